"""Distance of an object that moves at known speed while it is touched: (2) and (10) with the way
that it has come.

The contact lies on the object's surface, which has moved by u θ since touch, u the object's motion
per radian of the motor. With the deflection w = |m| x d/C at the contact's distance x (d: on the
base's cylinder), towards the normal

    w cos(β − φ) = θ (x cos β + u_n),   β = φ + α,   d_x = x − u_x θ,

u_n towards the whisker. Where the contact sticks to the object, w cos φ = θ (x − u_y). Axes are
those of the contact frame: x along the whisker at touch, y the way it pushes, z up. The friction
acts against the motion over the surface, so an object that moves faster along itself than the
whisker slips turns it round, and one that moves along the whisker takes its share of it. Angles in
rad, lengths in mm.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import atan, atan2, copysign, cos, hypot, nan, sin, sqrt, tan

import numpy as np

from estimator import distance, first_order, uncertainty
from estimator.beam import Beam
from estimator.numerics import RELATIVE_STEP, central_differences
from estimator.reasons import NamedReason
from estimator.uncertainty import Z_95
from estimator.whisk import Estimate, EstimatorSettings, Whisk

MOTION_UNKNOWN = NamedReason(
    "motion_not_stated", "nobody says how the object moves (object_velocity_mm_s)"
)
RUNS_AWAY = NamedReason(
    "object_runs_away", "an object that moves as told would be touched nowhere on the whisker"
)
AMBIGUOUS = NamedReason(
    "two_distances", "or {:.1f} mm: an object that runs away is felt alike at both"
)
# [1] Of the distance: another distance counts from here on, for at one as near as that the object would run
# at nine tenths of the whisker's own speed. Derived.
_LEAST_OTHER = 0.1
# [iterations] Of the share of friction along the object, by the direction of the motion over it. Stated.
_ITERATIONS = 4
# [rad] Steepest friction angle at an end of its interval: friction of 48 times the force across
# holds any bar. Stated.
_STEEPEST_RAD = 1.55


@dataclass(frozen=True)
class MovingContact:
    """Contact with a moving object; NaN where there is none.

    d_x_mm: distance as at touch. beta_rad: slope that it follows from. other_mm: another distance
    that explains as much, not above zero where there is none.
    """

    d_x_mm: float
    beta_rad: float
    other_mm: float = nan


_NOWHERE = MovingContact(nan, nan)


def held(theta: float, m_y: float, m_z: float, u: np.ndarray, beam: Beam) -> MovingContact:
    """Compute the contact that sticks to the object, u (3,) mm/rad; its slope stays unknown.

    >>> beam = Beam.from_rigidity(3000.0, 100.0)
    >>> round(float(held(0.05, 0.0, 7.5, np.zeros(3), beam).d_x_mm), 6)
    60.0
    """
    x, other = _distances(beam.C_Nmm2 * theta / m_z, -u[1], beam)
    return MovingContact(x - u[0] * theta, nan, other)


def sliding(
    theta: float, m_y: float, m_z: float, alpha: float, u: np.ndarray, beam: Beam
) -> MovingContact:
    """Compute the contact that slides over the object: up or down along it, whichever agrees with
    its displacement.

    >>> beam = Beam.from_rigidity(3000.0, 100.0)
    >>> away = sliding(0.05, 2.0, 6.0, 0.2, np.array([0.0, 10.0, 0.0]), beam)
    >>> still = distance.with_friction(0.05, 2.0, 6.0, 0.2, beam.C_Nmm2)
    >>> round(float(still), 3), round(float(away.d_x_mm), 3)
    (62.939, 50.468)
    """
    whisker = _SlidingWhisker(theta, atan2(m_y, m_z), hypot(m_y, m_z), alpha, u, beam)
    up = -1.0 if m_y < 0 else 1.0
    first, first_slip = whisker.contact_to(up)
    if first_slip * up > 0:
        return first
    second, second_slip = whisker.contact_to(-up)
    return second if second_slip * -up > 0 else first


@dataclass(frozen=True, eq=False)
class _SlidingWhisker:
    """Whisker that slides over a moving object.

    theta, phi, alpha: pushing angle, felt slip angle and friction angle, rad; moment: |m|, N·mm; u
    (3,): the object's motion, mm/rad.
    """

    theta: float
    phi: float
    moment: float
    alpha: float
    u: np.ndarray
    beam: Beam

    def contact_to(self, way: float) -> tuple[MovingContact, float]:
        """Compute the contact if it slides to one side (1: up the z of the object), and its slip in
        mm.
        """
        share = 1.0  # of friction that acts along the surface in the sensing plane
        for _ in range(_ITERATIONS):
            cone = way * atan(share * tan(self.alpha))
            beta = self.phi + cone
            x, other = self._distances_at(beta, cone)
            if not x > 0:
                return _NOWHERE, nan
            slip = self._slip(x, beta, cone)
            moved = hypot(slip, self.u[0] * self.theta)
            share = abs(slip) / moved if moved > 0 else 1.0
        along_whisker = copysign(sqrt(1 - share**2), self.u[0])
        dragging = first_order.dragging(self.theta, self.alpha)
        x *= 1 - along_whisker * dragging / self.beam.thickness(x)
        return MovingContact(x - self.u[0] * self.theta, beta, other), slip

    def _distances_at(self, beta: float, cone: float) -> tuple[float, float]:
        """Solve for both distances, mm, on a slope β where the force is turned from the normal by
        `cone`, rad.
        """
        towards = -self.u[1] * cos(beta) + self.u[2] * sin(beta)
        standing = self.beam.C_Nmm2 * self.theta * cos(beta) / (self.moment * cos(cone))
        return _distances(standing, towards / cos(beta), self.beam)

    def _slip(self, x: float, beta: float, cone: float) -> float:
        """Compute how far a contact at x has slipped up the slope β, mm."""
        along = self.u[1] * sin(beta) + self.u[2] * cos(beta)
        deflection = self.moment * x * self.beam.as_cylinder_mm(x) / self.beam.C_Nmm2
        return self.theta * (x * sin(beta) - along) - deflection * sin(cone)


def _distances(standing_mm: float, gains_mm: float, beam: Beam) -> tuple[float, float]:
    """Solve d = standing (1 + gains/x) for the farther and the nearer x, where 1/d = 1/x − τ; NaN
    without a solution.

    d is the distance on the base's cylinder. An object that runs away (gains < 0) is felt alike at
    both: at the farther it does so at less than half the speed with which the whisker follows, at
    the nearer at more. The farther comes first, unless the whisker is not as long.
    """
    tau = beam.taper / beam.length_mm
    square = 1 + standing_mm * tau
    linear = standing_mm * (1 - tau * gains_mm)
    discriminant = linear**2 + 4 * square * (standing_mm * gains_mm)
    if not discriminant >= 0:
        return nan, nan
    root = discriminant**0.5
    far = (linear + root) / (2 * square)
    near = (linear - root) / (2 * square)
    if far > beam.length_mm and near > _LEAST_OTHER * far:
        return near, far
    return far, near


def known_motion(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Estimate the distance by (10) for an object that moves as `Whisk.object_motion` says, by (2)
    where it sticks.

    Its interval is the sum in squares of the changes by either end of α_est's interval and of 1.96
    sigma of the rest.
    """
    beam = whisk.beam
    reason = _why_not(whisk)
    if reason:
        return Estimate(nan, nan, reason)
    inputs = _inputs(whisk, settings)
    sticks = _is_held(whisk, _held_at(inputs, beam))
    solve = _held_at if sticks else _sliding_at
    contact = solve(inputs, beam)
    d_x = contact.d_x_mm
    if not 0 < d_x <= beam.length_mm:
        return Estimate(nan, nan, RUNS_AWAY)
    gradient = _gradient(solve, inputs, beam)
    rest = _sigma_without_alpha(whisk, settings, d_x, gradient)
    half_alpha = Z_95 * settings.alpha_est_sigma_rad
    low, high = _interval(solve, inputs, beam, d_x, half_alpha, Z_95 * rest)
    return Estimate(
        d_x,
        hypot(rest, gradient[3] * settings.alpha_est_sigma_rad),
        _status(contact),
        low,
        high,
        alpha_est_rad=nan if sticks else settings.alpha_est_rad,
        beta_rad=contact.beta_rad,
        gradient=gradient[:4],
    )


