"""From the samples of one forward stroke to what an estimator needs: filter, felt touch, moments at
an angle.

Everything takes plain arrays; moments may be in N·mm or in volts. Angles in rad, times in s.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from estimator import noise
from estimator.domain import require_positive
from estimator.lowpass import zero_phase_lowpass
from estimator.onset import FeltTouch, columns, felt_touch, speed, usable
from estimator.reasons import NamedReason

__all__ = [
    "FeltTouch",
    "MomentAt",
    "felt_touch",
    "moment_at",
    "zero_phase_lowpass",
]

# [s] Period of mains hum at 50 Hz, over which moments are averaged. Stated.
HUM_PERIOD_S = 0.02
# [rad] Half width of the window around the pushing angle, over which moments are a line: at 10°/s
# it is five periods of mains hum wide. Stated.
HALF_WINDOW_RAD = np.radians(0.5)
# [samples] Fewest to which a line with a scatter is fitted. Derived.
MIN_SAMPLES = 3
NOT_REACHED = NamedReason("angle_not_reached", "the stroke does not reach the pushing angle")


@dataclass(frozen=True)
class MomentAt:
    """Moments above the free stroke's level at a pushing angle.

    values (k,) and covariance (k, k) in the unit of the samples; theta_covariance (k,) is the
    covariance of the pushing angle (through the touch) with the moments. NaN where status is not
    empty.
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
    touch: FeltTouch,
    *,
    time_s: ArrayLike | None = None,
    half_window_rad: ArrayLike = HALF_WINDOW_RAD,
    good: np.ndarray | None = None,
) -> MomentAt:
    """Fit a line to the samples around the pushing angle theta_rad past `touch`, and return the
    moments there.

    The window is ± half_window_rad, widened where time_s is given to hold a period of mains hum,
    and never reaches back to the touch. The covariance holds the fit (with the noise's
    autocorrelation), the free stroke and drift. good: mask (n,) of the `usable` samples, where that
    is known already. Raises ValueError for theta_rad ≤ 0, and where motor angles and moments do not
    have the same samples.
    """
    motor, samples = columns(motor_rad, moments)
    channels = samples.shape[1]
    if touch.status:
        return _nothing(theta_rad, channels, touch.status)
    require_positive("theta_rad", theta_rad, "rad")
    at = touch.motor_rad + theta_rad
    hum_rad = speed(motor, time_s) * HUM_PERIOD_S
    half = min(max(half_window_rad, hum_rad / 2), 0.9 * theta_rad)
    if good is None:
        good = usable(motor, samples)
    near = good & (np.abs(motor - at) <= half)
    if not good.any() or motor[good].max() < at or np.count_nonzero(near) < MIN_SAMPLES:
        return _nothing(theta_rad, channels, NOT_REACHED)
    return _local_fit(theta_rad, motor, samples, near, at, touch)


def _nothing(theta_rad, channels, status):
    """Return moments of NaN in so many channels, and why."""
    gap = np.full(channels, np.nan)
    return MomentAt(theta_rad, gap, np.full((channels, channels), np.nan), gap, status)


def _local_fit(theta_rad, motor, samples, near, at, touch):
    """Return the moments at the motor angle `at` from a line fitted to the samples `near` it, a
    mask (n,).
    """
    level = touch.level
    rise = touch.rise
    weights = noise.line_weights(motor, near, at)
    own = noise.Memory.of(motor, samples, near)
    values = noise.weighted_sum(weights, samples, near) - level.offset
    scatter = noise.wider(rise.memory.of_sum(weights), own.of_sum(weights))
    covariance = scatter + level.covariance_between(at, at)
    shared = rise.memory.between_sums(rise.weights, weights)
    with_touch = rise.gain @ (shared + level.covariance_between(touch.motor_rad, at))
    return MomentAt(theta_rad, values, covariance, with_touch)
