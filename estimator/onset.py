"""Felt touch: the motor angle at which the moments leave the level of the free stroke.

Plain arrays over one forward stroke: motor angle (n,) in rad, moments (n,) or (n, 2) in N·mm or volts, time (n,) in s.
The fit of the rise is here; half height of the rate and the paper's threshold are in `estimator.crossing`.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from estimator import noise
from estimator.reasons import NamedReason

TOO_FEW = NamedReason("too_few_samples", "too few samples to find a touch")
NO_RISE = NamedReason("no_rise", "never touches: the moments do not rise above their noise")
NO_FREE_STROKE = NamedReason(
    "no_free_stroke", "touching from the start: no free stroke to measure the rise from"
)
SHORT_RISE = NamedReason("rise_too_short", "touches too near the end of the stroke to fit the rise")
VAGUE = NamedReason(
    "onset_vague",
    "no clear onset: the touch angle is uncertain by more than a third of the fitted rise",
)

WINDOW_RAD = np.radians(2.0)
WINDOW_S = 0.06
GUARD_RAD = np.radians(0.1)
MIN_RISE_IN_SIGMAS = 8.0
MIN_FREE_SAMPLES = 20
MIN_RISE_SAMPLES = 12
COARSE_BINS = 120
SPIKE_IN_SIGMAS = 8.0


@dataclass(frozen=True)
class Level:
    """What the moments read without contact: offset (k,) with covariance (k, k), at the motor angle centre_rad.

    drift (k,) per rad is the slope of the free stroke beyond its noise. It is not taken off: extrapolated past the
    free stroke it would bring more noise than it removes. It widens the covariance instead.
    """

    offset: np.ndarray
    covariance: np.ndarray
    drift: np.ndarray
    centre_rad: float

    def covariance_between(self, one_rad: float, other_rad: float) -> np.ndarray:
        """Covariance (k, k) of the level's errors at two motor angles."""
        return self.covariance + np.diag(self.drift**2) * (one_rad - self.centre_rad) * (
            other_rad - self.centre_rad
        )


@dataclass(frozen=True)
class Rise:
    """The fitted rise: slope (k,) per rad; gain (k,) turns moments above the level into rad past the touch.

    weights (n,) make the line's value at the touch from the samples, whose noise memory describes.
    """

    slope: np.ndarray
    gain: np.ndarray
    weights: np.ndarray
    memory: noise.Memory


@dataclass(frozen=True)
class Touch:
    """First touch as the moments tell it, with its standard deviation; both NaN where status is not empty.

    bias_rad is what the method by its nature is off by, not subtracted. level and rise are what it was found from.
    """

    motor_rad: float
    sigma_rad: float
    status: str = ""
    bias_rad: float = 0.0
    level: Level | None = field(default=None, repr=False)
    rise: Rise | None = field(default=None, repr=False)

    @classmethod
    def none(cls, status: str) -> "Touch":
        """No touch, and why."""
        return cls(np.nan, np.nan, status)

    @property
    def offset(self) -> np.ndarray:
        """Level (k,) of the free stroke, to be taken off the moments."""
        return self.level.offset


def felt_touch(
    motor_rad: ArrayLike,
    moments: ArrayLike,
    time_s: ArrayLike | None = None,
    *,
    window_rad: float = WINDOW_RAD,
    guard_rad: float = GUARD_RAD,
) -> Touch:
    """Touch where a line fitted to the rise of the moments meets the level of the free stroke.

    The rise is fitted from guard_rad to window_rad past the touch, and over 60 ms at least where time_s is given, so
    that fast strokes average over hum and vibration too. The channels share one touch angle, weighted by the inverse
    of their scatter's covariance: where the whisker sticks and slips, the scatter lies along the surface, so that the
    weight falls on the moment across it, which rises evenly whatever the slip. Isolated spikes and NaN are left out.
    """
    motor, samples = columns(motor_rad, moments)
    used = usable(motor, samples) & _moving(motor)
    if np.count_nonzero(used) < MIN_FREE_SAMPLES + MIN_RISE_SAMPLES:
        return Touch.none(TOO_FEW)
    touch = _coarse_touch(motor, samples, used)
    status = _coarse_status(motor, samples, used, touch)
    if status:
        return Touch.none(status)
    window = max(window_rad, speed(motor, time_s) * WINDOW_S)
    for share in (2.0, 1.0, 1.0, 1.0):
        found = _extrapolate(motor, samples, used, touch, share * window, guard_rad)
        if found.status:
            return found
        touch = found.motor_rad
    return found


