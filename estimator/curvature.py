"""Appendix B: the whisker against a surface of constant lateral curvature. Equations (15),
(22)–(32).

Lengths are over the contact distance d_x, moments over C/d_x: r_n = r_κ/d_x, and at r_n = ∞ the
surface is flat. β_0 is the slope at first touch, θ the pushing angle, α the friction cone angle,
all in rad. (22) then has m_y = d sin φ and m_z = d cos φ.

The slip angle φ and the deflection d are there twice: `printed` by the paper's (24), φ = max(0, ζ −
α) with ζ taken at the virtual point, and `exact`, where the force leaves the normal at the contact
point by α. The printed form is right for α = 0 only.

Both are written with q = θ/r_n so that nothing cancels for large r_n: from p² = r_n² − 2 y_c θ +
θ²,

    d = θ (2 cos β_0 − q) / (√(1 − (p/r_n)² sin² u) + (p/r_n) cos u),   u = ζ − φ.

Domain: r_n > 0, 0 ≤ θ < 2 y_c and below 90°, |β_0| < 90°, |φ| < 90°; beyond it the whisker has
passed the object and the result is NaN. β_0 < 0 mirrors β_0 > 0. α outside [0°, 90°) raises
ValueError.
"""

import numpy as np
from numpy.typing import ArrayLike

from estimator.domain import RIGHT_ANGLE, Numbers, elementwise, require_friction_angle


@elementwise
def virtual_turn(q: ArrayLike, beta_0: ArrayLike) -> Numbers:
    """Return ζ − β_0 of (25) and (29), rad: by how much the push turns the virtual point about the centre."""
    return np.arctan2(q * np.sin(beta_0), 1 - q * np.cos(beta_0))


@elementwise
def virtual_radius(q: ArrayLike, beta_0: ArrayLike) -> Numbers:
    """Return p / r_n of (32): the virtual point's distance from the centre, in radii."""
    return np.hypot(1 - q * np.cos(beta_0), q * np.sin(beta_0))


@elementwise
def exact(
    r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike, alpha: ArrayLike
) -> tuple[Numbers, Numbers]:
    """Return (φ, d) of (23) and (31) with the friction cone at the contact point, rad.

    Where the contact slides, the surface there is steeper than at first touch by δ, φ = β_0 − α +
    δ, and the law of sines reads sin α = sin(α − δ) + q sin φ. It is a quadratic in tan(δ/2), whose
    root is taken without cancellation; its discriminant is the s² = (p/r_n)² − sin² α of d = θ (2
    cos β_0 − q) / (cos α + s).
    """
    require_friction_angle("alpha", alpha)
    slope = np.abs(beta_0)
    q = theta / r_n
    flat_phi = np.maximum(0.0, slope - alpha)
    push = q * np.sin(flat_phi)
    along = np.cos(alpha) - q * np.cos(flat_phi)
    denominator = 2 * np.sin(alpha) + push
    root = np.sqrt(along * along + denominator * push)
    half_delta = np.where(along >= 0, push / (along + root), (root - along) / denominator)
    phi = flat_phi + 2 * np.arctan(half_delta)
    d = theta * (2 * np.cos(slope) - q) / (np.cos(alpha) + root)
    return _where_valid(r_n, theta, beta_0, phi, d, slope > alpha)


@elementwise
def printed(
    r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike, alpha: ArrayLike
) -> tuple[Numbers, Numbers]:
    """Return (φ, d) of (24) and (31), as printed, rad; (24) takes the friction cone at the virtual point."""
    require_friction_angle("alpha", alpha)
    slope = np.abs(beta_0)
    q = theta / r_n
    phi = np.maximum(0.0, slope - alpha + virtual_turn(q, slope))
    chord = 2 * np.cos(slope) - q
    inner = np.hypot(np.cos(alpha), np.sin(alpha) * np.sqrt(q * chord))
    d = theta * chord / (inner + virtual_radius(q, slope) * np.cos(alpha))
    return _where_valid(r_n, theta, beta_0, phi, d, phi > 0)


def _where_valid(r_n, theta, beta_0, phi, d, slides):
    """Return (φ, d) inside the domain: φ = 0 and d = θ where nothing slides, NaN outside."""
    phi = np.where(slides, phi, 0.0)
    d = np.where(slides, d, theta)
    pushes = (theta >= 0) & (theta < RIGHT_ANGLE)
    meets = np.isfinite(beta_0) & (np.abs(beta_0) < RIGHT_ANGLE) & (r_n > 0)
    has_not_passed = theta / r_n < 2 * np.cos(beta_0)
    valid = pushes & meets & has_not_passed & (phi < RIGHT_ANGLE)
    on_its_side = np.copysign(phi, beta_0) + 0.0
    return np.where(valid, on_its_side, np.nan), np.where(valid, d, np.nan)


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
