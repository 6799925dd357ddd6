"""Where a centreline is nearest to the touched object's axis: conventions of contact and slip.

A bar is a straight axis; a rounded object acts on a contact like the bar that lies along its
surface there (`bar_at`). Contact is the arc length at which the wire's centreline is nearest to the
axis, found by Newton's method. Clearance is the signed distance there. Directions are unit vectors
with positive z, along which slope and slip are counted.
"""

from dataclasses import dataclass, replace

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.geometry.rotation import cross
from vision.geometry.rounded import Rounded, nearer_by
from vision.geometry.silhouette import outline

# [steps] Newton's, which double the digits: from 1.25 mm to rounding. Study: exactness.py.
_STEPS_FROM_NODE = 4
# [steps] Newton's from nearly there to rounding. Study: exactness.py.
_STEPS_FROM_NEAR = 2
# [steps] Newton's, more than on a bar: an object's axis turns with the contact, so that each
# divides what is left by ten and not by its square. Derived.
_MORE_STEPS = 3
# [1] Least squared sine between wire and axis that is divided by. Stated.
_LEAST_ACROSS = 1e-6
# [mm] To either side of its point, where a bar may hide the wire: longer than whiskers reach
# across. Stated.
_OUTLINE_MM = 60.0
# [points] Along an outline. Stated.
_OUTLINE_POINTS = 121
# [1] X of a direction from which on its frame is taken from z: no bar's, but that of the plane of
# a ring. Stated.
_ALONG_X = 0.9


@dataclass(frozen=True)
class BarAxis:
    """The bar's axis in the rig frame.

    point_mm (..., 3): a point of it. direction (..., 3): unit, with positive z.
    """

    point_mm: np.ndarray
    direction: np.ndarray


Axis = BarAxis | Rounded


def upward(axis: Axis) -> Axis:
    """Return the same bar with that of its two directions which has positive z.

    A rounded object is returned as it is.
    """
    if isinstance(axis, Rounded) or axis.direction[2] >= 0:
        return axis
    return BarAxis(axis.point_mm, -axis.direction)


def bar_at(axis: Axis, points_mm: np.ndarray) -> BarAxis:
    """Return the bar that contacts at points (..., 3) act on.

    Of a rounded object it is one for each point, of a bar itself.
    """
    if not isinstance(axis, Rounded):
        return axis
    local = axis.near(points_mm[..., None, :])
    return BarAxis(local.foot_mm[..., 0, :], local.direction[..., 0, :])


def drawn_as_bar(axis: Axis) -> BarAxis:
    """Return the bar that stands for the object where it is touched, to be drawn."""
    return bar_at(axis, axis.spot_mm) if isinstance(axis, Rounded) else axis


def contact_frame_angles(direction: np.ndarray, touch_rad: float) -> tuple[float, float]:
    """Return slope and tilt of a bar in the frame turned by the touch angle.

    With the direction a there, beta = atan2(a_y, a_z) and psi = asin(a_x).
    """
    cos = np.cos(touch_rad)
    sin = np.sin(touch_rad)
    a_x = cos * direction[..., 0] + sin * direction[..., 1]
    a_y = -sin * direction[..., 0] + cos * direction[..., 1]
    return np.arctan2(a_y, direction[..., 2]), np.arcsin(np.clip(a_x, -1.0, 1.0))


def closest_arc(curves: Curves, axis: Axis, near_mm: np.ndarray | None = None) -> np.ndarray:
    """Find the arc length (...) where each centreline is nearest to the axis.

    It lies within the whisker's length. near_mm (...): where it was when curve and axis were nearly
    as they are; None searches the whole curve.
    """
    if isinstance(axis, Rounded):
        return _closest_to_rounded(curves, axis, near_mm)
    arc = near_mm
    steps = _STEPS_FROM_NEAR
    if near_mm is None:
        distance2 = np.sum(_from_axis(curves.points_mm, axis) ** 2, axis=-1)
        arc = curves.arc_mm[np.argmin(distance2, axis=-1)]
        steps = _STEPS_FROM_NODE
    for _ in range(steps):
        point, tangent = curves.at(arc[..., None])
        away = _from_axis(point, axis)[..., 0, :]
        across = _across(tangent, axis)[..., 0, :]
        across2 = np.maximum(np.sum(across**2, axis=-1), _LEAST_ACROSS)
        step = -np.sum(away * across, axis=-1) / across2
        arc = np.clip(arc + step, 0.0, curves.arc_mm[-1])
    return arc


