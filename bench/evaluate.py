"""The main job: a recorded session in; truth, estimates and their errors out."""

from pathlib import Path

from bench.base.atomic import lock_output
from bench.base.doubts import Doubts
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.friction.curved import curved_whisks, write_curvature
from bench.friction.error_map import write_error_map
from bench.friction.explained import write_explained
from bench.friction.runs import alpha_est_sigma, with_runs
from bench.friction.soft import soft_objects, write_compliance
from bench.friction.tables import friction_of, write_friction
from bench.report.assembly import write_tables
from bench.report.evaluation import Evaluation
from bench.session.check import checked_session
from bench.trials.clocks import shared_doubt, shared_touch, with_shared_touch
from bench.trials.estimates import estimators
from bench.trials.of_session import evaluated, judged, placed_units, with_gauges


def evaluate(session_path: Path, out: Path, settings: Settings, *, workers: int = 1, progress: bool = False) -> int:
    """Evaluate a session into the folder `out`. Returns 0, or 1 where something is doubtful; raises BadInput."""
    estimators(settings.estimators)
    doubts = Doubts()
    session = checked_session(session_path, doubts)
    trials = judged(session)
    with lock_output(out), Workers(workers, progress) as pool:
        calibration, units = placed_units(session, trials, out, settings, pool, doubts)
        gauges, units = with_gauges(units, pool, doubts)
        results = tuple(with_runs(evaluated(units, pool), session.whisker, settings))
        shared = shared_touch(results)
        doubts.notes += filter(None, [shared_doubt(results, shared)])
        results = with_shared_touch(results, shared)
        friction = tuple(friction_of(results, session.whisker, settings.alpha_est_rad))
        write_tables(out, results)
        write_friction(out, results, friction, settings.alpha_est_rad)
        soft = tuple(soft_objects(session, results, settings.alpha_est_rad))
        write_compliance(out, soft)
        alpha = settings.alpha_est_rad, alpha_est_sigma([f.surface for f in friction], settings)
        shapes = tuple(curved_whisks(results, session.whisker, *alpha))
        write_curvature(out, shapes)
        notes = calibration.notes, tuple(doubts.notes)
        return report(Evaluation(session, out, settings, results, friction, gauges, *notes, soft, shapes), pool)


def report(evaluation: Evaluation, pool: Workers) -> int:
    """Figures and summary; returns the exit code. A synthetic session's finished results are scored."""
    from bench.report.against_theta import write_against_theta
    from bench.report.figures import write_figures
    from bench.report.score import score
    from bench.report.summary.page import write_summary

    out, results, alpha_est_rad = evaluation.out, evaluation.results, evaluation.settings.alpha_est_rad
    by_theta, drawn = write_against_theta(out, results)
    figures = [
        *write_figures(evaluation, pool),
        *drawn,
        *write_explained(out, results, evaluation.session.whisker),
        *write_error_map(out, results, evaluation.friction, alpha_est_rad),
    ]
    return write_summary(evaluation, score(evaluation.session, out, evaluation.gauges), figures, by_theta)
