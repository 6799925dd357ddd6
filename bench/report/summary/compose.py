"""summary.txt: the verdict first, then what it rests on. Verdict and warnings appear in the terminal."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.analyses.analysis import EvaluatedRun
from bench.analyses.catalogue import ANALYSES
from bench.report.evaluation import Evaluation
from bench.report.run_facts import Section
from bench.report.run_tables import RUN_TABLES
from bench.report.summary.error_lines import contact_lines, error_lines
from bench.report.summary.gauge_lines import gauge_lines
from bench.report.summary.shared import scatter_warnings, shared_lines
from bench.report.summary.truth import beam_lines, budget_lines, clock_lines, truth_lines
from bench.report.summary.verdict import gauge_source_lines, preset_lines, verdict
from bench.report.summary.warning_lines import (
    damage_warnings,
    estimator_limits,
    frame_lines,
    light_lines,
    whisk_warnings,
)
from bench.session.angle_source import without_motor_log
from bench.session.given_lines import given_lines
from bench.session.session import Session
from bench.trials.estimate_errors import judge
from vision.geometry import counted

WARNINGS = "Warnings"
SCORE = "Score against the truth files of this synthetic session (no result knows them)"
_MOST_ON_SCREEN = 20  # lines: a screen
# Codes of the sections of analyses in their order; those of other analyses come after these.
_ANALYSES_FIRST = (
    "sensors",
    "both_ways",
    "one_camera",
    "moving",
    "against_theta",
    "friction",
    "object",
)
# Codes of sections of analyses that stand behind the gauges: they are about the model.
_ANALYSES_LAST = ("ledger",)
# Figures in the order in which the files are listed; others come after these.
_FIGURES_FIRST = ("fig8.png", "error_against_slope.png", "against_theta.png", "moving.png")


@dataclass(frozen=True)
class Summary:
    """The verdict, the warnings, and titled sections, of which one has the warnings."""

    verdict: tuple[str, ...]
    warnings: tuple[str, ...]
    sections: tuple[Section, ...]

    @property
    def text(self) -> str:
        """Return the text of summary.txt."""
        return "\n".join([*self.verdict, "", *section_lines(self.sections)]).rstrip() + "\n"

    def on_screen(self, out: Path) -> str:
        """Return what is seen at a glance: the verdict, the warnings, and where the rest is."""
        lines = [*self.verdict, ""]
        if self.warnings:
            shown = list(self.warnings[:_MOST_ON_SCREEN])
            more = len(self.warnings) - len(shown)
            if more:
                shown.append(f"and {more} more, in summary.txt")
            lines += section_lines([Section("warnings", WARNINGS, tuple(shown))])
        lines.append(f"All of it: {out / 'report.html'}, {out / 'summary.txt'}")
        return "\n".join(lines)


def section_lines(sections: Iterable[Section]) -> Iterator[str]:
    """Yield titles with their lines below them, and an empty line after each."""
    for section in sections:
        yield section.title
        for line in section.lines:
            yield f"  {line}"
        yield ""


def summary_of(evaluation: Evaluation, scores: Sequence[str], figures: Sequence[str]) -> Summary:
    """Return the summary of a run.

    scores: lines on a synthetic session's truth. figures: names of the pictures.
    """
    run = evaluation.run
    results = run.results
    warnings = (
        *evaluation.warnings,
        *damage_warnings(results),
        *scatter_warnings(results),
        *whisk_warnings(results, evaluation.warnings),
    )
    of_analyses = _sections_of_analyses(run)
    last = [of_analyses.pop(code) for code in _ANALYSES_LAST if code in of_analyses]
    sections = (
        *_sections_of_errors(run),
        *of_analyses.values(),
        _section("gauges", "Gauges, N·mm/V (± 95 %)", gauge_lines(evaluation.gauges)),
        *last,
        *_sections_of_pictures(evaluation),
        _section("warnings", WARNINGS, warnings),
        _section("limits", "Limits that estimators met", estimator_limits(results)),
        _section("score", SCORE, scores),
        _section("givens", "Givens (± one sigma)", _given_lines(evaluation)),
        _section("files", "Files", [_file_list(figures)]),
    )
    shown = tuple(section for section in sections if section.lines)
    return Summary(tuple(_verdict_lines(evaluation, len(warnings))), warnings, shown)


def _verdict_lines(evaluation: Evaluation, warnings: int) -> Iterator[str]:
    """Yield the lines that the summary begins with. warnings: how many there are."""
    run = evaluation.run
    session = run.session
    settings = run.settings
    yield from verdict(session.name, session.is_seen, run.accuracy, settings, warnings)
    yield from angle_lines(session)
    yield from gauge_source_lines(evaluation.gauges)
    yield from preset_lines(run.results, settings)


def angle_lines(session: Session) -> Iterator[str]:
    """Yield a line on each source of motor angles but a log: how many trials, and whether θ is seen."""
    for source, count in without_motor_log(session.trials):
        seen = "; θ of their estimates is seen" if source.is_seen else ""
        trials = f"{count} of {counted(len(session.trials), 'trial')}"
        yield f"No motor log: the angle of {trials} is by {source.by}{seen}."


def _given_lines(evaluation: Evaluation) -> Iterator[str]:
    """Return lines on how well what was stated is known."""
    cameras = evaluation.calibration.cameras
    session = evaluation.run.session
    are_brought = cameras is not None and session.cameras_toml is not None
    are_exact = are_brought and not np.any(cameras.covariance)
    return given_lines(session, cameras_are_exact=are_exact)


def _sections_of_pictures(evaluation: Evaluation) -> Iterator[Section]:
    """Yield the sections on cameras, light and frames."""
    yield _section("cameras", "Cameras", evaluation.calibration.notes)
    yield _section("light", "Light from one side", light_lines(evaluation.run.results))
    yield _section("frames", "Frames", frame_lines(evaluation.run.results))


def _sections_of_errors(run: EvaluatedRun) -> Iterator[Section]:
    """Yield the sections on truth, clocks and errors, with which the summary begins."""
    results = run.results
    truth = (
        *truth_lines(results),
        *budget_lines(results),
        *shared_lines(results),
        *beam_lines(results),
    )
    theta_deg = run.settings.theta_deg
    title = (
        f"Error of d_x at θ = {theta_deg:g}°, estimate less truth, in % of the truth (± one sigma)"
    )
    source = "by a stage" if run.is_by_stage else "from the pictures"
    yield _section("truth", f"Truth, {source} (± one sigma)", truth)
    yield _section("clocks", "Clocks", clock_lines(results))
    yield _section("errors", title, [*error_lines(judge(results)), *contact_lines(results)])


def _sections_of_analyses(run: EvaluatedRun) -> dict[str, Section]:
    """Return the sections of the analyses by their codes, in the summary's order.

    Analyses of one code share a section.
    """
    titles = {}
    lines: dict[str, list[str]] = {code: [] for code in _ANALYSES_FIRST}
    for analysis in ANALYSES:
        heading = analysis.heading
        if heading is None:
            continue
        titles[heading.code] = heading.title
        of_section = lines.setdefault(heading.code, [])
        of_section += analysis.lines(run.found(analysis))
    sections = {}
    for code, of_section in lines.items():
        if code in titles:
            sections[code] = _section(code, titles[code], of_section)
    return sections


def _section(code: str, title: str, lines: Iterable[str]) -> Section:
    """Return a section of the summary."""
    return Section(code, title, tuple(lines))


def _file_list(figures: Sequence[str]) -> str:
    """Return the names of all files and folders of figures of a run."""
    single = [name for name in figures if "/" not in name]
    first = [name for name in _FIGURES_FIRST if name in single]
    others = [name for name in single if name not in first]
    folders = sorted({name.split("/")[0] for name in figures if "/" in name})
    tables = [table.file for table in RUN_TABLES.values()]
    of_folders = [f"{folder}/" for folder in folders]
    return ", ".join(["report.html", *tables, "track/", *first, *others, *of_folders])
