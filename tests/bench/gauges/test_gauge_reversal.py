"""Hysteresis and zero return from a simulated back stroke; not measured without one."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bench.base.settings import Settings
from bench.gauges.felt import strokes_of
from bench.gauges.reversal import in_percent, reversals
from bench.session.signals import Signals

TRIAL = SimpleNamespace(name="gauge", speed_deg_s=10.0)
LAG_V, LEFT_V = 0.03, 0.008


def recording(*, back: bool) -> Signals:
    """A push of 1 V over 4°, there and perhaps back, on which a lag and a zero that does not return are laid."""
    there = np.radians(np.linspace(-1.6, 4.6, 1240))
    motor = np.concatenate([there, there[::-1]]) if back else there
    is_back = np.arange(len(motor)) >= len(there)
    volts = np.where(motor > 0, motor / np.radians(4.0), 0.0)
    volts = volts + np.where(is_back & (motor > 0), LAG_V, 0.0) + np.where(is_back, LEFT_V, 0.0)
    noise = 0.001 * np.random.default_rng(0).standard_normal((2, len(motor)))
    return Signals(np.arange(len(motor)) / 2000, motor, noise[0], volts + noise[1], "V")


def test_what_was_put_in_comes_out():
    found = reversals(TRIAL, recording(back=True), Settings())
    hysteresis, returned = in_percent(found, 10.0 * np.eye(2), np.array([11.5, 11.5]))
    # noise of 1 mV over 60 samples a line: 0.15 mV; 0.1 % of 11.5 N·mm is 1.2 mV, largest of fifteen
    assert hysteresis == pytest.approx([0.0, 100 * 10 * (LAG_V + LEFT_V) / 11.5], abs=0.15)
    assert returned == pytest.approx([0.0, 100 * 10 * LEFT_V / 11.5], abs=0.05)


def test_without_a_back_stroke_nothing_is_measured():
    assert reversals(TRIAL, recording(back=False), Settings()) == []
    assert in_percent([], np.eye(2), np.ones(2)) == (None, None)


def test_a_motor_that_stops_short_of_the_free_stroke_shows_no_return():
    signals = recording(back=True)
    cut = slice(0, len(signals.motor_rad) - 400)
    cut_short = Signals(
        *(a[cut] for a in (signals.time_s, signals.motor_rad, signals.y, signals.z)), "V"
    )
    found = reversals(TRIAL, cut_short, Settings())
    hysteresis, returned = in_percent(found, 10.0 * np.eye(2), np.array([11.5, 11.5]))
    assert hysteresis is not None
    assert returned is None


@pytest.mark.parametrize("back", [True, False])
def test_drift_is_taken_out_where_both_free_strokes_show_it(back):
    """50 mV/s over 0.6 s. With the way back the slope is known to some 0.2 mV/s; without, nothing may be taken out."""
    signals = recording(back=back)
    level = LEFT_V if back else 0.0
    sound = signals.z - np.where(np.arange(len(signals.z)) >= 1240, level, 0.0)
    drifting = Signals(
        signals.time_s, signals.motor_rad, signals.y, sound + 0.05 * signals.time_s, "V"
    )
    (stroke,) = strokes_of(drifting, TRIAL, Settings())
    pushed = stroke.motor_rad > np.radians(4.0)
    off = (
        stroke.channels[pushed, 1]
        - stroke.motor_rad[pushed] / np.radians(4.0)
        - stroke.touch.offset[1]
    )
    gained = 0.05 * stroke.time_s[pushed].mean()
    assert off.mean() == pytest.approx(0.0 if back else gained, abs=0.012 if not back else 0.003)


def test_a_converter_s_steps_are_in_a_levelled_stroke_s_touch():
    """Noise is a tenth of the step, on one of which the free stroke stays: its level may be off by half of it."""
    signals = recording(back=True)
    step_V = 0.01
    stepped = replace(signals, z=step_V * np.round(signals.z / step_V))
    (stroke,) = strokes_of(stepped, TRIAL, Settings())
    assert np.ptp(stroke.drift[:, 1]) > step_V / 5
    assert np.sqrt(stroke.touch.level.covariance[1, 1]) > 0.9 * step_V / np.sqrt(12.0)
