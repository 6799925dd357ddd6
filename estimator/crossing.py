"""Touch on a filtered signal: half height of the moment's rate, and the paper's threshold, each
with its bias.

A filter smears the touch over a time of about one over its cut-off. A threshold on the smeared
moment is crossed early or late by a share of that; half height of the smeared rate is not, by
symmetry. Both biases are found by sending the ideal broken line (level, then rise) through the same
filter.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_banded

from estimator.onset import FeltTouch, columns, felt_touch, usable
from estimator.reasons import NamedReason

# Order of the Butterworth filter of each way.
_FILTER_ORDER = 2
# [sigmas] Threshold of the filtered moment, in those of its noise.
_THRESHOLD_IN_SIGMAS = 10.0
NOT_CROSSED = NamedReason(
    "threshold_not_crossed", "never touches: the filtered moment does not cross the threshold"
)


def zero_phase_lowpass(x: ArrayLike, rate_Hz: float, cutoff_Hz: float) -> np.ndarray:
    """Filter samples along the first axis by a low-pass, forwards and backwards: without delay.

    Second-order Butterworth each way, −3 dB at cutoff_Hz over both. Missing samples (NaN) are
    bridged by lines for the filter, and stay NaN. Raises ValueError for a cut-off outside (0,
    rate/2).
    """
    x = np.asarray(x, dtype=float)
    if not 0 < cutoff_Hz < rate_Hz / 2:
        raise ValueError(
            f"cutoff_Hz = {cutoff_Hz}: must lie between 0 and half the rate of {rate_Hz} Hz"
        )
    each_way_Hz = cutoff_Hz / (np.sqrt(2) - 1) ** (1 / (2 * _FILTER_ORDER))
    cutoff = min(each_way_Hz / rate_Hz, 0.499)
    padding = min(len(x) - 1, int(3 * rate_Hz / cutoff_Hz))
    bridged = np.apply_along_axis(_bridged, 0, x)
    filtered = _forwards_and_backwards(bridged, cutoff, padding)
    return np.where(np.isfinite(x), filtered, np.nan)


def _forwards_and_backwards(x, cutoff, padding: int):
    """Filter x (n, …) from its beginning and then from its end; cutoff as a share of the rate.

    At both ends x is continued by `padding` samples, mirrored at its end point.
    """
    before = 2 * x[:1] - x[padding:0:-1]
    after = 2 * x[-1:] - x[-2 : -padding - 2 : -1]
    longer = np.concatenate([before, x, after])
    for _ in range(2):
        longer = _butterworth(longer, cutoff)[::-1]
    return longer[padding : padding + len(x)]


def _butterworth(x, cutoff):
    """Filter x (n, …) once by a second-order Butterworth low-pass, at rest at its first sample.

    By the bilinear transform y_k + a1 y_{k-1} + a2 y_{k-2} = b (x_k + 2 x_{k-1} + x_{k-2}): one
    banded system for all k.
    """
    k = np.tan(np.pi * cutoff)
    a0 = 1.0 + np.sqrt(2.0) * k + k * k
    a1 = 2.0 * (k * k - 1.0) / a0
    a2 = (1.0 - np.sqrt(2.0) * k + k * k) / a0
    b = k * k / a0
    above = x - x[:1]
    driven = b * above
    driven[1:] += 2.0 * b * above[:-1]
    driven[2:] += b * above[:-2]
    bands = np.tile([[1.0], [a1], [a2]], len(x))
    filtered = solve_banded((2, 0), bands, driven.reshape(len(x), -1))
    return x[:1] + filtered.reshape(x.shape)


def _bridged(x):
    """Interpolate the missing samples of x (n,) linearly; zeros where all are missing."""
    known = np.flatnonzero(np.isfinite(x))
    if known.size == 0:
        return np.zeros(len(x))
    return np.interp(np.arange(len(x)), known, x[known])


def threshold_touch(
    motor_rad: ArrayLike,
    moments: ArrayLike,
    time_s: ArrayLike,
    cutoff_Hz: float,
    *,
    threshold: float | None = None,
) -> FeltTouch:
    """Find the touch as the paper does: where the filtered moment crosses a threshold for good.

    The moment is taken above its level. threshold is in the unit of the moments, for their
    magnitude; left out, it is ten times the filtered noise. The touch's bias_rad is how much too
    late the crossing comes (early: negative) for the fitted rise.
    """
    felt = felt_touch(motor_rad, moments, time_s)
    if felt.status:
        return felt
    stroke = _Stroke(motor_rad, moments, time_s, cutoff_Hz, felt)
    magnitude = np.hypot.reduce(stroke.filtered, axis=1)
    if threshold is None:
        threshold = _threshold_above_noise(stroke)
    index, found, steepness = _last_crossing(magnitude, stroke.motor, threshold)
    if index is None:
        return FeltTouch.none(NOT_CROSSED)
    covariance = stroke.noise(index) + felt.level.covariance_between(found, found)
    sigma = _sigma_along(felt.rise.slope, covariance) / steepness
    ideal_magnitude = np.hypot.reduce(stroke.ideal, axis=1)
    ideal = _last_crossing(ideal_magnitude, stroke.motor, threshold)[1]
    return _touch(found, sigma, ideal, felt)


def touch_on_rate(
    motor_rad: ArrayLike, moments: ArrayLike, time_s: ArrayLike, cutoff_Hz: float
) -> FeltTouch:
    """Find the touch where the filtered moment's slope reaches half of that in the fitted rise.

    The slope is that over the motor angle.
    """
    felt = felt_touch(motor_rad, moments, time_s)
    if felt.status:
        return felt
    stroke = _Stroke(motor_rad, moments, time_s, cutoff_Hz, felt)
    rate = stroke.rate(stroke.filtered)
    index, found, steepness = _nearest_crossing(rate, stroke.motor, 0.5, felt.motor_rad)
    if index is None:
        return FeltTouch.none(NOT_CROSSED)
    variance = felt.rise.gain @ stroke.noise_of_rate(index) @ felt.rise.gain
    ideal_rate = stroke.rate(stroke.ideal)
    ideal = _nearest_crossing(ideal_rate, stroke.motor, 0.5, felt.motor_rad)[1]
    return _touch(found, np.sqrt(variance) / steepness, ideal, felt)


class _Stroke:
    """A stroke's moments above their level, and the broken line fitted to them, both filtered.

    filtered, ideal (n, k): moments, measured and of the broken line, N·mm; motor (n,): filtered
    angle, rad.
    """

    def __init__(self, motor_rad, moments, time_s, cutoff_Hz, felt):
        """Interpolate what is missing, subtract the level, and filter."""
        motor, samples = columns(motor_rad, moments)
        time = np.asarray(time_s, dtype=float)
        good = usable(motor, samples)
        above = samples - felt.offset
        columns_above = [np.interp(time, time[good], column[good]) for column in above.T]
        motor = np.interp(time, time[good], motor[good])
        since_touch = np.maximum(0.0, motor - felt.motor_rad)
        self._rate_Hz = 1 / np.median(np.diff(time))
        self._cutoff_Hz = cutoff_Hz
        self._felt = felt
        self.filtered = self._filter(np.stack(columns_above, axis=1))
        self.ideal = self._filter(since_touch[:, None] * felt.rise.slope)
        self.motor = self._filter(motor)

    def _filter(self, x):
        """Filter x (n, …) along its first axis, without delay."""
        return zero_phase_lowpass(x, self._rate_Hz, self._cutoff_Hz)

    def rate(self, moments):
        """Return the slope (n,) of the moments over the motor angle, in units of the fitted
        rise's.
        """
        with np.errstate(all="ignore"):
            return np.gradient(moments @ self._felt.rise.gain) / np.gradient(self.motor)

    def noise(self, index):
        """Return the covariance (k, k) of the filtered moments at a sample: the noise that is
        left.
        """
        return self._felt.rise.memory.of_sum(self._weights(index))

    def noise_of_rate(self, index):
        """Return the covariance (k, k) of the filtered moments' slope over the motor at a
        sample.
        """
        change = (self._weights(index + 1) - self._weights(index - 1)) / 2
        return self._felt.rise.memory.of_sum(change / np.gradient(self.motor)[index])

    def _weights(self, index):
        """Return the weights (n,) of all samples in a filtered one: the response to an impulse
        there.
        """
        impulse = np.zeros(len(self.motor))
        impulse[np.clip(index, 0, len(impulse) - 1)] = 1.0
        return self._filter(impulse)


def _threshold_above_noise(stroke: _Stroke) -> float:
    """Return the threshold, N·mm, that the filtered noise in mid-stroke does not cross."""
    noise = stroke.noise(len(stroke.motor) // 2)
    return _THRESHOLD_IN_SIGMAS * np.sqrt(np.trace(noise))


def _sigma_along(direction: np.ndarray, covariance: np.ndarray) -> float:
    """Return the standard deviation along a direction (k,) of any length, of moments with a
    covariance (k, k).
    """
    along = direction / np.hypot.reduce(direction)
    return np.sqrt(along @ covariance @ along)


def _touch(found, sigma, ideal, felt):
    """Return the touch at the crossing `found`, biased as the ideal line's crossing is."""
    bias = float(ideal - felt.motor_rad)
    return FeltTouch(float(found), float(sigma), "", bias, felt.level, felt.rise)


def _last_crossing(x, motor, height):
    """Find where x last rises through `height`: (sample, motor angle, slope).

    The sample is None, and the others NaN, where it never does.
    """
    below = np.flatnonzero(np.logical_not(x >= height))
    if below.size == 0 or below[-1] + 1 >= len(x):
        return None, np.nan, np.nan
    return below[-1], *_interpolated(x, motor, height, below[-1])


def _nearest_crossing(x, motor, height, near):
    """Find where x rises through `height` nearest to the motor angle `near`: (sample, angle,
    slope).

    The sample is None, and the others NaN, where it never does.
    """
    rising = np.flatnonzero((x[:-1] < height) & (x[1:] >= height))
    if rising.size == 0:
        return None, np.nan, np.nan
    index = rising[np.argmin(np.abs(motor[rising] - near))]
    return index, *_interpolated(x, motor, height, index)


def _interpolated(x, motor, height, before):
    """Interpolate between a sample and the next: (motor angle at which x is `height`, slope
    there).
    """
    slope = (x[before + 1] - x[before]) / (motor[before + 1] - motor[before])
    return motor[before] + (height - x[before]) / slope, slope
