"""Distance of an object that moves at known speed while it is touched: (2) and (10) with the way that it has come.

The contact lies on the object's surface, which has moved by u θ since touch, u the object's motion per radian of the
motor. With the deflection w = |m| x d/C at the contact's distance x (d: on the base's cylinder), towards the normal

    w cos(β − φ) = θ (x cos β + u_n),   β = φ + α,   d_x = x − u_x θ,

u_n towards the whisker. Where the contact sticks to the object, w cos φ = θ (x − u_y). Axes are those of the contact
frame: x along the whisker at touch, y the way it pushes, z up. The friction acts against the motion over the surface,
so an object that moves faster along itself than the whisker slips turns it round, and one that moves along the whisker
takes its share of it. Angles in rad, lengths in mm.
"""

from dataclasses import dataclass
from math import atan, atan2, cos, hypot, nan, sin, tan

import numpy as np

from estimator import distance, first_order, uncertainty
from estimator.beam import Beam
from estimator.reasons import NamedReason
from estimator.uncertainty import Z_95
from estimator.whisk import Estimate, EstimatorSettings, Whisk

NOT_TOLD = NamedReason(
    "motion_not_stated", "nobody says how the object moves (object_velocity_mm_s)"
)
RUNS_AWAY = NamedReason(
    "object_runs_away", "an object that moves as told would be touched nowhere on the whisker"
)
AMBIGUOUS = NamedReason(
    "two_distances", "or {:.1f} mm: an object that runs away is felt alike at both"
)
_BESIDE = 0.1  # of the distance: at one as near the object would run at nine tenths of the whisker's own speed
_HELD_SIGMAS = 2.0  # of m_y, as in `estimator.builtin.is_held`
_STEPS = np.array(
    [1e-6, 1e-6, 1e-6, 1e-6, 1e-5, 1e-5, 1e-5]
)  # of differences: θ, m_y, m_z, α in parts of 1, u in mm


@dataclass(frozen=True)
class Contact:
    """Where the contact is: d_x_mm as at touch, with the slope it follows from, rad; NaN where there is none. other_mm:
    another distance that explains as much, not above zero where there is none."""

    d_x_mm: float
    beta_rad: float
    other_mm: float = nan


_NOWHERE = Contact(nan, nan)


def held(theta: float, m_y: float, m_z: float, u: np.ndarray, beam: Beam) -> Contact:
    """Contact that sticks to the object, u (3,) mm/rad; its slope is not told.

    >>> beam = Beam.from_rigidity(3000.0, 100.0)
    >>> round(float(held(0.05, 0.0, 7.5, np.zeros(3), beam).d_x_mm), 6)
    60.0
    """
    x, other = _distances(beam.C_Nmm2 * theta / m_z, -u[1], beam)
    return Contact(x - u[0] * theta, nan, other)


def sliding(
    theta: float, m_y: float, m_z: float, alpha: float, u: np.ndarray, beam: Beam
) -> Contact:
    """Contact that slides over the object: up or down along it, whichever agrees with where it has come to.

    >>> beam = Beam.from_rigidity(3000.0, 100.0)
    >>> away = sliding(0.05, 2.0, 6.0, 0.2, np.array([0.0, 10.0, 0.0]), beam)
    >>> round(float(distance.with_friction(0.05, 2.0, 6.0, 0.2, beam.C_Nmm2)), 3), round(float(away.d_x_mm), 3)
    (62.939, 50.468)
    """
    first = -1.0 if m_y < 0 else 1.0
    for way in (first, -first):
        contact, slips = _one_way(way, theta, m_y, m_z, alpha, u, beam)
        if slips * way > 0:
            return contact
    return _one_way(first, theta, m_y, m_z, alpha, u, beam)[0]


def _one_way(way, theta, m_y, m_z, alpha, u, beam) -> tuple[Contact, float]:
    """The contact where the whisker slides to one side (1: up the z of the object), and how far it has slid, mm."""
    phi, m, share, drawn = atan2(m_y, m_z), hypot(m_y, m_z), 1.0, 0.0
    for _ in range(
        4
    ):  # of the share of friction along the object, by the direction of the motion over it
        across = way * atan(share * tan(alpha))
        beta = phi + across
        towards, along = -u[1] * cos(beta) + u[2] * sin(beta), u[1] * sin(beta) + u[2] * cos(beta)
        standing = beam.C_Nmm2 * theta * cos(beta) / (m * cos(across))
        x, other = _distances(standing, towards / cos(beta), beam)
        if not x > 0:
            return _NOWHERE, nan
        deflection = m * x * beam.as_cylinder_mm(x) / beam.C_Nmm2
        slid = theta * (x * sin(beta) - along) - deflection * sin(across)
        share = abs(slid) / max(hypot(slid, u[0] * theta), 1e-12)
        drawn = np.copysign((1 - share**2) ** 0.5, u[0])
    x *= 1 - drawn * first_order.dragging(theta, alpha) / beam.left(x)
    return Contact(x - u[0] * theta, beta, other), slid


def _distances(standing_mm: float, gains_mm: float, beam: Beam) -> tuple[float, float]:
    """The farther and the nearer x with d = standing (1 + gains/x) on the base's cylinder, 1/d = 1/x − τ; NaN of none.

    An object that runs away (gains < 0) is felt alike at both: at the farther it does so at less than half the speed
    with which the whisker follows, at the nearer at more. The farther is taken, but where the whisker is not as long.
    """
    tau = beam.taper / beam.length_mm
    square, linear, constant = (
        1 + standing_mm * tau,
        standing_mm * (1 - tau * gains_mm),
        standing_mm * gains_mm,
    )
    root = linear**2 + 4 * square * constant
    if not root >= 0:
        return nan, nan
    far, near = ((linear + side * root**0.5) / (2 * square) for side in (1.0, -1.0))
    return (near, far) if far > beam.length_mm and near > _BESIDE * far else (far, near)


