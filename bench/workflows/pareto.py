"""Fronts: the choices that no other beats, and those that are worth waiting for."""

from collections.abc import Iterable

import numpy as np

# [1] Least share by which a slower choice is expected to err less than any faster one, to be worth its time.
# Study: `whisker-bench robot fixtures/small-session`. Stated sigmas differ by 3 % between 8, 10 and
# 12 bits, which are alike.
_LEAST_GAIN = 0.05


def pareto_front(costs: np.ndarray) -> np.ndarray:
    """Return the mask (n,) of the choices that no other beats.

    costs (n, k): of each choice, the less the better. One choice beats another where it costs no
    more in any column, and less in one.
    """
    is_on_front = np.ones(len(costs), dtype=bool)
    for number, cost in enumerate(costs):
        no_worse = np.all(costs <= cost, axis=1)
        better = np.any(costs < cost, axis=1)
        is_on_front[number] = not np.any(no_worse & better)
    return is_on_front


def worth_waiting_for(errors: Iterable[float]) -> np.ndarray:
    """Return the mask (n,) of the choices that are expected to err clearly less than each faster one.

    errors (n,): of the choices, the fastest first; infinite of one that is none.
    """
    least = np.inf
    mask = []
    for error in errors:
        is_worth = error < (1.0 - _LEAST_GAIN) * least
        mask.append(is_worth)
        if is_worth:
            least = error
    return np.array(mask, dtype=bool)
