"""Error of every estimator against the slope, and of (10) against the friction angle."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun
from bench.analyses.cells import panel_title
from bench.analyses.estimates_again import FITTED
from bench.analyses.pooling import grouped
from bench.analyses.surfaces import FittedSurface
from bench.base.drawing import (
    SLOPES_DEG,
    PointStyle,
    add_legend,
    blank,
    colour_of,
    draw_whisks,
    label_of,
    whisk_url,
)
from bench.base.settings import Settings
from bench.records.trial_result import WITH_FRICTION, TrialResult, whisks
from bench.trials.estimate_errors import Judged, judge
from estimator.threshold import distance_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# [%] A layout: an error bar that is longer widens no axis.
_LONGEST_BAR_PERCENT = 50.0
# [deg] A layout: between the estimates of one whisk by two estimators.
_APART_DEG = 0.8
# [deg] A layout: between the first and the last of many, less than the 5° between slopes.
_SPREAD_DEG = 4.0


class ErrorAgainstSlope(Analysis):
    """The error of each estimator against the slope."""

    figure_name = "error_against_slope"
    figure_title = "Error against slope"
    figure_caption = (
        "Error of d_x, estimate less truth, in per cent of the truth, ± one sigma; a row a surface and speed. "
        "Lines: as (13), (14) predict with the α that fits it. Estimators stand side by side, points and lines. "
        "A hollow point has a warning and is not in the verdict."
    )

    def compute(self, run: EvaluatedRun) -> EvaluatedRun:
        """Return the run as it is: it holds what is drawn."""
        return run

    def figure(self, found: EvaluatedRun) -> "Figure | None":
        """Draw the errors; None where none is known."""
        judged = measured(found.results)
        fitted = [friction.surface for friction in found.friction]
        return error_against_slope(judged, fitted, found.settings) if judged else None


class ErrorAgainstFriction(Analysis):
    """The error of (10) against the friction angle that the pictures show, or that fits."""

    figure_name = "error_against_friction"
    figure_title = "Error against friction"
    figure_caption = (
        "Against the friction angle that the pictures show, of whisks that slip; without pictures, that "
        "fits the surface's other whisks. Where α_est is not α, (10) errs."
    )

    def compute(self, run: EvaluatedRun) -> list[tuple[float, Judged]]:
        """Return the errors of (10), each with its friction angle, deg."""
        return errors_with_friction(run.results)

    def figure(self, found: Sequence[tuple[float, Judged]]) -> "Figure | None":
        """Draw the errors; None where the friction angle of fewer than two whisks is known."""
        return error_against_friction(found) if len(found) > 1 else None


def measured(results: Sequence[TrialResult]) -> list[Judged]:
    """Return the estimates of measured whisks whose error is known."""
    return [j for j in judge(results) if j.purpose == "measure" and np.isfinite(j.error_percent)]


def error_against_slope(
    judged: Sequence[Judged], fitted: Sequence[FittedSurface], settings: Settings
) -> "Figure":
    """Draw the error of d_x against slope, for every estimator, and on the right without (2).

    The error of (2), which assumes no slip, dwarfs the others'. Hollow points are flagged.
    """
    judged = [one for one in judged if one.is_shown]
    panels = grouped(judged, lambda one: (one.surface, one.speed_deg_s))
    surface_of = {surface.panel: surface for surface in fitted}
    lanes = _lanes(judged)
    figure = blank(9.6, 1.0 + 3.2 * len(panels))
    rows = figure.subplots(len(panels), 2, squeeze=False)
    for row, (panel, every) in zip(rows, panels.items()):
        _draw_row(row, every, lanes, surface_of.get(panel), settings)
        row[0].set(title=f"{panel_title(*panel)}: every estimator", ylabel="error of d$_x$  [%]")
        row[1].set_title(f"{panel_title(*panel)}: without (2)")
    for axes in rows[-1]:
        axes.set_xlabel("slope β  [°]")
    add_legend(figure, 3)
    return figure


def _draw_row(
    row: Sequence["Axes"],
    every: Sequence[Judged],
    lanes: Mapping["Lane", float],
    surface: FittedSurface | None,
    settings: Settings,
) -> None:
    """Draw every estimator of a surface and speed on the left, and all but (2) on the right."""
    without_2 = [one for one in every if one.estimator != "no_slip"]
    by_whole_matrix = [one for one in every if not one.one_factor]
    _draw_estimators(row[0], every, lanes, surface, settings)
    _draw_estimators(row[1], without_2, lanes, surface, settings)
    row[0].set_ylim(_limits(by_whole_matrix))
    row[1].set_ylim(_limits(without_2))


# A `Judged.way`: by it an estimate is moved, so as not to cover others of its whisk.
Lane = tuple[str, bool]


def _lanes(judged: Sequence[Judged]) -> dict[Lane, float]:
    """Return how far the estimates of each lane are drawn to the side of their slope, degrees."""
    lanes = list(dict.fromkeys(one.way for one in judged))
    step_deg = min(_APART_DEG, _SPREAD_DEG / len(lanes))
    middle = 0.5 * (len(lanes) - 1)
    return {lane: step_deg * (number - middle) for number, lane in enumerate(lanes)}


def _draw_estimators(
    axes: "Axes",
    judged: Sequence[Judged],
    lanes: Mapping[Lane, float],
    surface: FittedSurface | None,
    settings: Settings,
) -> None:
    """Draw predicted and measured errors of the estimators against the slope, on one surface.

    lanes: how far the estimates of one whisk stand to the side, so that none hides another; the
    predicted line goes with them.
    """
    of_lanes = grouped(judged, lambda one: one.way)
    for number, (lane, apart_deg) in enumerate(lanes.items()):
        mine = of_lanes.get(lane, [])
        if not mine:
            continue
        name, one_factor = lane
        label = label_of(name)
        label += ", one gauge factor a channel" if one_factor else ""
        if surface is not None and not one_factor:
            _draw_prediction(axes, name, number, surface, settings, apart_deg)
        slopes = [abs(one.beta_deg) + apart_deg for one in mine]
        _draw_group(axes, slopes, mine, number, label)
    axes.axhline(0.0, color="0.6", lw=0.8, zorder=0)
    axes.set(xlim=(-3, 82))


def errors_with_friction(results: Sequence[TrialResult]) -> list[tuple[float, Judged]]:
    """Return the errors of (10), each with the friction angle seen, or else fitted, deg."""
    alpha_deg = {}
    for result, seen, felt in whisks(results):
        key = (result.trial.name, seen.whisk)
        if seen.deflection is not None:
            alpha_deg[key] = math.degrees(seen.friction_rad.value)
            continue
        fitted = felt.estimate(FITTED)
        if fitted is not None:
            alpha_deg[key] = math.degrees(fitted.alpha_est_rad)
    found = []
    for one in measured(results):
        alpha = alpha_deg.get((one.trial, one.whisk), math.nan)
        if one.is_by_ten and math.isfinite(alpha):
            found.append((alpha, one))
    return found


def error_against_friction(found: Sequence[tuple[float, Judged]]) -> "Figure":
    """Draw the error of (10) against the friction angle."""
    chosen = [one for _, one in found]
    figure = blank(5.6, 4.3)
    axes = figure.subplots()
    _draw_group(axes, [alpha for alpha, _ in found], chosen, 0)
    axes.axhline(0.0, color="0.6", lw=0.8, zorder=0)
    axes.set(xlabel="friction angle α  [°]", ylabel="error of d$_x$  [%]")
    axes.set_title(label_of(WITH_FRICTION))
    axes.set_ylim(*_limits(chosen))
    return figure


def _limits(judged: Sequence[Judged]) -> tuple[float, float]:
    """Return limits, %, that hold all points with their sigmas, and at least ± 5 %."""
    low = -5.0
    high = 5.0
    for one in judged:
        reach = min(one.error_sigma_percent, _LONGEST_BAR_PERCENT)
        low = min(low, one.error_percent - reach)
        high = max(high, one.error_percent + reach)
    margin = 0.06 * (high - low)
    return low - margin, high + margin


def _draw_prediction(
    axes: "Axes",
    name: str,
    number: int,
    surface: FittedSurface,
    settings: Settings,
    apart_deg: float,
) -> None:
    """Draw the error that (13), (14) predict for an estimator where the surface has its fitted α.

    apart_deg: how far to the side.
    """
    assumed_rad = {"frictionless": 0.0, WITH_FRICTION: settings.alpha_est_rad, "no_slip": 0.0}
    if name not in assumed_rad or surface.fit is None:
        return
    equation = "no_slip" if name == "no_slip" else WITH_FRICTION
    error = distance_error(np.radians(SLOPES_DEG), surface.alpha_rad, assumed_rad[name], equation)
    axes.plot(
        SLOPES_DEG + apart_deg,
        100.0 * surface.beam.error_share(surface.common_d_x_mm, error),
        color=colour_of(name, number),
        lw=1.2,
        alpha=0.8,
        label=f"{label_of(name)}, predicted",
    )


def _draw_group(
    axes: "Axes",
    x: Sequence[float],
    judged: Sequence[Judged],
    number: int,
    label: str | None = None,
) -> None:
    """Draw errors of one estimator over x (n,); hollow where flagged or of one gauge factor."""
    colour = colour_of(judged[0].estimator, number)
    for is_filled in (True, False):
        drawn = []
        for place, j in zip(x, judged):
            is_hollow = j.has_warning or j.one_factor
            if is_hollow != is_filled:
                drawn.append((place, j))
        if drawn:
            draw_whisks(
                axes,
                [place for place, _ in drawn],
                [j.error_percent for _, j in drawn],
                [j.error_sigma_percent for _, j in drawn],
                [whisk_url(j.trial, j.whisk) for _, j in drawn],
                PointStyle(colour, label, is_filled=is_filled),
            )
            label = None
