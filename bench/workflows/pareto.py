"""Pareto front: the choices that no other choice beats."""

import numpy as np


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
