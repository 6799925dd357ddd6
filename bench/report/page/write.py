"""The page, put together and written with methods.md and results.bib."""

import json
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from bench.analyses.analysis import EvaluatedRun, PageTable
from bench.analyses.catalogue import ANALYSES
from bench.base.atomic import lock_output, write_whole
from bench.base.results import plain
from bench.base.settings import Seeing, Settings
from bench.base.statuses import cure_of
from bench.report.page.cards import card, cells, columns, is_flagged
from bench.report.page.drawings import Drawings, draw
from bench.report.page.gauge_tables import gauge_part
from bench.report.page.methods import bibliography, methods
from bench.report.page.rig_in_3d import ELLIPSOID_FACTOR, scene
from bench.report.page.words import WhiskRow, by_whisk, number, rows_of
from bench.report.run_facts import CameraFacts, RunRecord
from bench.report.run_folder import read_run

REPORT = "report.html"
METHODS = "methods.md"
BIBLIOGRAPHY = "results.bib"
# Codes of sections of the summary whose content has a place of its own on the page.
_WITH_OWN_PLACE = {
    "truth",
    "errors",
    "warnings",
    "cameras",
    "gauges",
    "givens",
    "ledger",
    "sensors",
}
# Files of the tables that begin the part on whisks together; others come in the order of ANALYSES.
_TABLES_FIRST = ("surfaces.csv", "tilts.csv")


def report_again(out: Path, figure_formats: Sequence[str] = ()) -> list[Path]:
    """Write the report of an evaluated run from its results alone, and its figures for a paper.

    figure_formats: of these. Returns the paths written. Raises BadInput where `out` is no such run.
    """
    record, run = read_run(out)
    with lock_output(out):
        figures = []
        if figure_formats:
            from bench.report.paper import write_paper_figures  # with all of matplotlib

            figures = write_paper_figures(out, run, figure_formats)
        return [*write_report(out, record, run), *figures]


def write_report(out: Path, record: RunRecord, run: EvaluatedRun) -> list[Path]:
    """Write report.html, methods.md and results.bib, each whole; return their paths.

    The same results give the same bytes.
    """
    written = {
        REPORT: page(out, record, run),
        METHODS: methods(record, run),
        BIBLIOGRAPHY: bibliography(record),
    }
    for name, text in written.items():
        write_whole(out / name, text)
    return [out / name for name in written]


def page(out: Path, record: RunRecord, run: EvaluatedRun) -> str:
    """Return the page as HTML. out: the folder of its pictures and of the analyses' tables."""
    rows = rows_of(run.results)
    drawings = draw(record, rows, run) if record.settings.figures else Drawings()
    template = _environment().get_template("report.html.j2")
    text = template.render(
        **_of_whisks(out, rows),
        **_of_run(record, run, rows),
        **_of_scene(record, rows),
        record=record,
        run=run,
        drawings=drawings,
        page_tables=page_tables(out),
        citation=bibliography(record),
        number=number,
    )
    return text + "\n"


def _of_whisks(out: Path, rows: Sequence[WhiskRow]) -> dict[str, object]:
    """Return what the template shows of each whisk: the rows of the table, its head, the cards."""
    estimators: list[str] = []  # in the order in which they first come
    for row in rows:
        for estimate in row.felt.estimates:
            if estimate.estimator not in estimators:
                estimators.append(estimate.estimator)
    lines = []
    cards = []
    for row in rows:
        lines.append((row, cells(row, estimators), is_flagged(row)))
        cards.append(card(row, out, len(rows)))
    return {"rows": lines, "columns": columns(estimators), "cards": cards}


def _of_run(record: RunRecord, run: EvaluatedRun, rows: Sequence[WhiskRow]) -> dict[str, object]:
    """Return what the template shows of the run as a whole: errors, warnings, settings, gauges."""
    row_of = by_whisk(rows)
    accuracies = []
    for one in run.accuracy.estimators:
        accuracies.append((one, row_of.get(one.worst_at)))
    settings = []
    for field in fields(Settings):
        settings.append((field.name, _setting(getattr(record.settings, field.name))))
    return {
        "accuracies": accuracies,
        "truth": run.accuracy.truth,
        "warnings": list(zip(record.warnings, map(cure_of, record.warning_codes))),
        "settings": settings,
        "gauges": gauge_part(record.gauges, rows),
        "others": [one for one in record.sections if one.code not in _WITH_OWN_PLACE],
    }


def _of_scene(record: RunRecord, rows: list[WhiskRow]) -> dict[str, object]:
    """Return what the template shows of the rig in three dimensions, and the cameras' distances, mm."""
    drawn = scene(record, rows)
    return {
        "scene": as_script(drawn),
        "scene_known": bool(drawn["cameras"] or drawn["whisks"]),
        "factor": ELLIPSOID_FACTOR,
        "cameras": [(camera, _distance(camera)) for camera in record.cameras],
    }


def page_tables(out: Path) -> list[PageTable]:
    """Return the tables on whisks together that have rows. Raises BadInput if a file is damaged."""
    shown = []
    for analysis in ANALYSES:
        table = analysis.page_table(out)
        if table is not None and table.rows:
            shown.append(table)

    def place(table: PageTable) -> int:
        """Return the place of a table's file in `_TABLES_FIRST`, or one behind all of these."""
        if table.file in _TABLES_FIRST:
            return _TABLES_FIRST.index(table.file)
        return len(_TABLES_FIRST)

    return sorted(shown, key=place)


def _setting(value: object) -> str:
    """Return a setting as a reader takes it."""
    if value is None:
        return "by default"
    if isinstance(value, Seeing):
        return value.name
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return ", ".join(map(str, value)) or "none"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _distance(camera: CameraFacts) -> float:
    """Return the distance from the camera's centre to the whisker's base, mm."""
    return float((camera.T_camera_rig[:, 3] @ camera.T_camera_rig[:, 3]) ** 0.5)


def as_script(value: object) -> Markup:
    """Return JSON that may stand within a script: no "<" can end it, a missing number is null."""
    text = json.dumps(plain(value), ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return Markup(
        text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
    )


def _environment() -> Environment:
    """Return what renders the page's templates."""
    return Environment(
        loader=PackageLoader("bench.report", "page"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
