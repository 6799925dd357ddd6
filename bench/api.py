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

`session` and `out` are folders, as on the command line. Bad input raises
`bench.base.errors.BadInput` or `vision.geometry.refusals.Refused`, whose text is the line that the
command line shows.
"""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bench.analyses.analysis import EvaluatedRun
from bench.array.array_results import TABLES as ARRAY_TABLES
from bench.array.array_results import folder_of, is_array, read_array_record, write_array
from bench.base.atomic import lock_output
from bench.base.drawing import style
from bench.base.settings import Settings
from bench.base.tables import Table
from bench.report.page.write import report_again
from bench.report.record import read_record
from bench.report.run_facts import RunRecord
from bench.report.run_folder import read_run
from bench.report.run_tables import RUN_TABLES as TABLES
from bench.report.whisk_tables import TRACK
from bench.trials.seeing import STANDARD, by_preset
from bench.workflows import session_evaluation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bench.plan.plan_rows import Plan
    from bench.workflows.live_push import LivePush

Folder = Path | str
_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Run:
    """An evaluated session.

    out: its folder. record: what run.json says. Each table is a structured array (rows,) whose
    fields are the columns of docs/formats.md: NaN is a number that is missing, '' a text.
    """

    out: Path
    record: RunRecord

    @property
    def verdict(self) -> tuple[str, ...]:
        """Return how good each estimator is, in sentences."""
        return self.record.verdict

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return the warnings, a line each."""
        return self.record.warnings

    @property
    def has_warnings(self) -> bool:
        """Return whether there is any warning; the command line's exit code is then 1."""
        return bool(self.warnings)

    @property
    def whisks(self) -> np.ndarray:
        """Return a row a whisk: truth and moments, with sigmas."""
        return self.table("whisks")

    @property
    def estimates(self) -> np.ndarray:
        """Return a row a whisk and estimator."""
        return self.table("estimates")

    def table(self, name: str) -> np.ndarray:
        """Return a table by its name, one of TABLES. Raise KeyError for another."""
        return _read_table(TABLES, name, self.out)

    def track(self, trial: str) -> np.ndarray:
        """Return a row a frame of a trial. Raise KeyError where there is no such trial."""
        if trial not in self.record.recordings:
            names = ", ".join(self.record.recordings)
            raise KeyError(f"there is no trial {trial!r}; there are {names}")
        return TRACK.read_file(self.out / "track" / f"{trial}.csv")

    def results(self) -> EvaluatedRun:
        """Return everything of every whisk as typed records (`bench.records.trial_result`), and
        the friction of each surface."""
        _, run = read_run(self.out)
        return run

    def figures(self) -> dict[str, "Figure"]:
        """Return the session's figures by name, to change and save as one likes."""
        from bench.report.paper import session_figures

        with style():
            return {one.name: one.drawing for one in session_figures(self.results())}


@dataclass(frozen=True, eq=False)
class ArrayRun:
    """An evaluated session of several whiskers.

    verdict, warnings: of all of them. whiskers: each one's own run, by its name.
    """

    out: Path
    verdict: tuple[str, ...]
    warnings: tuple[str, ...]
    whiskers: dict[str, Run]

    @property
    def has_warnings(self) -> bool:
        """Return whether there is any warning; the command line's exit code is then 1."""
        return bool(self.warnings)

    def table(self, name: str) -> np.ndarray:
        """Return a table of all whiskers: whisks, estimates or surface. Raise KeyError for
        another name."""
        return _read_table(ARRAY_TABLES, name, self.out)


def _read_table(tables: Mapping[str, Table], name: str, out: Path) -> np.ndarray:
    """Return the table of this name from a run's folder. Raise KeyError where there is none."""
    if name not in tables:
        raise KeyError(f"{name!r} is no table; there are {', '.join(tables)}")
    return tables[name].read(out)


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
    """Evaluate a session into a folder, as `whisker-bench evaluate` does, without a word on the
    screen; return the run.

    The options are those of the command line. workers: 0 and 1 work in this process, by one thread
    of linear algebra while it lasts. More are processes of their own, which read the script that
    asks for them: it does so below `if __name__ == "__main__":`. Raise BadInput, Refused.
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
    session_evaluation.evaluate(
        Path(session),
        Path(out),
        settings,
        workers=workers,
        dask=dask,
        figure_formats=figure_formats,
        announce=_log.info,
    )
    return read(out)


def live(
    session: Folder,
    out: Folder,
    trial: str,
    stroke_deg: tuple[float, float],
    *,
    clock_sigma_s: float = 0.0,
    follow_links: bool = False,
) -> "LivePush":
    """Return a push to come against the bar of a trial, to be fed while it is recorded: `add` each
    picture, `work` while waiting for the next, `finish` after the last.

    stroke_deg: motor angles between which it goes. clock_sigma_s: how well the frames' times are
    known against the motor's angles. Raise BadInput.
    """
    from bench.workflows.live_push import open_push

    return open_push(
        Path(session),
        Path(out),
        trial,
        stroke_deg,
        clock_sigma_s=clock_sigma_s,
        follow_links=follow_links,
    )


def read(out: Folder) -> Run | ArrayRun:
    """Read a run that was evaluated before. Raise BadInput where the folder holds none."""
    out = Path(out)
    if not is_array(out):
        return Run(out, read_record(out))
    array = read_array_record(out)
    whiskers = {}
    for base in array.bases:
        folder = folder_of(out, base.name)
        whiskers[base.name] = Run(folder, read_record(folder))
    return ArrayRun(out, array.verdict, array.warnings, whiskers)


def plan(
    what: Folder,
    out: Folder,
    *,
    theta_deg: float = 3.0,
    changes: bool = True,
    follow_links: bool = False,
    workers: int = 0,
) -> "Plan":
    """Plan a RIG.toml, or a recorded session, into a folder, as `whisker-bench plan` does; return
    the plan.

    It has a row a trial, with expected sigmas, limits and changes. workers: as of `evaluate`.
    Raise BadInput.
    """
    from bench.plan import run_plan  # with the rig and all that paints: other verbs do without

    options = run_plan.Options(theta_deg, changes, follow_links)
    return run_plan.plan(Path(what), Path(out), options, workers=workers, announce=_log.info)


def report(out: Folder, figure_formats: Sequence[str] = ()) -> list[Path]:
    """Write report.html, methods.md and results.bib again; return the paths written.

    figure_formats: of figures for a paper, too ("png", "pdf", "svg"). Raise BadInput where the
    folder is no run.
    """
    out = Path(out)
    if not is_array(out):
        return report_again(out, figure_formats)
    written = []
    for base in read_array_record(out).bases:
        written += report_again(folder_of(out, base.name), figure_formats)
    with lock_output(out):
        write_array(out)
    return [*written, out / "report.html"]
