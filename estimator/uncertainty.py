"""Standard deviation and interval of d_x from those of the pushing angle, the moments and α_est, and the model's own.

Gradients are with respect to (θ, m_y, m_z, α_est), the last axis of length 4. Angles in rad, moments in
N·mm, C in N·mm², lengths in mm. Where the distance is NaN, so is its sigma.

C = 3EI has no place in the sum: where the gauge factors were found with the same C, it drops out of d_x.
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

Z_95 = 1.959964  # half an interval of 95 % of the normal distribution, in sigmas
_STEEPEST_RAD = RIGHT_ANGLE - 1e-9  # of a friction angle: at 90° its tangent has no number


def gradient_no_slip(theta: ArrayLike, m_z: ArrayLike, C: ArrayLike) -> np.ndarray:
    """∂d_x/∂(θ, m_y, m_z, α_est) of (2): d_x (1/θ, 0, −1/m_z, 0)."""
    d_x = distance.no_slip(theta, m_z, C)
    return _stack(d_x, _inverse(theta), 0.0, -_inverse(m_z), 0.0)


def gradient_known_slope(
    theta: ArrayLike, m_y: ArrayLike, m_z: ArrayLike, beta: ArrayLike, C: ArrayLike
) -> np.ndarray:
    """∂d_x/∂(θ, m_y, m_z, α_est) of (6), the slope taken as exact."""
    d_x = distance.known_slope(theta, m_y, m_z, beta, C)
    share = _inverse(np.multiply(m_z, np.cos(beta)) + np.multiply(m_y, np.sin(beta)))
    return _stack(d_x, _inverse(theta), -np.sin(beta) * share, -np.cos(beta) * share, 0.0)


def gradient_with_friction(
    theta: ArrayLike, m_y: ArrayLike, m_z: ArrayLike, alpha_est: ArrayLike, C: ArrayLike
) -> np.ndarray:
    """∂d_x/∂(θ, m_y, m_z, α_est) of (10).

    ∂ln d_x/∂α_est = −tan(φ + α_est) + tan α_est. At m_y = 0, where |m_y| has a kink, the derivative of
    the side m_y > 0.
    """
    d_x = distance.with_friction(theta, m_y, m_z, alpha_est, C)
    return _stack(d_x, *_log_gradient(theta, m_y, m_z, alpha_est))


def gradient_frictionless(
    theta: ArrayLike, m_y: ArrayLike, m_z: ArrayLike, C: ArrayLike
) -> np.ndarray:
    """∂d_x/∂(θ, m_y, m_z, α_est) of (11) and (12); the last one is 0."""
    d_x = distance.frictionless(theta, m_y, m_z, C)
    return _stack(d_x, *_log_gradient(theta, m_y, m_z, 0.0)[:3], 0.0)


def gradient_cone(
    theta: ArrayLike,
    m_y: ArrayLike,
    m_z: ArrayLike,
    alpha_est: ArrayLike,
    C: ArrayLike,
    length: ArrayLike,
) -> np.ndarray:
    """∂d_x/∂(θ, m_y, m_z, α_est) of the cone: that of (10) times (cone's d_x / cylinder's d_x)²."""
    cylinder = distance.with_friction(theta, m_y, m_z, alpha_est, C)
    shrink = (distance.cone(theta, m_y, m_z, alpha_est, C, length) / cylinder) ** 2
    return np.asarray(shrink)[..., None] * gradient_with_friction(theta, m_y, m_z, alpha_est, C)


@elementwise
def gradient_printed(
    theta: ArrayLike, m_y: ArrayLike, m_z: ArrayLike, C: ArrayLike, taper_per_mm: ArrayLike
) -> np.ndarray:
    """∂d_x/∂(θ, m_y, m_z, α_est) of (16) as printed, cos φ / (|m|/(Cθ) + τ/L); the last one is 0."""
    m = np.hypot(m_y, m_z)
    d_x = (m_z / m) / (m / (C * theta) + taper_per_mm)
    shrink = 1 / (1 + taper_per_mm * C * theta / m)  # of a relative error of Cθ/|m|
    by_m = -(1 + shrink) / m**2
    return _stack(d_x, shrink / theta, by_m * m_y, by_m * m_z + 1 / m_z, 0.0)


def sigma(
    gradient: ArrayLike,
    *,
    theta_sigma: ArrayLike = 0.0,
    touch_sigma: ArrayLike = 0.0,
    covariance: ArrayLike | None = None,
    alpha_est_sigma: ArrayLike = 0.0,
    theta_moment_covariance: ArrayLike | None = None,
) -> Numbers:
    """Standard deviation of d_x, in mm, for one of the gradients above.

    theta_sigma: of the motor angle, touch_sigma: of the touch, both in rad; covariance (..., 2, 2) of
    (m_y, m_z) in (N·mm)²; alpha_est_sigma in rad; theta_moment_covariance (..., 2) of the pushing angle
    with (m_y, m_z). A negative or infinite sigma raises ValueError.

    >>> gradient = gradient_no_slip(0.05, 9.0, 9000.0)
    >>> sigma(gradient, theta_sigma=0.0005)
    0.5
    """
    for name, value in (
        ("theta_sigma", theta_sigma),
        ("touch_sigma", touch_sigma),
        ("alpha_est_sigma", alpha_est_sigma),
    ):
        require_sigma(name, value)
    covariance = np.zeros((2, 2)) if covariance is None else np.asarray(covariance, dtype=float)
    mixed = (
        np.zeros(2)
        if theta_moment_covariance is None
        else np.asarray(theta_moment_covariance, dtype=float)
    )
    theta, moment, alpha = gradient[..., 0], gradient[..., 1:3], gradient[..., 3]
    variance = (
        theta**2 * (np.square(theta_sigma) + np.square(touch_sigma))
        + (alpha * alpha_est_sigma) ** 2
    )
    variance = variance + np.einsum("...i,...ij,...j->...", moment, covariance, moment)
    variance = variance + 2 * theta * np.einsum("...i,...i->...", moment, mixed)
    return _root(variance)


def sigma_no_slip(theta: ArrayLike, m_z: ArrayLike, C: ArrayLike, **sigmas: ArrayLike) -> Numbers:
    """Standard deviation of (2), in mm; `sigmas` as of `sigma`."""
    return sigma(gradient_no_slip(theta, m_z, C), **sigmas)


def sigma_known_slope(
    theta: ArrayLike,
    m_y: ArrayLike,
    m_z: ArrayLike,
    beta: ArrayLike,
    C: ArrayLike,
    **sigmas: ArrayLike,
) -> Numbers:
    """Standard deviation of (6), in mm; `sigmas` as of `sigma`."""
    return sigma(gradient_known_slope(theta, m_y, m_z, beta, C), **sigmas)


def sigma_with_friction(
    theta: ArrayLike,
    m_y: ArrayLike,
    m_z: ArrayLike,
    alpha_est: ArrayLike,
    C: ArrayLike,
    **sigmas: ArrayLike,
) -> Numbers:
    """Standard deviation of (10), in mm; `sigmas` as of `sigma`."""
    return sigma(gradient_with_friction(theta, m_y, m_z, alpha_est, C), **sigmas)


def sigma_frictionless(
    theta: ArrayLike, m_y: ArrayLike, m_z: ArrayLike, C: ArrayLike, **sigmas: ArrayLike
) -> Numbers:
    """Standard deviation of (11) and (12), in mm; `sigmas` as of `sigma`."""
    return sigma(gradient_frictionless(theta, m_y, m_z, C), **sigmas)


def sigma_cone(
    theta: ArrayLike,
    m_y: ArrayLike,
    m_z: ArrayLike,
    alpha_est: ArrayLike,
    C: ArrayLike,
    length: ArrayLike,
    **sigmas: ArrayLike,
) -> Numbers:
    """Standard deviation of the cone's distance, in mm; `sigmas` as of `sigma`."""
    return sigma(gradient_cone(theta, m_y, m_z, alpha_est, C, length), **sigmas)


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
    """(low, high), mm: the 95 % interval of (10), beyond a φ + α_est of 90° too; NaN where m_z or θ is no push.

    (10) falls with α_est, and by more than a line where its sigma is large. So each side is its own: the change that
    the end of α_est's interval makes and 1.96 sigma of the rest (`sigmas` as of `sigma`), added in squares (MOVER:
    Zou & Donner, Statistics in Medicine 27, 2008). No friction angle is below 0: where α_est's interval is cut there,
    α may well be at the cut itself, and the rest keeps its share of the sum (`_side`). model_sigma: of the equation
    itself, a share of it. A low end at zero or below says that no distance is too short: it is 0.
    """
    require_sigma("alpha_est_sigma", alpha_est_sigma)
    require_friction_angle("alpha_est", alpha_est)
    require_positive("C", C, "N·mm²")
    middle, gradient = _through_zero(theta, m_y, m_z, alpha_est, C)
    rest = Z_95 * np.hypot(sigma(gradient, **sigmas), model_sigma * middle)
    ends = (alpha_est + side * Z_95 * alpha_est_sigma for side in (1.0, -1.0))
    least, most = (
        _through_zero(theta, m_y, m_z, np.clip(a, 0.0, _STEEPEST_RAD), C)[0] for a in ends
    )
    high = middle + _side(most - middle, rest, alpha_est, Z_95 * np.asarray(alpha_est_sigma))
    low = middle - np.hypot(middle - least, rest)
    push = (np.asarray(theta) > 0) & (np.asarray(m_z) > 0) & np.isfinite(middle)
    return np.where(push, np.maximum(low, 0.0), np.nan)[()], np.where(
        push, np.maximum(high, 0.0), np.nan
    )[()]


