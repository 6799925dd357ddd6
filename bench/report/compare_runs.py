"""`whisker-bench compare`: evaluated runs side by side, whisk by whisk: what changed, and by how many sigmas."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from bench.base.drawing import label_of
from bench.base.errors import BadInput
from bench.base.tables import TRIAL, WHISK, Column, Kind, Table
from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.report.estimator_accuracy import accuracies
from bench.report.evaluation import finished
from bench.report.page.words import MISSING, number, with_sigma
from bench.report.pooled import read_run
from bench.report.record import read_record
from vision.truth.value import UNKNOWN, Value

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
            "of the difference: of one recording the larger of the two stated sigmas, for both err "
            "alike; of two recordings both",
        ),
        Column("sigmas", "the difference in sigmas"),
        Column("same_recording", "1 where the trial's files are the same, else 0"),
    ),
)
DONE, CHANGED = 0, 1
# A re-evaluated whisk that moves so far has another truth, or another estimate; less is within what was stated.
_MATTERS_SIGMAS = 1.0
# Of another day's whisk, by chance once in 370.
_STANDS_OUT_SIGMAS = 3.0
_MOST_SHOWN = 20  # lines in a terminal
_DEGREES = math.degrees(1.0)
_SEEN: tuple[tuple[str, float, Callable[[SeenWhisk], Value]], ...] = (
    ("d_x_mm", 1.0, lambda s: s.d_x_mm),
    ("touch_deg", _DEGREES, lambda s: s.touch_rad),
    ("beta_deg", _DEGREES, lambda s: s.beta_rad),
    ("slip_mm", 1.0, lambda s: s.at.slip_mm if s.at is not None else UNKNOWN),
)


@dataclass(frozen=True)
class Change:
    """One quantity of one whisk in two runs. values: in the first run, and in `out`; NaN where it is not known.

    sigma: of the difference. Where both are of one recording, their errors are mostly the same ones: it is then the
    larger of the two stated. Of two recordings both count.
    """

    trial: str
    whisk: int
    quantity: str
    out: Path
    values: tuple[float, float]
    sigma: float
    same_recording: bool

    @property
    def difference(self) -> float:
        """Second less first."""
        return self.values[1] - self.values[0]

    @property
    def sigmas(self) -> float:
        """The difference in sigmas; infinite where one of both, or its sigma, is not known."""
        if self.difference == 0:
            return 0.0
        return (
            self.difference / self.sigma
            if math.isfinite(self.difference) and self.sigma > 0
            else math.inf
        )

    @property
    def matters(self) -> bool:
        """Whether it is to be told."""
        return abs(self.sigmas) > (_MATTERS_SIGMAS if self.same_recording else _STANDS_OUT_SIGMAS)


def compare_runs(outs: Sequence[Path], table: Path | None = None) -> tuple[list[str], int]:
    """Lines on what changed from the first run to each of the others, and the exit code: 1 where anything that matters
    did. table: a CSV file to write, a row a whisk and quantity. Raises BadInput where a folder is no run, or no whisk
    stands in two of them."""
    if len(outs) < 2:
        raise BadInput("is one run alone; give two or more", file=outs[0])
    if len({Path(out).resolve() for out in outs}) < len(outs):
        raise BadInput("is given twice; give each run once", file=outs[-1])
    first, *others = (_read(Path(out)) for out in outs)
    changes = [change for other in others for change in _changes(first, other)]
    if not changes:
        raise BadInput(
            f"shares no whisk with {outs[0]}: trials are told by their names", file=outs[1]
        )
    if table is not None:
        COMPARISON.write_file(table, (_row(change, Path(outs[0])) for change in changes))
    lines = [
        line
        for other in others
        for line in _lines(first, other, [c for c in changes if c.out == other.out])
    ]
    lines += _accuracy_lines([first, *others])
    return lines, CHANGED if any(c.matters for c in changes) else DONE


@dataclass(frozen=True)
class _Run:
    out: Path
    recordings: dict[str, str]
    results: tuple[TrialResult, ...]

    def whisks(self) -> dict[tuple[str, int], tuple[SeenWhisk, FeltWhisk]]:
        """By trial and number."""
        return {
            (result.trial.name, seen.whisk): (seen, felt)
            for result, seen, felt in whisks(self.results)
        }


def _read(out: Path) -> _Run:
    record = read_record(out)
    return _Run(
        out, record.recordings, finished(read_run(out), record.whisker, record.settings).results
    )


def _changes(first: _Run, other: _Run) -> Iterator[Change]:
    """Every quantity of a whisk that stands in both runs, where either knows it."""
    theirs = other.whisks()
    for key, mine in first.whisks().items():
        same = key[0] in first.recordings and first.recordings.get(key[0]) == other.recordings.get(
            key[0]
        )
        before, after = _quantities(*mine), _quantities(*theirs[key]) if key in theirs else {}
        for name in (name for name in before if name in after):
            a, b = before[name], after[name]
            if math.isfinite(a.value) or math.isfinite(b.value):
                yield Change(*key, name, other.out, (a.value, b.value), _sigma(a, b, same), same)


def _sigma(a: Value, b: Value, same: bool) -> float:
    finite = [v.sigma for v in (a, b) if math.isfinite(v.sigma)]
    return max(finite, default=math.nan) if same else math.hypot(*finite)


def _quantities(seen: SeenWhisk, felt: FeltWhisk) -> dict[str, Value]:
    """By name, in the unit that it ends with."""
    quantities = {name: _scaled(get(seen), scale) for name, scale, get in _SEEN}
    quantities["touch_felt_deg"] = _scaled(felt.touch_felt_rad, _DEGREES)
    return quantities | {
        f"{answer.estimator}: d_x_est_mm": answer.d_x_est_mm for answer in felt.estimates
    }


def _scaled(value: Value, scale: float) -> Value:
    return Value(scale * float(value.value), scale * float(value.sigma))


def _row(change: Change, reference: Path) -> dict:
    return {
        **{
            name: getattr(change, name)
            for name in ("trial", "whisk", "quantity", "difference", "sigma")
        },
        "out": change.out,
        "reference": change.values[0],
        "value": change.values[1],
        "sigmas": change.sigmas,
        "same_recording": int(change.same_recording),
    }


def _lines(first: _Run, other: _Run, changes: Sequence[Change]) -> Iterator[str]:
    """Of one run against the first: counts, what is told by quantity, and the whisks that changed most."""
    compared = {(c.trial, c.whisk) for c in changes}
    same = len({(c.trial, c.whisk) for c in changes if c.same_recording})
    yield f"{other.out} against {first.out}: {len(compared)} whisks in both, {same} of them of one recording"
    alone = [
        (run.out, set(run.whisks()) - set(rest.whisks()))
        for run, rest in ((first, other), (other, first))
    ]
    yield from (f"  only in {out}: {_named(sorted(keys))}" for out, keys in alone if keys)
    significant = sorted((c for c in changes if c.matters), key=lambda c: -abs(c.sigmas))
    for change in significant[:_MOST_SHOWN]:
        yield f"  {_change_line(change)}"
    if len(significant) > _MOST_SHOWN:
        yield f"  … and {len(significant) - _MOST_SHOWN} more (--out FILE has all)"
    quiet = max((abs(c.sigmas) for c in changes if not c.matters), default=0.0)
    yield f"  {len(changes) - len(significant)} of {len(changes)} values moved by {quiet:.2f} sigma at most"


def _accuracy_lines(runs: Sequence[_Run]) -> Iterator[str]:
    """RMS error of each estimator in each run."""
    by_label = [{one.label: one for one in accuracies(run.results)} for run in runs]
    names = list(dict.fromkeys(label for of_run in by_label for label in of_run))
    if names:
        yield "RMS error of d_x, % (whisks), in the order of the runs"
    for name in names:
        cells = (of_run.get(name) for of_run in by_label)
        yield f"  {name:<24}" + "".join(
            f"{f'{number(s.rms_percent)} ({len(s.judged)})' if s is not None else MISSING:>18}"
            for s in cells
        )


def _change_line(change: Change) -> str:
    name, _, unit = change.quantity.rpartition("_")
    estimator, _, quantity = name.rpartition(": ")
    what = f"{label_of(estimator)}, {quantity}" if estimator else quantity
    where = f"{change.trial}, whisk {change.whisk}: {what}"
    if not math.isfinite(change.difference):
        gone = math.isfinite(change.values[0])
        return f"{where} {'is no longer known' if gone else 'has become known'}"
    moved = with_sigma(change.difference, change.sigma, sign=True)
    return f"{where} {change.values[0]:.4g} → {change.values[1]:.4g} {unit}, {moved}, {change.sigmas:+.1f} sigma"


def _named(keys: Sequence[tuple[str, int]]) -> str:
    names = [f"{trial} {whisk}" for trial, whisk in keys]
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
