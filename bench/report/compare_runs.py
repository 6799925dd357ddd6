"""`whisker-bench compare`: by how many sigmas each whisk changed between evaluated runs."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from bench.analyses.estimator_accuracy import Accuracy
from bench.base.drawing import label_of
from bench.base.errors import BadInput
from bench.base.exit_codes import DONE, WITH_WARNINGS
from bench.base.numbers import first_names
from bench.base.tables import TRIAL, WHISK, Column, Kind, Table
from bench.records.trial_result import FeltWhisk, SeenWhisk, whisks
from bench.report.page.words import MISSING, number, with_sigma
from bench.report.run_folder import read_run
from vision import UNKNOWN, Value

COMPARISON = Table(
    "comparison",
    "`compare … --out FILE` writes a row a whisk and quantity of each run after the first.",
    (
        TRIAL,
        WHISK,
        Column(
            "quantity",
            "d_x_mm, touch_deg, beta_deg, slip_mm, touch_felt_deg, or an estimator's d_x_est_mm",
            Kind.TEXT,
        ),
        Column("out", "the run that is held against the first", Kind.TEXT),
        Column("reference", "its value in the first run"),
        Column("value", "its value in this run"),
        Column("difference", "this less the first"),
        Column(
            "sigma",
            "of the difference: of one recording the larger stated sigma, for both err alike; of two "
            "recordings both",
        ),
        Column("sigmas", "the difference in sigmas"),
        Column("same_recording", "1 where the trial's files are the same, else 0"),
    ),
)
CHANGED = WITH_WARNINGS
# [sigma] A whisk evaluated again that moves by more has another truth, or another estimate. Stated.
_LEAST_SIGMAS_AGAIN = 1.0
# [sigma] Of another recording's whisk, by chance once in 370. Derived.
_LEAST_SIGMAS_ANEW = 3.0
_MOST_LISTED = 20  # lines in a terminal
_MOST_NAMED = 6  # whisks in a line

WhiskKey = tuple[str, int]  # trial, number of the whisk
Pair = tuple[SeenWhisk, FeltWhisk]


@dataclass(frozen=True)
class QuantityChange:
    """One quantity of one whisk in two runs.

    values: in the first run, and in `out`; NaN where it is not known. sigma: of the difference. Where
    both are of one recording, their errors are mostly the same ones: it is then the larger of the two
    stated. Of two recordings both count.
    """

    trial: str
    whisk: int
    quantity: str
    out: Path
    values: tuple[float, float]
    sigma: float
    same_recording: bool

    @property
    def key(self) -> WhiskKey:
        """Return trial and number of the whisk."""
        return self.trial, self.whisk

    @property
    def difference(self) -> float:
        """Return the second value less the first."""
        return self.values[1] - self.values[0]

    @property
    def sigmas(self) -> float:
        """Return the difference in sigmas; infinite where one of both, or its sigma, is not known."""
        if self.difference == 0:
            return 0.0
        if math.isfinite(self.difference) and self.sigma > 0:
            return self.difference / self.sigma
        return math.inf

    @property
    def matters(self) -> bool:
        """Return whether the difference is more than the sigmas explain."""
        least = _LEAST_SIGMAS_AGAIN if self.same_recording else _LEAST_SIGMAS_ANEW
        return abs(self.sigmas) > least


def compare_runs(outs: Sequence[Path], table: Path | None = None) -> tuple[list[str], int]:
    """Compare the first run with each of the others; return lines on what changed, and the exit code.

    The code is 1 where anything changed that matters. table: a CSV file to write, a row a whisk and
    quantity. Raises BadInput where a folder is no run, or no whisk stands in two of them.
    """
    first, *others = _read_runs(outs)
    changes: list[QuantityChange] = []
    lines: list[str] = []
    for other in others:
        of_run = list(_changes(first, other))
        changes += of_run
        lines += _run_lines(first, other, of_run)
    if not changes:
        alone = f"shares no whisk with {outs[0]}: trials are matched by their names"
        raise BadInput(alone, file=outs[1])
    if table is not None:
        COMPARISON.write_file(table, [_row(change, Path(outs[0])) for change in changes])
    lines += _accuracy_lines([first, *others])
    has_changed = any(change.matters for change in changes)
    return lines, CHANGED if has_changed else DONE


def _read_runs(outs: Sequence[Path]) -> list["_ComparedRun"]:
    """Read two or more runs. Raises BadInput where there is one alone, one twice, or one is none."""
    if len(outs) < 2:
        raise BadInput("is one run alone; give two or more", file=outs[0])
    if len({Path(out).resolve() for out in outs}) < len(outs):
        raise BadInput("is given twice; give each run once", file=outs[-1])
    return [_ComparedRun.read(Path(out)) for out in outs]


@dataclass(frozen=True)
class _ComparedRun:
    """A run and its folder. recordings: hash of each trial's files. whisks: seen and felt."""

    out: Path
    recordings: dict[str, str]
    accuracies: Sequence[Accuracy]
    whisks: dict[WhiskKey, Pair]

    @classmethod
    def read(cls, out: Path) -> "_ComparedRun":
        """Read the run of a folder. Raises BadInput where it is none."""
        record, run = read_run(out)
        found = {}
        for result, seen, felt in whisks(run.results):
            found[result.trial.name, seen.whisk] = (seen, felt)
        return cls(out, record.recordings, run.accuracy.estimators, found)

    @property
    def truth_sources(self) -> str:
        """Return where its truth comes from, in words."""
        sources = {seen.truth_source for seen, _ in self.whisks.values()} - {""}
        return " and ".join(sorted(sources)) or "none"

    def has_recording_of(self, other: "_ComparedRun", trial: str) -> bool:
        """Return whether a trial has the same files in both runs."""
        ours = self.recordings.get(trial)
        return ours is not None and ours == other.recordings.get(trial)


