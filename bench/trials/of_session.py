"""Steps that concern all trials of a session: cameras placed in the rig, drift of the zero, gauges.

`evaluate` and `calibrate gauges` share them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np

from bench.base.digests import Digests
from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.base.numbers import first_names
from bench.base.progress import begin_step
from bench.base.results import hash_of_files
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.cameras.session_cameras import SessionCalibration, calibrate_session
from bench.gauges.certificate import Certificate
from bench.gauges.drift import drift_rate
from bench.gauges.felt import FeltStroke, strokes_of
from bench.gauges.fit import fit_gauges
from bench.gauges.gauge_faults import Undetermined, check_alive
from bench.gauges.gauge_readings import Pairs, pairs_of
from bench.gauges.gauges_file import given_gauges
from bench.gauges.matrix import FROM_ALL, GaugeCalibration
from bench.gauges.reversal import reversals
from bench.records.trial_result import SeenTrial
from bench.session.session import Session
from bench.session.signals import read_signals
from bench.session.trial import Trial
from bench.trials.contradictions import contradictions_of
from bench.trials.free_strokes import free_strokes
from bench.trials.lost import see_units
from bench.trials.placing import place_rig
from bench.trials.trial_evaluation import kept_seen
from bench.trials.unit import Unit
from vision.geometry import Reason

_MORE = "or let the other trials serve: --gauges-from-all"
# [trials] In one line. A layout.
_MOST_NAMED = 8
# [trials] Of which free strokes are read: their mean square is then known to a fifth. Derived.
_MOST_DRIFT_STROKES = 60


def require_some(trials: Sequence[Trial], settings: Settings) -> None:
    """Raise BadInput where the settings choose none of the trials, or a camera without pictures."""
    if not any(settings.takes(trial.name) for trial in trials):
        names = first_names((trial.name for trial in trials), _MOST_NAMED)
        raise BadInput(f"--trials {settings.trials}: no trial has such a name; there are {names}")
    cameras = dict.fromkeys(name for trial in trials for name in trial.cameras)
    for name in settings.seeing.cameras:
        if name not in cameras:
            found = f"there is no camera {name}; there are {first_names(cameras, _MOST_NAMED)}"
            raise BadInput(f"cameras of {settings.seeing.name}: {found}")


def placed_units(
    session: Session,
    trials: Sequence[Trial],
    out: Path,
    settings: Settings,
    pool: Workers,
    problems: InputProblems,
) -> tuple[SessionCalibration, list[Unit]]:
    """Return the session's cameras in the rig frame and a unit of work for each trial, without
    gauges. Raise BadInput.
    """
    return units_in_rig(session, first_units(session, trials, out, settings), pool, problems)


def first_units(
    session: Session,
    trials: Sequence[Trial],
    out: Path,
    settings: Settings,
    calibration: SessionCalibration | None = None,
) -> list[Unit]:
    """Return a unit of work for each trial, with the cameras in the frame that the board gives.

    calibration: made from the session where it is None. Raises BadInput.
    """
    if calibration is None:
        begin_step("cameras from pictures of the board")
        calibration = calibrate_session(session, out)
    begin_step("what has changed since an earlier run")
    digests = Digests(out)
    units = []
    for trial in trials:
        files = hash_of_files([trial.folder], digests.of)
        units.append(Unit(session, trial, files, calibration, settings, out))
    digests.keep()
    return units


def units_in_rig(
    session: Session, units: Sequence[Unit], pool: Workers, problems: InputProblems
) -> tuple[SessionCalibration, list[Unit]]:
    """Return the cameras in the rig frame of board and free strokes, and the units with these.

    What the board's views contradict is a warning in `problems`. The units have the warnings so far
    that question their truth or estimates. Raises BadInput.
    """
    problems.warnings += units[0].calibration.warnings
    calibration = place_rig(session, units[0].calibration, units, pool, problems)
    placed = []
    for unit in units:
        found = contradictions_of(problems, unit.trial.name)
        settings = unit.settings
        if calibration.placed_by:  # no trial reads the whisker's base again
            settings = settings.with_vision(read_base=False)
        placed.append(
            replace(unit, calibration=calibration, contradictions=found, settings=settings)
        )
    return calibration, placed


def with_gauges(
    units: Sequence[Unit], pool: Workers, problems: InputProblems
) -> tuple[GaugeCalibration | None, Certificate | None, list[Unit]]:
    """Return the session's gauges, their certificate where its own trials calibrated them, and the
    units with the gauges and the drift of the channels.
    """
    rate, force_rate = session_drift(units, pool)
    gauges, certificate = session_gauges(units, rate, pool, problems)
    complete = []
    for unit in units:
        complete.append(replace(unit, drift_rate=rate, force_drift_rate=force_rate, gauges=gauges))
    return gauges, certificate, complete


def session_drift(units: Sequence[Unit], pool: Workers) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the RMS drift per second of the channels (2,) and of the forces (3,), from free
    strokes all over the session; None for forces where no load cell was recorded.
    """
    every = max(1, len(units) // _MOST_DRIFT_STROKES)
    channels = []
    forces = []
    for strokes in pool.run(free_strokes, units[::every], "free strokes"):
        channels += strokes.channels
        forces += strokes.forces
    return drift_rate(channels), drift_rate(forces) if forces else None


def session_gauges(
    units: Sequence[Unit], rate: np.ndarray, pool: Workers, problems: InputProblems
) -> tuple[GaugeCalibration | None, Certificate | None]:
    """Return the session's gauges, and their certificate where its own trials calibrate them.

    Gauges that were brought along come first; else they are fitted to the gauge trials, or to all where
    the settings ask for that. Where the trials cannot fix them there are none, and a warning says why.
    """
    gauges = given_gauges(units[0].session)
    from_all = units[0].settings.gauges_from_all
    chosen = []
    others = []
    for unit in units:
        if not (from_all or unit.trial.purpose == "gauge"):
            others.append(unit)
        elif _has_volts(unit):
            chosen.append(unit)
    if gauges is not None or not chosen:
        return gauges, None
    try:
        certificate = fit_certificate(chosen, rate, pool, problems)
    except Undetermined as refusal:
        parts = [str(refusal), *_lacking_truth(chosen)]
        if any(_has_volts(unit) for unit in others):
            parts.append(_MORE)
        problems.warn(Reason("gauges_undetermined", "; ".join(parts)))
        return None, None
    if from_all:
        return replace(certificate.gauges, source=FROM_ALL), certificate
    return certificate.gauges, certificate


def _has_volts(unit: Unit) -> bool:
    """Return whether the trial's signals are volts of gauges."""
    return read_signals(unit.trial).kind == "V"


def fit_certificate(
    units: Sequence[Unit], rate: np.ndarray, pool: Workers, problems: InputProblems
) -> Certificate:
    """Fit the gauges to the pictures and signals of these trials, and return all that they rest on.

    rate (2,): drift of the channels, V/s. Raises Undetermined where the trials do not fix the
    coefficients, BadInput where a channel is dead, swapped or reversed.
    """
    session = units[0].session
    settings = units[0].settings
    strokes = []  # of each unit
    back = []
    for unit in units:
        signals = read_signals(unit.trial)
        strokes.append(strokes_of(signals, unit.trial, settings))
        check_alive(strokes[-1])
        back += reversals(unit.trial, signals, settings)
    pairs = []
    seen = see_units(units, pool, "gauge trials", problems)
    for unit, trial_seen, trial_strokes in zip(units, seen, strokes):
        pairs += _pairs(unit, trial_seen, trial_strokes, rate, problems)
    return Certificate(
        session.name,
        session.whisker,
        fit_gauges(pairs),
        tuple(pairs),
        tuple(chain.from_iterable(strokes)),
        rate,
        tuple(back),
        roll_sigma_deg=max(unit.trial.follicle_roll_sigma_deg for unit in units),
    )


def _pairs(
    unit: Unit,
    seen: SeenTrial,
    strokes: Sequence[FeltStroke],
    rate: np.ndarray,
    problems: InputProblems,
) -> Iterator[Pairs]:
    """Yield the pairs of each whisk of a trial that has any, and keep why a seen one has none.

    rate (2,): drift of the channels, V/s.
    """
    theta_rad = unit.settings.theta_rad
    for whisk, stroke in zip(seen.whisks, strokes):
        pairs = pairs_of(unit.trial, whisk, stroke, rate, unit.session.whisker, theta_rad)
        if isinstance(pairs, Pairs):
            yield pairs
        elif whisk.deflection is not None:
            code = pairs.codes[0]
            line = f"{unit.trial.name}, whisk {whisk.whisk} calibrates no gauge: {pairs}"
            problems.warn(Reason(code, line), [unit.trial.name])


def _lacking_truth(units: Sequence[Unit]) -> Iterator[str]:
    """Yield a line on each trial with whisks that were evaluated and show no moments, and why."""
    for unit in units:
        seen = kept_seen(unit)
        if seen is None:
            continue
        statuses = [whisk.status for whisk in seen.whisks if whisk.deflection is None]
        lacking = dict.fromkeys(filter(None, statuses))
        if lacking:
            yield f"{unit.trial.name} has no truth: {', '.join(lacking)}"
