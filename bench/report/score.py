"""Synthetic sessions only: finished results against the truth files, after everything else. Opens them and nothing
that computes a result does; what it finds is printed and changes nothing."""

import csv
import json
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.tables import sigma_name
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
_SLIP_THETA_DEG = 3.0  # °: the pushing angle at which truth files give the slip (slip_at_3deg_mm)


@dataclass(frozen=True)
class Score:
    """One quantity over n values: errors and stated sigmas (n,)."""

    name: str
    unit: str
    errors: np.ndarray
    sigmas: np.ndarray

    def line(self) -> str:
        """Bias, RMS, and how well the stated sigmas hold."""
        z = np.abs(self.errors) / self.sigmas
        finite = z[np.isfinite(z)]
        held = (
            f"{100 * np.mean(finite <= Z_95):5.0f} %   {finite.max():5.2f}"
            if len(finite)
            else "    -       -"
        )
        return (
            f"{self.name:<28}{len(self.errors):5d}  {np.mean(self.errors):+9.4f}  "
            f"{np.sqrt(np.mean(self.errors**2)):8.4f} {self.unit:<4}{held}"
        )


def score(session: Session, out: Path, gauges: GaugeCalibration | None = None) -> list[str]:
    """Lines on bias, RMS and the share of 95 % intervals that hold; empty where the session has no truth files."""
    return score_all([(session, out)], gauges)


def score_all(
    runs: Sequence[tuple[Session, Path]], gauges: GaugeCalibration | None = None
) -> list[str]:
    """The same of several runs (the whiskers of an array), each with its folder, taken together."""
    try:
        found = [one for session, out in runs for one in _scores(session, out)]
        lines = list(_gauge_lines(runs[0][0], gauges))
    except (OSError, ValueError, KeyError, IndexError) as problem:
        return [f"the truth files cannot be read: {type(problem).__name__} {problem}"]
    if not found:
        return lines
    scores = [
        _together([s for s in found if s.name == name])
        for name in dict.fromkeys(s.name for s in found)
    ]
    head = f"{'':<28}{'n':>5}  {'bias':>9}  {'RMS':>8}     in 95 %  most |z|"
    return [head, *(s.line() for s in scores), *lines]


def _together(scores: Sequence[Score]) -> Score:
    errors, sigmas = (
        np.concatenate([getattr(s, key) for s in scores]) for key in ("errors", "sigmas")
    )
    return Score(scores[0].name, scores[0].unit, errors, sigmas)


def _scores(session: Session, out: Path) -> Iterator[Score]:
    rows = _read(out / "whisks.csv")
    paired = [(row, truth) for row in rows if (truth := _truth(session, row)) is not None]
    for column, key in _AT_TOUCH:
        yield from _compared(column, [(row, truth.get(key)) for row, truth in paired])
    at_3 = [
        (row, truth.get("slip_at_3deg_mm"))
        for row, truth in paired
        if float(row["theta_deg"]) == _SLIP_THETA_DEG
    ]
    yield from _compared("slip_mm", at_3, "slip_mm at 3 deg")
    for column in ("x_mm", "y_mm", "z_mm", "slip_mm"):
        yield from _compared(
            column, list(_frames(session, out, column)), f"{column}, touching frames"
        )
    yield from _friction(session, out)
    measured = {trial.name for trial in session.trials if trial.purpose == "measure"}
    exact = {
        (row["trial"], row["whisk"]): truth.get("d_x_mm")
        for row, truth in paired
        if row["trial"] in measured
    }
    estimates = _read(out / "estimates.csv")
    for estimator in dict.fromkeys(row["estimator"] for row in estimates):
        mine = [
            (row, exact.get((row["trial"], row["whisk"])))
            for row in estimates
            if row["estimator"] == estimator
        ]
        yield from _compared("d_x_est_mm", mine, f"d_x by {estimator}")


