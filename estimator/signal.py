"""From the samples of one forward stroke to what an estimator needs: filter, felt touch, moments at an angle.

Everything takes plain arrays; moments may be in N·mm or in volts. Angles in rad, times in s.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from estimator import noise
from estimator.crossing import threshold_touch, touch_on_rate, zero_phase_lowpass
from estimator.domain import require_positive
from estimator.onset import Touch, columns, felt_touch, speed, usable
from estimator.reasons import NamedReason

__all__ = [
    "MomentAt",
    "Touch",
    "felt_touch",
    "moment_at",
    "threshold_touch",
    "touch_on_rate",
    "zero_phase_lowpass",
]

HUM_PERIOD_S = 0.02
HALF_WINDOW_RAD = np.radians(0.5)
MIN_SAMPLES = 3
NOT_REACHED = NamedReason("angle_not_reached", "the stroke does not reach the pushing angle")


@dataclass(frozen=True)
class MomentAt:
    """Moments above the free stroke's level at a pushing angle.

    values (k,) and covariance (k, k) in the unit of the samples; theta_covariance (k,) is the covariance
    of the pushing angle (through the touch) with the moments. NaN where status is not empty.
    """

    theta_rad: float
    values: np.ndarray
    covariance: np.ndarray
    theta_covariance: np.ndarray
    status: str = ""


def moment_at(
    theta_rad: ArrayLike,
    motor_rad: ArrayLike,
    moments: ArrayLike,
    touch: Touch,
    *,
    time_s: ArrayLike | None = None,
    half_window_rad: ArrayLike = HALF_WINDOW_RAD,
    good: np.ndarray | None = None,
) -> MomentAt:
    """Moments at the pushing angle theta_rad past `touch`, from a line fitted to the samples around it.

    The window is ± half_window_rad, widened where time_s is given to hold a period of mains hum, and never reaches
    back to the touch. The covariance holds the fit (with the noise's autocorrelation), the free stroke and drift.
    good: mask (n,) of the `usable` samples, where that is known already.
    """
    motor, samples = columns(motor_rad, moments)
    if touch.status:
        return _nothing(theta_rad, samples.shape[1], touch.status)
    require_positive("theta_rad", theta_rad, "rad")
    at = touch.motor_rad + theta_rad
    half = min(max(half_window_rad, speed(motor, time_s) * HUM_PERIOD_S / 2), 0.9 * theta_rad)
    good = usable(motor, samples) if good is None else good
    near = good & (np.abs(motor - at) <= half)
    if not good.any() or motor[good].max() < at or np.count_nonzero(near) < MIN_SAMPLES:
        return _nothing(theta_rad, samples.shape[1], NOT_REACHED)
    return _local_fit(theta_rad, motor, samples, near, at, touch)


def _nothing(theta_rad, channels, status):
    gap = np.full(channels, np.nan)
    return MomentAt(theta_rad, gap, np.full((channels, channels), np.nan), gap, status)


def _local_fit(theta_rad, motor, samples, near, at, touch):
    weights = noise.line_weights(motor, near, at)
    own = noise.Memory.of(motor, samples, near)
    values = noise.weighted_sum(weights, samples, near) - touch.level.offset
    scatter = noise.wider(touch.rise.memory.of_sum(weights), own.of_sum(weights))
    shared = touch.rise.memory.between_sums(touch.rise.weights, weights)
    with_touch = touch.rise.gain @ (shared + touch.level.covariance_between(touch.motor_rad, at))
    return MomentAt(theta_rad, values, scatter + touch.level.covariance_between(at, at), with_touch)
