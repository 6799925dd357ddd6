"""Rods in the pictures besides the one that is measured: pixels where they may be are masked."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np

from vision.pictures.pyramid import shrunk_px

# [px] Near another whisker's wire no pixel counts: the last of the coarse passes is off by 2 px
# at most (six wires of a 2 × 3 array), and three of a lens blur of a pixel. With 4 or 9 a base
# line moves by less than its sigma. Study: arrays_seen.py.
BESIDE_ROD_PX = 5.0
# [bits] A layout: how OpenCV takes fractions of a pixel. Derived.
_FRACTION_BITS = 4


@dataclass(frozen=True, eq=False)
class RodLines:
    """A rod in some of a camera's frames.

    frames (f,): their indices. middle_px (f, m, 2): the middle of its picture. half_px (f,): half
    its width.
    """

    frames: np.ndarray
    middle_px: np.ndarray
    half_px: np.ndarray

    def shrunk(self, scale: int) -> "RodLines":
        """Return the rod in pictures shrunk by `scale`."""
        if scale == 1:
            return self
        return replace(
            self, middle_px=shrunk_px(self.middle_px, scale), half_px=self.half_px / scale
        )

    def within(self, frame: int) -> np.ndarray:
        """Return which rows (f,) are of a frame."""
        return self.frames == frame


Others = Mapping[str, RodLines]  # by name


def mask_rods(others: Others, frame: int, shape: tuple[int, int]) -> np.ndarray | None:
    """Return which pixels (h, w) of a frame show another rod or lie so near one that they may.

    None where there is no other rod.
    """
    if not others:
        return None
    mask = np.zeros(shape, dtype=np.uint8)
    for lines in others.values():
        rows = lines.within(frame)
        for middle_px, half_px in zip(lines.middle_px[rows], lines.half_px[rows]):
            if np.all(np.isfinite(middle_px)):
                nodes = np.round(middle_px * 2**_FRACTION_BITS).astype(np.int32)
                width = int(np.ceil(2.0 * (half_px + BESIDE_ROD_PX)))
                cv2.polylines(mask, [nodes], False, 1, thickness=width, shift=_FRACTION_BITS)
    return mask.astype(bool)
