"""The felt half of a trial's result: felt touch, moments and estimates of each whisk.

What is seen enters in two places, neither of which is an estimate: phases of stick and slip take
the slope as seen, and moments that disagree with the seen shape get a status.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.base.statuses import reason
from bench.gauges.felt import (
    FeltStroke,
    gauge_delay,
    strokes_of,
    touch_on_the_way_back,
    ways_back_of,
)
from bench.gauges.gauge_readings import Pairs, pairs_of
from bench.records.trial_result import (
    BY_STAGE,
    WITH_FRICTION,
    EstimateRow,
    FeltAt,
    FeltTrial,
    FeltWhisk,
    SeenTrial,
    SeenWhisk,
    WithDrift,
)
from bench.session.signals import Signals
from bench.trials.agreement import MomentAgreement, OtherReading, agreement, other_units
from bench.trials.consistency import check_friction_cone, nominal_slope
from bench.trials.contradictions import against_estimates
from bench.trials.estimates import as_felt, estimators, felt_at, run_estimators
from bench.trials.gate import kinetic_of
from bench.trials.moment_size import check_moment_size
from bench.trials.object_motion import MOTION_ESTIMATORS, with_motion
from bench.trials.readout import Readout, felt_whisk, whisk_at
from bench.trials.seen import NO_PICTURES, unseen
from bench.trials.sensor_readings import with_others
from bench.trials.stated_length import stated_in_other_unit
from bench.trials.stick_slip_phases import phases_of
from bench.trials.unit import Unit
from bench.trials.ways_back import NO_WAY_BACK, with_both_ways, with_late_release
from estimator.builtin import ESTIMATORS
from estimator.sensors import SENSORS
from estimator.signal import NOT_REACHED, FeltTouch
from estimator.whisk import Whisk
from vision import NAN, UNKNOWN, Value
from vision.geometry import NO_REASON, Reason, joined

NO_GAUGES = reason("no_gauges")
SATURATED = reason("gauges_at_rail")
OWN_GAUGES = reason("own_gauges")
# Pushing angles at which a run says how error and sigma go with θ: steps of a half and less, where
# errors bend.
THETAS_DEG = (0.2, 0.3, 0.5, 0.7, 1, 1.5, 2, 2.5, 3, 3.5, 4, 5, 6, 8, 10, 12, 15, 20)


def feel_trial(unit: Unit, signals: Signals, seen: SeenTrial) -> FeltTrial:
    """Return felt touch, moments and estimates of each whisk of a trial."""
    strokes = strokes_of(signals, unit.trial, unit.settings)
    whisks = []
    for number, stroke in enumerate(strokes):
        whisks.append(_feel(unit, signals.kind, stroke, seen.whisks[number], number))
    back_touch_rad = UNKNOWN
    if seen.back:
        back_touch_rad = touch_on_the_way_back(signals, _delay_s(unit).value)
    back = _feel_back(unit, signals, seen, whisks) if unit.trial.both_ways else ()
    return FeltTrial(tuple(whisks), back_touch_rad, back)


def _feel_back(
    unit: Unit, signals: Signals, seen: SeenTrial, forward: Sequence[FeltWhisk]
) -> tuple[FeltWhisk, ...]:
    """Return the way back of each whisk, with the estimates of both ways together."""
    pictures = seen.ways_back or unseen(len(forward), NO_PICTURES).whisks
    strokes = ways_back_of(signals, unit.trial, unit.settings)
    delay_s = _delay_s(unit).value
    whisks = []
    for stroke, one, there in zip(strokes, pictures, forward):
        if stroke is None:
            whisks.append(FeltWhisk(there.whisk, status=NO_WAY_BACK))
            continue
        back = _feel(unit, signals.kind, stroke, one, there.whisk)
        back = with_late_release(back, 2.0 * delay_s * stroke.speed_rad_s)
        whisks.append(with_both_ways(back, there, unit.session.whisker.beam, unit.settings))
    return tuple(whisks)


def _feel(unit: Unit, kind: str, stroke: FeltStroke, seen: SeenWhisk, number: int) -> FeltWhisk:
    """Return one whisk as felt; kind: of the signals."""
    readout, missing = readout_of(unit, kind)
    touch, whisk = _felt_whisk(unit, stroke, readout or Readout.bare())
    status = _missing(unit, stroke, touch, whisk, missing)
    usable = None if status else whisk
    felt = as_felt(number, touch, usable, stroke.speed_rad_s, _delay_s(unit))
    felt = replace(felt, status=status, saturated=stroke.saturated)
    if usable is None:
        return felt
    of_seen = against_estimates(unit.contradictions, unit.gauges, seen)
    felt = replace(felt, status=joined(of_seen, _beyond_calibration(unit, readout, usable)))
    estimated = _EstimatedStroke(unit, stroke, readout, touch)
    felt = estimated.with_moments(felt, usable, seen)
    felt = replace(felt, one_factor=_one_factor(unit, kind, stroke))
    felt = _against_pictures(felt, unit, stroke, readout, seen)
    felt = estimated.with_estimates(felt, usable)
    return felt if seen.source != BY_STAGE else _against_stated(felt, seen)


def _against_stated(felt: FeltWhisk, seen: SeenWhisk) -> FeltWhisk:
    """Return the felt whisk with a status where (10) has the contact where the stage does in another unit.

    Nothing is concluded from such a whisk.
    """
    ten = felt.estimate(WITH_FRICTION)
    unit_name = stated_in_other_unit(seen.d_x_mm.value, ten.d_x_est_mm.value)
    if not unit_name:
        return felt
    found = f"the stage has the contact at {seen.d_x_mm.value:.4g} mm, (10) at {ten.d_x_est_mm.value:.3g} mm"
    odd = Reason("stated_in_other_unit", f"{found}: is the stage's in {unit_name}?")
    return replace(felt, apart=True, status=joined(felt.status, odd))


def _beyond_calibration(unit: Unit, readout: Readout, whisk: Whisk) -> Reason:
    """Return the status of moments larger than any that were calibrated; NO_REASON elsewhere."""
    if not readout.is_gauged:
        return NO_REASON
    return Reason("beyond_calibration", unit.gauges.beyond(readout.in_follicle(whisk)))


def _missing(
    unit: Unit, stroke: FeltStroke, touch: FeltTouch, whisk: Whisk | Reason, without_readout: Reason
) -> Reason:
    """Return why a stroke has no moments at the wanted angle; NO_REASON where it has.

    without_readout: why the channels are no moments.
    """
    status = whisk if isinstance(whisk, Reason) else without_readout
    reaches = stroke.motor_rad.max() >= touch.motor_rad + unit.settings.theta_rad
    return SATURATED if NOT_REACHED.code in status.codes and reaches else status


def _felt_whisk(
    unit: Unit, stroke: FeltStroke, readout: Readout
) -> tuple[FeltTouch, Whisk | Reason]:
    """Return felt touch and the whisk at the wanted angle, or the reason why there is none."""
    beam = unit.session.whisker.beam
    return felt_whisk(stroke, readout, unit.drift_rate, beam, unit.settings.theta_rad)


def _delay_s(unit: Unit) -> Value:
    """Return the delay of the gauges' filter."""
    return gauge_delay(unit.trial.gauge_filter_Hz)


