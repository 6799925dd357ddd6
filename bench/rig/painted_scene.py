"""The objects in front of a camera: floor, board, posts and hubs, whiskers, the bar with its block.
They are drawn far to near."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit

from bench.rig.bar import TouchedBar
from bench.rig.box import Box
from bench.rig.layer import Occluder, draw_layers
from bench.rig.light import Light, Material
from bench.rig.linear import rotate_about_z
from bench.rig.other_boards import AnyBoard
from bench.rig.pinhole import PinholeCamera
from bench.rig.plate import Plate, Print
from bench.rig.printed_board import Ink, marker_count, marker_print
from bench.rig.rays import unit
from bench.rig.solid import Solid
from bench.rig.touched_object import TouchedObject
from bench.rig.tube import Tube, draw_tubes
from bench.rig.window import Window

HUB_FRONT_MM = 5.0  # how far the hub reaches along the whisker
# mm: corners of the hub's block, its own axes
_HUB_LOW, _HUB_HIGH = np.array([-17.0, -9.0, -6.0]), np.array([HUB_FRONT_MM, 9.0, 7.0])
_HUB_FRONT, _HUB_TOP, _BLOCK_FRONT = (0, 1), (2, 1), (1, 1)  # faces of boxes
_SLIM_MM = 4.0  # half the width of a hub that has neighbours
_SHAFT_X_MM = -6.0  # of the motor's shaft, in the hub's axes
_BLOCK_HALF = np.array([9.0, 9.0, 7.0])  # mm: half the bar's block, each way
_BLOCK_UP_MM = 52.0  # along the bar from where it is touched
_BAR_DOWN_MM = 20.0, 75.0  # least and most of a bar below where it is touched
_AWAY = np.array([0.0, 1.0, 0.0])  # (3,): from whiskers and cameras
_ROD_MM, _ROD_RADIUS_MM = 150.0, 2.5  # that holds an object which is no bar, from behind
_HUB_MARKER, _BLOCK_MARKER = -2, -1  # from the end of the dictionary, where no board's markers are
_SHADE_MM2 = 9e5  # the floor darkens by half at the root of this from _LIT_X_MM
_LIT_X_MM = 40.0  # along the rig's x: where the floor is brightest
_CREASE_MM = 1.5  # over which floor turns into wall
_GRAIN = 0.02  # of the floor's tone


@dataclass(frozen=True)
class Appearance:
    """Light and surfaces of a scene, and where its floor and its wall are.

    floor, wall: reflectances. margin_mm: of white paper round the board's squares.
    """

    light: Light
    ink: Ink
    wire: Material
    bar: Material
    dark: Material
    floor: float
    wall: float
    floor_z_mm: float = -95.0
    wall_y_mm: float = 420.0
    margin_mm: float = 7.5


@dataclass(frozen=True, eq=False)
class Stand:
    """The place where a hub turns.

    pose (3, 4): of its base in the rig frame. low_mm, high_mm (3,): corners of its block on its own
    axes. has_marker: whether it has a marker, and a post round its shaft.
    """

    pose: np.ndarray
    low_mm: np.ndarray
    high_mm: np.ndarray
    has_marker: bool = False

    @classmethod
    def alone(cls) -> "Stand":
        """Return the stand of one whisker at the rig's origin."""
        return cls(np.eye(3, 4), _HUB_LOW, _HUB_HIGH, True)

    @classmethod
    def of_column(cls, pose: np.ndarray, heights_mm: Sequence[float]) -> "Stand":
        """Return the stand of a slim hub that holds whiskers at these heights."""
        low = np.array([_HUB_LOW[0], -_SLIM_MM, _HUB_LOW[2] + min(heights_mm)])
        high = np.array([_HUB_HIGH[0], _SLIM_MM, _HUB_HIGH[2] + max(heights_mm)])
        return cls(pose, low, high)

    def hub(self, motor_rad: float) -> Box:
        """Return the hub at a motor angle."""
        axes = self.pose[:, :3] @ rotate_about_z(np.eye(3), motor_rad).T
        return Box(self.low_mm, self.high_mm, axes, self.pose[:, 3], 0.05, self.has_marker)

    def posts(self, appearance: Appearance) -> list[Tube]:
        """Return the shaft from the hub down to the floor, or to the post round it, and that post."""
        floor = appearance.floor_z_mm - self.pose[2, 3]
        under = self.low_mm[2]
        if not self.has_marker:
            return [self._upright(under + 2.0, floor, 3.0, appearance.dark)]
        post = self._upright(under - 12.0, floor, 11.0, appearance.dark)
        return [post, self._upright(under + 2.0, under - 13.0, 3.0, appearance.dark)]

    def _upright(self, top_mm, bottom_mm, radius_mm, material):
        """Return a tube along the motor's shaft between two heights in the hub's axes."""
        top = self.pose @ [_SHAFT_X_MM, 0.0, top_mm, 1.0]
        bottom = self.pose @ [_SHAFT_X_MM, 0.0, bottom_mm, 1.0]
        return Tube.straight(top, bottom, radius_mm, material)


