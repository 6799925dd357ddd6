"""The bar as one camera finds it: a line across the whisker, and its distance from its width.

The two planes through the camera's centre that graze a bar intersect along its direction, and the
angle between them is that of the bar's diameter at its distance. So shift and tilt of both edges in
the picture, four numbers, determine the four of an axis in space. The search assumes at first that
the bar is at right angles to the line of sight; its edges then correct that. Cameras whose planes
through the bar coincide know no more than one camera does.
"""

from collections.abc import Mapping
from functools import partial

import numpy as np

from vision.geometry.camera import Camera, Cameras
from vision.geometry.centreline import rotation_z
from vision.geometry.contact import BarAxis
from vision.geometry.refusals import Refused
from vision.geometry.rotation import turned_about, unit
from vision.touched.axis import sight_planes
from vision.touched.edge_map import EdgeMap
from vision.touched.edges import measure_edges
from vision.touched.find import search_bars
from vision.touched.object_view import ObjectView
from vision.touched.search_scene import SearchScene
from vision.wire.points import LinePoints

# [radii] Step of the grid along the whisker. Derived.
_X_STEP = 0.35
# [rad] Turns of the grid about the line of sight. Study: coverage.py alone.
_TURN_RAD = np.radians(np.arange(0.0, 180.0, 5.0))
# [1] Distances of the grid, beyond the whisker, as a share. Study: coverage.py alone.
_FARTHER = np.array([-0.05, 0.0, 0.05])
# [1] Of the first distance: nearer than this, what passed for edges is none. Study: coverage.py
# alone.
_NEAREST = 0.7
# [1] Of the first distance: farther than this, what passed for edges is none. Study: coverage.py
# alone.
_FARTHEST = 1.4
# [rad] Planes through the bar nearer to each other than this do not determine its slope: at 1°
# its sigma is some 1°, by views.py. Study: views.py.
_SAME_PLANE_RAD = np.radians(1.0)


def find_bars_alone(edges: EdgeMap, scene: SearchScene) -> list[BarAxis]:
    """Find axes of what may be the bar in one camera, the best first.

    All are at right angles to the line of sight. The whisker is taken as at its mean motor angle.
    """
    motor_rad = float(np.mean(scene.motor_rad))
    x_mm = scene.contact_places_mm(_X_STEP * scene.radius_mm)
    axes_of = partial(_axes_across_sight, camera=edges.camera, motor_rad=motor_rad)
    values = [x_mm, _TURN_RAD, _FARTHER]
    return search_bars([edges], values, axes_of, scene)


def _axes_across_sight(hypotheses: np.ndarray, camera: Camera, motor_rad: float) -> BarAxis:
    """Return the axes (n, 3) of hypotheses (n, 3) about a bar across the line of sight.

    The numbers are x mm on the straight whisker, a turn about the line of sight, and a distance.
    The distance is the share by which a bar is farther away than the whisker.
    """
    x_mm, turn, farther = hypotheses.T[..., None]
    on_whisker = x_mm * rotation_z(motor_rad)[:, 0]
    sight = on_whisker - camera.centre_mm
    point = camera.centre_mm + (1.0 + farther) * sight
    ahead = unit(sight)
    right = unit(np.cross(ahead, [0.0, 0.0, 1.0]))
    return BarAxis(point, turned_about(-ahead, right, turn))


def see_bar_alone(first: BarAxis, view: ObjectView) -> BarAxis:
    """Compute the bar's axis from its edges in one camera, from a coarse axis.

    Raises Refused where its edges are not seen.
    """
    camera = view.camera
    axis = first
    for coarse in (True, False):
        edges = measure_edges(view, axis, coarse=coarse)
        if edges is not None:
            axis = axis_from_edges(edges, camera, view.radius_mm)
        ratio = _distance_mm(axis, camera) / _distance_mm(first, camera)
        if not _NEAREST < ratio < _FARTHEST or (coarse and edges is None):
            raise Refused(
                f"camera {camera.name} alone does not tell how far away the bar is: "
                "its edges are not seen",
                code="bar_distance_unseen",
            )
    return axis


def _distance_mm(axis: BarAxis, camera: Camera) -> float:
    """Return the distance from a camera's centre to the axis's point, mm."""
    return float(np.linalg.norm(axis.point_mm - camera.centre_mm))


def seen_from_one_side(cameras: Cameras, axis: BarAxis) -> bool:
    """Return whether all cameras' planes through the bar coincide to a degree.

    Then only its width says how far away it is.
    """
    return widest_angle_rad(cameras, axis) < _SAME_PLANE_RAD


def widest_angle_rad(cameras: Cameras, axis: BarAxis) -> float:
    """Return the widest angle, rad, between the planes that two cameras span with the bar."""
    normals = sight_planes(cameras, axis)
    least_cosine = np.min(np.abs(normals @ normals.T))
    return float(np.arccos(min(least_cosine, 1.0)))


def axis_from_edges(edges: Mapping[int, LinePoints], camera: Camera, radius_mm: float) -> BarAxis:
    """Return the axis whose two grazing planes pass through the edges.

    edges: two points each, by side (-1 and 1). Its point is where the mean ray through the edge
    points meets it.
    """
    rays = np.array([camera.rays(edges[side].px) for side in (-1, 1)])  # (sides, 2, 3)
    one, other = unit(np.cross(rays[:, 0], rays[:, 1]))  # normals of the grazing planes
    direction = unit(np.cross(one, other))
    half_angle_rad = 0.5 * np.arccos(np.clip(one @ other, -1.0, 1.0))
    distance_mm = radius_mm / np.sin(half_angle_rad)
    middle = np.sum(rays, axis=(0, 1))
    across = middle - (middle @ direction) * direction
    point_mm = camera.centre_mm + distance_mm / np.linalg.norm(across) * middle
    return BarAxis(point_mm, direction).upward()
