"""Moments at the base over a whole recording: the quasi-static ones of each whisk, and what rings on top."""

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from bench.rig.marched import Instants, MarchedWhisk
from bench.rig.stroke import Stroke
from bench.rig.vibration import Mode, ring

_TICK_S = 5e-4  # s: over which the motor's speed, and its changes, are taken


def quasi_static_Nmm(
    stroke: Stroke, whisks: Sequence[MarchedWhisk], times_s: np.ndarray
) -> np.ndarray:
    """(n, 2): m_y, m_z in the hub frame at times, without vibration."""
    return _over_time(stroke, whisks, times_s, Instants.moments_at, 2)


def base_force_N(stroke: Stroke, whisks: Sequence[MarchedWhisk], times_s: np.ndarray) -> np.ndarray:
    """(n, 3): force of the base on the whisker in the hub frame at times, likewise."""
    return _over_time(stroke, whisks, times_s, Instants.forces_at, 3)


def _over_time(
    stroke, whisks, times_s, at: Callable[[Instants, np.ndarray], np.ndarray], count
) -> np.ndarray:
    """(n, count): zeros where there is no whisk."""
    motor = stroke.angle_rad(times_s)
    found = np.zeros((len(times_s), count))
    for whisk, start, turn, end in _periods(stroke, whisks):
        rising, falling = (times_s >= start) & (times_s <= turn), (times_s > turn) & (times_s < end)
        found[rising] = at(whisk.forward, motor[rising])
        found[falling] = at(whisk.back or whisk.forward, motor[falling])
    return found


def ringing_Nmm(
    stroke: Stroke, whisks: Sequence[MarchedWhisk], times_s: np.ndarray, damping: float
) -> np.ndarray:
    """(n, 2): the free mode rung by the motor's ramps, the propped one by touch and by every jump of stick–slip."""
    rod, total = whisks[0].rod, np.zeros((len(times_s), 2))
    free = Mode.of(rod)
    propped = Mode.of(rod, min(whisks[0].touch.arc_mm, 0.999 * rod.length_mm))
    for number, (whisk, start, _, end) in enumerate(_periods(stroke, whisks)):
        touch_s = float(stroke.time_s(number, whisk.touch.motor_rad))
        for when, change in _speed_changes(stroke, start, touch_s):
            rate = free.swing * change * free.moment_Nmm
            total[:, 1] += ring(times_s, when, touch_s, free.frequency_rad_s, damping, rate=rate)
        struck = (
            propped.strike
            * _speed(stroke, touch_s)
            * propped.moment_Nmm
            * _push(whisk)
            / propped.push_Nmm
        )
        for axis in (0, 1):
            total[:, axis] += ring(
                times_s, touch_s, end, propped.frequency_rad_s, damping, rate=struck[axis]
            )
        for when, jump in _jumps(stroke, number, whisk):
            for axis in (0, 1):
                total[:, axis] += ring(
                    times_s, when, end, propped.frequency_rad_s, damping, value=-jump[axis]
                )
    return total


def _periods(stroke, whisks) -> Iterator[tuple[MarchedWhisk, float, float, float]]:
    """Each whisk with its beginning, its turning back and its end; together they are the whole recording."""
    starts = [0.0, *(start for start, _ in stroke.forward[1:])]
    for whisk, start, end, (_, turn) in zip(
        whisks, starts, [*starts[1:], math.inf], stroke.forward
    ):
        yield whisk, start, turn, end


def _speed(stroke, time_s):
    return float(stroke.angle_rad(time_s + _TICK_S) - stroke.angle_rad(time_s)) / _TICK_S


def _speed_changes(stroke, start, end):
    """Times and steps of the motor's speed, ramps taken in ticks."""
    ticks = np.arange(start, end, _TICK_S)
    changes = np.diff(stroke.angle_rad(ticks), 2) / _TICK_S
    for i in np.nonzero(np.abs(changes) > 1e-6)[0]:
        yield ticks[i + 1], changes[i]


def _push(whisk):
    """(2,) moment for a radian of pushing, from the first instants after touch."""
    few = min(3, len(whisk.forward.motor_rad) - 1)
    return whisk.forward.moment_Nmm[few] / (whisk.forward.motor_rad[few] - whisk.touch.motor_rad)


def _jumps(stroke, number, whisk):
    """Times and moment steps of stick–slip on the forward stroke."""
    angles, moments = whisk.forward.motor_rad, whisk.forward.moment_Nmm
    for i in np.nonzero(np.diff(angles) == 0)[0]:
        yield float(stroke.time_s(number, angles[i])), moments[i + 1] - moments[i]