def model_share(
    theta: ArrayLike,
    phi: ArrayLike,
    alpha: ArrayLike,
    d_x: ArrayLike,
    *,
    reach: ArrayLike = 0.0,
    tilt_sigma: ArrayLike = 0.0,
    left: ArrayLike = 1.0,
    held_spread: ArrayLike = 1.0,
) -> Numbers:
    """How far (10) may be off by itself, as a share of d_x: leading terms in θ, derived in docs/maps.md.

    reach: radii of object and whisker together, mm; tilt_sigma: of the object's lean ψ, rad; left: share of the base's
    diameter that is left at d_x. A held contact drags along the whisker by up to tan α; where it slips, that is far
    less than what α_est does. held_spread: the part of that which is not known.
    """
    leaning = first_order.leaning(theta, tilt_sigma, phi, alpha)
    rolling = first_order.rolling(theta, reach, phi, alpha, d_x, left)
    dragging = held_spread * first_order.dragging(theta, alpha)
    return np.sqrt(leaning**2 + rolling**2 + dragging**2 + (theta**2 / (6 * left)) ** 2)


@elementwise
def _side(change, rest, alpha_est, half):
    """How far the side of small α goes: the most of u·whole + √(1 − u²)·rest over what α ≥ 0 leaves of u in 0 to 1.

    whole: the change by all of α_est's half interval (rad), of which `change` is the part down to α = 0. Where nothing
    is cut off, it is the root of the sum of squares.
    """
    left = np.where(alpha_est < half, alpha_est / half, 1.0)
    whole = np.where(left > 0, change / left, 0.0)
    total = np.hypot(whole, rest)
    u = np.where(total > 0, np.minimum(whole / total, left), 0.0)
    return u * whole + np.sqrt(1 - u**2) * rest


