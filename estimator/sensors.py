"""The other sensors of the paper's Table I as estimators: each a function of a whisk and the
settings.

Angle and moment are the paper's own (`estimator.builtin`); here are those that have more, or less,
to go by.
"""

from dataclasses import replace
from math import hypot, isnan, nan, sqrt

import numpy as np

from estimator import distance, load_cell
from estimator.builtin import TIP, with_friction
from estimator.reasons import NamedReason
from estimator.uncertainty import Z_95
from estimator.whisk import Estimate, EstimatorSettings, Whisk

NO_CELL = NamedReason(
    "no_force_recorded", "no force at the base was recorded (f_x_N, f_y_N, f_z_N)"
)
NO_RATE = NamedReason("no_moment_rate", "the rate of the moment is not known")


def touch_alone(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Estimate from a binary sensor, which has the angle of touch, and of the distance only that
    the whisker reaches.

    Every place along the whisker is equally probable: the middle, with the standard deviation of a
    uniform distribution.
    """
    length = whisk.beam.length_mm
    return Estimate(length / 2, length / sqrt(12), "", 0.025 * length, 0.975 * length)


def moment_rate(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Estimate from the moments' rate over the angle (piezoelectric sensors): (1) with the slip of
    (10), by rate times θ.

    The moment is taken to rise as a line, so no angle of touch and no zero enters, and no error of
    theirs.
    """
    others = whisk.others
    theta = whisk.theta_at_rad
    if others is None or not np.isfinite(others.rate_Nmm).all():
        return Estimate(nan, nan, NO_RATE)
    m_y, m_z = (theta * others.rate_Nmm).tolist()
    by_rate = replace(
        whisk,
        m_y_at_Nmm=m_y,
        m_z_at_Nmm=m_z,
        covariance_at=theta**2 * others.rate_covariance,
        theta_sigma_rad=0.0,
        theta_moment_covariance_at=np.zeros(2),
    )
    return with_friction(by_rate, settings)


def force_and_moment(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Estimate from six axes at the base: the force's line of action meets the whisker there
    (`estimator.load_cell`).

    One over the distance is linear in the force, so the interval is that of one over it (Fieller:
    Journal of the Royal Statistical Society B 16, 1954); where the force is within its noise, only
    "no nearer than" is left.
    """
    others = whisk.others
    if others is None or not np.isfinite(others.force_N).all():
        return Estimate(nan, nan, NO_CELL)
    m_y = whisk.m_y_at_Nmm
    m_z = whisk.m_z_at_Nmm
    f_x, f_y, f_z = others.force_N.tolist()
    d_x = load_cell.distance(whisk.theta_at_rad, m_y, m_z, f_x, f_y, f_z, whisk.beam)
    if isnan(d_x):
        return Estimate(nan, nan, load_cell.why_not(m_y, m_z, f_x, f_y, f_z))
    by_felt = load_cell.relative_gradient(m_y, m_z, f_y, f_z)
    noise_share = _noise_share(whisk, by_felt)
    share = hypot(noise_share, others.scale_sigma, _model_share(whisk, settings, d_x))
    gradient = np.array([0.0, d_x * by_felt[0], d_x * by_felt[1], 0.0])
    return _on_whisker(d_x, share, gradient, whisk.beam.length_mm)


def _on_whisker(d_x: float, share: float, gradient: np.ndarray, length: float) -> Estimate:
    """Assemble the estimate of a distance and its relative sigma; beyond the length it is the
    tip's, of the same relative sigma, and has no gradient.
    """
    clamped, at_tip = distance.clamp_to_length(d_x, length)
    low, high = _interval(clamped, Z_95 * share, length)
    if at_tip:
        return Estimate(clamped, clamped * share, TIP.format(d_x, low), low, high)
    return Estimate(clamped, clamped * share, "", low, high, gradient=gradient)


def _interval(d_x: float, half: float, length: float) -> tuple[float, float]:
    """Return the ends, mm, where 1/d_x lies within ± half of itself; the high one at most the
    whisker's length.
    """
    low = d_x / (1 + half)
    high = min(d_x / (1 - half), length) if half < 1 else length
    return low, high


SENSORS = {
    "touch_alone": touch_alone,
    "moment_rate": moment_rate,
    "force_and_moment": force_and_moment,
}


def _noise_share(whisk: Whisk, by_felt: np.ndarray) -> float:
    """Return the relative sigma of the distance by noise of moments and forces, whose sensors are
    independent.
    """
    by_moments = by_felt[:2]
    by_forces = by_felt[2:]
    moments = by_moments @ whisk.covariance_at @ by_moments
    forces = by_forces @ whisk.others.force_covariance @ by_forces
    return sqrt(max(moments + forces, 0.0))


def _model_share(whisk: Whisk, settings: EstimatorSettings, d_x: float) -> float:
    """Return the relative sigma of the distance by unknown thickness and lean of the object, and by the taper."""
    theta = whisk.theta_at_rad
    thickness = whisk.beam.thickness(d_x)
    phi = whisk.phi_rad
    rolling = load_cell.rolling(theta, settings.object_reach_mm, phi, d_x, thickness)
    leaning = load_cell.leaning(theta, settings.tilt_sigma_rad, phi, settings.alpha_est_rad)
    return hypot(rolling, leaning, whisk.beam.share_by_taper(d_x))
