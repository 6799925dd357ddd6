"""Radial distance from force and moment at the base (Table I: Tsujimura, Scholz & Rahn, Clements & Rahn; [21], [37]).

Axes are the hub's. f: force that the base exerts on the whisker, N; m = P × f: moment, N·mm; so the contact P lies on
the line of action of f. No angle of touch, slope or friction is needed, and the beam only for how far the contact is
bent back, which counts to second order in θ. Angles in rad, lengths in mm. The moment and force about the whisker's own
axis: m_x follows from m · f = 0 and tells nothing more.
"""

import numpy as np
from numpy.typing import ArrayLike

from estimator import first_order
from estimator.beam import Beam
from estimator.domain import Numbers, elementwise, first_failure, where_all

_ROUNDS = 3  # of the contact's deflection by its distance: each brings two orders of θ


@elementwise
def lever(
    m_y: ArrayLike, m_z: ArrayLike, f_x: ArrayLike, f_y: ArrayLike, f_z: ArrayLike
) -> Numbers:
    """|m|/|f|, mm: how far the line of action passes the base. As d_x it is short by what acts along the whisker.

    >>> lever(0.0, 3.0, 0.0, 0.06, 0.0)
    50.0
    """
    distance = np.hypot(m_y, m_z) / np.sqrt(f_x**2 + f_y**2 + f_z**2)
    return where_all(_conditions(m_y, m_z, f_x, f_y, f_z), distance)


@elementwise
def across(m_y: ArrayLike, m_z: ArrayLike, f_y: ArrayLike, f_z: ArrayLike) -> Numbers:
    """Force across the whisker, N, in the plane in which m bends it: (f_y m_z − f_z m_y) / |m|."""
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
    """d_x, mm: where the line of action meets the bent whisker, turned from the hub's axes to those at touch.

    In the plane of bending |m| = x f + w f_x, w = |m| x d/C the deflection there ((18), d the distance on the base's
    cylinder); d_x = x cos θ + w cos φ sin θ, for the contact moves in the sensing plane, which stands where it first
    touched. Within 0.01 % of an exact rod to θ = 3°, but for `rolling` and `leaning`. NaN where the force or the
    moment does not push, `why_not` says which.
    """
    theta, *felt = (np.asarray(number, dtype=float) for number in (theta, m_y, m_z, f_x, f_y, f_z))
    m_y, m_z, f_x, f_y, f_z = felt
    with np.errstate(all="ignore"):
        moment, force = np.hypot(m_y, m_z), across(m_y, m_z, f_y, f_z)
        x, w = moment / force, 0.0
        for _ in range(_ROUNDS):
            w = moment * x * beam.as_cylinder_mm(x) / beam.C_Nmm2
            x = (moment - w * f_x) / force
        d_x = x * np.cos(theta) + w * m_z / moment * np.sin(theta)
        good = np.where((d_x > 0) & np.isfinite(d_x), d_x, np.nan)
        return where_all(_conditions(m_y, m_z, f_x, f_y, f_z), good)[()]


def relative_gradient(m_y: float, m_z: float, f_y: float, f_z: float) -> np.ndarray:
    """∂ln d_x/∂(m_y, m_z, f_x, f_y, f_z), (5,), of |m|² / (f_y m_z − f_z m_y): f_x and θ enter to second order."""
    square, power = m_y**2 + m_z**2, f_y * m_z - f_z * m_y
    return np.array(
        [
            2 * m_y / square + f_z / power,
            2 * m_z / square - f_y / power,
            0.0,
            -m_z / power,
            m_y / power,
        ]
    )


@elementwise
def rolling(
    theta: ArrayLike, reach: ArrayLike, phi: ArrayLike, d_x: ArrayLike, left: ArrayLike
) -> Numbers:
    """−½ θ (R/d_x) cos β / w, at most, as a share of d_x: the contact rolls over a round object towards the base.

    reach: R, radii of object and whisker together; left: w, share of the base's diameter at d_x. β is at least φ.

    >>> round(rolling(0.05, 3.0, 0.0, 60.0, 1.0), 8)
    -0.00125
    """
    return -0.5 * theta * reach / d_x * np.cos(phi) / left


@elementwise
def leaning(theta: ArrayLike, psi: ArrayLike, phi: ArrayLike, alpha: ArrayLike) -> Numbers:
    """θ tan ψ sin φ / cos α, as a share of d_x: the contact moves along the whisker as it slips along an object that
    leans by ψ. Twice what (10) has of it, which feels the whole way there."""
    return 2 * first_order.leaning(theta, psi, phi, alpha)


def why_not(
    m_y: ArrayLike, m_z: ArrayLike, f_x: ArrayLike, f_y: ArrayLike, f_z: ArrayLike
) -> str | np.ndarray:
    """Why there is no distance for these arguments, a sentence; empty where there is one."""
    arrays = np.broadcast_arrays(
        *(np.asarray(number, dtype=float) for number in (m_y, m_z, f_x, f_y, f_z))
    )
    with np.errstate(all="ignore"):
        return first_failure(_conditions(*arrays), arrays[0].shape)


def _conditions(m_y, m_z, f_x, f_y, f_z):
    finite = np.logical_and.reduce(
        np.broadcast_arrays(*(np.isfinite(n) for n in (m_y, m_z, f_x, f_y, f_z)))
    )
    return (
        ("a measured value is missing or infinite", finite),
        ("m_z is not positive: the whisker does not push towards the object", m_z > 0),
        (
            "the force at the base is not the one that its moment asks for",
            f_y * m_z - f_z * m_y > 0,
        ),
    )
