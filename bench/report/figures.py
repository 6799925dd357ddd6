"""Figures of an evaluated session that no analysis draws: error against slope, each trial's planes and overlays."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.analyses.surfaces import Surface
from bench.base.drawing import SLOPES_DEG, colour_of, is_drawn, label_of, save, style
from bench.base.results import DRAWING, hash_of, hash_of_code
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.records.trial_result import TrialResult
from bench.report.evaluation import Evaluation
from bench.report.overlays import draw_overlays
from bench.report.planes import draw_planes
from bench.session.trial import Trial
from bench.trials.estimate_errors import Judged, judge
from estimator.threshold import distance_error

_MARKERS = "osD^vP"


def write_figures(evaluation: Evaluation, pool: Workers) -> list[str]:
    """Draw error against slope, and the figures of each trial; return the names of the files.

    Each is drawn again only where what it shows has changed.
    """
    results = evaluation.results
    out = evaluation.out
    settings = evaluation.settings
    fitted = [friction.surface for friction in evaluation.friction]
    stamp = hash_of([result.hash for result in results], hash_of_code(DRAWING))
    judged = [j for j in judge(results) if j.purpose == "measure" and np.isfinite(j.error_percent)]
    names = ["error_against_slope.png"] if judged else []
    if judged and not is_drawn(out / names[0], stamp):
        with style():
            save(error_against_slope(judged, fitted, settings), out / names[0], stamp)
    tasks = []
    for result in results:
        trial = evaluation.session.trial(result.trial.name)
        tasks.append((trial, result, _friction_of(result, fitted, settings), out))
    drawn = pool.run(draw_trial, tasks, "figures")
    return [*names, *(name for group in drawn for name in group)]


def _friction_of(
    result: TrialResult, fitted: Sequence[Surface], settings: Settings
) -> tuple[float, str]:
    """Half opening of the friction cone to draw, rad, and where it comes from."""
    for surface in fitted:
        if surface.panel == result.trial.panel and surface.fit is not None:
            return surface.alpha_rad, "fitted"
    return settings.alpha_est_rad, "assumed"


def draw_trial(task: tuple[Trial, TrialResult, tuple[float, str], Path]) -> list[str]:
    """Sensing plane and overlays of one trial; names of the files, relative to the results' folder."""
    trial, result, friction, out = task
    stamp = hash_of(result.hash, friction, hash_of_code(DRAWING))
    with style():
        return [
            *draw_planes(result, friction, out, stamp),
            *draw_overlays(trial, result, out, stamp),
        ]


def error_against_slope(
    judged: Sequence[Judged], fitted: Sequence[Surface], settings: Settings
) -> Figure:
    """Error of d_x against slope: every estimator, and on the right without (2), whose error dwarfs the others'."""
    figure = Figure(figsize=(9.6, 4.3), layout="constrained")
    whole, near = figure.subplots(1, 2)
    judged = [j for j in judged if not j.one_factor or j.estimator == "with_friction"]
    names = list(dict.fromkeys(j.estimator for j in judged))
    for axes, shown in ((whole, names), (near, [n for n in names if n != "no_slip"])):
        for number, name in enumerate(shown):
            _predicted(axes, name, number, fitted, settings)
            _points(axes, [j for j in judged if j.estimator == name], number, name, fitted)
        axes.axhline(0.0, color="0.6", lw=0.8, zorder=0)
        axes.set(xlabel="slope β  [°]", xlim=(-2, 82))
    whole.set(ylabel="error of d$_x$  [%]", title="every estimator")
    whole.set_ylim(*_limits([j for j in judged if not j.one_factor]))
    near.set(title="without (2)")
    near.set_ylim(*_limits([j for j in judged if j.estimator != "no_slip"]))
    handles = {label: handle for handle, label in zip(*whole.get_legend_handles_labels())}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3)
    return figure


def _limits(judged: Sequence[Judged]) -> tuple[float, float]:
    """All points with room for their sigmas, and never less than ± 5 %."""
    reach = [
        j.error_percent + sign * 2.0 * min(j.error_sigma_percent, 50.0)
        for j in judged
        for sign in (-1, 1)
    ]
    low, high = min([-5.0, *reach]), max([5.0, *reach])
    return low - 0.06 * (high - low), high + 0.06 * (high - low)


def _predicted(
    axes: Axes, name: str, number: int, fitted: Sequence[Surface], settings: Settings
) -> None:
    """The error that (13), (14) predict where the surface has its fitted α."""
    assumed = {"frictionless": 0.0, "with_friction": settings.alpha_est_rad, "no_slip": 0.0}.get(
        name
    )
    equation = "no_slip" if name == "no_slip" else "with_friction"
    for surface in fitted if assumed is not None else ():
        if surface.fit is not None:
            error = distance_error(
                np.radians(SLOPES_DEG), surface.alpha_rad, assumed, equation=equation
            )
            error = surface.beam.error_share(surface.common_d_x_mm, error)
            axes.plot(
                SLOPES_DEG,
                100.0 * error,
                color=colour_of(name, number),
                lw=1.2,
                alpha=0.8,
                ls=("-", "--", ":", "-.")[fitted.index(surface) % 4],
                label=f"{label_of(name)}, predicted, α = {np.degrees(surface.alpha_rad):.1f}°",
            )


def _points(
    axes: Axes, judged: Sequence[Judged], number: int, name: str, fitted: Sequence[Surface]
) -> None:
    keys = [s.panel for s in fitted]
    for one_factor in (False, True):
        for place, key in enumerate(keys):
            chosen = [
                j
                for j in judged
                if j.one_factor == one_factor and (j.surface, j.speed_deg_s) == key
            ]
            if chosen:
                axes.errorbar(
                    [abs(j.beta_deg) for j in chosen],
                    [j.error_percent for j in chosen],
                    [j.error_sigma_percent for j in chosen],
                    fmt=_MARKERS[place % len(_MARKERS)],
                    ms=5,
                    color=colour_of(name, number),
                    mfc="white" if one_factor else None,
                    capsize=2.5,
                    lw=0,
                    elinewidth=1.0,
                    label=_point_label(name, one_factor, fitted[place], len(keys)),
                )


def _point_label(name: str, one_factor: bool, surface: Surface, count: int) -> str:
    gauges = ", one gauge factor a channel" if one_factor else ""
    return f"{label_of(name)}{gauges}" + (f", {surface.title}" if count > 1 else "")
