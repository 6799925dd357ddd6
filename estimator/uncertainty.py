"""Standard deviation and interval of d_x from those of the pushing angle, the moments and α_est,
and the model's own.

Gradients are with respect to (θ, m_y, m_z, α_est), the last axis of length 4; of (6) β takes the
place of α_est. Angles in rad, moments in N·mm, C in N·mm², lengths in mm. Where the distance is NaN,
so is its sigma.

C = 3EI has no place in the sum: where the gauge factors were found with the same C, it drops out of
d_x.
"""

import numpy as np
from numpy.typing import ArrayLike

from estimator import distance, first_order
from estimator.domain import (
    RIGHT_ANGLE,
    Numbers,
    elementwise,
    require_friction_angle,
    require_positive,
    require_sigma,
)

# [sigma] Half an interval of 95 % of the normal distribution. Derived.
Z_95 = 1.959964
# [rad] Steepest friction angle: at 90° its tangent has no number. Derived.
_STEEPEST_RAD = RIGHT_ANGLE - 1e-9


def gradient_no_slip(theta: ArrayLike, m_z: ArrayLike, C: ArrayLike) -> np.ndarray:
    """Compute ∂d_x/∂(θ, m_y, m_z, α_est) of (2): d_x (1/θ, 0, −1/m_z, 0)."""
    d_x = np.asarray(distance.no_slip(theta, m_z, C))
    nothing = 0.0 * d_x
    return np.stack([d_x / theta, nothing, -d_x / m_z, nothing], axis=-1)


@elementwise
def gradient_known_slope(
    theta: ArrayLike, m_y: ArrayLike, m_z: ArrayLike, beta: ArrayLike, C: ArrayLike
) -> np.ndarray:
    """Compute ∂d_x/∂(θ, m_y, m_z, β) of (6): d_x (1/θ, −sin β/m, −cos β/m, −m_y/(m cos β)), where
    m = m_z cos β + m_y sin β.
    """
    d_x = distance.known_slope(theta, m_y, m_z, beta, C)
    sine = np.sin(beta)
    cosine = np.cos(beta)
    m = m_z * cosine + m_y * sine
    relative = _stack(1 / theta, -sine / m, -cosine / m, -m_y / (m * cosine))
    return np.asarray(d_x)[..., None] * relative


def gradient_with_friction(
    theta: ArrayLike, m_y: ArrayLike, m_z: ArrayLike, alpha_est: ArrayLike, C: ArrayLike
) -> np.ndarray:
    """Compute ∂d_x/∂(θ, m_y, m_z, α_est) of (10).

    ∂ln d_x/∂α_est = −tan(φ + α_est) + tan α_est. At m_y = 0, where |m_y| has a kink, it is the
    derivative of the side m_y > 0.
    """
    d_x = np.asarray(distance.with_friction(theta, m_y, m_z, alpha_est, C))
    _, gradient = _linear_in_mu(theta, m_y, m_z, alpha_est, C)
    return np.where(np.isfinite(d_x)[..., None], gradient, np.nan)


def slip_angle_sigma(m_y: float, m_z: float, covariance: np.ndarray) -> float:
    """Return the standard deviation of φ of (8), in rad.

    covariance (2, 2): of the moments. The gradient of φ is (m_z, −m_y) / |m|².
    """
    gradient = np.array([m_z, -m_y]) / (m_y**2 + m_z**2)
    variance = gradient @ covariance @ gradient
    return float(np.sqrt(max(variance, 0.0)))


@elementwise
def gradient_printed(
    theta: ArrayLike, m_y: ArrayLike, m_z: ArrayLike, C: ArrayLike, taper_per_mm: ArrayLike
) -> np.ndarray:
    """Compute ∂d_x/∂(θ, m_y, m_z, α_est) of (16) as printed, cos φ / (|m|/(Cθ) + τ/L); the last one
    is 0.
    """
    m = np.hypot(m_y, m_z)
    d_x = (m_z / m) / (m / (C * theta) + taper_per_mm)
    shrink = 1 / (1 + taper_per_mm * C * theta / m)  # of a relative error of Cθ/|m|
    by_m = -(1 + shrink) / m**2
    relative = _stack(shrink / theta, by_m * m_y, by_m * m_z + 1 / m_z, 0.0 * d_x)
    return d_x[..., None] * relative


def sigma(
    gradient: ArrayLike,
    *,
    theta_sigma: ArrayLike = 0.0,
    covariance: ArrayLike | None = None,
    alpha_est_sigma: ArrayLike = 0.0,
    theta_moment_covariance: ArrayLike | None = None,
) -> Numbers:
    """Compute the standard deviation of d_x, in mm, from its gradient (..., 4).

    theta_sigma: of the pushing angle, in rad; covariance (..., 2, 2) of (m_y, m_z) in (N·mm)²;
    alpha_est_sigma in rad; theta_moment_covariance (..., 2) of the pushing angle with (m_y, m_z). A
    negative or infinite sigma raises ValueError.

    >>> gradient = gradient_no_slip(0.05, 9.0, 9000.0)
    >>> sigma(gradient, theta_sigma=0.0005)
    0.5
    """
    require_sigma("theta_sigma", theta_sigma)
    require_sigma("alpha_est_sigma", alpha_est_sigma)
    by_theta = gradient[..., 0]
    by_moments = gradient[..., 1:3]
    by_alpha = gradient[..., 3]
    variance = (by_theta * theta_sigma) ** 2 + (by_alpha * alpha_est_sigma) ** 2
    if covariance is not None:
        variance = variance + np.einsum("...i,...ij,...j->...", by_moments, covariance, by_moments)
    if theta_moment_covariance is not None:
        mixed = np.einsum("...i,...i->...", by_moments, theta_moment_covariance)
        variance = variance + 2 * by_theta * mixed
    return _root(variance)


