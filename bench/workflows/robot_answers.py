"""Estimates of a robot, and when it has them: recorded whisks through another filter and converter.

A robot has no sample of the future. Its filter is causal, and the stroke ends when it estimates:
felt touch, zero and moments are made of what came before. Nothing that follows the contact takes
out a drift. The time counts from the touch as seen, or as felt where the truth is a stage's, which knows no touch.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfilt, sosfilt_zi

from bench.gauges.felt import FeltStroke
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenWhisk, TrialResult
from bench.session.rails import off_the_rails
from bench.session.signals import Signals, forward_strokes, read_signals
from bench.trials.estimate_errors import is_sound
from bench.trials.estimates import estimators, run_estimators
from bench.trials.felt_trial import readout_of
from bench.trials.readout import Readout, felt_whisk
from bench.trials.unit import Unit
from estimator import first_order
from estimator.signal import HALF_WINDOW_RAD, HUM_PERIOD_S
from estimator.slip import moments, slip_angle
from estimator.whisk import Whisk

PUSHES_DEG = (0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0)
_ORDER = 4  # of the filter (Butterworth), as ahead of the paper's converter
_DELAY = 2.6131 / (2.0 * math.pi)  # of such a filter for slow signals, over its cut-off
# [1] Push over the pushing angle θ where the push is small: there the window is from θ/10 to 1.9 θ
# (`estimator.signal.moment_at`). Stated.
_SMALL_PUSH = 1.9


@dataclass(frozen=True)
class Converter:
    """What stands between gauges and robot; None leaves a property as recorded.

    cutoff_Hz: of a low-pass. every: one sample in so many is kept. bits: over the range that the
    session's signals fill.
    """

    cutoff_Hz: float | None = None
    every: int = 1
    bits: int | None = None

    @property
    def delay_s(self) -> float:
        """Return the time by which the filter delays slow signals."""
        return _DELAY / self.cutoff_Hz if self.cutoff_Hz else 0.0

    def can_filter(self, rate_Hz: float) -> bool:
        """Return whether the filter passes less than was recorded at this sample rate."""
        return self.cutoff_Hz is None or self.cutoff_Hz < rate_Hz / 2

    def convert(self, channels: np.ndarray, rate_Hz: float, range_V: np.ndarray) -> np.ndarray:
        """Return the channels (n, 2) filtered and rounded, every sample of them.

        range_V (2,): what the bits are spread over.
        """
        if self.cutoff_Hz:
            sections = butter(_ORDER, self.cutoff_Hz, fs=rate_Hz, output="sos")
            at_rest = sosfilt_zi(sections)[:, :, None] * channels[0]
            channels, _ = sosfilt(sections, channels, axis=0, zi=at_rest)
        if self.bits:
            step_V = range_V / 2.0**self.bits
            channels = np.round(channels / step_V) * step_V
        return channels


@dataclass(frozen=True)
class Answer:
    """One estimator's distance for a whisk through a converter, in % of the true distance.

    push_deg: of the motor since touch. time_s: from touch to the estimate. expected_percent: the
    error by (13), (14) and docs/maps.md. error_percent: measured; noise_percent: its stated sigma;
    NaN without a distance.
    """

    estimator: str
    truth_source: str
    converter: Converter
    speed_deg_s: float
    rate_Hz: float
    push_deg: float
    time_s: float
    expected_percent: float
    error_percent: float
    noise_percent: float


@dataclass(frozen=True)
class Task:
    """A trial whose whisks are estimated through each converter.

    range_V (2,): what the bits of a converter are spread over.
    """

    unit: Unit
    result: TrialResult
    converters: Sequence[Converter]
    range_V: np.ndarray


@dataclass(frozen=True)
class _ConvertedWhisk:
    """A whisk whose truth is sound, and its stroke through a converter.

    touch_rad: motor angle that times count from.
    """

    task: Task
    readout: Readout
    seen: SeenWhisk
    touch_rad: float
    converter: Converter
    stroke: FeltStroke
    rate_Hz: float

    @property
    def touch_s(self) -> float:
        """Return the time of touch; NaN where the motor does not come so far."""
        return _time_at(self.stroke, self.touch_rad)


def range_of(signals: Signals) -> np.ndarray:
    """Return the range (2,) of the channels."""
    return np.nan_to_num(np.ptp(_channels(signals), axis=0))


def _channels(signals: Signals) -> np.ndarray:
    """Return both channels (n, 2)."""
    return np.stack([signals.y, signals.z], axis=1)


def answers_of_trial(task: Task) -> list[Answer]:
    """Return all answers about the measured whisks of a trial whose truth is sound.

    Of a saturated stroke there are none.
    """
    signals = read_signals(task.unit.trial)
    readout, _ = readout_of(task.unit, signals.kind)
    if readout is None or task.result.trial.purpose != "measure":
        return []
    strokes = forward_strokes(signals)
    seen_whisks = task.result.seen.whisks
    felt_whisks = task.result.felt.whisks
    found = []
    for converter in task.converters:
        if not converter.can_filter(signals.rate_Hz):
            continue
        for where, seen, felt in zip(strokes, seen_whisks, felt_whisks):
            if not seen.has_truth or not is_sound(seen, felt):
                continue
            stroke = _convert_stroke(signals, where, converter, task.range_V)
            if stroke is not None:
                rate_Hz = signals.rate_Hz / converter.every
                touch_rad = _touch_rad(seen, felt)
                whisk = _ConvertedWhisk(task, readout, seen, touch_rad, converter, stroke, rate_Hz)
                found += _answers_of_whisk(whisk)
    return found


def _touch_rad(seen: SeenWhisk, felt: FeltWhisk) -> float:
    """Return the motor angle that times count from: of touch as seen, else as felt."""
    if seen.touch_rad.is_known:
        return float(seen.touch_rad.value)
    return float(felt.touch_felt_rad.value)


def _convert_stroke(
    signals: Signals, where: slice, converter: Converter, range_V: np.ndarray
) -> FeltStroke | None:
    """Return a stroke as the converter gives it; None where a sample is saturated or missing."""
    raw = _channels(signals)[: where.stop]  # from the recording's begin: the filter is causal
    if signals.kind == "V":
        raw[where] = off_the_rails(raw[where])
    if not np.isfinite(raw).all():
        return None
    channels = converter.convert(raw, signals.rate_Hz, range_V)[where][:: converter.every]
    time_s = signals.time_s[where][:: converter.every]
    motor_rad = signals.motor_rad[where][:: converter.every]
    return FeltStroke(
        time_s,
        motor_rad,
        channels,
        channels,
        angle_sigma=signals.angle_sigma.part(where).part(slice(None, None, converter.every)),
    )


def _answers_of_whisk(whisk: _ConvertedWhisk) -> Iterator[Answer]:
    """Yield the answers about a whisk at each push that its stroke reaches."""
    stroke = whisk.stroke
    for push_deg in PUSHES_DEG:
        push_rad = math.radians(push_deg)
        pushed_s = _time_at(stroke, whisk.touch_rad + push_rad)
        end_s = pushed_s + whisk.converter.delay_s
        if not end_s <= stroke.time_s[-1]:  # NaN, too
            return
        now = stroke.time_s <= end_s
        channels = stroke.channels[now]
        cut = FeltStroke(
            stroke.time_s[now],
            stroke.motor_rad[now],
            channels,
            channels,
            angle_sigma=stroke.angle_sigma.part(now),
        )
        time_s = end_s - whisk.touch_s + 1.0 / whisk.rate_Hz
        theta_rad = _theta_rad(push_rad, stroke.speed_rad_s)
        yield from _answers_at(whisk, cut, theta_rad, push_deg, time_s)


def _time_at(stroke: FeltStroke, motor_rad: float) -> float:
    """Return when the motor is at an angle, s; NaN where it does not come so far."""
    if not stroke.motor_rad[0] <= motor_rad <= stroke.motor_rad.max():
        return math.nan
    return float(np.interp(motor_rad, np.maximum.accumulate(stroke.motor_rad), stroke.time_s))


def _theta_rad(push_rad: float, speed_rad_s: float) -> float:
    """Return the pushing angle whose window (`estimator.signal.moment_at`) ends with the push."""
    half_rad = max(HALF_WINDOW_RAD, speed_rad_s * HUM_PERIOD_S / 2)
    return max(push_rad - half_rad, push_rad / _SMALL_PUSH)


def _answers_at(
    whisk: _ConvertedWhisk, cut: FeltStroke, theta_rad: float, push_deg: float, time_s: float
) -> Iterator[Answer]:
    """Yield each estimator's answer from a stroke that is cut at a push."""
    truth = whisk.seen.d_x_mm
    measured = {row.estimator: row for row in _measured_rows(whisk, cut, theta_rad)}
    for expected in _estimate(whisk, _expected_whisk(whisk, theta_rad)):
        row = measured.get(expected.estimator)
        error_percent = math.nan
        noise_percent = math.nan
        if row is not None:
            error_percent = row.error_percent(truth).value
            noise_percent = 100.0 * row.d_x_est_sigma_alpha_exact_mm / truth.value
        yield Answer(
            estimator=expected.estimator,
            truth_source=whisk.seen.truth_source,
            converter=whisk.converter,
            speed_deg_s=math.degrees(whisk.stroke.speed_rad_s),
            rate_Hz=whisk.rate_Hz,
            push_deg=push_deg,
            time_s=time_s,
            expected_percent=expected.error_percent(truth).value,
            error_percent=error_percent,
            noise_percent=noise_percent,
        )


