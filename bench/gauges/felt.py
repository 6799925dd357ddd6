"""The felt half of a trial: gauge signals in; touch, zero and channels at an angle out. No picture is read here.

Everything is in the channels' own unit. Touch and zero need no gauge factors, and moments are linear in the channels.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bench.base.settings import Settings
from bench.records.trial_result import FeltWhisk, SeenWhisk
from bench.session.angle_source import EXACT, AngleSigma
from bench.session.rails import off_the_rails
from bench.session.signals import Signals, back_stroke, forward_strokes, stroke_ends, ways_back
from bench.session.trial import Trial
from estimator.onset import GUARD_RAD, converter_steps, usable
from estimator.signal import FeltTouch, MomentAt, felt_touch, moment_at, zero_phase_lowpass
from vision import UNKNOWN, FrameTruth, Value

# [samples] Of a free stroke, for its mean.
_LEAST_FREE = 50
# [Hz] Ahead of the converter, by the paper.
PAPERS_FILTER_HZ = 800.0
# [periods] Mean of the impulse response of a fourth-order Butterworth filter, by its cut-off. Derived.
_DELAY_CYCLES = np.sqrt(2.0) * np.sqrt(2.0 + np.sqrt(2.0)) / (2.0 * np.pi)
# [1] One sigma of a filter's delay over it: resistors and capacitors are known to some per cent. Stated.
_DELAY_SHARE = 0.03


def gauge_delay(filter_Hz: float | None) -> Value:
    """Return by how long a ramp comes late out of the gauges' filter, s.

    It is the mean of the filter's impulse response: fourth-order Butterworth, √2 √(2 + √2) / (2π
    filter_Hz), 0 without one (0 Hz), and known as well as the filter's parts. Where no filter is
    named (None) it is the paper's, and its sigma that of any delay from none to twice as much
    (uniform).
    """
    if filter_Hz is None:
        delay_s = float(_DELAY_CYCLES / PAPERS_FILTER_HZ)
        return Value(delay_s, delay_s / float(np.sqrt(3.0)))
    delay_s = float(_DELAY_CYCLES / filter_Hz) if filter_Hz else 0.0
    return Value(delay_s, _DELAY_SHARE * delay_s)


def late_by(delay_s: Value, speed_rad_s: float) -> Value:
    """Return the angle by which a motor of that speed is ahead of what comes so late, rad."""
    return Value(delay_s.value * speed_rad_s, delay_s.sigma * speed_rad_s)


def lateness(seen: SeenWhisk, felt: FeltWhisk) -> Value:
    """Return felt less seen touch of a whisk, rad."""
    sigma = float(np.hypot(seen.touch_rad.sigma, felt.touch_felt_rad.sigma))
    return Value(felt.touch_felt_rad.value - seen.touch_rad.value, sigma)


def motor_speed(frames: FrameTruth) -> float:
    """Return the motor's speed over the frames of a whisk, rad/s."""
    return float(np.median(np.diff(frames.motor_rad) / np.diff(frames.time_s)))


def touch_on_the_way_back(signals: Signals, delay_s: float) -> Value:
    """Return the motor angle at which the first back stroke lets go of the bar, rad.

    It is the felt touch of that stroke run backwards, the gauges' delay taken out. Its sigma is
    without the delay's.
    """
    where = back_stroke(signals)
    if where is None:
        return UNKNOWN
    stroke = _backwards(signals, where)
    touch = stroke.touch
    if touch.status:
        return UNKNOWN
    return Value(touch.motor_rad + delay_s * stroke.speed_rad_s, touch.sigma_rad)


@dataclass(frozen=True)
class FeltStroke:
    """A forward stroke as the gauges record it.

    time_s, motor_rad (n,); channels (n, 2) as recorded, NaN where saturated, and filtered; drift
    (n, 2) that was taken out of both, None where none was; forces_N (n, 3), None where no load cell
    was recorded. angle_sigma: how well motor_rad is known. steps (2,): of the converter, None where
    the channels are as recorded and show them.
    """

    time_s: np.ndarray
    motor_rad: np.ndarray
    channels: np.ndarray
    filtered: np.ndarray
    drift: np.ndarray | None = None
    forces_N: np.ndarray | None = None
    angle_sigma: AngleSigma = EXACT
    steps: np.ndarray | None = None

    @property
    def saturated(self) -> int:
        """Return how many samples were left out as saturated."""
        return int(np.isnan(self.channels).any(axis=1).sum())

    @property
    def speed_rad_s(self) -> float:
        """Return the mean speed of the motor over the stroke."""
        return float(np.ptp(self.motor_rad) / np.ptp(self.time_s))

    @property
    def with_drift(self) -> "FeltStroke":
        """Return the stroke with the drift that was taken out of it."""
        if self.drift is None:
            return self
        return replace(self._less(-self.drift), drift=None)

    def _less(self, drift: np.ndarray) -> "FeltStroke":
        """Return the stroke without a drift (n, 2) of its zero."""
        channels = self.channels - drift
        return replace(self, channels=channels, filtered=self.filtered - drift, drift=drift)

    @cached_property
    def touch(self) -> FeltTouch:
        """Return felt touch. The rise is fitted as recorded: a filter would smear the onset."""
        return felt_touch(self.motor_rad, self.channels, self.time_s, steps=self.steps)

    @cached_property
    def _usable(self) -> np.ndarray:
        """Return the mask (n,) of the samples that a fit may take."""
        return usable(self.motor_rad, self.channels)

    def at(self, theta_rad: float, touch: FeltTouch, **window: float) -> MomentAt:
        """Return the channels above the free stroke's level, at a pushing angle past `touch`.

        A line through the samples as recorded averages as section V's low-pass does. That smears
        the onset, by 5 % of it at 0.5°. window: of `estimator.signal.moment_at`.
        """
        return moment_at(
            theta_rad,
            self.motor_rad,
            self.channels,
            touch,
            time_s=self.time_s,
            good=self._usable,
            **window,
        )


