"""The felt half of a trial: gauge signals in; touch, zero and channels at an angle out. No picture is read here.

Everything is in the channels' own unit. Touch and zero need no gauge factors, and moments are linear in the channels.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bench.base.settings import Settings
from bench.records.trial_result import FeltWhisk, SeenWhisk
from bench.session.rails import off_the_rails
from bench.session.signals import Signals, back_stroke, forward_strokes, ways_back
from bench.session.trial import Trial
from estimator.onset import usable
from estimator.signal import FeltTouch, MomentAt, felt_touch, moment_at, zero_phase_lowpass
from vision.truth.records import FrameTruth
from vision.truth.value import UNKNOWN, Value

_GUARD_RAD = np.radians(0.2)  # rad before felt touch, beyond what that is uncertain by. Set by eye
_LEAST_FREE = 50  # samples
PAPERS_FILTER_HZ = 800.0  # ahead of the converter


def gauge_delay(filter_Hz: float | None) -> Value:
    """By how long a ramp comes late out of the gauges' filter, s: the mean of its impulse response.

    Fourth-order Butterworth, √2 √(2 + √2) / (2π filter_Hz), 0 without one (0 Hz). Where no filter is named (None) the
    paper's, and as sigma that of any delay from none to twice as much (uniform).
    """
    mean_s = np.sqrt(2.0) * np.sqrt(2.0 + np.sqrt(2.0)) / (2.0 * np.pi)
    if filter_Hz is None:
        return Value(
            float(mean_s / PAPERS_FILTER_HZ), float(mean_s / PAPERS_FILTER_HZ / np.sqrt(3.0))
        )
    return Value(float(mean_s / filter_Hz) if filter_Hz else 0.0, 0.0)


def late_by(delay_s: Value, speed_rad_s: float) -> Value:
    """By what a motor of that speed is ahead of what comes so late, rad."""
    return Value(delay_s.value * speed_rad_s, delay_s.sigma * speed_rad_s)


def lateness(seen: SeenWhisk, felt: FeltWhisk) -> Value:
    """Felt less seen touch of a whisk, rad."""
    sigma = float(np.hypot(seen.touch_rad.sigma, felt.touch_felt_rad.sigma))
    return Value(felt.touch_felt_rad.value - seen.touch_rad.value, sigma)


def motor_speed(frames: FrameTruth) -> float:
    """Of the motor over the frames of a whisk, rad/s."""
    return float(np.median(np.diff(frames.motor_rad) / np.diff(frames.time_s)))


def touch_on_the_way_back(signals: Signals, delay_s: float) -> Value:
    """Where the first back stroke lets go of the bar, rad: felt touch of that stroke run backwards, the gauges' delay
    taken out. Its sigma is without the delay's."""
    where = back_stroke(signals)
    if where is None:
        return UNKNOWN
    channels = np.stack([signals.y, signals.z], axis=1)[where]
    channels = off_the_rails(channels) if signals.kind == "V" else channels
    time_s, motor_rad = signals.time_s[where], signals.motor_rad[where]
    touch = felt_touch(motor_rad[::-1], channels[::-1], time_s[-1] - time_s[::-1])
    speed_rad_s = float(np.ptp(motor_rad) / np.ptp(time_s))
    return (
        UNKNOWN if touch.status else Value(touch.motor_rad + delay_s * speed_rad_s, touch.sigma_rad)
    )


@dataclass(frozen=True)
class Stroke:
    """One forward stroke: time_s, motor_rad (n,); channels (n, 2) as recorded, NaN where saturated, and filtered; drift
    (n, 2) that was taken out of both, None where none was; forces_N (n, 3), None where no load cell was recorded."""

    time_s: np.ndarray
    motor_rad: np.ndarray
    channels: np.ndarray
    filtered: np.ndarray
    drift: np.ndarray | None = None
    forces_N: np.ndarray | None = None

    @property
    def saturated(self) -> int:
        """How many samples were left out as saturated."""
        return int(np.isnan(self.channels).any(axis=1).sum())

    @property
    def speed_rad_s(self) -> float:
        """Mean speed of the motor over the stroke."""
        return float(np.ptp(self.motor_rad) / np.ptp(self.time_s))

    @property
    def with_drift(self) -> "Stroke":
        """The stroke as it was before the drift was taken out."""
        if self.drift is None:
            return self
        return replace(
            self,
            channels=self.channels + self.drift,
            filtered=self.filtered + self.drift,
            drift=None,
        )

    def touch(self) -> FeltTouch:
        """Felt touch. The rise is fitted as recorded: a filter would smear the onset."""
        return self._touch

    @cached_property
    def _touch(self) -> FeltTouch:
        return felt_touch(self.motor_rad, self.channels, self.time_s)

    @cached_property
    def _usable(self) -> np.ndarray:
        return usable(self.motor_rad, self.channels)

    def at(self, theta_rad: float, touch: FeltTouch, **window: float) -> MomentAt:
        """Channels above the free stroke's level, at a pushing angle past `touch`: a line through the samples as
        recorded, which averages as section V's low-pass does. That smears the onset, by 5 % of it at 0.5°."""
        known = {"time_s": self.time_s, "good": self._usable}
        return moment_at(theta_rad, self.motor_rad, self.channels, touch, **known, **window)


