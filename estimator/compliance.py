"""Distance and stiffness of a yielding object, from two whisks at two distances.

Section VII; Kaneko 1998.

An object of stiffness k gives way by F/k under the contact force F = m/d_x, so that without lateral
slip

    k_θ = θ/m = d/C + 1/(k d_x²),   1/d = 1/d_x − τ.

Two whisks from bases a known shift apart give two such equations. Lengths in mm, k in N/mm, C = 3EI
in N·mm² at the base; taper_per_mm, τ: share of its diameter that the whisker loses per mm
(`Beam.taper` over its length).
"""

import numpy as np
from numpy.typing import ArrayLike

from estimator.domain import Numbers, elementwise, require_positive, require_sigma


@elementwise
def compliance_on_soft_object(
    d_x: ArrayLike, stiffness: ArrayLike, C: ArrayLike, taper_per_mm: ArrayLike = 0.0
) -> Numbers:
    """Return k_θ, rad/(N·mm), of a whisker that touches an object of the given stiffness at d_x.

    d_x in mm, stiffness in N/mm; NaN unless both are positive and d_x is on the whisker.
    """
    require_positive("C", C, "N·mm²")
    inside = (d_x > 0) & (stiffness > 0) & (taper_per_mm * d_x < 1)
    compliance = _rigid(d_x, C, taper_per_mm) + 1 / (stiffness * d_x * d_x)
    return np.where(inside, compliance, np.nan)


@elementwise
def two_distances(
    compliance_near: ArrayLike,
    compliance_far: ArrayLike,
    shift: ArrayLike,
    C: ArrayLike,
    taper_per_mm: ArrayLike = 0.0,
) -> tuple[Numbers, Numbers]:
    """Solve for (d_x, k): distance of the nearer whisk in mm, stiffness of the object in N/mm.

    compliance_near and compliance_far are k_θ of (1) in rad/(N·mm), as of
    `distance.rotational_compliance`; the second whisk is made `shift` mm farther away. The
    stiffness is infinite where the object yields no more than a rigid one, as it may within the
    noise; both are NaN where no distance explains the two compliances. shift ≤ 0 or C ≤ 0 raises
    ValueError.

    With K = C k_θ the cubic terms of a cylinder's (K_1 − d) d² = (K_2 − d − s)(d + s)² cancel, and
    the larger root of a quadratic remains; of a whisker that tapers it is the largest root of a
    quartic.
    """
    require_positive("C", C, "N·mm²")
    require_positive("shift", shift, "mm")
    near = C * compliance_near
    far = C * compliance_far
    cylinder = _cylinder_root(near, far, shift)
    d_x = np.where(taper_per_mm > 0, _tapered_root(near, far, shift, taper_per_mm), cylinder)
    give = near - C * _rigid(d_x, C, taper_per_mm)
    possible = (near > 0) & (d_x > 0) & np.isfinite(d_x)
    stiffness = C / (np.maximum(give, 0.0) * d_x * d_x)
    return np.where(possible, d_x, np.nan), np.where(possible, stiffness, np.nan)


def _rigid(d_x, C, taper_per_mm):
    """Return k_θ against a rigid object: (1) of the base's cylinder."""
    return d_x / (C * (1 - taper_per_mm * d_x))


def _cylinder_root(near, far, shift):
    """Find the larger root of (K_1 − d) d² = (K_2 − d − s)(d + s)², mm."""
    square = 3 * shift + near - far
    linear = shift * (2 * far - 3 * shift)
    constant = shift * shift * (far - shift)
    return _positive_root(square, linear, constant)


@np.vectorize
def _tapered_root(near, far, shift, taper):
    """Find the largest root of (K_1 a − d) d² b = (K_2 b − d − s)(d + s)² a on the whisker; NaN
    without.

    a and b are the shares of the base's diameter that are left at d and d + s. At a root without
    negative give the difference of both sides rises, and beyond the largest root it rises to
    infinity.
    """
    if not (taper > 0 and np.isfinite([near, far]).all()):
        return np.nan
    d = np.polynomial.Polynomial([0.0, 1.0])
    a = 1 - taper * d
    b = 1 - taper * (d + shift)
    left = (near * a - d) * d**2 * b
    right = (far * b - d - shift) * (d + shift) ** 2 * a
    roots = (left - right).roots()
    on_whisker = np.isreal(roots) & (roots.real > 0) & (roots.real + shift < 1 / taper)
    return np.max(roots.real[on_whisker], initial=0.0) or np.nan


