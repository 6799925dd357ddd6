"""Where a centreline comes closest to the bar's axis: conventions of contact, slip and deflection in code."""

from dataclasses import dataclass

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.geometry.rotation import cross
from vision.geometry.silhouette import outline


@dataclass(frozen=True)
class BarAxis:
    """The bar's axis in the rig frame: a point (…, 3) in mm and a unit direction (…, 3) with positive z."""

    point_mm: np.ndarray
    direction: np.ndarray


def upward(axis: BarAxis) -> BarAxis:
    """The same bar, by that of its two directions which has positive z: slope and slip are counted along it."""
    return axis if axis.direction[2] >= 0 else BarAxis(axis.point_mm, -axis.direction)


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


_ROUNDS_FROM_NODE, _ROUNDS_FROM_NEAR = 4, 2
_OUTLINE_MM = 60.0  # to either side of its point, where a bar may hide the wire


def closest_arc(curves: Curves, axis: BarAxis, near_mm: np.ndarray | None = None) -> np.ndarray:
    """Arc length (…) where each centreline is nearest to the axis, within the whisker's length.

    near_mm (…): where it was when curve and axis were nearly as they are; None looks along the whole of it.
    """
    arc = near_mm
    if near_mm is None:
        arc = curves.arc_mm[np.argmin(np.sum(_from_axis(curves.points_mm, axis) ** 2, axis=-1), axis=-1)]
    for _ in range(_ROUNDS_FROM_NODE if near_mm is None else _ROUNDS_FROM_NEAR):
        point, tangent = curves.at(arc[..., None])
        away = _from_axis(point, axis)[..., 0, :]
        across = _across(tangent, axis)[..., 0, :]
        step = -np.sum(away * across, axis=-1) / np.maximum(np.sum(across**2, axis=-1), 1e-6)
        arc = np.clip(arc + step, 0.0, curves.arc_mm[-1])
    return arc


def clearance(
    curves: Curves, axis: BarAxis, near_mm: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Signed distance (…) from axis to centreline, contact arc (…), closest point (…, 3); near_mm: see `closest_arc`.

    Positive on the side that the whisker comes from (lower y), negative once the unbent whisker has passed.
    """
    arc = closest_arc(curves, axis, near_mm)
    point, tangent = curves.at(arc[..., None])
    away = _from_axis(point, axis)[..., 0, :]
    normal = cross(np.asarray(axis.direction), tangent[..., 0, :])
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    side = np.where(normal[..., 1] > 0, -1.0, 1.0)
    return np.sum(away * normal, axis=-1) * side, arc, point[..., 0, :]


def axis_frame(direction: np.ndarray) -> np.ndarray:
    """Two unit vectors (2, 3) at right angles to a direction and to each other."""
    e1 = cross(direction, np.array([1.0, 0.0, 0.0]))
    e1 = e1 / np.linalg.norm(e1)
    return np.stack([e1, cross(direction, e1)])


def shifted_axis(axis: BarAxis, across: np.ndarray, vector: np.ndarray) -> BarAxis:
    """An axis (batch of vectors (…, ≥ 4) allowed) moved by two shifts in mm and two tilts across itself."""
    direction = axis.direction + vector[..., 2:4] @ across
    return BarAxis(axis.point_mm + vector[..., 0:2] @ across,
                   direction / np.linalg.norm(direction, axis=-1, keepdims=True))


def outline_of_bar(camera: Camera, axis: BarAxis, radius_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Middle (m, 2) and half-width (m,) of the bar in one camera, _OUTLINE_MM to either side of its point."""
    place = np.linspace(-_OUTLINE_MM, _OUTLINE_MM, 121)
    points = axis.point_mm + place[:, None] * axis.direction
    return outline(camera, points, np.broadcast_to(axis.direction, points.shape), radius_mm)