def strokes_of(
    signals: Signals, trial: Trial, settings: Settings, *, level: bool = True
) -> list[FeltStroke]:
    """Return the forward strokes of a trial, each a whisk.

    The whole recording goes through the zero-phase low-pass of section V, so that a stroke's ends
    are no edges of it. level: take out the drift between the free stroke before touch and the one
    after the way back, if both were recorded.
    """
    channels = signals.channels
    places = forward_strokes(signals)
    if signals.kind == "V":
        for where in places:  # elsewhere the motor may rest, and a channel stand still with it
            channels[where] = off_the_rails(channels[where])
    strokes = []
    lowpassed: dict[float, np.ndarray] = {}
    for where, end in zip(places, stroke_ends(signals)):
        cutoff_Hz = _cutoff_Hz(signals, where, trial, settings)
        if cutoff_Hz not in lowpassed:  # strokes at the stated speed share one
            lowpassed[cutoff_Hz] = _lowpass(channels, signals.rate_Hz, cutoff_Hz)
        stroke = FeltStroke(
            signals.time_s[where],
            signals.motor_rad[where],
            channels[where],
            lowpassed[cutoff_Hz][where],
            forces_N=None if signals.forces_N is None else signals.forces_N[where],
            angle_sigma=signals.angle_sigma.part(where),
            steps=converter_steps(channels[where]),
        )
        if level:
            stroke = _levelled(stroke, signals, channels, slice(where.stop, end))
        strokes.append(stroke)
    return strokes


def ways_back_of(signals: Signals, trial: Trial, settings: Settings) -> list[FeltStroke | None]:
    """Return the way back after each forward stroke, run backwards; None where none was recorded.

    So the whisker comes to the object. The zero is that of the free stroke after it lets go.
    """
    found: list[FeltStroke | None] = []
    for where in ways_back(signals):
        if where is None:
            found.append(None)
            continue
        stroke = _backwards(signals, where)
        cutoff_Hz = _cutoff_Hz(signals, where, trial, settings)
        smooth = _lowpass(stroke.channels[::-1], signals.rate_Hz, cutoff_Hz)
        found.append(replace(stroke, filtered=smooth[::-1]))
    return found


def _backwards(signals: Signals, where: slice) -> FeltStroke:
    """Return a back stroke run backwards, not filtered."""
    channels = signals.channels[where]
    if signals.kind == "V":
        channels = off_the_rails(channels)
    time_s = signals.time_s[where]
    forces = None if signals.forces_N is None else signals.forces_N[where][::-1]
    return FeltStroke(
        time_s[-1] - time_s[::-1],
        signals.motor_rad[where][::-1],
        channels[::-1],
        channels[::-1],
        forces_N=forces,
    )


def _cutoff_Hz(signals: Signals, where: slice, trial: Trial, settings: Settings) -> float:
    """Return the low-pass's cut-off for a stroke: by the trial's stated speed, else by its own."""
    if trial.speed_deg_s:
        return settings.cutoff_for(trial.speed_deg_s)
    speed_rad_s = np.ptp(signals.motor_rad[where]) / np.ptp(signals.time_s[where])
    return settings.cutoff_for(float(np.degrees(speed_rad_s)))


def is_free(motor_rad: np.ndarray, touch: FeltTouch) -> np.ndarray:
    """Return which samples (n,) are of the free stroke: those that felt touch takes for it."""
    return motor_rad < touch.motor_rad - GUARD_RAD


def _levelled(
    stroke: FeltStroke, signals: Signals, channels: np.ndarray, back: slice
) -> FeltStroke:
    """Return the stroke without the drift of its zero from before the touch to after the way back.

    channels (n, 2): of the whole recording. back: samples of the way back. The stroke is returned
    as it is where either is too short.
    """
    if back.stop - back.start < _LEAST_FREE:
        return stroke
    motor_rad = signals.motor_rad[back]
    touch = stroke.touch
    if touch.status:
        return stroke
    before = is_free(stroke.motor_rad, touch)
    after = is_free(motor_rad, touch)
    if min(before.sum(), after.sum()) < _LEAST_FREE:
        return stroke
    start_s = stroke.time_s[before].mean()
    duration_s = signals.time_s[back][after].mean() - start_s
    change = np.nanmean(channels[back][after], axis=0) - np.nanmean(stroke.channels[before], axis=0)
    return stroke._less(np.outer(stroke.time_s - start_s, change / duration_s))


def _lowpass(channels: np.ndarray, rate_Hz: float, cutoff_Hz: float) -> np.ndarray:
    """Filter channels (n, 2); gaps are bridged by lines for the filter and stay gaps.

    A cut-off that the sampling rate cannot hold leaves them as they are.
    """
    if cutoff_Hz >= rate_Hz / 2:
        return channels
    return zero_phase_lowpass(channels, rate_Hz, cutoff_Hz)
