"""The robot's trade: error of each estimator against the milliseconds since touch, and its converter.

From one recording: pushed further and further, at each speed that was recorded, through filters,
slower and coarser converters, one changed at a time. Measured: bias and scatter over the whisks.
Expected: (13), (14) and docs/maps.md at the slope and friction seen, and the noise as stated.
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
from bench.workflows.pareto import pareto_front
from bench.workflows.robot_answers import Answer, Converter, Task, answers_of_trial, range_of

FIGURE = "robot_trade"
CONVERTERS = (
    Converter(),  # as recorded
    *(Converter(cutoff_Hz=cutoff) for cutoff in (5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 400.0)),
    *(Converter(every=every) for every in (2, 5, 10, 20, 50)),
    *(Converter(bits=bits) for bits in (6, 8, 10, 12)),
)
# [1] Least share of all whisks that an estimator on the front has a distance for: with fewer its
# error is that of other whisks. Stated.
_LEAST_SHARE = 0.9
# [°] Push that the figure compares converters at, or the nearest to it. Stated.
_USUAL_PUSH_DEG = 3.0


@dataclass(frozen=True)
class Point:
    """One estimator through one converter, at one speed and push, over its whisks.

    cutoff_Hz, bits: NaN as recorded. time_ms: from touch to the estimate. whisks, none: how many
    have a distance, and have none. The errors are mean, standard deviation and RMS, % of d_x.
    """

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
    def is_unfiltered_and_unrounded(self) -> bool:
        """Return whether neither filter nor bits were changed; the rate may be."""
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
    """Write table and figure into `out`, and return the points.

    `out` holds the session's evaluation, too: what of it is there already is not made again. Raise
    BadInput, also where no whisk has both a truth and moments.
    """
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
        ranges_V = [range_of(read_signals(unit.trial)) for unit in chosen]
        range_V = np.max(ranges_V, axis=0, initial=0.0)
        tasks = [Task(unit, result, CONVERTERS, range_V) for unit, result in zip(chosen, results)]
        answers = []
        for of_trial in pool.run(answers_of_trial, tasks, "answers"):
            answers += of_trial
    if not answers:
        raise BadInput(
            "no whisk has both a sound truth and moments; evaluate says why", file=session_path
        )
    points = pool_answers(answers)
    on_front = front(points)
    rows = []
    for point, is_on_front in zip(points, on_front):
        rows.append({"on_front": int(is_on_front)} | vars(point))
    ROBOT_TRADE.write(out, rows)
    with style():
        publish(draw(points, on_front), out / FIGURE)
    return points


def pool_answers(answers: Sequence[Answer]) -> list[Point]:
    """Return a point for each estimator, speed (to two digits), converter and push."""
    groups: dict[tuple, list[Answer]] = {}
    for one in answers:
        speed_deg_s = float(f"{one.speed_deg_s:.2g}")
        key = (one.estimator, speed_deg_s, one.converter, one.push_deg)
        groups.setdefault(key, []).append(one)
    return [_point(group, key[1]) for key, group in groups.items()]


def _point(answers: Sequence[Answer], speed_deg_s: float) -> Point:
    """Return the point of answers of one estimator, converter and push."""
    first = answers[0]
    rows = [(one.error_percent, one.expected_percent, one.noise_percent) for one in answers]
    table = np.array(rows)  # (answers, 3) %
    known = table[np.isfinite(table).all(axis=1)]
    error, expected, noise = known.T
    error_mean, error_sd, error_rms = _moments(error, np.zeros(len(known)))
    expected_mean, expected_sd, expected_rms = _moments(expected, noise)
    return Point(
        estimator=first.estimator,
        speed_deg_s=speed_deg_s,
        cutoff_Hz=first.converter.cutoff_Hz or np.nan,
        rate_Hz=float(np.median([one.rate_Hz for one in answers])),
        bits=first.converter.bits or np.nan,
        push_deg=first.push_deg,
        time_ms=1e3 * float(np.median([one.time_s for one in answers])),
        whisks=len(known),
        none=len(answers) - len(known),
        error_mean_percent=error_mean,
        error_sd_percent=error_sd,
        error_rms_percent=error_rms,
        expected_mean_percent=expected_mean,
        expected_sd_percent=expected_sd,
        expected_rms_percent=expected_rms,
    )


def _moments(values: np.ndarray, noise: np.ndarray) -> tuple[float, float, float]:
    """Return mean, standard deviation and RMS of values (n,) that noise of these sigmas (n,) is
    added to; NaN of no values."""
    if not len(values):
        return np.nan, np.nan, np.nan
    added = np.mean(noise**2)
    deviation = np.sqrt(values.var() + added)
    rms = np.sqrt(np.mean(values**2) + added)
    return float(values.mean()), float(deviation), float(rms)


def front(points: Sequence[Point]) -> np.ndarray:
    """Return the mask (n,) of the points that no other beats in both milliseconds and RMS error.

    Points with a distance for too few whisks are not on it.
    """
    whisks = np.array([point.whisks for point in points])
    without = np.array([point.none for point in points])
    costs = np.array([[point.time_ms, point.error_rms_percent] for point in points])
    has_few = whisks < _LEAST_SHARE * np.max(whisks + without)
    costs[has_few] = np.inf
    return pareto_front(costs) & np.isfinite(costs).all(axis=1)


def trade_lines(points: Sequence[Point]) -> Iterator[str]:
    """Yield the front as text, the fastest first."""
    yield f"{'ms':>8}{'error RMS':>11}{'mean':>9}{'expected':>10}   estimator, push, converter"
    on_front = [point for point, is_on_front in zip(points, front(points)) if is_on_front]
    for point in sorted(on_front, key=lambda point: point.time_ms):
        converter = [f"{point.rate_Hz:.0f} Hz"]
        if np.isfinite(point.cutoff_Hz):
            converter.append(f"low-pass {point.cutoff_Hz:g} Hz")
        if np.isfinite(point.bits):
            converter.append(f"{point.bits:.0f} bits")
        errors = (
            f"{point.error_rms_percent:9.2f} %{point.error_mean_percent:+7.2f} %"
            f"{point.expected_rms_percent:8.2f} %"
        )
        push = f"{point.push_deg:g}° at {point.speed_deg_s:g}°/s"
        whose = f"{label_of(point.estimator)}, {push}, {', '.join(converter)}"
        yield f"{point.time_ms:8.0f}{errors}   {whose}"


def draw(points: Sequence[Point], on_front: Sequence[bool]) -> Figure:
    """Draw error against milliseconds with the front, and against cut-off, rate and bits.

    The last three are at the push nearest to _USUAL_PUSH_DEG.
    """
    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    time, cutoff, rate, bits = figure.subplots(2, 2).ravel()
    names = list(dict.fromkeys(point.estimator for point in points))
    _draw_against_time(time, points, on_front, names)
    pushes_deg = {point.push_deg for point in points}
    push_deg = min(pushes_deg, key=lambda deg: abs(deg - _USUAL_PUSH_DEG))
    usual = [point for point in points if point.push_deg == push_deg]
    full_rate_Hz = max(point.rate_Hz for point in usual)
    at_full_rate = [point for point in usual if point.rate_Hz == full_rate_Hz]
    filtered = [point for point in at_full_rate if np.isfinite(point.cutoff_Hz)]
    thinned = [point for point in usual if point.is_unfiltered_and_unrounded]
    rounded = [point for point in at_full_rate if np.isfinite(point.bits)]
    _draw_against(cutoff, filtered, "cutoff_Hz", names)
    _draw_against(rate, thinned, "rate_Hz", names)
    _draw_against(bits, rounded, "bits", names)
    cutoff.set_xlabel("cut-off, Hz")
    rate.set_xlabel("samples a second")
    bits.set_xlabel("bits of the converter")
    for axes in (cutoff, rate, bits):
        axes.set(ylabel="error of d$_x$, RMS, %", title=f"pushed by {push_deg:g}°")
    handles, labels = time.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(names) + 2)
    return figure


def _draw_against_time(
    axes: Axes, points: Sequence[Point], on_front: Sequence[bool], names: Sequence[str]
) -> None:
    """Draw the error of every point against its milliseconds, and the front."""
    for number, name in enumerate(names):
        own = [point for point in points if point.estimator == name and point.whisks]
        axes.plot(
            [point.time_ms for point in own],
            [point.error_rms_percent for point in own],
            "o",
            ms=3,
            alpha=0.5,
            color=colour_of(name, number),
            mew=0,
            label=label_of(name),
        )
    joined = []
    for point, is_on_front in zip(points, on_front):
        if is_on_front:
            joined.append((point.time_ms, point.error_rms_percent))
    time_ms, error_percent = np.array(sorted(joined)).reshape(-1, 2).T
    axes.plot(time_ms, error_percent, color="0.2", lw=1, label="Pareto front")
    axes.plot([], [], "--", color="0.4", lw=1, label="expected")
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="from touch to answer, ms",
        ylabel="error of d$_x$, RMS, %",
    )
    _label_logarithmic(axes.xaxis)
    _label_logarithmic(axes.yaxis)


def _draw_against(axes: Axes, points: Sequence[Point], column: str, names: Sequence[str]) -> None:
    """Draw measured (solid) and expected error (dashed) over a column of ROBOT_TRADE.

    There is a line an estimator and speed.
    """
    speeds_deg_s = sorted({point.speed_deg_s for point in points})
    for number, name in enumerate(names):
        colour = colour_of(name, number)
        for speed_deg_s in speeds_deg_s:
            own = []
            for point in points:
                is_own = point.estimator == name and point.speed_deg_s == speed_deg_s
                if is_own and point.whisks:
                    errors = (point.error_rms_percent, point.expected_rms_percent)
                    own.append((getattr(point, column), *errors))
            if own:
                x, measured, expected = np.array(sorted(own)).T
                axes.plot(x, measured, "o-", ms=3, lw=1, color=colour)
                axes.plot(x, expected, "--", lw=1, color=colour)
    axes.set_yscale("log")
    _label_logarithmic(axes.yaxis)
    if column != "bits":
        axes.set_xscale("log")
        _label_logarithmic(axes.xaxis)


def _label_logarithmic(axis: Axis) -> None:
    """Label a logarithmic axis with plain numbers at 1, 2 and 5."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(ScalarFormatter())
    axis.set_minor_formatter("")
