"""Time against error of the truth, over the settings of the evaluation of pictures.

Tried are the presets, the standard with one setting changed at a time, and the standard with its
figures drawn. Each setting sees the same trials. It is timed several times, and the least time
counts: what a clock adds is never negative. Errors are against the known truth where the session is
simulated, else against the preset `standard`. Settings are ranked by the error that their stated
sigmas let one expect, and by the measured one where that is larger than chance explains.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter

from bench.base.atomic import lock_output, write_whole
from bench.base.drawing import publish, style
from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.base.progress import begin_step
from bench.base.settings import Seeing, Settings
from bench.base.tables import Column, Kind, Table, alike
from bench.base.workers import Workers
from bench.report.score import truth_of
from bench.session.inside import check_outside
from bench.session.session import Session
from bench.session.session_check import checked_session
from bench.session.signals import forward_strokes, read_signals
from bench.session.trial import Trial
from bench.trials.of_session import placed_units, trials_with_whisks, with_gauges
from bench.trials.seeing import PRESETS, STANDARD, as_toml, by_preset
from bench.trials.trial_evaluation import trial_result
from bench.trials.unit import Unit
from bench.workflows.expected_error import ExpectedRms
from bench.workflows.pareto import pareto_front
from bench.workflows.seeing_times import draw_all, see_all, time_work
from estimator.uncertainty import Z_95
from vision.geometry import counted

TRADEOFF = Table(
    "tradeoff",
    "A row a setting of `whisker-bench tradeoff`. Errors are against the known truth of a synthetic "
    "session, else against the preset `standard`. `with-figures` is `standard` with planes and overlays "
    "drawn, too: `evaluate` without `--no-figures`.",
    (
        Column("setting", "its name", Kind.TEXT),
        Column(
            "on_front",
            "1 where no other setting is as good in truths, error and time, else 0; by d_x_expected_rms_mm, "
            "or a measured RMS above d_x_expected_high_mm",
        ),
        Column("whisks", "how many whisks were seen", Kind.WHOLE),
        Column("whisks_with_truth", "how many of them have a truth"),
        Column("cpu_s_per_whisk", "seconds of processor, decoding included"),
        Column("wall_s_per_whisk", "seconds of wall time, decoding included"),
        Column(
            "cpu_share_of_standard",
            "processor time over that of the preset `standard` in the same run",
        ),
        Column("d_x_error_rms_mm", "RMS of the errors"),
        Column("d_x_expected_rms_mm", "RMS of the stated sigmas"),
        *alike(
            ("d_x_expected_low_mm", "d_x_expected_high_mm"),
            "range of 95 % of the RMS errors of so many whisks",
        ),
        Column("d_x_sigma_median_mm", "median of the stated sigmas"),
        Column("inside_95_percent", "how many 95 % intervals hold"),
    ),
)
# Values of each setting that are tried in place of the standard's.
_CHANGES = {
    "rounds": (0, 2),
    "every_frame": (2, 3),
    "picture_scale": (2,),
    "wire_piece_px": (8, 24),
    "bar_piece_px": (8, 24),
    "check_beam": (False,),
}
FIGURES = "with-figures"  # the standard and its figures; no key of a settings file
_DIGITS = FormatStrFormatter("%.3g")  # a log axis of less than a decade
# Keys of a row of TRADEOFF that are printed, their heads and formats.
_PRINTED = (
    ("cpu_s_per_whisk", "CPU s/whisk", "13.2f"),
    ("cpu_share_of_standard", "of standard", "13.2f"),
    ("d_x_expected_rms_mm", "expected mm", "13.4f"),
    ("d_x_error_rms_mm", "d_x RMS mm", "13.4f"),
    ("inside_95_percent", "in 95 %", "13.0f"),
)


@dataclass(frozen=True, eq=False)
class Trade:
    """What one setting costs, and how wrong the truth is with it.

    cpu_s, wall_s: seconds a whisk of processor and of wall time. d_x_mm, sigma_mm, errors_mm (n,):
    distance of every whisk, its sigma and its error, NaN where there is none.
    """

    seeing: Seeing
    cpu_s: float
    wall_s: float
    d_x_mm: np.ndarray
    sigma_mm: np.ndarray
    errors_mm: np.ndarray

    @property
    def rms_mm(self) -> float:
        """Return the RMS of the errors; NaN where there is none."""
        finite = self.errors_mm[np.isfinite(self.errors_mm)]
        return float(np.sqrt(np.mean(finite**2))) if len(finite) else np.nan

    @property
    def expected(self) -> ExpectedRms:
        """Return the RMS error that the stated sigmas let one expect, mm."""
        sigmas = self.sigma_mm[np.isfinite(self.errors_mm)]
        return ExpectedRms.of_errors(np.zeros(len(sigmas)), sigmas)

    @property
    def missing(self) -> int:
        """Return the number of whisks without a truth."""
        return int(np.sum(np.isnan(self.d_x_mm)))

    def row(self, standard_cpu_s: float, is_on_front: bool) -> dict:
        """Return the row of TRADEOFF."""
        finite = np.isfinite(self.errors_mm)
        sigma_mm = np.nan
        inside_percent = np.nan
        if np.any(finite):
            is_inside = np.abs(self.errors_mm[finite]) <= Z_95 * self.sigma_mm[finite]
            sigma_mm = float(np.median(self.sigma_mm[finite]))
            inside_percent = 100.0 * np.mean(is_inside)
        return {
            "setting": self.seeing.name,
            "on_front": int(is_on_front),
            "whisks": len(self.d_x_mm),
            "whisks_with_truth": len(self.d_x_mm) - self.missing,
            "cpu_s_per_whisk": self.cpu_s,
            "wall_s_per_whisk": self.wall_s,
            "cpu_share_of_standard": self.cpu_s / standard_cpu_s,
            "d_x_error_rms_mm": self.rms_mm,
            "d_x_expected_rms_mm": self.expected.rms,
            "d_x_expected_low_mm": self.expected.low,
            "d_x_expected_high_mm": self.expected.high,
            "d_x_sigma_median_mm": sigma_mm,
            "inside_95_percent": inside_percent,
        }


def tradeoff(
    path: Path,
    out: Path,
    settings: Settings,
    *,
    repeats: int = 2,
    workers: int = 1,
) -> list[dict]:
    """Time each setting on a session's trials; return the rows of TRADEOFF.

    Written into `out`: tradeoff.csv, tradeoff.png and .svg, and a settings file for each setting on
    the front. settings: of which the trials and follow_links hold. repeats: how often each is
    timed. workers: so many settings are timed at once, each by a process of one thread; they share
    the machine's memory, so times are longest with many. Raise BadInput.
    """
    check_outside(out, path)
    problems = InputProblems()
    session = checked_session(path, problems, follow_links=settings.follow_links)
    recorded = trials_with_whisks(session)
    wanted = _trials_to_time(recorded, settings)
    names = {trial.name for trial in wanted}
    with lock_output(out), Workers(workers) as pool:
        _, units = placed_units(session, recorded, out, settings, pool, problems)
        *_, units = with_gauges(units, pool, problems)
        chosen = [unit for unit in units if unit.trial.name in names]
        ladder = list(settings_to_try(tuple(wanted[0].camera_sources)))
        trades = pool.run(partial(_time_seeing, chosen, repeats), ladder, "settings")
        begin_step("figures")
        trades.append(_time_drawing(chosen, _standard(trades), repeats))
        trades = _with_errors(session, chosen, trades)
    return _write(out, trades)


def _trials_to_time(recorded: Sequence[Trial], settings: Settings) -> list[Trial]:
    """Return the trials with pictures that the settings name. Raise BadInput where none is."""
    wanted = [trial for trial in recorded if settings.takes(trial.name) and trial.camera_sources]
    if not wanted:
        raise BadInput(f"--trials {settings.trials}: no trial with pictures has such a name")
    return wanted


def settings_to_try(cameras: Sequence[str]) -> Iterator[Seeing]:
    """Yield the presets, then the standard with one thing changed.

    Where there are three cameras or more, each is left out in turn.
    """
    yield from map(by_preset, PRESETS)
    standard = PRESETS[STANDARD]
    for name, values in _CHANGES.items():
        for value in values:
            yield Seeing(f"{name}={str(value).lower()}", replace(standard, **{name: value}))
    if len(cameras) < 3:
        return
    for left_out in cameras:
        others = tuple(name for name in cameras if name != left_out)
        yield Seeing(f"without-{left_out}", standard, others)


def front(trades: Sequence[Trade]) -> np.ndarray:
    """Return the mask (n,) of the settings that no other beats in truths, expected error and time."""
    rows = []
    for trade in trades:
        rows.append([trade.missing, trade.expected.to_rank(trade.rms_mm), trade.cpu_s])
    costs = np.array(rows)
    costs[np.isnan(costs)] = np.inf
    return pareto_front(costs)


def _time_seeing(units: Sequence[Unit], repeats: int, seeing: Seeing) -> Trade:
    """Time one setting over the trials, decoding included; the errors are NaN as yet."""
    settings = Settings(seeing=seeing)
    seen, timing = time_work(lambda: see_all(units, settings), repeats)
    distances = [whisk.d_x_mm for trial in seen for whisk in trial.whisks]
    d_x_mm = np.array([distance.value for distance in distances], dtype=float)
    sigma_mm = np.array([distance.sigma for distance in distances], dtype=float)
    count = len(distances)
    errors_mm = np.full(count, np.nan)
    return Trade(seeing, timing.cpu_s / count, timing.wall_s / count, d_x_mm, sigma_mm, errors_mm)


def _time_drawing(units: Sequence[Unit], standard: Trade, repeats: int) -> Trade:
    """Return the standard with the seconds of drawing all figures of the trials added to its own."""
    results = [(unit, trial_result(unit)) for unit in units]
    _, timing = time_work(lambda: draw_all(results), repeats)
    count = len(standard.d_x_mm)
    return replace(
        standard,
        seeing=Seeing(FIGURES, standard.seeing.vision),
        cpu_s=standard.cpu_s + timing.cpu_s / count,
        wall_s=standard.wall_s + timing.wall_s / count,
    )


def _with_errors(session: Session, units: Sequence[Unit], trades: Sequence[Trade]) -> list[Trade]:
    """Return the settings with their errors against the known truth, or the standard."""
    standard_mm = _standard(trades).d_x_mm
    true_mm = []
    for unit in units:
        for number in range(len(forward_strokes(read_signals(unit.trial)))):
            truth = truth_of(session, unit.trial.name, number)
            true_mm.append(np.nan if truth is None else truth["d_x_mm"])
    true_mm = np.array(true_mm, dtype=float)
    reference_mm = np.where(np.isnan(true_mm), standard_mm, true_mm)
    return [replace(trade, errors_mm=trade.d_x_mm - reference_mm) for trade in trades]


def _standard(trades: Sequence[Trade]) -> Trade:
    """Return the trade of the standard preset."""
    return next(trade for trade in trades if trade.seeing.name == STANDARD)


def _write(out: Path, trades: Sequence[Trade]) -> list[dict]:
    """Write table, settings files and plot; return the rows of the table."""
    on_front = front(trades)
    standard_cpu_s = _standard(trades).cpu_s
    rows = []
    for trade, is_on_front in zip(trades, on_front):
        rows.append(trade.row(standard_cpu_s, is_on_front))
        if is_on_front:
            name = trade.seeing.name.replace("=", "-")
            write_whole(out / "settings" / f"{name}.toml", as_toml(trade.seeing))
    TRADEOFF.write(out, rows)
    with style():
        publish(draw(trades, on_front), out / "tradeoff")
    return rows


def tradeoff_lines(rows: Sequence[dict]) -> Iterator[str]:
    """Yield the table as text, the fastest setting first."""
    heads = "".join(f"{head:>13}" for _, head, _ in _PRINTED)
    yield f"{'setting':<18}{'truths':>13}{heads}"
    for row in sorted(rows, key=lambda row: row["cpu_s_per_whisk"]):
        truths = f"{row['whisks_with_truth']}/{row['whisks']}"
        values = "".join(format(row[name], form) for name, _, form in _PRINTED)
        mark = "  on the front" if row["on_front"] else ""
        yield f"{row['setting']:<18}{truths:>13}{values}{mark}"
    whisks = counted(max(row["whisks_with_truth"] for row in rows), "whisk")
    yield (
        f"The front is by the expected error. Measured on {whisks}: of {len(rows)} settings the one that "
        "measures best is the luckiest."
    )


def draw(trades: Sequence[Trade], on_front: Sequence[bool]) -> Figure:
    """Draw expected error against processor time, the front joined, and measured errors as crosses.

    A bar is the range of 95 % of the RMS errors of so many whisks. Presets and what lies on the front
    are named; the rest lie upon each other: tradeoff.csv has them.
    """
    figure = Figure(figsize=(6.0, 4.0), layout="constrained")
    axes = figure.add_subplot()
    points = [(trade.cpu_s, trade.expected.rms) for trade in trades]
    joined = sorted(point for point, is_on_front in zip(points, on_front) if is_on_front)
    axes.plot(*np.array(joined).T, color="0.6", lw=1, zorder=1, label="Pareto front")
    for trade, is_on_front in zip(trades, on_front):
        _draw_setting(axes, trade, is_on_front)
    axes.plot([], [], "o-", color="0.6", lw=0.8, ms=5, label="expected, 95 % by chance")
    axes.plot([], [], "x", color="0.6", ms=4, label="measured")
    axes.set(xlabel="processor time a whisk, s", ylabel="error of d$_x$, RMS, mm", yscale="log")
    axes.yaxis.set_major_formatter(_DIGITS)
    axes.yaxis.set_minor_formatter(_DIGITS)
    axes.margins(x=0.12)
    axes.legend()
    return figure


def _draw_setting(axes: Axes, trade: Trade, is_on_front: bool) -> None:
    """Draw expected error, its range and the measured error of one setting, perhaps with its name."""
    colour = "#2166ac" if is_on_front else "0.6"
    axes.plot(trade.cpu_s, trade.expected.rms, "o", color=colour, ms=5)
    ends = (trade.expected.low, trade.expected.high)
    axes.plot([trade.cpu_s] * 2, ends, color=colour, lw=0.8, alpha=0.6)
    axes.plot(trade.cpu_s, trade.rms_mm, "x", color=colour, ms=4)
    if is_on_front or trade.seeing.name in (*PRESETS, FIGURES):
        axes.annotate(
            trade.seeing.name,
            (trade.cpu_s, trade.expected.rms),
            xytext=(4, 3),
            textcoords="offset points",
            fontsize=7,
            color="0.2" if is_on_front else "0.5",
        )