@dataclass(frozen=True, eq=False)
class _EstimatedStroke:
    """A stroke with its felt touch, to be given to estimators at any pushing angle."""

    unit: Unit
    stroke: FeltStroke
    readout: Readout
    touch: FeltTouch

    def with_moments(self, felt: FeltWhisk, whisk: Whisk, seen: SeenWhisk) -> FeltWhisk:
        """Return the felt whisk with how its moments err, its stick and slip, and what drift it had.

        whisk: at the wanted angle.
        """
        readout = self.readout
        trial = self.unit.trial
        return replace(
            felt,
            shared_Nmm=readout.shared_Nmm(whisk),
            by_camera_error_Nmm=readout.by_camera_error_Nmm(whisk),
            phases=phases_of(trial, self.stroke, self.touch, readout, seen, whisk.beam),
            with_drift=_with_drift(self.unit, self.stroke, readout),
        )

    def with_estimates(self, felt: FeltWhisk, whisk: Whisk) -> FeltWhisk:
        """Return the felt whisk with all estimates; whisk: at the wanted angle."""
        felt = replace(felt, estimates=self._rows(whisk))
        ten = felt.estimate(WITH_FRICTION)
        return replace(
            felt,
            kinetic=kinetic_of(self.stroke, self.touch, self.readout, whisk, ten),
            by_theta=self._by_theta(),
            sensors=self._sensor_rows(whisk, felt.touch_felt_rad.value),
        )

    def _rows(self, whisk: Whisk) -> tuple[EstimateRow, ...]:
        """Return the rows of the built-in and the user's own estimators."""
        own = self.unit.settings.estimators
        if own and whisk.others is None:
            whisk = self._with_sensors(whisk)
        return run_estimators(
            whisk, estimators(own, whisk.beam), self.unit.settings, _radii_mm(self.unit)
        )

    def _by_theta(self) -> tuple[FeltAt, ...]:
        """Return moments and estimates at THETAS_DEG, as far as the stroke goes."""
        beam = self.unit.session.whisker.beam
        found = []
        for theta_rad in np.radians(THETAS_DEG).tolist():
            whisk = whisk_at(self.stroke, self.readout, self.touch, beam, theta_rad)
            if isinstance(whisk, Whisk):
                if self.stroke.forces_N is not None:
                    whisk = self._with_sensors(whisk)
                found.append(felt_at(whisk, self._rows(whisk)))
        return tuple(found)

    def _sensor_rows(self, whisk: Whisk, touch_rad: float) -> tuple[EstimateRow, ...]:
        """Return the rows of the other sensors of Table I and of a known motion, where there are."""
        settings = self.unit.settings
        radii_mm = _radii_mm(self.unit)
        rows: tuple[EstimateRow, ...] = ()
        if self.stroke.forces_N is not None:
            rows += run_estimators(self._with_sensors(whisk), SENSORS, settings, radii_mm)
        if self.unit.trial.object_velocity_mm_s is not None:
            moving = with_motion(whisk, self.unit.trial, self.stroke, touch_rad)
            rows += run_estimators(moving, MOTION_ESTIMATORS, settings, radii_mm)
        return rows

    def _with_sensors(self, whisk: Whisk) -> Whisk:
        """Return the whisk with the readings of the other sensors."""
        return with_others(
            whisk,
            self.stroke,
            self.readout,
            self.touch,
            force_drift_rate=self.unit.force_drift_rate,
            scale_sigma=_stiffness_share(self.unit, self.readout, of_wire=True),
        )


