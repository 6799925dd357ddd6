"""A rectangle of a camera's picture, sampled finer than its pixels: what is drawn on."""

from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np

from bench.rig.pinhole import PinholeCamera

_LEAST_BLUR = 0.2  # samples: a blur of less changes nothing


@dataclass(frozen=True, eq=False)
class Window:
    """Pixels from left, top up to right, bottom (exclusive) of a camera's picture.

    fine: samples to a pixel each way. soft_px: sigma of the blur of every drawn edge.
    """

    camera: PinholeCamera
    left: int
    top: int
    right: int
    bottom: int
    fine: int
    soft_px: float

    @classmethod
    def whole(cls, camera: PinholeCamera, fine: int, soft_px: float, margin: int = 0) -> "Window":
        """Return the window of the whole picture and a margin of pixels round it."""
        width, height = camera.size_px
        return cls(camera, -margin, -margin, width + margin, height + margin, fine, soft_px)

    def crop(self, px: np.ndarray, margin: float) -> "Window | None":
        """Return the part of this window that holds points (n, 2) px and a margin round them.

        None where nothing of it is in this window.
        """
        low = np.floor(px.min(0) - margin).astype(int)
        high = np.ceil(px.max(0) + margin).astype(int) + 1
        left = max(self.left, low[0])
        top = max(self.top, low[1])
        right = min(self.right, high[0])
        bottom = min(self.bottom, high[1])
        if left >= right or top >= bottom:
            return None
        return replace(self, left=left, top=top, right=right, bottom=bottom)

    def index_in(
        self, other: "Window", index: tuple[np.ndarray, np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Convert rows and columns of this window's samples to those of a window that holds it."""
        rows, columns = self.slices_in(other)
        return index[0] + rows.start, index[1] + columns.start

    def slices_in(self, other: "Window") -> tuple[slice, slice]:
        """Return the rows and columns of this window in the samples of a window that holds it."""
        rows, columns = self.shape
        top = (self.top - other.top) * self.fine
        left = (self.left - other.left) * self.fine
        return slice(top, top + rows), slice(left, left + columns)

    @property
    def shape(self) -> tuple[int, int]:
        """Return the numbers of rows and columns of samples."""
        return (self.bottom - self.top) * self.fine, (self.right - self.left) * self.fine

    @cached_property
    def u_px(self) -> np.ndarray:
        """Return the columns' positions in the picture; pixel centres are whole numbers."""
        return self.left + (np.arange(self.shape[1]) + 0.5) / self.fine - 0.5

    @cached_property
    def v_px(self) -> np.ndarray:
        """Return the rows' positions in the picture; pixel centres are whole numbers."""
        return self.top + (np.arange(self.shape[0]) + 0.5) / self.fine - 0.5

    def rays(self) -> tuple[np.ndarray, np.ndarray]:
        """Return x/z and y/z (rows, columns) of the samples' rays in the camera's frame."""
        return self.camera.rays(self.u_px, self.v_px)

    def blur_to_pixels(self, radiance: np.ndarray, blur_px: float) -> np.ndarray:
        """Blur drawn samples to a sigma of blur_px and average them over the pixels' areas.

        Edges are drawn with soft_px of that blur already.
        """
        blur = np.sqrt(max(blur_px**2 - self.soft_px**2, 0.0)) * self.fine  # samples
        if blur > _LEAST_BLUR:
            radiance = cv2.GaussianBlur(radiance, (0, 0), blur)
        size = self.right - self.left, self.bottom - self.top
        return cv2.resize(radiance, size, interpolation=cv2.INTER_AREA)
