"""Error of every estimator against the slope, and of (10) against the friction angle that is seen."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bench.analyses.alphas import seen_friction
from bench.analyses.analysis import Analysis, EvaluatedRun
from bench.analyses.pooling import grouped
from bench.analyses.surfaces import FittedSurface
from bench.base.drawing import (
    SLOPES_DEG,
    add_legend,
    blank,
    colour_of,
    draw_whisks,
    label_of,
    whisk_url,
)
from bench.base.settings import Settings
from bench.records.trial_result import TrialResult, whisks
from bench.trials.estimate_errors import Judged, judge
from estimator.threshold import distance_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MARKERS = "osD^vP"
_LINES = ("-", "--", ":", "-.")
# [%] A layout: an error bar that is longer widens no axis.
_LONGEST_BAR_PERCENT = 50.0
# [deg] A layout: between the estimates of one whisk by two estimators.
_APART_DEG = 0.6


class ErrorAgainstSlope(Analysis):
    """The error of each estimator against the slope."""

    figure_name = "error_against_slope"
    figure_title = "Error against slope"
    figure_caption = (
        "Error of d_x, estimate less truth, in per cent of the truth, ± one sigma. Lines: as (13), (14) "
        "predict with the α that fits each surface. A hollow point is in doubt and not in the verdict."
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
    """The error of (10) against the friction angle that the pictures show."""

    figure_name = "error_against_friction"
    figure_title = "Error against friction"
    figure_caption = (
        "Against the friction angle that the pictures show, of whisks that slip: where α_est is not α, "
        "(10) errs."
    )

    def compute(self, run: EvaluatedRun) -> list[tuple[float, Judged]]:
        """Return the errors of (10), each with the friction angle seen, deg."""
        return errors_with_friction(run.results)

    def figure(self, found: Sequence[tuple[float, Judged]]) -> "Figure | None":
        """Draw the errors; None where fewer than two whisks show the friction angle."""
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
    figure = blank(9.6, 4.3)
    whole, near = figure.subplots(1, 2)
    judged = [j for j in judged if not j.one_factor or j.estimator == "with_friction"]
    without_2 = [j for j in judged if j.estimator != "no_slip"]
    _draw_estimators(whole, judged, fitted, settings)
    _draw_estimators(near, without_2, fitted, settings)
    whole.set(ylabel="error of d$_x$  [%]", title="every estimator")
    whole.set_ylim(*_limits([j for j in judged if not j.one_factor]))
    near.set(title="without (2)")
    near.set_ylim(*_limits(without_2))
    add_legend(figure, 3)
    return figure


def _draw_estimators(
    axes: "Axes", judged: Sequence[Judged], fitted: Sequence[FittedSurface], settings: Settings
) -> None:
    """Draw predicted and measured errors of all estimators against the slope."""
    of_estimators = grouped(judged, lambda one: one.estimator)
    for number, (name, mine) in enumerate(of_estimators.items()):
        _draw_prediction(axes, name, number, fitted, settings)
        apart_deg = _APART_DEG * (number - 0.5 * (len(of_estimators) - 1))
        _draw_errors(axes, mine, number, fitted, apart_deg)
    axes.axhline(0.0, color="0.6", lw=0.8, zorder=0)
    axes.set(xlabel="slope β  [°]", xlim=(-2, 82))


def errors_with_friction(results: Sequence[TrialResult]) -> list[tuple[float, Judged]]:
    """Return the errors of (10), each with the friction angle that the pictures show, deg."""
    alpha_deg = {}
    for result, seen, _ in whisks(results):
        if seen.deflection is not None:
            alpha_deg[result.trial.name, seen.whisk] = math.degrees(seen_friction(seen)[0])
    found = []
    for one in measured(results):
        alpha = alpha_deg.get((one.trial, one.whisk), math.nan)
        if one.estimator == "with_friction" and not one.one_factor and math.isfinite(alpha):
            found.append((alpha, one))
    return found


def error_against_friction(found: Sequence[tuple[float, Judged]]) -> "Figure":
    """Draw the error of (10) against the friction angle that the pictures show."""
    chosen = [one for _, one in found]
    figure = blank(5.6, 4.3)
    axes = figure.subplots()
    _draw_group(axes, [alpha for alpha, _ in found], chosen, "o", 0)
    axes.axhline(0.0, color="0.6", lw=0.8, zorder=0)
    axes.set(xlabel="friction angle α seen  [°]", ylabel="error of d$_x$  [%]")
    axes.set_title(label_of("with_friction"))
    axes.set_ylim(*_limits(chosen))
    return figure


def _limits(judged: Sequence[Judged]) -> tuple[float, float]:
    """Return limits, %, that hold all points with room for their sigmas, and at least ± 5 %."""
    low = -5.0
    high = 5.0
    for one in judged:
        reach = 2.0 * min(one.error_sigma_percent, _LONGEST_BAR_PERCENT)
        low = min(low, one.error_percent - reach)
        high = max(high, one.error_percent + reach)
    margin = 0.06 * (high - low)
    return low - margin, high + margin


def _draw_prediction(
    axes: "Axes", name: str, number: int, fitted: Sequence[FittedSurface], settings: Settings
) -> None:
    """Draw the error that (13), (14) predict for an estimator where the surface has its fitted α."""
    assumed_rad = {"frictionless": 0.0, "with_friction": settings.alpha_est_rad, "no_slip": 0.0}
    if name not in assumed_rad:
        return
    equation = "no_slip" if name == "no_slip" else "with_friction"
    for place, surface in enumerate(fitted):
        if surface.fit is None:
            continue
        error = distance_error(
            np.radians(SLOPES_DEG), surface.alpha_rad, assumed_rad[name], equation=equation
        )
        axes.plot(
            SLOPES_DEG,
            100.0 * surface.beam.error_share(surface.common_d_x_mm, error),
            color=colour_of(name, number),
            lw=1.2,
            alpha=0.8,
            ls=_LINES[place % len(_LINES)],
            label=f"{label_of(name)}, predicted, α = {np.degrees(surface.alpha_rad):.1f}°",
        )


def _draw_errors(
    axes: "Axes",
    judged: Sequence[Judged],
    number: int,
    fitted: Sequence[FittedSurface],
    apart_deg: float,
) -> None:
    """Draw the errors of one estimator against the slope, a marker a surface.

    apart_deg: sideways, so that the estimates of one whisk do not hide each other.
    """
    for one_factor in (False, True):
        for place, surface in enumerate(fitted):
            chosen = []
            for j in judged:
                is_of_panel = (j.surface, j.speed_deg_s) == surface.panel
                if is_of_panel and j.one_factor == one_factor:
                    chosen.append(j)
            if chosen:
                label = label_of(chosen[0].estimator)
                label += ", one gauge factor a channel" if one_factor else ""
                label += f", {surface.title}" if len(fitted) > 1 else ""
                slopes = [abs(j.beta_deg) + apart_deg for j in chosen]
                marker = _MARKERS[place % len(_MARKERS)]
                _draw_group(axes, slopes, chosen, marker, number, label)


def _draw_group(
    axes: "Axes",
    x: Sequence[float],
    judged: Sequence[Judged],
    marker: str,
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
                marker=marker,
                colour=colour,
                is_filled=is_filled,
                label=label,
            )
            label = None
