"""The robot's trade: error of each estimator against the milliseconds since touch, and its converter.

From one recording: pushed further and further, at each speed that was recorded, through filters,
slower and coarser converters, one changed at a time. Measured: bias and scatter over the whisks.
Expected: (13), (14) and docs/maps.md at the slope and friction seen, and the noise as stated; by that
choices are ranked and drawn, since of many that few whisks measure the best is the luckiest.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from operator import attrgetter
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.analyses.pooling import column
from bench.base.drawing import (
    colour_of,
    label_logarithmic,
    label_of,
    name_stage,
    nested_size,
    publish,
    style,
)
from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.records.trial_result import BY_STAGE, TrialResult
from bench.report.evaluation import evaluated_run
from bench.session.signals import read_signals
from bench.trials.lost import evaluate_units
from bench.trials.unit import Unit
from bench.workflows.opened_session import opened_session
from bench.workflows.robot_answers import Answer, Converter, Task, answers_of_trial, range_of
from bench.workflows.robot_points import ROBOT_TRADE, Point, front, pool_answers

FIGURE = "robot_trade"
CONVERTERS = (
    Converter(),  # as recorded
    *(Converter(cutoff_Hz=cutoff) for cutoff in (5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 400.0)),
    *(Converter(every=every) for every in (2, 5, 10, 20, 50)),
    *(Converter(bits=bits) for bits in (6, 8, 10, 12)),
)
# [°] Push that the figure compares converters at, or the nearest to it. Stated.
_USUAL_PUSH_DEG = 3.0


def robot_trade(
    session_path: Path, out: Path, settings: Settings, *, workers: int = 1
) -> list[Point]:
    """Write table and figure into `out`, and return the points.

    `out` holds the session's evaluation, too: what of it is there already is not made again. Raise
    BadInput, also where no whisk has both a truth and moments.
    """
    answers = _answers_of_session(session_path, out, settings, workers)
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
        figure = draw(points, on_front)
        if points[0].truth_source == BY_STAGE:
            name_stage(figure)
        publish(figure, out / FIGURE)
    return points


def _answers_of_session(
    session_path: Path, out: Path, settings: Settings, workers: int
) -> list[Answer]:
    """Evaluate the session into `out`; return all answers about its whisks. Raise BadInput."""
    with opened_session(session_path, out, settings, workers) as (session, units, pool):
        results = evaluated_run(evaluate_units(units, pool), session.whisker, settings).results
        of_trials = pool.run(answers_of_trial, _tasks(units, results), "answers")
    return list(chain.from_iterable(of_trials))


def _tasks(units: Sequence[Unit], results: Sequence[TrialResult]) -> list[Task]:
    """Return a task a trial: through every converter, its bits over the range that all signals fill."""
    ranges_V = [range_of(read_signals(unit.trial)) for unit in units]
    range_V = np.max(ranges_V, axis=0, initial=0.0)
    return [Task(unit, result, CONVERTERS, range_V) for unit, result in zip(units, results)]


def draw(points: Sequence[Point], on_front: Sequence[bool]) -> Figure:
    """Draw expected error against milliseconds with the front, and against cut-off, rate and bits.

    The last three are at the push nearest to _USUAL_PUSH_DEG.
    """
    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    time, *others = figure.subplots(2, 2).ravel()
    names = list(dict.fromkeys(point.estimator for point in points))
    _draw_against_time(time, points, on_front, names)
    pushes_deg = {point.push_deg for point in points}
    push_deg = min(pushes_deg, key=lambda deg: abs(deg - _USUAL_PUSH_DEG))
    usual = [point for point in points if point.push_deg == push_deg]
    for axes, panel in zip(others, _panels(usual)):
        _draw_against(axes, panel.points, panel.column, names)
        title = f"pushed by {push_deg:g}°"
        axes.set(xlabel=panel.label, ylabel="error of d$_x$, RMS, %", title=title)
    handles, labels = time.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


@dataclass(frozen=True)
class _Panel:
    """A panel of the figure: the column of ROBOT_TRADE that it goes over, its label, its points."""

    column: str
    label: str
    points: Sequence[Point]


def _panels(points: Sequence[Point]) -> tuple[_Panel, ...]:
    """Return the panels over cut-off, rate and bits, one changed at a time. points: at one push."""
    full_rate_Hz = max(point.rate_Hz for point in points)
    at_full_rate = [point for point in points if point.rate_Hz == full_rate_Hz]
    filtered = [point for point in at_full_rate if np.isfinite(point.cutoff_Hz)]
    thinned = [point for point in points if point.is_unfiltered_and_unrounded]
    rounded = [point for point in at_full_rate if np.isfinite(point.bits)]
    return (
        _Panel("cutoff_Hz", "cut-off, Hz", filtered),
        _Panel("rate_Hz", "samples a second", thinned),
        _Panel("bits", "bits of the converter", rounded),
    )


def _draw_against_time(
    axes: Axes, points: Sequence[Point], on_front: Sequence[bool], names: Sequence[str]
) -> None:
    """Draw the expected error of every point against its milliseconds, and the front.

    On the front a bar is the range of 95 % of the RMS errors of so many whisks, and a cross the
    measured one.
    """
    for number, name in enumerate(names):
        own = [point for point in points if point.estimator == name and point.whisks]
        axes.plot(
            column(own, "time_ms"),
            column(own, "expected_rms_percent"),
            "o",
            ms=nested_size(number, len(names), least=3.0, step=1.0),
            alpha=0.5,
            color=colour_of(name, number),
            mew=0,
            label=label_of(name),
        )
    _draw_front(axes, [point for point, is_on_front in zip(points, on_front) if is_on_front])
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="from touch to answer, ms",
        ylabel="error of d$_x$, RMS, %",
        title="at every push",
    )
    label_logarithmic(axes.xaxis)
    label_logarithmic(axes.yaxis)


def _draw_front(axes: Axes, on_front: Sequence[Point]) -> None:
    """Draw the front: a line through its expected errors, their ranges, and measured errors."""
    best = sorted(on_front, key=lambda point: point.time_ms)
    time_ms = column(best, "time_ms")
    expected = column(best, "expected_rms_percent")
    axes.plot(time_ms, expected, color="0.2", lw=1, label="front, expected")
    low = column(best, "expected_low_percent")
    high = column(best, "expected_high_percent")
    axes.vlines(time_ms, low, high, color="0.6", lw=2, zorder=1.5, label="95 % by chance")
    measured = column(best, "error_rms_percent")
    axes.plot(time_ms, measured, "x", ms=5, color="0.2", label="measured")


def _draw_against(axes: Axes, points: Sequence[Point], over: str, names: Sequence[str]) -> None:
    """Draw expected error (a line in the range of 95 %) and measured error (crosses) over a column of
    ROBOT_TRADE.

    There is a line an estimator and speed.
    """
    speeds_deg_s = sorted({point.speed_deg_s for point in points})
    for number, name in enumerate(names):
        colour = colour_of(name, number)
        rim_points = nested_size(number, len(names), least=0.0, step=1.3)
        for speed_deg_s in speeds_deg_s:
            own = []
            for point in points:
                is_own = point.estimator == name and point.speed_deg_s == speed_deg_s
                if is_own and point.whisks:
                    own.append(point)
            _draw_line(axes, own, over, colour, rim_points)
    axes.set_yscale("log")
    label_logarithmic(axes.yaxis)
    if over != "bits":
        axes.set_xscale("log")
        label_logarithmic(axes.xaxis)


def _draw_line(
    axes: Axes, points: Sequence[Point], over: str, colour: str, rim_points: float
) -> None:
    """Draw expected and measured errors of one estimator at one speed over a column of ROBOT_TRADE.

    rim_points: by how much the line is wider than those that are drawn last.
    """
    own = sorted(points, key=attrgetter(over))
    x = column(own, over)
    low = column(own, "expected_low_percent")
    high = column(own, "expected_high_percent")
    axes.fill_between(x, low, high, color=colour, alpha=0.1, lw=0)
    axes.plot(x, column(own, "expected_rms_percent"), lw=1.0 + rim_points, color=colour)
    measured = column(own, "error_rms_percent")
    axes.plot(x, measured, "x", ms=4 + 1.5 * rim_points, color=colour)
