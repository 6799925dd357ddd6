"""Touch on a filtered signal: half height of the moment's rate, and the paper's threshold, each with its bias.

A filter smears the touch over a time of about one over its cut-off. A threshold on the smeared moment is crossed early
or late by a share of that; half height of the smeared rate is not, by symmetry. Both biases are found by sending the
ideal broken line (level, then rise) through the same filter.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_banded

from estimator.onset import FeltTouch, columns, felt_touch, usable

FILTER_ORDER = 2
THRESHOLD_IN_SIGMAS = 10.0
NOT_CROSSED = "never touches: the filtered moment does not cross the threshold"


def zero_phase_lowpass(x: ArrayLike, rate_Hz: float, cutoff_Hz: float) -> np.ndarray:
    """Low-pass of samples along the first axis, forwards and backwards: no delay, −3 dB at cutoff_Hz over both passes.

    Second-order Butterworth each way. Missing samples (NaN) are bridged by lines for the filter, and stay NaN. Raises
    ValueError for a cut-off outside (0, rate/2).
    """
    x = np.asarray(x, dtype=float)
    if not 0 < cutoff_Hz < rate_Hz / 2:
        raise ValueError(
            f"cutoff_Hz = {cutoff_Hz}: must lie between 0 and half the rate of {rate_Hz} Hz"
        )
    each_way = cutoff_Hz / (np.sqrt(2) - 1) ** (1 / (2 * FILTER_ORDER))
    padding = min(len(x) - 1, int(3 * rate_Hz / cutoff_Hz))
    filtered = _there_and_back(
        np.apply_along_axis(_bridged, 0, x), min(each_way / rate_Hz, 0.499), padding
    )
    return np.where(np.isfinite(x), filtered, np.nan)


def _there_and_back(x, cutoff, padding: int):
    """The filter over x (n, …) and then from its end, beyond which x goes on mirrored at its ends; cutoff in rates."""
    first, last = x[:1], x[-1:]
    before, after = 2 * first - x[padding:0:-1], 2 * last - x[-2 : -padding - 2 : -1]
    longer = np.concatenate([before, x, after])
    for _ in range(2):
        longer = _butterworth(longer, cutoff)[::-1]
    return longer[padding : padding + len(x)]


def _butterworth(x, cutoff):
    """Second-order Butterworth low-pass by the bilinear transform, along the first axis, at rest at its first sample:

    y_k + a1 y_{k-1} + a2 y_{k-2} = b (x_k + 2 x_{k-1} + x_{k-2}), one banded system for all k.
    """
    k = np.tan(np.pi * cutoff)
    whole = 1.0 + np.sqrt(2.0) * k + k * k
    a1, a2, b = 2.0 * (k * k - 1.0) / whole, (1.0 - np.sqrt(2.0) * k + k * k) / whole, k * k / whole
    above = x - x[:1]
    driven = b * above
    driven[1:] += 2.0 * b * above[:-1]
    driven[2:] += b * above[:-2]
    bands = np.tile([[1.0], [a1], [a2]], len(x))
    return x[:1] + solve_banded((2, 0), bands, driven.reshape(len(x), -1)).reshape(x.shape)


def _bridged(x):
    known = np.flatnonzero(np.isfinite(x))
    return np.interp(np.arange(len(x)), known, x[known]) if known.size else np.zeros(len(x))


def threshold_touch(
    motor_rad: ArrayLike,
    moments: ArrayLike,
    time_s: ArrayLike,
    cutoff_Hz: float,
    *,
    threshold: float | None = None,
) -> FeltTouch:
    """Touch as the paper finds it: where the filtered moment above its level crosses a threshold for good.

    threshold is in the unit of the moments, for their magnitude; left out, it is ten times the filtered noise.
    bias_rad says by how much the crossing comes early (negative) or late for the fitted rise.
    """
    felt = felt_touch(motor_rad, moments, time_s)
    if felt.status:
        return felt
    stroke = _Stroke(motor_rad, moments, time_s, cutoff_Hz, felt)
    size, ideal_size = (np.hypot.reduce(x, axis=1) for x in (stroke.filtered, stroke.ideal))
    middle = stroke.noise(len(size) // 2)
    height = THRESHOLD_IN_SIGMAS * np.sqrt(np.trace(middle)) if threshold is None else threshold
    index, found, steepness = _last_crossing(size, stroke.motor, height)
    if index is None:
        return FeltTouch.none(NOT_CROSSED)
    along = felt.rise.slope / np.hypot.reduce(felt.rise.slope)
    scatter = along @ (stroke.noise(index) + felt.level.covariance_between(found, found)) @ along
    ideal = _last_crossing(ideal_size, stroke.motor, height)[1]
    return _touch(found, np.sqrt(scatter) / steepness, ideal, felt)


def touch_on_rate(
    motor_rad: ArrayLike, moments: ArrayLike, time_s: ArrayLike, cutoff_Hz: float
) -> FeltTouch:
    """Touch where the filtered moment's rate over the motor angle reaches half of its rate in the fitted rise."""
    felt = felt_touch(motor_rad, moments, time_s)
    if felt.status:
        return felt
    stroke = _Stroke(motor_rad, moments, time_s, cutoff_Hz, felt)
    rate, ideal_rate = stroke.rate(stroke.filtered), stroke.rate(stroke.ideal)
    index, found, steepness = _nearest_crossing(rate, stroke.motor, 0.5, felt.motor_rad)
    if index is None:
        return FeltTouch.none(NOT_CROSSED)
    scatter = felt.rise.gain @ stroke.noise_of_rate(index) @ felt.rise.gain
    ideal = _nearest_crossing(ideal_rate, stroke.motor, 0.5, felt.motor_rad)[1]
    return _touch(found, np.sqrt(scatter) / steepness, ideal, felt)


