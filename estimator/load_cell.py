"""Radial distance from force and moment at the base (Table I: Tsujimura, Scholz & Rahn, Clements &
Rahn; [21], [37]).

Axes are the hub's. f: force that the base exerts on the whisker, N; m = P × f: moment, N·mm; so the
contact P lies on the line of action of f. No angle of touch, slope or friction is needed, and the
beam only for how far the contact is bent back, which counts to second order in θ. Angles in rad,
lengths in mm. The moment and force about the whisker's own axis: m_x follows from m · f = 0 and
adds no information.
"""

import numpy as np
from numpy.typing import ArrayLike

from estimator import first_order
from estimator.beam import Beam
from estimator.domain import (
    NOT_PUSHING,
    VALUE_MISSING,
    Numbers,
    elementwise,
    first_failure,
    where_all,
)
from estimator.reasons import NamedReason

FORCE_UNLIKE_MOMENT = NamedReason(
    "force_unlike_moment", "the force at the base is not the one that its moment asks for"
)

# [iterations] Of the contact's deflection by its distance: each brings two orders of θ. Derived.
_ITERATIONS = 3


@elementwise
def lever(
    m_y: ArrayLike, m_z: ArrayLike, f_x: ArrayLike, f_y: ArrayLike, f_z: ArrayLike
) -> Numbers:
    """Compute |m|/|f|, mm: how far the line of action passes the base.

    As an estimate of d_x it is too short by the share of the force that acts along the whisker.

    >>> lever(0.0, 3.0, 0.0, 0.06, 0.0)
    50.0
    """
    m_y, m_z, f_x, f_y, f_z = _broadcast(m_y, m_z, f_x, f_y, f_z)
    distance = np.hypot(m_y, m_z) / np.sqrt(f_x**2 + f_y**2 + f_z**2)
    return where_all(_conditions(m_y, m_z, f_x, f_y, f_z), distance)


@elementwise
def across(m_y: ArrayLike, m_z: ArrayLike, f_y: ArrayLike, f_z: ArrayLike) -> Numbers:
    """Compute the force across the whisker, N, in the plane of m: (f_y m_z − f_z m_y) / |m|."""
    return (f_y * m_z - f_z * m_y) / np.hypot(m_y, m_z)


def distance(
    theta: ArrayLike,
    m_y: ArrayLike,
    m_z: ArrayLike,
    f_x: ArrayLike,
    f_y: ArrayLike,
    f_z: ArrayLike,
    beam: Beam,
) -> Numbers:
    """Compute d_x, mm: where the line of action meets the bent whisker, turned from the hub's axes
    to those at touch.

    In the plane of bending |m| = x f + w f_x, w = |m| x d/C the deflection there ((18), d the
    distance on the base's cylinder); d_x = x cos θ + w cos φ sin θ, for the contact moves in the
    sensing plane, which is fixed where it first touched. Within 0.01 % of an exact rod to θ = 3°,
    but for `rolling` and `leaning`. NaN where the force or the moment does not push; `why_not` says
    which.
    """
    theta = np.asarray(theta, dtype=float)
    m_y, m_z, f_x, f_y, f_z = _broadcast(m_y, m_z, f_x, f_y, f_z)
    with np.errstate(all="ignore"):
        moment = np.hypot(m_y, m_z)
        force = across(m_y, m_z, f_y, f_z)
        x = moment / force
        for _ in range(_ITERATIONS):
            w = moment * x * beam.as_cylinder_mm(x) / beam.C_Nmm2
            x = (moment - w * f_x) / force
        d_x = x * np.cos(theta) + w * m_z / moment * np.sin(theta)
        positive = np.where((d_x > 0) & np.isfinite(d_x), d_x, np.nan)
        return where_all(_conditions(m_y, m_z, f_x, f_y, f_z), positive)[()]


def _broadcast(*numbers):
    """Return numbers as float arrays of their common shape."""
    arrays = [np.asarray(number, dtype=float) for number in numbers]
    return np.broadcast_arrays(*arrays)


def relative_gradient(m_y: float, m_z: float, f_y: float, f_z: float) -> np.ndarray:
    """Compute ∂ln d_x/∂(m_y, m_z, f_x, f_y, f_z), (5,), of |m|² / (f_y m_z − f_z m_y).

    f_x and θ enter to second order.
    """
    square = m_y**2 + m_z**2
    power = f_y * m_z - f_z * m_y
    by_y = 2 * m_y / square + f_z / power
    by_z = 2 * m_z / square - f_y / power
    return np.array([by_y, by_z, 0.0, -m_z / power, m_y / power])


@elementwise
def rolling(
    theta: ArrayLike, reach: ArrayLike, phi: ArrayLike, d_x: ArrayLike, thickness: ArrayLike
) -> Numbers:
    """Return −½ θ (R/d_x) cos β / w, at most: the share of d_x by which the contact rolls towards
    the base.

    reach: R, radii of object and whisker together; thickness: w, the diameter at d_x over the base's. β
    is at least φ.

    >>> round(rolling(0.05, 3.0, 0.0, 60.0, 1.0), 8)
    -0.00125
    """
    return -0.5 * theta * reach / d_x * np.cos(phi) / thickness


@elementwise
def leaning(theta: ArrayLike, psi: ArrayLike, phi: ArrayLike, alpha: ArrayLike) -> Numbers:
    """Return θ tan ψ sin φ / cos α, the share of d_x by which the contact moves along the whisker.

    It does so as it slips along an object that leans by ψ. The share is twice that of (10), which
    feels the whole way there.
    """
    return 2 * first_order.leaning(theta, psi, phi, alpha)


def why_not(
    m_y: ArrayLike, m_z: ArrayLike, f_x: ArrayLike, f_y: ArrayLike, f_z: ArrayLike
) -> str | np.ndarray:
    """Return why there is no distance for these arguments, a sentence; empty where there is one."""
    m_y, m_z, f_x, f_y, f_z = _broadcast(m_y, m_z, f_x, f_y, f_z)
    with np.errstate(all="ignore"):
        return first_failure(_conditions(m_y, m_z, f_x, f_y, f_z), m_y.shape)


def _conditions(m_y, m_z, f_x, f_y, f_z):
    """Return pairs (what is wrong, mask of what must hold) of arrays of one shape."""
    finite = np.isfinite([m_y, m_z, f_x, f_y, f_z]).all(axis=0)
    power = f_y * m_z - f_z * m_y
    return (
        (VALUE_MISSING, finite),
        (NOT_PUSHING, m_z > 0),
        (FORCE_UNLIKE_MOMENT, power > 0),
    )
