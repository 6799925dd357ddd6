"""Score of a synthetic session: its finished results against its truth files.

Nothing that computes a result opens these files. It is made after everything else, printed, and
changes nothing.
"""

import csv
import json
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.analyses.analysis import Row
from bench.analyses.catalogue import ANALYSES
from bench.analyses.pooling import grouped, rms
from bench.base.tables import Table, sigma_name
from bench.gauges.matrix import GaugeCalibration
from bench.session.session import Session
from estimator.uncertainty import Z_95

# Column of whisks.csv and key of truth.toml.
_AT_TOUCH = (
    ("d_x_mm", "d_x_mm"),
    ("touch_deg", "touch_deg"),
    ("touch_felt_deg", "touch_deg"),
    ("beta_deg", "beta_deg"),
    ("psi_deg", "psi_deg"),
)
_IN_TRACK = ("x_mm", "y_mm", "z_mm", "slip_mm")  # columns of track/<trial>.csv and of truth.csv
_SLIP_THETA_DEG = 3.0  # the pushing angle at which truth files give the slip (slip_at_3deg_mm)

Pair = tuple[Row, float | None]  # of a result and the true value; None where that is not known


@dataclass(frozen=True)
class Score:
    """One quantity over n values: errors and stated sigmas (n,)."""

    name: str
    unit: str
    errors: np.ndarray
    sigmas: np.ndarray

    def line(self) -> str:
        """Return bias, RMS, and how well the stated sigmas hold, in a line."""
        with np.errstate(invalid="ignore", divide="ignore"):  # what is exact has a sigma of 0
            z = np.abs(self.errors) / self.sigmas
        finite = z[np.isfinite(z)]
        coverage = "    -       -"
        if len(finite):
            coverage = f"{100 * np.mean(finite <= Z_95):5.0f} %   {finite.max():5.2f}"
        bias = np.mean(self.errors)
        return (
            f"{self.name:<28}{len(self.errors):5d}  {bias:+9.4f}  {rms(self.errors):8.4f} {self.unit:<4}"
            f"{coverage}"
        )


@dataclass(frozen=True, eq=False)
class _TrueRun:
    """A run's folder and its synthetic session, as `bench.analyses.analysis.TrueRun`."""

    session: Session
    out: Path

    def rows(self, table: Table) -> list[Row]:
        """Return the rows of a table; none where the run does not have it."""
        path = self.out / table.file
        return _read_rows(path) if path.is_file() else []

    def whisk(self, row: Row) -> dict | None:
        """Return truth.toml of the whisk that a row names, as `truth_of`."""
        return truth_of(self.session, row["trial"], int(row["whisk"]))

    def contacts(self, trial: str) -> tuple[np.ndarray, np.ndarray]:
        """Return motor angles (n,), degrees, and contacts (n, 3) of the frames that touch."""
        path = self.session.trial(trial).own("truth.csv")
        motor_deg = []
        contacts_mm = []
        for row in _read_rows(path) if path.is_file() else ():
            if row["contact"] == "1":
                motor_deg.append(float(row["motor_deg"]))
                contacts_mm.append([float(row["x_mm"]), float(row["y_mm"]), float(row["z_mm"])])
        return np.array(motor_deg), np.array(contacts_mm).reshape(-1, 3)


def score(session: Session, out: Path, gauges: GaugeCalibration | None = None) -> list[str]:
    """Return lines on bias, RMS and the share of 95 % intervals that hold.

    There are none where the session has no truth files.
    """
    return score_all([(session, out)], gauges)


def score_all(
    runs: Sequence[tuple[Session, Path]], gauges: GaugeCalibration | None = None
) -> list[str]:
    """Return the lines of `score` on several runs taken together, such as the whiskers of an array.

    runs: each with its folder. gauges: of the first.
    """
    found: list[Score] = []
    try:
        for session, out in runs:
            found += scores_of(session, out)
        gauge_lines = list(_gauge_lines(runs[0][0], gauges))
    except (OSError, ValueError, KeyError, IndexError) as problem:
        return [f"the truth files cannot be read: {type(problem).__name__} {problem}"]
    if not found:
        return gauge_lines
    by_name = grouped(found, lambda one: one.name)
    head = f"{'':<28}{'n':>5}  {'bias':>9}  {'RMS':>8}     in 95 %  most |z|"
    return [head, *(_joined(scores).line() for scores in by_name.values()), *gauge_lines]


def _joined(scores: Sequence[Score]) -> Score:
    """Return the scores of one quantity in several runs as one."""
    errors = np.concatenate([one.errors for one in scores])
    sigmas = np.concatenate([one.sigmas for one in scores])
    return Score(scores[0].name, scores[0].unit, errors, sigmas)


