"""The main job: a recorded session in; truth, estimates and their errors out."""

from collections.abc import Callable, Collection, Sequence
from pathlib import Path

from bench.analyses.curved import curved_whisks, write_curvature
from bench.analyses.error_map import write_error_map
from bench.analyses.explained import write_explained
from bench.analyses.friction_tables import write_friction
from bench.analyses.gave import write_gives_way
from bench.analyses.runs import alpha_est_sigma
from bench.analyses.soft import soft_objects, write_compliance
from bench.analyses.tilted import tilted_whisks, write_tilts
from bench.base.atomic import lock_output, write_whole
from bench.base.doubts import Doubts
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.report.assembly import write_tables
from bench.report.evaluation import Evaluation, finished
from bench.report.summary.compose import Summary
from bench.session.inside import check_outside
from bench.session.session import Session
from bench.session.session_check import checked_views
from bench.session.trial import Trial
from bench.trials.estimates import estimators
from bench.trials.exchanged_signals import exchanged_signals
from bench.trials.lost import evaluate_units
from bench.trials.of_session import (
    first_units,
    require_some,
    trials_with_whisks,
    units_in_rig,
    with_gauges,
)
from bench.trials.one_camera import require_camera
from bench.trials.side_by_side import array_units
from bench.trials.unit import Unit

DONE, DOUBTFUL = 0, 1


def evaluate(
    session_path: Path,
    out: Path,
    settings: Settings,
    *,
    workers: int = 1,
    dask: str | None = None,
    progress: bool = False,
    figure_formats: Sequence[str] = (),
    announce: Callable[[str], object] = print,
    verdict_alone: bool = False,
    trials: Collection[str] | None = None,
) -> int:
    """Evaluate a session into the folder `out`. Returns 0, or 1 where something is doubtful; raises BadInput.

    dask: address of a Dask cluster's scheduler, in place of `workers`. figure_formats: of figures for a paper, beside
    the others; announce: is given what is to be seen at a glance, or of that the verdict alone; trials: names of those
    that the session is taken to have; None: all.
    """
    estimators(settings.estimators)
    if dask is not None:
        session_path, out = session_path.absolute(), out.absolute()  # its workers stand elsewhere
    check_outside(out, session_path)
    doubts = Doubts()
    views = checked_views(session_path, doubts, trials, follow_links=settings.follow_links)
    require_camera(views[0], settings)
    recorded = [trials_with_whisks(view) for view in views]
    require_some(recorded[0], settings)
    with lock_output(out), _workers(dask, workers, out, progress) as pool:
        if views[0].base is None:
            units = first_units(views[0], recorded[0], out, settings)
            summary = _evaluated(views[0], units, out, settings, pool, doubts, figure_formats)
        else:
            summary = _array(views, recorded, out, settings, pool, doubts, figure_formats)
    announce("\n".join(summary.verdict) if verdict_alone else summary.on_screen(out))
    return DOUBTFUL if summary.doubtful else DONE


def _array(
    views: Sequence[Session],
    recorded: Sequence[Sequence[Trial]],
    out: Path,
    settings: Settings,
    pool: Workers,
    doubts: Doubts,
    figure_formats: Sequence[str],
) -> Summary:
    """Each whisker of an array as a run of its own, and then what they tell together."""
    from bench.array.array_results import array_record, folder_of, write_array, write_array_record
    from bench.report.score import score_all

    folders = [folder_of(out, view.base.name) for view in views]
    for view, folder, units in zip(
        views, folders, array_units(views, recorded, out, folders, settings, pool)
    ):
        with lock_output(folder):
            _evaluated(view, units, folder, settings, pool, Doubts(), figure_formats)
    write_array_record(out, array_record(views, doubts.notes, score_all(list(zip(views, folders)))))
    return write_array(out)


