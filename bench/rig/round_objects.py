"""Objects that are no straight bar: a bar bent to a circle, a sphere, and a cone. To a contact each is a bar whose axis
turns as the contact moves on it.
"""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from bench.rig.bar import Bar, cross_matrix

_UP = np.array([0.0, 0.0, 1.0])  # (3,): axes have a positive z


@dataclass(frozen=True)
class Ring(Bar):
    """A bar whose axis is a circle about `point_mm`; `axis` is the normal of its plane."""

    ring_radius_mm: float = 0.0

    @classmethod
    def bent(cls, bar: Bar, touched_mm: np.ndarray, ring_radius_mm: float) -> Self:
        """A straight bar bent away from the whisker that touches it at a point (3,)."""
        foot = bar.foot_mm(touched_mm)
        normal = (touched_mm - foot) / np.linalg.norm(touched_mm - foot)
        plane = np.cross(bar.axis, normal)
        return cls(
            foot - ring_radius_mm * normal,
            plane,
            bar.radius_mm,
            bar.stiffness_N_mm,
            ring_radius_mm=ring_radius_mm,
        )

    def seen_from(self, pose: np.ndarray) -> Self:
        """The same ring in the frame of a pose (3, 4), T_rig_base."""
        turn, shift = pose[:, :3], pose[:, 3]
        return replace(self, point_mm=turn.T @ (self.point_mm - shift), axis=turn.T @ self.axis)

    def foot_mm(self, point_mm: np.ndarray) -> np.ndarray:
        """The circle's points nearest to points (..., 3)."""
        apart = point_mm - self.point_mm
        flat = apart - np.multiply.outer(apart @ self.axis, self.axis)
        return self.point_mm + self.ring_radius_mm * flat / np.linalg.norm(
            flat, axis=-1, keepdims=True
        )

    def around(self, point_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """As `Bar.around`."""
        apart = point_mm - self.point_mm
        plane = np.eye(3) - np.outer(self.axis, self.axis)
        flat = plane @ apart
        length = np.linalg.norm(flat)
        outward = flat / length
        outward_by = (plane - np.outer(outward, outward)) / length
        along = np.cross(self.axis, outward)
        side = 1.0 if along[2] >= 0 else -1.0
        turning = side * cross_matrix(self.axis) @ outward_by
        way = apart - self.ring_radius_mm * outward
        return way, np.eye(3) - self.ring_radius_mm * outward_by, side * along, turning


@dataclass(frozen=True)
class Sphere(Bar):
    """A sphere about `point_mm`. The axis that a contact sees lies in the surface, as upright as can be."""

    def seen_from(self, pose: np.ndarray) -> Self:
        """The same sphere in the frame of a pose (3, 4), T_rig_base."""
        return replace(self, point_mm=pose[:, :3].T @ (self.point_mm - pose[:, 3]))

    def foot_mm(self, point_mm: np.ndarray) -> np.ndarray:
        """The centre, for each of points (..., 3)."""
        return np.broadcast_to(self.point_mm, np.shape(point_mm))

    def around(self, point_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """As `Bar.around`."""
        way = point_mm - self.point_mm
        distance = np.linalg.norm(way)
        normal = way / distance
        normal_by = (np.eye(3) - np.outer(normal, normal)) / distance
        upright = _UP - normal[2] * normal
        length = np.linalg.norm(upright)
        axis = upright / length
        upright_by = -np.outer(normal, normal_by[2]) - normal[2] * normal_by
        return way, np.eye(3), axis, (np.eye(3) - np.outer(axis, axis)) @ upright_by / length


@dataclass(frozen=True)
class Cone(Bar):
    """A round cone: all points at `radius_mm` from the thinner one whose tip is `point_mm`, up to its own tip. `axis`
    points there; the axis that a contact sees is the straight line of the surface through it.
    """

    half_angle_rad: float = 0.0

    @classmethod
    def narrowing(cls, bar: Bar, touched_mm: np.ndarray, half_angle_rad: float) -> Self:
        """A cone that a whisker touches at the point (3,) and slope at which it touches the bar, its tip above; there
        it is as curved across as the bar is."""
        foot = bar.foot_mm(touched_mm)
        normal = (touched_mm - foot) / np.linalg.norm(touched_mm - foot)
        axis = math.cos(half_angle_rad) * bar.axis + math.sin(half_angle_rad) * normal
        return cls(foot, axis, bar.radius_mm, bar.stiffness_N_mm, half_angle_rad=half_angle_rad)

    @property
    def tip_mm(self) -> np.ndarray:
        """Where the cone ends, (3,)."""
        return self.point_mm + self.radius_mm / math.sin(self.half_angle_rad) * self.axis

    def seen_from(self, pose: np.ndarray) -> Self:
        """The same cone in the frame of a pose (3, 4), T_rig_base."""
        turn, shift = pose[:, :3], pose[:, 3]
        return replace(self, point_mm=turn.T @ (self.point_mm - shift), axis=turn.T @ self.axis)

    def _across(self, point_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of points (..., 3): the way out from the centreline (..., 3), how far that is, and the distance from the thin
        cone, negative within, (...)."""
        apart = point_mm - self.point_mm
        high = apart @ self.axis
        flat = apart - np.multiply.outer(high, self.axis)
        far = np.linalg.norm(flat, axis=-1)
        return flat, far, math.cos(self.half_angle_rad) * far + math.sin(self.half_angle_rad) * high

    def _normal(self, outward: np.ndarray) -> np.ndarray:
        return math.cos(self.half_angle_rad) * outward + math.sin(self.half_angle_rad) * self.axis

    def outside_mm(self, point_mm: np.ndarray) -> np.ndarray:
        """As `Bar.outside_mm`; above the tip, how far from the tip."""
        _, far, distance = self._across(point_mm)
        outside = distance - self.radius_mm
        above = far < math.cos(self.half_angle_rad) * outside
        return np.where(above, np.linalg.norm(point_mm - self.tip_mm, axis=-1), outside)

    def foot_mm(self, point_mm: np.ndarray) -> np.ndarray:
        """The thin cone's points nearest to points (..., 3)."""
        flat, far, distance = self._across(point_mm)
        return point_mm - distance[..., None] * self._normal(flat / far[..., None])

    def around(self, point_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """As `Bar.around`. Raises ArithmeticError above the tip."""
        flat, far, distance = self._across(point_mm)
        sin, cos = math.sin(self.half_angle_rad), math.cos(self.half_angle_rad)
        if far <= cos * (distance - self.radius_mm):
            raise ArithmeticError("the contact is past the cone's tip")
        outward = flat / far
        normal = self._normal(outward)
        outward_by = (np.eye(3) - np.outer(self.axis, self.axis) - np.outer(outward, outward)) / far
        upwards = cos * self.axis - sin * outward
        side = 1.0 if upwards[2] >= 0 else -1.0
        way_by = np.outer(normal, normal) + distance * cos * outward_by
        return distance * normal, way_by, side * upwards, -side * sin * outward_by
