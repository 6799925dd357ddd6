"""Pinhole cameras with Brown–Conrady lenses, projecting through OpenCV."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.polynomial import chebyshev

_DEGREE = 13  # of the Chebyshev series of the lens's inverse
_SPAN = 1.2  # of that series, in halves of the picture: a tenth of it beyond either side
_PASSES = 60  # of the correction by which a lens is inverted


@dataclass(frozen=True, eq=False)
class PinholeCamera:
    """A camera in the rig.

    matrix (3, 3), distortion (n,): as OpenCV has them. rotation (3, 3), translation_mm (3,): from
    rig coordinates to camera coordinates.
    """

    name: str
    size_px: tuple[int, int]
    matrix: np.ndarray
    distortion: np.ndarray
    rotation: np.ndarray
    translation_mm: np.ndarray

    @classmethod
    def aim(
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
    ) -> "PinholeCamera":
        """Make a camera at a position that is aimed at a point, the rig's z upwards up to a roll.

        Raises ValueError where it is aimed straight up or down (there is no upwards then) or stands
        on its target.
        """
        if centre_px is None:
            centre_px = (np.array(size_px) - 1) / 2
        matrix = np.diag([focal_px, focal_px * aspect, 1.0])
        matrix[:2, 2] = centre_px
        rotation = _aim(np.asarray(position_mm, float), np.asarray(target_mm, float), roll_rad)
        lens = np.asarray(distortion, float)
        return cls(name, tuple(size_px), matrix, lens, rotation, -rotation @ position_mm)

    @property
    def centre_mm(self) -> np.ndarray:
        """Return where the camera is in the rig frame, (3,)."""
        return -self.rotation.T @ self.translation_mm

    def project(self, points_mm: np.ndarray) -> np.ndarray:
        """Project points (n, 3) of the rig frame to pixels (n, 2)."""
        turn, _ = cv2.Rodrigues(self.rotation)
        return self._project(np.asarray(points_mm, float), turn, self.translation_mm)

    def _project(self, points, turn, shift):
        """Project points (n, 3) that a rotation vector and a shift take to the camera's frame."""
        points = np.ascontiguousarray(points.reshape(-1, 1, 3))
        px, _ = cv2.projectPoints(points, turn, shift, self.matrix, self.distortion)
        return px[:, 0]

    def in_camera(self, points_mm: np.ndarray) -> np.ndarray:
        """Convert points (..., 3) of the rig frame to camera coordinates."""
        return np.asarray(points_mm, float) @ self.rotation.T + self.translation_mm

    def rays(self, u_px: np.ndarray, v_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return undistorted x/z and y/z on the grid of columns u_px and rows v_px.

        Both are float32, (rows, columns). They come from a polynomial in the pixel position that
        inverts the lens to 1e-5 px (tested), so that any grid costs two matrix products.
        """
        columns = self._chebyshev(u_px, 0)
        rows = self._chebyshev(v_px, 1)
        x, y = ((rows @ series @ columns.T).astype(np.float32) for series in self._inverse_lens)
        return x, y

    def _chebyshev(self, px, side):
        """Return the Chebyshev polynomials at positions (n,) along a side of the picture, (n, k)."""
        half = 0.5 * self.size_px[side]
        return chebyshev.chebvander((np.asarray(px, float) - half) / (_SPAN * half), _DEGREE)

    @cached_property
    def _inverse_lens(self):
        """Return the Chebyshev coefficients (k, k) of x/z and of y/z by row and column."""
        count = 2 * _DEGREE
        nodes = np.cos(np.pi * (np.arange(count) + 0.5) / count)
        width, height = self.size_px
        u = 0.5 * width * (1 + _SPAN * nodes)
        v = 0.5 * height * (1 + _SPAN * nodes)
        px = np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)
        x, y = self._undistort(px).T.reshape(2, count, count)  # (rows, columns) each
        of_columns = np.linalg.pinv(self._chebyshev(u, 0)).T
        of_rows = np.linalg.pinv(self._chebyshev(v, 1))
        return [of_rows @ x @ of_columns, of_rows @ y @ of_columns]

    def _undistort(self, px):
        """Return x/z and y/z (n, 2) that OpenCV projects to pixels (n, 2).

        The pinhole's rays are corrected by what their projection is off by, until it is off by
        nothing. OpenCV's own function with so many passes has another name in each major version.
        """
        focal = np.diag(self.matrix)[:2]
        rays = (px - self.matrix[:2, 2]) / focal
        for _ in range(_PASSES):
            points = np.column_stack([rays, np.ones(len(rays))])
            rays = rays + (px - self._project(points, np.zeros(3), np.zeros(3))) / focal
        return rays


def _aim(position, target, roll):
    """Return the rotation (3, 3) of a camera that is aimed from a position (3,) at a target (3,)."""
    ahead = (target - position) / np.linalg.norm(target - position)
    right = np.cross(ahead, [0, 0, 1.0])
    if not np.linalg.norm(right) > 1e-9:
        raise ValueError("a camera must not look straight up or down, nor stand on its target")
    right /= np.linalg.norm(right)
    down = np.cross(ahead, right)
    cos = math.cos(roll)
    sin = math.sin(roll)
    return np.array([cos * right + sin * down, cos * down - sin * right, ahead])
