"""Error of (10) over slope and friction: measured cells, and what (13), (14) predict for the same α and α_est.

A whisk's friction is its surface's: α as seen, where pictures show it, else as Fig. 8's fit has it. Cells in which
nothing was measured stay empty.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bench.analyses.friction_tables import SurfaceFriction
from bench.base.drawing import blank, is_drawn, save, style
from bench.base.results import hash_of
from bench.base.tables import Column, Kind, Table, alike
from bench.records.trial_result import TrialResult
from bench.trials.estimate_errors import judge
from estimator.threshold import distance_error
from vision.geometry.counted import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAME = "error_map"
ERROR_MAP = Table(
    NAME,
    "A row a cell of slope and friction with whisks in it.",
    (
        *alike(("beta_from_deg", "beta_to_deg", "alpha_from_deg", "alpha_to_deg"), "the cell"),
        Column("whisks", "how many whisks in it", Kind.WHOLE),
        Column("error_percent", "error of (10), mean"),
        Column("error_sd_percent", "error of (10), standard deviation"),
        Column("predicted_percent", "error by (13) and (14)"),
    ),
)
_BETA_DEG, _ALPHA_DEG = (
    5.0,
    2.5,
)  # sizes of a cell; slopes of 0, 5, 10 … lie in the middles of theirs
_STEEPEST_DEG = 82.5  # °: the map's edge, the upper end of the cell of 80°


@dataclass(frozen=True)
class Cell:
    """Whisks of alike slope and friction: lower edges of the cell, each whisk's error and prediction, per cent."""

    beta_deg: float
    alpha_deg: float
    errors: np.ndarray
    predicted: np.ndarray


def write_error_map(
    out: Path,
    results: Sequence[TrialResult],
    friction: Sequence[SurfaceFriction],
    alpha_est_rad: float,
    *,
    drawn: bool = True,
) -> list[str]:
    """error_map.csv, and error_map.png where there is a cell and it is to be `drawn`. Names of the pictures."""
    cells = measured_cells(results, friction, alpha_est_rad)
    ERROR_MAP.write(out, map(_row, cells))
    if not cells or not drawn:
        return []
    path, stamp = (
        out / f"{NAME}.png",
        hash_of([vars(cell) for cell in cells], alpha_est_rad, ERROR_MAP.names),
    )
    if not is_drawn(path, stamp):
        with style():
            save(draw_error_map(cells, alpha_est_rad, typical_taper(friction)), path, stamp)
    return [path.name]


def measured_cells(
    results: Sequence[TrialResult], friction: Sequence[SurfaceFriction], alpha_est_rad: float
) -> list[Cell]:
    """The cells that hold a whisk, by slope and friction."""
    cells: dict[tuple, list[tuple[float, float]]] = {}
    for beta_deg, alpha_rad, error, share in _whisks(results, friction):
        half = 0.5 * _BETA_DEG
        edges = (
            _edge(abs(beta_deg) + half, _BETA_DEG) - half,
            _edge(np.degrees(alpha_rad), _ALPHA_DEG),
        )
        predicted = 100.0 * float(
            share(distance_error(np.radians(abs(beta_deg)), alpha_rad, alpha_est_rad))
        )
        cells.setdefault(edges, []).append((error, predicted))
    return [Cell(*edges, *np.array(values).T) for edges, values in sorted(cells.items())]


def _edge(value: float, size: float) -> float:
    return float(np.floor(value / size) * size)


def _whisks(results: Sequence[TrialResult], friction: Sequence[SurfaceFriction]) -> Iterator[tuple]:
    """(β in degrees, α in rad, error in per cent) of every whisk for which all three are known, and how its whisker's
    taper changes a relative error."""
    judged = (j for j in judge(results) if j.estimator == "with_friction")
    errors = {(j.trial, j.whisk): j for j in judged if not (j.one_factor or j.doubtful)}
    for surface in friction:
        seen, fitted = surface.alpha("seen")[0], surface.alpha("least_squares")[0]
        alpha = seen if np.isfinite(seen) else fitted
        mine = (errors[whisk.key] for whisk in surface.whisks if whisk.key in errors)
        known = (
            j
            for j in mine
            if np.isfinite([alpha, j.beta_deg, j.error_percent]).all() and alpha >= 0
        )
        of_taper = surface.surface.beam.error_share
        yield from (
            (j.beta_deg, alpha, j.error_percent, partial(of_taper, j.d_x_mm)) for j in known
        )


