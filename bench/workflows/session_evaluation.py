"""The main job: a recorded session in; truth, estimates and their errors out."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bench.analyses.catalogue import ANALYSES
from bench.base.atomic import lock_output, write_whole
from bench.base.exit_codes import DONE, WITH_WARNINGS
from bench.base.input_problems import InputProblems
from bench.base.progress import begin_step, count_parts
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.report.evaluation import Evaluation, evaluated_run
from bench.report.summary.compose import Summary
from bench.report.whisk_rows import write_tables
from bench.session.inside import check_outside
from bench.session.session import Session
from bench.session.session_check import checked_views, trials_with_whisks
from bench.session.trial import Trial
from bench.trials.contradictions import contradictions_alone
from bench.trials.estimates import own_estimators
from bench.trials.exchanged_signals import exchanged_pictures, exchanged_signals
from bench.trials.lost import evaluate_units
from bench.trials.of_session import first_units, require_some, units_in_rig, with_gauges
from bench.trials.one_camera import require_camera
from bench.trials.side_by_side import array_units
from bench.trials.unit import Unit


def evaluate(
    session_path: Path,
    out: Path,
    settings: Settings,
    *,
    workers: int = 1,
    dask: str | None = None,
    figure_formats: Sequence[str] = (),
    announce: Callable[[str], object] = print,
    verdict_alone: bool = False,
    trials: Collection[str] | None = None,
) -> int:
    """Evaluate a session into the folder `out`. Return 0, or 1 with warnings.

    dask: address of a Dask cluster's scheduler, in place of `workers`. figure_formats: of figures for a
    paper, drawn besides the others. announce: is given what is to be seen at a glance, or of that the
    verdict alone. trials: names of those that the session is taken to have; None: all. Raise BadInput.
    """
    own_estimators(settings.estimators)
    if dask is not None:  # its workers stand elsewhere
        session_path = session_path.absolute()
        out = out.absolute()
    check_outside(out, session_path)
    problems = InputProblems()
    views = checked_views(session_path, problems, trials, follow_links=settings.follow_links)
    require_camera(views[0], settings)
    recorded = [trials_with_whisks(view) for view in views]
    require_some(recorded[0], settings)
    with lock_output(out), _workers(dask, workers, out) as pool:
        job = _Job(out, settings, pool, problems, figure_formats)
        if views[0].base is None:
            units = first_units(views[0], recorded[0], out, settings)
            summary = _evaluate_whisker(views[0], units, job)
        else:
            summary = _evaluate_array(views, recorded, job)
    announce("\n".join(summary.verdict) if verdict_alone else summary.on_screen(out))
    return WITH_WARNINGS if summary.warnings else DONE


@dataclass(frozen=True, eq=False)
class _Job:
    """The folder that an evaluation fills, which is locked, its settings, and the processes that work on it.

    problems: what has been found so far. figure_formats: of figures for a paper.
    """

    out: Path
    settings: Settings
    pool: Workers
    problems: InputProblems
    figure_formats: Sequence[str]


def _evaluate_array(
    views: Sequence[Session], recorded: Sequence[Sequence[Trial]], job: _Job
) -> Summary:
    """Evaluate each whisker of an array as a run of its own, and then all whiskers together."""
    from bench.array.array_results import array_record, folder_of, write_array, write_array_record
    from bench.report.score import score_all

    folders = [folder_of(job.out, view.base.name) for view in views]
    units_of_views = array_units(views, recorded, job.out, folders, job.settings, job.pool)
    for view, folder, units in zip(views, folders, units_of_views):
        carried = contradictions_alone(job.problems)
        with lock_output(folder):
            _evaluate_whisker(view, units, replace(job, out=folder, problems=carried))
    scores = score_all(list(zip(views, folders)))
    write_array_record(job.out, array_record(views, job.problems.warnings, scores))
    return write_array(job.out)


def _evaluate_whisker(session: Session, units: Sequence[Unit], job: _Job) -> Summary:
    """Evaluate the trials of one whisker's session, a unit each."""
    settings = job.settings
    problems = job.problems
    calibration, units = units_in_rig(session, units, job.pool, problems)
    gauges, certificate, units = with_gauges(units, job.pool, problems)
    chosen = [unit for unit in units if settings.takes(unit.trial.name)]
    run = evaluated_run(evaluate_units(chosen, job.pool), session.whisker, settings, session)
    if run.touch_warning:
        problems.warnings.append(run.touch_warning)
    problems.warnings += exchanged_signals(chosen, run.results)
    problems.warnings += exchanged_pictures(chosen, run.results)
    evaluation = Evaluation(
        run,
        job.out,
        gauges=gauges,
        certificate=certificate,
        calibration=calibration,
        warnings=tuple(problems.warnings),
        recordings={unit.trial.name: unit.files for unit in chosen},
    )
    return report(evaluation, job.pool, job.figure_formats)


def _workers(dask: str | None, count: int, out: Path) -> Workers:
    """Return processes here, or a cluster."""
    if dask is None:
        return Workers(count)
    from bench.base.cluster import Cluster

    return Cluster(dask, out)


def report(evaluation: Evaluation, pool: Workers, figure_formats: Sequence[str] = ()) -> Summary:
    """Write tables, figures where they are wanted, report and summary; return the summary.

    Results of a synthetic session are scored.
    """
    from bench.report.page.write import write_report
    from bench.report.record import record_of, write_record
    from bench.report.score import score
    from bench.report.summary.compose import summary_of

    out = evaluation.out
    run = evaluation.run
    write_tables(out, run.results)
    for analysis in count_parts(ANALYSES, "tables on whisks together", len(ANALYSES)):
        analysis.write(out, run.found(analysis))
    figures = []
    if run.settings.figures:
        from bench.report.trial_figures import draw_trials  # with all of matplotlib

        figures += draw_trials(run, out, pool)
        for analysis in count_parts(ANALYSES, "figures on whisks together", len(ANALYSES)):
            figures += analysis.draw(out, run)
    begin_step("report")
    scores = score(run.session, out, evaluation.gauges)
    summary = summary_of(evaluation, scores, figures)
    written = record_of(evaluation, summary, figures)
    record = write_record(out, written, run.session.path)
    write_report(out, record, run)
    if figure_formats:
        from bench.report.paper import write_paper_figures

        write_paper_figures(out, run, figure_formats)
    write_whole(out / "summary.txt", summary.text)
    return summary
