"""Rays of a picture's samples, and what is asked of an object that they meet: how much of a sample its outline covers,
and where rays meet it first. Rays are (x, y, 1) in the camera's frame.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.special import ndtr


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays x, y (rows, columns) through samples, undistorted; `focal_px` (2,) and the blur of an edge, px."""

    x: np.ndarray
    y: np.ndarray
    focal_px: np.ndarray
    soft_px: float

    def covered(self, level: np.ndarray, by_x: np.ndarray, by_y: np.ndarray) -> np.ndarray:
        """How much of each sample is where a function of the rays is negative, by its derivatives there."""
        return ndtr(
            -level / (self.soft_px * np.hypot(by_x / self.focal_px[0], by_y / self.focal_px[1]))
        )

    def beside(self, normal: np.ndarray) -> np.ndarray:
        """How much of each sample is on the negative side of a plane through the camera, by its normal (3,)."""
        return self.covered(
            normal[0] * self.x + normal[1] * self.y + normal[2], normal[0], normal[1]
        )

    def within(self, conic: np.ndarray) -> np.ndarray:
        """How much of each sample is within a conic (3, 3), negative there."""
        by_x, by_y, rest = (row[0] * self.x + row[1] * self.y + row[2] for row in conic)
        return self.covered(0.5 * (self.x * by_x + self.y * by_y + rest), by_x, by_y)


@dataclass(frozen=True, eq=False)
class Hits:
    """Where rays (n,) meet a surface first: depths mm, NaN where they miss it; its normals there (n, 3); and how far
    the eye stands off the surface's straight or least curved direction, 0 to 1: what its darkening is measured by."""

    depth_mm: np.ndarray
    normals: np.ndarray
    across: np.ndarray


class Seen(Protocol):
    """An object in the camera's frame."""

    def points_mm(self) -> np.ndarray:
        """Points (n, 3) about which it lies, to some thousandths of its size."""

    def cover(self, rays: Rays) -> np.ndarray:
        """How much of each sample it covers (rows, columns)."""

    def hits(self, rays: np.ndarray) -> Hits:
        """Where rays (n, 3) meet it first."""


def unit(way: np.ndarray) -> np.ndarray:
    """A direction (3,) of length 1."""
    return way / np.linalg.norm(way)


def across(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (3,) across an axis and each other."""
    first = unit(np.cross(axis, np.eye(3)[np.abs(axis).argmin()]))
    return first, np.cross(axis, first)


def sine_off(ways: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Sines (n,) of the angles between unit vectors (n, 3)."""
    return np.sqrt(np.maximum(1 - (ways * along).sum(1) ** 2, 0))
