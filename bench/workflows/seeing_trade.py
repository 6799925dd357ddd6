"""Time against error of the truth, over the settings of the evaluation of pictures.

Tried are `live` with and without pictures before the push, the presets, the standard with one setting
changed at a time, and the standard with its figures drawn. Each sees the same trials. The time is that
of one core from the last frame of a push to its truth. It is taken several times, and the least counts:
what a clock adds is never negative. Errors are against the known truth where the session is
simulated, else against the preset `standard`. Settings are ranked by the error that their stated
sigmas let one expect, and by the measured one where that is larger than chance explains.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import compress
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.analyses.pooling import rms_of_known
from bench.base.atomic import write_whole
from bench.base.drawing import label_logarithmic, publish, style
from bench.base.errors import BadInput
from bench.base.progress import begin_step
from bench.base.settings import Seeing, Settings
from bench.base.tables import Column, Kind, Table, alike
from bench.base.workers import Workers
from bench.report.score import truth_of
from bench.session.session import Session
from bench.session.signals import forward_strokes, read_signals
from bench.session.trial import Trial
from bench.trials.of_session import require_some
from bench.trials.seeing import PRESETS, STANDARD, as_toml, by_preset
from bench.trials.trial_evaluation import trial_result
from bench.trials.unit import Unit
from bench.workflows.expected_error import ExpectedRms, interval_of_rms
from bench.workflows.opened_session import opened_session
from bench.workflows.pareto import pareto_front, worth_waiting_for
from bench.workflows.seeing_times import draw_all, play_all, see_all, time_work
from estimator.uncertainty import Z_95
from vision import Value
from vision.geometry import counted

TRADEOFF = Table(
    "tradeoff",
    "A row a setting of `whisker-bench tradeoff`. `live` evaluates each push while it is recorded, after "
    "three pictures long before it; `live-cold` without these. `with-figures` is `standard` with planes and "
    "overlays drawn, too: `evaluate` without `--no-figures`.",
    (
        Column("setting", "its name", Kind.TEXT),
        Column(
            "on_front",
            "1 where no other setting is as good in truths, error and time, else 0; by d_x_expected_rms_mm, "
            "or a measured RMS above d_x_expected_high_mm",
        ),
        Column("whisks", "how many whisks were seen", Kind.WHOLE),
        Column("whisks_with_truth", "how many of them have a truth"),
        Column(
            "after_s_per_whisk", "seconds of one core from the last frame of a push to its truth"
        ),
        Column("cpu_s_per_whisk", "seconds of processor, decoding included"),
        Column("wall_s_per_whisk", "seconds of wall time, decoding included"),
        Column(
            "cpu_share_of_standard",
            "processor time over that of the preset `standard` in the same run",
        ),
        Column("reference", "what errors are against: the known `truth`, or `standard`", Kind.TEXT),
        Column("d_x_error_rms_mm", "RMS of the errors"),
        *alike(
            ("d_x_error_low_mm", "d_x_error_high_mm"),
            "its 95 % interval, by as many independent errors as there are trials",
        ),
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
_TRUTH = "truth"
LIVE = "live"
LIVE_COLD = "live-cold"
# [s] From the first three pictures of a push to it, for `live`: all work on them is done then. Stated.
_LEAD_S = 60.0
# [1] An error that may be so many times the measured one is not known. Stated.
_UNKNOWN_FACTOR = 2.0
# Keys of a row of TRADEOFF that are printed, their heads and formats.
_PRINTED = (
    ("after_s_per_whisk", "s after push", "13.2f"),
    ("cpu_s_per_whisk", "CPU s/whisk", "13.2f"),
    ("d_x_expected_rms_mm", "expected mm", "13.4f"),
    ("d_x_error_rms_mm", "d_x RMS mm", "13.4f"),
    ("inside_95_percent", "in 95 %", "13.0f"),
)


@dataclass(frozen=True, eq=False)
class Trade:
    """What one setting costs, and how wrong the truth is with it.

    after_s: seconds of one core a whisk from the last frame to the truth. cpu_s, wall_s: seconds a whisk
    of processor and of wall time. d_x_mm, sigma_mm, errors_mm (n,): distance of every whisk, its sigma and
    its error, NaN where there is none. trial (n,): number of each whisk's trial. reference: what errors
    are against.
    """

    seeing: Seeing
    after_s: float
    cpu_s: float
    wall_s: float
    d_x_mm: np.ndarray
    sigma_mm: np.ndarray
    errors_mm: np.ndarray
    trial: np.ndarray
    reference: str = STANDARD

    @property
    def rms_mm(self) -> float:
        """Return the RMS of the errors; NaN where there is none."""
        return rms_of_known(self.errors_mm)

    @property
    def expected(self) -> ExpectedRms:
        """Return the RMS error that the stated sigmas let one expect, mm."""
        sigmas = self.sigma_mm[np.isfinite(self.errors_mm)]
        return ExpectedRms.of_errors(np.zeros(len(sigmas)), sigmas)

    @property
    def error_interval_mm(self) -> tuple[float, float]:
        """Return the 95 % interval of the RMS error. The whisks of a trial share their bar: they count as one."""
        return interval_of_rms(self.rms_mm, len(np.unique(self.trial[np.isfinite(self.errors_mm)])))

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
        low_mm, high_mm = self.error_interval_mm
        return {
            "setting": self.seeing.name,
            "on_front": int(is_on_front),
            "whisks": len(self.d_x_mm),
            "whisks_with_truth": len(self.d_x_mm) - self.missing,
            "after_s_per_whisk": self.after_s,
            "cpu_s_per_whisk": self.cpu_s,
            "wall_s_per_whisk": self.wall_s,
            "cpu_share_of_standard": self.cpu_s / standard_cpu_s,
            "reference": self.reference,
            "d_x_error_rms_mm": self.rms_mm,
            "d_x_error_low_mm": low_mm,
            "d_x_error_high_mm": high_mm,
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
    with opened_session(path, out, settings, workers, _require_pictures) as opened:
        session, units, pool = opened
        chosen = [unit for unit in units if unit.trial.camera_sources]
        trades = _with_errors(session, chosen, _time_all(chosen, repeats, pool))
    return _write(out, trades)


def _require_pictures(trials: Sequence[Trial], settings: Settings) -> None:
    """Raise BadInput where the settings choose no trial, or none with pictures."""
    require_some(trials, settings)
    if not any(settings.takes(trial.name) and trial.camera_sources for trial in trials):
        raise BadInput(f"--trials {settings.trials}: no trial of such a name has pictures")


def _time_all(units: Sequence[Unit], repeats: int, pool: Workers) -> list[Trade]:
    """Time every setting, the evaluation while pushes are recorded, and the figures."""
    ladder = list(settings_to_try(tuple(units[0].trial.camera_sources)))
    trades = pool.run(partial(_time_seeing, units, repeats), ladder, "settings")
    begin_step("while recorded")
    trades.append(_time_live(units, repeats, LIVE, _LEAD_S))
    trades.append(_time_live(units, repeats, LIVE_COLD, 0.0))
    begin_step("figures")
    trades.append(_time_drawing(units, _standard(trades), repeats))
    return trades


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
    """Return the mask (n,) of the settings that no other beats in truths, expected error and time.

    LIVE_COLD is not on it: whether a camera ran before the push is no choice made after it.
    """
    rows = []
    for trade in trades:
        rows.append([trade.missing, trade.expected.to_rank(trade.rms_mm), trade.after_s])
    costs = np.array(rows)
    costs[np.isnan(costs)] = np.inf
    is_choice = np.array([trade.seeing.name != LIVE_COLD for trade in trades])
    costs[~is_choice] = np.inf
    return pareto_front(costs) & is_choice


def _time_seeing(units: Sequence[Unit], repeats: int, seeing: Seeing) -> Trade:
    """Time one setting over the trials, decoding included; the errors are NaN as yet."""
    settings = Settings(seeing=seeing)
    seen, timing = time_work(lambda: see_all(units, settings), repeats)
    distances = [whisk.d_x_mm for trial in seen for whisk in trial.whisks]
    count = len(distances)
    cpu_s = timing.cpu_s / count
    return _trade(seeing, units, distances, (cpu_s, cpu_s, timing.wall_s / count))


def _time_live(units: Sequence[Unit], repeats: int, name: str, lead_s: float) -> Trade:
    """Time the evaluation while pushes are recorded; the errors are NaN as yet. lead_s: see `play_all`."""
    played = [play_all(units, lead_s) for _ in range(repeats)]
    after_s = min(one.after_s for one in played)
    busy_s = min(one.busy_s for one in played)
    return _trade(Seeing(name), units, played[0].d_x_mm, (after_s, busy_s, np.nan))


def _trade(
    seeing: Seeing,
    units: Sequence[Unit],
    distances: Sequence[Value],
    seconds: tuple[float, float, float],
) -> Trade:
    """Return a setting with distances and seconds (after the push, of processor, of wall time) a whisk."""
    d_x_mm = np.array([distance.value for distance in distances], dtype=float)
    sigma_mm = np.array([distance.sigma for distance in distances], dtype=float)
    trial = []
    for number, unit in enumerate(units):
        trial += [number] * len(forward_strokes(read_signals(unit.trial)))
    errors_mm = np.full(len(d_x_mm), np.nan)
    after_s, cpu_s, wall_s = seconds
    return Trade(seeing, after_s, cpu_s, wall_s, d_x_mm, sigma_mm, errors_mm, np.array(trial))


def _time_drawing(units: Sequence[Unit], standard: Trade, repeats: int) -> Trade:
    """Return the standard with the seconds of drawing all figures of the trials added to its own."""
    results = [(unit, trial_result(unit)) for unit in units]
    _, timing = time_work(lambda: draw_all(results), repeats)
    count = len(standard.d_x_mm)
    return replace(
        standard,
        seeing=Seeing(FIGURES, standard.seeing.vision),
        after_s=standard.after_s + timing.cpu_s / count,
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
    reference = STANDARD if np.isnan(true_mm).any() else _TRUTH
    reference_mm = standard_mm if reference == STANDARD else true_mm
    found = []
    for trade in trades:
        errors_mm = trade.d_x_mm - reference_mm
        found.append(replace(trade, errors_mm=errors_mm, reference=reference))
    return found


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
        if is_on_front and trade.seeing.name != LIVE:
            write_whole(out / "settings" / _file_name(trade.seeing.name), as_toml(trade.seeing))
    TRADEOFF.write(out, rows)
    with style():
        publish(draw(trades, on_front), out / "tradeoff")
    return rows


def tradeoff_lines(rows: Sequence[dict]) -> Iterator[str]:
    """Yield the table as text, the fastest setting first."""
    heads = "".join(f"{head:>13}" for _, head, _ in _PRINTED)
    yield f"{'setting':<18}{'truths':>13}{heads}"
    for row in sorted(rows, key=_after_s):
        truths = f"{row['whisks_with_truth']}/{row['whisks']}"
        values = "".join(format(row[name], form) for name, _, form in _PRINTED)
        mark = "  on the front" if row["on_front"] else ""
        yield f"{row['setting']:<18}{truths:>13}{values}{mark}"
    steps = advised(rows)
    yield _measured_line(steps, rows)
    parts = [f"for d_x ± {_ranked_mm(row):.2g} mm use {_use(row)}" for row in steps]
    slower = "" if len(steps) > 1 else "; nothing slower is expected to err clearly less"
    yield f"F{'; '.join(parts)[1:]}{slower}."


def advised(rows: Sequence[dict]) -> list[dict]:
    """Return the rows of the front that are worth their time, the fastest first.

    Each is expected to err clearly less than any faster one, and none has fewer truths than `standard`.
    """
    (standard,) = [row for row in rows if row["setting"] == STANDARD]
    by_time = sorted(rows, key=_after_s)
    errors_mm = []
    for row in by_time:
        has_fewer = row["whisks_with_truth"] < standard["whisks_with_truth"]
        is_choice = row["on_front"] and not has_fewer
        errors_mm.append(_ranked_mm(row) if is_choice else np.inf)
    return list(compress(by_time, worth_waiting_for(errors_mm)))


def pick_line(rows: Sequence[dict], accuracy_mm: float, out: Path) -> str:
    """Return which setting is the fastest that is expected to err by no more, in words, and how it is used."""
    steps = advised(rows)
    for row in steps:
        if _ranked_mm(row) <= accuracy_mm:
            how = f"evaluate --settings {out / 'settings' / _file_name(row['setting'])}"
            if row["setting"] == LIVE:
                how = "the verb live, or bench.api.live"
            return f"Within {accuracy_mm:g} mm: {_use(row)}: {how}"
    least = min((_ranked_mm(row) for row in steps), default=np.nan)
    return f"Within {accuracy_mm:g} mm: none; the least that is expected is {least:.2g} mm"


def _after_s(row: dict) -> float:
    """Return the seconds from the last frame to the truth; infinite where it cannot be had so."""
    seconds = row["after_s_per_whisk"]
    return seconds if np.isfinite(seconds) else np.inf


def _ranked_mm(row: dict) -> float:
    """Return the error that a row of TRADEOFF is ranked by."""
    low_mm, high_mm = row["d_x_expected_low_mm"], row["d_x_expected_high_mm"]
    return ExpectedRms(row["d_x_expected_rms_mm"], low_mm, high_mm).to_rank(row["d_x_error_rms_mm"])


def _use(row: dict) -> str:
    """Return a setting and its time in words."""
    return f"{row['setting']} ({row['after_s_per_whisk']:.2g} s of a core after the push)"


def _measured_line(steps: Sequence[dict], rows: Sequence[dict]) -> str:
    """Return how far measured errors bear out the front, in words."""
    whisks = counted(max(row["whisks_with_truth"] for row in rows), "whisk")
    reference = rows[0]["reference"]
    said = []
    for row in steps:
        rms_mm, high_mm = row["d_x_error_rms_mm"], row["d_x_error_high_mm"]
        if row["setting"] != reference and high_mm > 0:
            said.append(f"{row['setting']} {rms_mm:.2g} mm RMS, {high_mm:.2g} at most")
    measured = f"against {reference} on {whisks}: {', '.join(said)} (95 %)" if said else "nothing"
    is_vague = any(row["d_x_error_high_mm"] > _UNKNOWN_FACTOR * _ranked_mm(row) for row in steps)
    few = "; so few whisks cannot show whether the sigmas hold" if is_vague or not said else ""
    return f"By stated sigmas (±, one sigma, RMS over whisks). Measured {measured}{few}."


def _file_name(setting: str) -> str:
    """Return the name of a setting's file."""
    return f"{setting.replace('=', '-')}.toml"