def _why_not(whisk: Whisk) -> str:
    """Return the reason for having no distance before it is sought; empty without one."""
    if whisk.object_motion is None:
        return MOTION_UNKNOWN
    return distance.why_not(*whisk.felt)


def _status(contact: MovingContact) -> str:
    """Return that another distance explains as much; empty where none does."""
    is_ambiguous = contact.other_mm > _LEAST_OTHER * contact.d_x_mm
    return AMBIGUOUS.format(contact.other_mm) if is_ambiguous else ""


def _sigma_without_alpha(
    whisk: Whisk, settings: EstimatorSettings, d_x: float, gradient: np.ndarray
) -> float:
    """Return the sigma of d_x, mm, by all but α_est; gradient (7,): its derivative by the
    inputs.
    """
    variance = gradient @ _covariance(whisk) @ gradient
    return float(np.sqrt(variance + (_model_share(whisk, settings, d_x) * d_x) ** 2))


def _inputs(whisk: Whisk, settings: EstimatorSettings) -> np.ndarray:
    """Return (7,): θ, m_y, m_z, α and u, of which the contact is a function."""
    return np.array([*whisk.felt, settings.alpha_est_rad, *whisk.object_motion.per_rad_mm])


def _held_at(inputs: np.ndarray, beam: Beam) -> MovingContact:
    """Compute the contact that sticks, from inputs (7,)."""
    theta, m_y, m_z = inputs[:3]
    return held(theta, m_y, m_z, inputs[4:], beam)


