"""Distance and stiffness of a yielding object, from two whisks at two distances (section VII, Kaneko 1998).

An object of stiffness k gives way by F/k under the contact force F = m/d_x, so that without lateral slip

    k_θ = θ/m = d_x/C + 1/(k d_x²).

Two whisks from bases a known shift apart give two such equations. Lengths in mm, k in N/mm, C = 3EI in N·mm².
"""

import numpy as np
from numpy.typing import ArrayLike

from estimator.domain import Numbers, elementwise, require_positive, require_sigma


@elementwise
def compliance_on_soft_object(d_x: ArrayLike, stiffness: ArrayLike, C: ArrayLike) -> Numbers:
    """k_θ in rad/(N·mm) of a whisker that touches an object of the given stiffness [N/mm] at d_x [mm]."""
    require_positive("C", C, "N·mm²")
    inside = (d_x > 0) & (stiffness > 0)
    return np.where(inside, d_x / C + 1 / (stiffness * d_x * d_x), np.nan)


@elementwise
def two_distances(
    compliance_near: ArrayLike, compliance_far: ArrayLike, shift: ArrayLike, C: ArrayLike
) -> tuple[Numbers, Numbers]:
    """(d_x, k): distance of the nearer whisk in mm, stiffness of the object in N/mm.

    compliance_near and compliance_far are k_θ of (1) in rad/(N·mm), as of `distance.rotational_compliance`; the
    second whisk is made `shift` mm farther away. The stiffness is infinite where the object yields no more than a
    rigid one, as it may within the noise; both are NaN where no distance explains the two compliances. shift ≤ 0 or
    C ≤ 0 raises ValueError.

    With K = C k_θ the cubic terms of (K_1 − d) d² = (K_2 − d − s)(d + s)² cancel, and a quadratic remains.
    """
    require_positive("C", C, "N·mm²")
    require_positive("shift", shift, "mm")
    near, far = C * compliance_near, C * compliance_far
    square = 3 * shift + near - far
    linear = shift * (2 * far - 3 * shift)
    constant = shift * shift * (far - shift)
    d_x = _positive_root(square, linear, constant)
    give = near - d_x
    possible = (near > 0) & (d_x > 0) & np.isfinite(d_x)
    stiffness = C / (np.maximum(give, 0.0) * d_x * d_x)
    return np.where(possible, d_x, np.nan), np.where(possible, stiffness, np.nan)


def _positive_root(square, linear, constant):
    """Larger root of square · d² = linear · d + constant, by whichever form does not cancel."""
    root = np.sqrt(linear * linear + 4 * square * constant)
    return np.where(linear >= 0, (linear + root) / (2 * square), 2 * constant / (root - linear))


@elementwise
def give(d_x: ArrayLike, compliance: ArrayLike, C: ArrayLike) -> Numbers:
    """1/k, mm/N, of an object at d_x whose compliance k_θ was felt: k_θ d² − d³/C; below zero by noise.

    >>> round(give(50.0, compliance_on_soft_object(50.0, 0.5, 9000.0), 9000.0), 9)
    2.0
    """
    require_positive("C", C, "N·mm²")
    return np.where(d_x > 0, d_x * d_x * (compliance - d_x / C), np.nan)


@elementwise
def two_distances_moved(
    d_x: ArrayLike, give: ArrayLike, shift: ArrayLike, C: ArrayLike, near_change: ArrayLike, far_change: ArrayLike
) -> tuple[Numbers, Numbers]:
    """(change of d_x in mm, of 1/k in mm/N) of `two_distances` where both compliances change, to first order.

    With g = 1/k, δk_θ = (1/C − 2 g / d³) δd + δg / d² at both places; the two are solved for δd and δg.
    """
    require_positive("C", C, "N·mm²")
    far = d_x + shift
    near_by_d, near_by_give = 1 / C - 2 * give / d_x**3, 1 / d_x**2
    far_by_d, far_by_give = 1 / C - 2 * give / far**3, 1 / far**2
    determinant = near_by_d * far_by_give - far_by_d * near_by_give
    d_change = (far_by_give * near_change - near_by_give * far_change) / determinant
    return d_change, (near_by_d * far_change - far_by_d * near_change) / determinant


@elementwise
def two_distances_spread(
    d_x: ArrayLike,
    give: ArrayLike,
    shift: ArrayLike,
    C: ArrayLike,
    near_sigma: ArrayLike,
    far_sigma: ArrayLike,
    shift_sigma: ArrayLike = 0.0,
) -> tuple[Numbers, Numbers]:
    """(sigma of d_x in mm, sigma of 1/k in mm/N) of `two_distances` by those of both compliances and of the shift,
    which err apart from each other. The shift moves the farther place alone.
    """
    require_sigma("near_sigma", near_sigma)
    require_sigma("far_sigma", far_sigma)
    require_sigma("shift_sigma", shift_sigma)
    by_shift = (1 / C - 2 * give / (d_x + shift) ** 3) * shift_sigma
    places = (near_sigma, 0.0), (0.0, np.hypot(far_sigma, by_shift))
    moved = [two_distances_moved(d_x, give, shift, C, *changes) for changes in places]
    return tuple(np.hypot(*changes) for changes in zip(*moved))


def two_distances_sigma(
    d_x: ArrayLike, stiffness: ArrayLike, shift: ArrayLike, C: ArrayLike, near_sigma: ArrayLike, far_sigma: ArrayLike
) -> tuple[Numbers, Numbers]:
    """(sigma of d_x in mm, sigma of k in N/mm) of `two_distances`, see `two_distances_spread`."""
    stiffness = np.asarray(stiffness, dtype=float)
    d_sigma, give_sigma = two_distances_spread(d_x, 1 / stiffness, shift, C, near_sigma, far_sigma)
    return d_sigma, (give_sigma * stiffness**2)[()]
