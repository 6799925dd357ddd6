"""Distance and stiffness of a yielding object, from two whisks at two distances (section VII, Kaneko 1998).

An object of stiffness k gives way by F/k under the contact force F = m/d_x, so that without lateral slip

    k_θ = θ/m = d/C + 1/(k d_x²),   1/d = 1/d_x − τ.

Two whisks from bases a known shift apart give two such equations. Lengths in mm, k in N/mm, C = 3EI in N·mm² at the
base; taper_per_mm, τ: share of its diameter that the whisker loses a mm (`Beam.taper` over its length).
"""

import numpy as np
from numpy.typing import ArrayLike

from estimator.domain import Numbers, elementwise, require_positive, require_sigma


@elementwise
def compliance_on_soft_object(
    d_x: ArrayLike, stiffness: ArrayLike, C: ArrayLike, taper_per_mm: ArrayLike = 0.0
) -> Numbers:
    """k_θ in rad/(N·mm) of a whisker that touches an object of the given stiffness [N/mm] at d_x [mm]."""
    require_positive("C", C, "N·mm²")
    inside = (d_x > 0) & (stiffness > 0) & (taper_per_mm * d_x < 1)
    return np.where(inside, _rigid(d_x, C, taper_per_mm) + 1 / (stiffness * d_x * d_x), np.nan)


@elementwise
def two_distances(
    compliance_near: ArrayLike,
    compliance_far: ArrayLike,
    shift: ArrayLike,
    C: ArrayLike,
    taper_per_mm: ArrayLike = 0.0,
) -> tuple[Numbers, Numbers]:
    """(d_x, k): distance of the nearer whisk in mm, stiffness of the object in N/mm.

    compliance_near and compliance_far are k_θ of (1) in rad/(N·mm), as of `distance.rotational_compliance`; the
    second whisk is made `shift` mm farther away. The stiffness is infinite where the object yields no more than a
    rigid one, as it may within the noise; both are NaN where no distance explains the two compliances. shift ≤ 0 or
    C ≤ 0 raises ValueError.

    With K = C k_θ the cubic terms of a cylinder's (K_1 − d) d² = (K_2 − d − s)(d + s)² cancel, and a quadratic remains;
    of a whisker that tapers the larger root of a quartic is taken, too.
    """
    require_positive("C", C, "N·mm²")
    require_positive("shift", shift, "mm")
    near, far = C * compliance_near, C * compliance_far
    square = 3 * shift + near - far
    linear = shift * (2 * far - 3 * shift)
    constant = shift * shift * (far - shift)
    cylinder = _positive_root(square, linear, constant)
    d_x = np.where(taper_per_mm > 0, _tapered_root(near, far, shift, taper_per_mm), cylinder)
    give = near - C * _rigid(d_x, C, taper_per_mm)
    possible = (near > 0) & (d_x > 0) & np.isfinite(d_x)
    stiffness = C / (np.maximum(give, 0.0) * d_x * d_x)
    return np.where(possible, d_x, np.nan), np.where(possible, stiffness, np.nan)


def _rigid(d_x, C, taper_per_mm):
    """k_θ against a rigid object: (1) of the base's cylinder."""
    return d_x / (C * (1 - taper_per_mm * d_x))


@np.vectorize
def _tapered_root(near, far, shift, taper):
    """Largest root of (K_1 a − d) d² b = (K_2 b − d − s)(d + s)² a on the whisker, a and b the shares of the base's
    diameter that are left at d and d + s; NaN without one.

    A root with give, or none, is one where the difference rises, and beyond the largest it rises to infinity.
    """
    if not (taper > 0 and np.isfinite([near, far]).all()):
        return np.nan
    d = np.polynomial.Polynomial([0.0, 1.0])
    a, b = 1 - taper * d, 1 - taper * (d + shift)
    roots = ((near * a - d) * d**2 * b - (far * b - d - shift) * (d + shift) ** 2 * a).roots()
    on_whisker = np.isreal(roots) & (roots.real > 0) & (roots.real + shift < 1 / taper)
    return np.max(roots.real[on_whisker], initial=0.0) or np.nan


def _positive_root(square, linear, constant):
    """Larger root of square · d² = linear · d + constant, by whichever form does not cancel."""
    root = np.sqrt(linear * linear + 4 * square * constant)
    return np.where(linear >= 0, (linear + root) / (2 * square), 2 * constant / (root - linear))


@elementwise
def give(
    d_x: ArrayLike, compliance: ArrayLike, C: ArrayLike, taper_per_mm: ArrayLike = 0.0
) -> Numbers:
    """1/k, mm/N, of an object at d_x whose compliance k_θ was felt: d_x² (k_θ − d/C); below zero by noise.

    >>> round(give(50.0, compliance_on_soft_object(50.0, 0.5, 9000.0), 9000.0), 9)
    2.0
    """
    require_positive("C", C, "N·mm²")
    return np.where(d_x > 0, d_x * d_x * (compliance - _rigid(d_x, C, taper_per_mm)), np.nan)


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
    """(change of d_x in mm, of 1/k in mm/N) of `two_distances` where both compliances change, to first order.

    With g = 1/k, δk_θ = (∂/∂d_x) k_θ δd_x + δg / d_x² at both places; the two are solved for δd_x and δg.
    """
    require_positive("C", C, "N·mm²")
    far = d_x + shift
    near_by_d, near_by_give = _by_distance(d_x, give, C, taper_per_mm), 1 / d_x**2
    far_by_d, far_by_give = _by_distance(far, give, C, taper_per_mm), 1 / far**2
    determinant = near_by_d * far_by_give - far_by_d * near_by_give
    d_change = (far_by_give * near_change - near_by_give * far_change) / determinant
    return d_change, (near_by_d * far_change - far_by_d * near_change) / determinant


def _by_distance(d_x, give, C, taper_per_mm):
    """∂k_θ/∂d_x = 1/(C (1 − τ d_x)²) − 2 g / d_x³."""
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
    """(sigma of d_x in mm, sigma of 1/k in mm/N) of `two_distances` by those of both compliances and of the shift,
    which err apart from each other. The shift moves the farther place alone.
    """
    require_sigma("near_sigma", near_sigma)
    require_sigma("far_sigma", far_sigma)
    require_sigma("shift_sigma", shift_sigma)
    by_shift = _by_distance(d_x + shift, give, C, taper_per_mm) * shift_sigma
    places = (near_sigma, 0.0), (0.0, np.hypot(far_sigma, by_shift))
    moved = [two_distances_moved(d_x, give, shift, C, *changes, taper_per_mm) for changes in places]
    return tuple(np.hypot(*changes) for changes in zip(*moved))


def two_distances_sigma(
    d_x: ArrayLike,
    stiffness: ArrayLike,
    shift: ArrayLike,
    C: ArrayLike,
    near_sigma: ArrayLike,
    far_sigma: ArrayLike,
) -> tuple[Numbers, Numbers]:
    """(sigma of d_x in mm, sigma of k in N/mm) of `two_distances`, see `two_distances_spread`."""
    stiffness = np.asarray(stiffness, dtype=float)
    d_sigma, give_sigma = two_distances_spread(d_x, 1 / stiffness, shift, C, near_sigma, far_sigma)
    return d_sigma, (give_sigma * stiffness**2)[()]