@dataclass(frozen=True, eq=False)
class Scene:
    """The rig that a board, a bar and whiskers on their stands make. T_rig_board (3, 4): of its print."""

    board: AnyBoard
    T_rig_board: np.ndarray
    appearance: Appearance
    stands: tuple[Stand, ...]

    def draw_backdrop(self, window: Window) -> np.ndarray:
        """Draw floor, wall and board, as the rig's board picture shows them; return the radiance."""
        radiance = draw_floor_and_wall(window, self.appearance)
        self.draw_board(window, radiance, self.T_rig_board)
        return radiance

    def draw_board(self, window: Window, radiance: np.ndarray, T_rig_board: np.ndarray) -> None:
        """Draw the board at any pose, as the views for the lens show it."""
        self._board_plate(T_rig_board).draw(window, radiance, self.appearance.light)

    def _board_plate(self, T_rig_board):
        """Return the printed board at a pose (3, 4)."""
        appearance = self.appearance
        return Plate(self.board.to_print(appearance.ink, appearance.margin_mm), T_rig_board)

    def draw_bar(
        self, window: Window, radiance: np.ndarray, bar: TouchedBar, middle_mm: np.ndarray
    ) -> None:
        """Draw the posts under the hubs, and a bar with a block at its upper end.

        middle_mm (3,): of the bar, where it is first touched.
        """
        light = self.appearance.light
        self._draw_posts(window, radiance)
        bottom = middle_mm - self._reach_down_mm(bar, middle_mm) * bar.axis
        block = _block(bar, middle_mm)
        tube = Tube.straight(bottom, block.origin_mm, bar.radius_mm, self.appearance.bar)
        tube.draw(window, radiance, light)
        block.draw(window, radiance, light, self._marker(_BLOCK_MARKER), _BLOCK_FRONT)

    def draw_round_object(
        self, window: Window, radiance: np.ndarray, thing: TouchedObject
    ) -> Occluder | None:
        """Draw the posts under the hubs, and a ring, sphere or cone on a rod from behind.

        What is below the board is hidden. Return the object as it hides what is behind it; None
        where it is not seen.
        """
        light = self.appearance.light
        self._draw_posts(window, radiance)
        held = thing.support_mm()
        rod = Tube.straight(held, held + _ROD_MM * _AWAY, _ROD_RADIUS_MM, self.appearance.dark)
        board = self._board_plate(self.T_rig_board)
        layers = []
        for layer in (
            rod.layer(window, light),
            Solid(thing, self.appearance.bar).layer(window, light),
        ):
            layers.append(layer and board.hide(layer, window))
        draw_layers([layer for layer in layers if layer], radiance)
        return layers[-1] and Occluder.from_layer(layers[-1], window)

    def _draw_posts(self, window, radiance):
        """Draw the posts under all hubs."""
        for stand in self.stands:
            for post in stand.posts(self.appearance):
                post.draw(window, radiance, self.appearance.light)

    def _reach_down_mm(self, bar, middle_mm):
        """Return how far a bar reaches down from its middle: to the board, within a rod's length."""
        normal = self.T_rig_board[:, 2]
        height = abs((self.T_rig_board[:, 3] - middle_mm) @ normal)
        return float(np.clip(height / max(abs(bar.axis @ normal), 1e-6), *_BAR_DOWN_MM))

    def _marker(self, from_end) -> Print:
        """Return the print of a marker by its place from the end of the board's dictionary."""
        number = marker_count(self.board.dictionary) + from_end
        return marker_print(self.board.dictionary, number, self.appearance.ink)

    def draw_moving(
        self,
        window: Window,
        radiance: np.ndarray,
        hubs: Sequence[Box],
        whiskers: Sequence[Tube],
        occluder: Occluder | None = None,
    ) -> None:
        """Draw hubs and whiskers.

        A hub whose front, out of which its whiskers stand, faces the camera is behind all whiskers,
        another one before them. occluder: an object that may hide whiskers.
        """
        centre = window.camera.centre_mm
        behind = []
        before = []
        for hub in sorted(hubs, key=lambda hub: -np.linalg.norm(hub.origin_mm - centre)):
            (behind if hub.face(_HUB_FRONT).faces(centre) else before).append(hub)
        self._draw_hubs(window, radiance, behind)
        draw_tubes(whiskers, window, radiance, self.appearance.light, occluder)
        self._draw_hubs(window, radiance, before)

    def _draw_hubs(self, window, radiance, hubs):
        """Draw hubs in this order, with their markers."""
        for hub in hubs:
            marker = self._marker(_HUB_MARKER) if hub.is_marked else None
            hub.draw(window, radiance, self.appearance.light, marker, _HUB_TOP)

    def moving_px(
        self, camera: PinholeCamera, hubs: Sequence[Box], whiskers: Sequence[Tube]
    ) -> np.ndarray:
        """Return pixels (n, 2) between which all that moves lies."""
        px = [camera.project(hub.corners_mm()) for hub in hubs]
        px += [whisker.silhouette(camera).reshape(-1, 2) for whisker in whiskers]
        return np.concatenate(px)


