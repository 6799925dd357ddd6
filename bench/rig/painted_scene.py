"""What stands in front of a camera: floor, board, post and hub, whisker, bar with its block. Drawn far to near."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.rig.bar import Bar
from bench.rig.layer import Front, draw_layers
from bench.rig.light import Light, Material
from bench.rig.linear import rotate_about_z
from bench.rig.pinhole import Camera
from bench.rig.plate import Plate, Print
from bench.rig.printed_board import Board, Ink, marker
from bench.rig.solid import Solid
from bench.rig.tube import Tube, draw_tubes
from bench.rig.window import Window

HUB_FRONT_MM = 5.0  # how far the hub reaches along the whisker
# mm: corners of the hub's block, its own axes
_HUB_LOW, _HUB_HIGH = np.array([-17.0, -9.0, -6.0]), np.array([HUB_FRONT_MM, 9.0, 7.0])
_SLIM_MM = 4.0  # half the width of a hub that has neighbours
_SHAFT_X_MM = -6.0  # of the motor's shaft, in the hub's axes
_BLOCK_HALF = np.array([9.0, 9.0, 7.0])  # mm: half the bar's block, each way
_BLOCK_UP_MM = 52.0  # along the bar from where it is touched
_AWAY = np.array([0.0, 1.0, 0.0])  # (3,): from whiskers and cameras
_ROD_MM, _ROD_RADIUS_MM = 150.0, 2.5  # that holds an object which is no bar, from behind
_HUB_MARKER, _BLOCK_MARKER = -2, -1  # from the end of the dictionary, where no board's markers are


@dataclass(frozen=True)
class Looks:
    """Light and surfaces of a scene, and where its floor and its wall are."""

    light: Light
    ink: Ink
    wire: Material
    bar: Material
    dark: Material
    floor: float
    wall: float
    floor_z_mm: float = -95.0
    wall_y_mm: float = 420.0
    margin_mm: float = 7.5  # of white paper round the board's squares


@dataclass(frozen=True, eq=False)
class Box:
    """A block with plain faces and perhaps a marker on one. Axes (3, 3): its own x, y, z as columns, rig frame."""

    low_mm: np.ndarray
    high_mm: np.ndarray
    axes: np.ndarray
    origin_mm: np.ndarray
    reflectance: float
    marked: bool = False

    def faces(self) -> Iterator[tuple[tuple[int, int], Plate]]:
        """(name, plate) of the six faces, prints facing outwards."""
        for axis in range(3):
            for end, limit in ((-1, self.low_mm), (1, self.high_mm)):
                yield (axis, end), self._face(axis, end, limit[axis])

    def _face(self, axis, end, level):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        inward = -end * self.axes[:, axis]
        first, second = self.axes[:, i], np.cross(inward, self.axes[:, i])
        low, high = self.low_mm, self.high_mm
        from_j = low[j] if second @ self.axes[:, j] > 0 else high[j]
        corner = self.axes[:, axis] * level + first * low[i] + self.axes[:, j] * from_j
        pose = np.column_stack([first, second, inward, self.origin_mm + corner])
        return Plate(Print.plain(high[i] - low[i], high[j] - low[j], self.reflectance), pose)

    def draw(
        self,
        window: Window,
        radiance: np.ndarray,
        light: Light,
        print_: Print | None = None,
        on: tuple[int, int] = (2, 1),
    ) -> None:
        """All faces, and a print centred on one of them."""
        for name, plate in self.faces():
            plate.draw(window, radiance, light)
            if print_ is not None and name == on:
                x, y = (0.5 * e[[0, -1]].sum() for e in (plate.print.x_mm, plate.print.y_mm))
                Plate(print_.moved(x, y), plate.pose).draw(window, radiance, light)


@dataclass(frozen=True, eq=False)
class Stand:
    """Where a hub turns: the pose (3, 4) of its base in the rig frame, the corners (3,) of its block in its own axes,
    mm; whether it has a marker, and a post round its shaft."""

    pose: np.ndarray
    low_mm: np.ndarray
    high_mm: np.ndarray
    has_marker: bool = False

    @classmethod
    def alone(cls) -> "Stand":
        """The hub of one whisker at the rig's origin."""
        return cls(np.eye(3, 4), _HUB_LOW, _HUB_HIGH, True)

    @classmethod
    def of_column(cls, pose: np.ndarray, heights_mm: Sequence[float]) -> "Stand":
        """A slim hub that holds whiskers at these heights."""
        low, high = (
            [x, side * _SLIM_MM, z + height]
            for (x, _, z), side, height in (
                (_HUB_LOW, -1, min(heights_mm)),
                (_HUB_HIGH, 1, max(heights_mm)),
            )
        )
        return cls(pose, np.array(low), np.array(high))

    def hub(self, motor_rad: float) -> Box:
        """The hub at a motor angle."""
        axes = self.pose[:, :3] @ rotate_about_z(np.eye(3), motor_rad).T
        return Box(self.low_mm, self.high_mm, axes, self.pose[:, 3], 0.05, self.has_marker)

    def posts(self, looks: Looks) -> Iterator[Tube]:
        """Down to the floor."""
        floor = looks.floor_z_mm - self.pose[2, 3]
        if self.has_marker:
            yield self._along_shaft(self.low_mm[2] - 12.0, floor, 11.0, looks)
            floor = self.low_mm[2] - 13.0
        yield self._along_shaft(self.low_mm[2] + 2.0, floor, 3.0, looks)

    def _along_shaft(self, from_mm, to_mm, radius_mm, looks):
        ends = (
            self.pose[:, :3] @ [_SHAFT_X_MM, 0.0, z] + self.pose[:, 3] for z in (from_mm, to_mm)
        )
        return Tube.straight(*ends, radius_mm, looks.dark)


