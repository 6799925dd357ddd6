"""The other sensors of the paper's Table I as estimators: each a function of a whisk and the settings.

Angle and moment are the paper's own (`estimator.builtin`); here are those that have more, or less, to go by.
"""

from dataclasses import replace
from math import hypot, nan, sqrt

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
    """A binary sensor: the angle of touch, and nothing of the distance but that the whisker reaches.

    Every place along the whisker is as likely: the middle, with the standard deviation of a uniform distribution.
    """
    length = whisk.beam.length_mm
    return Estimate(length / 2, length / sqrt(12), "", 0.025 * length, 0.975 * length)


def moment_rate(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Moments' rate over the angle (piezoelectric sensors): (1) with the slip of (10), by the rate times θ.

    The moment is taken to rise as a line, so no angle of touch and no zero enters, and no error of theirs.
    """
    others, theta = whisk.others, whisk.theta_at_rad
    if others is None or not np.isfinite(others.rate_Nmm).all():
        return Estimate(nan, nan, NO_RATE)
    m_y, m_z = (theta * others.rate_Nmm).tolist()
    known = {"theta_sigma_rad": 0.0, "theta_moment_covariance_at": np.zeros(2)}
    moments = {
        "m_y_at_Nmm": m_y,
        "m_z_at_Nmm": m_z,
        "covariance_at": theta**2 * others.rate_covariance,
    }
    return with_friction(replace(whisk, **moments, **known), settings)


def force_and_moment(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Six axes at the base: the contact is where the force's line of action meets the whisker (`estimator.load_cell`).

    One over the distance is linear in the force, so the interval is that of one over it (Fieller: Journal of the Royal
    Statistical Society B 16, 1954); where the force is within its noise, only "no nearer than" is left.
    """
    others = whisk.others
    if others is None or not np.isfinite(others.force_N).all():
        return Estimate(nan, nan, NO_CELL)
    felt = (whisk.m_y_at_Nmm, whisk.m_z_at_Nmm, *others.force_N.tolist())
    d_x, length = load_cell.distance(whisk.theta_at_rad, *felt, whisk.beam), whisk.beam.length_mm
    if d_x != d_x:
        return Estimate(nan, nan, load_cell.why_not(*felt))
    by = load_cell.relative_gradient(felt[0], felt[1], felt[3], felt[4])
    share = hypot(_noise_share(whisk, by), others.scale_sigma, _model_share(whisk, settings, d_x))
    low = min(d_x / (1 + Z_95 * share), length)
    high = min(d_x / (1 - Z_95 * share), length) if Z_95 * share < 1 else length
    clamped, at_tip = distance.clamp_to_length(d_x, length)
    status = TIP.format(d_x, low) if at_tip else ""
    gradient = None if at_tip else np.array([0.0, d_x * by[0], d_x * by[1], 0.0])
    return Estimate(clamped, d_x * share, status, low, high, gradient=gradient)


SENSORS = {
    "touch_alone": touch_alone,
    "moment_rate": moment_rate,
    "force_and_moment": force_and_moment,
}


def _noise_share(whisk: Whisk, by: np.ndarray) -> float:
    """Relative sigma of the distance by noise of moments and forces, which are read by sensors of their own."""
    moments, forces = (
        by[:2] @ whisk.covariance_at @ by[:2],
        by[2:] @ whisk.others.force_covariance @ by[2:],
    )
    return sqrt(max(moments + forces, 0.0))


def _model_share(whisk: Whisk, settings: EstimatorSettings, d_x: float) -> float:
    """What thickness and lean of an object nothing is known of may move the contact by, as a share of d_x."""
    phi = distance.felt_slip_angle(whisk.m_y_at_Nmm, whisk.m_z_at_Nmm)
    left = whisk.beam.left(d_x)
    rolled = load_cell.rolling(whisk.theta_at_rad, settings.object_reach_mm, phi, d_x, left)
    return hypot(
        rolled,
        load_cell.leaning(whisk.theta_at_rad, settings.tilt_sigma_rad, phi, settings.alpha_est_rad),
    )