def _block(bar: TouchedBar, middle_mm: np.ndarray) -> Box:
    """Return the block that holds a bar at its upper end, its front towards the whiskers."""
    front = unit(bar.axis * bar.axis[1] - _AWAY)
    axes = np.column_stack([np.cross(front, bar.axis), front, bar.axis])
    return Box(-_BLOCK_HALF, _BLOCK_HALF, axes, middle_mm + _BLOCK_UP_MM * bar.axis, 0.1)


def block_corners_mm(bar: TouchedBar, middle_mm: np.ndarray) -> np.ndarray:
    """Return the corners (24, 3) of the block that holds a bar whose middle is near a point (3,)."""
    return _block(bar, middle_mm).corners_mm()


def draw_floor_and_wall(window: Window, appearance: Appearance) -> np.ndarray:
    """Draw a grey floor that darkens away from the rig, and the wall behind it; return the radiance
    (rows, columns) of the window's samples, the same for all of a pixel."""
    point, floor_share = _floor_and_wall_points(window, appearance)
    x, y, z = np.moveaxis(point, -1, 0)
    from_rig_mm2 = (x - _LIT_X_MM) ** 2 + y**2
    brightness = 1 / (1 + from_rig_mm2 / _SHADE_MM2)
    grain = 1 + _GRAIN * np.sin(0.11 * x + 0.3) * np.sin(0.13 * y + 0.7 * z)
    light = appearance.light
    floor = appearance.floor * light.shade_flat([0, 0, 1.0])
    wall = appearance.wall * light.shade_flat([0, -1.0, 0])
    surface = floor * floor_share + wall * (1 - floor_share)
    radiance = (surface * brightness * grain).astype(np.float32)
    return radiance.repeat(window.fine, 0).repeat(window.fine, 1)


def _floor_and_wall_points(window, appearance):
    """Return the points (rows, columns, 3) of floor or wall that the window's pixels show, mm, and
    the share (rows, columns) of the floor."""
    x, y = replace(window, fine=1).rays()
    in_camera = np.stack([x, y, np.ones_like(x)], -1)
    rays = in_camera @ window.camera.rotation.astype(np.float32)
    centre = window.camera.centre_mm
    downwards = np.minimum(rays[..., 2], -1e-3)
    backwards = np.maximum(rays[..., 1], 1e-3)
    to_floor = (appearance.floor_z_mm - centre[2]) / downwards
    to_wall = (appearance.wall_y_mm - centre[1]) / backwards
    nearer = np.minimum(to_floor, to_wall)[..., None]
    floor_share = expit((to_wall - to_floor) / _CREASE_MM)
    return rays * nearer + centre, floor_share