def _evaluated(
    session: Session,
    units: Sequence[Unit],
    out: Path,
    settings: Settings,
    pool: Workers,
    doubts: Doubts,
    figure_formats: Sequence[str],
) -> Summary:
    """The recorded trials of one whisker's session, a unit each, into the folder `out`, which is locked."""
    calibration, units = units_in_rig(session, units, pool, doubts)
    gauges, certificate, units = with_gauges(units, pool, doubts)
    chosen = [unit for unit in units if settings.takes(unit.trial.name)]
    whole = finished(evaluate_units(chosen, pool), session.whisker, settings)
    doubts.notes += [*filter(None, [whole.doubt]), *exchanged_signals(chosen, whole.results)]
    write_tables(out, whole.results)
    write_friction(out, whole.results, whole.friction, settings.alpha_est_rad)
    alpha = settings.alpha_est_rad, alpha_est_sigma([f.surface for f in whole.friction], settings)
    soft = tuple(soft_objects(session, whole.results, *alpha))
    write_compliance(out, soft)
    write_gives_way(out, whole.results)
    shapes = tuple(curved_whisks(whole.results, session.whisker, *alpha))
    write_curvature(out, shapes)
    tilted = tuple(tilted_whisks(session, whole.results))
    write_tilts(out, tilted)
    recordings = {unit.trial.name: unit.files for unit in chosen}
    found = (
        whole.results,
        whole.friction,
        gauges,
        calibration,
        tuple(doubts.notes),
        recordings,
        soft,
        shapes,
    )
    return report(
        Evaluation(session, out, settings, *found, certificate, tilted), pool, figure_formats
    )


def _workers(dask: str | None, count: int, out: Path, progress: bool) -> Workers:
    """Processes here, or a cluster."""
    if dask is None:
        return Workers(count, progress)
    from bench.base.cluster import Cluster

    return Cluster(dask, out, progress)


def report(evaluation: Evaluation, pool: Workers, figure_formats: Sequence[str] = ()) -> Summary:
    """Figures where they are wanted, report and summary, which is returned. Results of a synthetic session are
    scored."""
    from bench.analyses.against_theta import write_against_theta
    from bench.analyses.back_strokes import both_ways_lines, ways_back, write_both_ways
    from bench.analyses.ledger import write_ledger
    from bench.analyses.moving_objects import moved_whisks, moving_lines, write_moving
    from bench.analyses.single_camera import one_camera_lines, shapes_seen, write_one_camera
    from bench.analyses.table_i_sensors import sensors_worth, write_sensors
    from bench.report.page.write import write_report
    from bench.report.record import record_of, write_record
    from bench.report.score import score
    from bench.report.summary.compose import summary_of

    out, results, alpha_est_rad = (
        evaluation.out,
        evaluation.results,
        evaluation.settings.alpha_est_rad,
    )
    drawn = evaluation.settings.figures
    by_theta, of_theta = write_against_theta(out, results, drawn=drawn)
    needed = write_ledger(out, results, evaluation.session.whisker)
    write_sensors(out, worth := sensors_worth(results, evaluation.friction))
    write_both_ways(out, back := ways_back(results))
    write_one_camera(out, shapes := shapes_seen(results))
    moved = moved_whisks(evaluation.session, results)
    figures = [
        *(_figures(evaluation, pool) if drawn else []),
        *of_theta,
        *write_moving(out, moved, drawn=drawn),
        *write_explained(out, results, evaluation.session.whisker, drawn=drawn),
        *write_error_map(out, results, evaluation.friction, alpha_est_rad, drawn=drawn),
    ]
    scores = score(evaluation.session, out, evaluation.gauges)
    others = (
        tuple(moving_lines(moved)),
        tuple(both_ways_lines(back)),
        tuple(one_camera_lines(shapes)),
    )
    summary = summary_of(evaluation, scores, figures, by_theta, needed, worth, *others)
    record = write_record(out, record_of(evaluation, summary, figures), evaluation.session.path)
    write_report(out, record, results, evaluation.friction)
    if figure_formats:
        from bench.report.paper import write_paper_figures

        write_paper_figures(
            out, results, evaluation.friction, record.whisker, record.settings, figure_formats
        )
    write_whole(out / "summary.txt", summary.text)
    return summary


def _figures(evaluation: Evaluation, pool: Workers) -> list[str]:
    from bench.report.figures import write_figures  # with all of matplotlib

    return write_figures(evaluation, pool)