def known_motion(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """(10) for an object that moves as `Whisk.object_motion` says, (2) where the contact sticks to it.

    Its interval: what one over each end of α_est's makes of it, and 1.96 sigma of the rest, side by side.
    """
    motion, beam = whisk.object_motion, whisk.beam
    if motion is None:
        return Estimate(nan, nan, NOT_TOLD)
    angle_and_moments = whisk.theta_at_rad, whisk.m_y_at_Nmm, whisk.m_z_at_Nmm
    felt = np.array([*angle_and_moments, settings.alpha_est_rad, *motion.per_rad_mm])
    reason = distance.why_not(*angle_and_moments)
    if reason:
        return Estimate(nan, nan, reason)
    solve = _held_at if _is_held(whisk, held(*felt[:3], felt[4:], beam)) else _sliding_at
    contact = solve(felt, beam)
    if not 0 < contact.d_x_mm <= beam.length_mm:
        return Estimate(nan, nan, RUNS_AWAY)
    gradient = _gradient(solve, felt, beam)
    noise = gradient @ _covariance(whisk) @ gradient
    rest = float(
        np.sqrt(noise + (_model_share(whisk, settings, contact.d_x_mm) * contact.d_x_mm) ** 2)
    )
    low, high = _ends(
        solve, felt, beam, contact.d_x_mm, Z_95 * settings.alpha_est_sigma_rad, Z_95 * rest
    )
    sigma = hypot(rest, gradient[3] * settings.alpha_est_sigma_rad)
    status = (
        AMBIGUOUS.format(contact.other_mm) if contact.other_mm > _BESIDE * contact.d_x_mm else ""
    )
    told = (
        {}
        if solve is _held_at
        else {"alpha_est_rad": settings.alpha_est_rad, "beta_rad": contact.beta_rad}
    )
    return Estimate(contact.d_x_mm, sigma, status, low, high, **told, gradient=gradient[:4])


def _held_at(felt: np.ndarray, beam: Beam) -> Contact:
    return held(*felt[:3], felt[4:], beam)


def _sliding_at(felt: np.ndarray, beam: Beam) -> Contact:
    return sliding(*felt[:4], felt[4:], beam)


def _is_held(whisk: Whisk, contact: Contact) -> bool:
    """Is m_y what an object takes along with it, within two sigma?"""
    if not contact.d_x_mm > 0:
        return False
    u, theta, beam = whisk.object_motion.per_rad_mm, whisk.theta_at_rad, whisk.beam
    x = contact.d_x_mm + u[0] * theta
    expected = beam.C_Nmm2 * u[2] * theta / (x * beam.as_cylinder_mm(x))
    return abs(whisk.m_y_at_Nmm - expected) <= _HELD_SIGMAS * whisk.covariance_at[0, 0] ** 0.5


def _gradient(solve, felt: np.ndarray, beam: Beam) -> np.ndarray:
    """Of d_x by θ, m_y, m_z, α and u, (7,), by differences on both sides."""
    changes = np.diag(_STEPS)
    ends = [
        [solve(felt + side * change, beam).d_x_mm for side in (1.0, -1.0)] for change in changes
    ]
    return np.nan_to_num(-np.diff(ends, axis=1)[:, 0] / (2 * _STEPS))


def _covariance(whisk: Whisk) -> np.ndarray:
    """Of what is felt and told but for α, (7, 7)."""
    whole = np.zeros((7, 7))
    whole[0, 0], whole[1:3, 1:3] = whisk.theta_sigma_rad**2, whisk.covariance_at
    whole[0, 1:3] = whole[1:3, 0] = whisk.theta_moment_covariance_at
    whole[4:, 4:] = whisk.object_motion.covariance_mm2
    return whole


def _ends(solve, felt, beam, d_x, half_alpha, rest) -> tuple[float, float]:
    """The 95 % interval: changes by either end of α_est's and by the rest, in squares, as of (10)."""
    ends = []
    for side in (1.0, -1.0):
        other = felt.copy()
        other[3] = min(max(felt[3] + side * half_alpha, 0.0), 1.55)
        there = solve(other, beam).d_x_mm
        ends.append(there if there > 0 else 0.0 if side > 0 else beam.length_mm)
    low, high = (
        d_x - hypot(max(d_x - min(ends), 0.0), rest),
        d_x + hypot(max(max(ends) - d_x, 0.0), rest),
    )
    return max(low, 0.0), min(high, beam.length_mm)


def _model_share(whisk: Whisk, settings: EstimatorSettings, d_x: float) -> float:
    """As of (10): thickness and lean of the object, friction along the whisker, large angles."""
    known = {
        "reach": settings.object_reach_mm,
        "tilt_sigma": settings.tilt_sigma_rad,
        "left": whisk.beam.left(d_x),
    }
    phi = distance.felt_slip_angle(whisk.m_y_at_Nmm, whisk.m_z_at_Nmm)
    return float(
        uncertainty.model_share(whisk.theta_at_rad, phi, settings.alpha_est_rad, d_x, **known)
    )
