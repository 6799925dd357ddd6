"""Where a wire is nearest to the touched object: conventions of contact and slip.

A bar is a straight axis; any other object acts on a contact like the bar that lies along its
surface there (`Axis.bar_at`). Contact is the arc length at which the wire's surface is nearest to
the axis, found by Newton's method: of a wire that tapers the centreline's distance there falls along
the wire as its radius does. Clearance is the centreline's signed distance there. Directions are unit
vectors with positive z, along which slope and slip are counted.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.geometry.polyline import normals
from vision.geometry.refusals import Refused
from vision.geometry.rods import Wire
from vision.geometry.rotation import across, cross, unit
from vision.geometry.silhouette import outline
from vision.geometry.touched import Axis

# [steps] Newton's more than from nearly there: from 1.25 mm to rounding. Study: exactness.py.
_MORE_FROM_NODE = 2
# [1] Least squared sine between wire and axis that is divided by. Stated.
_LEAST_ACROSS = 1e-6
# [mm] To either side of its point, where a bar may hide the wire: longer than whiskers reach
# across. Stated.
OUTLINE_MM = 60.0
# [points] Along an outline. Stated.
OUTLINE_POINTS = 121
# [stations] Fewer have no direction. Derived.
_FEWEST_STATIONS = 2
# [1] X of a direction from which on its frame is taken from z: no bar's, but that of the plane of
# a ring. Stated.
_ALONG_X = 0.9


@dataclass(frozen=True)
class BarAxis(Axis):
    """The axis of a straight bar in the rig frame.

    point_mm (..., 3): a point of it. direction (..., 3): unit, with positive z.
    """

    point_mm: np.ndarray
    direction: np.ndarray

    # [steps] Newton's from nearly there to rounding, which double the digits. Study: exactness.py.
    newton_steps: ClassVar[int] = 2

    def upward(self) -> "BarAxis":
        """Return the same bar with that of its two directions which has positive z."""
        return self if self.direction[2] >= 0 else BarAxis(self.point_mm, -self.direction)

    def angle_to(self, other: "BarAxis") -> float:
        """Return the angle between two bars' directions, rad, at most a right one."""
        return float(np.arccos(min(abs(float(self.direction @ other.direction)), 1.0)))

    def bar_at(self, points_mm: np.ndarray) -> "BarAxis":
        """Return the bar itself, on which all contacts act."""
        return self

    def as_bar(self) -> "BarAxis":
        """Return the bar itself."""
        return self

    def nearest(self, points_mm: np.ndarray) -> np.ndarray:
        """Return which (...) of points (..., k, 3) is nearest to the axis."""
        return np.argmin(np.sum(self._from_axis(points_mm) ** 2, axis=-1), axis=-1)

    def newton_step(
        self, points_mm: np.ndarray, tangents: np.ndarray, growth: np.ndarray | float = 0.0
    ) -> np.ndarray:
        """Return Newton's steps (..., k), mm, along curves to where their surface is nearest."""
        across = self._across(tangents)
        across2 = np.maximum(np.sum(across**2, axis=-1), _LEAST_ACROSS)
        away = self._from_axis(points_mm)
        grown = growth * np.linalg.norm(away, axis=-1)
        return (grown - np.sum(away * across, axis=-1)) / across2

    def distance_mm(self, points_mm: np.ndarray, tangents: np.ndarray) -> np.ndarray:
        """Return the signed distances (...) of curves at their nearest points (..., 3).

        They are positive on the side that the whisker comes from (lower y), negative once the
        unbent whisker has passed.
        """
        normal = unit(cross(np.asarray(self.direction), tangents))
        side = np.where(normal[..., 1] > 0, -1.0, 1.0)
        away = self._from_axis(points_mm[..., None, :])[..., 0, :]
        return np.sum(away * normal, axis=-1) * side

    def covering_discs(self, camera: Camera, radius_mm: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the middle (m, 2) of the bar's outline and its half-width (m,) px."""
        return self.outline(camera, radius_mm, OUTLINE_MM, OUTLINE_POINTS)

    def edges_px(
        self, camera: Camera, radius_mm: float, reach_mm: float, stations: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return both edges (stations, 2) px of the bar, reach_mm to either side of its point."""
        middle, half_px = self.outline(camera, radius_mm, reach_mm, stations)
        offset = half_px[:, None] * normals(middle)
        return middle - offset, middle + offset

    def outline(
        self, camera: Camera, radius_mm: float, reach_mm: float, stations: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return middle (stations, 2) and half-width (stations,) px of the outline near its point."""
        place = np.linspace(-reach_mm, reach_mm, stations)
        return outline(camera, self.points_at(place), self.direction, radius_mm)

    def outline_before(
        self, camera: Camera, radius_mm: float, reach_mm: float, stations: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return place (n,) mm, middle (n, 2) and half-width (n,) px of the outline, where the bar lies before
        the camera and is no wider than its picture.

        Raises Refused where that has no direction: fewer than two stations do.
        """
        place_mm = np.linspace(-reach_mm, reach_mm, stations)
        middle, half_px = self.outline(camera, radius_mm, reach_mm, stations)
        # Inside the bar the half-width is 0, behind the camera NaN.
        is_before = (half_px > 0.0) & (half_px < max(camera.size_px))
        if np.sum(is_before) < _FEWEST_STATIONS:
            raise Refused(
                f"camera {camera.name} would have the bar behind or about it: check T_camera_rig",
                code="bar_behind_camera",
            )
        return place_mm[is_before], middle[is_before], half_px[is_before]

    def _from_axis(self, points: np.ndarray) -> np.ndarray:
        """Return the vectors (..., k, 3) straight from the axis to points (..., k, 3)."""
        return self._across(points - np.asarray(self.point_mm)[..., None, :])

    def _across(self, vectors: np.ndarray) -> np.ndarray:
        """Return vectors (..., k, 3) without their part along the axis."""
        a = np.asarray(self.direction)[..., None, :]
        return across(vectors, a)


def contact_frame_angles(direction: np.ndarray, touch_rad: float) -> tuple[float, float]:
    """Return slope and tilt of a bar in the frame turned by the touch angle.

    With the direction a there, beta = atan2(a_y, a_z) and psi = asin(a_x).
    """
    cos = np.cos(touch_rad)
    sin = np.sin(touch_rad)
    x, y, a_z = np.moveaxis(direction, -1, 0)
    a_x = cos * x + sin * y
    a_y = cos * y - sin * x
    return np.arctan2(a_y, a_z), np.arcsin(np.clip(a_x, -1.0, 1.0))


def directions_at_slope(beta_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the directions (..., 3) along bars without tilt, and from a whisker along x to them, by their
    slopes (...).
    """
    sin = np.sin(beta_rad)
    cos = np.cos(beta_rad)
    zero = np.zeros_like(sin)
    return np.stack([zero, sin, cos], axis=-1), np.stack([zero, cos, -sin], axis=-1)


def closest_arc(
    curves: Curves, axis: Axis, wire: Wire, near_mm: np.ndarray | None = None
) -> np.ndarray:
    """Find the arc length (...) where the wire about each centreline is nearest to the object.

    It lies within the whisker's length. near_mm (...): where it was when curve and object were
    nearly as they are; None searches the whole curve.
    """
    arc = near_mm
    steps = axis.newton_steps
    if near_mm is None:
        arc = curves.arc_mm[axis.nearest(curves.points_mm)]
        steps += _MORE_FROM_NODE
    for _ in range(steps):
        points, tangents = curves.at(arc[..., None])
        growth = wire.radius_by_arc(arc[..., None])
        step = axis.newton_step(points, tangents, growth)[..., 0]
        arc = np.clip(arc + step, 0.0, curves.arc_mm[-1])
    return arc


def clearance(
    curves: Curves, axis: Axis, wire: Wire, near_mm: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the distance (...) from axis to centreline where the wire is nearest.

    Returns with it the contact arc (...) and the centreline's point (..., 3) there. near_mm: see
    `closest_arc`. The distance from a bar has a sign; that from another object is positive, and
    less by what its middle is farther from its surface than its own radius.
    """
    arc = closest_arc(curves, axis, wire, near_mm)
    points, tangents = curves.at(arc[..., None])
    point = points[..., 0, :]
    return axis.distance_mm(point, tangents[..., 0, :]), arc, point


def axis_frame(direction: np.ndarray) -> np.ndarray:
    """Return two unit vectors (2, 3) at right angles to a direction and to each other."""
    is_along_x = abs(direction[0]) >= _ALONG_X
    other = np.array([0.0, 0.0, 1.0] if is_along_x else [1.0, 0.0, 0.0])
    e1 = unit(cross(direction, other))
    return np.stack([e1, cross(direction, e1)])
