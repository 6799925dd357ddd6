"""A part of a camera's picture as the picture of a camera of its own.

Seen in a mirror, the world is reflected, and no camera with a right-handed frame sees it so. Flipped left to right,
the part is what a camera behind the mirror sees: its pose is the camera's, reflected, its lens the camera's
with the principal point and p2 flipped, too. Both cameras are one lens.
"""

from dataclasses import dataclass

import numpy as np

from vision.geometry.lens import LENS_TERMS

# [1] Derivative of the lens terms by those of the picture before it was flipped left to right. Derived.
_FLIP = np.array([-1.0 if term in ("cx", "p2") else 1.0 for term in LENS_TERMS])
# [column] A layout, no threshold.
_CENTRE = slice(2, 4)


@dataclass(frozen=True)
class Crop:
    """A part of a picture: `width` x `height` px from (left, top), flipped left to right where mirrored.

    of: name of the camera whose picture it is. whole_px: (width, height) of that picture.
    """

    of: str
    whole_px: tuple[int, int]
    left: int
    top: int
    width: int
    height: int
    mirrored: bool = False

    @classmethod
    def whole(cls, name: str, size_px: tuple[int, int]) -> "Crop":
        """Return the whole picture of a camera."""
        return cls(name, size_px, 0, 0, *size_px)

    @property
    def size_px(self) -> tuple[int, int]:
        """Return (width, height)."""
        return self.width, self.height

    def cut(self, grey: np.ndarray) -> np.ndarray:
        """Return this part (height, width) of a whole picture, of size `whole_px`."""
        part = grey[self.top : self.top + self.height, self.left : self.left + self.width]
        return np.ascontiguousarray(part[:, ::-1] if self.mirrored else part)

    def in_part(self, px: np.ndarray) -> np.ndarray:
        """Return points (n, 2) of the whole picture as this part has them."""
        u, v = px.T
        if self.mirrored:
            u = self.whole_px[0] - 1.0 - u
        return np.stack([u, v], axis=1) - self.offset_px

    @property
    def offset_px(self) -> np.ndarray:
        """Return where (0, 0) lies (2,) in the whole picture, flipped as a whole where mirrored."""
        right = self.whole_px[0] - self.left - self.width
        return np.array([right if self.mirrored else self.left, self.top], dtype=float)

    @property
    def lens_signs(self) -> np.ndarray:
        """Return the derivative (9,) of each lens term by that of the whole picture."""
        return _FLIP if self.mirrored else np.ones(len(LENS_TERMS))

    def lens_of(self, whole: np.ndarray) -> np.ndarray:
        """Return the lens (9,) of this part by that of the whole picture."""
        lens = self.lens_signs * whole
        if self.mirrored:
            lens[2] += self.whole_px[0] - 1
        lens[_CENTRE] -= self.offset_px
        return lens
