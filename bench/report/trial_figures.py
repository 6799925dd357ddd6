"""Drawings of an evaluated session that no analysis makes: each trial's, the truth's variance, the gauges."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.analyses.analysis import EvaluatedRun
from bench.analyses.pooling import grouped
from bench.analyses.surfaces import FittedSurface
from bench.base.drawing import PointStyle, blank, draw_whisks, style, whisk_url
from bench.base.results import DRAWING, hash_of, hash_of_code
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.records.trial_result import SeenWhisk, TrialResult, whisks
from bench.report.overlays import draw_overlays
from bench.report.planes import draw_planes
from bench.report.run_facts import GaugePoints
from bench.session.trial import Trial
from bench.session.whisker import Whisker
from vision import CAUSES

_MARKERS = "osD^vP"
# [whisks] A layout: bars that can still be told apart; of more, those of the largest sigma.
_MOST_BARS = 60
# [points] A layout: of a panel; more hide each other.
_MOST_POINTS = 500
# [trials] A layout: in a legend.
_MOST_NAMED = 8

_WhiskOfTrial = tuple[str, SeenWhisk]  # name of the trial, whisk


@dataclass(frozen=True)
class TrialToDraw:
    """One trial's drawing as a task.

    friction: half the opening of the friction cone, rad, and where it comes from. out: the results'
    folder.
    """

    trial: Trial
    result: TrialResult
    whisker: Whisker
    friction: tuple[float, str]
    out: Path


def draw_trials(run: EvaluatedRun, out: Path, pool: Workers) -> list[str]:
    """Draw the figures of each trial; return the names of the files.

    A figure is drawn again only where what it shows has changed.
    """
    fitted = [friction.surface for friction in run.friction]
    tasks = []
    for result in run.results:
        trial = run.session.trial(result.trial.name)
        friction = _friction_of(result, fitted, run.settings)
        tasks.append(TrialToDraw(trial, result, run.whisker, friction, out))
    names = []
    for of_trial in pool.run(draw_trial, tasks, "figures"):
        names += of_trial
    return names


def _friction_of(
    result: TrialResult, fitted: Sequence[FittedSurface], settings: Settings
) -> tuple[float, str]:
    """Return half the opening of the friction cone to draw, rad, and where it comes from."""
    for surface in fitted:
        if surface.panel == result.trial.panel and surface.fit is not None:
            return surface.alpha_rad, "fitted"
    return settings.alpha_est_rad, "assumed"


def draw_trial(task: TrialToDraw) -> list[str]:
    """Draw planes and overlays of one trial; return their names, relative to the results' folder."""
    result = task.result
    stamp = hash_of(result.hash, task.friction, hash_of_code(DRAWING))
    with style():
        planes = draw_planes(result, task.whisker, task.friction, task.out, stamp)
        return [*planes, *draw_overlays(task.trial, result, task.out, stamp)]


def variance_of_truth(results: Sequence[TrialResult]) -> Figure | None:
    """Draw where the variance of d_x comes from: a bar a whisk, its shares stacked.

    Returns None where no whisk has a truth. Of more than `_MOST_BARS` whisks those of the largest
    sigma are drawn.
    """
    known = _least_sure(results)
    if not known:
        return None
    figure = blank(8.0, 1.4 + 0.2 * len(known))
    axes = figure.subplots()
    _draw_shares(axes, known)
    _write_whisks(axes, known)
    axes.set(xlabel="share of the variance of d$_x$  [%]", xlim=(0.0, 115.0))
    axes.invert_yaxis()
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def _least_sure(results: Sequence[TrialResult]) -> list[_WhiskOfTrial]:
    """Return the whisks whose variance of d_x has known causes, those of the largest sigma first."""
    known = []
    for result, seen, _ in whisks(results):
        if seen.has_truth and seen.truth.budget:
            known.append((result.trial.name, seen))
    known.sort(key=lambda one: -one[1].d_x_mm.sigma)
    return known[:_MOST_BARS]


def _draw_shares(axes: Axes, known: Sequence[_WhiskOfTrial]) -> None:
    """Draw the bars, a whisk below the other: the shares of each cause, per cent, end to end."""
    places = np.arange(len(known))
    ends = np.zeros(len(known))
    for number, cause in enumerate(CAUSES):
        percents = []
        for _, seen in known:
            percents.append(100.0 * seen.truth.budget.get(cause, math.nan))
        shares = np.nan_to_num(np.array(percents))
        bars = axes.barh(places, shares, left=ends, color=f"C{number}", label=cause)
        for bar, (trial, seen) in zip(bars, known):
            bar.set_url(whisk_url(trial, seen.whisk))
        ends += shares


def _write_whisks(axes: Axes, known: Sequence[_WhiskOfTrial]) -> None:
    """Write trial and whisk before each bar, and the sigma of d_x after it: its own, and shared."""
    names = []
    for place, (trial, seen) in enumerate(known):
        names.append(f"{trial} {seen.whisk}" if seen.whisk else trial)
        own_mm = seen.d_x_own_sigma_mm
        text = f"± {own_mm:.3f} ± {seen.d_x_shared_sigma_mm:.3f} mm"
        if math.isnan(own_mm):
            text = f"± {seen.d_x_mm.sigma:.3f} mm"
        axes.annotate(text, (101.0, place), va="center", fontsize=7)
    axes.set_yticks(np.arange(len(known)), names, fontsize=7)


def gauge_residuals(points: Sequence[GaugePoints]) -> Figure:
    """Draw the moment by the gauges less that known from the deflection, each frame ± one sigma.

    Of more than `_MOST_POINTS` frames every second, third, ... is drawn.
    """
    figure = blank(9.6, 4.3)
    every = 1 + sum(len(p.moments_Nmm) for p in points) // _MOST_POINTS
    by_trial = grouped(points, lambda of_whisk: of_whisk.trial)
    for channel, axes in enumerate(figure.subplots(1, 2)):
        _draw_residuals(axes, by_trial, channel, every)
        name = ("m$_y$", "m$_z$")[channel]
        axes.axhline(0.0, color="0.6", lw=0.8, zorder=0)
        axes.set(xlabel=f"{name} known  [N·mm]", ylabel="gauge less known  [N·mm]")
    if len(by_trial) <= _MOST_NAMED:
        handles, labels = figure.axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def _draw_residuals(
    axes: Axes, by_trial: Mapping[str, Sequence[GaugePoints]], channel: int, every: int
) -> None:
    """Draw the residuals of one moment, m_y (channel 0) or m_z (1), N·mm, of each `every`-th frame."""
    for number, (trial, mine) in enumerate(by_trial.items()):
        urls = []
        for p in mine:
            urls += [whisk_url(p.trial, p.whisk)] * len(p.moments_Nmm)
        label = trial if len(by_trial) <= _MOST_NAMED else None
        draw_whisks(
            axes,
            np.concatenate([p.moments_Nmm[:, channel] for p in mine])[::every],
            np.concatenate([p.residuals_Nmm[:, channel] for p in mine])[::every],
            np.concatenate([p.moments_sigma_Nmm[:, channel] for p in mine])[::every],
            urls[::every],
            PointStyle(f"C{number % 10}", label, _MARKERS[number % len(_MARKERS)]),
        )
