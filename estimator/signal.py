"""From the samples of one forward stroke to what an estimator needs: filter, felt touch, moments at a
pushing angle.

Everything takes plain arrays; moments may be in N·mm or in volts. Angles in rad, times in s.
"""

from dataclasses import dataclass

import numpy as np

from estimator import noise
from estimator.onset import Touch, _as_columns, felt_touch, level

__all__ = ["MomentAt", "Touch", "felt_touch", "moment_at", "zero_phase_lowpass"]

FILTER_ORDER = 2
HUM_PERIOD_S = 0.02
HALF_WINDOW_RAD = np.radians(0.5)


def zero_phase_lowpass(x, rate_Hz, cutoff_Hz):
    """Low-pass of samples along the first axis, forwards and backwards: no delay, −3 dB at `cutoff_Hz`
    over both passes.

    Second-order Butterworth each way. Raises ValueError for a cut-off outside (0, rate/2).
    """
    from scipy.signal import butter, sosfiltfilt

    if not 0 < cutoff_Hz < rate_Hz / 2:
        raise ValueError(f"cutoff_Hz = {cutoff_Hz}: must lie between 0 and half the rate of {rate_Hz} Hz")
    each_way = cutoff_Hz / (np.sqrt(2) - 1) ** (1 / (2 * FILTER_ORDER))
    sections = butter(FILTER_ORDER, min(each_way, 0.499 * rate_Hz), fs=rate_Hz, output="sos")
    padding = min(len(x) - 1, int(3 * rate_Hz / cutoff_Hz))
    return sosfiltfilt(sections, np.asarray(x, dtype=float), axis=0, padlen=padding)


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
    theta_rad, motor_rad, moments, touch, *, half_window_rad=HALF_WINDOW_RAD, time_s=None
) -> MomentAt:
    """Moments at the pushing angle theta_rad past `touch`, from a line fitted to the samples around it.

    The window is ± half_window_rad, widened where `time_s` is given to hold a period of mains hum, and
    never reaches back to the touch. The covariance holds the fit (with the residuals' autocorrelation),
    the free stroke and drift.
    """
    motor, samples = _as_columns(motor_rad, moments)
    channels = samples.shape[1]
    if touch.status:
        return _nothing(theta_rad, channels, touch.status)
    at = touch.motor_rad + theta_rad
    good = np.isfinite(motor) & np.isfinite(samples).all(axis=1)
    half = min(_half_window(motor, time_s, half_window_rad), 0.9 * theta_rad)
    near = good & (np.abs(motor - at) <= half)
    if not good.any() or np.nanmax(motor[good]) < at or np.count_nonzero(near) < 3:
        return _nothing(theta_rad, channels, "the stroke does not reach the pushing angle")
    return _local_fit(theta_rad, motor, samples, near, at, touch)


def _half_window(motor, time_s, half_window_rad):
    if time_s is None:
        return half_window_rad
    speed = np.median(np.diff(motor)) / np.median(np.diff(time_s))
    return max(half_window_rad, speed * HUM_PERIOD_S / 2)


def _nothing(theta_rad, channels, status):
    gap = np.full(channels, np.nan)
    return MomentAt(theta_rad, gap, np.full((channels, channels), np.nan), gap, status)


def _local_fit(theta_rad, motor, samples, near, at, touch):
    weights = noise.line_weights(motor, near, at)
    memory = noise.autocovariance(noise.line_residuals(motor, samples, near))
    offset, offset_covariance, _ = level(motor, samples, touch.free, at)
    values = np.where(near[:, None], samples, 0.0).T @ weights - offset
    covariance = noise.covariance_of_sums(weights, weights, memory) + offset_covariance
    return MomentAt(theta_rad, values, covariance, touch.offset_covariance @ touch.gain)
