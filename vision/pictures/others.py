"""Rods in the pictures that are not the one looked for: where one of them may be, nothing is learnt of this one."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np

from vision.pictures.pyramid import shrunk_px

# [px] Beside another whisker's wire no pixel counts: the last of the first looks is off by 2 px
# at most (six wires of a 2 × 3 array), and three of a lens blur of a pixel. With 4 or 9 a base
# line moves by less than its sigma. Study: arrays_seen.py.
BESIDE_ROD_PX = 5.0
# [parts of a pixel, bits] A layout: how OpenCV takes fractions of a pixel. Derived.
_PARTS, _PARTS_AS_SHIFT = 16, 4


@dataclass(frozen=True, eq=False)
class RodLines:
    """A rod in some of a camera's frames (f,): the middle (f, m, 2) of its picture and half its width (f,), px."""

    frames: np.ndarray
    middle_px: np.ndarray
    half_px: np.ndarray

    def shrunk(self, scale: int) -> "RodLines":
        """The same in shrunk pictures."""
        if scale == 1:
            return self
        return replace(
            self, middle_px=shrunk_px(self.middle_px, scale), half_px=self.half_px / scale
        )

    def within(self, frame: int) -> np.ndarray:
        """Which rows (f,) are of a frame."""
        return self.frames == frame


Others = Mapping[str, RodLines]  # by name


def covered(others: Others, frame: int, shape: tuple[int, int]) -> np.ndarray | None:
    """Pixels (h, w), bool, of a frame that show another rod or lie so near one that they may; None without any."""
    if not others:
        return None
    mask = np.zeros(shape, dtype=np.uint8)
    for lines in others.values():
        there = lines.within(frame)
        for middle, half in zip(lines.middle_px[there], lines.half_px[there]):
            if np.all(np.isfinite(middle)):
                nodes = np.round(middle * _PARTS).astype(np.int32)[:, None]
                wide = int(np.ceil(2.0 * (half + BESIDE_ROD_PX)))
                cv2.polylines(mask, [nodes], False, 1, thickness=wide, shift=_PARTS_AS_SHIFT)
    return mask.astype(bool)