def scores_of(session: Session, out: Path) -> Iterator[Score]:
    """Yield the score of every quantity of a run of which a true value is known."""
    truths = []
    for row in _read_rows(out / "whisks.csv"):
        truth = truth_of(session, row["trial"], int(row["whisk"]))
        if truth is not None:
            truths.append((row, truth))
    for column, key in _AT_TOUCH:
        yield from _compare(column, [(row, truth.get(key)) for row, truth in truths])
    slips = []
    for row, truth in truths:
        if float(row["theta_deg"]) == _SLIP_THETA_DEG:
            slips.append((row, truth.get("slip_at_3deg_mm")))
    yield from _compare("slip_mm", slips, "slip_mm at 3 deg")
    for column in _IN_TRACK:
        yield from _compare(column, _frames(session, out, column), f"{column}, touching frames")
    yield from _estimates(session, out, truths)
    run = _TrueRun(session, out)
    for analysis in ANALYSES:
        for one in analysis.scored(run):
            yield from _compare(one.column, one.pairs, one.name)


def _estimates(session: Session, out: Path, truths: Sequence[tuple[Row, dict]]) -> Iterator[Score]:
    """Yield the score of each estimator's distances. truths: rows of whisks.csv with their truth."""
    measured = {trial.name for trial in session.trials if trial.purpose == "measure"}
    true_mm = {}
    for row, truth in truths:
        if row["trial"] in measured:
            true_mm[row["trial"], row["whisk"]] = truth.get("d_x_mm")
    estimates = grouped(_read_rows(out / "estimates.csv"), lambda row: row["estimator"])
    for estimator, mine in estimates.items():
        pairs = [(row, true_mm.get((row["trial"], row["whisk"]))) for row in mine]
        yield from _compare("d_x_est_mm", pairs, f"d_x by {estimator}")


def _compare(column: str, pairs: Iterable[Pair], name: str = "") -> Iterator[Score]:
    """Yield the score of a column where both sides are known; nothing where none is."""
    known = []
    for row, truth in pairs:
        if truth is not None and row[column] and np.isfinite(float(truth)):
            sigma = float(row[sigma_name(column)] or "nan")
            known.append((float(row[column]) - float(truth), sigma))
    if known:
        errors, sigmas = np.array(known).T
        yield Score(name or column, column.rpartition("_")[2], errors, sigmas)


def truth_of(session: Session, trial: str, number: int) -> dict | None:
    """Return truth.toml of a whisk by its number; None where the session is no synthetic one.

    Where a recording holds several whisks, each value of the file is a list in their order.
    """
    path = session.trial(trial).own("truth.toml")
    if not path.is_file():
        return None
    truth = {}
    for key, value in tomllib.loads(path.read_text()).items():
        if not isinstance(value, list):
            truth[key] = value
        elif number < len(value):
            truth[key] = value[number]
    return truth


def _frames(session: Session, out: Path, column: str) -> Iterator[Pair]:
    """Yield the rows of the tracks in which the whisker touches, seen and true, with the true value."""
    for trial in session.trials:
        path = trial.own("truth.csv")
        track = out / "track" / f"{trial.name}.csv"
        if not (path.is_file() and track.is_file()):
            continue
        truth = {int(float(row["frame"])): row for row in _read_rows(path)}
        for row in _read_rows(track):
            true = truth.get(int(row["frame"]))
            if true is not None and float(true["contact"]) == 1 and row["touching"] == "1":
                yield row, float(true[column])


def _gauge_lines(session: Session, gauges: GaugeCalibration | None) -> Iterator[str]:
    """Yield the errors of the coefficients against truth.json.

    The diagonal's are in per cent, the others' in per cent of their column's diagonal.
    """
    path = session.path / "truth.json"
    if gauges is None or not path.is_file():
        return
    stated = json.loads(path.read_text()).get("gauge_matrix_Nmm_per_V")
    if stated is None:
        return
    true = np.array(stated)
    matrices = {
        "fitted": gauges.all,
        "at one angle": gauges.at_angle,
        "one factor": gauges.one_factor,
    }
    for name, found in matrices.items():
        if found is None:
            continue
        diagonal = 100.0 * (np.diag(found.matrix) * _inverse(np.diag(true)) - 1.0)
        cross = 100.0 * (_over_diagonal(found.matrix) - _over_diagonal(true))
        yield (
            f"gauges {name:<14} diagonal {diagonal[0]:+.2f} %, {diagonal[1]:+.2f} %; "
            f"cross-talk {cross[0, 1]:+.2f}, {cross[1, 0]:+.2f} points"
        )


def _over_diagonal(matrix: np.ndarray) -> np.ndarray:
    """Return each column (2, 2) over its entry on the diagonal.

    NaN where that is 0: a channel that responds to no moment.
    """
    return matrix * _inverse(np.diag(matrix))


def _inverse(values: np.ndarray) -> np.ndarray:
    """Return 1 / values, NaN where they are 0."""
    return 1.0 / np.where(values == 0.0, np.nan, values)


def _read_rows(path: Path) -> list[Row]:
    """Return the rows of a CSV file by column."""
    with path.open(newline="") as file:
        return list(csv.DictReader(file))
