"""Moments at the base over a recording: the quasi-static ones of each whisk, and what rings on top."""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from bench.rig.stroke import Stroke
from bench.rig.vibration import Mode, damped_oscillation
from bench.rig.whisk_mechanics import ContactPath, WhiskMechanics

_TICK_S = 5e-4  # s: over which the motor's speed, and its changes, are taken
# [s] A sample as near to the turn of a stroke is at the turn: both times are sums of rounded numbers,
# some 1e-16 s wrong, and far fewer than samples. Derived.
_SAME_TIME_S = 1e-9
_PROP_SHARE = 0.999  # of the length: the farthest prop of a mode


def quasi_static_Nmm(
    stroke: Stroke, whisks: Sequence[WhiskMechanics], times_s: np.ndarray
) -> np.ndarray:
    """Return (n, 2): m_y, m_z in the hub frame at times (n,), without vibration."""
    return _over_time(stroke, whisks, times_s, ContactPath.moments_at, 2)


def base_force_N(
    stroke: Stroke, whisks: Sequence[WhiskMechanics], times_s: np.ndarray
) -> np.ndarray:
    """Return (n, 3): force of the base on the whisker in the hub frame at times (n,), without
    vibration."""
    return _over_time(stroke, whisks, times_s, ContactPath.forces_at, 3)


def _over_time(
    stroke, whisks, times_s, at: Callable[[ContactPath, np.ndarray], np.ndarray], count
) -> np.ndarray:
    """Evaluate (n, count) of the whisks' strokes at times; zeros where there is no whisk.

    A sample at the turn of a stroke belongs to the forward one.
    """
    motor = stroke.angle_rad(times_s)
    values = np.zeros((len(times_s), count))
    for whisk, start, turn, end in _periods(stroke, whisks):
        is_forward = times_s <= turn + _SAME_TIME_S
        rising = (times_s >= start) & is_forward
        falling = ~is_forward & (times_s < end)
        values[rising] = at(whisk.forward, motor[rising])
        values[falling] = at(whisk.back or whisk.forward, motor[falling])
    return values


def ringing_Nmm(
    stroke: Stroke, whisks: Sequence[WhiskMechanics], times_s: np.ndarray, damping: float
) -> np.ndarray:
    """Return (n, 2): the free mode rung by the motor's ramps, the propped one by touch and by every
    jump of stick–slip."""
    free, propped = _modes(whisks[0])
    ring_free = _oscillation(free, times_s, damping)
    ring_propped = _oscillation(propped, times_s, damping)
    total = np.zeros((len(times_s), 2))
    for number, (whisk, start_s, _, end_s) in enumerate(_periods(stroke, whisks)):
        touch_s = stroke.time_s(number, whisk.touch.motor_rad)
        for at_s, change_rad_s in _speed_changes(stroke, start_s, touch_s):
            rate = free.swing * change_rad_s * free.moment_Nmm
            total[:, 1] += ring_free(at_s, touch_s, rate=rate)
        strike_Nmm = _strike_rate(propped, whisk, stroke, touch_s)
        total += np.outer(ring_propped(touch_s, end_s, rate=1.0), strike_Nmm)
        for at_s, jump_Nmm in _jumps(stroke, number, whisk):
            total -= np.outer(ring_propped(at_s, end_s, value=1.0), jump_Nmm)
    return total


def _oscillation(mode, times_s, damping) -> Callable[..., np.ndarray]:
    """Return `damped_oscillation` of a mode at times (n,), by its beginning, end and value or rate."""
    frequency = mode.frequency_rad_s
    return partial(damped_oscillation, times_s, frequency_rad_s=frequency, damping=damping)


def _modes(whisk):
    """Return the free mode of a whisk's rod, and that propped where it first touches."""
    rod = whisk.rod
    prop_mm = min(whisk.touch.arc_mm, _PROP_SHARE * rod.length_mm)
    return Mode.solve(rod), Mode.solve(rod, prop_mm)


def _strike_rate(propped, whisk, stroke, touch_s):
    """Return the rate (2,), N·mm/s, of the moments with which touch sets the propped mode going."""
    per_push = propped.strike * _speed(stroke, touch_s) * propped.moment_Nmm / propped.push_Nmm
    return per_push * _moment_per_rad(whisk)


def _periods(stroke, whisks) -> Iterator[tuple[WhiskMechanics, float, float, float]]:
    """Yield each whisk with its beginning, its turning back and its end, s; together they are the
    whole recording.

    The motor turns back in the middle between its steady motions: it slows down and rests before.
    """
    starts = [start for start, _ in stroke.forward]
    ends = [*starts[1:], math.inf]
    starts[0] = 0.0
    turns = [math.inf] * len(starts)
    if stroke.back:
        steady = zip(stroke.forward, stroke.back)
        turns = [0.5 * (forward[1] + back[0]) for forward, back in steady]
    yield from zip(whisks, starts, turns, ends)


def _speed(stroke, time_s):
    """Return the motor's speed, rad/s."""
    return float(stroke.angle_rad(time_s + _TICK_S) - stroke.angle_rad(time_s)) / _TICK_S


def _speed_changes(stroke, start, end):
    """Yield times and steps, rad/s, of the motor's speed, ramps taken in ticks."""
    ticks = np.arange(start, end, _TICK_S)
    changes = np.diff(stroke.angle_rad(ticks), 2) / _TICK_S
    for i in np.nonzero(np.abs(changes) > 1e-6)[0]:
        yield ticks[i + 1], changes[i]


def _moment_per_rad(whisk):
    """Return the moment (2,) for a radian of pushing, from the first instants after touch."""
    row = min(3, len(whisk.forward.motor_rad) - 1)
    return whisk.forward.moment_Nmm[row] / (whisk.forward.motor_rad[row] - whisk.touch.motor_rad)


def _jumps(stroke, number, whisk):
    """Yield times and moment steps (2,) of stick–slip on the forward stroke."""
    angles = whisk.forward.motor_rad
    moments = whisk.forward.moment_Nmm
    for i in np.nonzero(np.diff(angles) == 0)[0]:
        yield float(stroke.time_s(number, angles[i])), moments[i + 1] - moments[i]
