"""The whisker on a circle: slip angle and deflection in the sensing plane, the core of Appendix B.

Lengths over the contact distance d_x, angles in rad; arrays in, arrays out. The public side, with checks
of settings and the equations' names, is `estimator.curvature`.
"""

import numpy as np
from numpy.typing import ArrayLike

from estimator.domain import RIGHT_ANGLE, Numbers, elementwise, where_all


def conditions(
    r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike
) -> tuple[tuple[str, np.ndarray], ...]:
    """What a push against the circle must fulfil: pairs (what is wrong, mask of what must hold)."""
    known = ~np.isnan(r_n) & np.isfinite(theta) & np.isfinite(beta_0)
    return (
        ("a measured value is missing or infinite", known),
        ("the radius of curvature is not positive", r_n > 0),
        ("the pushing angle is negative", theta >= 0),
        ("the pushing angle is 90 degrees or more", theta < RIGHT_ANGLE),
        ("the slope beta_0 is 90 degrees or more", np.abs(beta_0) < RIGHT_ANGLE),
        (
            "the whisker has passed the object: theta is 2 y_c or more",
            theta / r_n < 2 * np.cos(beta_0),
        ),
    )


def inside(
    r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike, *values: ArrayLike
) -> tuple[np.ndarray, ...]:
    """The values where `conditions` hold, NaN elsewhere."""
    return tuple(where_all(conditions(r_n, theta, beta_0), value) for value in values)


def turn(q: ArrayLike, beta_0: ArrayLike) -> np.ndarray:
    """ζ − β_0: by how much the push turns the virtual point about the centre."""
    return np.arctan2(q * np.sin(beta_0), 1 - q * np.cos(beta_0))


def relative_virtual_radius(q: ArrayLike, beta_0: ArrayLike) -> np.ndarray:
    """p / r_n."""
    return np.hypot(1 - q * np.cos(beta_0), q * np.sin(beta_0))


@elementwise
def exact(
    r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike, alpha: ArrayLike
) -> tuple[Numbers, Numbers]:
    """(φ, d) with the friction cone at the contact point.

    Where the contact slides, the surface there is steeper than at first touch by δ, φ = β_0 − α + δ, and
    the law of sines reads sin α = sin(α − δ) + q sin φ. It is a quadratic in tan(δ/2), whose root is
    taken without cancellation; its discriminant is the s² = (p/r_n)² − sin² α of d = θ (2 cos β_0 − q) /
    (cos α + s).
    """
    slope, q = np.abs(beta_0), theta / r_n
    flat_phi = np.maximum(0.0, slope - alpha)
    push, along = q * np.sin(flat_phi), np.cos(alpha) - q * np.cos(flat_phi)
    steep = 2 * np.sin(alpha) + push
    root = np.sqrt(along * along + steep * push)
    half_turn = np.where(along >= 0, push / (along + root), (root - along) / steep)
    phi = flat_phi + 2 * np.arctan(half_turn)
    slid = theta * (2 * np.cos(slope) - q) / (np.cos(alpha) + root)
    return _checked(
        r_n, theta, beta_0, np.where(slope > alpha, phi, 0.0), np.where(slope > alpha, slid, theta)
    )


@elementwise
def printed(
    r_n: ArrayLike, theta: ArrayLike, beta_0: ArrayLike, alpha: ArrayLike
) -> tuple[Numbers, Numbers]:
    """(φ, d) of (24) and (31), as printed."""
    slope, q = np.abs(beta_0), theta / r_n
    phi = np.maximum(0.0, slope - alpha + turn(q, slope))
    room = q * (2 * np.cos(slope) - q)
    inner = np.hypot(np.cos(alpha), np.sin(alpha) * np.sqrt(room))
    slid = (
        theta
        * (2 * np.cos(slope) - q)
        / (inner + relative_virtual_radius(q, slope) * np.cos(alpha))
    )
    return _checked(r_n, theta, beta_0, phi, np.where(phi > 0, slid, theta))


def _checked(r_n, theta, beta_0, phi, d):
    phi = np.where(phi < RIGHT_ANGLE, phi, np.nan)
    phi, d = inside(r_n, theta, beta_0, phi, d)
    return np.copysign(phi, beta_0) + 0.0, np.where(np.isnan(phi), np.nan, d)
