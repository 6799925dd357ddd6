"""The measured rig drawn into the pictures of the board on it: centre, axis and x, each with its ±."""

from typing import TYPE_CHECKING

import numpy as np

from bench.cameras.session_cameras import SessionCalibration
from vision.calibration import Placement
from vision.geometry import Camera, apply

if TYPE_CHECKING:  # matplotlib is loaded where something is drawn
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# [draws] Of the rig frame's covariance, drawn as thin lines. Chosen.
_DRAWS = 60
# [mm] Lengths of the drawn axes. Chosen.
_ALONG_X_MM = 100.0
_ALONG_Z_MM = 30.0
_WIDTH_IN = 5.2


def draw_rig(calibration: SessionCalibration, covariance: np.ndarray) -> "Figure":
    """Return the figure, a panel for each camera.

    calibration: in the measured rig frame; covariance (6, 6): of that frame, rad and mm.
    """
    from matplotlib.figure import Figure

    cameras = list(calibration.cameras)
    height_in = _WIDTH_IN * cameras[0].size_px[1] / cameras[0].size_px[0] + 0.6
    figure = Figure(figsize=(_WIDTH_IN * len(cameras), height_in), dpi=150, layout="constrained")
    panels = figure.subplots(1, len(cameras), squeeze=False)[0]
    draws = np.random.default_rng(0).multivariate_normal(np.zeros(6), covariance, _DRAWS)
    for axes, camera in zip(panels, cameras):
        _draw_camera(axes, camera, calibration.background[camera.name], draws)
    panels[0].legend(loc="lower left", fontsize=7, framealpha=0.8)
    return figure


def _draw_camera(
    axes: "Axes", camera: Camera, picture: np.ndarray | None, draws: np.ndarray
) -> None:
    """Draw the rig frame into a camera's picture, and where it may also stand (draws, 6)."""
    if picture is not None:
        axes.imshow(picture, cmap="gray", interpolation="nearest")
    axes.set_title(f"{camera.name}: thin lines are {len(draws)} draws of the ±", fontsize=8)
    axes.set_xlim(-0.5, camera.size_px[0] - 0.5)
    axes.set_ylim(camera.size_px[1] - 0.5, -0.5)
    axes.set_axis_off()
    _draw_frame(axes, camera, draws)


def _draw_frame(axes: "Axes", camera: Camera, draws: np.ndarray) -> None:
    """Draw axes and centre of the rig frame, and the axes of its `draws` (n, 6)."""
    x_axis = np.array([[0.0, 0.0, 0.0], [_ALONG_X_MM, 0.0, 0.0]])
    z_axis = np.array([[0.0, 0.0, -_ALONG_Z_MM], [0.0, 0.0, _ALONG_Z_MM]])
    lines = ((x_axis, "tab:red", "x: whisker at motor angle 0"), (z_axis, "tab:cyan", "z: axis"))
    for ends_mm, colour, label in lines:
        for draw in draws:
            moved = apply(Placement(draw, np.zeros((6, 6))).T_board_rig, ends_mm)
            axes.plot(*camera.project(moved).T, color=colour, linewidth=0.3, alpha=0.4)
        axes.plot(*camera.project(ends_mm).T, color=colour, linewidth=1.0, label=label)
    centre = camera.project(np.zeros((1, 3)))[0]
    axes.plot(*centre, "o", color="yellow", markersize=4, fillstyle="none", label="centre")