def columns(motor_rad: ArrayLike, moments: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Motor angles (n,) and moments (n, k) as float arrays; raises ValueError where the samples do not match."""
    motor = np.asarray(motor_rad, dtype=float)
    samples = np.asarray(moments, dtype=float)
    samples = samples[:, None] if samples.ndim == 1 else samples
    if motor.ndim != 1 or samples.ndim != 2 or samples.shape[0] != motor.size:
        raise ValueError(
            f"motor angles {motor.shape} and moments {samples.shape} must have the same samples"
        )
    return motor, samples


def usable(motor: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Mask (n,) of the samples that are known in all columns and no isolated spikes."""
    known = np.isfinite(motor) & np.isfinite(samples).all(axis=1)
    if np.count_nonzero(known) < 5:
        return known
    values = samples[known]
    around = np.stack([np.roll(values, shift, axis=0) for shift in (-2, -1, 0, 1, 2)])
    off = np.abs(values - np.median(around, axis=0))
    off[:2], off[-2:] = 0.0, 0.0
    known[known] = (off <= SPIKE_IN_SIGMAS * _noise(values)).all(axis=1)
    return known


def speed(motor: np.ndarray, time_s: ArrayLike | None) -> float:
    """Usual speed of the motor in rad/s; 0 where there are no times."""
    if time_s is None or len(motor) < 2:
        return 0.0
    return float(
        np.nanmedian(np.diff(motor)) / np.nanmedian(np.diff(np.asarray(time_s, dtype=float)))
    )


def _moving(motor):
    """Mask of the samples at which the motor runs at more than half its usual speed."""
    width = max(1, len(motor) // 40)
    if len(motor) <= 2 * width:
        return np.zeros(len(motor), dtype=bool)
    step = np.full(len(motor), np.nan)
    step[width:-width] = motor[2 * width :] - motor[: -2 * width]
    step[:width], step[-width:] = step[width], step[-width - 1]
    usual = np.median(step[np.isfinite(step)]) if np.isfinite(step).any() else np.nan
    return step > 0.5 * usual


def _noise(samples):
    """Standard deviation (k,) of one sample by the median of second differences, blind to rise, drift and spikes.

    Never less than a billionth of the range, which is what a flat-topped channel would otherwise show.
    """
    second = np.abs(np.diff(samples, n=2, axis=0))
    floor = np.maximum(1e-9 * np.ptp(samples, axis=0), noise.TINY)
    return np.maximum(np.median(second, axis=0) / (0.6745 * np.sqrt(6)), floor)


def _coarse_touch(motor, samples, used):
    """Motor angle of the break of the broken line (level, then rise) that explains most of both channels."""
    angle, binned = _binned(motor[used], samples[used])
    scaled = binned / _noise(samples[used])
    breaks = angle[:-2]
    ramp = np.maximum(0.0, angle[None, :] - breaks[:, None])
    ramp -= ramp.mean(axis=1, keepdims=True)
    along = ramp @ (scaled - scaled.mean(axis=0))
    explained = (along**2).sum(axis=1) / np.maximum((ramp**2).sum(axis=1), noise.TINY)
    return breaks[int(np.argmax(explained))]


def _binned(motor, samples):
    edges = np.linspace(0, len(motor), min(COARSE_BINS, len(motor)) + 1).astype(int)[:-1]
    counts = np.diff(np.append(edges, len(motor)))
    mean = np.add.reduceat(samples, edges, axis=0) / counts[:, None]
    return np.add.reduceat(motor, edges) / counts, mean


def _coarse_status(motor, samples, used, touch):
    after, before = used & (motor > touch), used & (motor <= touch)
    if np.count_nonzero(after) < MIN_RISE_SAMPLES:
        return NO_RISE
    scatter = np.std(noise.line_residuals(motor, samples, after), axis=0)
    rise = noise.line_slope(motor, samples, after) * (motor[after].max() - touch)
    if np.hypot.reduce(rise / np.maximum(scatter, noise.TINY)) < MIN_RISE_IN_SIGMAS:
        return NO_RISE
    if np.count_nonzero(before) < MIN_FREE_SAMPLES or _rises_already(motor, samples, before, after):
        return NO_FREE_STROKE
    return ""


def _rises_already(motor, samples, before, after):
    """Does the supposed free stroke rise at more than a third of the later rate, beyond doubt?"""
    rate = noise.line_slope(motor, samples, after)
    size = np.hypot.reduce(rate)
    slope = noise.line_slope(motor, samples, before) @ rate / size
    scatter = np.std(noise.line_residuals(motor, samples, before) @ rate / size)
    spread = np.std(motor[before]) * np.sqrt(np.count_nonzero(before))
    return slope > max(size / 3, 5 * scatter / max(spread, noise.TINY))


def _extrapolate(motor, samples, used, touch, window, guard):
    """One pass of `felt_touch` around a touch angle already known roughly."""
    free = used & (motor < touch - guard)
    rising = used & (motor > touch + guard) & (motor <= touch + window)
    if np.count_nonzero(free) < MIN_FREE_SAMPLES:
        return Touch.none(NO_FREE_STROKE)
    if np.count_nonzero(rising) < MIN_RISE_SAMPLES:
        return Touch.none(SHORT_RISE)
    level = free_level(motor, samples, free)
    weights = noise.line_weights(motor, rising, touch)
    memory = noise.Memory.of(motor, samples, free, rising)
    scatter = noise.wider(
        memory.of_sum(weights), noise.Memory.of(motor, samples, rising).of_sum(weights)
    )
    slope = noise.line_slope(motor, samples, rising)
    gap = noise.weighted_sum(weights, samples, rising) - level.offset
    pull = np.linalg.pinv(scatter + level.covariance_between(touch, touch), hermitian=True) @ slope
    information = slope @ pull
    sigma = 1 / np.sqrt(max(information, noise.TINY))
    if not sigma < window / 3:
        return Touch.none(VAGUE)
    gain = pull / information
    rise = Rise(slope, gain, weights, memory)
    return Touch(float(touch - gap @ gain), float(sigma), level=level, rise=rise)


def free_level(motor: np.ndarray, samples: np.ndarray, free: np.ndarray) -> Level:
    """The level of the samples (n, k) of a free stroke, a mask (n,), over motor angles (n,)."""
    weights = noise.mean_weights(free)
    memory = noise.Memory.of(motor, samples, free)
    centre = motor[free].mean()
    per_rad = noise.line_weights(motor, free, centre + 1.0) - weights
    doubt = np.diag(memory.of_sum(per_rad))
    drift = np.sqrt(np.maximum(0.0, noise.line_slope(motor, samples, free) ** 2 - doubt))
    return Level(
        noise.weighted_sum(weights, samples, free), memory.of_sum(weights), drift, float(centre)
    )
