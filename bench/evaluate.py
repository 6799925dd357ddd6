"""The main job: a recorded session in; truth, estimates and their errors out."""

from collections.abc import Callable, Sequence
from pathlib import Path

from bench.base.atomic import lock_output, write_whole
from bench.base.doubts import Doubts
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.friction.error_map import write_error_map
from bench.friction.explained import write_explained
from bench.friction.tables import write_friction
from bench.report.assembly import write_tables
from bench.report.evaluation import Evaluation, finished
from bench.report.summary.page import Summary
from bench.session.check import checked_session
from bench.trials.estimates import estimators
from bench.trials.of_session import evaluated, judged, placed_units, with_gauges

DONE, DOUBTFUL = 0, 1


def evaluate(
    session_path: Path,
    out: Path,
    settings: Settings,
    *,
    workers: int = 1,
    progress: bool = False,
    figure_formats: Sequence[str] = (),
    announce: Callable[[str], object] = print,
) -> int:
    """Evaluate a session into the folder `out`. Returns 0, or 1 where something is doubtful; raises BadInput.

    figure_formats: of figures for a paper, beside the others; announce: is given the summary.
    """
    estimators(settings.estimators)
    doubts = Doubts()
    session = checked_session(session_path, doubts)
    trials = judged(session)
    with lock_output(out), Workers(workers, progress) as pool:
        calibration, units = placed_units(session, trials, out, settings, pool, doubts)
        gauges, units = with_gauges(units, pool, doubts)
        whole = finished(evaluated(units, pool), session.whisker, settings)
        doubts.notes += filter(None, [whole.doubt])
        write_tables(out, whole.results)
        write_friction(out, whole.results, whole.friction, settings.alpha_est_rad)
        recordings = {unit.trial.name: unit.files for unit in units}
        found = whole.results, whole.friction, gauges, calibration, tuple(doubts.notes), recordings
        summary = report(Evaluation(session, out, settings, *found), pool, figure_formats)
    announce(summary.text.rstrip())
    return DOUBTFUL if summary.doubtful else DONE


def report(evaluation: Evaluation, pool: Workers, figure_formats: Sequence[str] = ()) -> Summary:
    """Figures, report and summary, which is returned. A synthetic session's finished results are scored."""
    from bench.report.figures import write_figures
    from bench.report.page.write import write_report
    from bench.report.paper import write_paper_figures
    from bench.report.record import record_of, write_record
    from bench.report.score import score
    from bench.report.summary.page import summary_of

    out, results, alpha_est_rad = evaluation.out, evaluation.results, evaluation.settings.alpha_est_rad
    figures = [
        *write_figures(evaluation, pool),
        *write_explained(out, results, evaluation.session.whisker),
        *write_error_map(out, results, evaluation.friction, alpha_est_rad),
    ]
    summary = summary_of(evaluation, score(evaluation.session, out, evaluation.gauges), figures)
    record = write_record(out, record_of(evaluation, summary, figures), evaluation.session.path)
    write_report(out, record, results, evaluation.friction)
    write_paper_figures(out, results, evaluation.friction, record.whisker, record.settings, figure_formats)
    write_whole(out / "summary.txt", summary.text)
    return summary