class _Stroke:
    """A stroke's moments above their level, and the broken line fitted to them; both filtered, as is the motor."""

    def __init__(self, motor_rad, moments, time_s, cutoff_Hz, felt):
        motor, samples = columns(motor_rad, moments)
        time = np.asarray(time_s, dtype=float)
        good = usable(motor, samples)
        above = np.stack(
            [np.interp(time, time[good], c[good]) for c in (samples - felt.offset).T], axis=1
        )
        motor = np.interp(time, time[good], motor[good])
        ideal = np.maximum(0.0, motor - felt.motor_rad)[:, None] * felt.rise.slope
        self._rate_Hz, self._cutoff_Hz, self._felt = 1 / np.median(np.diff(time)), cutoff_Hz, felt
        self.filtered, self.ideal, self.motor = (self._filter(x) for x in (above, ideal, motor))

    def _filter(self, x):
        return zero_phase_lowpass(x, self._rate_Hz, self._cutoff_Hz)

    def rate(self, moments):
        """Slope (n,) of the moments over the motor angle, in units of the fitted rise's."""
        with np.errstate(all="ignore"):
            return np.gradient(moments @ self._felt.rise.gain) / np.gradient(self.motor)

    def noise(self, index):
        """Covariance (k, k) of the filtered moments at a sample: what the filter lets through of the noise."""
        return self._felt.rise.memory.of_sum(self._weights(index))

    def noise_of_rate(self, index):
        """Covariance (k, k) of the filtered moments' slope over the motor angle at a sample."""
        change = (self._weights(index + 1) - self._weights(index - 1)) / 2
        return self._felt.rise.memory.of_sum(change / np.gradient(self.motor)[index])

    def _weights(self, index):
        """Weights (n,) with which the filter makes its sample from all: its answer to an impulse, being symmetric."""
        impulse = np.zeros(len(self.motor))
        impulse[np.clip(index, 0, len(impulse) - 1)] = 1.0
        return self._filter(impulse)


def _touch(found, sigma, ideal, felt):
    bias = float(ideal - felt.motor_rad)
    return FeltTouch(float(found), float(sigma), "", bias, felt.level, felt.rise)


def _last_crossing(x, motor, height):
    """(sample, motor angle, slope) at which x last rises through `height`; None and NaN where it never does."""
    below = np.flatnonzero(np.logical_not(x >= height))
    if below.size == 0 or below[-1] + 1 >= len(x):
        return None, np.nan, np.nan
    return below[-1], *_interpolated(x, motor, height, below[-1])


def _nearest_crossing(x, motor, height, near):
    """(sample, motor angle, slope) at which x rises through `height` nearest to the motor angle `near`."""
    rising = np.flatnonzero((x[:-1] < height) & (x[1:] >= height))
    if rising.size == 0:
        return None, np.nan, np.nan
    index = rising[np.argmin(np.abs(motor[rising] - near))]
    return index, *_interpolated(x, motor, height, index)


def _interpolated(x, motor, height, before):
    slope = (x[before + 1] - x[before]) / (motor[before + 1] - motor[before])
    return motor[before] + (height - x[before]) / slope, slope
