"""What the whiskers of an array tell together: tables, figure, summary and page, from their runs' folders alone."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from bench.analyses.runs import alpha_est_sigma
from bench.array.array_page import write_page
from bench.array.cloud import Contact, Mount, contacts
from bench.array.exchanged_whiskers import exchanged
from bench.array.shape_verdict import (
    SURFACE_POINTS,
    surface_lines,
    surface_verdict,
    write_surface,
)
from bench.array.size import SIZE, felt_sizes, size_lines, write_sizes
from bench.array.surface import Surface, seen_surface, stated_surface
from bench.base.atomic import write_whole
from bench.base.errors import BadInput
from bench.base.tables import WHISKER
from bench.records.plain import from_plain, to_plain
from bench.records.trial_result import TrialResult, whisks
from bench.report.assembly import estimate_rows, whisk_rows
from bench.report.evaluation import Finished, finished
from bench.report.pooled import read_run
from bench.report.record import ARRAY, RUNS, read_record
from bench.report.run_facts import RunRecord, Section
from bench.report.summary.compose import DOUBTFUL, SCORE, Summary
from bench.report.summary.verdict import verdict
from bench.report.whisk_tables import ESTIMATES, WHISKS
from bench.session.session import Base, Session
from vision.geometry.counted import counted

ARRAY_WHISKS = replace(WHISKS, columns=(WHISKER, *WHISKS.columns))
ARRAY_ESTIMATES = replace(ESTIMATES, columns=(WHISKER, *ESTIMATES.columns))
# Of all whiskers, by name.
TABLES = {table.name: table for table in (ARRAY_WHISKS, ARRAY_ESTIMATES, SURFACE_POINTS, SIZE)}


@dataclass(frozen=True, eq=False)
class ArrayRecord:
    """What is known of an array beside its whiskers' runs. doubts: of the session as a whole; scores: of all whiskers
    against the truth files of a synthetic session; surfaces: objects as the manifests state them, by trial; verdict,
    doubtful: as the summary has them, once it is made."""

    session: str
    bases: tuple[Base, ...]
    doubts: tuple[str, ...] = ()
    scores: tuple[str, ...] = ()
    surfaces: dict[str, Surface] = field(default_factory=dict)
    verdict: tuple[str, ...] = ()
    doubtful: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class WhiskerRun:
    """One whisker of the array: where it stands, and its run."""

    base: Base
    record: RunRecord
    whole: Finished

    @property
    def mount(self) -> Mount:
        """What places its contacts."""
        settings = self.record.settings
        sigma = alpha_est_sigma([f.surface for f in self.whole.friction], settings)
        return Mount(self.base, self.record.whisker.wire, settings.alpha_est_rad, sigma)


def folder_of(out: Path, whisker: str) -> Path:
    """Where a whisker's run stands in the array's OUT."""
    return out / RUNS / whisker


def array_record(
    views: Sequence[Session], doubts: Sequence[str], scores: Sequence[str]
) -> ArrayRecord:
    """The record of an array's views, one a whisker."""
    stated = {trial.name: stated_surface(trial) for trial in views[0].trials}
    surfaces = {name: surface for name, surface in stated.items() if surface is not None}
    return ArrayRecord(
        views[0].whole_name,
        tuple(view.base for view in views),
        tuple(doubts),
        tuple(scores),
        surfaces,
    )


def write_array_record(out: Path, record: ArrayRecord) -> None:
    """array.json, whole."""
    write_whole(
        out / ARRAY,
        json.dumps(to_plain(record), sort_keys=True, ensure_ascii=False, indent=1) + "\n",
    )


