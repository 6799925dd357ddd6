"""The bench with its cameras from above and from the side, and what each camera will see of one trial."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.base.drawing import publish, style
from bench.plan.staged import StagedWhisk
from vision.geometry import Camera, Cameras, apply

_SIDES = {"from above": (0, 1), "from the side": (0, 2)}
# [mm] Of a bar that is drawn to either side of the contact. A layout.
_BAR_MM = 45.0
# [mm] Of a bar's edges in a camera's picture, to either side of the contact. A layout.
_EDGES_MM = 60.0
# [points] Of each of these edges. A layout.
_EDGE_POINTS = 121
_COLOURS = ("#2166ac", "#b2182b", "#1b7837", "#762a83", "#8c510a", "#01665e")


@dataclass(frozen=True, eq=False)
class Bench:
    """What is drawn: cameras, whisks, and the board's outline (4, 3) in the rig frame, mm.

    board_mm: None where there is no board.
    """

    cameras: Cameras
    staged: Sequence[StagedWhisk]
    board_mm: np.ndarray | None

    @property
    def contact_mm(self) -> np.ndarray:
        """Return the mean contact (3,)."""
        return np.mean([whisk.known.contact_mm for whisk in self.staged], axis=0)


@dataclass(frozen=True, eq=False)
class PaintedTrial:
    """One trial as the cameras will see it: its name, its whisk, and by camera its last frame."""

    name: str
    staged: StagedWhisk
    pictures: Mapping[str, np.ndarray]


def board_outline(
    T_rig_board: np.ndarray, squares: tuple[int, int], square_mm: float
) -> np.ndarray:
    """Return the corners (4, 3) of a board that stands on the rig, mm."""
    width, height = np.array(squares) * square_mm
    corners = [[0, 0, 0], [width, 0, 0], [width, height, 0], [0, height, 0]]
    return apply(T_rig_board, np.array(corners, dtype=float))


def write_drawing(out: Path, bench: Bench, painted: PaintedTrial | None = None) -> Path:
    """Write plan.png: the bench, and below it each camera's picture of a trial, if there is one."""
    pictures = {} if painted is None else painted.pictures
    columns = max(2, len(pictures))
    with style():
        figure = Figure(figsize=(4.2 * columns, 7.2 if pictures else 4.2), layout="constrained")
        heights = [1.25, 1.0] if pictures else [1.0]
        grid = figure.add_gridspec(len(heights), 2 * columns, height_ratios=heights)
        for k, (title, side) in enumerate(_SIDES.items()):
            place = grid[0, k * columns : (k + 1) * columns]
            _draw_bench(figure.add_subplot(place), bench, side, title)
        for k, name in enumerate(pictures):
            place = grid[1, 2 * k : 2 * k + 2]
            _draw_picture(figure.add_subplot(place), bench.cameras[name], painted)
        return publish(figure, out / "plan", ("png",), dpi=110)[0]


def _draw_bench(axes: Axes, bench: Bench, side: tuple[int, int], title: str) -> None:
    """Draw the bench from one side: two axes of the rig frame."""
    if bench.board_mm is not None:
        axes.fill(*bench.board_mm[:, side].T, color="#dddddd", label="board")
    for whisk in bench.staged:
        axes.plot(*_bar_ends_mm(whisk)[:, side].T, color="#999999", lw=1.5)
    axes.plot(*_wire_mm(bench.staged[0])[:, side].T, color="black", lw=2)
    axes.plot(0, 0, "ks", ms=7)
    _draw_cameras(axes, bench, side)
    axes.set_aspect("equal", adjustable="datalim")
    horizontal, vertical = ("xyz"[number] for number in side)
    axes.set(xlabel=f"{horizontal} / mm", ylabel=f"{vertical} / mm", title=title)


def _draw_cameras(axes: Axes, bench: Bench, side: tuple[int, int]) -> None:
    """Draw each camera, and its picture as far ahead as the contact."""
    for number, camera in enumerate(bench.cameras):
        corners_mm = _corners_at(camera, bench.contact_mm)
        colour = _COLOURS[number % len(_COLOURS)]
        _draw_camera(axes, camera, corners_mm[:, side], camera.centre_mm[list(side)], colour)


def _bar_ends_mm(whisk: StagedWhisk) -> np.ndarray:
    """Return the ends (2, 3) of the part of a bar that is drawn, in the rig frame."""
    bar = whisk.known.axis
    half_mm = _BAR_MM * bar.direction
    return np.array([bar.point_mm - half_mm, bar.point_mm + half_mm])


def _wire_mm(whisk: StagedWhisk) -> np.ndarray:
    """Return base and tip (2, 3) of the straight wire at first touch, in the rig frame."""
    known = whisk.known
    direction = np.array([np.cos(known.touch_rad), np.sin(known.touch_rad), 0.0])
    return np.array([np.zeros(3), known.rods.wire.length_mm * direction])


def _corners_at(camera: Camera, point_mm: np.ndarray) -> np.ndarray:
    """Return where rays through the corners of a picture are as far ahead as a point, (4, 3) mm."""
    width, height = camera.size_px
    corners_px = np.array([[0, 0], [width, 0], [width, height], [0, height]], dtype=float)
    rays = camera.rays(corners_px)
    ahead = camera.T_camera_rig[2, :3]
    depth_mm = (point_mm - camera.centre_mm) @ ahead
    return camera.centre_mm + rays * (depth_mm / (rays @ ahead))[:, None]


def _draw_camera(
    axes: Axes, camera: Camera, corners_mm: np.ndarray, centre_mm: np.ndarray, colour: str
) -> None:
    """Draw where a camera is (2,), and the edges of its picture out to the corners (4, 2)."""
    for corner_mm in corners_mm:
        axes.plot(*np.array([centre_mm, corner_mm]).T, color=colour, lw=0.6, alpha=0.6)
    axes.fill(*corners_mm.T, fill=False, edgecolor=colour, lw=0.8)
    axes.plot(*centre_mm, "o", color=colour, ms=7)
    axes.annotate(camera.name, centre_mm, xytext=(6, 6), textcoords="offset points", color=colour)


def _draw_picture(axes: Axes, camera: Camera, painted: PaintedTrial) -> None:
    """Draw a painted frame with wire, bar and contact."""
    picture = painted.pictures[camera.name]
    white = np.iinfo(picture.dtype).max if picture.dtype == np.uint8 else None
    axes.imshow(picture, cmap="gray", vmin=0, vmax=white)
    _draw_known(axes, camera, painted.staged)
    width, height = camera.size_px
    axes.set(
        xlim=(-0.5, width - 0.5),
        ylim=(height - 0.5, -0.5),
        xticks=[],
        yticks=[],
        title=f"{camera.name}: {painted.name}",
    )


def _draw_known(axes: Axes, camera: Camera, whisk: StagedWhisk) -> None:
    """Draw the wire pushed furthest, the bar's edges and the contact as a camera sees them."""
    known = whisk.known
    last = int(np.argmax(known.motor_rad))
    wire_px = camera.project(known.curves([last])[last].points_mm)
    axes.plot(*wire_px.T, color="#e08214", lw=0.8)
    radius_mm = known.rods.bar.radius_mm
    for edge_px in known.axis.edges_px(camera, radius_mm, _EDGES_MM, _EDGE_POINTS):
        axes.plot(*edge_px.T, color="#67a9cf", lw=0.8)
    axes.plot(*camera.project(known.contact_mm[None])[0], "+", color="#b2182b", ms=9)
