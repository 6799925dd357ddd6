"""The forms of surface that an array feels, by the names that manifests give them.

A form holds no place and no size: these are fields of `bench.array.surface.ObjectSurface`, plain
values that array.json keeps.
"""

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

import numpy as np

if TYPE_CHECKING:
    from bench.array.surface import ObjectSurface

# [points] Of a centreline that is drawn. A layout.
_POINTS = 400
# [mm] Least length of a cone that is drawn. A layout.
_DRAWN_CONE_MM = 30.0


class SurfaceForm(ABC):
    """All points at one distance from a centreline.

    size: field of ObjectSurface that touches determine. column: its name in size.csv. is_thick:
    whether the distance from the centreline is stated.
    """

    size: ClassVar[str] = "radius_mm"
    column: ClassVar[str] = "radius_mm"
    is_thick: ClassVar[bool] = True

    @abstractmethod
    def from_centreline(self, surface: "ObjectSurface", points_mm: np.ndarray) -> np.ndarray:
        """Return the vectors (n, 3) from the centreline's nearest points to points (n, 3)."""

    @abstractmethod
    def centreline_mm(self, surface: "ObjectSurface", low_mm: float, high_mm: float) -> np.ndarray:
        """Return points (n, 3) of the centreline, a straight one between two heights."""

    def distance_mm(
        self, surface: "ObjectSurface", points_mm: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the distances (n,) of points (n, 3), negative within, and the normals (n, 3)."""
        outward = self.from_centreline(surface, points_mm)
        return np.linalg.norm(outward, axis=1) - surface.radius_mm, _unit(outward)

    def free_axes(self, surface: "ObjectSurface") -> np.ndarray:
        """Return the directions (k, 3), unit, in which a shift of the surface changes it."""
        return np.eye(3)

    def in_unit_of_column(self, size: float) -> float:
        """Convert a size to the unit of its column."""
        return size


class BarSurface(SurfaceForm):
    """A round bar: its centreline is straight."""

    def from_centreline(self, surface: "ObjectSurface", points_mm: np.ndarray) -> np.ndarray:
        """Return the vectors (n, 3) from the line to points (n, 3)."""
        return _from_axis(surface, points_mm)

    def centreline_mm(self, surface: "ObjectSurface", low_mm: float, high_mm: float) -> np.ndarray:
        """Return points (n, 3) of the line between two heights."""
        heights = np.linspace(low_mm, high_mm, _POINTS)
        return surface.point_mm + np.outer(heights, surface.axis)

    def free_axes(self, surface: "ObjectSurface") -> np.ndarray:
        """Return the directions (2, 3) across the line."""
        return _across(surface)


class RingSurface(SurfaceForm):
    """A ring: its centreline is a circle, whose radius touches determine."""

    size = "ring_radius_mm"

    def from_centreline(self, surface: "ObjectSurface", points_mm: np.ndarray) -> np.ndarray:
        """Return the vectors (n, 3) from the circle to points (n, 3)."""
        towards_circle = _unit(_from_axis(surface, points_mm))
        return points_mm - surface.point_mm - surface.ring_radius_mm * towards_circle

    def centreline_mm(self, surface: "ObjectSurface", low_mm: float, high_mm: float) -> np.ndarray:
        """Return points (n, 3) of the whole circle."""
        angles = np.linspace(0.0, 2 * np.pi, _POINTS)
        circle = np.stack([np.cos(angles), np.sin(angles)], axis=1) @ _across(surface)
        return surface.point_mm + surface.ring_radius_mm * circle


class SphereSurface(SurfaceForm):
    """A sphere: its centreline is a point."""

    def from_centreline(self, surface: "ObjectSurface", points_mm: np.ndarray) -> np.ndarray:
        """Return the vectors (n, 3) from the centre to points (n, 3)."""
        return points_mm - surface.point_mm

    def centreline_mm(self, surface: "ObjectSurface", low_mm: float, high_mm: float) -> np.ndarray:
        """Return the centre (1, 3)."""
        return surface.point_mm[None]


class ConeSurface(BarSurface):
    """A cone about a straight line up to its tip; touches determine its half angle."""

    size = "half_angle_rad"
    column = "half_angle_deg"
    is_thick = False

    def centreline_mm(self, surface: "ObjectSurface", low_mm: float, high_mm: float) -> np.ndarray:
        """Return points (n, 3) of the line from a height up to the tip."""
        return super().centreline_mm(surface, min(low_mm, -_DRAWN_CONE_MM), 0.0)

    def distance_mm(
        self, surface: "ObjectSurface", points_mm: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the distances (n,) and normals (n, 3) from the straight lines of the surface.

        They are from the tip where no such line is nearer.
        """
        sin = np.sin(surface.half_angle_rad)
        cos = np.cos(surface.half_angle_rad)
        from_tip = points_mm - surface.point_mm
        height = from_tip @ surface.axis
        from_axis = _from_axis(surface, points_mm)
        radial = np.linalg.norm(from_axis, axis=1)
        is_above = sin * radial < cos * height
        side_normals = cos * _unit(from_axis) + sin * surface.axis
        normals = np.where(is_above[:, None], _unit(from_tip), side_normals)
        to_tip = np.linalg.norm(from_tip, axis=1)
        return np.where(is_above, to_tip, cos * radial + sin * height), normals

    def free_axes(self, surface: "ObjectSurface") -> np.ndarray:
        """Return all three directions: a shift along the axis moves the tip."""
        return np.eye(3)

    def in_unit_of_column(self, size: float) -> float:
        """Convert a half angle to degrees."""
        return float(np.degrees(size))


FORMS: dict[str, SurfaceForm] = {
    "bar": BarSurface(),
    "ring": RingSurface(),
    "sphere": SphereSurface(),
    "cone": ConeSurface(),
}


def _from_axis(surface, points_mm):
    """Return the vectors (n, 3) from a surface's axis to points (n, 3)."""
    from_point = points_mm - surface.point_mm
    return from_point - np.outer(from_point @ surface.axis, surface.axis)


def _across(surface):
    """Return two unit vectors (2, 3) at right angles to a surface's axis."""
    return np.linalg.svd(surface.axis[None])[2][1:]


def _unit(vectors):
    """Return vectors (n, 3) scaled to length 1."""
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