def read_array_record(out: Path) -> ArrayRecord:
    """The array of a folder. Raises BadInput where it is none, or of another version."""
    try:
        return from_plain(ArrayRecord, json.loads((out / ARRAY).read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise BadInput(f"is no array's run (there is no {ARRAY} in it)", file=out) from None
    except (OSError, ValueError, KeyError):
        raise BadInput(
            "is damaged or of an older version; evaluate the session again", file=out / ARRAY
        ) from None


def is_array(out: Path) -> bool:
    """Whether a folder holds the runs of several whiskers."""
    return (out / ARRAY).is_file()


def write_array(out: Path) -> Summary:
    """Tables, figures, report.html and summary.txt of an array's runs, each whole. Raises BadInput as reading does."""
    record = read_array_record(out)
    runs = [_read(base, folder_of(out, base.name)) for base in record.bases]
    _write_tables(out, runs)
    cloud = [
        contact
        for run in runs
        for contact in contacts(run.mount, run.whole.results, record.surfaces)
    ]
    write_surface(out, cloud)
    sizes = felt_sizes(cloud, record.surfaces)
    write_sizes(out, sizes)
    summary = _summary(record, runs, cloud, sizes)
    figures = []
    if runs[0].record.settings.figures:
        from bench.array.figure import write_figures  # with all of matplotlib

        figures = write_figures(out, cloud, _seen(runs) | record.surfaces)
    write_page(out, record.session, summary, [(run.base.name, run.record) for run in runs], figures)
    write_whole(out / "summary.txt", summary.text)
    write_array_record(out, replace(record, verdict=summary.verdict, doubtful=summary.doubtful))
    return summary


def _read(base: Base, folder: Path) -> WhiskerRun:
    record = read_record(folder)
    return WhiskerRun(base, record, finished(read_run(folder), record.whisker, record.settings))


def _seen(runs: Sequence[WhiskerRun]) -> dict[str, Surface]:
    """The bar of each trial, as the first whisk that shows it has it."""
    found = {}
    for run in runs:
        for result, seen, _ in whisks(run.whole.results):
            surface = seen_surface(seen, result.seen.bar_radius_mm, run.mount.wire, run.base)
            if surface is not None:
                found.setdefault(result.trial.name, surface)
    return found


def _write_tables(out: Path, runs: Sequence[WhiskerRun]) -> None:
    """Write whisks.csv and estimates.csv of all whiskers, each row with its whisker."""
    for table, rows in ((ARRAY_WHISKS, whisk_rows), (ARRAY_ESTIMATES, estimate_rows)):
        named = (
            {"whisker": run.base.name} | row for run in runs for row in rows(run.whole.results)
        )
        table.write(out, named)


def _named_by_whisker(result: TrialResult, run: WhiskerRun) -> TrialResult:
    """Return a result whose trial's name says which whisker it is of: all whiskers share trials."""
    trial = replace(result.trial, name=f"{result.trial.name}, {run.base.name}")
    return replace(result, trial=trial)


def _summary(
    record: ArrayRecord, runs: Sequence[WhiskerRun], cloud: Sequence[Contact], sizes
) -> Summary:
    swapped = exchanged({run.base.name: run.whole.results for run in runs})
    doubtful = [
        *record.doubts,
        *swapped,
        *(f"{run.base.name}: {line}" for run in runs for line in run.record.doubts),
    ]
    results = [_named_by_whisker(result, run) for run in runs for result in run.whole.results]
    pictures = any(run.record.has_pictures for run in runs)
    said = verdict(
        f"{record.session}, {counted(len(runs), 'whisker')}",
        pictures,
        results,
        runs[0].record.settings,
        len(doubtful),
    )
    sections = (
        Section(
            "whiskers",
            "Whiskers",
            tuple(f"{run.base.name}: {run.record.verdict[0]}" for run in runs),
        ),
        Section(
            "surface",
            "Surface: contacts from the object, mm (surface.csv)",
            tuple(surface_lines(cloud)),
        ),
        Section(
            "size",
            "Size of the object by (10), its place free (size.csv)",
            tuple(size_lines(sizes)),
        ),
        Section("doubtful", DOUBTFUL, tuple(doubtful)),
        Section(
            "score",
            SCORE,
            record.scores,
        ),
        Section(
            "files",
            "Files",
            (f"report.html, whisks.csv, estimates.csv, surface.csv, size.csv, {RUNS}/<name>/",),
        ),
    )
    spoken = (*surface_verdict(cloud), *said)
    return Summary(spoken, tuple(doubtful), tuple(section for section in sections if section.lines))
