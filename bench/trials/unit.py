"""One trial, the unit of work: a pure function of its files, the session's calibration and the settings.

The result stands whole in OUT/trials/<trial>.json with the hash of all of these. Workers, interruption, resuming, and
redoing only what changed are this one mechanism. What is seen has a hash of its own, so that another α_est costs no
look at the pictures.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from bench.base.results import ESTIMATING, SEEING, hash_of, hash_of_code, read_result, write_result
from bench.base.settings import Settings
from bench.base.statuses import reason
from bench.cameras.session_cameras import SessionCalibration
from bench.gauges.felt import FeltStroke, gauge_delay, strokes_of, touch_on_the_way_back
from bench.gauges.gauge_readings import Pairs, pairs_of
from bench.gauges.matrix import GaugeCalibration
from bench.records.plain import from_plain, to_plain
from bench.records.trial_result import (
    EstimateRow,
    FeltTrial,
    FeltWhisk,
    SeenTrial,
    SeenWhisk,
    TrialFacts,
    TrialResult,
    WhiskerFacts,
    WithDrift,
)
from bench.session.session import Session
from bench.session.signals import Signals, read_signals
from bench.session.trial import Trial
from bench.session.whisker import Whisker
from bench.trials.agreement import Agreement, agreement
from bench.trials.consistency import cone_doubt, nominal_slope
from bench.trials.estimates import Readout, answers, as_felt, estimators, felt_by_theta, felt_whisk
from bench.trials.gate import kinetic_of
from bench.trials.object_motion import ASKED, MOVING, with_motion
from bench.trials.other_wires import lines_in
from bench.trials.seen import see_trial
from bench.trials.sensor_readings import with_others
from bench.trials.stick_slip_phases import phases_of
from bench.trials.ways_back import feel_back
from bench.trials.whose_wire import with_whose
from estimator.builtin import ESTIMATORS
from estimator.sensors import SENSORS
from estimator.signal import NOT_REACHED
from estimator.whisk import Whisk
from vision.geometry.reasons import NO_REASON, Reason, joined
from vision.truth.value import NAN, UNKNOWN

NO_GAUGES = reason("no_gauges")
SATURATED = reason("gauges_at_rail")
_TEN = "with_friction"  # equation (10)
OWN_GAUGES = reason("own_gauges")


@dataclass(frozen=True)
class Unit:
    """What one trial's result is made from. files: hash of the trial's files. drift_rate: (2,), of the channels per
    second, and force_drift_rate (3,) of a load cell; gauges: None where volts cannot become moments. stage: folder of
    what is seen before all is known. wires: of an array, by the names of its whiskers, files that say where
    their wires are in the pictures, with the hash of all of them; straight: the same were all wires straight."""

    session: Session
    trial: Trial
    files: str
    calibration: SessionCalibration
    settings: Settings
    out: Path
    drift_rate: np.ndarray | None = None
    gauges: GaugeCalibration | None = None
    stage: str = "seen"
    force_drift_rate: np.ndarray | None = None
    wires: tuple[tuple[str, Path], ...] = ()
    wires_hash: str = ""
    straight: tuple[tuple[str, Path], ...] = ()

    @property
    def path(self) -> Path:
        """Where the result stands."""
        return self.out / "trials" / f"{self.trial.name}.json"

    @property
    def seen_path(self) -> Path:
        """Where the seen half of a trial stands that is part of the session's calibration."""
        return self.out / "calibration" / self.stage / f"{self.trial.name}.json"

    @property
    def seen_hash(self) -> str:
        """Hash of all that the seen half depends on."""
        session = self.session
        return hash_of(
            hash_of_code(SEEING),
            self.files,
            self.trial,
            session.whisker,
            session.board,
            session.T_rig_board,
            self.calibration.hash,
            self.settings.seen(),
            *filter(None, [self.wires_hash]),
        )

    @property
    def hash(self) -> str:
        """Hash of all that the result depends on."""
        made_from = (
            self.drift_rate,
            self.gauges,
            self.settings.estimated(),
            self.settings.own_code(),
        )
        return hash_of(hash_of_code(ESTIMATING), self.seen_hash, self.force_drift_rate, *made_from)

    def with_gauges(
        self,
        drift_rate: np.ndarray,
        gauges: GaugeCalibration | None,
        force_drift_rate: np.ndarray | None = None,
    ) -> "Unit":
        """The unit complete, once the gauges are known."""
        return replace(
            self, drift_rate=drift_rate, gauges=gauges, force_drift_rate=force_drift_rate
        )


def see_unit(unit: Unit) -> SeenTrial:
    """The seen half, kept beside the calibration."""
    seen = kept_seen(unit)
    if seen is None:
        seen = _see(unit, read_signals(unit.trial))
        write_result(unit.seen_path, {"seen_hash": unit.seen_hash, "seen": to_plain(seen)})
    return seen