@dataclass(frozen=True, eq=False)
class Scene:
    """The rig that a board, a bar and whiskers on their stands make. `T_rig_board` (3, 4)."""

    board: Board
    T_rig_board: np.ndarray
    looks: Looks
    stands: tuple[Stand, ...]

    def backdrop(self, window: Window) -> np.ndarray:
        """Floor, wall and board: what the rig's board picture shows."""
        radiance = floor_and_wall(window, self.looks)
        self.print_board(window, radiance, self.T_rig_board)
        return radiance

    def print_board(self, window: Window, radiance: np.ndarray, T_rig_board: np.ndarray) -> None:
        """The board anywhere, as the views for the lens show it."""
        self._board_plate(T_rig_board).draw(window, radiance, self.looks.light)

    def _board_plate(self, T_rig_board):
        return Plate(self.board.printed(self.looks.ink, self.looks.margin_mm), T_rig_board)

    def stand_bar(
        self, window: Window, radiance: np.ndarray, bar: Bar, middle_mm: np.ndarray
    ) -> None:
        """The posts under the hubs, and the bar (its middle where first touched) with a block at its upper end."""
        looks = self.looks
        self._stand_posts(window, radiance)
        down, block = (
            middle_mm - self._reach_down(bar, middle_mm) * bar.axis,
            _block(bar, middle_mm),
        )
        Tube.straight(down, block.origin_mm, bar.radius_mm, looks.bar).draw(
            window, radiance, looks.light
        )
        print_ = marker(self.board.dictionary, self._marker(_BLOCK_MARKER), 10.0, looks.ink)
        block.draw(window, radiance, looks.light, print_, (1, 1))

    def stand_rounded(self, window: Window, radiance: np.ndarray, thing: Bar) -> Front | None:
        """The posts under the hubs, and a ring, sphere or cone on a rod from behind; the object as it hides what is
        behind it, None where it is not seen. What is below the board is hidden."""
        looks = self.looks
        self._stand_posts(window, radiance)
        held = thing.support_mm()
        rod = Tube.straight(held, held + _ROD_MM * _AWAY, _ROD_RADIUS_MM, looks.dark)
        layers = [
            rod.layer(window, looks.light),
            Solid(thing, looks.bar).layer(window, looks.light),
        ]
        board = self._board_plate(self.T_rig_board)
        left = [
            replace(layer, cover=layer.cover * (1 - board.hides(window, layer)))
            for layer in layers
            if layer
        ]
        draw_layers(left, radiance)
        return Front.of(left[-1], window) if layers[-1] else None

    def _stand_posts(self, window, radiance):
        for post in (post for stand in self.stands for post in stand.posts(self.looks)):
            post.draw(window, radiance, self.looks.light)

    def _reach_down(self, bar, middle):
        """To the board, but no further than a rod of this length would."""
        below = self.T_rig_board[:, 2]
        towards = -(bar.axis @ below)
        to_board = (
            (self.T_rig_board[:, 3] - middle) @ below / towards if abs(towards) > 1e-6 else math.inf
        )
        return float(np.clip(abs(to_board), 20, 75))

    def _marker(self, from_end):
        known = self.board.opencv().getDictionary()
        return len(known.bytesList) + from_end

    def move(
        self,
        window: Window,
        radiance: np.ndarray,
        hubs: Sequence[Box],
        whiskers: Sequence[Tube],
        front: Front | None = None,
    ) -> None:
        """Hubs and whiskers: a hub whose front, out of which its whiskers stand, faces the camera is behind all
        whiskers, another one before them. front: an object that may hide whiskers."""
        centre = window.camera.centre_mm
        behind = [dict(hub.faces())[(0, 1)].faces(centre) for hub in hubs]
        self._draw_hubs(
            window, radiance, [hub for hub, is_behind in zip(hubs, behind) if is_behind]
        )
        draw_tubes(whiskers, window, radiance, self.looks.light, front)
        self._draw_hubs(
            window, radiance, [hub for hub, is_behind in zip(hubs, behind) if not is_behind]
        )

    def _draw_hubs(self, window, radiance, hubs):
        centre = window.camera.centre_mm
        for hub in sorted(hubs, key=lambda hub: -np.linalg.norm(hub.origin_mm - centre)):
            print_ = marker(self.board.dictionary, self._marker(_HUB_MARKER), 10.0, self.looks.ink)
            hub.draw(window, radiance, self.looks.light, print_ if hub.marked else None)

    def moving_px(
        self, camera: Camera, hubs: Sequence[Box], whiskers: Sequence[Tube]
    ) -> np.ndarray:
        """Pixels (n, 2) between which all that moves lies."""
        corners = np.concatenate([plate.corners_mm() for hub in hubs for _, plate in hub.faces()])
        return np.concatenate(
            [camera.project(corners), *(px for one in whiskers for px in one.silhouette(camera))]
        )