def _stiffness_share(unit: Unit, readout: Readout, *, of_wire: bool) -> float:
    """Return C's relative sigma where it applies, else 0.

    With of_wire it applies where the moments' newtons are those of the wire's bending, else where
    gauges or recording bring newtons of their own.
    """
    whisker = unit.session.whisker
    is_fitted = readout.is_gauged and unit.gauges.of_wire
    return whisker.C_sigma_Nmm2 / whisker.C_Nmm2 if is_fitted == of_wire else 0.0


def _against_pictures(
    felt: FeltWhisk, unit: Unit, stroke: FeltStroke, readout: Readout, seen: SeenWhisk
) -> FeltWhisk:
    """Return the felt whisk with χ² of its moments less those of the seen shape, and a status with
    the probable cause where they disagree.

    Pictures that contradict encoder or lengths say nothing about the gauges.
    """
    if seen.deflection is None:
        odd = _against_expectation(felt, unit, readout)
        is_apart = seen.contradicted or bool(odd)
        return replace(felt, apart=is_apart, status=joined(felt.status, odd))
    if seen.contradicted:
        return replace(felt, apart=True)
    rate = np.zeros(2) if unit.drift_rate is None else unit.drift_rate
    whisker = unit.session.whisker
    pairs = pairs_of(unit.trial, seen, stroke, rate, whisker, unit.settings.theta_rad)
    if not isinstance(pairs, Pairs):
        if "gauge_rod_unconverged" in pairs.codes:
            return replace(felt, status=joined(felt.status, pairs))
        return felt
    found = against_shape(unit, readout, pairs)
    status = joined(felt.status, found.status)
    return replace(felt, agreement_chi2=found.chi2, apart=bool(found.status), status=status)


