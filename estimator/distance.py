"""Radial distance d_x from pushing angle and moments: equations (1), (2), (6)–(12), (16), (17).

Angles in rad, moments in N·mm, C = 3EI in N·mm², lengths in mm. Where the arguments are no push
against a surface the distance is NaN, never negative and never infinite, and `why_not` names the
condition that failed. β < 0 mirrors β > 0: m_y changes sign, the distance does not. C ≤ 0, L ≤ 0
and α_est outside [0°, 90°) raise ValueError.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from estimator.domain import (
    ANGLE_TOO_LARGE,
    NOT_PUSHING,
    RIGHT_ANGLE,
    SLOPE_TOO_STEEP,
    VALUE_MISSING,
    Numbers,
    elementwise,
    first_failure,
    require_friction_angle,
    require_positive,
    where_all,
)
from estimator.reasons import NamedReason

ANGLE_NOT_POSITIVE = NamedReason("angle_not_positive", "the pushing angle is not positive")
UP_THE_SLOPE = NamedReason(
    "moments_up_slope", "m_y points up the slope beta, too strongly for a contact there"
)
BEYOND_FRICTION = NamedReason("beyond_friction", "phi + alpha_est is 90 degrees or more")
OUT_OF_RANGE = NamedReason("distance_out_of_range", "the distance is beyond the range of a float")

# ν(θ, |m|): the distance in mm for an angle and a moment, where nothing slips.
NoSlip: TypeAlias = Callable[[np.ndarray, np.ndarray], np.ndarray]


@elementwise
def rotational_compliance(theta: ArrayLike, m_z: ArrayLike) -> Numbers:
    """Compute k_θ of (1), in rad/(N·mm): how far the base turns per moment, over two angles or a
    stroke.

    theta and m_z (..., n): n ≥ 2 samples along the last axis, else it raises ValueError. The
    compliance is one over the slope of the least-squares line of the moment over the angle, so that
    the angle of touch drops out. NaN where the moment does not rise with the angle.

    >>> round(rotational_compliance([0.01, 0.03], [2.0, 6.0]), 9)
    0.005
    """
    if min(theta.ndim, m_z.ndim) < 1 or min(theta.shape[-1], m_z.shape[-1]) < 2:
        raise ValueError("rotational_compliance needs two samples or more along the last axis")
    angle = theta - theta.mean(axis=-1, keepdims=True)
    moment = m_z - m_z.mean(axis=-1, keepdims=True)
    compliance = (angle**2).sum(axis=-1) / (angle * moment).sum(axis=-1)
    return np.where((compliance > 0) & np.isfinite(compliance), compliance, np.nan)


@elementwise
def from_compliance(compliance: ArrayLike, C: ArrayLike) -> Numbers:
    """Return d_x of (1), in mm: C k_θ, for a compliance in rad/(N·mm)."""
    require_positive("C", C, "N·mm²")
    known = (("the compliance is missing", np.isfinite(compliance)),)
    return _distance(C * compliance, known)


@elementwise
def no_slip(theta: ArrayLike, m_z: ArrayLike, C: ArrayLike) -> Numbers:
    """Return d_x of (2), in mm: Cθ / m_z, exact where the whisker does not slip sideways.

    >>> no_slip(0.05, 9.0, 9000.0)
    50.0
    """
    require_positive("C", C, "N·mm²")
    return _distance(C * theta / m_z, _conditions(theta, 0.0, m_z))


@elementwise
def known_slope(
    theta: ArrayLike, m_y: ArrayLike, m_z: ArrayLike, beta: ArrayLike, C: ArrayLike
) -> Numbers:
    """Return d_x of (6), in mm, at a known slope β: Cθ cos β / (m_z cos β + m_y sin β)."""
    require_positive("C", C, "N·mm²")
    d_x = C * theta * np.cos(beta) / _across_slope(m_y, m_z, beta)
    return _distance(d_x, _conditions(theta, m_y, m_z, beta=beta))


@elementwise
def felt_slip_angle(m_y: ArrayLike, m_z: ArrayLike) -> Numbers:
    """Return φ of (8), in rad: atan2(m_y, m_z); NaN unless m_z > 0: the whisker pushes towards
    +y.
    """
    return np.where((m_z > 0) & np.isfinite(m_y) & np.isfinite(m_z), np.arctan2(m_y, m_z), np.nan)


@elementwise
def estimated_slope(m_y: ArrayLike, m_z: ArrayLike, alpha_est: ArrayLike) -> Numbers:
    """Return β_est of (9), in rad: φ ± α_est on the side of φ; NaN from 90° on, and for m_z ≤ 0."""
    require_friction_angle("alpha_est", alpha_est)
    steep = np.arctan2(np.abs(m_y), m_z) + alpha_est
    slope = np.copysign(np.minimum(steep, RIGHT_ANGLE), m_y)
    return where_all(_conditions(1.0, m_y, m_z, alpha_est), slope)


@elementwise
def with_friction(
    theta: ArrayLike, m_y: ArrayLike, m_z: ArrayLike, alpha_est: ArrayLike, C: ArrayLike
) -> Numbers:
    """Return d_x of (10), in mm, for an assumed friction cone angle α_est.

    d_x = Cθ (m_z − μ |m_y|) / (m_z² + m_y²) with μ = tan α_est. The printed form with β_est = φ +
    α_est is the same number; this one is exact to the last digit.
    """
    require_friction_angle("alpha_est", alpha_est)
    require_positive("C", C, "N·mm²")
    d_x = C * theta * _across_friction(m_y, m_z, alpha_est) / (m_z**2 + m_y**2)
    return _distance(d_x, _conditions(theta, m_y, m_z, alpha_est))


@elementwise
def frictionless(theta: ArrayLike, m_y: ArrayLike, m_z: ArrayLike, C: ArrayLike) -> Numbers:
    """Return d_x of (11) and (12), in mm: (Cθ/|m|) cos φ = Cθ m_z / (m_z² + m_y²), (10) without friction."""
    return with_friction(theta, m_y, m_z, 0.0, C)


@elementwise
def general_printed(theta: ArrayLike, m_y: ArrayLike, m_z: ArrayLike, nu: NoSlip) -> Numbers:
    """Return d_x of (16) as printed, in mm: ν(θ, |m|) cos φ, for a no-slip extraction ν.

    `nu(theta, magnitude)` takes and returns arrays. Exact only where ν is proportional to θ/|m|,
    that is for a cylinder; use `general`.
    """
    magnitude = np.hypot(m_y, m_z)
    d_x = nu(theta, magnitude) * (m_z / magnitude)
    return _distance(d_x, _conditions(theta, m_y, m_z))


@elementwise
def general(
    theta: ArrayLike, m_y: ArrayLike, m_z: ArrayLike, alpha_est: ArrayLike, nu: NoSlip
) -> Numbers:
    """Return d_x of (16), in mm, for any no-slip extraction ν, the angle scaled in place of the
    distance.

    d_x = ν(θ cos(φ + α_est) / cos α_est, |m|): slip reduces the deflection, hence the angle.
    `nu(theta, magnitude)` takes and returns arrays.
    """
    require_friction_angle("alpha_est", alpha_est)
    magnitude = np.hypot(m_y, m_z)
    scaled_theta = theta * _across_friction(m_y, m_z, alpha_est) / magnitude
    return _distance(nu(scaled_theta, magnitude), _conditions(theta, m_y, m_z, alpha_est))


@elementwise
def clamp_to_length(d_x: ArrayLike, length: ArrayLike) -> tuple[Numbers, bool | np.ndarray]:
    """Clip distances to the whisker's length: past the tip means tip contact (section VII).

    Returns (d_x in mm, at most `length`; mask of the distances that were longer).

    >>> clamp_to_length(120.0, 100.0)
    (100.0, True)
    """
    require_positive("length", length, "mm")
    d_x = np.where(d_x > 0, d_x, np.nan)
    at_tip = d_x > length
    return np.where(at_tip, length, d_x), at_tip


@elementwise
def contact_point(
    d_x: ArrayLike, touch: ArrayLike, z_c: ArrayLike = 0.0
) -> tuple[Numbers, Numbers, Numbers]:
    """Return (r_c, θ_c, z_c) of section II: the contact's cylindrical coordinates, in mm, rad, mm.

    `touch` is the motor angle of first touch, `z_c` the height of the whisker's plane of rotation.
    All three are NaN where the distance is not positive and finite.
    """
    known = np.isfinite(d_x) & (d_x > 0) & np.isfinite(touch) & np.isfinite(z_c)
    return tuple(np.where(known, value, np.nan) for value in (d_x, touch, z_c))


@elementwise
def cartesian(
    r_c: ArrayLike, theta_c: ArrayLike, z_c: ArrayLike
) -> tuple[Numbers, Numbers, Numbers]:
    """Convert the cylindrical coordinates of `contact_point` to (x, y, z) in mm."""
    return r_c * np.cos(theta_c), r_c * np.sin(theta_c), z_c + 0 * r_c


def why_not(
    theta: ArrayLike,
    m_y: ArrayLike,
    m_z: ArrayLike,
    *,
    alpha_est: ArrayLike = 0.0,
    beta: ArrayLike | None = None,
    C: ArrayLike | None = None,
) -> str | np.ndarray:
    """Return a sentence why these arguments give no distance; empty where they give one.

    Give `beta` for (6), `alpha_est` for (9) and (10); with C, a distance too large or
    too small for a float is reported as well. Returns a str for scalars, else an array of str.
    """
    slope = 0.0 if beta is None else beta
    stiffness = 1.0 if C is None else C
    require_friction_angle("alpha_est", alpha_est)
    require_positive("C", stiffness, "N·mm²")
    arguments = np.broadcast_arrays(theta, m_y, m_z, alpha_est, slope, stiffness)
    theta, m_y, m_z, alpha_est, slope, stiffness = (a.astype(float) for a in arguments)
    with np.errstate(all="ignore"):
        conditions = _conditions(theta, m_y, m_z, alpha_est, slope)
        if C is not None:
            if beta is None:
                d_x = with_friction(theta, m_y, m_z, alpha_est, stiffness)
            else:
                d_x = known_slope(theta, m_y, m_z, slope, stiffness)
            conditions += ((OUT_OF_RANGE, np.isfinite(d_x)),)
        return first_failure(conditions, theta.shape)


def _conditions(theta, m_y, m_z, alpha_est=0.0, beta=0.0):
    """Return pairs (reason for having no distance, mask of what must hold), the first reason
    first.
    """
    finite = np.isfinite(theta) & np.isfinite(m_y) & np.isfinite(m_z) & np.isfinite(beta)
    return (
        (VALUE_MISSING, finite),
        (ANGLE_NOT_POSITIVE, theta > 0),
        (ANGLE_TOO_LARGE, theta < RIGHT_ANGLE),
        (NOT_PUSHING, m_z > 0),
        (SLOPE_TOO_STEEP, np.abs(beta) < RIGHT_ANGLE),
        (UP_THE_SLOPE, _across_slope(m_y, m_z, beta) > 0),
        (BEYOND_FRICTION, _across_friction(m_y, m_z, alpha_est) > 0),
    )


def _across_slope(m_y, m_z, beta):
    """Return m_z cos β + m_y sin β: the moment across a surface of slope β."""
    return m_z * np.cos(beta) + m_y * np.sin(beta)


def _across_friction(m_y, m_z, alpha_est):
    """Return m_z − μ |m_y| with μ = tan α_est: what friction leaves of the moment of the push."""
    return m_z - np.tan(alpha_est) * np.abs(m_y)


def _distance(value, conditions):
    """Return `value` where it is positive and finite and all conditions hold, NaN elsewhere."""
    value = np.where(np.greater(value, 0) & np.isfinite(value), value, np.nan)
    return where_all(conditions, value)
