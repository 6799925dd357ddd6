"""Rings, spheres and cones in pictures: shaded where rays meet them, their edges blurred as a tube's are."""

from dataclasses import dataclass

import cv2
import numpy as np

from bench.base.errors import BadInput
from bench.rig.bar import Bar
from bench.rig.grazed import seen
from bench.rig.layer import Layer
from bench.rig.light import Light, Material, surface_shade
from bench.rig.rays import Hits, Rays, Seen
from bench.rig.window import Window

_COVERS = 1e-6  # of a sample: what covers less is not drawn, what covers all but so much has no edge there
_GAUSS = 0.5 / np.sqrt(3)  # Gauss–Legendre's two points across a sample


@dataclass(frozen=True, eq=False)
class Solid:
    """A ring, sphere or cone in the rig frame, and its material."""

    thing: Bar
    material: Material

    def layer(self, window: Window, light: Light) -> Layer | None:
        """What it is in the samples of a window; None where it is not in it. Raises BadInput where it is not all before
        the camera."""
        camera = window.camera
        shape = seen(self.thing, camera.rotation, camera.translation_mm)
        points = shape.points_mm()
        if points[:, 2].min() <= 1.0:
            raise BadInput(f"camera {camera.name} stands within an object or beside it")
        points = (points - camera.translation_mm) @ camera.rotation
        part = window.around(camera.project(points), 4 * window.soft_px + 2)
        if part is None:
            return None
        x, y = (ray.astype(float) for ray in part.rays())
        rays = Rays(x, y, np.diag(camera.matrix)[:2], window.soft_px)
        cover = shape.cover(rays)
        covered = cover > _COVERS
        if not covered.any():
            return None
        tone, depth = self._lit(shape, light, camera.rotation @ light.towards, rays, cover)
        at, (rows, columns) = np.nonzero(covered), part.within(window)
        return Layer(
            (at[0] + rows.start, at[1] + columns.start), cover[covered], tone[at], depth[at]
        )

    def _lit(self, shape: Seen, light: Light, towards: np.ndarray, rays: Rays, cover: np.ndarray):
        """Brightness and distance (rows, columns) where it covers anything; towards (3,): the lamp, in the camera's
        frame. At edges the mean of the four rays of a sample that meet it, beyond them the nearest sample's."""
        tone, depth = (np.full(cover.shape, np.nan) for _ in range(2))
        covered = cover > _COVERS
        edge = covered & (cv2.erode((cover > 1 - _COVERS).astype(np.uint8), np.ones((3, 3))) == 0)
        inner = covered & ~edge
        tone[inner], depth[inner] = self._at(shape, light, towards, rays.x[inner], rays.y[inner])
        tone[edge], depth[edge] = self._mean(shape, light, towards, rays, edge)
        return (_filled(values, covered) for values in (tone, depth))

    def _mean(self, shape, light, towards, rays, edge):
        """Of samples at an edge, NaN where no ray meets it."""
        x_down, x_right = (step[edge] for step in np.gradient(rays.x))
        y_down, y_right = (step[edge] for step in np.gradient(rays.y))
        found = []
        for down, right in ((i, j) for i in (-_GAUSS, _GAUSS) for j in (-_GAUSS, _GAUSS)):
            x = rays.x[edge] + down * x_down + right * x_right
            y = rays.y[edge] + down * y_down + right * y_right
            found.append(self._at(shape, light, towards, x, y))
        found = np.array(found)
        met = np.isfinite(found)
        return np.where(met, found, 0).sum(0) / np.where(met.any(0), met.sum(0), np.nan)

    def _at(self, shape, light, towards, x, y):
        """Brightness and distance (n,) where rays meet it, NaN where they miss."""
        rays = np.stack([x, y, np.ones_like(x)], -1)
        length = np.linalg.norm(rays, axis=1)
        hits = shape.hits(rays)
        return self._shade(light, towards, hits, rays / length[:, None]), hits.depth_mm * length

    def _shade(self, light: Light, towards: np.ndarray, hits: Hits, unit: np.ndarray) -> np.ndarray:
        """As a round bar is: by its normal, and darker towards the edges."""
        half = towards - unit
        half /= np.linalg.norm(half, axis=1)[:, None]
        facing = np.clip(-(hits.normals * unit).sum(1) / np.maximum(hits.across, 1e-9), 0, 1)
        return surface_shade(
            light, self.material, hits.normals @ towards, (hits.normals * half).sum(1), facing
        )


def _filled(values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """The same where they are wanted, that of the nearest sample that has one where they are NaN."""
    known = np.isfinite(values)
    if known[wanted].all():
        return values
    _, labels = cv2.distanceTransformWithLabels(
        (~known).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    of_label = np.zeros(labels.max() + 1)
    of_label[labels[known]] = values[known]
    return np.where(known, values, of_label[labels])
