"""How far the gauges' zero may wander within a stroke, from all free strokes of a session together.

One free stroke of a few tenths of a second hardly separates a drift from noise, and where no free
stroke follows the contact a steady drift is indistinguishable from another gauge factor. So the
rate is taken from many strokes, with what they cannot rule out, and goes into the sigma of
everything that is read from a gauge.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.gauges.felt import FeltStroke, is_free
from estimator import noise
from estimator.signal import FeltTouch

# [rounds] Of weights and excess; after five nothing changes that matters.
_ROUNDS = 10


@dataclass(frozen=True)
class FreeSlope:
    """Slope (k,) of the channels over a free stroke, per second, and its variance (k,) from noise."""

    slope: np.ndarray
    variance: np.ndarray


def free_slope(stroke: FeltStroke) -> FreeSlope | None:
    """Fit the slope of a stroke's channels before felt touch; None where there is no touch."""
    return _slope_of(stroke, stroke.channels)


def force_slope(stroke: FeltStroke) -> FreeSlope | None:
    """Fit the slope of a load cell's forces, (3,), before felt touch; None where there is none."""
    return None if stroke.forces_N is None else _slope_of(stroke, stroke.forces_N)


def _slope_of(stroke: FeltStroke, samples: np.ndarray) -> FreeSlope | None:
    """Fit the slope of samples (n, k) before felt touch; None where there is no touch."""
    touch = stroke.touch
    if touch.status:
        return None
    time_s = stroke.time_s
    free = is_free(stroke.motor_rad, touch) & np.isfinite(samples).all(axis=1)
    samples = np.where(free[:, None], samples, 0.0)
    after_a_second = noise.line_weights(time_s, free, time_s[0] + 1.0)
    per_second = after_a_second - noise.line_weights(time_s, free, time_s[0])
    variance = np.diag(noise.Memory.of(time_s, samples, free).of_sum(per_second))
    return FreeSlope(noise.line_slope(time_s, samples, free), variance)


def drift_rate(slopes: Sequence[FreeSlope]) -> np.ndarray:
    """Estimate the RMS rate (k,) of the channels' drift, per second; zeros (2,) without slopes.

    It is the slopes' mean square beyond their noise, and one standard deviation of that, which the
    strokes cannot rule out. A square scatters by √2 of its own mean: each stroke counts by one over
    the square of that, for a fast one is short and has hardly any information.
    """
    if not slopes:
        return np.zeros(2)
    squares = np.array([each.slope**2 for each in slopes])  # (strokes, k)
    variances = np.array([each.variance for each in slopes])
    excess = np.zeros(squares.shape[1])
    for _ in range(_ROUNDS):
        information = 0.5 / np.maximum(excess + variances, noise.TINY) ** 2
        mean = np.sum(information * (squares - variances), axis=0) / information.sum(axis=0)
        excess = np.maximum(0.0, mean)
    return np.sqrt(excess + information.sum(axis=0) ** -0.5)


def allow_drift(touch: FeltTouch, rate: np.ndarray, speed_rad_s: float) -> FeltTouch:
    """Return a touch with a zero that may drift at `rate` (k,) per second.

    The rate is the session's, and not the stroke's own, which is mostly noise. The touch's sigma
    takes the one for the other too, so that it agrees with its covariances.
    """
    if touch.status or speed_rad_s <= 0:
        return touch
    at = touch.motor_rad
    level = replace(touch.level, drift=np.asarray(rate) / speed_rad_s)
    added = level.covariance_between(at, at) - touch.level.covariance_between(at, at)
    variance = touch.sigma_rad**2 + touch.rise.gain @ added @ touch.rise.gain
    return replace(touch, level=level, sigma_rad=float(np.sqrt(variance)))