def _block(bar: Bar, middle_mm: np.ndarray) -> Box:
    """The block that holds a bar at its upper end."""
    front = np.array([0.0, -1.0, 0.0]) - bar.axis * -bar.axis[1]
    front /= np.linalg.norm(front)
    axes = np.column_stack([np.cross(front, bar.axis), front, bar.axis])
    return Box(-_BLOCK_HALF, _BLOCK_HALF, axes, middle_mm + _BLOCK_UP_MM * bar.axis, 0.1)


def block_corners_mm(bar: Bar, middle_mm: np.ndarray) -> np.ndarray:
    """Corners (24, 3) of the block that holds a bar whose middle is near a point, face by face."""
    return np.concatenate([plate.corners_mm() for _, plate in _block(bar, middle_mm).faces()])


def floor_and_wall(window: Window, looks: Looks) -> np.ndarray:
    """A grey floor that darkens away from the rig, and the wall behind it."""
    coarse = Window(window.camera, window.left, window.top, window.right, window.bottom, 1, 1.0)
    x, y = coarse.rays()
    rays = np.stack([x, y, np.ones_like(x)], -1) @ window.camera.rotation.astype(np.float32)
    centre = window.camera.centre_mm
    down, back = np.minimum(rays[..., 2], -1e-3), np.maximum(rays[..., 1], 1e-3)
    to_floor, to_wall = (looks.floor_z_mm - centre[2]) / down, (looks.wall_y_mm - centre[1]) / back
    beyond = 1 / (1 + np.exp(np.clip((to_floor - to_wall) / 1.5, -50, 50)))
    at = rays * np.minimum(to_floor, to_wall)[..., None] + centre
    near = 1 / (1 + (at[..., 0] - 40) ** 2 / 9e5 + at[..., 1] ** 2 / 9e5)
    grain = 1 + 0.02 * np.sin(0.11 * at[..., 0] + 0.3) * np.sin(
        0.13 * at[..., 1] + 0.7 * at[..., 2]
    )
    light = looks.light
    floor, wall = (
        r * light.flat(n) for r, n in ((looks.floor, [0, 0, 1.0]), (looks.wall, [0, -1.0, 0]))
    )
    tone = ((floor * beyond + wall * (1 - beyond)) * near * grain).astype(np.float32)
    return np.repeat(np.repeat(tone, window.fine, 0), window.fine, 1)
