"""Felt touch: the motor angle at which the moments leave the level of the free stroke.

Plain arrays over one forward stroke: motor angle (n,) in rad, moments (n,) or (n, 2) in N·mm or
volts, time (n,) in s.
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

# [rad] How far past the touch the line is fitted to the rise, which bends beyond. By 1.4° or 2.9°
# numbers of a whisk move by 0.9 or 0.4 sigma at most. Study: bench_thresholds.py estimator.onset
# WINDOW_RAD ….
WINDOW_RAD = np.radians(2.0)
# [s] Shortest window of the rise: three periods of mains hum. Stated.
WINDOW_S = 0.06
# [rad] To either side of the touch, samples that belong neither to the free stroke nor to the rise.
# Half or twice it moves numbers of a whisk by 0.4 sigma at most. Study: bench_thresholds.py
# estimator.onset GUARD_RAD ….
GUARD_RAD = np.radians(0.1)
# [sigma] Smallest rise over the scatter of one sample that counts as a touch. 5 to 12 move nothing
# on the fixtures. Study: bench_thresholds.py estimator.onset MIN_RISE_IN_SIGMAS ….
MIN_RISE_IN_SIGMAS = 8.0
# [rad] To what readings of a motor are written: a hundred-thousandth of a degree. Steps of an encoder
# are multiples of it. Stated.
READING_RAD = np.radians(1e-5)
# [1] Of that, the rounding of a reading in radians: that of a double at 360° is 5e-9 of it. Stated.
READING_ROUNDING = 1e-3
# [samples] Fewest of the free stroke, from which level and drift are measured. Stated.
MIN_FREE_SAMPLES = 20
# [samples] Fewest of the rise, to which the line is fitted. Stated.
MIN_RISE_SAMPLES = 12
# [bins] In which the coarse touch is searched. Stated.
COARSE_BINS = 120
# [sigma] Distance of a sample from its neighbours' median beyond which it is a spike. 5 to 15 move
# nothing on the fixtures. Study: bench_thresholds.py estimator.onset SPIKE_IN_SIGMAS ….
SPIKE_IN_SIGMAS = 8.0


@dataclass(frozen=True)
class Level:
    """Reading of the moments without contact.

    offset (k,) with covariance (k, k), at the motor angle centre_rad. drift (k,) per rad: slope of
    the free stroke beyond its noise. It is not subtracted: extrapolated past the free stroke it
    would bring more noise than it removes. It widens the covariance instead.
    """

    offset: np.ndarray
    covariance: np.ndarray
    drift: np.ndarray
    centre_rad: float

    def covariance_between(self, one_rad: float, other_rad: float) -> np.ndarray:
        """Return the covariance (k, k) of the level's errors at two motor angles."""
        one = one_rad - self.centre_rad
        other = other_rad - self.centre_rad
        return self.covariance + np.diag(self.drift**2) * one * other


@dataclass(frozen=True)
class Rise:
    """The fitted rise: gain (k,) turns moments above the level into rad past the touch.

    weights (n,) make the line's value at the touch from the samples; memory describes the noise of
    these.
    """

    gain: np.ndarray
    weights: np.ndarray
    memory: noise.Memory


@dataclass(frozen=True)
class FeltTouch:
    """First touch as found in the moments, with its standard deviation; both NaN where status is
    not empty.

    level, rise: what the touch was found from.
    """

    motor_rad: float
    sigma_rad: float
    status: str = ""
    level: Level | None = field(default=None, repr=False)
    rise: Rise | None = field(default=None, repr=False)

    @classmethod
    def none(cls, status: str) -> "FeltTouch":
        """Return that there is no touch, and why."""
        return cls(np.nan, np.nan, status)

    @property
    def offset(self) -> np.ndarray:
        """Return the level (k,) of the free stroke, which is to be subtracted from the moments."""
        return self.level.offset


def felt_touch(
    motor_rad: ArrayLike,
    moments: ArrayLike,
    time_s: ArrayLike | None = None,
    *,
    steps: np.ndarray | None = None,
) -> FeltTouch:
    """Find the touch where a line fitted to the rise of the moments meets the level of the free
    stroke.

    The rise is fitted from GUARD_RAD to WINDOW_RAD past the touch, and over 60 ms at least where
    time_s is given, so that fast strokes average over hum and vibration too. The channels share one
    touch angle, weighted by the inverse of their scatter's covariance: where the whisker sticks and
    slips, the scatter lies along the surface, so that the weight falls on the moment across it,
    which rises evenly whatever the slip. Isolated spikes and NaN are left out. steps (k,): of the
    converter, which `converter_steps` reads from the moments where they are not given. Raises
    ValueError where motor angles and moments do not have the same samples.
    """
    motor, samples = columns(motor_rad, moments)
    if steps is None:
        steps = converter_steps(samples)
    used = usable(motor, samples) & _moving(motor)
    if np.count_nonzero(used) < MIN_FREE_SAMPLES + MIN_RISE_SAMPLES:
        return FeltTouch.none(TOO_FEW)
    touch = _coarse_touch(motor, samples, used)
    status = _coarse_status(motor, samples, used, touch)
    if status:
        return FeltTouch.none(status)
    window = max(WINDOW_RAD, speed(motor, time_s) * WINDOW_S)
    for share in (2.0, 1.0, 1.0, 1.0):
        found = _extrapolate(motor, samples, used, touch, share * window, steps)
        if found.status:
            return found
        touch = found.motor_rad
    return found


