"""How far the gauges' zero may wander within a stroke, from all free strokes of a session together.

One free stroke of a few tenths of a second hardly tells a drift from noise, and where no free stroke follows the
contact a steady drift looks exactly like another gauge factor. So the rate is taken from many strokes, with what they
cannot rule out, and goes into the sigma of everything that is read from a gauge.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.gauges.felt import Stroke
from estimator import noise
from estimator.signal import FeltTouch

_GUARD_RAD = np.radians(0.1)  # rad before felt touch, beyond what that is uncertain by. Set by eye
_ROUNDS = 10  # of weights and excess; after five nothing changes that matters


@dataclass(frozen=True)
class FreeSlope:
    """Slope (k,) of the channels over a free stroke, per second, and its variance (k,) from noise alone."""

    slope: np.ndarray
    variance: np.ndarray


def free_slope(stroke: Stroke) -> FreeSlope | None:
    """Of a stroke's samples before felt touch; None where there is no touch."""
    return _slope_of(stroke, stroke.channels)


def force_slope(stroke: Stroke) -> FreeSlope | None:
    """Of a load cell's forces, (3,), likewise; None where there is none."""
    return None if stroke.forces_N is None else _slope_of(stroke, stroke.forces_N)


def _slope_of(stroke: Stroke, samples: np.ndarray) -> FreeSlope | None:
    touch = stroke.touch()
    if touch.status:
        return None
    free = (stroke.motor_rad < touch.motor_rad - _GUARD_RAD) & np.isfinite(samples).all(axis=1)
    samples = np.where(free[:, None], samples, 0.0)
    start = stroke.time_s[0]
    per_second = noise.line_weights(stroke.time_s, free, start + 1.0) - noise.line_weights(
        stroke.time_s, free, start
    )
    variance = np.diag(noise.Memory.of(stroke.time_s, samples, free).of_sum(per_second))
    return FreeSlope(noise.line_slope(stroke.time_s, samples, free), variance)


def drift_rate(slopes: Sequence[FreeSlope]) -> np.ndarray:
    """RMS rate (k,) of the channels' drift, per second: the slopes' mean square beyond their noise, and one standard
    deviation of that, which is what the strokes cannot rule out. Two zeros where there are no slopes.

    A square scatters by √2 of its own mean: each stroke counts by one over the square of that, for a fast one is short
    and tells hardly anything.
    """
    if not slopes:
        return np.zeros(2)
    squares, variances = (
        np.array([s.slope**2 for s in slopes]),
        np.array([s.variance for s in slopes]),
    )
    excess = np.zeros(squares.shape[1])
    for _ in range(_ROUNDS):
        information = 0.5 / np.maximum(excess + variances, noise.TINY) ** 2
        excess = np.maximum(
            0.0, np.sum(information * (squares - variances), axis=0) / information.sum(axis=0)
        )
    return np.sqrt(excess + information.sum(axis=0) ** -0.5)


def allow_drift(touch: FeltTouch, rate: np.ndarray, speed_rad_s: float) -> FeltTouch:
    """The same touch, with a zero that may drift at `rate` (k,) per second: the session's, and not the stroke's own,
    which is mostly noise. The touch's sigma takes the one for the other too, so that it agrees with its covariances."""
    if touch.status or speed_rad_s <= 0:
        return touch
    level, at = replace(touch.level, drift=np.asarray(rate) / speed_rad_s), touch.motor_rad
    added = level.covariance_between(at, at) - touch.level.covariance_between(at, at)
    variance = touch.sigma_rad**2 + touch.rise.gain @ added @ touch.rise.gain
    return replace(touch, level=level, sigma_rad=float(np.sqrt(variance)))