def strokes_of(
    signals: Signals, trial: Trial, settings: Settings, *, level: bool = True
) -> list[Stroke]:
    """The forward strokes of a trial, each a whisk.

    The whole recording goes through the zero-phase low-pass of section V, so that a stroke's ends are no edges of it.
    level: take out the drift that shows between the free stroke before touch and the one after the way back, if both
    were recorded.
    """
    channels, places = np.stack([signals.y, signals.z], axis=1), forward_strokes(signals)
    if signals.kind == "V":
        for where in places:  # elsewhere the motor may rest, and a channel stand still with it
            channels[where] = off_the_rails(channels[where])
    strokes, lowpassed = [], {}
    for where, end in zip(places, [*(place.start for place in places[1:]), len(signals.time_s)]):
        time, motor = signals.time_s[where], signals.motor_rad[where]
        cutoff_Hz = settings.cutoff_for(
            trial.speed_deg_s or float(np.degrees(np.ptp(motor) / np.ptp(time)))
        )
        if cutoff_Hz not in lowpassed:  # strokes at the stated speed share one
            lowpassed[cutoff_Hz] = _lowpass(channels, signals.rate_Hz, cutoff_Hz)
        forces = None if signals.forces_N is None else signals.forces_N[where]
        stroke = Stroke(time, motor, channels[where], lowpassed[cutoff_Hz][where], forces_N=forces)
        back = slice(where.stop, end)
        way_back = signals.time_s[back], signals.motor_rad[back], channels[back]
        strokes.append(_levelled(stroke, *way_back) if level else stroke)
    return strokes


def ways_back_of(signals: Signals, trial: Trial, settings: Settings) -> list[Stroke | None]:
    """The way back after each forward stroke, run backwards, so that the whisker comes to the object; None where none
    was recorded. Its zero is that of the free stroke after it lets go."""
    channels, found = np.stack([signals.y, signals.z], axis=1), []
    for where in ways_back(signals):
        if where is None:
            found.append(None)
            continue
        mine = off_the_rails(channels[where]) if signals.kind == "V" else channels[where]
        time, motor = signals.time_s[where], signals.motor_rad[where]
        cutoff_Hz = settings.cutoff_for(
            trial.speed_deg_s or float(np.degrees(np.ptp(motor) / np.ptp(time)))
        )
        smooth = _lowpass(mine, signals.rate_Hz, cutoff_Hz)
        forces = None if signals.forces_N is None else signals.forces_N[where][::-1]
        found.append(
            Stroke(time[-1] - time[::-1], motor[::-1], mine[::-1], smooth[::-1], forces_N=forces)
        )
    return found


def _levelled(stroke: Stroke, time_s, motor_rad, channels) -> Stroke:
    """The stroke without the drift of its zero from before the touch to after the way back (time_s, motor_rad (b,),
    channels (b, 2)); as it is where either is too short."""
    if len(time_s) < _LEAST_FREE:
        return stroke
    touch = stroke.touch()
    if touch.status:
        return stroke
    free = touch.motor_rad - _GUARD_RAD
    before, after = (
        (t[m < free], c[m < free])
        for t, m, c in (
            (stroke.time_s, stroke.motor_rad, stroke.channels),
            (time_s, motor_rad, channels),
        )
    )
    if min(len(before[0]), len(after[0])) < _LEAST_FREE:
        return stroke
    (start, zero), (end, returned) = ((t.mean(), np.nanmean(c, axis=0)) for t, c in (before, after))
    drift = np.outer(stroke.time_s - start, (returned - zero) / (end - start))
    return replace(
        stroke, channels=stroke.channels - drift, filtered=stroke.filtered - drift, drift=drift
    )


def _lowpass(channels, rate_Hz: float, cutoff_Hz: float) -> np.ndarray:
    """Filtered channels; gaps are bridged by lines for the filter and stay gaps. A cut-off that the sampling rate
    cannot hold leaves them as they are."""
    if cutoff_Hz >= rate_Hz / 2:
        return channels
    filtered = zero_phase_lowpass(_bridged(channels), rate_Hz, cutoff_Hz)
    return np.where(np.isnan(channels), np.nan, filtered)


def _bridged(channels) -> np.ndarray:
    bridged, place = channels.copy(), np.arange(len(channels))
    for column in bridged.T:
        finite = np.isfinite(column)
        if finite.any():
            column[~finite] = np.interp(place[~finite], place[finite], column[finite])
        else:
            column[:] = 0.0
    return bridged