def _positive_root(square, linear, constant):
    """Return the larger root of square · d² = linear · d + constant, by the form that does not
    cancel.
    """
    root = np.sqrt(linear * linear + 4 * square * constant)
    return np.where(linear >= 0, (linear + root) / (2 * square), 2 * constant / (root - linear))


@elementwise
def give(
    d_x: ArrayLike, compliance: ArrayLike, C: ArrayLike, taper_per_mm: ArrayLike = 0.0
) -> Numbers:
    """Return 1/k, mm/N, of an object at d_x with the measured k_θ: d_x² (k_θ − d/C).

    It may be below zero by noise; NaN unless d_x is positive.

    >>> round(give(50.0, compliance_on_soft_object(50.0, 0.5, 9000.0), 9000.0), 9)
    2.0
    """
    require_positive("C", C, "N·mm²")
    yielding = compliance - _rigid(d_x, C, taper_per_mm)
    return np.where(d_x > 0, d_x * d_x * yielding, np.nan)


@elementwise
def two_distances_moved(
    d_x: ArrayLike,
    give: ArrayLike,
    shift: ArrayLike,
    C: ArrayLike,
    near_change: ArrayLike,
    far_change: ArrayLike,
    taper_per_mm: ArrayLike = 0.0,
) -> tuple[Numbers, Numbers]:
    """Return the changes of d_x (mm) and 1/k (mm/N) of `two_distances` where both compliances
    change.

    To first order, with g = 1/k: δk_θ = (∂/∂d_x) k_θ δd_x + δg / d_x² at both places; the two
    equations are solved for δd_x and δg.
    """
    require_positive("C", C, "N·mm²")
    far = d_x + shift
    near_by_d = _by_distance(d_x, give, C, taper_per_mm)
    far_by_d = _by_distance(far, give, C, taper_per_mm)
    near_by_give = 1 / d_x**2
    far_by_give = 1 / far**2
    determinant = near_by_d * far_by_give - far_by_d * near_by_give
    d_change = (far_by_give * near_change - near_by_give * far_change) / determinant
    give_change = (near_by_d * far_change - far_by_d * near_change) / determinant
    return d_change, give_change


def _by_distance(d_x, give, C, taper_per_mm):
    """Return ∂k_θ/∂d_x = 1/(C (1 − τ d_x)²) − 2 g / d_x³."""
    return 1 / (C * (1 - taper_per_mm * d_x) ** 2) - 2 * give / d_x**3


@elementwise
def two_distances_spread(
    d_x: ArrayLike,
    give: ArrayLike,
    shift: ArrayLike,
    C: ArrayLike,
    near_sigma: ArrayLike,
    far_sigma: ArrayLike,
    shift_sigma: ArrayLike = 0.0,
    taper_per_mm: ArrayLike = 0.0,
) -> tuple[Numbers, Numbers]:
    """Return the sigmas of d_x (mm) and 1/k (mm/N) of `two_distances`.

    They come from the independent errors of both compliances and of the shift, which moves the
    farther place alone.
    """
    require_sigma("near_sigma", near_sigma)
    require_sigma("far_sigma", far_sigma)
    require_sigma("shift_sigma", shift_sigma)
    by_shift = _by_distance(d_x + shift, give, C, taper_per_mm) * shift_sigma
    far_sigma = np.hypot(far_sigma, by_shift)
    d_near, give_near = two_distances_moved(d_x, give, shift, C, near_sigma, 0.0, taper_per_mm)
    d_far, give_far = two_distances_moved(d_x, give, shift, C, 0.0, far_sigma, taper_per_mm)
    return np.hypot(d_near, d_far), np.hypot(give_near, give_far)