def _see(unit: Unit, signals: Signals) -> SeenTrial:
    made_from = unit.session, unit.trial, signals, unit.calibration, unit.settings
    if not unit.wires:
        return see_trial(*made_from)
    looked = lines_in(unit.wires)
    return with_whose(
        see_trial(*made_from, looked), lines_in(unit.straight), looked, unit.session.base.name
    )


def kept_seen(unit: Unit) -> SeenTrial | None:
    """The seen half of an earlier result, where all that it depends on is as it was."""
    for path in (unit.path, unit.seen_path):
        kept = read_result(path)
        if kept and kept.get("seen_hash") == unit.seen_hash:
            return from_plain(SeenTrial, kept["seen"])
    return None


def evaluate_unit(unit: Unit) -> None:
    """The trial's whole result in its file, unless it stands there already."""
    kept = read_result(unit.path)
    if not kept or kept.get("hash") != unit.hash:
        write_result(unit.path, to_plain(trial_result(unit)))


def trial_result(unit: Unit) -> TrialResult:
    """Truth and estimates of every whisk of the trial."""
    signals = read_signals(unit.trial)
    seen = kept_seen(unit) or _see(unit, signals)
    felt = feel_trial(unit, signals, seen)
    return TrialResult(*described(unit), seen, felt, unit.hash, unit.seen_hash)


def described(unit: Unit) -> tuple[TrialFacts, WhiskerFacts, float]:
    """What a result begins with: trial, whisker and wanted pushing angle."""
    return _described(unit.trial), _whisker(unit.session.whisker), unit.settings.theta_deg


def _described(trial: Trial) -> TrialFacts:
    given = trial.d_x_mm, trial.beta_deg, trial.bar_diameter_mm
    nominal = (NAN if value is None else float(value) for value in given)
    purpose = trial.purpose if trial.object_velocity_mm_s is None else MOVING
    return TrialFacts(trial.name, purpose, trial.surface, trial.speed_deg_s, *nominal)


def _whisker(whisker: Whisker) -> WhiskerFacts:
    facts = whisker.shape, whisker.length_mm, whisker.diameter_mm, whisker.EI_Nmm2
    return WhiskerFacts(*facts, whisker.tip_diameter_mm)


def feel_trial(unit: Unit, signals: Signals, seen: SeenTrial) -> FeltTrial:
    """Felt touch, moments and estimates of each whisk; and its phases of stick and slip, which take the slope as seen
    and are no estimate."""
    strokes = strokes_of(signals, unit.trial, unit.settings)
    whisks = tuple(_feel(unit, signals.kind, s, seen.whisks[k], k) for k, s in enumerate(strokes))
    delay = gauge_delay(unit.trial.gauge_filter_Hz)
    there = touch_on_the_way_back(signals, delay.value) if seen.back else UNKNOWN
    back = (
        feel_back(partial(_feel, unit, signals.kind), unit, signals, seen, whisks)
        if unit.trial.both_ways
        else ()
    )
    return FeltTrial(whisks, there, back)


def _feel(unit: Unit, kind: str, stroke: FeltStroke, seen: SeenWhisk, number: int) -> FeltWhisk:
    readout, missing = readout_of(unit, kind)
    beam, theta_rad = unit.session.whisker.beam, unit.settings.theta_rad
    touch, whisk = felt_whisk(stroke, readout or Readout.bare(), unit.drift_rate, beam, theta_rad)
    status = whisk if isinstance(whisk, Reason) else missing
    if NOT_REACHED.code in status.codes and stroke.motor_rad.max() >= touch.motor_rad + theta_rad:
        status = SATURATED
    usable = None if status else whisk
    if usable is not None and readout.is_gauged:
        beyond = unit.gauges.beyond(readout.in_follicle(usable))
        status = Reason("beyond_calibration", beyond)
    felt = as_felt(
        number, touch, usable, stroke.speed_rad_s, gauge_delay(unit.trial.gauge_filter_Hz)
    )
    felt = replace(felt, status=status, saturated=stroke.saturated)
    if usable is None:
        return felt
    felt = replace(felt, shared_Nmm=readout.shared_Nmm(usable))
    felt = _against_pictures(felt, unit, stroke, readout, seen)
    told = {"settings": unit.settings, "radii_mm": _radii_mm(unit)}
    known = {
        "force_drift_rate": unit.force_drift_rate,
        "scale_sigma": _C_share(unit, readout, of_wire=True),
    }
    sensing = partial(with_others, stroke=stroke, readout=readout, touch=touch, **known)
    sensors = () if stroke.forces_N is None else _answered(sensing, usable, asked=SENSORS, **told)
    if unit.trial.object_velocity_mm_s is not None:
        sensors += answers(
            with_motion(usable, unit.trial, stroke, felt.touch_felt_rad.value), ASKED, **told
        )
    answered = partial(
        _answered,
        sensing if unit.settings.estimators else None,
        asked=estimators(unit.settings.estimators),
        **told,
    )
    estimates = answered(usable)
    return replace(
        felt,
        phases=phases_of(unit.trial, stroke, touch, readout, seen, beam),
        estimates=estimates,
        kinetic=kinetic_of(
            stroke, touch, readout, usable, next(row for row in estimates if row.estimator == _TEN)
        ),
        by_theta=felt_by_theta(stroke, readout, touch, beam, answered),
        sensors=sensors,
        one_factor=_one_factor(unit, kind, stroke),
        with_drift=_with_drift(unit, stroke, readout),
    )


