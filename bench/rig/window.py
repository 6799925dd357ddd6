"""A rectangle of a camera's picture, sampled finer than its pixels: what is drawn on."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from bench.rig.pinhole import Camera


@dataclass(frozen=True, eq=False)
class Window:
    """Pixels first…last (exclusive) of a camera, `fine` samples to a pixel each way; `soft_px` blurs every drawn
    edge.
    """

    camera: Camera
    left: int
    top: int
    right: int
    bottom: int
    fine: int
    soft_px: float

    @classmethod
    def whole(cls, camera: Camera, fine: int, soft_px: float, margin: int = 0) -> "Window":
        """The whole picture and a margin round it."""
        width, height = camera.size_px
        return cls(camera, -margin, -margin, width + margin, height + margin, fine, soft_px)

    def around(self, px: np.ndarray, margin: float) -> "Window | None":
        """The part of this window that holds points (n, 2) and a margin; None where nothing is left."""
        low, high = (
            np.floor(px.min(0) - margin).astype(int),
            np.ceil(px.max(0) + margin).astype(int) + 1,
        )
        left, top = max(self.left, low[0]), max(self.top, low[1])
        right, bottom = min(self.right, high[0]), min(self.bottom, high[1])
        if left >= right or top >= bottom:
            return None
        return Window(self.camera, left, top, right, bottom, self.fine, self.soft_px)

    def within(self, other: "Window") -> tuple[slice, slice]:
        """Rows and columns of this window in the samples of a window that holds it."""
        return (
            slice((self.top - other.top) * self.fine, (self.bottom - other.top) * self.fine),
            slice((self.left - other.left) * self.fine, (self.right - other.left) * self.fine),
        )

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of samples."""
        return (self.bottom - self.top) * self.fine, (self.right - self.left) * self.fine

    @cached_property
    def u_px(self) -> np.ndarray:
        """Columns' positions in the picture; pixel centres are whole numbers."""
        return self.left + (np.arange(self.shape[1]) + 0.5) / self.fine - 0.5

    @cached_property
    def v_px(self) -> np.ndarray:
        """Rows' positions in the picture."""
        return self.top + (np.arange(self.shape[0]) + 0.5) / self.fine - 0.5

    def rays(self) -> tuple[np.ndarray, np.ndarray]:
        """Directions x/z and y/z of the samples' sights."""
        return self.camera.rays(self.u_px, self.v_px)

    def seen(self, radiance: np.ndarray, blur_px: float) -> np.ndarray:
        """The lens' blur (sigma, of which `soft_px` is there already) and the pixels' area applied to drawn
        samples.
        """
        left = np.sqrt(max(blur_px**2 - self.soft_px**2, 0.0)) * self.fine
        blurred = cv2.GaussianBlur(radiance, (0, 0), left) if left > 0.2 else radiance
        rows, columns = self.shape
        return cv2.resize(
            blurred, (columns // self.fine, rows // self.fine), interpolation=cv2.INTER_AREA
        )
