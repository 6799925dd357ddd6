"""The whisker on a circle: slip angle and deflection in the sensing plane, the core of Appendix B.

Lengths over the contact distance d_x, angles in rad; arrays in, arrays out. The public side, with
checks of settings and the equations' names, is `estimator.curvature`.
"""

import numpy as np
from numpy.typing import ArrayLike

from estimator.domain import (
    ANGLE_NEGATIVE,
    ANGLE_TOO_LARGE,
    RIGHT_ANGLE,
    VALUE_MISSING,
    Numbers,
    elementwise,
    where_all,
)
from estimator.reasons import NamedReason

RADIUS_NOT_POSITIVE = NamedReason("radius_not_positive", "the radius of curvature is not positive")
FIRST_SLOPE_TOO_STEEP = NamedReason(
    "first_slope_too_steep", "the slope beta_0 is 90 degrees or more"
)
OBJECT_PASSED = NamedReason(
    "object_passed", "the whisker has passed the object: theta is 2 y_c or more"
)


def conditions(
    r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike
) -> tuple[tuple[str, np.ndarray], ...]:
    """Return the conditions on a push against the circle: pairs (what is wrong, mask of what must
    hold).
    """
    known = ~np.isnan(r_n) & np.isfinite(theta) & np.isfinite(beta_0)
    return (
        (VALUE_MISSING, known),
        (RADIUS_NOT_POSITIVE, r_n > 0),
        (ANGLE_NEGATIVE, theta >= 0),
        (ANGLE_TOO_LARGE, theta < RIGHT_ANGLE),
        (FIRST_SLOPE_TOO_STEEP, np.abs(beta_0) < RIGHT_ANGLE),
        (OBJECT_PASSED, theta / r_n < 2 * np.cos(beta_0)),
    )


def inside(
    r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike, *values: ArrayLike
) -> tuple[np.ndarray, ...]:
    """Return the values where `conditions` hold, NaN elsewhere."""
    met = conditions(r_n, theta, beta_0)
    return tuple(where_all(met, value) for value in values)


def turn(q: ArrayLike, beta_0: ArrayLike) -> np.ndarray:
    """Return ζ − β_0, rad: the angle by which the push turns the virtual point about the centre."""
    return np.arctan2(q * np.sin(beta_0), 1 - q * np.cos(beta_0))


def relative_virtual_radius(q: ArrayLike, beta_0: ArrayLike) -> np.ndarray:
    """Return p / r_n: the virtual point's distance from the centre, in radii."""
    return np.hypot(1 - q * np.cos(beta_0), q * np.sin(beta_0))


@elementwise
def exact(
    r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike, alpha: ArrayLike
) -> tuple[Numbers, Numbers]:
    """Return (φ, d) with the friction cone at the contact point.

    Where the contact slides, the surface there is steeper than at first touch by δ, φ = β_0 − α +
    δ, and the law of sines reads sin α = sin(α − δ) + q sin φ. It is a quadratic in tan(δ/2), whose
    root is taken without cancellation; its discriminant is the s² = (p/r_n)² − sin² α of d = θ (2
    cos β_0 − q) / (cos α + s).
    """
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
    """Return (φ, d) of (24) and (31), as printed."""
    slope = np.abs(beta_0)
    q = theta / r_n
    phi = np.maximum(0.0, slope - alpha + turn(q, slope))
    chord = 2 * np.cos(slope) - q
    inner = np.hypot(np.cos(alpha), np.sin(alpha) * np.sqrt(q * chord))
    d = theta * chord / (inner + relative_virtual_radius(q, slope) * np.cos(alpha))
    return _where_valid(r_n, theta, beta_0, phi, d, phi > 0)


def _where_valid(r_n, theta, beta_0, phi, d, slides):
    """Return (φ, d) inside the domain: φ = 0 and d = θ where nothing slides, NaN outside."""
    phi = np.where(slides, phi, 0.0)
    phi = np.where(phi < RIGHT_ANGLE, phi, np.nan)
    phi, d = inside(r_n, theta, beta_0, phi, np.where(slides, d, theta))
    return np.copysign(phi, beta_0) + 0.0, np.where(np.isnan(phi), np.nan, d)
