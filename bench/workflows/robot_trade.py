"""The robot's trade: error of each estimator against the milliseconds since touch, and what its converter costs.

From one recording: pushed further and further, at each speed that was recorded, through filters, slower and coarser
converters, one changed at a time. Measured: bias and scatter over the whisks. Expected: (13), (14) and docs/maps.md at
the slope and friction seen, and the noise as stated.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, ScalarFormatter

from bench.base.atomic import lock_output
from bench.base.doubts import Doubts
from bench.base.drawing import colour_of, label_of, publish, style
from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.base.tables import WHISKS_KNOWN, WHISKS_WITHOUT, Column, Kind, Table, alike
from bench.base.workers import Workers
from bench.report.evaluation import finished
from bench.session.inside import check_outside
from bench.session.session_check import checked_session
from bench.session.signals import read_signals
from bench.trials.lost import evaluate_units
from bench.trials.of_session import placed_units, require_some, trials_with_whisks, with_gauges
from bench.workflows.robot_answers import Converter, Task, answers_of_trial, range_of

FIGURE = "robot_trade"
AS_RECORDED = Converter()
CONVERTERS = (
    AS_RECORDED,
    *(Converter(cutoff_Hz=cutoff) for cutoff in (5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 400.0)),
    *(Converter(every=every) for every in (2, 5, 10, 20, 50)),
    *(Converter(bits=bits) for bits in (6, 8, 10, 12)),
)
_FEWEST_SHARE = 0.9  # of a panel's whisks: who answers fewer answers about other whisks


@dataclass(frozen=True)
class Point:
    """One estimator behind one converter, at one speed and push: milliseconds from touch to answer; whisks with a
    distance, and without; errors and what was to be expected of them, % of d_x. cutoff_Hz, bits: NaN as recorded."""

    estimator: str
    speed_deg_s: float
    cutoff_Hz: float
    rate_Hz: float
    bits: float
    push_deg: float
    time_ms: float
    whisks: int
    none: int
    error_mean_percent: float
    error_sd_percent: float
    error_rms_percent: float
    expected_mean_percent: float
    expected_sd_percent: float
    expected_rms_percent: float

    @property
    def as_recorded(self) -> bool:
        """Whether neither filter nor bits were changed; the rate may be."""
        return bool(np.isnan(self.cutoff_Hz) and np.isnan(self.bits))


ROBOT_TRADE = Table(
    "robot_trade",
    "A row an estimator, converter, speed and push of `whisker-bench robot`, over the measured "
    "whisks whose truth is sound.",
    (
        Column(
            "on_front",
            "1 where no other row is better in milliseconds and in RMS error, of those that answer "
            "about nearly all whisks, else 0",
        ),
        Column("estimator", "as in estimates.csv", Kind.TEXT),
        Column("speed_deg_s", "speed of the motor, to two digits"),
        Column("cutoff_Hz", "of a causal low-pass (fourth order); empty as recorded"),
        Column("rate_Hz", "samples a second"),
        Column("bits", "over the range that the session's signals fill; empty as recorded"),
        Column(
            "push_deg",
            "from touch seen to where the motor is when it answers; the estimate's θ is half a "
            "window less",
        ),
        Column("time_ms", "from touch to answer: the push, the filter's delay, and a sample"),
        WHISKS_KNOWN,
        WHISKS_WITHOUT,
        *alike(
            ("error_mean_percent", "error_sd_percent", "error_rms_percent"),
            "measured: mean, scatter and RMS of the errors over the whisks, % of d_x",
        ),
        *alike(
            ("expected_mean_percent", "expected_sd_percent", "expected_rms_percent"),
            "expected: the same by (13), (14) and docs/maps.md at the slope and friction seen, "
            "with the noise as stated",
        ),
    ),
)


def robot_trade(
    session_path: Path, out: Path, settings: Settings, *, workers: int = 1, progress: bool = False
) -> list[Point]:
    """Table and figure in `out`, which holds the session's evaluation too: what of it stands is not made again. Raises
    BadInput, also where no whisk has both a truth and moments."""
    check_outside(out, session_path)
    doubts = Doubts()
    session = checked_session(session_path, doubts, follow_links=settings.follow_links)
    recorded = trials_with_whisks(session)
    require_some(recorded, settings)
    with lock_output(out), Workers(workers, progress) as pool:
        _, units = placed_units(session, recorded, out, settings, pool, doubts)
        *_, units = with_gauges(units, pool, doubts)
        chosen = [unit for unit in units if settings.takes(unit.trial.name)]
        results = finished(evaluate_units(chosen, pool), session.whisker, settings).results
        range_V = np.max(
            [range_of(read_signals(unit.trial)) for unit in chosen], axis=0, initial=0.0
        )
        tasks = [Task(unit, result, CONVERTERS, range_V) for unit, result in zip(chosen, results)]
        answers = [
            answer for found in pool.run(answers_of_trial, tasks, "answers") for answer in found
        ]
    if not answers:
        raise BadInput(
            "no whisk has both a sound truth and moments; evaluate says why", file=session_path
        )
    points = pooled(answers)
    on_front = front(points)
    ROBOT_TRADE.write(
        out, ({"on_front": int(there)} | vars(p) for p, there in zip(points, on_front))
    )
    with style():
        publish(draw(points, on_front), out / FIGURE)
    return points


def pooled(answers: Sequence) -> list[Point]:
    """Over the whisks of one speed."""
    groups: dict[tuple, list] = {}
    for a in answers:
        key = a.estimator, float(f"{a.speed_deg_s:.2g}"), a.converter, a.push_deg
        groups.setdefault(key, []).append(a)
    return [_point(*key, found) for key, found in groups.items()]


def _point(
    estimator: str, speed_deg_s: float, converter: Converter, push_deg: float, found: Sequence
) -> Point:
    table = np.array([(a.error_percent, a.expected_percent, a.noise_percent) for a in found])
    known = table[np.isfinite(table).all(axis=1)]
    error, expected, noise = known.T
    nan = np.full(3, np.nan)
    measured = _moments(error) if len(known) else nan
    predicted = _moments(expected, noise) if len(known) else nan
    given = (
        converter.cutoff_Hz or np.nan,
        float(np.median([a.rate_Hz for a in found])),
        converter.bits or np.nan,
    )
    late_ms = 1e3 * float(np.median([a.time_s for a in found]))
    count = len(known), len(found) - len(known)
    return Point(
        estimator,
        speed_deg_s,
        *given,
        push_deg,
        late_ms,
        *count,
        *measured.tolist(),
        *predicted.tolist(),
    )


def _moments(values: np.ndarray, noise: np.ndarray | float = 0.0) -> np.ndarray:
    """Mean, standard deviation and RMS (3,) of values that have this noise besides."""
    added = np.mean(np.square(noise))
    return np.array(
        [values.mean(), np.sqrt(values.var() + added), np.sqrt(np.mean(values**2) + added)]
    )


def front(points: Sequence[Point]) -> list[bool]:
    """Which points no other beats in both milliseconds and RMS error, of those that answer about nearly all whisks."""
    most = max(p.whisks + p.none for p in points)
    cost = np.array(
        [
            [p.time_ms, p.error_rms_percent] if p.whisks >= _FEWEST_SHARE * most else [np.inf] * 2
            for p in points
        ]
    )
    return [
        bool(
            np.isfinite(one).all()
            and not np.any(np.all(cost <= one, axis=1) & np.any(cost < one, axis=1))
        )
        for one in cost
    ]


def trade_lines(points: Sequence[Point]) -> Iterator[str]:
    """The front as text."""
    yield f"{'ms':>8}{'error RMS':>11}{'mean':>9}{'expected':>10}   estimator, push, converter"
    on_front = [p for p, there in zip(points, front(points)) if there]
    for p in sorted(on_front, key=lambda p: p.time_ms):
        through = [f"{p.rate_Hz:.0f} Hz"]
        through += [f"low-pass {p.cutoff_Hz:g} Hz"] * bool(np.isfinite(p.cutoff_Hz))
        through += [f"{p.bits:.0f} bits"] * bool(np.isfinite(p.bits))
        yield (
            f"{p.time_ms:8.0f}{p.error_rms_percent:9.2f} %{p.error_mean_percent:+7.2f} %{p.expected_rms_percent:8.2f} %"
            f"   {label_of(p.estimator)}, {p.push_deg:g}° at {p.speed_deg_s:g}°/s, {', '.join(through)}"
        )


def draw(points: Sequence[Point], on_front: Sequence[bool]) -> Figure:
    """Error against milliseconds with the front, and against cut-off, rate and bits at the push nearest to 3°."""
    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    time, cutoff, rate, bits = figure.subplots(2, 2).ravel()
    names = list(dict.fromkeys(p.estimator for p in points))
    _against_time(time, points, on_front, names)
    push = min({p.push_deg for p in points}, key=lambda deg: abs(deg - 3.0))
    usual = [p for p in points if p.push_deg == push]
    most_Hz = max(p.rate_Hz for p in usual)
    through = [p for p in usual if p.rate_Hz == most_Hz]
    _against(cutoff, [p for p in through if np.isfinite(p.cutoff_Hz)], "cutoff_Hz", names)
    _against(rate, [p for p in usual if p.as_recorded], "rate_Hz", names)
    _against(bits, [p for p in through if np.isfinite(p.bits)], "bits", names)
    for axes, what in (
        (cutoff, "cut-off, Hz"),
        (rate, "samples a second"),
        (bits, "bits of the converter"),
    ):
        axes.set(xlabel=what, ylabel="error of d$_x$, RMS, %", title=f"pushed by {push:g}°")
    figure.legend(
        *time.get_legend_handles_labels(), loc="outside lower center", ncols=len(names) + 2
    )
    return figure


def _against_time(
    axes: Axes, points: Sequence[Point], on_front: Sequence[bool], names: Sequence[str]
) -> None:
    for number, name in enumerate(names):
        mine = [
            (p.time_ms, p.error_rms_percent) for p in points if p.estimator == name and p.whisks
        ]
        axes.plot(
            *np.array(mine).reshape(-1, 2).T,
            "o",
            ms=3,
            alpha=0.5,
            color=colour_of(name, number),
            mew=0,
            label=label_of(name),
        )
    joined = sorted((p.time_ms, p.error_rms_percent) for p, there in zip(points, on_front) if there)
    axes.plot(*np.array(joined).reshape(-1, 2).T, color="0.2", lw=1, label="Pareto front")
    axes.plot([], [], "--", color="0.4", lw=1, label="expected")
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="from touch to answer, ms",
        ylabel="error of d$_x$, RMS, %",
    )
    _plain(axes.xaxis, axes.yaxis)


def _plain(*axes: Axis) -> None:
    """Logarithmic axes with numbers at 1, 2 and 5."""
    for axis in axes:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(ScalarFormatter())
        axis.set_minor_formatter("")


def _against(axes: Axes, points: Sequence[Point], what: str, names: Sequence[str]) -> None:
    """Measured solid, expected dashed; a line an estimator and speed."""
    for number, name in enumerate(names):
        for speed in sorted({p.speed_deg_s for p in points}):
            mine = sorted(
                (getattr(p, what), p.error_rms_percent, p.expected_rms_percent)
                for p in points
                if p.estimator == name and p.speed_deg_s == speed and p.whisks
            )
            if mine:
                x, measured, expected = np.array(mine).T
                axes.plot(x, measured, "o-", ms=3, lw=1, color=colour_of(name, number))
                axes.plot(x, expected, "--", lw=1, color=colour_of(name, number))
    axes.set(yscale="log", xscale="linear" if what == "bits" else "log")
    _plain(axes.yaxis, *[axes.xaxis] * (what != "bits"))