def _friction(session: Session, out: Path) -> Iterator[Score]:
    """Friction angles: one where the coefficient at rest is that in motion, else the two apart."""
    path = out / "friction.csv"
    rows = [(row, _truth(session, row)) for row in (_read(path) if path.is_file() else ())]
    known = [(row, truth) for row, truth in rows if truth is not None and "mu_kinetic" in truth]
    alike = {True: [], False: []}
    for row, truth in known:
        angles = {
            key: float(np.degrees(np.arctan(truth[f"mu_{key}"]))) for key in ("static", "kinetic")
        }
        alike[truth["mu_static"] == truth["mu_kinetic"]].append((row, angles))
    for record in ("seen", "felt"):
        yield from _compared(
            f"alpha_{record}_deg", [(row, angles["kinetic"]) for row, angles in alike[True]]
        )
        for kind in ("static", "kinetic"):
            pairs = [(row, angles[kind]) for row, angles in alike[False]]
            yield from _compared(f"alpha_{kind}_{record}_deg", pairs)


def _compared(column: str, pairs, name: str = "") -> Iterator[Score]:
    """The score of a column where both sides are known; nothing where none is."""
    known = [
        (float(row[column]), float(row[sigma_name(column)] or "nan"), float(truth))
        for row, truth in pairs
        if truth is not None and row[column] and np.isfinite(float(truth))
    ]
    if known:
        values, sigmas, truths = np.array(known).T
        yield Score(name or column, column.rpartition("_")[2], values - truths, sigmas)


def _truth(session: Session, row: dict) -> dict | None:
    return truth_of(session, row["trial"], int(row["whisk"]))


def truth_of(session: Session, trial: str, number: int) -> dict | None:
    """truth.toml of a whisk; where a recording holds several, each value is a list in their order. None where the
    session is no synthetic one."""
    path = session.trial(trial).own("truth.toml")
    if not path.is_file():
        return None
    values = tomllib.loads(path.read_text())
    return {
        key: value[number] if isinstance(value, list) else value
        for key, value in values.items()
        if not isinstance(value, list) or number < len(value)
    }


def _frames(session: Session, out: Path, column: str) -> Iterator[tuple[dict, float]]:
    """Rows of the tracks in which the whisker touches, seen and true, with the true value."""
    for trial in session.trials:
        path = trial.own("truth.csv")
        track = out / "track" / f"{trial.name}.csv"
        if path.is_file() and track.is_file():
            truth = {int(float(row["frame"])): row for row in _read(path)}
            for row in _read(track):
                true = truth.get(int(row["frame"]))
                if true is not None and float(true["contact"]) == 1 and row["touching"] == "1":
                    yield row, float(true[column])


def _gauge_lines(session: Session, gauges: GaugeCalibration | None) -> Iterator[str]:
    """Coefficients against truth.json: the diagonal in per cent, the rest in points of its column's diagonal."""
    path = session.path / "truth.json"
    if gauges is None or not path.is_file():
        return
    true = json.loads(path.read_text()).get("gauge_matrix_Nmm_per_V")
    if true is None:
        return
    true = np.array(true)
    for name, made in (
        ("fitted", gauges.all),
        ("at one angle", gauges.at_angle),
        ("one factor", gauges.one_factor),
    ):
        if made is not None:
            diagonal = 100.0 * (np.diag(made.matrix) * _inverse(np.diag(true)) - 1.0)
            cross = 100.0 * (_over_diagonal(made.matrix) - _over_diagonal(true))
            yield (
                f"gauges {name:<14} diagonal {diagonal[0]:+.2f} %, {diagonal[1]:+.2f} %; "
                f"cross-talk {cross[0, 1]:+.2f}, {cross[1, 0]:+.2f} points"
            )


def _over_diagonal(matrix: np.ndarray) -> np.ndarray:
    """Each column (2, 2) over its entry on the diagonal; NaN where that is 0: a channel that answers to no moment."""
    return matrix * _inverse(np.diag(matrix))


def _inverse(values: np.ndarray) -> np.ndarray:
    """1 / values, NaN where they are 0."""
    return 1.0 / np.where(values == 0.0, np.nan, values)


def _read(path: Path) -> list[dict]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))
