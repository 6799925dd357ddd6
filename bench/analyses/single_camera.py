"""What the shape seen by one camera tells of each whisk, against the truth of all cameras: one_camera.csv.

These rows see their own trial, so they stand in no table of the gauges' estimates. Only where `--one-camera` asks.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.doubts import in_one_status
from bench.base.tables import write_table
from bench.records.trial_result import ByOneCamera, SeenWhisk, TrialResult, whisks
from estimator.uncertainty import Z_95
from vision.geometry.counted import counted
from vision.truth.value import UNKNOWN, Value

TABLE = "one_camera.csv"
COLUMNS = (
    *(
        "trial",
        "whisk",
        "surface",
        "camera",
        "touch_deg",
        "touch_sigma_deg",
        "touch_est_deg",
        "touch_est_sigma_deg",
    ),
    *(
        "d_x_mm",
        "d_x_sigma_mm",
        "d_x_est_mm",
        "d_x_est_sigma_mm",
        "error_mm",
        "error_percent",
        "inside",
    ),
    *(
        "moved_mm",
        "moved_sigma_mm",
        "moved_est_mm",
        "moved_est_sigma_mm",
        "force_N",
        "force_sigma_N",
    ),
    *("stiffness_N_mm", "stiffness_sigma_N_mm", "stiffness_low_N_mm", "status"),
)


@dataclass(frozen=True, eq=False)
class ShapeSeen:
    """One whisk as all cameras saw it, and what one camera's shape says of it."""

    result: TrialResult
    seen: SeenWhisk
    said: ByOneCamera

    @property
    def error_mm(self) -> float:
        """Distance by the shape less the truth."""
        return float(self.said.d_x_mm.value - self.seen.d_x_mm.value)

    @property
    def sigma_mm(self) -> float:
        """Stated sigma of that."""
        return float(np.hypot(self.said.d_x_mm.sigma, self.seen.d_x_mm.sigma))

    @property
    def inside(self) -> bool | None:
        """Whether the error lies within its 95 % interval; None where either distance is not known."""
        return abs(self.error_mm) <= Z_95 * self.sigma_mm if np.isfinite(self.error_mm) else None

    @property
    def moved_mm(self) -> Value:
        """How far the contact went the way it is pushed, by all cameras: that of the unbent whisker less d_y."""
        at = self.seen.at
        if at is None:
            return UNKNOWN
        d_x, deflection = self.seen.d_x_mm, at.d_y_mm
        return Value(
            float(d_x.value * np.tan(at.theta_rad) - deflection.value), float(deflection.sigma)
        )


def shapes_seen(results: Sequence[TrialResult]) -> list[ShapeSeen]:
    """Of every whisk that was asked for; empty without `--one-camera`."""
    found = whisks(results)
    return [
        ShapeSeen(result, seen, seen.by_one_camera)
        for result, seen, _ in found
        if seen.by_one_camera is not None
    ]


def write_one_camera(out: Path, found: Sequence[ShapeSeen]) -> None:
    """one_camera.csv; nothing where no camera was asked for."""
    if found:
        write_table(out / TABLE, COLUMNS, map(_row, found))


def _row(one: ShapeSeen) -> dict:
    seen, said = one.seen, one.said
    row = {"trial": one.result.trial.name, "whisk": seen.whisk, "surface": one.result.trial.surface}
    for name, value in {"touch": seen.touch_rad, "touch_est": said.touch_rad}.items():
        row |= {
            f"{name}_deg": float(np.degrees(value.value)),
            f"{name}_sigma_deg": float(np.degrees(value.sigma)),
        }
    lengths = {
        "d_x": seen.d_x_mm,
        "d_x_est": said.d_x_mm,
        "moved": one.moved_mm,
        "moved_est": said.moved_mm,
    }
    for name, value in lengths.items():
        row |= {f"{name}_mm": float(value.value), f"{name}_sigma_mm": float(value.sigma)}
    row |= {
        "force_N": said.force_N.value,
        "force_sigma_N": said.force_N.sigma,
        "camera": said.camera,
    }
    row |= {
        name: getattr(said, name)
        for name in ("stiffness_N_mm", "stiffness_sigma_N_mm", "stiffness_low_N_mm")
    }
    row |= {
        "error_mm": one.error_mm,
        "error_percent": 100.0 * one.error_mm / float(seen.d_x_mm.value),
    }
    row["inside"] = None if one.inside is None else int(one.inside)
    return row | {"status": in_one_status(seen.status, said.status)}


def one_camera_lines(found: Sequence[ShapeSeen]) -> Iterator[str]:
    """For the summary: one line a camera, over the whisks of which both distances are known."""
    for name in dict.fromkeys(one.said.camera for one in found):
        mine = [one for one in found if one.said.camera == name]
        known = [one for one in mine if one.inside is not None]
        if not known:
            yield f"{name}: none of {counted(len(mine), 'whisk')} has a distance"
            continue
        errors, sigmas = (
            np.sqrt(np.mean(np.square(of)))
            for of in zip(*((k.error_mm, k.sigma_mm) for k in known))
        )
        yield (
            f"{name}: d_x off by {errors:.2g} mm RMS (stated {sigmas:.2g}); its 95 % interval holds "
            f"{sum(bool(one.inside) for one in known)} of {counted(len(known), 'whisk')}"
        )
