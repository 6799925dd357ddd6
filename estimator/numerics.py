"""Numerical methods that several estimators use: derivatives by differences, a march in steps."""

from collections.abc import Callable

import numpy as np

# [1] Step of central differences over the size of what is changed: they are off by its square,
# 1e-12, and by rounding over it, 1e-10. Derived.
RELATIVE_STEP = 1e-6


def central_differences(
    function: Callable[[np.ndarray], np.ndarray], inputs: np.ndarray, steps: np.ndarray
) -> np.ndarray:
    """Return the derivatives (..., k) of a function's values (...) by each of its inputs (k,).

    Each input goes to either side by its own step (k,).
    """
    derivatives = []
    for change, step in zip(np.diag(steps), steps):
        difference = function(inputs + change) - function(inputs - change)
        derivatives.append(difference / (2 * step))
    return np.stack(derivatives, axis=-1)


def steps_each_way(steps: np.ndarray) -> np.ndarray:
    """Return the steps (2k + 1, k) at which `differences` takes its values: none, each up by its own
    of steps (k,), and each down.
    """
    changes = np.diag(steps)
    return np.concatenate([np.zeros((1, len(steps))), changes, -changes])


def differences(values: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return the derivatives (m, k) of values (m, 2k + 1), taken at `steps_each_way` of steps (k,)."""
    count = len(steps)
    up = values[:, 1 : count + 1]
    down = values[:, count + 1 :]
    return (up - down) / (2 * steps)


def runge_kutta(
    gain: Callable[[float, np.ndarray], np.ndarray], state: np.ndarray, steps: int
) -> np.ndarray:
    """Return the end (...) of a march of so many steps from a state (...), by Runge and Kutta's
    method of fourth order.

    gain: returns what a state gains in a step by its rate at a place, counted in steps.
    """
    for place in range(steps):
        first = gain(place, state)
        second = gain(place + 0.5, state + 0.5 * first)
        third = gain(place + 0.5, state + 0.5 * second)
        last = gain(place + 1.0, state + third)
        state = state + (first + 2 * second + 2 * third + last) / 6
    return state
