"""Time against error of the truth: one setting of the looking changed at a time, the presets, and figures or none.

Each setting sees the same trials. It is timed as often as asked, and the least time stands: what a clock adds is never
negative. Errors are against the known truth where the session is simulated, else against the preset `fine`.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter
from tqdm import tqdm

from bench.base.atomic import lock_output, write_whole
from bench.base.doubts import Doubts
from bench.base.drawing import publish, style
from bench.base.errors import BadInput
from bench.base.settings import Seeing, Settings
from bench.base.tables import Column, Kind, Table
from bench.base.workers import Workers
from bench.records.trial_result import SeenTrial, TrialResult
from bench.report.figures import draw_trial
from bench.report.score import truth_of
from bench.session.inside import check_outside
from bench.session.session import Session
from bench.session.session_check import checked_session
from bench.session.signals import forward_strokes, read_signals
from bench.trials.of_session import placed_units, trials_with_whisks, with_gauges
from bench.trials.seeing import PRESETS, STANDARD, as_toml, by_preset
from bench.trials.seen import see_trial
from bench.trials.trial_evaluation import trial_result
from bench.trials.unit import Unit
from estimator.uncertainty import Z_95

TRADEOFF = Table(
    "tradeoff",
    "A row a setting of `whisker-bench tradeoff`. Errors are against the known truth of a synthetic "
    "session, else against the preset `fine`. `with-figures` is `standard` with planes and overlays "
    "drawn, too: `evaluate` without `--no-figures`.",
    (
        Column("setting", "its name", Kind.TEXT),
        Column("on_front", "1 where no other setting is as good in truths, error and time, else 0"),
        Column("whisks", "how many whisks were seen", Kind.WHOLE),
        Column("whisks_with_truth", "how many of them have a truth"),
        Column("cpu_s_per_whisk", "seconds of processor, decoding included"),
        Column("wall_s_per_whisk", "seconds of wall time, decoding included"),
        Column(
            "cpu_share_of_standard",
            "processor time over that of the preset `standard` in the same run",
        ),
        Column("d_x_error_rms_mm", "RMS of the errors"),
        Column("d_x_sigma_median_mm", "median of the stated sigmas"),
        Column("inside_95_percent", "how many 95 % intervals hold"),
    ),
)
_CHANGES = {
    "rounds": (0, 2),
    "every_frame": (2, 3),
    "picture_scale": (2,),
    "wire_piece_px": (8, 24),
    "bar_piece_px": (8, 24),
    "check_beam": (False,),
}
FIGURES = "with-figures"  # the standard; no key of a settings file
_PLAIN = FormatStrFormatter("%.3g")  # a log axis of less than a decade

_Made = TypeVar("_Made")


@dataclass(frozen=True, eq=False)
class Trade:
    """A setting: seconds a whisk of processor and of wall; d_x (n,) of every whisk and its sigma, mm, NaN where there
    is no truth; errors (n,), mm."""

    seeing: Seeing
    cpu_s: float
    wall_s: float
    d_x_mm: np.ndarray
    sigma_mm: np.ndarray
    errors_mm: np.ndarray

    @property
    def rms_mm(self) -> float:
        """Of the errors of all whisks; NaN where there is none."""
        finite = self.errors_mm[np.isfinite(self.errors_mm)]
        return float(np.sqrt(np.mean(finite**2))) if len(finite) else np.nan

    @property
    def missing(self) -> int:
        """Whisks without a truth."""
        return int(np.sum(np.isnan(self.d_x_mm)))

    def row(self, standard_cpu_s: float, on_front: bool) -> dict:
        """As the table has it."""
        finite = np.isfinite(self.errors_mm)
        inside = np.abs(self.errors_mm[finite]) <= Z_95 * self.sigma_mm[finite]
        sigma = float(np.median(self.sigma_mm[finite])) if np.any(finite) else np.nan
        values = (
            self.seeing.name,
            int(on_front),
            len(finite),
            len(finite) - self.missing,
            self.cpu_s,
            self.wall_s,
            self.cpu_s / standard_cpu_s,
            self.rms_mm,
            sigma,
            100.0 * np.mean(inside) if len(inside) else np.nan,
        )
        return dict(zip(TRADEOFF.names, values))


def tradeoff(
    path: Path,
    out: Path,
    *,
    trials: str = "*",
    repeats: int = 2,
    progress: bool = False,
    follow_links: bool = False,
) -> int:
    """Write tradeoff.csv, tradeoff.png and .svg, and a settings file for each setting on the front into `out`.

    Returns 0. Raises BadInput.
    """
    check_outside(out, path)
    doubts, settings = Doubts(), Settings(trials=trials)
    session = checked_session(path, doubts, follow_links=follow_links)
    if not any(
        settings.takes(trial.name) and trial.camera_sources for trial in trials_with_whisks(session)
    ):
        raise BadInput(f"--trials {trials}: no trial with pictures has such a name")
    with lock_output(out), Workers(1, progress) as pool:
        _, units = placed_units(session, trials_with_whisks(session), out, settings, pool, doubts)
        *_, units = with_gauges(units, pool, doubts)
        chosen = [
            unit for unit in units if settings.takes(unit.trial.name) and unit.trial.camera_sources
        ]
        asked = list(ladder(tuple(chosen[0].trial.camera_sources)))
        each = tqdm(asked, desc="settings", disable=not progress, leave=False)
        trades = [_timed(chosen, seeing, repeats) for seeing in each]
        trades = _against_truth(
            session, chosen, [*trades, _drawn(chosen, _standard(trades), repeats)]
        )
    _write(out, trades)
    return 0


def ladder(cameras: Sequence[str]) -> Iterator[Seeing]:
    """The presets; the standard with one thing changed; and with one camera fewer where there are three or more."""
    yield from map(by_preset, PRESETS)
    standard = PRESETS[STANDARD]
    for name, values in _CHANGES.items():
        for value in values:
            yield Seeing(f"{name}={str(value).lower()}", replace(standard, **{name: value}))
    for left_out in cameras if len(cameras) > 2 else ():
        yield Seeing(
            f"without-{left_out}", standard, tuple(name for name in cameras if name != left_out)
        )


def front(trades: Sequence[Trade]) -> list[bool]:
    """Which settings no other beats: no fewer truths, no larger an error and no more time, and one of them better."""
    cost = np.array([[trade.missing, trade.rms_mm, trade.cpu_s] for trade in trades])
    cost[np.isnan(cost)] = np.inf
    return [not np.any(np.all(cost <= one, axis=1) & np.any(cost < one, axis=1)) for one in cost]


def _timed(units: Sequence[Unit], seeing: Seeing, repeats: int) -> Trade:
    """The trials seen so often with one setting, decoding included; no errors yet."""
    seen, cpu_s, wall_s = _clocked(lambda: _seen(units, Settings(seeing=seeing)), repeats)
    whisks = [whisk for trial in seen for whisk in trial.whisks]
    d_x, sigma = np.array(
        [(whisk.d_x_mm.value, whisk.d_x_mm.sigma) for whisk in whisks], dtype=float
    ).T
    return Trade(
        seeing, cpu_s / len(whisks), wall_s / len(whisks), d_x, sigma, np.full(len(d_x), np.nan)
    )


def _seen(units: Sequence[Unit], settings: Settings) -> list[SeenTrial]:
    return [
        see_trial(u.session, u.trial, read_signals(u.trial), u.calibration, settings) for u in units
    ]


def _drawn(units: Sequence[Unit], standard: Trade, repeats: int) -> Trade:
    """The standard, and beside its seconds those of drawing all figures of the trials."""
    results = [(unit, trial_result(unit)) for unit in units]
    _, cpu_s, wall_s = _clocked(lambda: _draw_all(results), repeats)
    count, about = len(standard.d_x_mm), Seeing(FIGURES, standard.seeing.vision)
    seconds = {"cpu_s": standard.cpu_s + cpu_s / count, "wall_s": standard.wall_s + wall_s / count}
    return replace(standard, seeing=about, **seconds)


def _draw_all(results: Sequence[tuple[Unit, TrialResult]]) -> list[str]:
    """Sensing planes and overlays, into a folder that does not stay; their names."""
    with TemporaryDirectory() as folder:
        return [
            name
            for unit, result in results
            for name in draw_trial(
                (unit.trial, result, (unit.settings.alpha_est_rad, "assumed"), Path(folder))
            )
        ]


def _clocked(make: Callable[[], _Made], repeats: int) -> tuple[_Made, float, float]:
    """What is made, and the least seconds of processor and of wall of so many times."""
    runs = []
    for _ in range(repeats):
        cpu_s, wall_s = time.process_time(), time.perf_counter()
        made = make()
        runs.append((time.process_time() - cpu_s, time.perf_counter() - wall_s))
    return made, *(min(column) for column in zip(*runs))


def _against_truth(session: Session, units: Sequence[Unit], trades: Sequence[Trade]) -> list[Trade]:
    """With errors: against the known truth, or the finest setting."""
    finest = trades[len(PRESETS) - 1].d_x_mm  # the last rung
    counts = [len(forward_strokes(read_signals(unit.trial))) for unit in units]
    truths = [
        truth_of(session, u.trial.name, number)
        for u, count in zip(units, counts)
        for number in range(count)
    ]
    true = np.array([np.nan if truth is None else truth["d_x_mm"] for truth in truths], dtype=float)
    return [
        replace(trade, errors_mm=trade.d_x_mm - np.where(np.isnan(true), finest, true))
        for trade in trades
    ]


def _standard(trades: Sequence[Trade]) -> Trade:
    return next(trade for trade in trades if trade.seeing.name == STANDARD)


def _write(out: Path, trades: Sequence[Trade]) -> None:
    on_front = front(trades)
    standard_cpu_s = _standard(trades).cpu_s
    rows = [trade.row(standard_cpu_s, there) for trade, there in zip(trades, on_front)]
    TRADEOFF.write(out, rows)
    for trade, there in zip(trades, on_front):
        if there:
            write_whole(
                out / "settings" / f"{trade.seeing.name.replace('=', '-')}.toml",
                as_toml(trade.seeing),
            )
    with style():
        publish(draw(trades, on_front), out / "tradeoff")
    print(*_lines(rows), sep="\n")


def _lines(rows: Sequence[dict]) -> Iterator[str]:
    heads = ("truths", "CPU s/whisk", "of standard", "d_x RMS mm", "sigma mm", "in 95 %")
    yield f"{'setting':<18}" + "".join(f"{head:>13}" for head in heads)
    for row in sorted(rows, key=lambda row: row["cpu_s_per_whisk"]):
        truths = f"{row['whisks_with_truth']}/{row['whisks']}"
        yield (
            f"{row['setting']:<18}{truths:>13}{row['cpu_s_per_whisk']:13.2f}{row['cpu_share_of_standard']:13.2f}"
            f"{row['d_x_error_rms_mm']:13.4f}{row['d_x_sigma_median_mm']:13.4f}{row['inside_95_percent']:13.0f}"
            + ("  on the front" if row["on_front"] else "")
        )


def draw(trades: Sequence[Trade], on_front: Sequence[bool]) -> Figure:
    """Error against processor time, the front joined; presets and what lies on the front are named."""
    figure = Figure(figsize=(6.0, 4.0), layout="constrained")
    axes = figure.add_subplot()
    joined = sorted((trade.cpu_s, trade.rms_mm) for trade, there in zip(trades, on_front) if there)
    axes.plot(*np.array(joined).T, color="0.6", lw=1, zorder=1, label="Pareto front")
    for trade, there in zip(trades, on_front):
        axes.plot(trade.cpu_s, trade.rms_mm, "o", color="#2166ac" if there else "0.6", ms=5)
        if there or trade.seeing.name in (
            *PRESETS,
            FIGURES,
        ):  # the rest lie upon each other: tradeoff.csv has them
            axes.annotate(
                trade.seeing.name,
                (trade.cpu_s, trade.rms_mm),
                xytext=(4, 3),
                textcoords="offset points",
                fontsize=7,
                color="0.2" if there else "0.5",
            )
    axes.set(xlabel="processor time a whisk, s", ylabel="error of d$_x$, RMS, mm", yscale="log")
    axes.yaxis.set_major_formatter(_PLAIN)
    axes.yaxis.set_minor_formatter(_PLAIN)
    axes.margins(x=0.12)
    axes.legend()
    return figure
