"""The ways back of a trial's whisks, evaluated as forward strokes are, and each with the way there."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from bench.base.settings import OBJECT_REACH_MM, TILT_SIGMA_RAD
from bench.base.statuses import reason
from bench.gauges.felt import FeltStroke, gauge_delay, ways_back_of
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenTrial, SeenWhisk
from bench.session.signals import Signals
from bench.trials.estimates import whisk_of
from bench.trials.seen import NO_PICTURES
from estimator.both_ways import there_and_back
from estimator.whisk import EstimatorSettings
from vision.truth.value import Value

if TYPE_CHECKING:
    from bench.trials.unit import Unit

BOTH_WAYS = "both_ways"
NO_WAY_BACK = reason("no_way_back")


def feel_back(
    feel: Callable[[FeltStroke, SeenWhisk, int], FeltWhisk],
    unit: "Unit",
    signals: Signals,
    seen: SeenTrial,
    there: Sequence[FeltWhisk],
) -> tuple[FeltWhisk, ...]:
    """The way back of each whisk `there`; feel: what feels a stroke beside what is seen of it."""
    pictures = seen.ways_back or tuple(SeenWhisk(k, NO_PICTURES) for k in range(len(there)))
    strokes = ways_back_of(signals, unit.trial, unit.settings)
    delay_s, found = gauge_delay(unit.trial.gauge_filter_Hz), []
    for stroke, one, whisk in zip(strokes, pictures, there):
        if stroke is None:
            found.append(FeltWhisk(whisk.whisk, status=NO_WAY_BACK))
            continue
        felt = feel(stroke, one, whisk.whisk)
        found.append(
            _with_both(_let_go(felt, 2.0 * delay_s.value * stroke.speed_rad_s), whisk, unit)
        )
    return tuple(found)


def _let_go(felt: FeltWhisk, later_rad: float) -> FeltWhisk:
    """The whisk where the motor went back: gauges that are late let go late, which is at a smaller angle."""
    touch = felt.touch_felt_rad
    return replace(felt, touch_felt_rad=Value(touch.value + later_rad, touch.sigma))


def _with_both(back: FeltWhisk, there: FeltWhisk, unit: "Unit") -> FeltWhisk:
    """The way back, its estimates followed by that of both ways together."""
    if not (back.has_moments and there.has_moments):
        return back
    beam, settings = unit.session.whisker.beam, unit.settings
    told = EstimatorSettings(settings.alpha_est_rad, 0.0, OBJECT_REACH_MM, TILT_SIGMA_RAD)
    ways = (whisk_of(way, settings.theta_rad, beam) for way in (there, back))
    found = there_and_back(*ways, told, (there.shared_Nmm, back.shared_Nmm))
    d_x, ends = Value(found.d_x_mm, found.sigma_mm), (found.low_mm, found.high_mm)
    row = EstimateRow(
        BOTH_WAYS, d_x, found.alpha_rad, found.beta_rad, found.status, found.sigma_mm, *ends
    )
    return replace(back, estimates=(*back.estimates, row))
