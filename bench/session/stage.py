"""stage.csv: where a stage has the touched object, on the signals' clock, in the rig frame."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.errors import BadInput
from bench.session.plausible import PLACE, PlausibleRange
from bench.session.table import NumberTable, forward_in_time, read_table, require_columns

STAGE = "stage.csv"
_TIME = "time_s"
_PLACES = ("x_mm", "y_mm", "z_mm")
# [mm] Of a stated sigma: no more than a place may be. Stated.
_SIGMA = PlausibleRange(0.0, PLACE.high)
_SIGMAS = ("x_sigma_mm", "y_sigma_mm", "z_sigma_mm")


@dataclass(frozen=True, eq=False)
class StageLog:
    """What a stage says: times (n,), places (n, 3) in mm with one standard deviation each.

    label: of its file, for messages.
    """

    label: str
    time_s: np.ndarray
    place_mm: np.ndarray
    sigma_mm: np.ndarray

    @property
    def moves(self) -> bool:
        """Return whether it says two different places."""
        return bool(np.any(self.place_mm != self.place_mm[0]))

    def covers(self, time_s: np.ndarray) -> bool:
        """Return whether all of these times lie within the log; one row holds at all times."""
        is_within = self.time_s[0] <= np.min(time_s) and np.max(time_s) <= self.time_s[-1]
        return len(self.time_s) == 1 or bool(is_within)

    def at(self, time_s: np.ndarray) -> np.ndarray:
        """Interpolate the places (..., 3) at times (...), mm."""
        return _interpolate(time_s, self.time_s, self.place_mm)

    def sigma_at(self, time_s: np.ndarray) -> np.ndarray:
        """Interpolate the standard deviations (..., 3) at times (...), mm."""
        return _interpolate(time_s, self.time_s, self.sigma_mm)


def read_stage(trial: Path, session: Path, place: str) -> StageLog | None:
    """Read the stage's log of a trial's folder, else of the session's; None where there is none.

    place: the trial's, in messages. Raises BadInput, naming file and row: what `read_table` refuses,
    missing columns, times that go back, places that are none, sigmas below 0.
    """
    for folder, label in ((trial, f"{place}/{STAGE}"), (session, STAGE)):
        if (folder / STAGE).is_file():
            return _read(folder / STAGE, label)
    return None


def _read(path: Path, label: str) -> StageLog:
    """Read one log. Raise BadInput."""
    columns = (_TIME, *_PLACES, *_SIGMAS)
    table = read_table(path, label, columns)
    require_columns(table, columns, label)
    table, _ = forward_in_time(table, _TIME, label)
    for name in _PLACES:
        _check(table, name, PLACE, label)
    for name in _SIGMAS:
        _check(table, name, _SIGMA, label)
    return StageLog(
        label,
        table[_TIME],
        np.stack([table[name] for name in _PLACES], axis=-1),
        np.stack([table[name] for name in _SIGMAS], axis=-1),
    )


def _check(table: NumberTable, name: str, allowed, label: str) -> None:
    """Raise BadInput for the first number of a column that is outside its range."""
    for row, value in zip(table.row, table[name]):
        if not allowed.holds(value):
            found = f"{value:g}; {allowed.allowed} is allowed.{allowed.guess(value)}"
            raise BadInput(found, file=label, row=int(row), column=name)


def _interpolate(time_s: np.ndarray, known_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Interpolate values (n, 3), known at times (n,), at times (...)."""
    return np.stack([np.interp(time_s, known_s, column) for column in values.T], axis=-1)
