"""Figures of an evaluated session: error against slope and friction, the variance of the truth, each trial's planes."""

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.analyses.alphas import seen_friction
from bench.analyses.figure_8 import figure_8
from bench.analyses.surfaces import Surface
from bench.base.drawing import (
    SLOPES_DEG,
    blank,
    colour_of,
    draw_whisks,
    is_drawn,
    label_of,
    save,
    style,
    whisk_url,
)
from bench.base.results import DRAWING, hash_of, hash_of_code
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.records.trial_result import TrialResult, whisks
from bench.report.evaluation import Evaluation
from bench.report.overlays import draw_overlays
from bench.report.planes import draw_planes
from bench.report.run_facts import GaugePoints
from bench.session.trial import Trial
from bench.session.whisker import Whisker
from bench.trials.estimate_errors import Judged, judge
from estimator.threshold import distance_error
from vision.fit.covariance import CAUSES

_MARKERS = "osD^vP"
_LINES = ("-", "--", ":", "-.")
# [%] A layout: an error bar that is longer widens no axis.
_LONGEST_BAR_PERCENT = 50.0
# [deg] A layout: between the estimates of one whisk by two estimators.
_APART_DEG = 0.6
# [whisks] A layout: bars that can still be told apart; of more, those of the largest sigma.
_MOST_BARS = 60
# [points] A layout: of a panel; more hide each other.
_MOST_POINTS = 500
# [trials] A layout: in a legend.
_MOST_NAMED = 8


def write_figures(evaluation: Evaluation, pool: Workers) -> list[str]:
    """Draw all figures that the results allow and return their names.

    A figure is drawn again only where what it shows has changed.
    """
    results = evaluation.results
    fitted = [friction.surface for friction in evaluation.friction]
    judged = measured(results)
    stamp = hash_of([r.hash for r in results], hash_of_code(DRAWING))
    drawings = {}
    if fitted:
        drawings["fig8.png"] = partial(figure_8, fitted)
    if judged:
        drawings["error_against_slope.png"] = partial(
            error_against_slope, judged, fitted, evaluation.settings
        )
    if friction_of_errors(results):
        drawings["error_against_friction.png"] = partial(error_against_friction, results)
    for name, draw in drawings.items():
        if not is_drawn(evaluation.out / name, stamp):
            with style():
                save(draw(), evaluation.out / name, stamp)
    names = list(drawings)
    tasks = []
    for result in results:
        trial = evaluation.session.trial(result.trial.name)
        friction = _friction_of(result, fitted, evaluation.settings)
        tasks.append((trial, result, evaluation.session.whisker, friction, evaluation.out))
    for of_trial in pool.run(draw_trial, tasks, "figures"):
        names += of_trial
    return names


def measured(results: Sequence[TrialResult]) -> list[Judged]:
    """Return the estimates of measured whisks whose error is known."""
    return [j for j in judge(results) if j.purpose == "measure" and np.isfinite(j.error_percent)]


def _friction_of(
    result: TrialResult, fitted: Sequence[Surface], settings: Settings
) -> tuple[float, str]:
    """Return half the opening of the friction cone to draw, rad, and where it comes from."""
    for surface in fitted:
        if surface.panel == result.trial.panel and surface.fit is not None:
            return surface.alpha_rad, "fitted"
    return settings.alpha_est_rad, "assumed"


def draw_trial(task: tuple[Trial, TrialResult, Whisker, tuple[float, str], Path]) -> list[str]:
    """Draw planes and overlays of one trial; return their names, relative to the results' folder."""
    trial, result, whisker, friction, out = task
    stamp = hash_of(result.hash, friction, hash_of_code(DRAWING))
    with style():
        planes = draw_planes(result, whisker, friction, out, stamp)
        return [*planes, *draw_overlays(trial, result, out, stamp)]


def error_against_slope(
    judged: Sequence[Judged], fitted: Sequence[Surface], settings: Settings
) -> Figure:
    """Draw the error of d_x against slope, for every estimator, and on the right without (2).

    The error of (2), which assumes no slip, dwarfs the others'. Hollow points are flagged.
    """
    figure = blank(9.6, 4.3)
    whole, near = figure.subplots(1, 2)
    judged = [j for j in judged if not j.one_factor or j.estimator == "with_friction"]
    names = list(dict.fromkeys(j.estimator for j in judged))
    without_2 = [name for name in names if name != "no_slip"]
    for axes, drawn in ((whole, names), (near, without_2)):
        for number, name in enumerate(drawn):
            _draw_prediction(axes, name, number, fitted, settings)
            mine = [j for j in judged if j.estimator == name]
            apart_deg = _APART_DEG * (number - 0.5 * (len(drawn) - 1))
            _draw_errors(axes, mine, number, fitted, apart_deg)
        axes.axhline(0.0, color="0.6", lw=0.8, zorder=0)
        axes.set(xlabel="slope β  [°]", xlim=(-2, 82))
    whole.set(ylabel="error of d$_x$  [%]", title="every estimator")
    whole.set_ylim(*_limits([j for j in judged if not j.one_factor]))
    near.set(title="without (2)")
    near.set_ylim(*_limits([j for j in judged if j.estimator != "no_slip"]))
    handles = {label: handle for handle, label in zip(*whole.get_legend_handles_labels())}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3)
    return figure


def friction_of_errors(results: Sequence[TrialResult]) -> list[tuple[float, Judged]]:
    """Return the errors of (10), each with the friction angle that the pictures show, deg.

    Returns nothing where fewer than two whisks show it.
    """
    alpha_deg = {}
    for result, seen, _ in whisks(results):
        if seen.deflection is not None:
            alpha_deg[result.trial.name, seen.whisk] = math.degrees(seen_friction(seen)[0])
    found = []
    for one in measured(results):
        alpha = alpha_deg.get((one.trial, one.whisk), math.nan)
        if one.estimator == "with_friction" and not one.one_factor and math.isfinite(alpha):
            found.append((alpha, one))
    return found if len(found) > 1 else []