def draw(trades: Sequence[Trade], on_front: Sequence[bool]) -> Figure:
    """Draw expected error against the time after a push, the front joined, measured errors as crosses.

    A bar is the range of 95 % of the RMS errors of so many whisks. Presets and what lies on the front
    are named; the rest lie upon each other: tradeoff.csv has them.
    """
    figure = Figure(figsize=(6.0, 4.0), layout="constrained")
    axes = figure.add_subplot()
    points = [(trade.after_s, trade.expected.rms) for trade in trades]
    joined = sorted(point for point, is_on_front in zip(points, on_front) if is_on_front)
    axes.plot(*np.array(joined).T, color="0.6", lw=1, zorder=1, label="Pareto front")
    for trade, is_on_front in zip(trades, on_front):
        _draw_setting(axes, trade, is_on_front)
    axes.plot([], [], "o-", color="0.6", lw=0.8, ms=5, label="expected, 95 % by chance")
    axes.plot([], [], "x", color="0.6", ms=4, label="measured")
    axes.set(xlabel="from the last frame of a push to its truth, s of one core", xscale="log")
    axes.set(ylabel="error of d$_x$, RMS, mm", yscale="log")
    label_logarithmic(axes.xaxis)
    label_logarithmic(axes.yaxis)
    axes.margins(x=0.12, y=0.2)
    figure.legend(loc="outside lower center", ncols=3)
    return figure


def _draw_setting(axes: Axes, trade: Trade, is_on_front: bool) -> None:
    """Draw expected error, its range and the measured error of one setting, perhaps with its name."""
    colour = "#2166ac" if is_on_front else "0.6"
    axes.plot(trade.after_s, trade.expected.rms, "o", color=colour, ms=5)
    ends = (trade.expected.low, trade.expected.high)
    axes.plot([trade.after_s] * 2, ends, color=colour, lw=0.8, alpha=0.6)
    axes.plot(trade.after_s, trade.rms_mm, "x", color=colour, ms=4)
    if is_on_front or trade.seeing.name in (*PRESETS, FIGURES, LIVE, LIVE_COLD):
        is_below = trade.seeing.name == LIVE_COLD  # it takes as long as `draft` does
        axes.annotate(
            trade.seeing.name,
            (trade.after_s, trade.expected.low if is_below else trade.expected.high),
            xytext=(0, -3 if is_below else 3),
            textcoords="offset points",
            rotation=60,
            ha="right" if is_below else "left",
            va="top" if is_below else "bottom",
            fontsize=7,
            color="0.2" if is_on_front else "0.5",
        )
