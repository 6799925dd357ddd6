"""The bar as one camera alone finds it: a line across the whisker, and its depth from how wide it looks.

The two planes of sight that graze a bar meet in its direction, and the angle between them is that of its diameter at
its distance: four numbers in the picture, shift and tilt of each edge, are the four of an axis in space.
"""

from collections.abc import Mapping

import numpy as np

from vision.geometry.camera import Camera, Cameras
from vision.geometry.centreline import resting_lines, rotation_z
from vision.geometry.contact import BarAxis, upward
from vision.geometry.refusals import Refused
from vision.geometry.rods import Rods, Wire
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.view import View
from vision.touched.edges import measure_edges
from vision.touched.find import Clear, likely
from vision.wire.points import LinePoints

# [radii] Of the grid along the whisker. Derived.
_X_STEP = 0.35
# [rad, 1] Of the grid round the sight, and of the depth. Study: coverage.py alone.
_TURN_RAD, _FURTHER = np.radians(np.arange(0.0, 180.0, 5.0)), np.array([-0.05, 0.0, 0.05])
# [1] Of the distance at first: beyond, what passed for edges is none. Study: coverage.py alone.
_NEAREST, _FARTHEST = 0.7, 1.4
# [rad] Planes through the bar nearer than this tell no slope: at 1° its sigma is some 1°, by
# views.py. Study: views.py.
_SAME_PLANE_RAD = np.radians(1.0)


def find_bars_alone(seen: Clear, rods: Rods, motor_rad: float) -> list[BarAxis]:
    """Coarse axes of what may be the bar in one camera, taken to be at right angles to the sight: its edges tell its
    tilt. motor_rad: about where the whisker touches."""
    x = np.arange(10.0, rods.wire.length_mm, _X_STEP * rods.bar.radius_mm)
    return likely(
        [seen],
        (x, _TURN_RAD, _FURTHER),
        lambda each: _axis(each, seen.camera, motor_rad),
        rods.bar.radius_mm,
    )


def _axis(hypotheses, camera: Camera, motor_rad: float) -> BarAxis:
    """Axes (n, 3) through the straight whisker at x mm, turned round the sight, further away by a share."""
    x, turn, further = hypotheses.T[..., None]
    on_whisker = x * rotation_z(motor_rad)[:, 0]
    sight = on_whisker - camera.centre_mm
    point = camera.centre_mm + (1.0 + further) * sight
    ahead = sight / np.linalg.norm(sight, axis=1, keepdims=True)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    return BarAxis(point, np.cos(turn) * right + np.sin(turn) * np.cross(right, ahead))


def see_bar_alone(
    first: BarAxis,
    view: View,
    wire: Wire,
    radius_mm: float,
    motor_rad: np.ndarray,
    settings: VisionSettings,
) -> BarAxis:
    """The bar's axis from one camera, from a coarse one, before any wire is known. motor_rad (n,): of all frames.

    Raises Refused where its edges are not seen.
    """
    camera, axis = view.camera, first
    straight = resting_lines(camera, wire, np.unique(motor_rad))
    for coarse in (True, False):
        edges = measure_edges(view, axis, radius_mm, straight, settings, coarse=coarse)
        found = axis if edges is None else axis_from_edges(edges, camera, radius_mm)
        if not _NEAREST < _distance_mm(found, camera) / _distance_mm(first, camera) < _FARTHEST or (
            coarse and edges is None
        ):
            raise Refused(
                f"camera {camera.name} alone does not tell how far away the bar is: its edges are not seen",
                code="bar_distance_unseen",
            )
        axis = found
    return axis


def _distance_mm(axis: BarAxis, camera: Camera) -> float:
    return float(np.linalg.norm(axis.point_mm - camera.centre_mm))


def seen_from_one_side(cameras: Cameras, axis: BarAxis) -> bool:
    """Whether all cameras' planes through the bar are the same to a degree: only its width tells how far away it is."""
    return widest_angle_rad(cameras, axis) < _SAME_PLANE_RAD


def widest_angle_rad(cameras: Cameras, axis: BarAxis) -> float:
    """Between the planes through the bar of the two cameras that see it from the most different sides."""
    across = np.array(
        [np.cross(axis.direction, axis.point_mm - camera.centre_mm) for camera in cameras]
    )
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return float(np.arccos(min(np.min(np.abs(across @ across.T)), 1.0)))


def axis_from_edges(edges: Mapping[int, LinePoints], camera: Camera, radius_mm: float) -> BarAxis:
    """The axis whose two grazing planes pass through the edges; its point is opposite the middle of what is seen."""
    planes = np.array([np.cross(*camera.rays(edges[side].px)) for side in (-1, 1)])
    one, other = planes / np.linalg.norm(planes, axis=1, keepdims=True)
    direction = np.cross(one, other)
    direction /= np.linalg.norm(direction)
    distance_mm = radius_mm / np.sin(0.5 * np.arccos(np.clip(one @ other, -1.0, 1.0)))
    middle = np.sum([camera.rays(points.px) for points in edges.values()], axis=(0, 1))
    away = middle - (middle @ direction) * direction
    return upward(
        BarAxis(camera.centre_mm + distance_mm / np.linalg.norm(away) * middle, direction)
    )
