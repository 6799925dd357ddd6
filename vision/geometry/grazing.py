"""Residuals of points on a rounded object's silhouette: how far sights pass outside its surface.

A sight that grazes the surface has residual 0. So no silhouette has to be drawn, and every point
has one residual, whatever the object's shape.
"""

from dataclasses import dataclass

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.rounded import RoundedAxis


@dataclass(frozen=True)
class Grazing:
    """Where sights come nearest to an object, or to a batch of objects.

    outside_mm (..., n): distance from the object's middle, see `RoundedAxis.outside_mm`. points_mm (n,
    3), normals (n, 3): the nearest points on the sights and the surface's normals there, of the
    first object of a batch.
    """

    outside_mm: np.ndarray
    points_mm: np.ndarray
    normals: np.ndarray

    def px_per_mm(self, camera: Camera, normals_px: np.ndarray) -> np.ndarray:
        """Return how far (n,) the silhouette moves, px, per mm that the surface moves outwards.

        normals_px (n, 2): of the silhouette, along which it moves.
        """
        _, by_point, _ = camera.project_with_jacobians(self.points_mm)
        return np.einsum("ni,nij,nj->n", normals_px, by_point, self.normals)


def sights_beside(camera: Camera, axis: RoundedAxis, px: np.ndarray, far_mm: np.ndarray) -> Grazing:
    """Compute where the sights through pixels (n, 2) come nearest to an object, or to a batch.

    far_mm (n,): about how far from the camera they graze it.
    """
    rays = camera.rays(px)
    shape = np.broadcast_shapes((*axis.point_mm.shape[:-1], 1), (len(px),))
    begin_mm = np.broadcast_to(far_mm, shape)
    nearest_mm = axis.nearest_on_lines(camera.centre_mm, rays, begin_mm)  # (..., n) from the camera
    outside, normals = axis.outside_mm(camera.centre_mm + nearest_mm[..., None] * rays)
    first = (0,) * (len(shape) - 1)
    points = camera.centre_mm + nearest_mm[first][:, None] * rays
    return Grazing(outside, points, normals[first])
