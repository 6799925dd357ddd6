"""Points in space from where two or more cameras see them, with the share of the calibration in their covariance."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vision.geometry.camera import N_PARAMETERS, Cameras

# [steps] Gauss–Newton from the meeting of rays converges quadratically; rays meet to a percent.
# Derived.
_STEPS = 6


@dataclass(frozen=True, eq=False)
class Points:
    """mm (n, 3) in the rig frame, NaN where fewer than two cameras see the point. noise_covariance (n, 3, 3): from the
    corners' sigmas; by_cameras (n, 3, 15 c): how a point follows the cameras' parameters."""

    mm: np.ndarray
    noise_covariance: np.ndarray
    by_cameras: np.ndarray

    def covariance(self, cameras: Cameras) -> np.ndarray:
        """Noise and calibration together, (n, 3, 3) mm². The calibration's share is common to all points."""
        J = self.by_cameras
        return self.noise_covariance + J @ cameras.covariance @ np.swapaxes(J, 1, 2)


def triangulate(
    cameras: Cameras, px: Mapping[str, np.ndarray], sigma_px: Mapping[str, np.ndarray]
) -> Points:
    """Least squares of the reprojection. px: per camera (n, 2), NaN where it does not see the point; sigma_px (n,)."""
    seen = {name: np.isfinite(px[name]).all(axis=1) for name in cameras.names}
    enough = np.sum([seen[name] for name in cameras.names], axis=0) > 1
    points = np.where(enough[:, None], _meet(cameras, px, seen), np.nan)
    for _ in range(_STEPS):
        step, normal, coupling = _step(cameras, px, sigma_px, seen, points)
        points = points + step
    inverse = _inverse(normal)
    blank = np.where(enough, 1.0, np.nan)[:, None, None]
    return Points(points, blank * inverse, blank * (inverse @ coupling))


def _meet(cameras: Cameras, px, seen) -> np.ndarray:
    """Where rays come nearest to each other, (n, 3)."""
    A, b = np.zeros((len(px[cameras.names[0]]), 3, 3)), np.zeros((len(px[cameras.names[0]]), 3))
    for camera in cameras:
        rays = np.where(
            seen[camera.name][:, None], camera.rays(np.nan_to_num(px[camera.name])), 0.0
        )
        across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
        across = across * np.any(np.nan_to_num(rays) != 0, axis=1)[:, None, None]
        A, b = A + np.nan_to_num(across), b + np.nan_to_num(across) @ camera.centre_mm
    return (_inverse(A) @ b[:, :, None])[:, :, 0]


def _step(cameras: Cameras, px, sigma_px, seen, points: np.ndarray):
    """Gauss–Newton's step (n, 3), its matrix (n, 3, 3), and minus the gradient by the cameras (n, 3, 15 c)."""
    n = len(points)
    normal, gradient = np.zeros((n, 3, 3)), np.zeros((n, 3))
    coupling = np.zeros((n, 3, N_PARAMETERS * len(cameras)))
    for k, camera in enumerate(cameras):
        predicted, by_point, by_camera = camera.project_with_jacobians(points)
        weight = np.where(seen[camera.name], 1.0 / sigma_px[camera.name], 0.0)[:, None]
        residual = np.nan_to_num((px[camera.name] - predicted) * weight)
        J, Jc = (np.nan_to_num(M * weight[:, :, None]) for M in (by_point, by_camera))
        Jt = np.swapaxes(J, 1, 2)
        normal, gradient = normal + Jt @ J, gradient + (Jt @ residual[:, :, None])[:, :, 0]
        coupling[:, :, N_PARAMETERS * k : N_PARAMETERS * (k + 1)] = -Jt @ Jc
    return (_inverse(normal) @ gradient[:, :, None])[:, :, 0], normal, coupling


def _inverse(matrices: np.ndarray) -> np.ndarray:
    """Inverses (n, 3, 3); of a point that is not seen twice, something finite."""
    return np.linalg.pinv(matrices, rcond=1e-14, hermitian=True)