def interval_with_friction(
    theta: ArrayLike,
    m_y: ArrayLike,
    m_z: ArrayLike,
    alpha_est: ArrayLike,
    C: ArrayLike,
    *,
    alpha_est_sigma: ArrayLike = 0.0,
    model_sigma: ArrayLike = 0.0,
    **sigmas: ArrayLike,
) -> tuple[Numbers, Numbers]:
    """Return (low, high), mm, of the 95 % interval of (10), also where φ + α_est passes 90°; NaN
    without a push.

    (10) falls with α_est, and by more than a line where its sigma is large. So each side has its
    own width: the change by that end of α_est's interval and 1.96 sigma of the rest (`sigmas` are
    the keywords of `sigma`), added in squares (MOVER: Zou & Donner, Statistics in Medicine 27,
    2008). No friction angle is below 0: where α_est's interval is cut there, α may well be at the
    cut itself, and the rest keeps its share of the sum (`_upper_side`). model_sigma: relative sigma
    of the equation itself. A low end at zero or below means that no distance is too short: it is 0.
    Raises ValueError for α_est outside [0°, 90°), C ≤ 0 or a negative sigma.
    """
    require_sigma("alpha_est_sigma", alpha_est_sigma)
    require_friction_angle("alpha_est", alpha_est)
    require_positive("C", C, "N·mm²")
    middle, gradient = _linear_in_mu(theta, m_y, m_z, alpha_est, C)
    rest = Z_95 * np.hypot(sigma(gradient, **sigmas), model_sigma * middle)
    half = Z_95 * np.asarray(alpha_est_sigma)
    least, most = _at_alpha_ends(theta, m_y, m_z, alpha_est, C, half)
    high = middle + _upper_side(most - middle, rest, alpha_est, half)
    low = middle - np.hypot(middle - least, rest)
    pushes = (np.asarray(theta) > 0) & (np.asarray(m_z) > 0) & np.isfinite(middle)
    return _not_negative(low, pushes), _not_negative(high, pushes)


def _at_alpha_ends(theta, m_y, m_z, alpha_est, C, half):
    """Compute (10), mm, at the steep and at the flat end of α_est's interval, α_est ± half, rad."""
    steep = np.clip(alpha_est + half, 0.0, _STEEPEST_RAD)
    flat = np.clip(alpha_est - half, 0.0, _STEEPEST_RAD)
    least, _ = _linear_in_mu(theta, m_y, m_z, steep, C)
    most, _ = _linear_in_mu(theta, m_y, m_z, flat, C)
    return least, most


def _not_negative(end, pushes):
    """Return an end of the interval, mm, at least 0; NaN where the whisker does not push."""
    return np.where(pushes, np.maximum(end, 0.0), np.nan)[()]


def model_share(
    theta: ArrayLike,
    phi: ArrayLike,
    alpha: ArrayLike,
    d_x: ArrayLike,
    *,
    reach: ArrayLike = 0.0,
    tilt_sigma: ArrayLike = 0.0,
    thickness: ArrayLike = 1.0,
    held_spread: ArrayLike = 1.0,
) -> Numbers:
    """Return the relative sigma of d_x by what (10) leaves out: leading terms in θ, derived in
    docs/maps.md.

    reach: radii of object and whisker together, mm; tilt_sigma: of the object's lean ψ, rad;
    thickness: the diameter at d_x over the base's. A held contact drags along the whisker by up
    to tan α; where it slips, that is far less than the effect of α_est. held_spread: the part of
    that which is not known.
    """
    leaning = first_order.leaning(theta, tilt_sigma, phi, alpha)
    rolling = first_order.rolling(theta, reach, phi, alpha, d_x, thickness)
    dragging = held_spread * first_order.dragging(theta, alpha)
    large = first_order.bending_far(theta, thickness)
    return np.sqrt(leaning**2 + rolling**2 + dragging**2 + large**2)


@elementwise
def _upper_side(change, rest, alpha_est, half):
    """Return the width of the interval's side of small α.

    It is the most of u·whole + √(1 − u²)·rest over u from 0 to the part of α_est's half interval (rad)
    that α ≥ 0 leaves; whole is the change by all of that interval, of which `change` is the part down
    to α = 0. Where nothing is cut off, it is the root of the sum of squares.
    """
    part = np.where(alpha_est < half, alpha_est / half, 1.0)
    whole = np.where(part > 0, change / part, 0.0)
    total = np.hypot(whole, rest)
    u = np.where(total > 0, np.minimum(whole / total, part), 0.0)
    return u * whole + np.sqrt(1 - u**2) * rest


@elementwise
def _linear_in_mu(theta, m_y, m_z, alpha_est, C):
    """Compute (10) and its gradient (..., 4) from the formula alone, linear in μ_est: below zero where φ + α_est
    passes 90°.
    """
    mu = np.copysign(np.tan(alpha_est), m_y)
    square = m_z * m_z + m_y * m_y
    scale = C * theta / square
    d_x = scale * (m_z - mu * m_y)
    by_theta = d_x / theta
    by_y = -scale * mu - 2 * m_y * d_x / square
    by_z = scale - 2 * m_z * d_x / square
    by_alpha = -scale * np.abs(m_y) / np.cos(alpha_est) ** 2
    return d_x, _stack(by_theta, by_y, by_z, by_alpha)


def _stack(*parts: np.ndarray) -> np.ndarray:
    """Return parts (...), broadcast against each other, side by side: (..., k)."""
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


@elementwise
def _root(variance):
    """Return the standard deviation of a variance, which rounding may have made negative."""
    return np.sqrt(np.maximum(variance, 0.0))
