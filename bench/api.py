"""The verbs for Python: results as NumPy tables, figures as Matplotlib has them.

Examples:
    >>> run = evaluate(session, out, alpha_est_deg=12.0)
    >>> run.verdict[0]
    'sample: no pictures, so the true distance is not known; 2 measured whisks felt...'
    >>> run.whisks.dtype.names[:4]
    ('trial', 'whisk', 'surface', 'speed_deg_s')
    >>> given = run.estimates["estimator"] == "with_friction"
    >>> run.estimates["alpha_est_deg"][given].round(1).tolist()
    [12.0, 12.0, 12.0, 12.0]
    >>> read(out).whisks["trial"].tolist()
    ['b30_3', 'b60_4', 'gauge_roll0', 'gauge_roll90']
    >>> sorted(run.figures())
    ['fig8']

`session` and `out` are folders, as on the command line, which is made of these functions. Bad input raises
`bench.base.errors.BadInput` or `vision.geometry.refusals.Refused`, whose text is the line that the command line shows.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.array.array_results import TABLES as ARRAY_TABLES
from bench.array.array_results import folder_of, is_array, read_array_record, write_array
from bench.base.atomic import lock_output
from bench.base.drawing import style
from bench.base.settings import Settings
from bench.commands.evaluate import evaluate as _evaluate
from bench.report.evaluation import Finished, finished
from bench.report.page.write import report_again
from bench.report.pooled import read_run
from bench.report.record import read_record
from bench.report.run_facts import RunRecord
from bench.report.run_tables import RUN_TABLES as TABLES
from bench.report.whisk_tables import TRACK
from bench.trials.seeing import STANDARD, by_preset

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bench.plan.plan_rows import Plan

Folder = Path | str


@dataclass(frozen=True, eq=False)
class Run:
    """An evaluated session. Each table is a structured array (rows,) whose fields are the columns of docs/formats.md:
    NaN is a number that is missing, '' a text. doubtful: whether anything is."""

    out: Path
    record: RunRecord

    @property
    def verdict(self) -> tuple[str, ...]:
        """How good each estimator is, in sentences."""
        return self.record.verdict

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is doubtful, a line each."""
        return self.record.doubts

    @property
    def doubtful(self) -> bool:
        """Whether anything is doubtful; the command line's exit code is then 1."""
        return bool(self.doubts)

    @property
    def whisks(self) -> np.ndarray:
        """A row a whisk: truth and moments, with sigmas."""
        return self.table("whisks")

    @property
    def estimates(self) -> np.ndarray:
        """A row a whisk and estimator."""
        return self.table("estimates")

    def table(self, name: str) -> np.ndarray:
        """A table by its name, one of TABLES. Raises KeyError for another."""
        if name not in TABLES:
            raise KeyError(f"{name!r} is no table; there are {', '.join(TABLES)}")
        return TABLES[name].read(self.out)

    def track(self, trial: str) -> np.ndarray:
        """A row a frame of a trial. Raises KeyError where there is no such trial."""
        if trial not in self.record.recordings:
            raise KeyError(
                f"there is no trial {trial!r}; there are {', '.join(self.record.recordings)}"
            )
        return TRACK.read_file(self.out / "track" / f"{trial}.csv")

    def results(self) -> Finished:
        """Everything of every whisk as typed records (`bench.records.trial_result`), and the friction of each surface."""
        return finished(read_run(self.out), self.record.whisker, self.record.settings)

    def figures(self) -> dict[str, "Figure"]:
        """The session's figures by name, to change and save as one likes."""
        from bench.report.paper import session_figures

        with style():
            return session_figures(self.results())


@dataclass(frozen=True, eq=False)
class ArrayRun:
    """An evaluated session of several whiskers: verdict and doubts of all; whiskers: each one's own run, by name."""

    out: Path
    verdict: tuple[str, ...]
    doubts: tuple[str, ...]
    whiskers: dict[str, Run]

    @property
    def doubtful(self) -> bool:
        """Whether anything is doubtful; the command line's exit code is then 1."""
        return bool(self.doubts)

    def table(self, name: str) -> np.ndarray:
        """A table of all whiskers by its name: whisks, estimates or surface. Raises KeyError for another."""
        if name not in ARRAY_TABLES:
            raise KeyError(f"{name!r} is no table; there are {', '.join(ARRAY_TABLES)}")
        return ARRAY_TABLES[name].read(self.out)


