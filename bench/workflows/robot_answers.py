"""What a robot would have answered, and when: the recorded signals of a whisk seen through another converter.

A robot has no sample of the future. Its filter is causal, and at the time of its answer the stroke ends: felt touch,
zero and moments are made of what came before. Nothing that follows the contact takes out a drift. The time counts from
the touch as seen.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import butter, sosfilt, sosfilt_zi

from bench.analyses.alphas import seen_friction
from bench.base.settings import Settings
from bench.gauges.felt import FeltStroke
from bench.records.trial_result import EstimateRow, SeenWhisk, TrialResult
from bench.session.rails import off_the_rails
from bench.session.signals import Signals, forward_strokes, read_signals
from bench.trials.estimate_errors import is_sound
from bench.trials.estimates import answers, estimators
from bench.trials.felt_trial import readout_of
from bench.trials.readout import Readout, felt_whisk
from bench.trials.unit import Unit
from estimator import first_order
from estimator.beam import Beam
from estimator.signal import HALF_WINDOW_RAD, HUM_PERIOD_S
from estimator.slip import moments, slip_angle
from estimator.whisk import Whisk

PUSHES_DEG = (0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0)
_ORDER = 4  # of the filter (Butterworth), as ahead of the paper's converter
_DELAY = 2.6131 / (2.0 * math.pi)  # of such a filter for slow signals, over its cut-off
_PART = 1.9  # of a small push, whose window is from θ/10 to 1.9 θ


@dataclass(frozen=True)
class Converter:
    """What stands between gauges and robot: a low-pass (None: as recorded), one sample in `every`, and bits over the
    range that the session's signals fill (None: as recorded)."""

    cutoff_Hz: float | None = None
    every: int = 1
    bits: int | None = None

    @property
    def delay_s(self) -> float:
        """By which the filter makes all that is felt late."""
        return _DELAY / self.cutoff_Hz if self.cutoff_Hz else 0.0

    def passes(self, rate_Hz: float) -> bool:
        """Whether there is such a filter, and less to be had than was recorded."""
        return self.cutoff_Hz is None or self.cutoff_Hz < rate_Hz / 2

    def converted(self, channels: np.ndarray, rate_Hz: float, range_V: np.ndarray) -> np.ndarray:
        """Channels (n, 2), filtered and rounded; not thinned. range_V (2,): what the bits are spread over."""
        if self.cutoff_Hz:
            sections = butter(_ORDER, self.cutoff_Hz, fs=rate_Hz, output="sos")
            begin = sosfilt_zi(sections)[:, :, None] * channels[0]
            channels, _ = sosfilt(sections, channels, axis=0, zi=begin)
        if self.bits:
            step = range_V / 2.0**self.bits
            channels = np.round(channels / step) * step
        return channels


@dataclass(frozen=True)
class Answer:
    """One estimator's answer about a whisk that was pushed by so much, seconds since touch: the error to be expected by
    (13), (14) and docs/maps.md, the error and the noise's sigma as stated (NaN: no distance), all in % of the truth."""

    estimator: str
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
    """A trial to be answered by each converter."""

    unit: Unit
    result: TrialResult
    converters: Sequence[Converter]
    range_V: np.ndarray


def range_of(signals: Signals) -> np.ndarray:
    """What the channels span (2,)."""
    return np.nan_to_num(np.ptp(_channels(signals), axis=0))


def _channels(signals: Signals) -> np.ndarray:
    return np.stack([signals.y, signals.z], axis=1)


def answered(task: Task) -> list[Answer]:
    """All answers about the measured whisks whose truth is sound; of a saturated stroke there are none."""
    signals = read_signals(task.unit.trial)
    readout, _ = readout_of(task.unit, signals.kind)
    if readout is None or task.result.trial.purpose != "measure":
        return []
    felt = task.result.felt.whisks
    whisks = zip(forward_strokes(signals), task.result.seen.whisks, felt)
    sound = [(where, seen) for where, seen, own in whisks if seen.has_truth and is_sound(seen, own)]
    converters = [converter for converter in task.converters if converter.passes(signals.rate_Hz)]
    found = (
        _of_whisk(task, signals, readout, converter, *whisk)
        for converter in converters
        for whisk in sound
    )
    return [answer for of_whisk in found for answer in of_whisk]


