"""Evaluation of one trial: a pure function of its files, the session's calibration and the settings.

The result stands whole in OUT/trials/<trial>.json with the hash of all of these. Workers,
interruption, resuming, and redoing only what changed are this one mechanism.
"""

from dataclasses import replace

from bench.base.results import read_result, write_result
from bench.records.plain import to_plain
from bench.records.trial_result import SeenTrial, TrialFacts, TrialResult, WhiskerFacts
from bench.session.signals import Signals, read_signals
from bench.trials.consistency import nominal_slope
from bench.trials.contradictions import contradicted
from bench.trials.felt_trial import feel_trial
from bench.trials.kept_fits import seen_in
from bench.trials.object_motion import MOVING
from bench.trials.other_wires import lines_in
from bench.trials.truth_source import truth_source
from bench.trials.unit import Unit
from bench.trials.whose_wire import with_whose
from vision import NAN


def see_unit(unit: Unit) -> SeenTrial:
    """Return the seen half, and keep it with the calibration."""
    seen = kept_seen(unit)
    if seen is None:
        seen = _see(unit, read_signals(unit.trial))
        write_result(unit.seen_path, {"seen_hash": unit.seen_hash, "seen": to_plain(seen)})
    return seen


def _see(unit: Unit, signals: Signals) -> SeenTrial:
    """Find the truth of a trial; with a status where the session contradicts itself, and, of an array,
    where the wire is not its own.
    """
    wires = lines_in(unit.wires)
    seen = truth_source(unit.session).truth(unit, signals, wires)
    if not unit.places_rig:
        seen = replace(seen, fits=())
    seen = contradicted(seen, unit.contradictions)
    if not unit.wires:
        return seen
    return with_whose(seen, lines_in(unit.straight_wires), wires, unit.session.base.name)


def kept_seen(unit: Unit) -> SeenTrial | None:
    """Return the seen half of an earlier result that has the same inputs; None without one."""
    for path in (unit.path, unit.seen_path):
        seen = seen_in(path, unit.seen_hash)
        if seen is not None:
            return seen
    return None


def evaluate_unit(unit: Unit) -> None:
    """Write the trial's result to its file, unless it stands there already."""
    kept = read_result(unit.path)
    if not kept or kept.get("hash") != unit.hash:
        write_result(unit.path, to_plain(trial_result(unit)))


def trial_result(unit: Unit) -> TrialResult:
    """Return truth and estimates of every whisk of the trial."""
    signals = read_signals(unit.trial)
    seen = kept_seen(unit) or _see(unit, signals)
    felt = feel_trial(unit, signals, seen)
    return TrialResult(
        trial_facts(unit),
        whisker_facts(unit),
        unit.settings.theta_deg,
        seen,
        felt,
        unit.hash,
        unit.seen_hash,
    )


def trial_facts(unit: Unit) -> TrialFacts:
    """Return the facts of the trial; numbers that the manifest does not state are NaN."""
    trial = unit.trial
    return TrialFacts(
        trial.name,
        trial.purpose if trial.object_velocity_mm_s is None else MOVING,
        trial.surface,
        trial.speed_deg_s,
        d_x_nominal_mm=_or_nan(trial.d_x_mm),
        beta_nominal_deg=_or_nan(trial.beta_deg),
        bar_diameter_mm=_or_nan(trial.bar_diameter_mm),
        beta_nominal_sigma_rad=nominal_slope(trial).sigma,
        angle_from=trial.angle_from,
    )


def _or_nan(stated: float | None) -> float:
    """Return a stated number; NaN of one that is not stated."""
    return NAN if stated is None else float(stated)


def whisker_facts(unit: Unit) -> WhiskerFacts:
    """Return the facts of the session's whisker."""
    whisker = unit.session.whisker
    return WhiskerFacts(
        whisker.shape,
        whisker.length_mm,
        whisker.diameter_mm,
        whisker.EI_Nmm2,
        whisker.tip_diameter_mm,
        whisker.widths,
    )
