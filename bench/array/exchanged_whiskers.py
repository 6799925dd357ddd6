"""Whiskers of an array whose wires, or signals, are exchanged: each feels its touch when the other's
is seen."""

from collections.abc import Iterable, Iterator, Mapping
from itertools import combinations

import numpy as np
from scipy.special import chdtrc

from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.trials.differences import LEAST_CHANCE

_Touches = dict[tuple[str, int], tuple[SeenWhisk, FeltWhisk]]  # by trial and whisk


def exchanged(results: Mapping[str, Iterable[TrialResult]]) -> Iterator[str]:
    """Yield a line for each two whiskers that seem exchanged in their whisks.

    results: by whisker.
    """
    touches = {name: _known_touches(of_whisker) for name, of_whisker in results.items()}
    for one, other in combinations(touches, 2):
        common = [key for key in touches[one] if key in touches[other]]
        if not common or _agree(touches[one], touches[other], common, is_crossed=False):
            continue
        if _agree(touches[one], touches[other], common, is_crossed=True):
            yield (
                f"{one} and {other} look exchanged: each touches, as felt, when the other does, as seen; check their "
                "base_mm and channels"
            )


def _known_touches(results: Iterable[TrialResult]) -> _Touches:
    """Return the whisks whose touch is both felt and seen."""
    known = {}
    for result, seen, felt in whisks(results):
        if np.isfinite(seen.touch_rad.sigma) and np.isfinite(felt.touch_felt_rad.sigma):
            known[result.trial.name, seen.whisk] = seen, felt
    return known


def _agree(one: _Touches, other: _Touches, common: Iterable, *, is_crossed: bool) -> bool:
    """Return whether felt and seen touches of two whiskers agree, each with its own, or each with the
    other's.

    common: keys of the whisks that both have.
    """
    chi_square = 0.0
    count = 0
    for key in common:
        seen, felt = one[key]
        other_seen, other_felt = other[key]
        if is_crossed:
            felt, other_felt = other_felt, felt
        chi_square += _chi_square(seen, felt) + _chi_square(other_seen, other_felt)
        count += 2
    return bool(chdtrc(count, chi_square) >= LEAST_CHANCE)


def _chi_square(seen: SeenWhisk, felt: FeltWhisk) -> float:
    """Return the squared difference of felt and seen touch over its variance.

    The part of the seen touch's variance that felt touches add to it is not counted.
    """
    touch = felt.touch_felt_rad
    seen_variance = seen.touch_rad.sigma**2 - seen.touch_shared_rad**2
    return (touch.value - seen.touch_rad.value) ** 2 / (touch.sigma**2 + seen_variance)