@elementwise
def _through_zero(theta, m_y, m_z, alpha_est, C):
    """(10) and its gradient (..., 4), which go on through zero where φ + α_est passes 90°."""
    mu, square = np.copysign(np.tan(alpha_est), m_y), m_z * m_z + m_y * m_y
    scale = C * theta / square
    d_x = scale * (m_z - mu * m_y)
    by_y, by_z = -scale * mu - 2 * m_y * d_x / square, scale - 2 * m_z * d_x / square
    by_alpha = -scale * np.abs(m_y) / np.cos(alpha_est) ** 2
    return d_x, np.stack(np.broadcast_arrays(d_x / theta, by_y, by_z, by_alpha), axis=-1)


@elementwise
def _inverse(x):
    return 1 / x


@elementwise
def _root(variance):
    return np.sqrt(np.maximum(variance, 0.0))


@elementwise
def _log_gradient(theta, m_y, m_z, alpha_est):
    mu = np.copysign(np.tan(alpha_est), m_y)
    share = m_z - mu * m_y
    square = m_z * m_z + m_y * m_y
    by_y = -mu / share - 2 * m_y / square
    by_z = 1 / share - 2 * m_z / square
    by_alpha = -np.abs(m_y) / (share * np.cos(alpha_est) ** 2)
    return 1 / theta, by_y, by_z, by_alpha


def _stack(d_x, *logarithmic):
    with np.errstate(all="ignore"):
        parts = np.broadcast_arrays(*(np.multiply(d_x, part) for part in logarithmic))
    return np.stack(parts, axis=-1)
