"""Felt touch: the motor angle at which the moments leave the line of the free stroke.

Three ways: extrapolating the rise of the moment, half height of its rate, and the paper's threshold on
the filtered moment. All take plain arrays over one forward stroke: motor angle (n,) in rad, moments (n,)
or (n, 2) in any unit.
"""

from dataclasses import dataclass, field

import numpy as np

from estimator import noise

NO_RISE = "never touches: the moments do not rise above their noise"
NO_FREE_STROKE = "touching from the start: no free stroke to measure the rise from"
SHORT_RISE = "touches too near the end of the stroke to fit the rise"
VAGUE = "no clear onset: the touch angle is uncertain by more than a third of the fitted rise"

MIN_RISE_IN_SIGMAS = 8.0
MIN_FREE_SAMPLES = 20
MIN_RISE_SAMPLES = 12
COARSE_BINS = 120
WINDOW_RAD = np.radians(2.0)
GUARD_RAD = np.radians(0.1)


@dataclass(frozen=True)
class Touch:
    """First touch as the moments tell it.

    motor_rad and sigma_rad are NaN where status is not empty. bias_rad is what the method itself is known
    to be off by (not subtracted). offset (k,) is the level of the free stroke, offset_covariance (k, k);
    drift (k,) is the slope per sample by which the free stroke rises beyond its noise; rise (k,) is per
    rad. free marks the samples of the free stroke, rise_end_rad the end of the fitted rise.
    """

    motor_rad: float
    sigma_rad: float
    status: str = ""
    bias_rad: float = 0.0
    offset: np.ndarray | None = field(default=None, repr=False)
    offset_covariance: np.ndarray | None = field(default=None, repr=False)
    drift: np.ndarray | None = field(default=None, repr=False)
    rise: np.ndarray | None = field(default=None, repr=False)
    rise_end_rad: float = np.nan
    free: np.ndarray | None = field(default=None, repr=False)
    gain: np.ndarray | None = field(default=None, repr=False)

    @classmethod
    def none(cls, status: str) -> "Touch":
        """No touch, and why."""
        return cls(np.nan, np.nan, status)


def felt_touch(motor_rad, moments, *, window_rad=WINDOW_RAD, guard_rad=GUARD_RAD) -> Touch:
    """Touch where a line fitted to the rise of the moments meets the level of the free stroke.

    The rise is fitted from guard_rad to window_rad past the touch; the channels share one touch angle,
    weighted by the inverse of their scatter's covariance. Where the whisker sticks and slips, the scatter
    lies along the surface, so that the weight falls on the moment across it, which rises evenly whatever
    the slip.
    """
    motor, samples = _as_columns(motor_rad, moments)
    used = np.isfinite(motor) & np.isfinite(samples).all(axis=1) & _moving(motor)
    if np.count_nonzero(used) < MIN_FREE_SAMPLES + MIN_RISE_SAMPLES:
        return Touch.none("too few samples to find a touch")
    touch, status = _coarse_touch(motor, samples, used)
    if status:
        return Touch.none(status)
    for window in (2 * window_rad, window_rad, window_rad, window_rad):
        fit = _extrapolate(motor, samples, used, touch, window, guard_rad)
        if fit.status:
            return fit
        touch = fit.motor_rad
    return fit


def _as_columns(motor_rad, moments):
    motor = np.asarray(motor_rad, dtype=float)
    samples = np.asarray(moments, dtype=float)
    samples = samples[:, None] if samples.ndim == 1 else samples
    if motor.ndim != 1 or samples.shape[:1] != motor.shape:
        raise ValueError(f"motor angles {motor.shape} and moments {samples.shape} must have the same samples")
    return motor, samples