def columns(motor_rad: ArrayLike, moments: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Return motor angles (n,) and moments (n, k) as float arrays.

    Raises ValueError where they do not have the same samples.
    """
    motor = np.asarray(motor_rad, dtype=float)
    samples = np.asarray(moments, dtype=float)
    if samples.ndim == 1:
        samples = samples[:, None]
    if motor.ndim != 1 or samples.ndim != 2 or samples.shape[0] != motor.size:
        raise ValueError(
            f"motor angles {motor.shape} and moments {samples.shape} must have the same samples"
        )
    return motor, samples


def usable(motor: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Return the mask (n,) of the samples that are known in all columns and are no spikes."""
    known = np.isfinite(motor) & np.isfinite(samples).all(axis=1)
    if np.count_nonzero(known) < 5:
        return known
    values = samples[known]
    neighbours = [np.roll(values, shift, axis=0) for shift in (-2, -1, 0, 1, 2)]
    residual = np.abs(values - np.median(neighbours, axis=0))
    residual[:2] = 0.0
    residual[-2:] = 0.0
    known[known] = (residual <= SPIKE_IN_SIGMAS * _noise(values)).all(axis=1)
    return known


def speed(motor: np.ndarray, time_s: ArrayLike | None) -> float:
    """Return the usual speed of the motor in rad/s; 0 where there are no times."""
    if time_s is None or len(motor) < 2:
        return 0.0
    times = np.asarray(time_s, dtype=float)
    return float(np.nanmedian(np.diff(motor)) / np.nanmedian(np.diff(times)))


def _moving(motor):
    """Return the mask of the samples at which the motor runs at more than half its usual speed."""
    width = max(1, len(motor) // 40)
    if len(motor) <= 2 * width:
        return np.zeros(len(motor), dtype=bool)
    step = np.pad(motor[2 * width :] - motor[: -2 * width], width, mode="edge")
    finite = step[np.isfinite(step)]
    usual = np.median(finite) if len(finite) else np.nan
    return step > 0.5 * usual


def _noise(samples):
    """Estimate the standard deviation (k,) of one sample by the median of second differences.

    It is blind to rise, drift and spikes, and never less than a billionth of the range: a channel
    whose values are mostly equal would show nothing.
    """
    second = np.abs(np.diff(samples, n=2, axis=0))
    floor = np.maximum(1e-9 * np.ptp(samples, axis=0), noise.TINY)
    return np.maximum(np.median(second, axis=0) / (0.6745 * np.sqrt(6)), floor)


def _coarse_touch(motor, samples, used):
    """Find the motor angle of the break of the broken line (level, then rise) that explains most of
    both channels.
    """
    angle, binned = _binned(motor[used], samples[used])
    scaled = binned / _noise(samples[used])
    breaks = angle[:-2]
    ramp = np.maximum(0.0, angle[None, :] - breaks[:, None])  # (breaks, bins) rad
    ramp -= ramp.mean(axis=1, keepdims=True)
    projection = ramp @ (scaled - scaled.mean(axis=0))  # (breaks, k)
    power = np.maximum((ramp**2).sum(axis=1), noise.TINY)
    explained = (projection**2).sum(axis=1) / power
    return breaks[int(np.argmax(explained))]


def _binned(motor, samples):
    """Return the means of motor angles (bins,) and samples (bins, k) in at most COARSE_BINS equal
    bins.
    """
    bins = min(COARSE_BINS, len(motor))
    edges = np.linspace(0, len(motor), bins + 1).astype(int)
    counts = np.diff(edges)
    begins = edges[:-1]
    mean = np.add.reduceat(samples, begins, axis=0) / counts[:, None]
    return np.add.reduceat(motor, begins) / counts, mean


def _coarse_status(motor, samples, used, touch):
    """Return why there is no touch at the coarse one: no rise, or no free stroke; empty where there
    is.
    """
    after = used & (motor > touch)
    before = used & (motor <= touch)
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
    """Check whether the supposed free stroke rises significantly, at more than a third of the later
    rate.
    """
    rate = noise.line_slope(motor, samples, after)
    size = np.hypot.reduce(rate)
    slope = noise.line_slope(motor, samples, before) @ rate / size
    residuals = noise.line_residuals(motor, samples, before) @ rate / size
    spread = np.std(motor[before]) * np.sqrt(np.count_nonzero(before))
    sigma = np.std(residuals) / max(spread, noise.TINY)  # of the slope
    return slope > max(size / 3, 5 * sigma)


def _extrapolate(motor, samples, used, touch, window, steps):
    """Return the touch of one pass of `felt_touch`, which starts from an earlier touch."""
    past_rad = motor - touch
    free = used & (past_rad < -GUARD_RAD)
    rising = used & (past_rad > GUARD_RAD) & (past_rad <= window)
    if np.count_nonzero(free) < MIN_FREE_SAMPLES:
        return FeltTouch.none(NO_FREE_STROKE)
    if np.count_nonzero(rising) < MIN_RISE_SAMPLES:
        return FeltTouch.none(SHORT_RISE)
    level = free_level(motor, samples, free, steps)
    rise, by_noise = _fit_rise(motor, samples, free, rising, touch, level)
    if not by_noise < window / 3:
        return FeltTouch.none(VAGUE)
    sigma = np.sqrt(by_noise**2 + hidden_step_variance(motor, free | rising))
    line_at_touch = noise.weighted_sum(rise.weights, samples, rising)
    meets_level_rad = touch - (line_at_touch - level.offset) @ rise.gain
    return FeltTouch(float(meets_level_rad), float(sigma), level=level, rise=rise)


def _fit_rise(motor, samples, free, rising, touch, level):
    """Return the line through the rise, and the standard deviation (rad) of where it meets the
    level.
    """
    weights = noise.line_weights(motor, rising, touch)
    memory = noise.Memory.of(motor, samples, free, rising)
    own = noise.Memory.of(motor, samples, rising)
    scatter = noise.wider(memory.of_sum(weights), own.of_sum(weights))
    covariance = scatter + level.covariance_between(touch, touch)  # (k, k) of line less level
    slope = noise.line_slope(motor, samples, rising)
    pull = np.linalg.pinv(covariance, hermitian=True) @ slope
    information = slope @ pull  # 1/rad²
    sigma = 1 / np.sqrt(max(information, noise.TINY))
    return Rise(pull / information, weights, memory), sigma


def hidden_step_variance(motor: np.ndarray, used: np.ndarray) -> float:
    """Return the variance (rad²) of a motor's angles (n,) by its encoder's steps that no sample shows.

    A reading is off by a uniform error of one step, q²/12. As far as this scatters about a steady
    motion it is noise, and averages out; where the motor goes a whole number of steps from sample to
    sample it is one and the same for all of them. used (n,): mask of the samples that count.
    """
    readings = motor[used] / READING_RAD
    counts = np.rint(readings)
    if np.abs(readings - counts).max() > READING_ROUNDING:
        return 0.0
    step = np.gcd.reduce(counts.astype(np.int64)) * READING_RAD
    scatter = noise.line_residuals(np.arange(len(motor), dtype=float), motor[:, None], used)
    return max(0.0, step**2 / 12 - float(np.mean(scatter**2)))


def converter_steps(samples: np.ndarray) -> np.ndarray:
    """Return the steps (k,) of the converter that recorded the samples (n, k) of a whole stroke, 0
    where a channel shows none.
    """
    steps = np.zeros(samples.shape[1])
    for channel, values in enumerate(samples.T):
        levels = np.unique(values[np.isfinite(values)])
        if len(levels) > 1:
            steps[channel] = np.diff(levels).min()
    return steps


def free_level(
    motor: np.ndarray, samples: np.ndarray, free: np.ndarray, steps: np.ndarray
) -> Level:
    """Measure the level of the samples (n, k) of a free stroke, a mask (n,), over motor angles
    (n,); steps (k,) of the converter.
    """
    weights = noise.mean_weights(free)
    memory = noise.Memory.of(motor, samples, free)
    centre = motor[free].mean()
    per_rad = noise.line_weights(motor, free, centre + 1.0) - weights
    variance = np.diag(memory.of_sum(per_rad))
    slope = noise.line_slope(motor, samples, free)
    drift = np.sqrt(np.maximum(0.0, slope**2 - variance))
    offset = noise.weighted_sum(weights, samples, free)
    covariance = memory.of_sum(weights) + np.diag(hidden_level_variance(samples, free, steps))
    return Level(offset, covariance, drift, float(centre))


def hidden_level_variance(samples: np.ndarray, free: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return the variances (k,) of a level's channels by a converter's steps that their noise does not hide.

    A channel that stays on one step q is off by a uniform error, q²/12. Noise of standard deviation s
    carries it over the steps, and the mean's error falls by exp(−4π² s²/q²) in variance (Widrow and Kollár,
    Quantization Noise, 2008). samples (n, k); free (n,): mask of those of the level; steps (k,), 0 of a
    channel without.
    """
    by_steps = steps**2 / 12
    noise_variance = np.maximum(0.0, np.var(samples[free], axis=0) - by_steps)
    in_steps = noise_variance / np.where(steps > 0, steps, np.inf) ** 2
    return by_steps * np.exp(-4 * np.pi**2 * in_steps)
