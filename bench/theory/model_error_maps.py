"""`whisker-bench figures tilt` and `figures radius`: the two maps that the paper left open, as PNG, SVG and CSV."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bench.base.drawing import publish, style
from bench.base.tables import write_table
from bench.base.workers import Workers
from bench.theory.model_error import Panel, Push, radius_map, tilt_map

COLUMNS = (*(f.name for f in fields(Push)), "error_percent", "predicted_percent")
_LEVELS = np.array([-5.0, -2.0, -1.0, -0.5, -0.2, -0.1, 0.0, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0])
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
    "tilt": Map(tilt_map, "Error of (10), α known, d$_x$ = 60 mm, bar of 6 mm, θ = 3°"),
    "radius": Map(radius_map, "Error of (10), α known, ψ = 0, θ = 3°"),
}


def write_map(name: str, out: Path, *, workers: int = 1, progress: bool = False) -> list[Path]:
    """Compute and write error_by_<name>.png, .svg and .csv, each whole; the paths. Raises KeyError for another name."""
    chosen = MAPS[name]
    with Workers(workers, progress) as pool:
        panels = chosen.compute(pool)
    stem = Path(out) / f"error_by_{name}"
    with style():
        paths = publish(draw(panels, chosen.title), stem)
    write_table(stem.with_suffix(".csv"), COLUMNS, rows(panels))
    return [*paths, stem.with_suffix(".csv")]


def rows(panels: Sequence[Panel]) -> Iterator[dict]:
    """A row a cell, by COLUMNS; errors that are not known are NaN."""
    for panel in panels:
        for pushes, errors, predicted in zip(panel.pushes, panel.error_percent, panel.predicted_percent):
            for push, error, foreseen in zip(pushes, errors, predicted):
                yield asdict(push) | {"error_percent": float(error), "predicted_percent": float(foreseen)}


def draw(panels: Sequence[Panel], title: str) -> Figure:
    """A panel each: exact errors in colour and solid lines, their first order in θ dashed."""
    figure = Figure(figsize=(3.9 * len(panels) + 0.6, 3.9), layout="constrained")
    grid = figure.subplots(1, len(panels), sharex=True, sharey=True, squeeze=False)[0]
    for axes, panel in zip(grid, panels):
        x, y = (_values(panel, name) for name in (panel.x, panel.y))
        drawn = axes.contourf(
            x, y, np.ma.masked_invalid(panel.error_percent), levels=_LEVELS, cmap="RdBu_r", norm=_norm(), extend="both"
        )
        lines = axes.contour(x, y, panel.error_percent, levels=_LEVELS, colors="black", linewidths=0.8, linestyles="-")
        axes.clabel(lines, fmt=lambda level: f"{level:+g} %" if level else "0", fontsize=7)
        if np.isfinite(panel.predicted_percent).any():
            axes.contour(
                x, y, panel.predicted_percent, levels=_LEVELS, colors="0.35", linewidths=0.8, linestyles="--"
            )
        axes.set(title=panel.title, xlabel=_NAMES[panel.x])
    grid[0].set_ylabel(_NAMES[panels[0].y])
    figure.suptitle(f"{title}; solid: exact mechanics, dashed: to first order in θ", fontsize=9)
    figure.colorbar(drawn, ax=grid, label="error of d$_x$  [%]", ticks=_LEVELS)
    return figure


def _norm():
    """Colours in steps, so that 0.1 % shows beside 5 %."""
    from matplotlib.colors import BoundaryNorm

    return BoundaryNorm(_LEVELS, 256, extend="both")


def _values(panel: Panel, name: str) -> np.ndarray:
    """Values of one field along its axis of the map."""
    pushes = panel.pushes[0] if name == panel.x else [row[0] for row in panel.pushes]
    return np.array([getattr(push, name) for push in pushes])
