"""Lateral slip in the sensing plane: what the base feels for a given contact. Equations (3)–(5),
(13), (14), (18)–(21).

Written with φ = max(0, |β| − α) in sines and cosines, which stay finite where the printed tan and
cot do not. β < 0 mirrors β > 0: φ, m_y and σ change sign. Angles in rad, lengths in mm, C = 3EI in
N·mm², moments in N·mm.

Domain: |β| < 90°, θ ≥ 0 and below 90°, d_x > 0; outside it the result is NaN. A friction cone
angle α outside [0°, 90°) or C ≤ 0 raises ValueError.
"""

import numpy as np
from numpy.typing import ArrayLike

from estimator.domain import (
    RIGHT_ANGLE,
    Numbers,
    elementwise,
    require_friction_angle,
    require_positive,
)


@elementwise
def slip_angle(beta: ArrayLike, alpha: ArrayLike) -> Numbers:
    """Return φ of (4), in rad: zero while the friction cone holds the whisker, |β| − α beyond.

    Raises ValueError for α outside [0°, 90°).

    >>> slip_angle(0.5, 0.2)
    0.3
    >>> slip_angle(0.5, 0.6)
    0.0
    """
    require_friction_angle("alpha", alpha)
    phi = np.copysign(np.maximum(0.0, np.abs(beta) - alpha), beta)
    return np.where(np.abs(beta) < RIGHT_ANGLE, phi + 0.0, np.nan)


@elementwise
def moments(
    d_x: ArrayLike, theta: ArrayLike, beta: ArrayLike, alpha: ArrayLike, C: ArrayLike
) -> tuple[Numbers, Numbers]:
    """Return (m_y, m_z) of (14) and (13), in N·mm, at the angle θ against a flat surface of slope
    β.

    m_z = (Cθ/d_x) cos β cos φ / cos(β − φ),  m_y = (Cθ/d_x) cos β sin φ / cos(β − φ).
    Raises ValueError for α outside [0°, 90°) or C ≤ 0.

    >>> moments(50.0, 0.05, 0.0, 0.2, 9000.0)
    (0.0, 9.0)
    """
    _require_settings(alpha, C)
    phi = slip_angle(beta, alpha)
    magnitude = _magnitude(d_x, theta, beta, alpha, C)
    m_y = _inside(d_x, theta, beta, magnitude * np.sin(phi))
    m_z = _inside(d_x, theta, beta, magnitude * np.cos(phi))
    return m_y, m_z


@elementwise
def moment_magnitude(
    d_x: ArrayLike, theta: ArrayLike, beta: ArrayLike, alpha: ArrayLike, C: ArrayLike
) -> Numbers:
    """Return |m| of (13) and (14), in N·mm: (Cθ/d_x) cos β / cos(β − φ).

    Raises ValueError for α outside [0°, 90°) or C ≤ 0.
    """
    _require_settings(alpha, C)
    return _inside(d_x, theta, beta, _magnitude(d_x, theta, beta, alpha, C))


@elementwise
def slip_distance(d_x: ArrayLike, theta: ArrayLike, beta: ArrayLike, alpha: ArrayLike) -> Numbers:
    """Return σ of (5), in mm: how far the contact has slid along the surface.

    σ = d_x θ sin φ / cos(β − φ). Raises ValueError for α outside [0°, 90°).
    """
    require_friction_angle("alpha", alpha)
    phi = slip_angle(beta, alpha)
    slip = d_x * theta * np.sin(phi) / np.cos(_held_angle(beta, alpha))
    return _inside(d_x, theta, beta, slip)


@elementwise
def moment_from_deflection(
    d_x: ArrayLike, d_y: ArrayLike, d_z: ArrayLike, C: ArrayLike
) -> tuple[Numbers, Numbers]:
    """Return (m_y, m_z) of (19) and (18), in N·mm, from the deflections d_y, d_z in mm.

    m_z = C d_y / d_x², m_y = C d_z / d_x²; the paper prints d_z² under (19), a slip of the pen.
    NaN unless d_x > 0. Raises ValueError for C ≤ 0.

    >>> moment_from_deflection(50.0, 2.5, 0.5, 9000.0)
    (1.8, 9.0)
    """
    require_positive("C", C, "N·mm²")
    inside = (d_x > 0) & np.isfinite(d_x)
    per_mm = np.where(inside, C / d_x**2, np.nan)
    return per_mm * d_z, per_mm * d_y


@elementwise
def slope_from_deflection(
    d_x: ArrayLike, theta: ArrayLike, d_y: ArrayLike, d_z: ArrayLike
) -> tuple[Numbers, Numbers]:
    """Return (β, φ) of (20) and (21), in rad, from the deflections d_y, d_z in mm.

    tan β = (d_x θ − d_y) / d_z, tan φ = d_z / d_y. Without slip (d_z = 0) the slope leaves no
    trace: β is NaN. NaN also for d_y ≤ 0 and d_y > d_x θ, which no push against a surface gives.
    """
    obstructed = (
        d_x * theta - d_y
    )  # mm that the surface keeps the contact behind the unbent whisker
    possible = (
        (d_x > 0)
        & (theta >= 0)
        & (theta < RIGHT_ANGLE)
        & (d_y > 0)
        & (obstructed >= 0)
        & np.isfinite(d_z)
    )
    beta = np.copysign(np.arctan2(obstructed, np.abs(d_z)), d_z)
    phi = np.where(possible, np.arctan2(d_z, d_y), np.nan)
    return np.where(possible & (d_z != 0), beta, np.nan), phi


def _require_settings(alpha, C):
    """Raise ValueError for α outside [0°, 90°) or C ≤ 0."""
    require_friction_angle("alpha", alpha)
    require_positive("C", C, "N·mm²")


def _inside(d_x, theta, beta, value):
    """Return the value inside the domain and the range of a float, NaN elsewhere."""
    pushes = (theta >= 0) & (theta < RIGHT_ANGLE)
    inside = pushes & (d_x > 0) & np.isfinite(d_x) & (np.abs(beta) < RIGHT_ANGLE)
    return np.where(inside & np.isfinite(value), value, np.nan)


def _magnitude(d_x, theta, beta, alpha, C):
    """Return (Cθ/d_x) cos β / cos(β − φ), the size of the moment, also outside the domain."""
    return C * theta / d_x * np.cos(beta) / np.cos(_held_angle(beta, alpha))


def _held_angle(beta, alpha):
    """Return |β| − φ, which is min(|β|, α) to the last bit."""
    return np.minimum(np.abs(beta), alpha)
