"""A bar bent to a circle, a sphere and a cone, and the registry of all objects by name."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from bench.rig.bar import TouchedBar
from bench.rig.linear import across, cross, cross_matrix
from bench.rig.protocol_tables import TrialTable
from bench.rig.touched_object import LocalBar, TouchedObject

_UP = np.array([0.0, 0.0, 1.0])  # (3,): axes have a positive z
_BEHIND = np.array([0.0, 1.0, 0.0])  # (3,): away from whiskers and cameras


@dataclass(frozen=True)
class TouchedRing(TouchedObject):
    """A round bar whose axis is a circle about `point_mm`; `axis` is the normal of its plane."""

    shape = "ring"

    ring_radius_mm: float = 0.0

    @classmethod
    def from_bar(cls, bar: TouchedBar, touched_mm: np.ndarray, ring_radius_mm: float) -> Self:
        """Return a straight bar bent away from the whisker that touches it at a point (3,)."""
        foot, normal = _foot_and_normal(bar, touched_mm)
        return cls(
            foot - ring_radius_mm * normal,
            cross(bar.axis, normal),
            bar.radius_mm,
            bar.stiffness_N_mm,
            ring_radius_mm=ring_radius_mm,
        )

    @classmethod
    def from_trial(cls, bar: TouchedBar, touched_mm: np.ndarray, table: TrialTable) -> Self:
        """Make the ring of a trial, which curves away from the whisker."""
        return cls.from_bar(bar, touched_mm, 0.5 * table.ring_diameter_mm)

    def size_keys(self) -> dict:
        """Return the diameter of the circle, mm."""
        return {"ring_diameter_mm": 2 * self.ring_radius_mm}

    def support_mm(self) -> np.ndarray:
        """Return the circle's point (3,) farthest from the base along the rig's y."""
        in_plane = _BEHIND - self.axis[1] * self.axis
        return self.point_mm + self.ring_radius_mm * in_plane / np.linalg.norm(in_plane)

    def foot_mm(self, point_mm: np.ndarray) -> np.ndarray:
        """Return the circle's points nearest to points (..., 3)."""
        outward = (point_mm - self.point_mm) @ across(self.axis)  # (..., 3), in the circle's plane
        distance = np.linalg.norm(outward, axis=-1, keepdims=True)
        return self.point_mm + self.ring_radius_mm * outward / distance

    def local_bar(self, point_mm: np.ndarray) -> LocalBar:
        """Return the bar that the circle's tangent is near a point (3,)."""
        from_centre = point_mm - self.point_mm
        projection = across(self.axis)
        in_plane = projection @ from_centre
        distance = np.linalg.norm(in_plane)
        outward = in_plane / distance
        outward_by = (projection - np.outer(outward, outward)) / distance
        tangent = cross(self.axis, outward)
        sign = _upward_sign(tangent)
        return LocalBar(
            from_centre - self.ring_radius_mm * outward,
            np.eye(3) - self.ring_radius_mm * outward_by,
            sign * tangent,
            sign * cross_matrix(self.axis) @ outward_by,
        )


@dataclass(frozen=True)
class TouchedSphere(TouchedObject):
    """A sphere about `point_mm`; a contact meets an axis in the surface, as upright as can be."""

    shape = "sphere"

    @classmethod
    def from_trial(cls, bar: TouchedBar, touched_mm: np.ndarray, table: TrialTable) -> Self:
        """Make the sphere of the bar's radius about the bar's point."""
        return cls(bar.point_mm, bar.axis, bar.radius_mm, bar.stiffness_N_mm)

    def place_keys(self) -> dict:
        """Return the centre; a sphere has no axis."""
        return {"point_mm": self.point_mm.tolist()}

    def foot_mm(self, point_mm: np.ndarray) -> np.ndarray:
        """Return the centre for each of points (..., 3)."""
        return np.broadcast_to(self.point_mm, np.shape(point_mm))

    def local_bar(self, point_mm: np.ndarray) -> LocalBar:
        """Return the bar through the centre with the most upright tangent of the surface."""
        offset_mm = point_mm - self.point_mm
        distance = np.linalg.norm(offset_mm)
        normal = offset_mm / distance
        normal_by = across(normal) / distance
        upright = _UP - normal[2] * normal
        length = np.linalg.norm(upright)
        axis = upright / length
        upright_by = -np.outer(normal, normal_by[2]) - normal[2] * normal_by
        return LocalBar(offset_mm, np.eye(3), axis, across(axis) @ upright_by / length)