def _of_whisk(
    task: Task,
    signals: Signals,
    readout: Readout,
    converter: Converter,
    where: slice,
    seen: SeenWhisk,
) -> Iterator[Answer]:
    """Of one stroke as this converter gives it, cut at each push."""
    raw = _channels(signals)[: where.stop]
    raw[where] = off_the_rails(raw[where]) if signals.kind == "V" else raw[where]
    if not np.isfinite(raw).all():
        return
    own = converter.converted(raw, signals.rate_Hz, task.range_V)[where][:: converter.every]
    time_s, motor = (
        values[where][:: converter.every] for values in (signals.time_s, signals.motor_rad)
    )
    stroke = FeltStroke(time_s, motor, own, own)
    rate_Hz = signals.rate_Hz / converter.every
    for push_deg in PUSHES_DEG:
        end_s = _time_at(stroke, seen.touch_rad.value + math.radians(push_deg)) + converter.delay_s
        if not end_s <= time_s[-1]:
            return
        now = time_s <= end_s
        cut = replace(
            stroke, time_s=time_s[now], motor_rad=motor[now], channels=own[now], filtered=own[now]
        )
        late_s = end_s - _time_at(stroke, seen.touch_rad.value) + 1.0 / rate_Hz
        about = converter, math.degrees(stroke.speed_rad_s), rate_Hz, push_deg, late_s
        theta_rad = _theta_rad(math.radians(push_deg), stroke.speed_rad_s)
        yield from _answers(task, readout, cut, theta_rad, seen, about)


def _time_at(stroke: FeltStroke, motor_rad: float) -> float:
    """When the motor is there; NaN where it does not come so far."""
    if not stroke.motor_rad[0] <= motor_rad <= stroke.motor_rad.max():
        return math.nan
    return float(np.interp(motor_rad, np.maximum.accumulate(stroke.motor_rad), stroke.time_s))


def _theta_rad(push_rad: float, speed_rad_s: float) -> float:
    """The pushing angle whose window (`estimator.signal.moment_at`) ends where the push does."""
    half = max(HALF_WINDOW_RAD, speed_rad_s * HUM_PERIOD_S / 2)
    return max(push_rad - half, push_rad / _PART)


def _answers(
    task: Task,
    readout: Readout,
    stroke: FeltStroke,
    theta_rad: float,
    seen: SeenWhisk,
    about: tuple,
) -> Iterator[Answer]:
    settings, beam = task.unit.settings, task.unit.session.whisker.beam
    asked = estimators(settings.estimators)
    radii_mm = 0.5 * task.result.trial.bar_diameter_mm, 0.5 * task.unit.session.whisker.diameter_mm
    _, whisk = felt_whisk(stroke, readout, task.unit.drift_rate, beam, theta_rad)
    rows = () if isinstance(whisk, str) else answers(whisk, asked, settings, radii_mm)
    found, d_x = {row.estimator: row for row in rows}, seen.d_x_mm.value
    for row in answers(
        _expected(seen, theta_rad, sum(radii_mm), settings, beam), asked, settings, radii_mm
    ):
        expected = 100.0 * (row.d_x_est_mm.value / d_x - 1.0)
        yield Answer(
            row.estimator, *about, expected, *_error_and_noise(found.get(row.estimator), d_x)
        )


def _error_and_noise(row: EstimateRow | None, d_x_mm: float) -> tuple[float, float]:
    """Of an answer, in % of the truth; NaN where there is none."""
    if row is None:
        return math.nan, math.nan
    return 100.0 * (
        row.d_x_est_mm.value / d_x_mm - 1.0
    ), 100.0 * row.d_x_est_sigma_alpha_exact_mm / d_x_mm


def _expected(
    seen: SeenWhisk, theta_rad: float, reach_mm: float, settings: Settings, beam: Beam
) -> Whisk:
    """The whisk as (13) and (14) have it for the slope and friction seen, with the first order of what they leave out."""
    alpha, beta, d_x = seen_friction(seen)[0], seen.beta_rad.value, seen.d_x_mm.value
    alpha = max(alpha, 0.0) if np.isfinite(alpha) else settings.alpha_est_rad
    phi, left = float(slip_angle(beta, alpha)), 1.0 - beam.taper * d_x / beam.length_mm
    share = first_order.leaning(theta_rad, seen.psi_rad.value, phi, alpha)
    if np.isfinite(reach_mm):
        share += first_order.rolling(theta_rad, reach_mm, phi, alpha, d_x, left)
    felt = np.array(
        moments(float(beam.as_cylinder_mm(d_x)), theta_rad, beta, alpha, beam.C_Nmm2)
    ) / (1.0 + share)
    return Whisk(*(np.zeros(0),) * 4, theta_rad, *felt.tolist(), np.zeros((2, 2)), 0.0, beam)
