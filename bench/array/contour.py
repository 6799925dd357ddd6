"""The contour of an object by touch alone, as a binary whisker or a rigid rod has it: contour.csv.

Of each whisker the angle of first touch serves, and nothing else (`estimator.contour`). Whiskers whose bases and
directions are level and equally high see one section of the object.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.analyses.pooling import column, grouped, rms
from bench.array.cloud import ContactPoint
from bench.array.shape_verdict import FELT
from bench.array.size import one_a_whisker
from bench.array.surface import ObjectSurface
from bench.base.tables import TRIAL, WHISKER, Column, Table, alike
from estimator.contour import Contour, TouchingLines, contour
from vision.geometry import counted

CONTOUR = Table(
    "contour",
    "Of an array all round an object: a row an edge of what whiskers at first touch enclose.",
    (
        TRIAL,
        WHISKER,
        *alike(("x_mm", "y_mm", "z_mm"), "middle of the edge, rig frame"),
        Column("across_sigma_mm", "of the edge there"),
        Column("resolution_mm", "length of the edge: the contact is somewhere on it"),
        *alike(("corner_x_mm", "corner_y_mm"), "its end"),
        Column("corner_sigma_mm", "of that, outwards"),
        *alike(("outside_mm", "corner_outside_mm"), "how far off the stated object"),
    ),
)
# [1] Largest height that a level whisker gains over its length. Stated.
_LEVEL = 1e-3
# [mm] Steps of height within which whiskers see one section. Stated.
_HEIGHT_MM = 0.01


@dataclass(frozen=True, eq=False)
class TrialContour:
    """A section of a trial's object: whiskers (k,) by name, their polygon, its height, and distances (k,) from the object."""

    trial: str
    whiskers: tuple[str, ...]
    height_mm: float
    polygon: Contour
    outside_mm: np.ndarray
    corner_outside_mm: np.ndarray

    def rows(self) -> Iterator[dict]:
        """Yield the rows of CONTOUR."""
        polygon = self.polygon
        for number, whisker in enumerate(self.whiskers):
            yield {
                "trial": self.trial,
                "whisker": whisker,
                "x_mm": polygon.middle_mm[number, 0],
                "y_mm": polygon.middle_mm[number, 1],
                "z_mm": self.height_mm,
                "across_sigma_mm": polygon.middle_sigma_mm[number],
                "resolution_mm": polygon.edge_mm[number],
                "outside_mm": self.outside_mm[number],
                "corner_x_mm": polygon.corner_mm[number, 0],
                "corner_y_mm": polygon.corner_mm[number, 1],
                "corner_sigma_mm": polygon.corner_sigma_mm[number],
                "corner_outside_mm": self.corner_outside_mm[number],
            }

    def line(self) -> str:
        """Return its line of the summary."""
        edges = counted(len(self.whiskers), "edge")
        text = f"{self.trial}: {edges} of {self.polygon.edge_mm.mean():.3g} mm"
        if np.isnan(self.outside_mm).any():
            return text
        middles = f"off the object by {rms(self.outside_mm):.2g} mm RMS at their middles"
        return f"{text}, {middles}, {rms(self.corner_outside_mm):.2g} mm at corners"


def contours(
    cloud: Sequence[ContactPoint], surfaces: dict[str, ObjectSurface]
) -> list[TrialContour]:
    """Return the sections that whiskers enclose, by trial and height."""
    level = []
    for one in cloud:
        if one.estimator == FELT and one.has_touch and abs(one.direction[2]) < _LEVEL:
            level.append(one)
    found = []
    for (trial, step), mine in grouped(level, _section).items():
        mine = one_a_whisker(mine)
        polygon = contour(_lines(mine))
        if isinstance(polygon, Contour):
            names = tuple(mine[number].whisker for number in polygon.line)
            height_mm = step * _HEIGHT_MM
            surface = surfaces.get(trial)
            middles_off_mm = _outside_mm(polygon.middle_mm, height_mm, surface)
            corners_off_mm = _outside_mm(polygon.corner_mm, height_mm, surface)
            found.append(
                TrialContour(trial, names, height_mm, polygon, middles_off_mm, corners_off_mm)
            )
    return found


def _section(one: ContactPoint) -> tuple[str, int]:
    """Return trial and height, in steps, of a level whisker."""
    return one.trial, round(float(one.base_mm[2]) / _HEIGHT_MM)


def _lines(mine: Sequence[ContactPoint]) -> TouchingLines:
    """Return the lines of whiskers at first touch.

    Touch alone does not say where along a whisker the contact is, nor so the radius there: it is anything
    between those of base and tip.
    """
    direction = column(mine, "direction")
    arc_mm = column(mine, "arc_mm")
    normal = np.stack([-direction[:, 1], direction[:, 0]], axis=-1)
    covariance = column(mine, "covariance_mm2")[:, :2, :2]
    across_mm = np.sqrt(np.einsum("ni,nij,nj->n", normal, covariance, normal))
    base_radius_mm = np.array([one.wire.radius_mm(0.0) for one in mine])
    tip_radius_mm = np.array([one.wire.radius_mm(one.wire.length_mm) for one in mine])
    return TouchingLines(
        column(mine, "base_mm")[:, :2],
        np.arctan2(direction[:, 1], direction[:, 0]),
        across_mm / arc_mm,
        0.5 * (base_radius_mm + tip_radius_mm),
        (base_radius_mm - tip_radius_mm) / np.sqrt(12.0),
    )


def _outside_mm(
    points_mm: np.ndarray, height_mm: float, surface: ObjectSurface | None
) -> np.ndarray:
    """Return the distances (k,) of points (k, 2) at a height from the object; NaN where none is stated."""
    if surface is None:
        return np.full(len(points_mm), np.nan)
    in_rig = np.column_stack([points_mm, np.full(len(points_mm), height_mm)])
    return surface.distance_mm(in_rig)[0]


def write_contours(out: Path, found: Sequence[TrialContour]) -> None:
    """Write contour.csv where there is any contour."""
    rows = []
    for one in found:
        rows += one.rows()
    if rows:
        CONTOUR.write(out, rows)
