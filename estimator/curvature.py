"""Appendix B: the whisker against a surface of constant lateral curvature. Equations (15),
(22)–(32).

Lengths are over the contact distance d_x, moments over C/d_x: r_n = r_κ/d_x, and at r_n = ∞ the
surface is flat. β_0 is the slope at first touch, θ the pushing angle, α the friction cone angle,
all in rad.

Each function exists twice where the paper's (24) matters: as printed, φ = max(0, ζ − α) with ζ
taken at the virtual point, and exact, where the force leaves the normal at the contact point by α.
The printed form is right for α = 0 only.

Both are written with q = θ/r_n so that nothing cancels for large r_n: from p² = r_n² − 2 y_c θ +
θ²,

    d = θ (2 cos β_0 − q) / (√(1 − (p/r_n)² sin² u) + (p/r_n) cos u),   u = ζ − φ.

Domain: r_n > 0, 0 ≤ θ < 2 y_c and below 90°, |β_0| < 90°, |φ| < 90°; beyond it the whisker has
passed the object and the result is NaN; `why_not` says why. β_0 < 0 mirrors β_0 > 0. α outside [0°,
90°) raises ValueError.
"""

import numpy as np
from numpy.typing import ArrayLike

from estimator import circle
from estimator.domain import (
    RIGHT_ANGLE,
    Numbers,
    elementwise,
    first_failure,
    require_friction_angle,
)
from estimator.reasons import NamedReason
from estimator.threshold import distance_error, slope_threshold

SLIP_ANGLE_TOO_LARGE = NamedReason("slip_angle_too_large", "the slip angle reaches 90 degrees")

__all__ = [
    "curvature_of_slip",
    "curvature_of_slip_printed",
    "deflection",
    "deflection_printed",
    "distance_error",
    "initial_contact",
    "moments",
    "moments_printed",
    "normalized_curvature",
    "normalized_radius",
    "slip_angle",
    "slip_angle_printed",
    "slope_threshold",
    "virtual_angle",
    "virtual_radius",
    "why_not",
]


def normalized_curvature(d_x: ArrayLike, r_kappa: ArrayLike) -> Numbers:
    """Return κ_n of (15): contact distance over radius of curvature, both in mm; NaN unless both
    are positive.

    >>> normalized_curvature(50.0, 100.0)
    0.5
    """
    return _positive_ratio(d_x, r_kappa)


def normalized_radius(d_x: ArrayLike, r_kappa: ArrayLike) -> Numbers:
    """Return r_n = 1/κ_n, both arguments in mm; NaN unless both are positive."""
    return _positive_ratio(r_kappa, d_x)


@elementwise
def initial_contact(r_n: ArrayLike, beta_0: ArrayLike) -> tuple[Numbers, Numbers]:
    """Return (y_c, z_c) of (26)–(28): the first contact from the centre, r_n (cos β_0, sin β_0)."""
    return circle.inside(r_n, 0.0, beta_0, r_n * np.cos(beta_0), r_n * np.sin(beta_0))


@elementwise
def virtual_angle(r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike) -> Numbers:
    """Return ζ of (25) and (29), in rad: direction of the virtual point from the centre."""
    zeta = beta_0 + circle.turn(theta / r_n, beta_0)
    return circle.inside(r_n, theta, beta_0, zeta)[0]


@elementwise
def virtual_radius(r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike) -> Numbers:
    """Return p of (32): distance of the virtual point from the centre, over d_x."""
    p = r_n * circle.relative_virtual_radius(theta / r_n, beta_0)
    return circle.inside(r_n, theta, beta_0, p)[0]


def slip_angle(r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike, alpha: ArrayLike) -> Numbers:
    """Return φ, exact, in rad: (23) with the friction cone at the contact point, ζ − asin(r_n sin α
    / p).
    """
    require_friction_angle("alpha", alpha)
    return circle.exact(r_n, theta, beta_0, alpha)[0]


