"""The main job: a recorded session in; truth, estimates and their errors out."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from bench.base.atomic import lock_output
from bench.base.doubts import Doubts
from bench.base.results import hash_of_files, read_result
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.cameras.calibration import calibrate_session
from bench.friction.error_map import write_error_map
from bench.friction.explained import write_explained
from bench.friction.runs import with_runs
from bench.friction.tables import SurfaceFriction, friction_of, write_friction
from bench.gauges.matrix import Gauges
from bench.report.assembly import write_tables
from bench.session.check import checked_session
from bench.session.session import Session
from bench.trials.estimates import estimators
from bench.trials.of_session import judged, session_drift, session_gauges
from bench.trials.placing import place_rig
from bench.trials.unit import Unit, evaluate_unit


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
        results = with_runs([read_result(unit.path) for unit in units], session.whisker, settings)
        write_tables(out, results)
        figures = write_explained(out, results, session.whisker)
        friction = friction_of(results, session.whisker, settings.alpha_est_rad)
        write_friction(out, results, friction, settings.alpha_est_rad)
        figures += write_error_map(out, results, friction, settings.alpha_est_rad)
        return report(session, out, results, gauges, doubts, calibration.notes, settings, pool, friction, figures)


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