def _against_expectation(felt: FeltWhisk, unit: Unit, readout: Readout) -> Reason:
    """Return why moments that no picture shows cannot be; NO_REASON where they can."""
    odd = check_friction_cone(felt.phi_felt_rad, nominal_slope(unit.trial), "felt")
    if readout.is_gauged:
        return odd
    moments_Nmm = np.array([felt.m_y_Nmm.value, felt.m_z_Nmm.value])
    size = check_moment_size(moments_Nmm, unit.settings.theta_rad, unit.session.whisker)
    return joined(odd, size)


def against_shape(unit: Unit, readout: Readout, pairs: Pairs) -> MomentAgreement:
    """Compare felt moments with those of the seen shape.

    Moments that have newtons of their own also depend on how well the rigidity is known.
    """
    others = other_units(readout.gauges, readout.is_gauged)
    if unit.gauges is not None and not readout.is_gauged:
        sentence = "m_y_Nmm and m_z_Nmm look like the gauges' volts: name them y_V and z_V"
        others.append(OtherReading(unit.gauges.all, sentence))
    scale_sigma = _stiffness_share(unit, readout, of_wire=False)
    return agreement(pairs, readout.gauges, scale_sigma, others)


def readout_of(unit: Unit, kind: str) -> tuple[Readout | None, Reason]:
    """Return the conversion of channels of this kind to moments, or None and why there is none."""
    if kind == "Nmm":
        return _with_scale(Readout.bare(unit.trial.moment_gain_sigma), unit), NO_REASON
    if unit.gauges is None:
        return None, NO_GAUGES
    gauges = unit.gauges.for_trial(unit.trial.name)
    if gauges is None:
        return None, OWN_GAUGES
    return _with_scale(Readout.of(unit.trial, gauges), unit), NO_REASON


def _with_scale(readout: Readout, unit: Unit) -> Readout:
    """Return the readout with the stiffness' relative sigma, where that enters distances.

    Where gauges were fitted to the wire's bending, the stiffness cancels.
    """
    return replace(readout, scale_sigma=_stiffness_share(unit, readout, of_wire=False))


def _with_drift(unit: Unit, stroke: FeltStroke, readout: Readout) -> WithDrift | None:
    """Return touch and (10) of the stroke as recorded; None where no drift was removed from it."""
    if stroke.drift is None:
        return None
    touch, whisk = _felt_whisk(unit, stroke.with_drift, readout)
    touch_rad = as_felt(0, touch, None, stroke.speed_rad_s, _delay_s(unit)).touch_felt_rad.value
    if isinstance(whisk, Reason):
        return WithDrift(touch_rad, NAN)
    (row,) = run_estimators(whisk, {WITH_FRICTION: ESTIMATORS[WITH_FRICTION]}, unit.settings)
    return WithDrift(touch_rad, row.d_x_est_mm.value)


def _one_factor(unit: Unit, kind: str, stroke: FeltStroke) -> tuple[EstimateRow, ...]:
    """Return the estimates with one factor a channel and no cross-talk, the paper's way.

    There are none where these factors were not calibrated, or by this trial too: they are fitted
    to all gauge trials at once.
    """
    factors = unit.gauges.one_factor if unit.gauges else None
    if kind == "Nmm" or factors is None or unit.trial.name in unit.gauges.without:
        return ()
    if not np.isfinite(factors.matrix).all():
        return ()
    _, whisk = _felt_whisk(unit, stroke, Readout.of(unit.trial, factors))
    return run_estimators(whisk, ESTIMATORS, unit.settings, _radii_mm(unit))


def _radii_mm(unit: Unit) -> tuple[float, float]:
    """Return the radii of the bar, NaN where it is not stated, and of the whisker's base."""
    bar_mm = unit.trial.bar_diameter_mm
    return (NAN if bar_mm is None else 0.5 * bar_mm), 0.5 * unit.session.whisker.diameter_mm