def error_against_friction(results: Sequence[TrialResult]) -> Figure:
    """Draw the error of (10) against the friction angle that the pictures show."""
    found = friction_of_errors(results)
    chosen = [one for _, one in found]
    figure = blank(5.6, 4.3)
    axes = figure.subplots()
    _draw_group(axes, [alpha for alpha, _ in found], chosen, "o", 0)
    axes.axhline(0.0, color="0.6", lw=0.8, zorder=0)
    axes.set(xlabel="friction angle α seen  [°]", ylabel="error of d$_x$  [%]")
    axes.set_title(label_of("with_friction"))
    axes.set_ylim(*_limits(chosen))
    return figure


def variance_of_truth(results: Sequence[TrialResult]) -> Figure | None:
    """Draw where the variance of d_x comes from: a bar a whisk, its shares stacked.

    Returns None where no whisk has a truth. Of more than `_MOST_BARS` whisks those of the largest
    sigma are drawn.
    """
    known = [(r.trial.name, seen) for r, seen, _ in whisks(results) if seen.has_truth]
    known = [(trial, seen) for trial, seen in known if seen.truth.budget]
    known.sort(key=lambda one: -one[1].d_x_mm.sigma)
    known = known[:_MOST_BARS]
    if not known:
        return None
    figure = blank(8.0, 1.4 + 0.2 * len(known))
    axes = figure.subplots()
    places = np.arange(len(known))
    ends = np.zeros(len(known))
    for number, cause in enumerate(CAUSES):
        shares = np.array([100.0 * seen.truth.budget.get(cause, math.nan) for _, seen in known])
        shares = np.nan_to_num(shares)
        bars = axes.barh(places, shares, left=ends, color=f"C{number}", label=cause)
        for bar, (trial, seen) in zip(bars, known):
            bar.set_url(whisk_url(trial, seen.whisk))
        ends += shares
    for place, (_, seen) in zip(places, known):
        axes.annotate(f"± {seen.d_x_mm.sigma:.3f} mm", (101.0, place), va="center", fontsize=7)
    names = [trial + (f" {seen.whisk}" if seen.whisk else "") for trial, seen in known]
    axes.set_yticks(places, names, fontsize=7)
    axes.set(xlabel="share of the variance of d$_x$  [%]", xlim=(0.0, 115.0))
    axes.invert_yaxis()
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def gauge_residuals(points: Sequence[GaugePoints]) -> Figure:
    """Draw the moment by the gauges less that known from the deflection, each frame ± one sigma.

    Of more than `_MOST_POINTS` frames every second, third, ... is drawn.
    """
    figure = blank(9.6, 4.3)
    every = 1 + sum(len(p.moments_Nmm) for p in points) // _MOST_POINTS
    trials = list(dict.fromkeys(p.trial for p in points))
    for channel, axes in enumerate(figure.subplots(1, 2)):
        name = ("m$_y$", "m$_z$")[channel]
        for number, trial in enumerate(trials):
            mine = [p for p in points if p.trial == trial]
            urls = []
            for p in mine:
                urls += [whisk_url(p.trial, p.whisk)] * len(p.moments_Nmm)
            draw_whisks(
                axes,
                np.concatenate([p.moments_Nmm[:, channel] for p in mine])[::every],
                np.concatenate([p.residuals_Nmm[:, channel] for p in mine])[::every],
                np.concatenate([p.moments_sigma_Nmm[:, channel] for p in mine])[::every],
                urls[::every],
                marker=_MARKERS[number % len(_MARKERS)],
                colour=f"C{number % 10}",
                size_points=4.0,
                label=trial if len(trials) <= _MOST_NAMED else None,
            )
        axes.axhline(0.0, color="0.6", lw=0.8, zorder=0)
        axes.set(xlabel=f"{name} known  [N·mm]", ylabel="gauge less known  [N·mm]")
    if len(trials) <= _MOST_NAMED:
        handles, labels = figure.axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
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
    axes: Axes, name: str, number: int, fitted: Sequence[Surface], settings: Settings
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
    axes: Axes, judged: Sequence[Judged], number: int, fitted: Sequence[Surface], apart_deg: float
) -> None:
    """Draw the errors of one estimator against the slope, a marker a surface.

    apart_deg: sideways, so that the estimates of one whisk do not hide each other.
    """
    for one_factor in (False, True):
        for place, surface in enumerate(fitted):
            chosen = [
                j
                for j in judged
                if j.one_factor == one_factor and (j.surface, j.speed_deg_s) == surface.panel
            ]
            if chosen:
                label = label_of(chosen[0].estimator)
                label += ", one gauge factor a channel" if one_factor else ""
                label += f", {surface.title}" if len(fitted) > 1 else ""
                slopes = [abs(j.beta_deg) + apart_deg for j in chosen]
                marker = _MARKERS[place % len(_MARKERS)]
                _draw_group(axes, slopes, chosen, marker, number, label)


def _draw_group(
    axes: Axes,
    x: Sequence[float],
    judged: Sequence[Judged],
    marker: str,
    number: int,
    label: str | None = None,
) -> None:
    """Draw errors of one estimator over x (n,); hollow where flagged or of one gauge factor."""
    colour = colour_of(judged[0].estimator, number)
    for is_filled in (True, False):
        drawn = [
            (place, j) for place, j in zip(x, judged) if (j.doubtful or j.one_factor) != is_filled
        ]
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
