"""What the shape seen by one camera tells of each whisk, against the truth of all cameras: one_camera.csv.

These rows see their own trial, so they stand in no table of the gauges' estimates. Only where `--one-camera` asks.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.doubts import in_one_status
from bench.base.tables import SURFACE, TRIAL, WHISK, Column, Kind, Table, status, with_sigma
from bench.records.trial_result import ByOneCamera, SeenWhisk, TrialResult, whisks
from estimator.uncertainty import Z_95
from vision.geometry.counted import counted
from vision.truth.value import UNKNOWN, Value

ONE_CAMERA = Table(
    "one_camera",
    "A row a whisk, with `--one-camera NAME` ([sensors.md](sensors.md)). The one camera's values "
    "are from pictures of the trial itself; the truth is that of all cameras.",
    (
        TRIAL,
        WHISK,
        SURFACE,
        Column("camera", "name of the one camera", Kind.TEXT),
        *with_sigma("touch_deg", "first touch: the truth"),
        *with_sigma(
            "touch_est_deg", "first touch: where the one camera sees the whisker begin to bend"
        ),
        *with_sigma("d_x_mm", "distance: the truth"),
        *with_sigma("d_x_est_mm", "distance: where the one camera sees the bend end"),
        Column("error_mm", "d_x_est_mm less d_x_mm"),
        Column("error_percent", "that error, % of the truth"),
        Column("inside", "1 where 1.96 sigma of both hold that error, else 0"),
        *with_sigma(
            "moved_mm",
            "how far the contact has gone the way it is pushed, by slip along a slope or because "
            "the object gives way: the truth",
        ),
        *with_sigma("moved_est_mm", "the same by the one camera"),
        *with_sigma("force_N", "across the whisker in the whisking plane"),
        *with_sigma(
            "stiffness_N_mm",
            "that force over moved_est_mm; empty where moved_est_mm is within its noise",
            "stiffness_sigma_N_mm",
        ),
        Column("stiffness_low_N_mm", "the stiffness is no less than that, at 97.5 %"),
        status("of the truth, and why something is not known"),
    ),
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
        ONE_CAMERA.write(out, map(_row, found))


def _row(one: ShapeSeen) -> dict:
    """Return the row of a whisk."""
    seen = one.seen
    said = one.said
    return {
        "trial": one.result.trial.name,
        "whisk": seen.whisk,
        "surface": one.result.trial.surface,
        "camera": said.camera,
        "touch_deg": float(np.degrees(seen.touch_rad.value)),
        "touch_sigma_deg": float(np.degrees(seen.touch_rad.sigma)),
        "touch_est_deg": float(np.degrees(said.touch_rad.value)),
        "touch_est_sigma_deg": float(np.degrees(said.touch_rad.sigma)),
        "d_x_mm": float(seen.d_x_mm.value),
        "d_x_sigma_mm": float(seen.d_x_mm.sigma),
        "d_x_est_mm": float(said.d_x_mm.value),
        "d_x_est_sigma_mm": float(said.d_x_mm.sigma),
        "error_mm": one.error_mm,
        "error_percent": 100.0 * one.error_mm / float(seen.d_x_mm.value),
        "inside": None if one.inside is None else int(one.inside),
        "moved_mm": float(one.moved_mm.value),
        "moved_sigma_mm": float(one.moved_mm.sigma),
        "moved_est_mm": float(said.moved_mm.value),
        "moved_est_sigma_mm": float(said.moved_mm.sigma),
        "force_N": said.force_N.value,
        "force_sigma_N": said.force_N.sigma,
        "stiffness_N_mm": said.stiffness_N_mm,
        "stiffness_sigma_N_mm": said.stiffness_sigma_N_mm,
        "stiffness_low_N_mm": said.stiffness_low_N_mm,
        "status": in_one_status(seen.status, said.status),
    }


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
