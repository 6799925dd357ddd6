"""angles_marker.csv and angles_whisker.csv of a trial: the motor's angle at each frame, by its pictures."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.atomic import write_whole
from bench.base.errors import BadInput
from bench.session.table import (
    read_table,
    refuse_where,
    require_columns,
    require_rising,
    require_rows,
)
from bench.session.trial import Trial

_COLUMNS = ("time_s", "motor_deg", "motor_sigma_deg", "share_sigma")


@dataclass(frozen=True, eq=False)
class FrameAngles:
    """The motor's angle in frames: times and angles (n,). sigma_deg (n,): of what each frame errs by
    alone. share_sigma: relative, of all differences together.
    """

    time_s: np.ndarray
    motor_deg: np.ndarray
    sigma_deg: np.ndarray
    share_sigma: float

    @classmethod
    def of_turns(
        cls, time_s: np.ndarray, motor_rad: np.ndarray, covariance: np.ndarray
    ) -> "FrameAngles":
        """Return angles (n,), rad, with a covariance (n, n) as errors of their own and a common share.

        A frame's own error is what the difference from its neighbours shows; what the difference of
        the extremes has beyond that is the share.
        """
        steps = np.diff(np.eye(len(motor_rad)), axis=0)  # (n - 1, n)
        of_steps = 0.5 * np.sum(steps @ covariance * steps, axis=1)  # rad²
        own = np.maximum(np.append(of_steps, 0.0), np.append(0.0, of_steps))
        low = int(np.argmin(motor_rad))
        high = int(np.argmax(motor_rad))
        between = covariance[low, low] + covariance[high, high] - 2.0 * covariance[low, high]
        beyond = max(between - own[low] - own[high], 0.0)
        share = float(np.sqrt(beyond) / np.ptp(motor_rad))
        return cls(time_s, np.degrees(motor_rad), np.degrees(np.sqrt(own)), share)


def angles_file(trial: Trial) -> Path:
    """Return the path of a trial's angles, by what they are seen."""
    return trial.own(f"angles_{trial.angle_from}.csv")


def read_angles(trial: Trial) -> FrameAngles:
    """Read the angles of a trial.

    Raises BadInput, naming file and row, where they are not there, times do not increase, or a sigma
    is below 0.
    """
    path = angles_file(trial)
    label = trial.label(path.name)
    if not path.is_file():
        cure = "run `whisker-bench calibrate angles` on this session"
        raise BadInput(f"is not there; {cure}", file=label)
    table = read_table(path, label)
    require_columns(table, _COLUMNS, label)
    require_rows(table, 2, "rows, one a frame", label)
    require_rising(table, "time_s", "times must increase", label)
    for column in ("motor_sigma_deg", "share_sigma"):
        refuse_where(table, column, table[column] < 0.0, "sigmas are 0 or more", label)
    return FrameAngles(
        table["time_s"],
        table["motor_deg"],
        table["motor_sigma_deg"],
        float(table["share_sigma"].max()),
    )


def write_angles(trial: Trial, angles: FrameAngles) -> None:
    """Write the angles of a trial whole."""
    lines = [",".join(_COLUMNS)]
    for row in zip(angles.time_s, angles.motor_deg, angles.sigma_deg):
        lines.append("{:.9g},{:.5f},{:.5f}".format(*row) + f",{angles.share_sigma:.3g}")
    write_whole(angles_file(trial), "\n".join(lines) + "\n")