def _moving(motor):
    """Mask of the samples at which the motor runs at more than half its usual speed."""
    width = max(1, len(motor) // 100)
    step = np.full(len(motor), np.nan)
    step[width:-width] = motor[2 * width :] - motor[: -2 * width]
    step[:width], step[-width:] = step[width], step[-width - 1]
    return step > 0.5 * np.nanmedian(step)


def _coarse_touch(motor, samples, used):
    """Break of the broken line (level, then rise) that explains most of both channels: (angle, status)."""
    angle, binned = _binned(motor[used], samples[used])
    scaled = binned / _noise(samples[used])
    breaks = angle[:-2]
    ramp = np.maximum(0.0, angle[None, :] - breaks[:, None])
    ramp -= ramp.mean(axis=1, keepdims=True)
    slopes = ramp @ (scaled - scaled.mean(axis=0)) / (ramp**2).sum(axis=1)[:, None]
    explained = (slopes**2).sum(axis=1) * (ramp**2).sum(axis=1)
    best = int(np.argmax(explained))
    return breaks[best], _coarse_status(motor, samples, used, breaks[best])


def _binned(motor, samples):
    edges = np.linspace(0, len(motor), min(COARSE_BINS, len(motor)) + 1).astype(int)[:-1]
    counts = np.diff(np.append(edges, len(motor)))
    mean = np.add.reduceat(samples, edges, axis=0) / counts[:, None]
    return np.add.reduceat(motor, edges) / counts, mean


def _noise(samples):
    """Standard deviation (k,) of one sample, from second differences, which no rise or drift disturbs."""
    second = np.diff(samples, n=2, axis=0)
    return np.maximum(np.sqrt((second**2).mean(axis=0) / 6), np.finfo(float).tiny)


def _coarse_status(motor, samples, used, touch):
    after = used & (motor > touch)
    before = used & (motor <= touch)
    if np.count_nonzero(after) < MIN_RISE_SAMPLES:
        return NO_RISE
    scatter = np.nanstd(noise.line_residuals(motor, samples, after), axis=0)
    rise = _slope(motor, samples, after) * (motor[after].max() - touch)
    if np.hypot.reduce(rise / np.maximum(scatter, np.finfo(float).tiny)) < MIN_RISE_IN_SIGMAS:
        return NO_RISE
    if np.count_nonzero(before) < MIN_FREE_SAMPLES or _rises_already(motor, samples, before, after):
        return NO_FREE_STROKE
    return ""


def _slope(motor, samples, used):
    spread = motor[used] - motor[used].mean()
    return spread @ samples[used] / (spread @ spread)


def _rises_already(motor, samples, before, after):
    """Does the supposed free stroke rise at more than a third of the later rate, beyond doubt?"""
    direction = _slope(motor, samples, after)
    along = samples @ direction / np.hypot.reduce(direction)
    slope = _slope(motor, along, before)
    spread = motor[before] - motor[before].mean()
    sigma = np.nanstd(noise.line_residuals(motor, along[:, None], before)) / np.sqrt(spread @ spread)
    return slope > max(np.hypot.reduce(direction) / 3, 5 * sigma)


def _extrapolate(motor, samples, used, touch, window, guard):
    """One pass of `felt_touch` around a touch angle already known roughly."""
    free = used & (motor < touch - guard)
    rising = used & (motor > touch + guard) & (motor <= touch + window)
    if np.count_nonzero(free) < MIN_FREE_SAMPLES:
        return Touch.none(NO_FREE_STROKE)
    if np.count_nonzero(rising) < MIN_RISE_SAMPLES:
        return Touch.none(SHORT_RISE)
    offset, offset_covariance, drift = level(motor, samples, free, touch)
    to_touch = noise.line_weights(motor, rising, touch)
    memory = noise.autocovariance(noise.line_residuals(motor, samples, rising))
    gap = np.where(rising[:, None], samples, 0.0).T @ to_touch - offset
    covariance = offset_covariance + noise.covariance_of_sums(to_touch, to_touch, memory)
    rise = _slope(motor, samples, rising)
    pull = np.linalg.lstsq(covariance, rise, rcond=None)[0]
    information = rise @ pull
    sigma = 1 / np.sqrt(information)
    if not sigma < window / 3:
        return Touch.none(VAGUE)
    found = touch - gap @ pull / information
    end = motor[rising].max()
    gain = pull / information
    return Touch(found, sigma, "", 0.0, offset, offset_covariance, drift, rise, end, free, gain)


def level(motor, samples, free, at):
    """Level (k,) of the free stroke, its covariance (k, k) at the motor angle `at`, and its drift (k,)
    per rad.

    The level is a mean: a slope fitted to a free stroke and extrapolated past it would carry more noise
    than the drift it removes. A drift beyond its own noise goes into the covariance instead.
    """
    weights = noise.mean_weights(free)
    residuals = noise.line_residuals(motor, samples, free)
    memory = noise.autocovariance(residuals)
    unit = noise.line_weights(motor, free, motor[free].mean() + 1.0) - weights
    slope = np.where(free[:, None], samples, 0.0).T @ unit
    doubt = np.diag(noise.covariance_of_sums(unit, unit, memory))
    drift = np.sqrt(np.maximum(0.0, slope**2 - doubt))
    covariance = noise.covariance_of_sums(weights, weights, memory)
    carried = drift * (at - motor[free].mean())
    return np.where(free[:, None], samples, 0.0).T @ weights, covariance + np.diag(carried**2), drift
