"""Objects that are no straight bar: a bar bent to a circle, and a sphere. To a contact each is a bar whose axis turns
as the contact moves on it.
"""

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
        return cls(foot - ring_radius_mm * normal, plane, bar.radius_mm, bar.stiffness_N_mm,
                   ring_radius_mm=ring_radius_mm)  # fmt: skip

    def seen_from(self, pose: np.ndarray) -> Self:
        """The same ring in the frame of a pose (3, 4), T_rig_base."""
        turn, shift = pose[:, :3], pose[:, 3]
        return replace(self, point_mm=turn.T @ (self.point_mm - shift), axis=turn.T @ self.axis)

    def foot_mm(self, point_mm: np.ndarray) -> np.ndarray:
        """The circle's points nearest to points (..., 3)."""
        apart = point_mm - self.point_mm
        flat = apart - np.multiply.outer(apart @ self.axis, self.axis)
        return self.point_mm + self.ring_radius_mm * flat / np.linalg.norm(flat, axis=-1, keepdims=True)

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
