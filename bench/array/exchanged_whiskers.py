"""Whiskers of an array whose wires, or signals, are each other's: each feels its touch when the other's is seen."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np
from scipy.special import chdtrc

from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.trials.differences import LEAST_CHANCE

Whisk = tuple[SeenWhisk, FeltWhisk]


def exchanged(results: Mapping[str, Sequence[TrialResult]]) -> Iterator[str]:
    """A line for each two whiskers that look exchanged in their whisks. results: by whisker."""
    both = {name: _known(mine) for name, mine in results.items()}
    for one, other in combinations(both, 2):
        pairs = [(both[one][key], both[other][key]) for key in both[one] if key in both[other]]
        if pairs and not _agree(pairs, crossed=False) and _agree(pairs, crossed=True):
            yield (
                f"{one} and {other} look exchanged: each touches, as felt, when the other does, as seen; check their "
                "base_mm and channels"
            )


def _known(results: Sequence[TrialResult]) -> dict[tuple[str, int], Whisk]:
    """Whisks whose touch is both felt and seen."""
    return {
        (result.trial.name, seen.whisk): (seen, felt)
        for result, seen, felt in whisks(results)
        if np.isfinite(seen.touch_rad.sigma) and np.isfinite(felt.touch_felt_rad.sigma)
    }


def _agree(pairs: Sequence[tuple[Whisk, Whisk]], *, crossed: bool) -> bool:
    """Whether felt and seen touches of both whiskers are the same, each with its own or each with the other's."""
    square = 0.0
    for (seen, felt), (other_seen, other_felt) in pairs:
        felts = (other_felt, felt) if crossed else (felt, other_felt)
        square += sum(_square(*one) for one in zip((seen, other_seen), felts))
    return bool(chdtrc(2 * len(pairs), square) >= LEAST_CHANCE)


def _square(seen: SeenWhisk, felt: FeltWhisk) -> float:
    """Of the difference, over its variance: without what the felt touches themselves add to that of the seen one."""
    touch, own = felt.touch_felt_rad, seen.touch_rad.sigma**2 - seen.touch_shared_rad**2
    return (touch.value - seen.touch_rad.value) ** 2 / (touch.sigma**2 + own)
