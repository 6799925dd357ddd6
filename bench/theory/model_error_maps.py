"""`whisker-bench figures tilt` and `figures radius`: the two maps that the paper left open, as PNG, SVG and CSV."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from bench.base.drawing import publish, style
from bench.base.tables import Column, Table, alike
from bench.base.workers import Workers
from bench.theory.model_error import Panel, Push, radius_map, tilt_map

_ERRORS = ("error_percent", "predicted_percent", "corrected_percent")
ERROR_BY = Table(
    "error_by_<map>",
    "A row a cell of the map; error_by_tilt.csv and error_by_radius.csv are written by "
    "`figures tilt` and `figures radius`.",
    (
        *alike((field.name for field in fields(Push)), "the push"),
        Column("error_percent", "error of (10), α known, by exact mechanics"),
        Column("predicted_percent", "that error to its first order in θ"),
        Column("corrected_percent", "error of (10) corrected, for which the bar's radius is given"),
    ),
)
_LEVELS = np.array([-5.0, -2.0, -1.0, -0.5, -0.2, -0.1, 0.0, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0])
_LINES = {"levels": _LEVELS, "linewidths": 0.8}
_LABEL_ROOM = 0.03  # of a panel's sides: a line's number nearer to an edge would be cut off
_NAMES = {
    "beta_deg": "slope β  [°]",
    "psi_deg": "tilt ψ  [°], from the base where positive",
    "d_x_mm": "d$_x$  [mm]",
    "bar_radius_mm": "radius of the bar  [mm]",
}


@dataclass(frozen=True)
class Map:
    """One of the maps: how it is computed, and the line above it."""

    compute: Callable[[Workers], list[Panel]]
    title: str


MAPS = {
    "tilt": Map(tilt_map, "Error at α known, d$_x$ = 60 mm, bar of 6 mm, θ = 3°"),
    "radius": Map(radius_map, "Error at α known, ψ = 0, θ = 3°"),
}


def write_map(name: str, out: Path, *, workers: int = 1, progress: bool = False) -> list[Path]:
    """Compute and write error_by_<name>.png, .svg and .csv, each whole; the paths. Raises KeyError for another name."""
    chosen = MAPS[name]
    with Workers(workers, progress) as pool:
        panels = chosen.compute(pool)
    stem = Path(out) / f"error_by_{name}"
    with style():
        paths = publish(draw(panels, chosen.title), stem)
    ERROR_BY.write_file(stem.with_suffix(".csv"), rows(panels))
    return [*paths, stem.with_suffix(".csv")]


def rows(panels: Sequence[Panel]) -> Iterator[dict]:
    """Yield a row of ERROR_BY a cell; errors that are not known are NaN."""
    for panel in panels:
        errors_percent = panel.error_percent, panel.predicted_percent, panel.corrected_percent
        for pushes, *errors in zip(panel.pushes, *errors_percent):
            for push, *each in zip(pushes, *errors):
                yield asdict(push) | dict(zip(_ERRORS, map(float, each)))


def draw(panels: Sequence[Panel], title: str) -> Figure:
    """A column a panel, (10) above, corrected below: exact errors in colour and solid lines, first order dashed."""
    figure = Figure(figsize=(3.9 * len(panels) + 0.6, 7.2), layout="constrained")
    grid = figure.subplots(2, len(panels), sharex=True, sharey=True, squeeze=False)
    for (above, below), panel in zip(grid.T, panels):
        drawn = _errors(above, panel, panel.error_percent)
        _errors(below, panel, panel.corrected_percent)
        if np.isfinite(panel.predicted_percent).any():
            above.contour(
                *_axes(panel), panel.predicted_percent, **_LINES, colors="0.35", linestyles="--"
            )
        above.set_title(panel.title)
        below.set_xlabel(_NAMES[panel.x])
    for axes, name in zip(grid[:, 0], ("(10)", "(10) corrected")):
        axes.set_ylabel(f"{name}\n{_NAMES[panels[0].y]}")
    lines = [Line2D([], [], color=c, ls=ls, lw=0.8) for c, ls in (("black", "-"), ("0.35", "--"))]
    figure.legend(
        lines, ["exact mechanics", "to first order in θ"], loc="outside lower center", ncols=2
    )
    figure.suptitle(title, fontsize=9)
    figure.colorbar(drawn, ax=grid, label="error of d$_x$  [%]", ticks=_LEVELS)
    return figure


def _errors(axes: Axes, panel: Panel, percent: np.ndarray) -> ContourSet:
    """Errors in colour, and their lines with numbers."""
    finite = np.ma.masked_invalid(percent)
    drawn = axes.contourf(
        *_axes(panel), finite, levels=_LEVELS, cmap="RdBu_r", norm=_norm(), extend="both"
    )
    lines = axes.contour(*_axes(panel), finite, **_LINES, colors="black", linestyles="-")
    for label in axes.clabel(lines, fmt=_percent, fontsize=7):
        x, y = axes.transAxes.inverted().transform(axes.transData.transform(label.get_position()))
        label.set_visible(bool(min(x, y, 1.0 - x, 1.0 - y) > _LABEL_ROOM))
    return drawn


def _percent(level: float) -> str:
    return f"{level:+g} %".replace("-", "−") if level else "0"


def _axes(panel: Panel) -> tuple[np.ndarray, np.ndarray]:
    return _values(panel, panel.x), _values(panel, panel.y)


def _norm():
    """Colours in steps, so that 0.1 % shows beside 5 %."""
    from matplotlib.colors import BoundaryNorm

    return BoundaryNorm(_LEVELS, 256, extend="both")


def _values(panel: Panel, name: str) -> np.ndarray:
    """Values of one field along its axis of the map."""
    pushes = panel.pushes[0] if name == panel.x else [row[0] for row in panel.pushes]
    return np.array([getattr(push, name) for push in pushes])
