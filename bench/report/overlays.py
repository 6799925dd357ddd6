"""What was found, drawn on its pictures: wire, bar's edges and contact, at touch and at θ, in every camera."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.base.drawing import is_drawn, save
from bench.records.trial import SeenWhisk, TrialResult
from bench.session.footage import read_frames
from bench.session.frame_times import frame_times
from bench.session.trial import Trial

_WIRE, _BAR, _CONTACT = "#ffd92f", "#4daf4a", "#e41a1c"
_MOMENTS = {"touch": "at touch", "theta": "at θ"}
_AROUND_PX = 34  # half width of the view that is enlarged
_MARGIN_PX = 70


def draw_overlays(trial: Trial, result: TrialResult, out: Path, stamp: str) -> list[str]:
    """overlays/<trial>_<whisk>.png of each whisk that was seen; names of the files."""
    names = []
    for whisk in result.seen.whisks:
        if whisk.overlay:
            names.append(f"overlays/{trial.name}_{whisk.whisk}.png")
            if not is_drawn(out / names[-1], stamp):
                save(_figure(trial, whisk), out / names[-1], stamp, dpi=130)
    return names


def _figure(trial: Trial, whisk: SeenWhisk) -> Figure:
    chosen = whisk.overlay
    cameras = list(chosen["touch"].cameras)
    pictures = _pictures(trial, cameras, {chosen[m].frame for m in _MOMENTS})
    figure = Figure(figsize=(13.0, 3.9 * len(cameras)), layout="constrained")
    grid = figure.subplots(len(cameras), 2, squeeze=False)
    for row, camera in zip(grid, cameras):
        for axes, moment in zip(row, _MOMENTS):
            frame = chosen[moment].frame
            _draw(axes, pictures[camera].get(frame), chosen[moment].cameras[camera])
            axes.set_title(f"{camera}, frame {frame}, {_MOMENTS[moment]}: {_theta(whisk, frame)}", loc="left")
    return figure


def _theta(whisk: SeenWhisk, frame: int) -> str:
    (theta_rad,) = whisk.frames.theta_rad.value[whisk.frames.index == frame]
    return f"{np.degrees(theta_rad):+.2f}° past touch"


def _pictures(trial: Trial, cameras, frames: set[int]) -> dict[str, dict[int, np.ndarray]]:
    """Pictures by camera and frame; a camera that dropped a frame lacks it."""
    times, pictures = frame_times(trial), {}
    for camera in cameras:
        index = {frame: int(times.picture[camera][frame]) for frame in frames}
        read = read_frames(trial.camera_sources[camera], [k for k in index.values() if k >= 0])
        pictures[camera] = {frame: read.get(k) for frame, k in index.items()}
    return pictures


def _draw(axes: Axes, picture, lines: dict[str, np.ndarray]) -> None:
    """The picture around the whisker with its lines, and the contact enlarged beside it."""
    if picture is None:
        axes.text(0.5, 0.5, "no picture", transform=axes.transAxes, ha="center")
        axes.set_axis_off()
        return
    contact = lines["contact"]
    inset, white = axes.inset_axes((0.76, 0.02, 0.23, 0.41)), np.percentile(picture, 99.8)
    for target in (axes, inset):
        target.imshow(picture, cmap="gray", vmax=white, interpolation="nearest")
        for name, colour in (("bar_left", _BAR), ("bar_right", _BAR), ("wire", _WIRE)):
            target.plot(*lines[name].T, color=colour, lw=0.7)
        target.plot(*contact, "+", color=_CONTACT, ms=9, mew=1.2)
        target.set(xticks=[], yticks=[])
    _look_at(axes, picture, lines["wire"])
    (x, y), around = contact, np.array([-_AROUND_PX, _AROUND_PX])
    inset.set(xlim=x + around, ylim=y - around)
    for edge in inset.spines.values():
        edge.set(visible=True, color="white", lw=1.2)
    axes.indicate_inset_zoom(inset, edgecolor="white", lw=0.8)


def _look_at(axes: Axes, picture, wire) -> None:
    """The part of the picture that holds the whisker, in the shape of 16:9."""
    height, width = picture.shape
    finite = wire[np.isfinite(wire).all(axis=1)]
    middle, size = 0.5 * (finite.min(axis=0) + finite.max(axis=0)), np.ptp(finite, axis=0) + 2 * _MARGIN_PX
    size = max(size[0], size[1] * 16 / 9) * np.array([1.0, 9 / 16])
    low = np.clip(middle - 0.5 * size, 0, np.maximum(np.array([width, height]) - size, 0))
    high = np.minimum(low + size, [width, height])
    axes.set(xlim=(low[0] - 0.5, high[0] - 0.5), ylim=(high[1] - 0.5, low[1] - 0.5))
