"""Touch on a filtered signal: half height of the moment's rate, and the paper's threshold, each with its bias.

A filter smears the touch over a time of about one over its cut-off. A threshold on the smeared moment is crossed early
or late by a share of that; half height of the smeared rate is not, by symmetry. Both biases are found by sending the
ideal broken line (level, then rise) through the same filter.
"""

import numpy as np

from estimator.onset import Touch, columns, felt_touch, usable

FILTER_ORDER = 2
THRESHOLD_IN_SIGMAS = 5.0
NOT_CROSSED = "never touches: the filtered moment does not cross the threshold"


def zero_phase_lowpass(x, rate_Hz, cutoff_Hz):
    """Low-pass of samples along the first axis, forwards and backwards: no delay, −3 dB at cutoff_Hz over both passes.

    Second-order Butterworth each way. Raises ValueError for a cut-off outside (0, rate/2), and for NaN.
    """
    from scipy.signal import butter, sosfiltfilt

    x = np.asarray(x, dtype=float)
    if not 0 < cutoff_Hz < rate_Hz / 2:
        raise ValueError(f"cutoff_Hz = {cutoff_Hz}: must lie between 0 and half the rate of {rate_Hz} Hz")
    if not np.isfinite(x).all():
        raise ValueError("samples are missing or infinite: a filter would smear them over the rest")
    each_way = cutoff_Hz / (np.sqrt(2) - 1) ** (1 / (2 * FILTER_ORDER))
    sections = butter(FILTER_ORDER, min(each_way, 0.499 * rate_Hz), fs=rate_Hz, output="sos")
    return sosfiltfilt(sections, x, axis=0, padlen=min(len(x) - 1, int(3 * rate_Hz / cutoff_Hz)))


def threshold_touch(motor_rad, moments, time_s, cutoff_Hz, *, threshold=None) -> Touch:
    """Touch as the paper finds it: where the filtered moment above its level crosses a threshold for good.

    threshold is in the unit of the moments, for their magnitude; left out, it is five times the filtered noise.
    bias_rad says by how much the crossing comes early (negative) or late for the fitted rise.
    """
    stroke = _Stroke(motor_rad, moments, time_s, cutoff_Hz)
    if stroke.felt.status:
        return stroke.felt
    noise = np.hypot.reduce(np.std(stroke.filtered_noise, axis=0))
    height = THRESHOLD_IN_SIGMAS * noise if threshold is None else threshold
    found, steepness = _last_crossing(np.hypot.reduce(stroke.filtered, axis=1), stroke.motor, height)
    ideal, _ = _last_crossing(np.hypot.reduce(stroke.filtered_ideal, axis=1), stroke.motor, height)
    if not np.isfinite(found):
        return Touch.none(NOT_CROSSED)
    return stroke.touch(found, noise / steepness, ideal)


def touch_on_rate(motor_rad, moments, time_s, cutoff_Hz) -> Touch:
    """Touch where the filtered moment's rate over the motor angle reaches half of its rate in the fitted rise."""
    stroke = _Stroke(motor_rad, moments, time_s, cutoff_Hz)
    if stroke.felt.status:
        return stroke.felt
    near = stroke.felt.motor_rad
    found, steepness = _nearest_crossing(stroke.rate(stroke.filtered), stroke.motor, 0.5, near)
    ideal, _ = _nearest_crossing(stroke.rate(stroke.filtered_ideal), stroke.motor, 0.5, near)
    if not np.isfinite(found):
        return Touch.none(NOT_CROSSED)
    return stroke.touch(found, np.std(stroke.rate(stroke.filtered_noise)) / steepness, ideal)


class _Stroke:
    """A stroke's moments above their level, the broken line fitted to them, and what it leaves over; all filtered."""

    def __init__(self, motor_rad, moments, time_s, cutoff_Hz):
        motor, samples = columns(motor_rad, moments)
        self.felt = felt_touch(motor, samples, time_s)
        if self.felt.status:
            return
        time = np.asarray(time_s, dtype=float)
        good = usable(motor, samples)
        above = np.stack([np.interp(time, time[good], c[good]) for c in (samples - self.felt.offset).T], axis=1)
        motor = np.interp(time, time[good], motor[good])
        ideal = np.maximum(0.0, motor - self.felt.motor_rad)[:, None] * self.felt.rise.slope
        rate_Hz = 1 / np.median(np.diff(time))
        self.filtered, self.filtered_ideal, self.filtered_noise, self.motor = (
            zero_phase_lowpass(x, rate_Hz, cutoff_Hz) for x in (above, ideal, above - ideal, motor)
        )

    def rate(self, moments):
        """Slope (n,) of the moments over the motor angle, in units of the fitted rise's."""
        with np.errstate(all="ignore"):
            return np.gradient(moments @ self.felt.rise.gain) / np.gradient(self.motor)

    def touch(self, found, sigma, ideal):
        """The crossing as a Touch; the level's own error adds to its sigma."""
        gain = self.felt.rise.gain
        level = gain @ self.felt.level.covariance_between(found, found) @ gain
        bias = float(ideal - self.felt.motor_rad)
        return Touch(float(found), float(np.sqrt(sigma**2 + level)), "", bias, self.felt.level, self.felt.rise)


def _last_crossing(x, motor, height):
    """(motor angle, slope) at which x last rises through `height`; NaN where it never does."""
    below = np.flatnonzero(~(x >= height))
    if below.size == 0 or below[-1] + 1 >= len(x):
        return np.nan, np.nan
    return _interpolated(x, motor, height, below[-1])


def _nearest_crossing(x, motor, height, near):
    """(motor angle, slope) at which x rises through `height` nearest to the motor angle `near`."""
    rising = np.flatnonzero((x[:-1] < height) & (x[1:] >= height))
    if rising.size == 0:
        return np.nan, np.nan
    return _interpolated(x, motor, height, rising[np.argmin(np.abs(motor[rising] - near))])


def _interpolated(x, motor, height, before):
    slope = (x[before + 1] - x[before]) / (motor[before + 1] - motor[before])
    return motor[before] + (height - x[before]) / slope, slope
