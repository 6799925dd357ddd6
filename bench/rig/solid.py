"""Rings, spheres and cones in pictures: shaded where rays meet them, their edges blurred as a tube's
are."""

from dataclasses import dataclass

import cv2
import numpy as np

from bench.base.errors import BadInput
from bench.rig.layer import Layer
from bench.rig.light import Light, Material, shade_surface
from bench.rig.quadrics import to_camera_frame
from bench.rig.rays import Rays, VisibleObject, unit
from bench.rig.touched_object import TouchedObject
from bench.rig.window import Window

_COVERS = 1e-6  # of a sample: what covers less is not drawn, what covers all but so much is no edge
_GAUSS = 0.5 / np.sqrt(3)  # Gauss–Legendre's two points across a sample


@dataclass(frozen=True, eq=False)
class Solid:
    """A ring, sphere or cone in the rig frame, and its material."""

    thing: TouchedObject
    material: Material

    def layer(self, window: Window, light: Light) -> Layer | None:
        """Return its layer in the samples of a window; None where it is not in it.

        Raises BadInput where it is not all before the camera.
        """
        camera = window.camera
        visible = to_camera_frame(self.thing, camera.rotation, camera.translation_mm)
        part = _crop(window, visible)
        if part is None:
            return None
        x, y = part.rays()
        focal_px = np.diag(camera.matrix)[:2]
        rays = Rays(x.astype(float), y.astype(float), focal_px, window.soft_px)
        cover = visible.coverage(rays)
        index = np.nonzero(cover > _COVERS)
        if not len(index[0]):
            return None
        shader = _Shader(visible, self.material, light, camera.rotation @ light.towards)
        tone, depth = shader.shade(rays, cover)[:, *index]
        return Layer(part.index_in(window, index), cover[index], tone, depth)


def _crop(window: Window, visible: VisibleObject) -> Window | None:
    """Return the part of a window that holds an object; None where it is not in it.

    Raises BadInput where it is not all before the camera.
    """
    camera = window.camera
    points = visible.points_mm()
    if points[:, 2].min() <= 1.0:
        raise BadInput(f"camera {camera.name} stands within an object or beside it")
    points = (points - camera.translation_mm) @ camera.rotation
    return window.crop(camera.project(points), 4 * window.soft_px + 2)


@dataclass(frozen=True, eq=False)
class _Shader:
    """An object, its material and its light in the camera's frame; towards (3,): the lamp there."""

    visible: VisibleObject
    material: Material
    light: Light
    towards: np.ndarray

    def shade(self, rays: Rays, cover: np.ndarray) -> np.ndarray:
        """Return brightness and distance, (2, rows, columns), of the samples that it covers.

        At edges it is the mean of the four rays of a sample that meet it, beyond them the nearest
        sample's.
        """
        shaded = np.full((2, *cover.shape), np.nan)
        is_covered = cover > _COVERS
        is_full = (cover > 1 - _COVERS).astype(np.uint8)
        is_inner = cv2.erode(is_full, np.ones((3, 3))).astype(bool)
        is_edge = is_covered & ~is_inner
        shaded[:, is_inner] = self._shade_rays(rays.x[is_inner], rays.y[is_inner])
        shaded[:, is_edge] = self._average(rays, is_edge)
        return np.array([_fill(values, is_covered) for values in shaded])

    def _average(self, rays, is_edge):
        """Return the mean (2, n) over the four rays of each edge sample; NaN where none meets it."""
        x = rays.x[is_edge]
        y = rays.y[is_edge]
        x_down, x_right = (step[is_edge] for step in np.gradient(rays.x))
        y_down, y_right = (step[is_edge] for step in np.gradient(rays.y))
        total = np.zeros((2, len(x)))
        count = np.zeros((2, len(x)))
        for down in (-_GAUSS, _GAUSS):
            for right in (-_GAUSS, _GAUSS):
                shaded = self._shade_rays(
                    x + down * x_down + right * x_right, y + down * y_down + right * y_right
                )
                is_met = np.isfinite(shaded)
                total += np.where(is_met, shaded, 0)
                count += is_met
        return total / np.where(count, count, np.nan)

    def _shade_rays(self, x, y):
        """Return brightness and distance, (2, n), where rays (n,) meet it; NaN where they miss.

        Like a round bar's, its brightness follows its normal and falls towards its edges.
        """
        rays = np.stack([x, y, np.ones_like(x)], -1)
        length = np.linalg.norm(rays, axis=1)
        directions = rays / length[:, None]
        hits = self.visible.intersect(rays)
        half = unit(self.towards - directions)
        facing = -(hits.normals * directions).sum(1) / np.maximum(hits.obliqueness, 1e-9)
        tone = shade_surface(
            self.light,
            self.material,
            hits.normals @ self.towards,
            (hits.normals * half).sum(1),
            np.clip(facing, 0, 1),
        )
        return np.stack([tone, hits.depth_mm * length])


def _fill(values, is_wanted):
    """Return values (rows, columns), the nearest sample's where one that is wanted is NaN."""
    is_known = np.isfinite(values)
    if is_known[is_wanted].all():
        return values
    _, labels = cv2.distanceTransformWithLabels(
        (~is_known).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    of_label = np.zeros(labels.max() + 1)
    of_label[labels[is_known]] = values[is_known]
    return np.where(is_known, values, of_label[labels])
