"""The main job: a recorded session in; truth, estimates and their errors out."""

from collections.abc import Iterable, Sequence
from itertools import islice
from pathlib import Path

from bench.base.atomic import lock_output
from bench.base.doubts import Doubts
from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.friction.error_map import write_error_map
from bench.friction.explained import write_explained
from bench.friction.runs import with_runs
from bench.friction.soft import soft_objects, write_compliance
from bench.friction.tables import friction_of, write_friction
from bench.report.assembly import write_tables
from bench.report.evaluation import Evaluation
from bench.session.check import checked_session
from bench.session.inside import check_outside
from bench.session.trial import Trial
from bench.trials.clocks import shared_doubt, shared_touch, with_shared_touch
from bench.trials.estimates import estimators
from bench.trials.of_session import evaluated, judged, placed_units, with_gauges

_MOST_NAMED = 8


def evaluate(session_path: Path, out: Path, settings: Settings, *, workers: int = 1, progress: bool = False) -> int:
    """Evaluate a session into the folder `out`. Returns 0, or 1 where something is doubtful; raises BadInput."""
    estimators(settings.estimators)
    check_outside(out, session_path)
    doubts = Doubts()
    session = checked_session(session_path, doubts)
    trials = judged(session)
    _require_some(trials, settings)
    with lock_output(out), Workers(workers, progress) as pool:
        calibration, units = placed_units(session, trials, out, settings, pool, doubts)
        gauges, units = with_gauges(units, pool, doubts)
        chosen = [unit for unit in units if settings.takes(unit.trial.name)]
        results = tuple(with_runs(evaluated(chosen, pool), session.whisker, settings))
        shared = shared_touch(results)
        doubts.notes += filter(None, [shared_doubt(results, shared)])
        results = with_shared_touch(results, shared)
        friction = tuple(friction_of(results, session.whisker, settings.alpha_est_rad))
        write_tables(out, results)
        write_friction(out, results, friction, settings.alpha_est_rad)
        soft = tuple(soft_objects(session, results, settings.alpha_est_rad))
        write_compliance(out, soft)
        notes = calibration.notes, tuple(doubts.notes)
        return report(Evaluation(session, out, settings, results, friction, gauges, *notes, soft), pool)


def _require_some(trials: Sequence[Trial], settings: Settings) -> None:
    """Raises BadInput where the settings take none of the trials, or ask a camera that has no pictures of any."""
    if not any(settings.takes(trial.name) for trial in trials):
        names = _some(trial.name for trial in trials)
        raise BadInput(f"--trials {settings.trials}: no trial has such a name; there are {names}")
    there = dict.fromkeys(name for trial in trials for name in trial.camera_sources)
    for name in settings.seeing.cameras:
        if name not in there:
            raise BadInput(f"cameras of {settings.seeing.name}: there is no camera {name}; there are {_some(there)}")


def _some(names: Iterable[str]) -> str:
    first = list(islice(names, _MOST_NAMED + 1))
    return ", ".join([*first[:_MOST_NAMED], *["…"] * (len(first) > _MOST_NAMED)])


def report(evaluation: Evaluation, pool: Workers) -> int:
    """Figures where they are wanted, and summary; returns the exit code. Results of a synthetic session are scored."""
    from bench.report.against_theta import write_against_theta
    from bench.report.figures import write_figures
    from bench.report.score import score
    from bench.report.summary.page import write_summary

    out, results, alpha_est_rad = evaluation.out, evaluation.results, evaluation.settings.alpha_est_rad
    drawn = evaluation.settings.figures
    by_theta, of_theta = write_against_theta(out, results, drawn=drawn)
    figures = [
        *(write_figures(evaluation, pool) if drawn else []),
        *of_theta,
        *write_explained(out, results, evaluation.session.whisker, drawn=drawn),
        *write_error_map(out, results, evaluation.friction, alpha_est_rad, drawn=drawn),
    ]
    return write_summary(evaluation, score(evaluation.session, out, evaluation.gauges), figures, by_theta)
