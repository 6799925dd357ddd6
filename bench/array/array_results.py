"""The results of an array's whiskers put together: tables, figure, summary and page, from their runs'
folders alone."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from bench.analyses.analysis import EvaluatedRun
from bench.analyses.estimator_accuracy import RunAccuracy
from bench.array.array_page import write_page
from bench.array.cloud import ContactPoint, Mount, contacts
from bench.array.contour import CONTOUR, TrialContour, contours, write_contours
from bench.array.exchanged_whiskers import exchanged
from bench.array.shape_verdict import SURFACE_POINTS, surface_lines, surface_verdict, write_surface
from bench.array.size import SIZE, FeltSize, fit_sizes, size_lines, write_sizes
from bench.array.surface import ObjectSurface, seen_surface, stated_surface
from bench.base.atomic import write_whole
from bench.base.errors import BadInput
from bench.base.tables import WHISKER
from bench.records.record_file import read_record_file, write_record_file
from bench.records.trial_result import TrialResult, whisks
from bench.report.record import ARRAY, RUNS
from bench.report.run_facts import RunRecord, Section
from bench.report.run_folder import read_run
from bench.report.summary.compose import SCORE, WARNINGS, Summary
from bench.report.summary.verdict import verdict
from bench.report.whisk_rows import estimate_rows, whisk_rows
from bench.report.whisk_tables import ESTIMATES, WHISKS
from bench.session.session import Base, Session
from vision.geometry import counted

ARRAY_WHISKS = replace(WHISKS, columns=(WHISKER, *WHISKS.columns))
ARRAY_ESTIMATES = replace(ESTIMATES, columns=(WHISKER, *ESTIMATES.columns))
_OF_ALL = (ARRAY_WHISKS, ARRAY_ESTIMATES, SURFACE_POINTS, SIZE, CONTOUR)
# Of all whiskers, by name.
TABLES = {table.name: table for table in _OF_ALL}


@dataclass(frozen=True, eq=False)
class ArrayRecord:
    """All that array.json holds of an array, without its whiskers' runs.

    session_warnings: about the session as a whole. scores: of all whiskers against the truth files of a
    synthetic session. surfaces: objects as the manifests state them, by trial. verdict, warnings:
    as the summary has them, once it is made.
    """

    session: str
    bases: tuple[Base, ...]
    session_warnings: tuple[str, ...] = ()
    scores: tuple[str, ...] = ()
    surfaces: dict[str, ObjectSurface] = field(default_factory=dict)
    verdict: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class WhiskerRun:
    """One whisker of the array: its base, and its run."""

    base: Base
    record: RunRecord
    run: EvaluatedRun

    @classmethod
    def read(cls, base: Base, folder: Path) -> "WhiskerRun":
        """Read a whisker's run from its folder. Raises BadInput where there is none."""
        return cls(base, *read_run(folder))

    @property
    def results(self) -> Sequence[TrialResult]:
        """Return the results of its trials."""
        return self.run.results

    @property
    def mount(self) -> Mount:
        """Return the base, wire and friction angle that place its contacts."""
        settings = self.record.settings
        sigma_rad = self.run.alpha_est_sigma_rad
        return Mount(self.base, self.record.whisker.wire, settings.alpha_est_rad, sigma_rad)


def folder_of(out: Path, whisker: str) -> Path:
    """Return the folder of a whisker's run in the array's OUT."""
    return out / RUNS / whisker


def array_record(
    views: Sequence[Session], warnings: Sequence[str], scores: Sequence[str]
) -> ArrayRecord:
    """Return the record of an array's views, one a whisker."""
    surfaces = {}
    for trial in views[0].trials:
        surface = stated_surface(trial)
        if surface is not None:
            surfaces[trial.name] = surface
    bases = tuple(view.base for view in views)
    return ArrayRecord(views[0].whole_name, bases, tuple(warnings), tuple(scores), surfaces)


def write_array_record(out: Path, record: ArrayRecord) -> None:
    """Write array.json, whole."""
    write_record_file(out / ARRAY, record)


def read_array_record(out: Path) -> ArrayRecord:
    """Read the array of a folder. Raises BadInput where it is none, or of another version."""
    if not is_array(out):
        raise BadInput(f"is no array's run (there is no {ARRAY} in it)", file=out)
    return read_record_file(ArrayRecord, out / ARRAY)


def is_array(out: Path) -> bool:
    """Return whether a folder holds the runs of several whiskers."""
    return (out / ARRAY).is_file()