def slip_angle_printed(
    r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike, alpha: ArrayLike
) -> Numbers:
    """Return φ of (24) as printed, in rad: max(0, ζ − α) with ζ at the virtual point."""
    require_friction_angle("alpha", alpha)
    return circle.printed(r_n, theta, beta_0, alpha)[0]


def deflection(r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike, alpha: ArrayLike) -> Numbers:
    """Return d of (31) with the exact φ: the deflection in the sensing plane, over d_x."""
    require_friction_angle("alpha", alpha)
    return circle.exact(r_n, theta, beta_0, alpha)[1]


def deflection_printed(
    r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike, alpha: ArrayLike
) -> Numbers:
    """Return d of (31) with φ of (24) as printed, over d_x."""
    require_friction_angle("alpha", alpha)
    return circle.printed(r_n, theta, beta_0, alpha)[1]


def moments(
    r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike, alpha: ArrayLike
) -> tuple[Numbers, Numbers]:
    """Return (m_y, m_z) of (22) with the exact φ, over C/d_x: d sin φ, d cos φ."""
    require_friction_angle("alpha", alpha)
    return _components(*circle.exact(r_n, theta, beta_0, alpha))


def moments_printed(
    r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike, alpha: ArrayLike
) -> tuple[Numbers, Numbers]:
    """Return (m_y, m_z) of (22) with φ of (24) as printed, over C/d_x."""
    require_friction_angle("alpha", alpha)
    return _components(*circle.printed(r_n, theta, beta_0, alpha))


@elementwise
def curvature_of_slip(rate: ArrayLike, phi_0: ArrayLike, alpha: ArrayLike) -> Numbers:
    """Return κ_n from the rate dφ/dθ at θ = 0, where φ = φ_0: rate cos α / sin φ_0.

    It is (23) with the exact φ. Below zero the surface curves towards the whisker. NaN where
    nothing slips (φ_0 = 0).
    """
    require_friction_angle("alpha", alpha)
    slipping = (np.abs(phi_0) > 0) & (np.abs(phi_0) + alpha < RIGHT_ANGLE)
    return np.where(slipping, rate * np.cos(alpha) / np.sin(phi_0), np.nan)


@elementwise
def curvature_of_slip_printed(rate: ArrayLike, phi_0: ArrayLike, alpha: ArrayLike) -> Numbers:
    """Return κ_n by (24) and (25) as printed, φ = ζ − α: rate / sin β_0 with β_0 = φ_0 + α."""
    require_friction_angle("alpha", alpha)
    slipping = (np.abs(phi_0) > 0) & (np.abs(phi_0) + alpha < RIGHT_ANGLE)
    return np.where(slipping, rate / np.sin(phi_0 + np.copysign(alpha, phi_0)), np.nan)


def why_not(
    r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike, alpha: ArrayLike = 0.0
) -> str | np.ndarray:
    """Return a sentence why this module gives NaN for these arguments; empty inside the domain."""
    require_friction_angle("alpha", alpha)
    arguments = np.broadcast_arrays(r_n, theta, beta_0, alpha)
    r_n, theta, beta_0, alpha = (a.astype(float) for a in arguments)
    with np.errstate(all="ignore"):
        phi = circle.exact(r_n, theta, beta_0, alpha)[0]
        passed = (SLIP_ANGLE_TOO_LARGE, np.isfinite(phi))
        return first_failure((*circle.conditions(r_n, theta, beta_0), passed), r_n.shape)


@elementwise
def _positive_ratio(above, below):
    """Return above / below; NaN unless both are positive and the ratio is finite."""
    ratio = above / below
    return np.where((above > 0) & (below > 0) & np.isfinite(ratio), ratio, np.nan)


@elementwise
def _components(phi, d):
    """Split a deflection into its components (d sin φ, d cos φ)."""
    return d * np.sin(phi), d * np.cos(phi)