def _measured_rows(
    whisk: _ConvertedWhisk, cut: FeltStroke, theta_rad: float
) -> tuple[EstimateRow, ...]:
    """Return each estimator's row from a stroke that is cut at a push; none where it does not hold
    the whisk."""
    unit = whisk.task.unit
    beam = unit.session.whisker.beam
    _, felt = felt_whisk(cut, whisk.readout, unit.drift_rate, beam, theta_rad)
    return _estimate(whisk, felt) if isinstance(felt, Whisk) else ()


def _estimate(whisk: _ConvertedWhisk, felt: Whisk) -> tuple[EstimateRow, ...]:
    """Return each estimator's row."""
    settings = whisk.task.unit.settings
    return run_estimators(
        felt, estimators(settings.estimators, felt.beam), settings, whisk.task.result.radii_mm
    )


def _expected_whisk(whisk: _ConvertedWhisk, theta_rad: float) -> Whisk:
    """Return the whisk that (13) and (14) predict for the slope and friction seen.

    What they leave out changes its moments to first order (docs/maps.md).
    """
    beam = whisk.task.unit.session.whisker.beam
    alpha_rad = _friction_angle_rad(whisk)
    share = _share_left_out(whisk, theta_rad, alpha_rad)
    as_cylinder_mm = float(beam.as_cylinder_mm(whisk.seen.d_x_mm.value))
    beta_rad = whisk.seen.beta_rad.value
    moments_Nmm = np.array(moments(as_cylinder_mm, theta_rad, beta_rad, alpha_rad, beam.C_Nmm2))
    felt_Nmm = (moments_Nmm / (1.0 + share)).tolist()
    return Whisk.without_samples(theta_rad, felt_Nmm, np.zeros((2, 2)), beam)


def _friction_angle_rad(whisk: _ConvertedWhisk) -> float:
    """Return the friction angle as it was seen, not below 0; α_est where it was not."""
    alpha_rad = whisk.seen.friction_rad.value
    if np.isfinite(alpha_rad):
        return max(alpha_rad, 0.0)
    return whisk.task.unit.settings.alpha_est_rad


def _share_left_out(whisk: _ConvertedWhisk, theta_rad: float, alpha_rad: float) -> float:
    """Return by what share leaning and rolling lower the moments, to first order."""
    seen = whisk.seen
    d_x_mm = seen.d_x_mm.value
    reach_mm = whisk.task.result.reach_mm(d_x_mm)  # NaN where the bar's diameter is not known
    phi_rad = float(slip_angle(seen.beta_rad.value, alpha_rad))
    share = first_order.leaning(theta_rad, seen.psi_rad.value, phi_rad, alpha_rad)
    if np.isfinite(reach_mm):
        left = whisk.task.unit.session.whisker.beam.thickness(d_x_mm)
        share += first_order.rolling(theta_rad, reach_mm, phi_rad, alpha_rad, d_x_mm, left)
    return share
