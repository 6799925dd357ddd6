"""Whisks by group, and errors pooled over them."""

from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Sequence
from operator import attrgetter
from typing import Any, TypeVar

import numpy as np

from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.trials.estimate_errors import is_sound
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


def rms_of_known(values: Iterable[float]) -> float:
    """Return the root mean square of the values that are finite; NaN of nothing."""
    return rms(value for value in values if np.isfinite(value))


def coverage(estimates: Collection[Any], noun: str) -> str:
    """Return of how many estimates, each of one `noun`, the 95 % interval holds the truth."""
    inside = sum(bool(one.inside) for one in estimates)
    return f"its 95 % interval holds {inside} of {counted(len(estimates), noun)}"


def known_rows(rows: Iterable[Iterable[float]], columns: int) -> tuple[np.ndarray, int]:
    """Return the rows of numbers that are all finite (n, columns), and how many are not."""
    table = np.array([list(row) for row in rows], dtype=float).reshape(-1, columns)
    is_known = np.isfinite(table).all(axis=1)
    return table[is_known], int(np.sum(~is_known))
