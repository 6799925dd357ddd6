"""Rays of a picture's samples, and what is computed of an object that they meet: how much of a
sample its outline covers, and where rays meet it first. Rays are (x, y, 1) in the camera's frame.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.special import ndtr


@dataclass(frozen=True, eq=False)
class Rays:
    """Undistorted rays through a grid of samples, and the sharpness of an edge drawn there.

    x, y (rows, columns). focal_px (2,). soft_px: sigma of an edge's blur.
    """

    x: np.ndarray
    y: np.ndarray
    focal_px: np.ndarray
    soft_px: float

    def coverage(self, level: np.ndarray, by_x: np.ndarray, by_y: np.ndarray) -> np.ndarray:
        """Return how much of each sample lies where a function of the rays is negative.

        level: the function's values; by_x, by_y: its derivatives by the rays.
        """
        slope_per_px = np.hypot(by_x / self.focal_px[0], by_y / self.focal_px[1])
        return ndtr(-level / (self.soft_px * slope_per_px))

    def half_plane_coverage(self, normal: np.ndarray) -> np.ndarray:
        """Return how much of each sample lies on the negative side of a plane through the camera.

        normal (3,): of the plane.
        """
        level = normal[0] * self.x + normal[1] * self.y + normal[2]
        return self.coverage(level, normal[0], normal[1])

    def conic_coverage(self, conic: np.ndarray) -> np.ndarray:
        """Return how much of each sample lies within a conic (3, 3), whose form is negative there."""
        by_x, by_y, rest = (row[0] * self.x + row[1] * self.y + row[2] for row in conic)
        return self.coverage(0.5 * (self.x * by_x + self.y * by_y + rest), by_x, by_y)


@dataclass(frozen=True, eq=False)
class Hits:
    """Points where rays (n,) first meet a surface.

    depth_mm (n,): NaN where a ray misses it. normals (n, 3): of the surface. obliqueness (n,):
    sine of the angle between the ray and the surface's straight or least curved direction, by which
    the surface darkens towards its edges.
    """

    depth_mm: np.ndarray
    normals: np.ndarray
    obliqueness: np.ndarray


class VisibleObject(Protocol):
    """An object in the camera's frame."""

    def points_mm(self) -> np.ndarray:
        """Return points (n, 3) whose hull holds it, to some thousandths of its size."""

    def coverage(self, rays: Rays) -> np.ndarray:
        """Return how much of each sample (rows, columns) it covers."""

    def intersect(self, rays: np.ndarray) -> Hits:
        """Find where rays (n, 3) first meet it."""


def unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (..., 3) scaled to length 1."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def perpendicular_axes(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors (3,) at right angles to a unit axis and to each other."""
    first = unit(np.cross(axis, np.eye(3)[np.abs(axis).argmin()]))
    return first, np.cross(axis, first)


def circle_points(
    centre: np.ndarray, radius: float, axis: np.ndarray, angles: np.ndarray
) -> np.ndarray:
    """Return the points (..., 3) of a circle about an axis at angles (...)."""
    first, second = perpendicular_axes(axis)
    cos = np.multiply.outer(np.cos(angles), first)
    sin = np.multiply.outer(np.sin(angles), second)
    return centre + radius * (cos + sin)


def sine_between(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the sines (n,) of the angles between unit vectors (n, 3)."""
    cosine = (one * other).sum(1)
    return np.sqrt(np.maximum(1 - cosine**2, 0))
