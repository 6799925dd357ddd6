"""Hysteresis of the gauges and the return to zero, from the way back, where a back stroke was recorded."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.base.settings import Settings
from bench.gauges.felt import FeltStroke, is_free, strokes_of
from bench.session.signals import Signals, forward_strokes, stroke_ends
from bench.session.strokes import without_spikes
from bench.session.trial import Trial
from estimator.onset import MIN_FREE_SAMPLES

# [angles] Between a tenth and nine tenths of the push: the largest of so many is the hysteresis.
_ANGLES = 15
# [rad] To either side of a line's middle. Over it moments leave a line by less than 1e-5 of themselves, since their
# curvature goes with the square of the pushing angle. Derived.
_HALF_WINDOW_RAD = np.radians(0.15)


@dataclass(frozen=True)
class Reversal:
    """One whisk there and back.

    difference (k, 2): volts back less forward, at the same motor angles, from 1/10 to 9/10 of the
    push; zero_return (2,): level after less level before; NaN where the motor did not come back so
    far.
    """

    trial: str
    difference: np.ndarray
    zero_return: np.ndarray


def reversals(trial: Trial, signals: Signals, settings: Settings) -> list[Reversal]:
    """Return a Reversal for each whisk whose way back was recorded."""
    found = []
    motor, _ = without_spikes(signals.motor_rad)
    strokes = strokes_of(signals, trial, settings, level=False)
    places = zip(forward_strokes(signals), stroke_ends(signals))
    for stroke, (place, end) in zip(strokes, places):
        back = slice(place.stop, end)
        found.append(_reversal(trial.name, stroke, motor[back], signals.channels[back]))
    return [each for each in found if each is not None]


def _reversal(
    name: str, stroke: FeltStroke, motor: np.ndarray, channels: np.ndarray
) -> Reversal | None:
    """Compare a stroke with its way back, motor (b,) and channels (b, 2); None without one."""
    touch = stroke.touch
    if touch.status or len(motor) < MIN_FREE_SAMPLES:
        return None
    push = stroke.motor_rad[-1] - touch.motor_rad
    if motor.min() > touch.motor_rad + 0.1 * push:
        return None
    angles = touch.motor_rad + push * np.linspace(0.1, 0.9, _ANGLES)
    forward = _volts_at(stroke.motor_rad, stroke.channels, angles)
    back = _volts_at(motor, channels, angles)
    free = is_free(motor, touch)
    level_after = np.full(2, np.nan)
    if free.sum() >= MIN_FREE_SAMPLES:
        level_after = np.nanmean(channels[free], axis=0)
    return Reversal(name, back - forward, level_after - touch.offset)


def _volts_at(motor: np.ndarray, channels: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Fit channels (k, 2) at motor angles (k,): a line through the samples around each.

    NaN where there are too few.
    """
    good = np.isfinite(channels).all(axis=1)
    volts = np.full((len(angles), 2), np.nan)
    for k, angle in enumerate(angles):
        near = good & (np.abs(motor - angle) < _HALF_WINDOW_RAD)
        if near.sum() >= 3 and np.ptp(motor[near]) > 0.0:
            volts[k] = np.polyfit(motor[near] - angle, channels[near], 1)[-1]
    return volts


def in_percent(
    reversals: Sequence[Reversal], matrix: np.ndarray, full_scale_Nmm: np.ndarray
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Return the largest hysteresis (2,) and return error (2,) of m_y, m_z in % of full scale.

    None where not measured.
    """
    differences = [np.nanmax(np.abs(each.difference @ matrix.T), axis=0) for each in reversals]
    returns = [np.abs(matrix @ each.zero_return) for each in reversals]
    returns = [each for each in returns if np.isfinite(each).all()]
    scale = 100.0 / np.asarray(full_scale_Nmm)
    hysteresis = np.max(differences, axis=0) * scale if differences else None
    return hysteresis, np.max(returns, axis=0) * scale if returns else None
