"""Pinhole cameras with Brown–Conrady lenses, projecting through OpenCV."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.polynomial import chebyshev

_DEGREE = 13  # of the Chebyshev series of the lens's inverse


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera in the rig: `rotation` (3, 3) and `translation_mm` (3,) take rig coordinates to camera coordinates."""

    name: str
    size_px: tuple[int, int]
    matrix: np.ndarray
    distortion: np.ndarray
    rotation: np.ndarray
    translation_mm: np.ndarray

    @classmethod
    def looking(
        cls,
        name: str,
        *,
        size_px: tuple[int, int],
        focal_px: float,
        distortion: Sequence[float],
        position_mm: np.ndarray,
        target_mm: np.ndarray,
        roll_rad: float = 0.0,
        centre_px: Sequence[float] | None = None,
        aspect: float = 1.0,
    ) -> "Camera":
        """A camera at a position looking at a point, the rig's z upwards in its picture up to `roll_rad`.

        Raises ValueError where it looks straight up or down (there is no upwards then) or stands on its target.
        """
        centre_px = centre_px if centre_px is not None else (np.array(size_px) - 1) / 2
        matrix = np.array(
            [[focal_px, 0, centre_px[0]], [0, focal_px * aspect, centre_px[1]], [0, 0, 1.0]]
        )
        rotation = _looking(np.asarray(position_mm, float), np.asarray(target_mm, float), roll_rad)
        return cls(
            name,
            tuple(size_px),
            matrix,
            np.asarray(distortion, float),
            rotation,
            -rotation @ position_mm,
        )

    @property
    def centre_mm(self) -> np.ndarray:
        """Where the camera is in the rig frame, (3,)."""
        return -self.rotation.T @ self.translation_mm

    def project(self, points_mm: np.ndarray) -> np.ndarray:
        """Pixels (n, 2) of points (n, 3) in the rig frame."""
        turn, _ = cv2.Rodrigues(self.rotation)
        points = np.ascontiguousarray(np.asarray(points_mm, float).reshape(-1, 1, 3))
        return cv2.projectPoints(points, turn, self.translation_mm, self.matrix, self.distortion)[
            0
        ][:, 0]

    def in_camera(self, points_mm: np.ndarray) -> np.ndarray:
        """Camera coordinates of points (..., 3)."""
        return np.asarray(points_mm, float) @ self.rotation.T + self.translation_mm

    def rays(self, u_px: np.ndarray, v_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Undistorted x/z and y/z on the grid of columns `u_px` and rows `v_px`: two (rows, columns) float32 arrays.

        From a polynomial in the pixel position that inverts the lens to 1e-5 px (tested), so that any grid costs two
        matrix products.
        """
        columns, rows = self._basis(u_px, 0), self._basis(v_px, 1)
        return tuple((rows @ c @ columns.T).astype(np.float32) for c in self._lens)

    def _basis(self, px, side):
        """Chebyshev values over the picture and a tenth of it on either side."""
        half = 0.5 * self.size_px[side]
        return chebyshev.chebvander((np.asarray(px, float) - half) / (1.2 * half), _DEGREE)

    @cached_property
    def _lens(self):
        nodes = np.cos(np.pi * (np.arange(2 * _DEGREE) + 0.5) / (2 * _DEGREE))
        u, v = (0.5 * s * (1 + 1.2 * nodes) for s in self.size_px)
        rays = self._undistorted(np.stack(np.meshgrid(u, v), -1))
        columns, rows = np.linalg.pinv(self._basis(u, 0)), np.linalg.pinv(self._basis(v, 1))
        return [rows @ rays[..., i] @ columns.T for i in (0, 1)]

    def _undistorted(self, px):
        """x/z, y/z (..., 2) that OpenCV projects to pixels (..., 2): the pinhole's answer, corrected until it does."""
        focal = np.diag(self.matrix)[:2]
        rays = (px - self.matrix[:2, 2]) / focal
        for _ in range(60):
            points = np.concatenate([rays, np.ones_like(rays[..., :1])], -1).reshape(-1, 1, 3)
            seen = cv2.projectPoints(
                points, np.zeros(3), np.zeros(3), self.matrix, self.distortion
            )[0]
            rays = rays + (px - seen.reshape(px.shape)) / focal
        return rays


def _looking(position, target, roll):
    ahead = (target - position) / np.linalg.norm(target - position)
    right = np.cross(ahead, [0, 0, 1.0])
    if not np.linalg.norm(right) > 1e-9:
        raise ValueError("a camera must not look straight up or down, nor stand on its target")
    right /= np.linalg.norm(right)
    down = np.cross(ahead, right)
    cos, sin = math.cos(roll), math.sin(roll)
    return np.array([cos * right + sin * down, cos * down - sin * right, ahead])
