"""What analyses have in common: whisks by group, errors pooled over whisks, cells of a row."""

import math
from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Sequence
from operator import attrgetter
from typing import Any, TypeVar

import numpy as np

from bench.base.tables import sigma_name
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.trials.estimate_errors import is_sound
from vision import Value
from vision.geometry import counted

Item = TypeVar("Item")
Key = TypeVar("Key", bound=Hashable)
# [°] Half of the step of 5° that a protractor sets: slopes nearer than that are one. Stated.
_SAME_SLOPE_DEG = 2.5


def grouped(items: Iterable[Item], key: Callable[[Item], Key]) -> dict[Key, list[Item]]:
    """Return the items by their key, keys in the order in which they come."""
    groups: dict[Key, list[Item]] = {}
    for item in items:
        groups.setdefault(key(item), []).append(item)
    return groups


def by_slope(items: Iterable[Item], slope_deg: Callable[[Item], float]) -> list[list[Item]]:
    """Return the items in groups of alike slope, the flattest first."""
    groups: list[list[Item]] = []
    for item in sorted(items, key=slope_deg):
        if groups and slope_deg(item) - slope_deg(groups[-1][0]) < _SAME_SLOPE_DEG:
            groups[-1].append(item)
        else:
            groups.append([item])
    return groups


def measured(results: Iterable[TrialResult]) -> list[TrialResult]:
    """Return the results of trials that measure, leaving out those that calibrate gauges."""
    return [result for result in results if result.trial.purpose == "measure"]


def sound_measured_whisks(
    results: Iterable[TrialResult],
) -> Iterator[tuple[TrialResult, SeenWhisk, FeltWhisk]]:
    """Yield the whisks of trials that measure, seen and felt, without a warning."""
    for result, seen, felt in whisks(measured(results)):
        if is_sound(seen, felt):
            yield result, seen, felt


def column(items: Iterable[Any], name: str) -> np.ndarray:
    """Return an attribute of all items, such as "d_x_mm.value", as an array (items, ...)."""
    return np.array([*map(attrgetter(name), items)])


def mean(values: Sequence[float]) -> float:
    """Return the mean; NaN of nothing."""
    return float(np.mean(values)) if len(values) else np.nan


def rms(values: Iterable[float]) -> float:
    """Return the root mean square; NaN of nothing."""
    squares = np.square(list(values))
    return float(np.sqrt(np.mean(squares))) if len(squares) else np.nan


def coverage(estimates: Collection[Any], noun: str) -> str:
    """Return of how many estimates, each of one `noun`, the 95 % interval holds the truth."""
    inside = sum(bool(one.inside) for one in estimates)
    return f"its 95 % interval holds {inside} of {counted(len(estimates), noun)}"


def known_rows(rows: Iterable[Iterable[float]], columns: int) -> tuple[np.ndarray, int]:
    """Return the rows of numbers that are all finite (n, columns), and how many are not."""
    table = np.array([list(row) for row in rows], dtype=float).reshape(-1, columns)
    is_known = np.isfinite(table).all(axis=1)
    return table[is_known], int(np.sum(~is_known))


def value_cells(column: str, value: Value) -> dict[str, float]:
    """Return the cells of a value and of its standard deviation; of an angle, in rad, the degrees."""
    shown = value.in_degrees() if column.endswith("_deg") else value
    return {column: float(shown.value), sigma_name(column): float(shown.sigma)}


def whisk_cells(result: TrialResult, whisk: int) -> dict:
    """Return the cells by which tables name a whisk; a table takes those that it has columns for."""
    trial = result.trial
    return {
        "trial": trial.name,
        "whisk": whisk,
        "surface": trial.surface,
        "speed_deg_s": trial.speed_deg_s,
    }


def estimate_cells(estimate: EstimateRow, truth: Value) -> dict:
    """Return the cells of an estimate, of the true distance and of their difference."""
    return {
        "estimator": estimate.estimator,
        "alpha_est_deg": degrees(estimate.alpha_est_rad),
        "beta_est_deg": degrees(estimate.beta_est_rad),
        **value_cells("d_x_est_mm", estimate.d_x_est_mm),
        "d_x_est_low_mm": estimate.d_x_est_low_mm,
        "d_x_est_high_mm": estimate.d_x_est_high_mm,
        **value_cells("d_x_mm", truth),
        "error_mm": estimate.error_mm(truth).value,
        "error_percent": estimate.error_percent(truth).value,
        "inside": as_cell(estimate.holds(truth.value)),
    }


def degrees(angle_rad: float) -> float:
    """Return an angle in degrees as a plain number."""
    return math.degrees(angle_rad)


def as_cell(is_inside: bool | None) -> int | None:
    """Return the cell of whether an interval holds the truth; empty where that is not known."""
    return None if is_inside is None else int(is_inside)


def panel_title(surface: str, speed_deg_s: float | None) -> str:
    """Return surface and speed in words."""
    name = surface or "surface not named"
    return name if speed_deg_s is None else f"{name}, {speed_deg_s:g}°/s"
