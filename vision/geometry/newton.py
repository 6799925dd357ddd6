"""The least value of a smooth function of a few parameters, by Newton's method with derivatives from differences."""

from collections.abc import Callable, Sequence

import numpy as np

# [steps] Ends before. Not measured.
_MOST_STEPS = 12
# [px⁻²] What the pictures do not tell is told to half a pixel by nothing. Stated.
_LEAST_CURVATURE = 4.0


def descend(
    function: Callable,
    begin: np.ndarray,
    steps: np.ndarray,
    longest: np.ndarray,
    settled: float,
    parts: Sequence[float] = (1.0, 0.3),
) -> tuple[np.ndarray, float, np.ndarray]:
    """Where the function is least near `begin` (n,), its value there, and its second derivatives (n, n).

    steps (n,): of the differences; longest (n,): a Newton step goes no farther. Ends when no part of a step is more
    than `settled`, or nothing lower is found by any of the parts of a step.
    """
    q, here = np.asarray(begin, dtype=float), function(begin)
    for _ in range(_MOST_STEPS):
        slope, curvature = _derivatives(function, q, here, steps)
        step = _downhill(slope, curvature, longest)
        trials = [(function(q + step * part), q + step * part) for part in parts]
        lower, there = min(trials, key=lambda trial: trial[0])
        if lower >= here:
            break
        moved, q, here = np.max(np.abs(there - q)), there, lower
        if moved < settled:
            break
    return q, here, curvature


def covariance_of(curvature: np.ndarray, misfit: float, pixels: float) -> np.ndarray:
    """Covariance (n, n) of the parameters at the least mean chi² of so many pixels, from noise alone."""
    values, vectors = np.linalg.eigh(0.5 * pixels * curvature / max(misfit, 1.0))
    return vectors @ np.diag(1.0 / np.maximum(values, _LEAST_CURVATURE)) @ vectors.T


def _derivatives(function, q, here: float, steps) -> tuple[np.ndarray, np.ndarray]:
    """Gradient (n,) and second derivatives (n, n) by central differences; 2n + n(n-1)/2 evaluations."""
    step = np.diag(steps)
    ahead, behind = (np.array([function(q + sign * row) for row in step]) for sign in (1, -1))
    curvature = np.diag(ahead + behind - 2.0 * here)
    for i in range(len(q)):
        for j in range(i):
            both = function(q + step[i] + step[j])
            curvature[i, j] = curvature[j, i] = both - ahead[i] - ahead[j] + here
    return (ahead - behind) / (2.0 * steps), curvature / np.outer(steps, steps)


def _downhill(slope, curvature, longest) -> np.ndarray:
    """Newton's step, turned downhill where the curvature is not positive, and not longer than allowed."""
    values, vectors = np.linalg.eigh(curvature)
    values = np.maximum(np.abs(values), 1e-3 * np.max(np.abs(values)))
    step = -vectors @ ((vectors.T @ slope) / values)
    return step / max(1.0, np.max(np.abs(step) / longest))


def cauchy_weights(residual: np.ndarray, scale: float) -> np.ndarray:
    """Weights of least squares by which a residual counts as under a Cauchy distribution of this scale."""
    return 1.0 / (1.0 + (residual / scale) ** 2)


def settle(rows_of: Callable, prior: np.ndarray, steps: np.ndarray, rounds: int) -> np.ndarray:
    """The parameters (k,) that leave the least, by Gauss–Newton from 0: rows_of gives at such parameters what is left
    (n,) and its columns (n, k), in pieces. prior (k,): their sigmas about 0. Ends with a step below `steps` (k,)."""
    vector = np.zeros(len(prior))
    for _ in range(rounds):
        rows = [*rows_of(vector), (-vector / prior, np.diag(1.0 / prior))]
        left, jacobian = (np.concatenate(part) for part in zip(*rows))
        step = np.linalg.lstsq(jacobian, left, rcond=None)[0]
        vector = vector + step
        if np.all(np.abs(step) < steps):
            break
    return vector
