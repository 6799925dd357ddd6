"""What an analysis of an evaluated session is, and what it is given.

An analysis puts one question to all whisks together. It is one module of this folder, with its tables,
its lines of the summary, its figure and its table on the page. Nobody calls it by name: `evaluate`, the
summary, the page and docs/formats.md ask each of `bench.analyses.catalogue.ANALYSES` for its part.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np

from bench.analyses.estimator_accuracy import RunAccuracy
from bench.base.drawing import is_drawn, name_stage, save, style
from bench.base.results import DRAWING, hash_of, hash_of_code
from bench.base.settings import Settings
from bench.base.tables import Table
from bench.records.trial_result import BY_STAGE, TrialResult
from bench.session.session import Session
from bench.session.whisker import Whisker
from vision.geometry import NO_REASON, Reason

if TYPE_CHECKING:  # matplotlib is loaded where something is drawn
    from matplotlib.figure import Figure

    from bench.analyses.friction_tables import SurfaceFriction

_FIGURE_CODE = (*DRAWING, "bench/analyses")  # sources that a figure depends on


@dataclass(frozen=True, eq=False, kw_only=True)
class EvaluatedRun:
    """The results of an evaluated session: all that an analysis is given.

    results: of all trials, brought together (`bench.report.evaluation.evaluated_run`). friction: of each
    surface and speed. alpha_est_sigma_rad: standard deviation of the assumed friction angle. touch_warning:
    about an error of touch that all whisks share; empty for none. session: its manifests; None where only
    the folder of results is there.
    """

    whisker: Whisker
    settings: Settings
    results: tuple[TrialResult, ...]
    friction: tuple["SurfaceFriction", ...]
    alpha_est_sigma_rad: float
    touch_warning: Reason = NO_REASON
    session: Session | None = None
    _findings: dict["Analysis", Any] = field(default_factory=dict, init=False, repr=False)
    _figures: dict["Analysis", "Figure | None"] = field(
        default_factory=dict, init=False, repr=False
    )

    @cached_property
    def accuracy(self) -> RunAccuracy:
        """Return how well the truth is known, and how far off each estimator is."""
        return RunAccuracy.of_results(self.results)

    @property
    def is_by_stage(self) -> bool:
        """Return whether the truth is a stage's."""
        return self.accuracy.truth.source == BY_STAGE

    def found(self, analysis: "Analysis") -> Any:
        """Return what an analysis finds in this run; it is computed at first use."""
        if analysis not in self._findings:
            self._findings[analysis] = analysis.compute(self)
        return self._findings[analysis]

    def figure(self, analysis: "Analysis") -> "Figure | None":
        """Return an analysis's figure, which its file and the page share; it is drawn at first use.

        None where it has nothing to show.
        """
        if analysis not in self._figures:
            with style():
                self._figures[analysis] = analysis.figure_of(self)
        return self._figures[analysis]


@dataclass(frozen=True)
class Heading:
    """A section of the summary: its code, by which programs know it, and its title for people."""

    code: str
    title: str


Row = dict[str, str]  # of a CSV file


class TrueRun(Protocol):
    """The tables of a synthetic session's run, beside its truth files: what a score is made from."""

    def rows(self, table: Table) -> list[Row]:
        """Return the rows of a table; none where the run does not have it."""

    def whisk(self, row: Row) -> dict | None:
        """Return the true values of the whisk that a row names; None where they are not known."""

    def contacts(self, trial: str) -> tuple[np.ndarray, np.ndarray]:
        """Return motor angles (n,), degrees, and contacts (n, 3) of the frames that touch."""


@dataclass(frozen=True)
class Scored:
    """A column of a table against the truth.

    pairs: of a row and its true value, None where that is not known. name: of the quantity, where
    that is not the column's.
    """

    column: str
    pairs: Sequence[tuple[Row, float | None]]
    name: str = ""


@dataclass(frozen=True)
class PageTable:
    """A table of the page: title, the file that has it all, head, and a text a cell."""

    title: str
    file: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


class Analysis(ABC):
    """A question put to all whisks of a session together.

    tables: that it may write; in_every_run: whether it writes them without rows, too. heading: of the
    section of the summary that has its lines; analyses of one code share that section. figure_name:
    of its figure's file, without .png; figure_title, figure_caption: on the page. needs_session:
    whether results alone are not enough for it.
    """

    tables: ClassVar[tuple[Table, ...]] = ()
    in_every_run: ClassVar[bool] = True
    heading: ClassVar[Heading | None] = None
    figure_name: ClassVar[str] = ""
    figure_title: ClassVar[str] = ""
    figure_caption: ClassVar[str] = ""
    needs_session: ClassVar[bool] = False

    @abstractmethod
    def compute(self, run: EvaluatedRun) -> Any:
        """Return what this analysis finds in a run, in the form that its other methods take."""

    def rows(self, found: Any) -> Mapping[Table, Iterable[dict]]:
        """Return the rows of each of its tables: by default `row` of each item of `found`."""
        return {table: [self.row(one) for one in found] for table in self.tables}

    def row(self, one: Any) -> dict:
        """Return the row of an item: by default its fields are the columns."""
        return vars(one)

    def lines(self, found: Any) -> Iterable[str]:
        """Return its lines of the summary."""
        return ()

    def figure(self, found: Any) -> "Figure | None":
        """Draw its figure; None where there is nothing to show."""
        return None

    def figure_of(self, run: EvaluatedRun) -> "Figure | None":
        """Draw its figure of a run, by a stage's truth with that word; None where it has nothing."""
        figure = self.figure(run.found(self))
        if figure is not None and run.is_by_stage:
            name_stage(figure)
        return figure

    def caption_of(self, run: EvaluatedRun) -> str:
        """Return what stands below its figure of a run."""
        if run.is_by_stage:
            return f"{self.figure_caption} The truth is a stage's."
        return self.figure_caption

    def page_table(self, out: Path) -> PageTable | None:
        """Return its table of the page, made from the tables in the folder `out`.

        None where there is nothing to show. Raises BadInput where a table is damaged.
        """
        return None

    def scored(self, run: TrueRun) -> Iterable[Scored]:
        """Return which columns of its tables a synthetic session has true values of, and these."""
        return ()

    def write(self, out: Path, found: Any) -> None:
        """Write its tables into a folder, each whole."""
        for table, rows in self.rows(found).items():
            rows = list(rows)
            if rows or self.in_every_run:
                table.write(out, rows)

    def draw(self, out: Path, run: EvaluatedRun) -> list[str]:
        """Write its figure into a folder; return the names of the files.

        The file has the hash of what it shows, and stays as it is where that has not changed.
        """
        if not self.figure_name:
            return []
        path = out / f"{self.figure_name}.png"
        hashes = [result.hash for result in run.results]
        stamp = hash_of(hashes, run.settings, hash_of_code(_FIGURE_CODE))
        if not is_drawn(path, stamp):
            figure = run.figure(self)
            if figure is None:
                return []
            with style():
                save(figure, path, stamp)
        return [path.name]


def read_rows(out: Path, table: Table) -> np.ndarray:
    """Read the rows of a table of a run; none where the run has no such table.

    Raises BadInput where the file is damaged.
    """
    return table.read(out) if (out / table.file).exists() else np.array([])
