"""Pictures of a thin object along a known curve, drawn apart from all that reads them."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import cKDTree

_FINE = 3  # cells a pixel


@dataclass(frozen=True)
class DrawnLine:
    """A thin object: its middle (n, 2) px, and half-widths (n,) px.

    light(t, s): grey levels at t across (-1 … 1) and s along (0 … 1). behind(x, y, t): of what is
    behind it. blur, noise: in px and grey levels.
    """

    middle_px: np.ndarray
    radius_px: np.ndarray
    light: Callable
    behind: Callable = lambda x, y, across: 130.0 + 0.0 * x
    shape: tuple[int, int] = (150, 300)
    blur_px: float = 0.9
    noise: float = 2.0

    def picture(self, rng: np.random.Generator) -> np.ndarray:
        """Return the noisy picture (h, w), grey levels rounded to whole ones."""
        y, x = np.meshgrid(
            *((np.arange(n * _FINE) + 0.5) / _FINE - 0.5 for n in self.shape), indexing="ij"
        )
        cells = np.stack([x.ravel(), y.ravel()], axis=1)
        _, node = cKDTree(self.middle_px).query(cells)
        apart = cells - self.middle_px[node]
        along = self._along()[node]
        across = (along[:, 0] * apart[:, 1] - along[:, 1] * apart[:, 0]).reshape(x.shape)
        far = np.linalg.norm(apart, axis=1).reshape(x.shape)
        is_beyond = np.isin(node, (0, len(self.middle_px) - 1)).reshape(x.shape)
        distance = np.where(is_beyond, far, np.abs(across))
        radius = self.radius_px[node].reshape(x.shape)
        place = (node / (len(self.middle_px) - 1)).reshape(x.shape)
        cover = np.clip((radius - distance) * _FINE + 0.5, 0.0, 1.0)
        behind = self.behind(x, y, across)
        grey = behind + cover * (self.light(np.clip(across / radius, -1.0, 1.0), place) - behind)
        fine = cv2.GaussianBlur(grey, (0, 0), self.blur_px * _FINE, borderType=cv2.BORDER_REPLICATE)
        height, width = self.shape
        whole = fine.reshape(height, _FINE, width, _FINE).mean(axis=(1, 3))
        return np.clip(np.round(whole + self.noise * rng.standard_normal(self.shape)), 0.0, 255.0)

    def _along(self) -> np.ndarray:
        along = np.gradient(self.middle_px, axis=0)
        return along / np.linalg.norm(along, axis=1, keepdims=True)

    def offsets_px(self, points_px: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Return by how much points (n, 2) lie beside the middle along their normals (n, 2), px."""
        _, node = cKDTree(self.middle_px).query(points_px)
        return np.sum((points_px - self.middle_px[node]) * normal, axis=1)


def bow(width_px: float, shape: tuple[int, int] = (150, 300), ends_px: float = 1.0) -> dict:
    """Return middle and half-widths of a bowed object; ends_px: how many times as wide at its end."""
    x = np.linspace(25.0, shape[1] - 25.0, 6000)
    middle = 0.5 * shape[0] + 0.16 * (x - 0.5 * shape[1]) + 20.0 * np.sin((x - 40.0) / 75.0)
    radius = 0.5 * width_px * np.linspace(1.0, ends_px, len(x))
    return {"middle_px": np.stack([x, middle], axis=1), "radius_px": radius, "shape": shape}
