"""How steep a surface may be before a distance is wrong by a given share: the curves of Figs 5 and
6.

Angles in rad; an error of 5 % is 0.05. A flat surface (r_n = ∞) has closed forms, a curved one is
searched.
"""

import numpy as np
from numpy.typing import ArrayLike

from estimator import circle
from estimator.domain import (
    RIGHT_ANGLE,
    Numbers,
    elementwise,
    require_friction_angle,
    require_positive,
)

EQUATIONS = ("no_slip", "with_friction")
# [rad] Step of the slopes among which the first one beyond the error is searched.
SEARCH_STEP = np.radians(0.25)
# Number of bisections, which is enough for the last bit of a float.
HALVINGS = 50


def distance_error(
    beta_0: ArrayLike,
    alpha: ArrayLike,
    alpha_est: ArrayLike,
    *,
    r_n: ArrayLike = np.inf,
    theta: ArrayLike = 0.0,
    equation: str = "with_friction",
    printed: bool = False,
) -> Numbers:
    """Compute the relative error of (2) or (10), estimate over truth minus one, for a slope β_0 at
    first touch.

    α is the true friction cone angle, α_est the assumed one; r_n the normalized radius of curvature
    (15). `printed` takes Appendix B as printed. −1 where (10) gives no distance because φ + α_est
    reaches 90°; NaN outside the domain. Raises ValueError for a friction angle outside [0°, 90°) or
    an unknown equation.
    """
    _require(alpha, alpha_est, equation)
    no_slip = equation == "no_slip"
    if np.all(np.isinf(r_n)):
        return _flat_error(beta_0, alpha, alpha_est, no_slip)
    return _curved_error(beta_0, alpha, alpha_est, r_n, theta, no_slip, _form(printed))


def slope_threshold(
    error: float,
    alpha: ArrayLike,
    alpha_est: ArrayLike = 0.0,
    *,
    r_n: ArrayLike = np.inf,
    theta: ArrayLike = 0.0,
    equation: str = "with_friction",
    printed: bool = False,
) -> Numbers:
    """Find β_thresh of Figs 5 and 6, in rad: the least slope at which (2) or (10) is wrong by
    `error`; NaN if never.

    Fig. 5 is the flat surface, α_est ≠ α; Fig. 6 has α_est = α and r_n and θ > 0. Raises ValueError
    for a friction angle outside [0°, 90°), an unknown equation, an error ≤ 0, or a curved surface
    with θ ≤ 0.

    >>> round(slope_threshold(0.05, 0.0, 0.0, r_n=1.0, theta=0.0524) * 180 / 3.14159, 1)
    62.9
    """
    _require(alpha, alpha_est, equation)
    require_positive("error", error, "(a share)")
    no_slip = equation == "no_slip"
    if np.all(np.isinf(r_n)):
        return _flat_threshold(error, alpha, alpha_est, no_slip)
    require_positive("theta", theta, "rad")
    return _curved_threshold(error, alpha, alpha_est, r_n, theta, no_slip, _form(printed))


def _require(alpha, alpha_est, equation):
    """Raise ValueError for a friction angle outside [0°, 90°) or an unknown equation."""
    require_friction_angle("alpha", alpha)
    require_friction_angle("alpha_est", alpha_est)
    if equation not in EQUATIONS:
        raise ValueError(f"equation = {equation!r}: must be one of {', '.join(EQUATIONS)}")


@elementwise
def _flat_error(beta_0, alpha, alpha_est, no_slip):
    """Compute the relative error on a flat surface; zero up to β = α.

    It is tan β tan φ for (2), and sin(α − α_est) (tan β − tan α) cos α / cos α_est for (10).
    """
    slope = np.abs(beta_0)
    phi = np.maximum(0.0, slope - alpha)
    excess = np.sin(phi) / (np.cos(slope) * np.cos(alpha))
    of_10 = -np.sin(alpha_est - alpha) * excess * np.cos(alpha) / np.cos(alpha_est)
    of_2 = np.tan(slope) * np.tan(phi)
    error = np.where(no_slip, of_2, np.maximum(of_10, -1.0))
    return np.where(slope < RIGHT_ANGLE, error, np.nan)


@elementwise
def _flat_threshold(error, alpha, alpha_est, no_slip):
    """Solve the formulas of `_flat_error` for tan β, and return β."""
    mu = np.tan(alpha)
    detour = np.sin(np.abs(alpha_est - alpha))
    of_10 = mu + error * np.cos(alpha_est) / (detour * np.cos(alpha))
    never = (detour == 0) | (alpha_est > alpha) & (error > 1)
    halfway = mu * (1 + error) / 2
    of_2 = halfway + np.sqrt(halfway**2 + error)
    return np.arctan(np.where(no_slip, of_2, np.where(never, np.nan, of_10)))


def _form(printed):
    """Return the function of Appendix B: as printed, or exact."""
    return circle.printed if printed else circle.exact


@elementwise
def _curved_error(beta_0, alpha, alpha_est, r_n, theta, no_slip, form):
    """Compute the relative error on a curved surface."""
    phi, d = form(r_n, theta, beta_0, alpha)
    angle = np.abs(phi)
    assumed = np.where(no_slip, 0.0, alpha_est)
    of_2 = theta / (d * np.cos(angle)) - 1
    of_10 = theta * np.maximum(0.0, np.cos(angle + assumed)) / (d * np.cos(assumed)) - 1
    return np.where(no_slip, of_2, of_10)


@elementwise
def _curved_threshold(error, alpha, alpha_est, r_n, theta, no_slip, form):
    """Find the first slope on a grid at which the error is reached, then bisect back to the
    crossing.
    """

    def is_reached(slope):
        """Check whether the error is reached at slopes (..., k)."""
        found = _curved_error(slope, *conditions, form)
        return np.abs(found) >= error[..., None]

    conditions = np.broadcast_arrays(alpha, alpha_est, r_n, theta, no_slip)
    conditions = [condition[..., None] for condition in conditions]
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