def write_array(out: Path) -> Summary:
    """Write tables, figures, report.html and summary.txt of an array's runs, each whole.

    Raises BadInput where a run cannot be read.
    """
    record = read_array_record(out)
    runs = [WhiskerRun.read(base, folder_of(out, base.name)) for base in record.bases]
    _write_tables(out, runs)
    cloud = _contacts_of_all(record, runs)
    write_surface(out, cloud)
    sizes = fit_sizes(cloud, record.surfaces)
    write_sizes(out, sizes)
    enclosed = contours(cloud, record.surfaces)
    write_contours(out, enclosed)
    summary = _summarise(record, runs, cloud, _shape_sections(cloud, sizes, enclosed))
    figures = []
    if runs[0].record.settings.figures:
        from bench.array.figure import write_figures  # with all of matplotlib

        figures = write_figures(out, cloud, _seen_surfaces(runs) | record.surfaces)
    write_page(out, record.session, summary, [(run.base.name, run.record) for run in runs], figures)
    write_whole(out / "summary.txt", summary.text)
    write_array_record(out, replace(record, verdict=summary.verdict, warnings=summary.warnings))
    return summary


def _contacts_of_all(record: ArrayRecord, runs: Sequence[WhiskerRun]) -> list[ContactPoint]:
    """Return the contacts of all whiskers."""
    cloud = []
    for run in runs:
        cloud += contacts(run.mount, run.results, record.surfaces)
    return cloud


def _seen_surfaces(runs: Sequence[WhiskerRun]) -> dict[str, ObjectSurface]:
    """Return the bar of each trial, from the first whisk that shows it."""
    surfaces = {}
    for run in runs:
        for result, seen, _ in whisks(run.results):
            surface = seen_surface(seen, result.seen.bar_radius_mm, run.mount.wire, run.base)
            if surface is not None:
                surfaces.setdefault(result.trial.name, surface)
    return surfaces


def _write_tables(out: Path, runs: Sequence[WhiskerRun]) -> None:
    """Write whisks.csv and estimates.csv of all whiskers, each row with its whisker."""
    for table, rows_of in ((ARRAY_WHISKS, whisk_rows), (ARRAY_ESTIMATES, estimate_rows)):
        rows = []
        for run in runs:
            rows += [{"whisker": run.base.name} | row for row in rows_of(run.results)]
        table.write(out, rows)


def _named_by_whisker(result: TrialResult, run: WhiskerRun) -> TrialResult:
    """Return a result whose trial's name says which whisker it is of: all whiskers share trials."""
    trial = replace(result.trial, name=f"{result.trial.name}, {run.base.name}")
    return replace(result, trial=trial)


def _shape_sections(
    cloud: Sequence[ContactPoint], sizes: Sequence[FeltSize], enclosed: Sequence[TrialContour]
) -> tuple[Section, ...]:
    """Return the sections on the object's shape: by contacts, as a size, and by touch alone."""
    surface_title = "Surface: contacts from the object, mm (surface.csv)"
    size_title = "Size of the object by (10), its place free (size.csv)"
    contour_title = "Contour by touch alone (contour.csv)"
    return (
        Section("surface", surface_title, tuple(surface_lines(cloud))),
        Section("size", size_title, tuple(size_lines(sizes))),
        Section("contour", contour_title, tuple(one.line() for one in enclosed)),
    )


def _sections(record, shape, first_lines, warnings) -> tuple[Section, ...]:
    """Return the sections that have lines, in their order.

    shape: see `_shape_sections`. first_lines: a verdict a whisker. warnings: see `_warning_lines`.
    """
    files = f"report.html, whisks.csv, estimates.csv, surface.csv, size.csv, {RUNS}/<name>/"
    sections = [
        Section("whiskers", "Whiskers", tuple(first_lines)),
        *shape,
        Section("warnings", WARNINGS, tuple(warnings)),
        Section("score", SCORE, record.scores),
        Section("files", "Files", (files,)),
    ]
    return tuple(section for section in sections if section.lines)


def _warning_lines(record: ArrayRecord, runs: Sequence[WhiskerRun]) -> list[str]:
    """Return the warnings about the session, about exchanged whiskers, and about each run."""
    by_whisker = {run.base.name: run.results for run in runs}
    lines = [*record.session_warnings, *exchanged(by_whisker)]
    for run in runs:
        lines += [f"{run.base.name}: {line}" for line in run.record.warnings]
    return lines


def _summarise(
    record: ArrayRecord,
    runs: Sequence[WhiskerRun],
    cloud: Sequence[ContactPoint],
    shape: Sequence[Section],
) -> Summary:
    """Return verdict and sections of the array's summary; sections without lines are left out.

    shape: see `_shape_sections`.
    """
    warnings = _warning_lines(record, runs)
    results = []
    first_lines = []
    for run in runs:
        results += [_named_by_whisker(result, run) for result in run.results]
        first_lines.append(f"{run.base.name}: {run.record.verdict[0]}")
    title = f"{record.session}, {counted(len(runs), 'whisker')}"
    has_pictures = any(run.record.has_pictures for run in runs)
    settings = runs[0].record.settings
    general = verdict(title, has_pictures, RunAccuracy.of_results(results), settings, len(warnings))
    kept = _sections(record, shape, first_lines, warnings)
    return Summary((*surface_verdict(cloud), *general), tuple(warnings), kept)
