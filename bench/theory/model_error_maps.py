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
_LABEL_ROOM = 0.03  # of a panel's sides: a line's number nearer to an edge would be cut off
_NAMES = {
    "beta_deg": "slope β  [°]",
    "psi_deg": "tilt ψ  [°], from the base where positive",
    "d_x_mm": "d$_x$  [mm]",
    "bar_radius_mm": "radius of the bar  [mm]",
}


@dataclass(frozen=True)
class Map:
    """One of the maps: the function that computes it, and the line above it."""

    compute: Callable[[Workers], list[Panel]]
    title: str


MAPS = {
    "tilt": Map(tilt_map, "Error at α known, d$_x$ = 60 mm, bar of 6 mm, θ = 3°"),
    "radius": Map(radius_map, "Error at α known, ψ = 0, θ = 3°"),
}


def write_map(name: str, out: Path, *, workers: int = 1) -> list[Path]:
    """Compute a map and write error_by_<name>.png, .svg and .csv, each whole; return their paths.

    Raises KeyError for a name that no map has.
    """
    chosen = MAPS[name]
    with Workers(workers) as pool:
        panels = chosen.compute(pool)
    stem = Path(out) / f"error_by_{name}"
    with style():
        paths = publish(draw(panels, chosen.title), stem)
    table = stem.with_suffix(".csv")
    ERROR_BY.write_file(table, rows(panels))
    return [*paths, table]


def rows(panels: Sequence[Panel]) -> Iterator[dict]:
    """Yield a row of ERROR_BY a cell; errors that are not known are NaN."""
    for panel in panels:
        errors = np.stack([getattr(panel, name) for name in _ERRORS], axis=-1).tolist()
        for pushes, row in zip(panel.pushes, errors):
            for push, cell in zip(pushes, row):
                yield asdict(push) | dict(zip(_ERRORS, cell))


def draw(panels: Sequence[Panel], title: str) -> Figure:
    """Draw a column a panel: (10) above, corrected below.

    Exact errors are in colour and solid lines, those to first order dashed.
    """
    figure = Figure(figsize=(3.9 * len(panels) + 0.6, 7.2), layout="constrained")
    grid = figure.subplots(2, len(panels), sharex=True, sharey=True, squeeze=False)
    for (above, below), panel in zip(grid.T, panels):
        colours = _draw_errors(above, panel, panel.error_percent)
        _draw_errors(below, panel, panel.corrected_percent)
        if np.isfinite(panel.predicted_percent).any():
            _draw_lines(above, panel, panel.predicted_percent, "0.35", "--")
        above.set_title(panel.title)
        below.set_xlabel(_NAMES[panel.x])
    y_name = _NAMES[panels[0].y]
    grid[0, 0].set_ylabel(f"(10)\n{y_name}")
    grid[1, 0].set_ylabel(f"(10) corrected\n{y_name}")
    _draw_legend(figure)
    figure.suptitle(title, fontsize=9)
    figure.colorbar(colours, ax=grid, label="error of d$_x$  [%]", ticks=_LEVELS)
    return figure


def _draw_legend(figure: Figure) -> None:
    """Draw what solid and dashed lines are."""
    exact = Line2D([], [], color="black", ls="-", lw=0.8)
    predicted = Line2D([], [], color="0.35", ls="--", lw=0.8)
    names = ["exact mechanics", "to first order in θ"]
    figure.legend([exact, predicted], names, loc="outside lower center", ncols=2)


def _draw_errors(axes: Axes, panel: Panel, percent: np.ndarray) -> ContourSet:
    """Draw errors in colour and as lines with numbers; return the coloured areas."""
    from matplotlib.colors import BoundaryNorm

    finite = np.ma.masked_invalid(percent)
    steps = BoundaryNorm(_LEVELS, 256, extend="both")  # so that 0.1 % shows beside 5 %
    colours = axes.contourf(
        *_axes(panel), finite, levels=_LEVELS, cmap="RdBu_r", norm=steps, extend="both"
    )
    lines = _draw_lines(axes, panel, finite, "black", "-")
    for label in axes.clabel(lines, fmt=_percent, fontsize=7):
        place = axes.transData.transform(label.get_position())
        place = axes.transAxes.inverted().transform(place)
        label.set_visible(bool(min(*place, *(1.0 - place)) > _LABEL_ROOM))
    return colours


def _draw_lines(axes: Axes, panel: Panel, percent: np.ndarray, colour: str, style: str):
    """Draw lines of equal error at _LEVELS and return them."""
    return axes.contour(
        *_axes(panel), percent, levels=_LEVELS, linewidths=0.8, colors=colour, linestyles=style
    )


def _percent(level: float) -> str:
    """Return the number of a line of equal error."""
    return f"{level:+g} %".replace("-", "−") if level else "0"


def _axes(panel: Panel) -> tuple[np.ndarray, np.ndarray]:
    """Return the values of the panel's two fields, along columns and along rows."""
    x = np.array([getattr(push, panel.x) for push in panel.pushes[0]])
    y = np.array([getattr(row[0], panel.y) for row in panel.pushes])
    return x, y
