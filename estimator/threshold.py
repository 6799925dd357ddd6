"""How steep a surface may be before a distance is wrong by a given share: the curves of Figs 5 and
6.

Angles in rad; an error of 5 % is 0.05. A flat surface has closed forms, a curved one is searched.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from estimator.domain import (
    RIGHT_ANGLE,
    Numbers,
    elementwise,
    require_friction_angle,
    require_positive,
)

EQUATIONS = ("no_slip", "with_friction")
# [rad] Step of the slopes among which the first one beyond the error is searched: an error of 10 %
# or less is reached over a wider range of slopes, or nowhere. Stated.
SEARCH_STEP = np.radians(0.25)
# [bisections] Enough for the last bit of a float. Derived.
HALVINGS = 50
# Appendix B: `estimator.curvature.exact`, or `printed`.
AppendixB: TypeAlias = Callable[..., tuple[Numbers, Numbers]]


def distance_error(
    beta: ArrayLike, alpha: ArrayLike, alpha_est: ArrayLike, equation: str = "with_friction"
) -> Numbers:
    """Compute the relative error of (2) or (10), estimate over truth minus one, on a flat surface of slope β.

    α is the true friction cone angle, α_est the assumed one. −1 where (10) gives no distance because
    φ + α_est reaches 90°; NaN for a slope of 90° or more. Raises ValueError for a friction angle
    outside [0°, 90°) or an unknown equation.
    """
    _require(alpha, alpha_est, equation)
    if equation == "no_slip":
        return _error_of_2(beta, alpha)
    return _error_of_10(beta, alpha, alpha_est)


def slope_threshold(
    error: ArrayLike, alpha: ArrayLike, alpha_est: ArrayLike, equation: str = "with_friction"
) -> Numbers:
    """Find β_thresh of Fig. 5, in rad: the least slope of a flat surface at which (2) or (10) is wrong by
    `error`; NaN if never.

    Raises ValueError as `distance_error`, and for an error ≤ 0.
    """
    _require(alpha, alpha_est, equation)
    require_positive("error", error, "(a share)")
    if equation == "no_slip":
        return _slope_of_2(error, alpha)
    return _slope_of_10(error, alpha, alpha_est)


def _require(alpha, alpha_est, equation):
    """Raise ValueError for a friction angle outside [0°, 90°) or an unknown equation."""
    require_friction_angle("alpha", alpha)
    require_friction_angle("alpha_est", alpha_est)
    if equation not in EQUATIONS:
        raise ValueError(f"equation = {equation!r}: must be one of {', '.join(EQUATIONS)}")


@elementwise
def _error_of_2(beta, alpha):
    """Compute the relative error of (2), tan β tan φ."""
    slope = np.abs(beta)
    error = np.tan(slope) * np.tan(np.maximum(0.0, slope - alpha))
    return np.where(slope < RIGHT_ANGLE, error, np.nan)


@elementwise
def _error_of_10(beta, alpha, alpha_est):
    """Compute the relative error of (10), sin(α − α_est) (tan β − tan α) cos α / cos α_est; zero up to β = α."""
    slope = np.abs(beta)
    phi = np.maximum(0.0, slope - alpha)
    excess = np.sin(phi) / (np.cos(slope) * np.cos(alpha))  # tan β − tan α
    detour = np.sin(alpha - alpha_est)
    error = detour * excess * np.cos(alpha) / np.cos(alpha_est)
    return np.where(slope < RIGHT_ANGLE, np.maximum(error, -1.0), np.nan)


@elementwise
def _slope_of_2(error, alpha):
    """Solve `_error_of_2` for β."""
    halfway = np.tan(alpha) * (1 + error) / 2
    return np.arctan(halfway + np.sqrt(halfway**2 + error))


@elementwise
def _slope_of_10(error, alpha, alpha_est):
    """Solve `_error_of_10` for β; NaN where the error is never as large."""
    detour = np.sin(np.abs(alpha_est - alpha))
    tangent = np.tan(alpha) + error * np.cos(alpha_est) / (detour * np.cos(alpha))
    never = (detour == 0) | (alpha_est > alpha) & (error > 1)
    return np.arctan(np.where(never, np.nan, tangent))


@elementwise
def curved_error(
    beta_0: ArrayLike, alpha: ArrayLike, r_n: ArrayLike, theta: ArrayLike, form: AppendixB
) -> Numbers:
    """Compute the relative error of (10) with the true α on a surface of normalized radius r_n (15).

    beta_0: slope at first touch. form: Appendix B. NaN outside its domain.
    """
    phi, d = form(r_n, theta, beta_0, alpha)
    return theta * np.maximum(0.0, np.cos(np.abs(phi) + alpha)) / (d * np.cos(alpha)) - 1


@elementwise
def curved_threshold(
    error: ArrayLike, alpha: ArrayLike, r_n: ArrayLike, theta: ArrayLike, form: AppendixB
) -> Numbers:
    """Find β_thresh of Fig. 6, in rad: the least slope at first touch at which (10) with the true α is wrong by
    `error`; NaN if never.

    The first slope on a grid at which the error is reached, then bisected back to the crossing.
    Raises ValueError for a friction angle outside [0°, 90°), an error ≤ 0 or θ ≤ 0.

    >>> from estimator import curvature
    >>> round(curved_threshold(0.05, 0.0, 1.0, 0.0524, curvature.exact) * 180 / 3.14159, 1)
    62.9
    """
    require_positive("error", error, "(a share)")
    require_positive("theta", theta, "rad")
    conditions = [condition[..., None] for condition in np.broadcast_arrays(alpha, r_n, theta)]

    def is_reached(slope):
        """Check whether the error is reached at slopes (..., k)."""
        return np.abs(curved_error(slope, *conditions, form)) >= error[..., None]

    slopes = np.arange(0.0, RIGHT_ANGLE, SEARCH_STEP)
    reached = is_reached(slopes)  # (..., slopes)
    first = np.argmax(reached, axis=-1, keepdims=True)
    high = slopes[first]
    low = slopes[np.maximum(first - 1, 0)]
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        beyond = is_reached(middle)
        low = np.where(beyond, low, middle)
        high = np.where(beyond, middle, high)
    return np.where(reached.any(axis=-1), high[..., 0], np.nan)