def evaluate(
    session: Folder,
    out: Folder,
    *,
    theta_deg: float = 3.0,
    alpha_est_deg: float = 10.0,
    alpha_est_sigma_deg: float | None = None,
    cutoff_Hz: float | None = None,
    clock_sigma_s: float | None = None,
    gauges_from_all: bool = False,
    estimators: Sequence[str] = (),
    trials: str = "*",
    figures: bool = True,
    preset: str = STANDARD,
    accuracy_mm: float | None = None,
    follow_links: bool = False,
    one_camera: str | None = None,
    workers: int = 0,
    dask: str | None = None,
    figure_formats: Sequence[str] = (),
) -> Run | ArrayRun:
    """Evaluate a session into a folder, as `whisker-bench evaluate` does, without a word on the screen.

    The options are those of the command line; workers: 0 works in this process. More are processes of their own, which
    read the script that asks for them: it does so below `if __name__ == "__main__":`. Raises BadInput, Refused.
    """
    settings = Settings(
        theta_deg=theta_deg,
        alpha_est_deg=alpha_est_deg,
        alpha_est_sigma_deg=alpha_est_sigma_deg,
        cutoff_Hz=cutoff_Hz,
        clock_sigma_s=clock_sigma_s,
        gauges_from_all=gauges_from_all,
        estimators=tuple(estimators),
        trials=trials,
        figures=figures,
        seeing=by_preset(preset),
        accuracy_mm=accuracy_mm,
        follow_links=follow_links,
        one_camera=one_camera,
    )
    return evaluate_with(Path(session), Path(out), settings, workers, figure_formats, dask=dask)


def evaluate_with(
    session: Path,
    out: Path,
    settings: Settings,
    workers: int = 1,
    figure_formats: Sequence[str] = (),
    **shown: Any,
) -> Run | ArrayRun:
    """The same with the options in one object. shown: progress, announce and dask of
    `bench.commands.evaluate.evaluate`."""
    quiet = {"announce": logging.getLogger(__name__).info}
    _evaluate(
        session, out, settings, workers=workers, figure_formats=figure_formats, **quiet | shown
    )
    return read(out)


def read(out: Folder) -> Run | ArrayRun:
    """A run that was evaluated before. Raises BadInput where the folder is none."""
    out = Path(out)
    if not is_array(out):
        return Run(out, read_record(out))
    array = read_array_record(out)
    folders = {base.name: folder_of(out, base.name) for base in array.bases}
    whiskers = {name: Run(folder, read_record(folder)) for name, folder in folders.items()}
    return ArrayRun(out, array.verdict, array.doubtful, whiskers)


def plan(
    what: Folder,
    out: Folder,
    *,
    theta_deg: float = 3.0,
    changes: bool = True,
    follow_links: bool = False,
    workers: int = 0,
) -> "Plan":
    """Plan a RIG.toml, or a recorded session, into a folder, as `whisker-bench plan` does: a row a trial, with expected
    sigmas, limits and changes. workers: as of `evaluate`. Raises BadInput."""
    from bench.plan import (
        run_plan as planning,
    )  # with the rig and all that paints: other verbs do without

    quiet, options = (
        logging.getLogger(__name__).info,
        planning.Options(theta_deg, changes, follow_links),
    )
    return planning.plan(Path(what), Path(out), options, workers=workers, announce=quiet)


def report(out: Folder, figure_formats: Sequence[str] = ()) -> list[Path]:
    """report.html, methods.md and results.bib again, and figures for a paper in these formats ("png", "pdf", "svg").
    The paths written. Raises BadInput where the folder is no run."""
    out = Path(out)
    if not is_array(out):
        return report_again(out, figure_formats)
    names = [base.name for base in read_array_record(out).bases]
    written = [
        path for name in names for path in report_again(folder_of(out, name), figure_formats)
    ]
    with lock_output(out):
        write_array(out)
    return [*written, out / "report.html"]