def _answered(
    sensing: Callable[[Whisk], Whisk] | None, whisk: Whisk, **asked
) -> tuple[EstimateRow, ...]:
    """Answers about a whisk; sensing: tells it what other sensors have to say."""
    return answers(whisk if sensing is None else sensing(whisk), **asked)


def _C_share(unit: Unit, readout: Readout, *, of_wire: bool) -> float:
    """How well the wire's C is known where the moments' newtons are those of the wire's bending (of_wire), or where
    gauges or recording bring their own; else 0."""
    whisker, fitted = unit.session.whisker, readout.is_gauged and unit.gauges.of_wire
    return whisker.C_sigma_Nmm2 / whisker.C_Nmm2 if fitted == of_wire else 0.0


def _against_pictures(
    felt: FeltWhisk, unit: Unit, stroke: FeltStroke, readout: Readout, seen: SeenWhisk
) -> FeltWhisk:
    """The felt whisk with χ² of its moments and those of the seen shape, and what is likely wrong in its status. Where
    pictures contradict encoder or lengths, they tell nothing of gauges."""
    if seen.deflection is None or seen.contradicted:
        odd = (
            cone_doubt(felt.phi_felt_rad, nominal_slope(unit.trial), "felt")
            if seen.deflection is None
            else ""
        )
        return replace(felt, apart=seen.contradicted or bool(odd), status=joined(felt.status, odd))
    whisker, rate = (
        unit.session.whisker,
        np.zeros(2) if unit.drift_rate is None else unit.drift_rate,
    )
    pairs = pairs_of(unit.trial, seen, stroke, rate, whisker, unit.settings.theta_rad)
    if pairs is None:
        return felt
    found = against_shape(unit, readout, pairs)
    status = joined(felt.status, found.status)
    return replace(felt, agreement_chi2=found.chi2, apart=bool(found.status), status=status)


def against_shape(unit: Unit, readout: Readout, pairs: Pairs) -> Agreement:
    """Felt moments against those of the seen shape. Moments that have newtons of their own tell the rigidity, too."""
    return agreement(pairs, readout.gauges, _C_share(unit, readout, of_wire=False))


def readout_of(unit: Unit, kind: str) -> tuple[Readout | None, Reason]:
    """How channels become moments, or why they cannot."""
    if kind == "Nmm":
        return Readout.bare(), NO_REASON
    if unit.gauges is None:
        return None, NO_GAUGES
    fitted = unit.gauges.for_trial(unit.trial.name)
    return (Readout.of(unit.trial, fitted), NO_REASON) if fitted is not None else (None, OWN_GAUGES)


def _with_drift(unit: Unit, stroke: FeltStroke, readout: Readout) -> WithDrift | None:
    """Touch and (10) of the stroke as recorded; None where nothing was taken out of it."""
    if stroke.drift is None:
        return None
    beam, theta_rad = unit.session.whisker.beam, unit.settings.theta_rad
    touch, whisk = felt_whisk(stroke.with_drift, readout, unit.drift_rate, beam, theta_rad)
    felt = as_felt(0, touch, None, stroke.speed_rad_s, gauge_delay(unit.trial.gauge_filter_Hz))
    if isinstance(whisk, Reason):
        return WithDrift(felt.touch_felt_rad.value, NAN)
    (row,) = answers(whisk, {_TEN: ESTIMATORS[_TEN]}, unit.settings)
    return WithDrift(felt.touch_felt_rad.value, row.d_x_est_mm.value)


def _one_factor(unit: Unit, kind: str, stroke: FeltStroke) -> tuple[EstimateRow, ...]:
    """The estimates with one factor a channel and no cross-talk, the paper's way, where that was calibrated, and by
    other trials: these factors are those of all."""
    plain_gauges = unit.gauges and unit.gauges.one_factor
    if kind == "Nmm" or plain_gauges is None or unit.trial.name in unit.gauges.without:
        return ()
    if not np.isfinite(plain_gauges.matrix).all():
        return ()
    readout, beam = Readout.of(unit.trial, plain_gauges), unit.session.whisker.beam
    _, whisk = felt_whisk(stroke, readout, unit.drift_rate, beam, unit.settings.theta_rad)
    return answers(whisk, estimators(()), unit.settings, _radii_mm(unit))


def _radii_mm(unit: Unit) -> tuple[float, float]:
    """Of the bar, NaN where the manifest does not say, and of the whisker's base."""
    bar = unit.trial.bar_diameter_mm
    return (NAN if bar is None else 0.5 * bar), 0.5 * unit.session.whisker.diameter_mm
