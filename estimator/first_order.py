"""The error of (10) to first order in θ, term by term, as shares of d_x; derived in docs/maps.md.

(10) takes small angles, and a contact that slips along a line across the whisker. Each function is
one effect that this leaves out, with its sign in the error (estimate less truth). Angles in rad,
lengths in mm.
"""

import numpy as np
from numpy.typing import ArrayLike

from estimator.domain import RIGHT_ANGLE, Numbers, elementwise

# A contact that does not slip sideways is held at some slope β from 0 to α, which no moment
# determines. The share of friction that is left to act along the whisker is √(1 − (tan β/tan α)²).

# [1] Its mean over such slopes. Derived.
HELD_SHARE = np.pi / 4
# [1] Its standard deviation over such slopes. Derived.
HELD_SPREAD = np.sqrt(2 / 3 - HELD_SHARE**2)


@elementwise
def leaning(theta: ArrayLike, psi: ArrayLike, phi: ArrayLike, alpha: ArrayLike) -> Numbers:
    """Return ½ θ tan ψ sin φ / cos α: slip along an object that leans by ψ, thus along the whisker.

    >>> round(leaning(0.05, 0.1, 0.5, 0.2), 8)
    0.00122703
    """
    return 0.5 * theta * np.tan(psi) * np.sin(np.abs(phi)) / np.cos(alpha)


@elementwise
def rolling(
    theta: ArrayLike,
    reach: ArrayLike,
    phi: ArrayLike,
    alpha: ArrayLike,
    d_x: ArrayLike,
    thickness: ArrayLike,
) -> Numbers:
    """Return −θ (R/d_x) cos β (½/w − ⅛), β = φ + α: rolling over a round object towards the base.

    reach: R, radii of object and whisker together; thickness: w, the diameter at d_x over the
    base's. Where the contact is held (φ = 0), its slope is taken as 0.

    >>> round(rolling(0.05, 3.0, 0.0, 0.0, 60.0, 1.0), 8)
    -0.0009375
    """
    slope = np.minimum(np.abs(phi) + alpha, RIGHT_ANGLE)
    return rolling_at(theta, reach, np.where(phi == 0, 0.0, slope), d_x, thickness)


@elementwise
def rolling_at(
    theta: ArrayLike, reach: ArrayLike, beta: ArrayLike, d_x: ArrayLike, thickness: ArrayLike
) -> Numbers:
    """Return −θ (R/d_x) cos β (½/w − ⅛): rolling at a known slope β, whether the contact is held or
    not.

    >>> round(rolling_at(0.05, 3.0, 0.0, 60.0, 1.0), 8)
    -0.0009375
    """
    return -theta * reach / d_x * np.cos(beta) * (0.5 / thickness - 0.125)


@elementwise
def dragging(theta: ArrayLike, alpha: ArrayLike) -> Numbers:
    """Return −⅕ θ tan α: friction along the whisker alone pulls at it, and makes it stiffer.

    >>> round(dragging(0.05, 0.4), 8)
    -0.00422793
    """
    return -0.2 * theta * np.tan(alpha)


@elementwise
def bending_far(theta: ArrayLike, thickness: ArrayLike) -> Numbers:
    """Return θ² / (6 w): angles that are not small, to their second order.

    >>> round(bending_far(0.3, 1.0), 8)
    0.015
    """
    return theta**2 / (6 * thickness)
