"""Distance by the shape that one camera sees of each whisk, against the truth of all cameras.

These rows see their own trial, so they stand in no table of the gauges' estimates: one_camera.csv.
Only where `--one-camera` asks for it.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun, Heading
from bench.analyses.cells import as_cell, value_cells, whisk_cells
from bench.analyses.pooling import column, coverage, grouped, rms
from bench.base.input_problems import in_one_status
from bench.base.tables import SURFACE, TRIAL, WHISK, Column, Kind, Table, status, with_sigma
from bench.records.trial_result import ByOneCamera, SeenWhisk, TrialResult, whisks
from estimator.uncertainty import Z_95
from vision import UNKNOWN, Value
from vision.geometry import counted

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
            "motion of the contact the way it is pushed: the truth",
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
    """One whisk as all cameras saw it, and its contact by the shape that one camera saw."""

    result: TrialResult
    seen: SeenWhisk
    by_one: ByOneCamera

    @property
    def error_mm(self) -> float:
        """Return the distance by the shape less the truth."""
        return float(self.by_one.d_x_mm.value - self.seen.d_x_mm.value)

    @property
    def error_sigma_mm(self) -> float:
        """Return the stated standard deviation of the error."""
        return math.hypot(self.by_one.d_x_mm.sigma, self.seen.d_x_mm.sigma)

    @property
    def inside(self) -> bool | None:
        """Return whether the error lies within its 95 % interval; None where it is not known."""
        if not np.isfinite(self.error_mm):
            return None
        return abs(self.error_mm) <= Z_95 * self.error_sigma_mm

    @property
    def moved_mm(self) -> Value:
        """Return how far the contact went the way it is pushed, by all cameras.

        That is the way of the unbent whisker less d_y.
        """
        at = self.seen.at
        if at is None:
            return UNKNOWN
        unbent_mm = self.seen.d_x_mm.value * np.tan(at.theta_rad)
        return Value(float(unbent_mm - at.d_y_mm.value), float(at.d_y_mm.sigma))


class OneCamera(Analysis):
    """How well one camera, without any gauge, locates the contact."""

    tables = (ONE_CAMERA,)
    in_every_run = False
    heading = Heading(
        "one_camera", "By one camera's pictures of its own trial, no gauge (one_camera.csv)"
    )

    def compute(self, run: EvaluatedRun) -> list[ShapeSeen]:
        """Return the shape of every whisk that was evaluated by one camera."""
        found = []
        for result, seen, _ in whisks(run.results):
            if seen.by_one_camera is not None:
                found.append(ShapeSeen(result, seen, seen.by_one_camera))
        return found

    def row(self, one: ShapeSeen) -> dict:
        """Return the row of a whisk."""
        seen = one.seen
        by_one = one.by_one
        return {
            **whisk_cells(one.result, seen.whisk),
            "camera": by_one.camera,
            **value_cells("touch_deg", seen.touch_rad),
            **value_cells("touch_est_deg", by_one.touch_rad),
            **value_cells("d_x_mm", seen.d_x_mm),
            **value_cells("d_x_est_mm", by_one.d_x_mm),
            "error_mm": one.error_mm,
            "error_percent": 100.0 * one.error_mm / float(seen.d_x_mm.value),
            "inside": as_cell(one.inside),
            **value_cells("moved_mm", one.moved_mm),
            **value_cells("moved_est_mm", by_one.moved_mm),
            **value_cells("force_N", by_one.force_N),
            "stiffness_N_mm": by_one.stiffness_N_mm,
            "stiffness_sigma_N_mm": by_one.stiffness_sigma_N_mm,
            "stiffness_low_N_mm": by_one.stiffness_low_N_mm,
            "status": in_one_status(seen.status, by_one.status),
        }

    def lines(self, found: Sequence[ShapeSeen]) -> Iterator[str]:
        """Yield a line a camera, over the whisks of which both distances are known."""
        for name, mine in grouped(found, lambda one: one.by_one.camera).items():
            known = [one for one in mine if one.inside is not None]
            if not known:
                yield f"{name}: none of {counted(len(mine), 'whisk')} has a distance"
                continue
            error_mm = rms(column(known, "error_mm"))
            stated_mm = rms(column(known, "error_sigma_mm"))
            yield (
                f"{name}: d_x off by {error_mm:.2g} mm RMS (stated {stated_mm:.2g}); "
                f"{coverage(known, 'whisk')}"
            )
