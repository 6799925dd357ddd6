"""Newton's and Gauss–Newton's method for smooth functions of a few parameters."""

from collections.abc import Callable, Sequence

import numpy as np

from vision.geometry.refusals import Refused

# [steps] A descent that takes more does not converge: six to a bar's edges took 7 at most. Stated.
_MOST_STEPS = 50
# [px⁻²] A prior of half a pixel on what the pictures do not constrain. Stated.
_LEAST_CURVATURE = 4.0
# [sigmas] Scale of the Cauchy distribution that weighs residuals. Stated.
_CAUCHY_SIGMAS = 5.0


def descend(
    function: Callable,
    begin: np.ndarray,
    steps: np.ndarray,
    longest: np.ndarray,
    tolerance: float,
    parts: Sequence[float] = (1.0, 0.3),
) -> tuple[np.ndarray, float, np.ndarray]:
    """Minimise a function from `begin` (n,) by Newton's method with derivatives from differences.

    steps (n,): of the differences. longest (n,): limit of a Newton step. Each step is tried whole
    and in part, by the factors `parts`. Ends when no parameter changes by more than `tolerance`, or
    no part of a step is lower. Returns the minimum (n,), the value there, and the second
    derivatives (n, n). Raises Refused where it does not converge, or comes to where the function
    has no value.
    """
    point = np.asarray(begin, dtype=float)
    value = function(begin)
    for _ in range(_MOST_STEPS):
        slope, curvature = _derivatives(function, point, value, steps)
        _require_finite(curvature)
        step = _downhill(slope, curvature, longest)
        trials = [(function(point + step * part), part) for part in parts]
        lower, part = min(trials, key=lambda trial: trial[0])
        if lower >= value:
            return point, value, curvature
        point = point + step * part
        value = lower
        if np.max(np.abs(step * part)) < tolerance:
            return point, value, curvature
    raise not_converged(_MOST_STEPS)


def _require_finite(curvature: np.ndarray) -> None:
    """Raise Refused where a function has no value about a point."""
    if not np.all(np.isfinite(curvature)):
        sentence = "a fit to the pictures left the pixels that could determine it"
        raise Refused(sentence, code="fit_not_converged")


def not_converged(steps: int) -> Refused:
    """Return the refusal of a fit that has not converged in so many steps."""
    sentence = f"a fit to the pictures did not converge in {steps} steps"
    return Refused(sentence, code="fit_not_converged")


def covariance_of(curvature: np.ndarray, misfit: float, pixels: float) -> np.ndarray:
    """Return the covariance (n, n) of the parameters at the least mean chi² of so many pixels, from
    noise alone.
    """
    values, vectors = np.linalg.eigh(0.5 * pixels * curvature / max(misfit, 1.0))
    return vectors @ np.diag(1.0 / np.maximum(values, _LEAST_CURVATURE)) @ vectors.T


def _derivatives(function, point, value: float, steps) -> tuple[np.ndarray, np.ndarray]:
    """Return gradient (n,) and second derivatives (n, n) by central differences, from
    2n + n(n − 1)/2 evaluations.
    """
    step = np.diag(steps)
    ahead = np.array([function(point + row) for row in step])
    behind = np.array([function(point - row) for row in step])
    curvature = np.diag(ahead + behind - 2.0 * value)
    for i in range(len(point)):
        for j in range(i):
            both = function(point + step[i] + step[j])
            curvature[i, j] = both - ahead[i] - ahead[j] + value
            curvature[j, i] = curvature[i, j]
    return (ahead - behind) / (2.0 * steps), curvature / np.outer(steps, steps)


def _downhill(slope, curvature, longest) -> np.ndarray:
    """Return Newton's step (n,), turned downhill where the curvature is not positive, within
    `longest`.
    """
    values, vectors = np.linalg.eigh(curvature)
    values = np.maximum(np.abs(values), 1e-3 * np.max(np.abs(values)))
    step = -vectors @ ((vectors.T @ slope) / values)
    return step / max(1.0, np.max(np.abs(step) / longest))


def cauchy_weights(residual: np.ndarray, scale: float) -> np.ndarray:
    """Return the weights of least squares that make residuals count as under a Cauchy distribution
    of this scale.
    """
    return 1.0 / (1.0 + (residual / scale) ** 2)


def gauss_newton(
    residuals_of: Callable,
    prior: np.ndarray,
    steps: np.ndarray,
    rounds: int,
    scale: float = _CAUCHY_SIGMAS,
) -> tuple[np.ndarray, bool]:
    """Fit parameters (k,) by Gauss–Newton's method from 0, with Cauchy weights.

    residuals_of: function of parameters (k + 1, k) that returns residuals (k + 1, n), in sigmas.
    prior (k,): standard deviations about 0. steps (k,): of the differences that give derivatives.
    scale: of the Cauchy distribution, in sigmas. Ends with a step below `steps`, or after so many
    rounds; the second value returned is whether it has converged.
    """
    parameters = np.zeros(len(prior))
    differences = np.vstack([np.zeros(len(prior)), np.diag(steps)])
    for _ in range(rounds):
        residual, *moved = residuals_of(parameters + differences)
        root_weight = np.sqrt(cauchy_weights(residual, scale))
        jacobian = (np.array(moved) - residual).T / steps  # (n, k)
        rows = np.vstack([root_weight[:, None] * jacobian, np.diag(1.0 / prior)])
        weighted = np.append(root_weight * residual, parameters / prior)
        step = -np.linalg.lstsq(rows, weighted, rcond=None)[0]
        parameters = parameters + step
        if np.all(np.abs(step) < steps):
            return parameters, True
    return parameters, False