@dataclass(frozen=True)
class TouchedCone(TouchedObject):
    """A round cone: all points at `radius_mm` from the thinner cone whose tip is `point_mm`, up to
    its own tip.

    `axis` points to the tip; a contact meets the straight line of the surface through it.
    """

    shape = "cone"

    half_angle_rad: float = 0.0

    @classmethod
    def from_bar(cls, bar: TouchedBar, touched_mm: np.ndarray, half_angle_rad: float) -> Self:
        """Make the cone, tip above, that a whisker touches at the point (3,) and slope at which it
        touches a bar; there it is as curved across as the bar."""
        foot, normal = _foot_and_normal(bar, touched_mm)
        axis = math.cos(half_angle_rad) * bar.axis + math.sin(half_angle_rad) * normal
        return cls(foot, axis, bar.radius_mm, bar.stiffness_N_mm, half_angle_rad=half_angle_rad)

    @classmethod
    def from_trial(cls, bar: TouchedBar, touched_mm: np.ndarray, table: TrialTable) -> Self:
        """Make the cone of a trial."""
        return cls.from_bar(bar, touched_mm, math.radians(table.cone_half_angle_deg))

    @property
    def tip_mm(self) -> np.ndarray:
        """Return the point (3,) where the cone ends."""
        return self.point_mm + self.radius_mm / math.sin(self.half_angle_rad) * self.axis

    def place_keys(self) -> dict:
        """Return the tip and the axis."""
        return {"point_mm": self.tip_mm.tolist(), "axis": self.axis.tolist()}

    def size_keys(self) -> dict:
        """Return the angle between axis and surface, deg."""
        return {"half_angle_deg": math.degrees(self.half_angle_rad)}

    def outside_mm(self, point_mm: np.ndarray) -> np.ndarray:
        """Return how far points (..., 3) are outside of the surface; above the tip, how far from
        the tip."""
        _, distance, height = self._from_centreline(point_mm)
        outside = height - self.radius_mm
        is_above = distance < math.cos(self.half_angle_rad) * outside
        return np.where(is_above, np.linalg.norm(point_mm - self.tip_mm, axis=-1), outside)

    def foot_mm(self, point_mm: np.ndarray) -> np.ndarray:
        """Return the thin cone's points nearest to points (..., 3)."""
        radial, distance, height = self._from_centreline(point_mm)
        normal = self._normal(radial / distance[..., None])
        return point_mm - height[..., None] * normal

    def local_bar(self, point_mm: np.ndarray) -> LocalBar:
        """Return the bar about the thin cone's straight line nearest to a point (3,).

        Raises ArithmeticError above the tip.
        """
        radial, distance, height = self._from_centreline(point_mm)
        sin = math.sin(self.half_angle_rad)
        cos = math.cos(self.half_angle_rad)
        if distance <= cos * (height - self.radius_mm):
            raise ArithmeticError("the contact is past the cone's tip")
        outward = radial / distance
        normal = self._normal(outward)
        outward_by = (across(self.axis) - np.outer(outward, outward)) / distance
        line = cos * self.axis - sin * outward
        sign = _upward_sign(line)
        offset_by = np.outer(normal, normal) + height * cos * outward_by
        return LocalBar(height * normal, offset_by, sign * line, -sign * sin * outward_by)

    def _from_centreline(self, point_mm):
        """Return, for points (..., 3), the way (..., 3) there from the centreline, its length, and
        the distance from the thin cone, negative within, each (...)."""
        from_tip = point_mm - self.point_mm
        along = from_tip @ self.axis
        radial = from_tip - np.multiply.outer(along, self.axis)
        distance = np.linalg.norm(radial, axis=-1)
        height = math.cos(self.half_angle_rad) * distance + math.sin(self.half_angle_rad) * along
        return radial, distance, height

    def _normal(self, outward):
        """Return the surface's normals (..., 3) where directions from the centreline are given."""
        return math.cos(self.half_angle_rad) * outward + math.sin(self.half_angle_rad) * self.axis


OBJECTS: dict[str, type[TouchedObject]] = {
    kind.shape: kind for kind in (TouchedBar, TouchedRing, TouchedSphere, TouchedCone)
}


def _foot_and_normal(bar, touched_mm):
    """Return the axis' point nearest to a point (3,) and the unit direction from there to it."""
    foot = bar.foot_mm(touched_mm)
    return foot, (touched_mm - foot) / np.linalg.norm(touched_mm - foot)


def _upward_sign(direction):
    """Return 1 for a direction whose z is not negative, else −1."""
    return 1.0 if direction[2] >= 0 else -1.0
