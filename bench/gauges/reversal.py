"""What the way back tells of the gauges: hysteresis and the return to zero, where a back stroke was recorded."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.base.settings import Settings
from bench.gauges.felt import Stroke, strokes_of
from bench.session.signals import Signals, forward_strokes
from bench.session.strokes import without_spikes
from bench.session.trial import Trial

_GUARD_RAD = np.radians(0.2)  # rad before felt touch, beyond what that is uncertain by. Set by eye
_LEAST_SAMPLES = 20  # of a mean or a way back: fewer tell no level beyond the noise. Set by eye
# between a tenth and nine tenths of the push: the largest of so many is the hysteresis
_ANGLES = 15
_HALF_WINDOW_RAD = np.radians(0.15)  # rad: a line is straight over twice that. Set by eye


@dataclass(frozen=True)
class Reversal:
    """One whisk there and back. difference (k, 2): volts back less forward, at the same motor angles, from 1/10 to 9/10
    of the push; zero_return (2,): level after less level before; NaN where the motor did not come back so far."""

    trial: str
    difference: np.ndarray
    zero_return: np.ndarray


def reversals(trial: Trial, signals: Signals, settings: Settings) -> list[Reversal]:
    """A Reversal for each whisk whose way back was recorded."""
    places = forward_strokes(signals)
    ends = [*(place.start for place in places[1:]), len(signals.motor_rad)]
    strokes = strokes_of(signals, trial, settings, level=False)
    motor, _ = without_spikes(signals.motor_rad)
    channels = np.stack([signals.y, signals.z], axis=1)
    of_whisks = [
        _reversal(trial.name, stroke, motor[place.stop : end], channels[place.stop : end])
        for stroke, place, end in zip(strokes, places, ends)
    ]
    return [one for one in of_whisks if one is not None]


def _reversal(name: str, stroke: Stroke, motor, channels) -> Reversal | None:
    touch = stroke.touch()
    if touch.status or len(motor) < _LEAST_SAMPLES:
        return None
    push = stroke.motor_rad[-1] - touch.motor_rad
    if motor.min() > touch.motor_rad + 0.1 * push:
        return None
    angles = touch.motor_rad + push * np.linspace(0.1, 0.9, _ANGLES)
    there, back = (
        _means(m, c, angles) for m, c in ((stroke.motor_rad, stroke.channels), (motor, channels))
    )
    free = motor < touch.motor_rad - _GUARD_RAD
    after = (
        np.nanmean(channels[free], axis=0) if free.sum() >= _LEAST_SAMPLES else np.full(2, np.nan)
    )
    return Reversal(name, back - there, after - touch.offset)


def _means(motor, channels, angles) -> np.ndarray:
    """Channels (k, 2) at motor angles: a line through the samples around each."""
    near = (np.abs(motor - angle) < _HALF_WINDOW_RAD for angle in angles)
    good = np.isfinite(channels).all(axis=1)
    return np.array(
        [_line_at(motor[n & good] - angle, channels[n & good]) for n, angle in zip(near, angles)]
    )


def _line_at(motor, channels) -> np.ndarray:
    """The line's value (2,) at motor = 0; NaN where there is none."""
    if len(motor) < 3 or np.ptp(motor) == 0.0:
        return np.full(2, np.nan)
    return np.polyfit(motor, channels, 1)[-1]


def in_percent(
    reversals: Sequence[Reversal], matrix: np.ndarray, full_scale_Nmm: np.ndarray
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Largest hysteresis (2,) and largest return error (2,) of m_y, m_z in % of full scale; None where not measured."""
    scale = 100.0 / np.asarray(full_scale_Nmm)
    differences = [np.nanmax(np.abs(one.difference @ matrix.T), axis=0) for one in reversals]
    returns = [
        np.abs(matrix @ one.zero_return) for one in reversals if np.isfinite(one.zero_return).all()
    ]
    return tuple(
        np.max(values, axis=0) * scale if values else None for values in (differences, returns)
    )