def _row(cell: Cell) -> dict:
    many = len(cell.errors) > 1
    return {
        "beta_from_deg": max(cell.beta_deg, 0.0),
        "beta_to_deg": cell.beta_deg + _BETA_DEG,
        "alpha_from_deg": cell.alpha_deg,
        "alpha_to_deg": cell.alpha_deg + _ALPHA_DEG,
        "whisks": len(cell.errors),
        "error_percent": float(cell.errors.mean()),
        "error_sd_percent": float(cell.errors.std(ddof=1)) if many else None,
        "predicted_percent": float(cell.predicted.mean()),
    }


def typical_taper(found: Sequence[SurfaceFriction]) -> Callable:
    """How the whisker's taper changes a relative error at the session's median distance."""
    surfaces = [s.surface for s in found]
    return partial(
        surfaces[0].beam.error_share, float(np.median([s.common_d_x_mm for s in surfaces]))
    )


def draw_error_map(
    cells: Sequence[Cell], alpha_est_rad: float, of_taper: Callable = np.asarray
) -> "Figure":
    """Measured on the left, predicted for the whole field on the right, in one scale of colours.

    of_taper: makes of a relative error on a cylinder that on the whisker.
    """
    figure = blank(9.6, 3.9)
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    most = max(10.0, *(abs(c.errors.mean()) for c in cells))
    top = max(30.0, *(c.alpha_deg + _ALPHA_DEG for c in cells))
    look = {"cmap": "RdBu_r", "vmin": -most, "vmax": most}
    measured, beta, alpha = _field(cells, top)
    mesh = left.pcolormesh(beta, alpha, measured, **look)
    _tell(left, cells, most)
    slopes, angles = np.meshgrid(np.linspace(0.0, _STEEPEST_DEG, 166), np.linspace(0.0, top, 121))
    predicted = 100.0 * of_taper(
        distance_error(np.radians(slopes), np.radians(angles), alpha_est_rad)
    )
    right.pcolormesh(
        slopes, angles, np.clip(predicted, -most, most), shading="nearest", rasterized=True, **look
    )
    for axes, title in ((left, _measured(cells)), (right, "predicted by (13), (14)")):
        axes.set(xlabel="slope β  [°]", title=title, xlim=(-2.5, _STEEPEST_DEG), ylim=(0.0, top))
        axes.axhline(np.degrees(alpha_est_rad), color="black", lw=0.8, ls=":")
    left.set_ylabel("friction angle α  [°]")
    left.text(80.0, np.degrees(alpha_est_rad), "α$_{est}$", va="bottom", ha="right", fontsize=8)
    figure.colorbar(mesh, ax=[left, right], label="error of d$_x$ by (10)  [%]", extend="both")
    return figure


def _measured(cells: Sequence[Cell]) -> str:
    """The title says how many whisks the map rests on, and that empty cells are empty."""
    counts = [len(cell.errors) for cell in cells]
    fewest, most = min(counts), max(counts)
    each = f"{fewest} a cell" if fewest == most else f"{fewest} to {most} a cell"
    return f"measured: {counted(sum(counts), 'whisk')}, {each}; blank: none"


def _field(cells: Sequence[Cell], top: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean errors (a, b), NaN where nothing was measured, and the cells' edges."""
    steepest = max(_STEEPEST_DEG, *(cell.beta_deg for cell in cells))
    beta = np.arange(-0.5 * _BETA_DEG, steepest + 1.5 * _BETA_DEG, _BETA_DEG)
    alpha = np.arange(0.0, top + _ALPHA_DEG, _ALPHA_DEG)
    field = np.full((len(alpha) - 1, len(beta) - 1), np.nan)
    for cell in cells:
        field[np.searchsorted(alpha, cell.alpha_deg), np.searchsorted(beta, cell.beta_deg)] = (
            cell.errors.mean()
        )
    return field, beta, alpha


def _tell(axes: "Axes", cells: Sequence[Cell], most: float) -> None:
    """Each cell's mean error in figures, light on the dark ends of the scale."""
    for cell in cells:
        colour = "white" if abs(cell.errors.mean()) > 0.6 * most else "black"
        middle = cell.beta_deg + 0.5 * _BETA_DEG, cell.alpha_deg + 0.5 * _ALPHA_DEG
        said = f"{cell.errors.mean():+.1f}".replace("-", "−").replace("−0.0", "0.0")
        axes.text(
            *middle,
            said,
            ha="center",
            va="center",
            fontsize=6 if len(said) < 5 else 5,
            color=colour,
        )