def _sliding_at(inputs: np.ndarray, beam: Beam) -> MovingContact:
    """Compute the contact that slides, from inputs (7,)."""
    theta, m_y, m_z, alpha = inputs[:4]
    return sliding(theta, m_y, m_z, alpha, inputs[4:], beam)


def _is_held(whisk: Whisk, contact: MovingContact) -> bool:
    """Check whether m_y is, within two sigma, that of an object which takes the whisker along with
    it.
    """
    if not contact.d_x_mm > 0:
        return False
    u = whisk.object_motion.per_rad_mm
    theta = whisk.theta_at_rad
    x = contact.d_x_mm + u[0] * theta
    expected = whisk.beam.C_Nmm2 * u[2] * theta / (x * whisk.beam.as_cylinder_mm(x))
    return whisk.feels_m_y(expected)


def _gradient(solve: Callable, inputs: np.ndarray, beam: Beam) -> np.ndarray:
    """Compute the derivative (7,) of d_x by θ, m_y, m_z, α and u, by differences on both sides."""
    moment = hypot(inputs[1], inputs[2])
    d_x_mm = solve(inputs, beam).d_x_mm
    sizes = np.array([inputs[0], moment, moment, 1.0, d_x_mm, d_x_mm, d_x_mm])
    steps = RELATIVE_STEP * sizes
    gradient = central_differences(lambda at: solve(at, beam).d_x_mm, inputs, steps)
    return np.nan_to_num(gradient)


def _covariance(whisk: Whisk) -> np.ndarray:
    """Return the covariance (7, 7) of the inputs, that of α left at zero."""
    whole = np.zeros((7, 7))
    whole[:3, :3] = whisk.felt_covariance
    whole[4:, 4:] = whisk.object_motion.covariance_mm2
    return whole


def _interval(solve, inputs, beam, d_x, half_alpha, rest) -> tuple[float, float]:
    """Return the 95 % interval: changes by either end of α_est's and by the rest, in squares, as
    for (10).
    """
    steep = _d_x_at(solve, inputs, beam, inputs[3] + half_alpha)
    flat = _d_x_at(solve, inputs, beam, inputs[3] - half_alpha)
    at_steep = steep if steep > 0 else 0.0
    at_flat = flat if flat > 0 else beam.length_mm
    nearer = max(d_x - min(at_steep, at_flat), 0.0)
    farther = max(max(at_steep, at_flat) - d_x, 0.0)
    low = d_x - hypot(nearer, rest)
    high = d_x + hypot(farther, rest)
    return max(low, 0.0), min(high, beam.length_mm)


def _d_x_at(solve, inputs, beam, alpha) -> float:
    """Compute the distance at another friction angle, which is kept within its range."""
    changed = inputs.copy()
    changed[3] = min(max(alpha, 0.0), _STEEPEST_RAD)
    return solve(changed, beam).d_x_mm


def _model_share(whisk: Whisk, settings: EstimatorSettings, d_x: float) -> float:
    """Return the relative sigma of d_x by what (10) leaves out, and by the taper.

    That is thickness and lean of the object, friction along the whisker, large angles.
    """
    share = uncertainty.model_share(
        whisk.theta_at_rad,
        whisk.phi_rad,
        settings.alpha_est_rad,
        d_x,
        reach=settings.object_reach_mm,
        tilt_sigma=settings.tilt_sigma_rad,
        thickness=whisk.beam.thickness(d_x),
    )
    return float(np.hypot(share, whisk.beam.share_by_taper(d_x)))
