"""Where a centreline comes closest to the bar's axis: conventions of contact, slip and deflection in code."""

from dataclasses import dataclass, replace

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.geometry.rotation import cross
from vision.geometry.rounded import Rounded, nearer_by
from vision.geometry.silhouette import outline


@dataclass(frozen=True)
class BarAxis:
    """The bar's axis in the rig frame: a point (…, 3) in mm and a unit direction (…, 3) with positive z."""

    point_mm: np.ndarray
    direction: np.ndarray


Axis = BarAxis | Rounded


def upward(axis: Axis) -> Axis:
    """The same bar, by that of its two directions which has positive z: slope and slip are counted along it. Where a
    rounded object points is its own."""
    if isinstance(axis, Rounded) or axis.direction[2] >= 0:
        return axis
    return BarAxis(axis.point_mm, -axis.direction)


def bar_at(axis: Axis, points_mm: np.ndarray) -> BarAxis:
    """The bar that a contact at points (…, 3) sees: of a rounded object one for each, of a bar itself."""
    if not isinstance(axis, Rounded):
        return axis
    local = axis.near(points_mm[..., None, :])
    return BarAxis(local.foot_mm[..., 0, :], local.direction[..., 0, :])


def contact_frame_angles(direction: np.ndarray, touch_rad: float) -> tuple[float, float]:
    """Slope beta = atan2(a_y, a_z) and tilt psi = asin(a_x) of the bar in the frame turned by the touch angle."""
    c, s = np.cos(touch_rad), np.sin(touch_rad)
    a_x = c * direction[..., 0] + s * direction[..., 1]
    a_y = -s * direction[..., 0] + c * direction[..., 1]
    return np.arctan2(a_y, direction[..., 2]), np.arcsin(np.clip(a_x, -1.0, 1.0))


def _from_axis(points, axis: BarAxis) -> np.ndarray:
    """Vectors (…, k, 3) from the axis to points (…, k, 3), at right angles to the axis."""
    return _across(points - np.asarray(axis.point_mm)[..., None, :], axis)


def _across(vectors, axis: BarAxis) -> np.ndarray:
    """Vectors (…, k, 3) without their part along the axis."""
    a = np.asarray(axis.direction)[..., None, :]
    return vectors - np.sum(vectors * a, axis=-1, keepdims=True) * a


def drawn_as_bar(axis: Axis) -> BarAxis:
    """The bar that is seen where an object is touched."""
    return bar_at(axis, axis.spot_mm) if isinstance(axis, Rounded) else axis


# [rounds] Newton's steps, which double the digits: from 1.25 mm, or from nearly there, to
# rounding. Study: exactness.py.
_ROUNDS_FROM_NODE, _ROUNDS_FROM_NEAR = 4, 2
# [rounds] Newton's, more than on a bar: an object's axis turns with the contact, so that each
# divides what is left by ten and not by its square. Derived.
_MORE_ROUNDS = 3
# [mm] To either side of its point, where a bar may hide the wire: longer than whiskers reach
# across. Stated.
_OUTLINE_MM = 60.0


def closest_arc(curves: Curves, axis: Axis, near_mm: np.ndarray | None = None) -> np.ndarray:
    """Arc length (…) where each centreline is nearest to the axis, within the whisker's length.

    near_mm (…): where it was when curve and axis were nearly as they are; None looks along the whole of it.
    """
    if isinstance(axis, Rounded):
        return _closest_to_rounded(curves, axis, near_mm)
    arc = near_mm
    if near_mm is None:
        arc = curves.arc_mm[
            np.argmin(np.sum(_from_axis(curves.points_mm, axis) ** 2, axis=-1), axis=-1)
        ]
    for _ in range(_ROUNDS_FROM_NODE if near_mm is None else _ROUNDS_FROM_NEAR):
        point, tangent = curves.at(arc[..., None])
        away = _from_axis(point, axis)[..., 0, :]
        across = _across(tangent, axis)[..., 0, :]
        step = -np.sum(away * across, axis=-1) / np.maximum(np.sum(across**2, axis=-1), 1e-6)
        arc = np.clip(arc + step, 0.0, curves.arc_mm[-1])
    return arc


def _closest_to_rounded(curves: Curves, axis: Rounded, near_mm: np.ndarray | None) -> np.ndarray:
    arc, rounds = near_mm, _ROUNDS_FROM_NEAR
    if near_mm is None:
        arc, rounds = (
            curves.arc_mm[np.argmin(axis.outside_mm(curves.points_mm)[0], axis=-1)],
            _ROUNDS_FROM_NODE,
        )
    for _ in range(rounds + _MORE_ROUNDS):
        arc = np.clip(
            arc + nearer_by(axis, *curves.at(arc[..., None]))[..., 0], 0.0, curves.arc_mm[-1]
        )
    return arc


def clearance(
    curves: Curves, axis: Axis, near_mm: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Signed distance (…) from axis to centreline, contact arc (…), closest point (…, 3); near_mm: see `closest_arc`.

    Positive on the side that the whisker comes from (lower y), negative once the unbent whisker has passed. Of a
    rounded object always positive, and less what its middle is farther from its surface than its own radius.
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


# [1] X of a direction from which on its frame is taken from z: no bar's, but that of the plane of
# a ring. Stated.
_ALONG_X = 0.9


def axis_frame(direction: np.ndarray) -> np.ndarray:
    """Two unit vectors (2, 3) at right angles to a direction and to each other."""
    e1 = cross(
        direction, np.array([1.0, 0.0, 0.0] if abs(direction[0]) < _ALONG_X else [0.0, 0.0, 1.0])
    )
    e1 = e1 / np.linalg.norm(e1)
    return np.stack([e1, cross(direction, e1)])


def shifted_axis(axis: Axis, across: np.ndarray, vector: np.ndarray) -> Axis:
    """An axis (batch of vectors (…, ≥ 4) allowed) moved by two shifts in mm and two tilts across itself."""
    direction = axis.direction + vector[..., 2:4] @ across
    return replace(
        axis,
        point_mm=axis.point_mm + vector[..., 0:2] @ across,
        direction=direction / np.linalg.norm(direction, axis=-1, keepdims=True),
    )


def outline_of_bar(camera: Camera, axis: Axis, radius_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Middle (m, 2) and half-width (m,) of the bar in one camera, _OUTLINE_MM to either side of its point."""
    if isinstance(axis, Rounded):
        return _discs(camera, axis, radius_mm)
    place = np.linspace(-_OUTLINE_MM, _OUTLINE_MM, 121)
    points = axis.point_mm + place[:, None] * axis.direction
    return outline(camera, points, np.broadcast_to(axis.direction, points.shape), radius_mm)


def _discs(camera: Camera, axis: Rounded, radius_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Middle (m, 2) and radius (m,) of discs that cover a rounded object in a picture."""
    limb, _ = axis.limb(camera.centre_mm, radius_mm, _OUTLINE_MM, 121)
    edges = camera.project(limb.reshape(-1, 3)).reshape(2, -1, 2)
    if axis.form.shape == "sphere":
        edges = edges.reshape(-1, 1, 2)  # one disc for all of its limb
    middle = np.mean(edges, axis=0)
    return middle, np.max(np.linalg.norm(edges - middle, axis=-1), axis=0)
