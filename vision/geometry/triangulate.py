"""Points in space from where two or more cameras see them, with the calibration's share of their
covariance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vision.geometry.camera import Camera, Cameras

# [steps] Gauss–Newton from the meeting of rays converges quadratically; rays meet to a percent.
# Derived.
_STEPS = 6


@dataclass(frozen=True, eq=False)
class Points:
    """Triangulated points with their covariance.

    mm (n, 3): in the rig frame, NaN where fewer than two cameras see the point.
    noise_covariance (n, 3, 3): from the sigmas of the picture points.
    by_cameras (n, 3, 15 c): derivatives by the cameras' parameters.
    """

    mm: np.ndarray
    noise_covariance: np.ndarray
    by_cameras: np.ndarray

    def covariance(self, cameras: Cameras) -> np.ndarray:
        """Return the covariance (n, 3, 3), mm², of noise and calibration. The calibration's share
        is common to all points.
        """
        J = self.by_cameras
        return self.noise_covariance + J @ cameras.covariance @ np.swapaxes(J, 1, 2)


def triangulate(
    cameras: Cameras, px: Mapping[str, np.ndarray], sigma_px: Mapping[str, np.ndarray]
) -> Points:
    """Triangulate points by least squares of the reprojection errors.

    px: by camera (n, 2), NaN where it does not see the point; sigma_px: by camera (n,).
    """
    visible = {name: np.isfinite(px[name]).all(axis=1) for name in cameras.names}
    enough = np.sum(list(visible.values()), axis=0) > 1  # (n,)
    meeting = nearest_to_rays(cameras.cameras, [px[name] for name in cameras.names])
    points = np.where(enough[:, None], meeting, np.nan)
    for _ in range(_STEPS):
        step, normal, coupling = _gauss_newton_step(cameras, px, sigma_px, points)
        points = points + step
    covariance = np.where(enough[:, None, None], _inverse(normal), np.nan)
    return Points(points, covariance, covariance @ coupling)


def nearest_to_rays(cameras: Sequence[Camera], px: Sequence[np.ndarray]) -> np.ndarray:
    """Return where the rays of several cameras come nearest to each other, (n, 3) mm.

    px: of each camera (n, 2), NaN where it does not see the point.
    """
    A = np.zeros((len(px[0]), 3, 3))
    b = np.zeros((len(px[0]), 3))
    for camera, own_px in zip(cameras, px):
        rays = camera.rays(own_px)
        across = np.nan_to_num(np.eye(3) - rays[:, :, None] * rays[:, None, :])
        A += across
        b += across @ camera.centre_mm
    return (_inverse(A) @ b[:, :, None])[:, :, 0]


def _gauss_newton_step(cameras: Cameras, px, sigma_px, points: np.ndarray):
    """Return Gauss–Newton's step (n, 3), its matrix (n, 3, 3), and minus the derivative of the
    gradient by the cameras' parameters (n, 3, 15 c).
    """
    n = len(points)
    normal = np.zeros((n, 3, 3))
    gradient = np.zeros((n, 3, 1))
    couplings = []
    for camera in cameras:
        residual, by_point, by_camera = _weighted_rows(
            camera, px[camera.name], sigma_px[camera.name], points
        )
        transposed = np.swapaxes(by_point, 1, 2)
        normal += transposed @ by_point
        gradient += transposed @ residual[:, :, None]
        couplings.append(-transposed @ by_camera)
    step = (_inverse(normal) @ gradient)[:, :, 0]
    return step, normal, np.concatenate(couplings, axis=2)


def _weighted_rows(camera: Camera, px, sigma_px, points: np.ndarray) -> list[np.ndarray]:
    """Return one camera's residuals (n, 2), and derivatives of its pixels by points (n, 2, 3) and
    by its parameters (n, 2, 15), over sigma; 0 of points that it does not see.
    """
    predicted, by_point, by_camera = camera.project_with_jacobians(points)
    residual = px - predicted
    weight = np.where(np.isfinite(residual).all(axis=1), 1.0 / sigma_px, 0.0)[:, None]
    rows = (residual * weight, by_point * weight[:, None], by_camera * weight[:, None])
    return [np.nan_to_num(values) for values in rows]


def _inverse(matrices: np.ndarray) -> np.ndarray:
    """Return the inverses (n, 3, 3); pseudo-inverses of points that fewer than two cameras see."""
    return np.linalg.pinv(matrices, rcond=1e-14, hermitian=True)
