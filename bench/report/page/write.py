"""The page put together and written, with methods.md and results.bib beside it."""

import json
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from bench.analyses.friction_tables import SurfaceFriction
from bench.base.atomic import lock_output, write_whole
from bench.base.results import plain
from bench.base.settings import Seeing
from bench.base.statuses import cure_of
from bench.records.trial_result import TrialResult
from bench.report.estimator_accuracy import accuracies, truth_uncertainty
from bench.report.evaluation import finished
from bench.report.page.cards import card, cells, columns, is_flagged
from bench.report.page.combined_whisks import together
from bench.report.page.drawings import Drawings, draw
from bench.report.page.gauge_tables import gauge_part
from bench.report.page.methods import bibliography, methods
from bench.report.page.rig_in_3d import ELLIPSOID_FACTOR, scene
from bench.report.page.words import number, rows_of
from bench.report.pooled import read_run
from bench.report.record import read_record
from bench.report.run_facts import CameraFacts, RunRecord

REPORT, METHODS, BIBLIOGRAPHY = "report.html", "methods.md", "results.bib"
_IN_FIGURES = (
    "Truth",
    "Error of d_x",
    "Doubtful",
    "Cameras",
    "Gauges",
    "Taken as exact",
    "Only what",
    "Sensors",
)


def report_again(out: Path, figure_formats: Sequence[str] = ()) -> list[Path]:
    """The report of an evaluated run, from its results alone, and its figures for a paper in these formats. The paths
    written. Raises BadInput where it is none."""
    record = read_record(out)
    whole = finished(read_run(out), record.whisker, record.settings)
    of_run = whole.results, whole.friction
    with lock_output(out):
        figures = []
        if figure_formats:
            from bench.report.paper import write_paper_figures  # with all of matplotlib

            figures = write_paper_figures(
                out, *of_run, record.whisker, record.settings, figure_formats
            )
        return [*write_report(out, record, *of_run), *figures]


def write_report(
    out: Path,
    record: RunRecord,
    results: Sequence[TrialResult],
    friction: Sequence[SurfaceFriction],
) -> list[Path]:
    """report.html, methods.md and results.bib, each whole. The paths written; the same results give the same bytes."""
    written = {
        REPORT: page(out, record, results, friction),
        METHODS: methods(record, results, friction),
        BIBLIOGRAPHY: bibliography(record),
    }
    for name, text in written.items():
        write_whole(out / name, text)
    return [out / name for name in written]


def page(
    out: Path,
    record: RunRecord,
    results: Sequence[TrialResult],
    friction: Sequence[SurfaceFriction],
) -> str:
    """The page as HTML. out: where its pictures and the tables of whisks together are taken from."""
    rows = rows_of(results)
    estimators = list(dict.fromkeys(a.estimator for row in rows for a in row.felt.estimates))
    accuracy = accuracies(results)
    drawn = scene(record, rows)
    drawings = Drawings()
    if record.settings.figures:
        drawings = draw(record, rows, results, friction)
    at = {(row.trial, row.seen.whisk): row for row in rows}
    return (
        _environment()
        .get_template("report.html.j2")
        .render(
            record=record,
            rows=[(row, cells(row, estimators), is_flagged(row)) for row in rows],
            columns=columns(estimators),
            cards=[card(row, out, len(rows)) for row in rows],
            accuracies=[(one, at.get(one.worst_at)) for one in accuracy],
            truth=truth_uncertainty(results),
            doubts=[
                (line, cure_of(codes)) for line, codes in zip(record.doubts, record.doubt_codes)
            ],
            drawings=drawings,
            together=together(out),
            scene=as_script(drawn),
            scene_known=bool(drawn["cameras"] or drawn["whisks"]),
            settings=[
                (f.name, _setting(getattr(record.settings, f.name)))
                for f in fields(record.settings)
            ],
            factor=ELLIPSOID_FACTOR,
            cameras=[(camera, _distance(camera)) for camera in record.cameras],
            gauges=gauge_part(record.gauges, rows),
            others=[s for s in record.sections if not s.title.startswith(_IN_FIGURES)],
            citation=bibliography(record),
            number=number,
        )
        + "\n"
    )


def _setting(value: object) -> str:
    """A setting as a reader takes it."""
    if isinstance(value, Seeing):
        return value.name
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return ", ".join(map(str, value)) or "none"
    return (
        "by default" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
    )


def _distance(camera: CameraFacts) -> float:
    """From the camera's centre to the whisker's base, mm."""
    return float((camera.T_camera_rig[:, 3] @ camera.T_camera_rig[:, 3]) ** 0.5)


def as_script(value: object) -> Markup:
    """JSON that may stand within a script: no "<" can end it, and what is missing is null."""
    text = json.dumps(plain(value), ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return Markup(
        text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
    )


def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("bench.report", "page"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