def _changes(first: _ComparedRun, other: _ComparedRun) -> Iterator[QuantityChange]:
    """Yield every quantity of a whisk that stands in both runs, where either knows it."""
    for key, pair in first.whisks.items():
        if key not in other.whisks:
            continue
        trial, whisk = key
        same = first.has_recording_of(other, trial)
        after = _quantities(other.whisks[key])
        for name, old in _quantities(pair).items():
            new = after.get(name)
            if new is None or not (old.is_known or new.is_known):
                continue
            values = (old.value, new.value)
            yield QuantityChange(
                trial, whisk, name, other.out, values, _sigma(old, new, same), same
            )


def _sigma(old: Value, new: Value, same_recording: bool) -> float:
    """Return the standard deviation of the difference of two values of a whisk."""
    finite = [value.sigma for value in (old, new) if math.isfinite(value.sigma)]
    if same_recording:
        return max(finite, default=math.nan)
    return math.hypot(*finite)


def _quantities(pair: Pair) -> dict[str, Value]:
    """Return the quantities of a whisk by name, in the unit that the name ends with."""
    seen, felt = pair
    slip_mm = seen.at.slip_mm if seen.at is not None else UNKNOWN
    quantities = {
        "d_x_mm": seen.d_x_mm,
        "touch_deg": seen.touch_rad.in_degrees(),
        "beta_deg": seen.beta_rad.in_degrees(),
        "slip_mm": slip_mm,
        "touch_felt_deg": felt.touch_felt_rad.in_degrees(),
    }
    for estimate in felt.estimates:
        quantities[f"{estimate.estimator}: d_x_est_mm"] = estimate.d_x_est_mm
    return quantities


def _row(change: QuantityChange, reference: Path) -> dict:
    """Return the row of COMPARISON. reference: folder of the first run."""
    return {
        "trial": change.trial,
        "whisk": change.whisk,
        "quantity": change.quantity,
        "out": change.out,
        "reference": change.values[0],
        "value": change.values[1],
        "difference": change.difference,
        "sigma": change.sigma,
        "sigmas": change.sigmas,
        "same_recording": int(change.same_recording),
    }


def _run_lines(
    first: _ComparedRun, other: _ComparedRun, changes: Sequence[QuantityChange]
) -> Iterator[str]:
    """Yield counts of one run against the first, and the quantities that changed most."""
    compared = {change.key for change in changes}
    same = {change.key for change in changes if change.same_recording}
    yield f"{other.out} against {first.out}: {len(compared)} whisks in both, {len(same)} of them from the same recording"
    if first.truth_sources != other.truth_sources:
        yield f"  the truth is by {first.truth_sources} in {first.out}, by {other.truth_sources} in {other.out}"
    for run, rest in ((first, other), (other, first)):
        alone = sorted(run.whisks.keys() - rest.whisks.keys())
        if alone:
            names = first_names((f"{trial} {whisk}" for trial, whisk in alone), _MOST_NAMED)
            yield f"  only in {run.out}: {names}"
    yield from _largest_changes(changes)


def _largest_changes(changes: Sequence[QuantityChange]) -> Iterator[str]:
    """Yield the quantities that changed most, and by how much the others did at most."""
    significant = [change for change in changes if change.matters]
    significant.sort(key=lambda change: -abs(change.sigmas))
    for change in significant[:_MOST_LISTED]:
        yield f"  {_change_line(change)}"
    if len(significant) > _MOST_LISTED:
        yield f"  … and {len(significant) - _MOST_LISTED} more (--out FILE has all)"
    quiet = len(changes) - len(significant)
    largest = max((abs(one.sigmas) for one in changes if not one.matters), default=0.0)
    yield f"  {quiet} of {len(changes)} values moved by {largest:.2f} sigma at most"


def _accuracy_lines(runs: Sequence[_ComparedRun]) -> Iterator[str]:
    """Yield the RMS error of each estimator in each run."""
    table: dict[str, list[str]] = {}  # by label, a cell a run
    for place, run in enumerate(runs):
        for accuracy in run.accuracies:
            cells = table.setdefault(accuracy.label, [MISSING] * len(runs))
            cells[place] = f"{number(accuracy.rms_percent)} ({len(accuracy.judged)})"
    if table:
        yield "RMS error of d_x, % (whisks), in the order of the runs"
    for label, cells in table.items():
        yield f"  {label:<24}" + "".join(f"{cell:>18}" for cell in cells)


def _change_line(change: QuantityChange) -> str:
    """Return what changed by how much, in words."""
    name, _, unit = change.quantity.rpartition("_")
    estimator, _, quantity = name.rpartition(": ")
    what = f"{label_of(estimator)}, {quantity}" if estimator else quantity
    where = f"{change.trial}, whisk {change.whisk}: {what}"
    before, after = change.values
    if not math.isfinite(change.difference):
        return f"{where} {'is no longer known' if math.isfinite(before) else 'has become known'}"
    difference = with_sigma(change.difference, change.sigma, sign=True)
    return f"{where} {before:.4g} → {after:.4g} {unit}, {difference}, {change.sigmas:+.1f} sigma"