def _closest_to_rounded(curves: Curves, axis: Rounded, near_mm: np.ndarray | None) -> np.ndarray:
    """Find the arc length (...) where each centreline is nearest to a rounded object."""
    arc = near_mm
    steps = _STEPS_FROM_NEAR + _MORE_STEPS
    if near_mm is None:
        outside_mm, _, _ = axis.outside_mm(curves.points_mm)
        arc = curves.arc_mm[np.argmin(outside_mm, axis=-1)]
        steps = _STEPS_FROM_NODE + _MORE_STEPS
    for _ in range(steps):
        points, tangents = curves.at(arc[..., None])
        step = nearer_by(axis, points, tangents)[..., 0]
        arc = np.clip(arc + step, 0.0, curves.arc_mm[-1])
    return arc


def clearance(
    curves: Curves, axis: Axis, near_mm: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the signed distance (...) from axis to centreline where they are nearest.

    Returns with it the contact arc (...) and the closest point (..., 3). near_mm: see
    `closest_arc`. The distance is positive on the side that the whisker comes from (lower y),
    negative once the unbent whisker has passed. Of a rounded object it is always positive, and less
    by what its middle is farther from its surface than its own radius.
    """
    arc = closest_arc(curves, axis, near_mm)
    point, tangent = curves.at(arc[..., None])
    if isinstance(axis, Rounded):
        return axis.outside_mm(point)[0][..., 0], arc, point[..., 0, :]
    away = _from_axis(point, axis)[..., 0, :]
    normal = cross(np.asarray(axis.direction), tangent[..., 0, :])
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    side = np.where(normal[..., 1] > 0, -1.0, 1.0)
    return np.sum(away * normal, axis=-1) * side, arc, point[..., 0, :]


def _from_axis(points: np.ndarray, axis: BarAxis) -> np.ndarray:
    """Return the vectors (..., k, 3) that point from the axis straight to points (..., k, 3)."""
    return _across(points - np.asarray(axis.point_mm)[..., None, :], axis)


def _across(vectors: np.ndarray, axis: BarAxis) -> np.ndarray:
    """Return vectors (..., k, 3) without their part along the axis."""
    a = np.asarray(axis.direction)[..., None, :]
    return vectors - np.sum(vectors * a, axis=-1, keepdims=True) * a


def axis_frame(direction: np.ndarray) -> np.ndarray:
    """Return two unit vectors (2, 3) at right angles to a direction and to each other."""
    is_along_x = abs(direction[0]) >= _ALONG_X
    other = np.array([0.0, 0.0, 1.0] if is_along_x else [1.0, 0.0, 0.0])
    e1 = cross(direction, other)
    e1 = e1 / np.linalg.norm(e1)
    return np.stack([e1, cross(direction, e1)])


def shifted_axis(axis: Axis, across: np.ndarray, vector: np.ndarray) -> Axis:
    """Return the axis moved by two shifts in mm and two tilts across itself.

    vector (..., 4 or more): more than one give a batch. across (2, 3): see `axis_frame`.
    """
    direction = axis.direction + vector[..., 2:4] @ across
    return replace(
        axis,
        point_mm=axis.point_mm + vector[..., 0:2] @ across,
        direction=direction / np.linalg.norm(direction, axis=-1, keepdims=True),
    )


def outline_of_bar(camera: Camera, axis: Axis, radius_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the middle (m, 2) and half-width (m,) px of the object in one camera."""
    if isinstance(axis, Rounded):
        return _covering_discs(camera, axis, radius_mm)
    place = np.linspace(-_OUTLINE_MM, _OUTLINE_MM, _OUTLINE_POINTS)
    points = axis.point_mm + place[:, None] * axis.direction
    return outline(camera, points, np.broadcast_to(axis.direction, points.shape), radius_mm)


def _covering_discs(
    camera: Camera, axis: Rounded, radius_mm: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the middle (m, 2) and radius (m,) px of discs that cover a rounded object."""
    limb, _ = axis.limb(camera.centre_mm, radius_mm, _OUTLINE_MM, _OUTLINE_POINTS)
    edges = camera.project(limb.reshape(-1, 3)).reshape(2, -1, 2)
    if axis.form.shape == "sphere":
        edges = edges.reshape(-1, 1, 2)  # one disc for all of its silhouette
    middle = np.mean(edges, axis=0)
    return middle, np.max(np.linalg.norm(edges - middle, axis=-1), axis=0)
