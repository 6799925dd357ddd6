"""The main job: a recorded session in; truth, estimates and their errors out."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.base.atomic import lock_output
from bench.base.doubts import Doubts
from bench.base.errors import BadInput
from bench.base.results import hash_of_files, read_result
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.cameras.calibration import calibrate_session
from bench.friction.error_map import write_error_map
from bench.friction.explained import write_explained
from bench.friction.runs import with_runs
from bench.friction.tables import SurfaceFriction, friction_of, write_friction
from bench.gauges.checks import Undetermined, check_alive
from bench.gauges.drift import drift_rate, free_slope
from bench.gauges.felt import strokes_of
from bench.gauges.fit import fit_gauges
from bench.gauges.gauges_file import given_gauges
from bench.gauges.matrix import Gauges
from bench.gauges.readings import Pairs, pairs_of
from bench.report.assembly import write_tables
from bench.session.check import checked_session
from bench.session.session import Session
from bench.session.signals import read_signals
from bench.session.trial import Trial
from bench.trials.estimates import estimators
from bench.trials.placing import place_rig
from bench.trials.unit import Unit, evaluate_unit, see_unit

_MOST_DRIFT_STROKES = 60  # trials; their mean square is then known to a fifth


def evaluate(session_path: Path, out: Path, settings: Settings, *, workers: int = 1, progress: bool = False) -> int:
    """Evaluate a session into the folder `out`. Returns 0, or 1 where something is doubtful; raises BadInput."""
    estimators(settings.estimators)
    doubts = Doubts()
    session = checked_session(session_path, doubts)
    trials = judged(session)
    with lock_output(out), Workers(workers, progress) as pool:
        calibration = calibrate_session(session, out)
        units = [Unit(session, t, hash_of_files([t.folder]), calibration, settings, out) for t in trials]
        calibration = place_rig(session, calibration, units, pool, doubts)
        units = [replace(unit, calibration=calibration) for unit in units]
        rate = session_drift(trials, settings, pool)
        gauges = session_gauges(units, rate, pool, doubts)
        units = [unit.with_gauges(rate, gauges) for unit in units]
        pool.run(evaluate_unit, units, "trials")
        results = with_runs([read_result(unit.path) for unit in units], session.whisker)
        write_tables(out, results)
        figures = write_explained(out, results, session.whisker)
        friction = friction_of(results, session.whisker, settings.alpha_est_rad)
        write_friction(out, results, friction, settings.alpha_est_rad)
        figures += write_error_map(out, results, friction, settings.alpha_est_rad)
        return report(session, out, results, gauges, doubts, calibration.notes, settings, pool, friction, figures)


def judged(session: Session) -> list[Trial]:
    """The trials with whisks: all but those with a weight. Raises BadInput where there is none."""
    trials = [trial for trial in session.trials if trial.purpose != "weight"]
    if not trials:
        raise BadInput("there is no trial to evaluate", file="trials")
    return trials


def session_drift(trials: Sequence[Trial], settings: Settings, pool: Workers) -> np.ndarray:
    """RMS drift (2,) of the channels per second, from free strokes all over the session."""
    every = max(1, len(trials) // _MOST_DRIFT_STROKES)
    tasks = [(trial, settings) for trial in trials[::every]]
    return drift_rate([slope for slopes in pool.run(_free_slopes, tasks, "free strokes") for slope in slopes])


def _free_slopes(task: tuple[Trial, Settings]) -> list:
    trial, settings = task
    slopes = [free_slope(stroke) for stroke in strokes_of(read_signals(trial), trial, settings)]
    return [slope for slope in slopes if slope is not None]


def session_gauges(units: Sequence[Unit], rate, pool: Workers, doubts: Doubts) -> Gauges | None:
    """Gauges as brought along, else from the gauge trials; None, and a note, where these cannot fix them."""
    given = given_gauges(units[0].session)
    trials = [unit for unit in units if unit.trial.purpose == "gauge" and read_signals(unit.trial).kind == "V"]
    if given is not None or not trials:
        return given
    pool.run(see_unit, trials, "gauge trials")
    try:
        return fit_gauges([pairs for unit in trials for pairs in _pairs(unit, rate)])
    except Undetermined as reason:
        doubts.note(str(reason))
        return None


def _pairs(unit: Unit, rate) -> list[Pairs]:
    """Pairs of moment and volts of a gauge trial's whisks."""
    strokes, whisker = strokes_of(read_signals(unit.trial), unit.trial, unit.settings), unit.session.whisker
    check_alive(strokes)
    found = [
        pairs_of(unit.trial, seen, stroke, rate, whisker, unit.settings.theta_rad)
        for seen, stroke in zip(see_unit(unit)["whisks"], strokes)
    ]
    return [pairs for pairs in found if pairs is not None]


def report(
    session: Session,
    out: Path,
    results: list[dict],
    gauges: Gauges | None,
    doubts: Doubts,
    cameras: Sequence[str],
    settings: Settings,
    pool: Workers,
    friction: Sequence[SurfaceFriction],
    figures: Sequence[str],
) -> int:
    """Figures and summary; returns the exit code. A synthetic session's finished results are scored."""
    from bench.report.figures import write_figures
    from bench.report.score import score
    from bench.report.summary import write_summary

    figures = [*write_figures(session, out, results, settings, pool), *figures]
    scores = score(session, out, gauges)
    return write_summary(session, out, results, gauges, doubts.notes, cameras, settings, scores, figures, friction)
