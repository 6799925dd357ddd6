"""The bench with its cameras from above and from the side, and what each camera will see of one trial."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.base.drawing import publish, style
from bench.plan.painted import Painter
from bench.plan.sight import curves_of
from bench.plan.staged import Staged
from vision.geometry.camera import Camera, Cameras
from vision.geometry.rotation import apply
from vision.geometry.silhouette import normals

_SIDES = {"from above": (0, 1), "from the side": (0, 2)}
_BAR_MM = 45.0  # of a bar drawn to either side of the contact
_COLOURS = ("#2166ac", "#b2182b", "#1b7837", "#762a83", "#8c510a", "#01665e")


@dataclass(frozen=True, eq=False)
class Bench:
    """What is drawn: cameras, whisks, and the board's outline (4, 3) in the rig frame, None where there is none."""

    cameras: Cameras
    staged: Sequence[Staged]
    board_mm: np.ndarray | None

    @property
    def contact_mm(self) -> np.ndarray:
        """The mean contact (3,)."""
        return np.mean([one.touch.point_mm for one in self.staged], axis=0)


def board_outline(
    T_rig_board: np.ndarray, squares: tuple[int, int], square_mm: float
) -> np.ndarray:
    """Corners (4, 3) of a board that stands on the rig."""
    width, height = np.array(squares) * square_mm
    return apply(
        T_rig_board,
        np.array([[0, 0, 0], [width, 0, 0], [width, height, 0], [0, height, 0]], dtype=float),
    )


def write_picture(
    out: Path, bench: Bench, views: Mapping[str, np.ndarray], shown: Staged | None, name: str
) -> Path:
    """plan.png: the bench, and below it each camera's picture of the trial `name`, where there are pictures."""
    with style():
        columns = max(2, len(views))
        figure = Figure(figsize=(4.2 * columns, 7.2 if views else 4.2), layout="constrained")
        grid = figure.add_gridspec(
            2 if views else 1, 2 * columns, height_ratios=[1.25, 1.0] if views else [1.0]
        )
        for k, (side, axes) in enumerate(_SIDES.items()):
            _bench(figure.add_subplot(grid[0, k * columns : (k + 1) * columns]), bench, axes, side)
        for k, (camera, picture) in enumerate(views.items()):
            _view(
                figure.add_subplot(grid[1, 2 * k : 2 * k + 2]),
                bench.cameras[camera],
                picture,
                shown,
                name,
            )
        return publish(figure, out / "plan", ("png",), dpi=110)[0]


def _bench(axis: Axes, bench: Bench, sides: tuple[int, int], title: str) -> None:
    """One drawing, two of the rig frame's axes."""
    first = bench.staged[0]
    if bench.board_mm is not None:
        axis.fill(*bench.board_mm[:, sides].T, color="#dddddd", label="board")
    for one in bench.staged:
        ends = one.foot_mm + np.array([[-_BAR_MM], [_BAR_MM]]) * one.axis.direction
        axis.plot(*ends[:, sides].T, color="#999999", lw=1.5)
    middle = first.touch.motor_rad
    wire = np.array(
        [[0, 0, 0], first.rods.wire.length_mm * np.array([np.cos(middle), np.sin(middle), 0.0])]
    )
    axis.plot(*wire[:, sides].T, color="black", lw=2)
    axis.plot(0, 0, "ks", ms=7)
    for camera, colour in zip(bench.cameras, _COLOURS * 3):
        _camera(axis, camera, bench.contact_mm, sides, colour)
    axis.set_aspect("equal", adjustable="datalim")
    axis.set(xlabel=f"{'xyz'[sides[0]]} / mm", ylabel=f"{'xyz'[sides[1]]} / mm", title=title)


def _camera(
    axis: Axes, camera: Camera, contact_mm: np.ndarray, sides: tuple[int, int], colour: str
) -> None:
    """Where it is, and the edges of its picture out to the contact."""
    width, height = camera.size_px
    corners = camera.rays(np.array([[0, 0], [width, 0], [width, height], [0, height]], dtype=float))
    ahead = camera.T_camera_rig[2, :3]
    depth = (contact_mm - camera.centre_mm) @ ahead
    reached = camera.centre_mm + corners * (depth / (corners @ ahead))[:, None]
    for corner in reached:
        axis.plot(
            *np.array([camera.centre_mm, corner])[:, sides].T, color=colour, lw=0.6, alpha=0.6
        )
    axis.plot(*np.vstack([reached, reached[:1]])[:, sides].T, color=colour, lw=0.8)
    axis.plot(*camera.centre_mm[list(sides)], "o", color=colour, ms=7)
    axis.annotate(
        camera.name,
        camera.centre_mm[list(sides)],
        xytext=(6, 6),
        textcoords="offset points",
        color=colour,
    )


def _view(axis: Axes, camera: Camera, picture: np.ndarray, shown: Staged, name: str) -> None:
    """A painted frame with wire, bar and contact drawn in."""
    width, height = camera.size_px
    axis.imshow(
        picture,
        cmap="gray",
        vmin=0,
        vmax=np.iinfo(picture.dtype).max if picture.dtype == np.uint8 else None,
    )
    frame = last_frame(shown)
    wire = camera.project(curves_of(shown, [frame])[frame].points_mm)
    axis.plot(*wire.T, color="#e08214", lw=0.8)
    middle, half = shown.axis.covering_discs(camera, shown.rods.bar.radius_mm)
    for side in (-1, 1):
        axis.plot(*(middle + side * half[:, None] * normals(middle)).T, color="#67a9cf", lw=0.8)
    axis.plot(*camera.project(shown.touch.point_mm[None])[0], "+", color="#b2182b", ms=9)
    axis.set(
        xlim=(-0.5, width - 0.5),
        ylim=(height - 0.5, -0.5),
        xticks=[],
        yticks=[],
        title=f"{camera.name}: {name}",
    )


def last_frame(staged: Staged) -> int:
    """The frame of the largest motor angle."""
    return int(np.argmax(staged.motor_rad))


def painted_views(painter: Painter, staged: Staged) -> dict[str, np.ndarray]:
    """Each camera's picture of a whisk at its largest angle."""
    frame = last_frame(staged)
    return {
        camera.name: painter.frame(number, staged, painter.setting(number, staged), frame)
        for number, camera in enumerate(painter.cameras)
    }
