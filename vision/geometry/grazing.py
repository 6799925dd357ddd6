"""The outline of a rounded object against points of it: how far the sights through these pass outside of its surface.

So no outline is drawn, and each of them has one residual, whatever the shape: 0 where a sight grazes the surface.
"""

from dataclasses import dataclass

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.rounded import Rounded


@dataclass(frozen=True)
class Grazing:
    """Where sights come nearest to an object: how far from its middle (…, n), mm, see `Rounded.outside_mm`, and of the
    first object of a batch the nearest points of its surface and their normals (n, 3)."""

    outside_mm: np.ndarray
    points_mm: np.ndarray
    normals: np.ndarray

    def px_per_mm(self, camera: Camera, normals_px: np.ndarray) -> np.ndarray:
        """By how much (n,) the outline moves across itself, along normals (n, 2), with a millimetre outwards."""
        _, by_point, _ = camera.project_with_jacobians(self.points_mm)
        return np.einsum("ni,nij,nj->n", normals_px, by_point, self.normals)


def sights_beside(camera: Camera, axis: Rounded, px: np.ndarray, far_mm: np.ndarray) -> Grazing:
    """Sights through pixels (n, 2) beside an object, or a batch of them; far_mm (n,): about how far away they graze."""
    rays = camera.rays(px)
    shape = np.broadcast_shapes((*axis.point_mm.shape[:-1], 1), (len(px),))
    far = axis.nearest_on_lines(camera.centre_mm, rays, np.broadcast_to(far_mm, shape))
    outside, normals, _ = axis.outside_mm(camera.centre_mm + far[..., None] * rays)
    one = (0,) * (len(shape) - 1)
    nearest = camera.centre_mm + far[one][:, None] * rays
    return Grazing(outside, nearest, normals[one])
