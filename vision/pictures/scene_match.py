"""Whether a picture shows the still scene that another shows: shifted, mirrored, another camera's, brighter, or blank.

Phase correlation: of two pictures of one scene all spatial frequencies agree on one shift, however the light and what
moved differ. Its peak over the surface's own scatter is some 60 to 300 where a scene has texture, and 5 to 11 for
pictures of different scenes (the largest of a million normal deviates is 5).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy import fft

from vision.geometry.robust import robust_sigma
from vision.pictures.change import HALF

# [1] Two pictures show one scene: peak of the phase correlation over its scatter, twice the
# largest of 150 pairs of different scenes. Study: faults.py.
# peak over scatter: twice the largest of 150 pairs of pictures that show different scenes
SEEN = 20.0
# [px] Between these blurs lie edges and texture, neither noise nor shading. Set by eye.
_FINE_PX, _COARSE_PX = 1.0, 4.0
# [1] One bright edge counts no more. Set by eye.
_MOST_SIGMAS = 8.0
# [grey levels] Less between the darkest and the brightest hundredth is no picture. Stated.
# grey levels between the darkest and the brightest hundredth: less is no picture
_LEAST_RANGE = 3.0
# [px] Plenty for one number. Derived.
_EVERY = 4
# [1] Of the median ratio: noise of a dark pixel, less than what a moving rod changes. Set by eye.
_STILL = 0.2
# [grey levels, of full scale] Neither black level nor saturation tells of exposure. Stated.
_LEAST_GREY, _MOST_SHARE = 16.0, 0.6


@dataclass(frozen=True)
class Likeness:
    """How clearly two pictures show one scene (peak over scatter), and by how much the first is shifted, px (x, y)."""

    peak: float
    shift_px: tuple[float, float]

    @property
    def seen(self) -> bool:
        """Whether it is one scene."""
        return self.peak > SEEN

    @property
    def moved_px(self) -> float:
        """Length of the shift; less than HALF px is not told from none."""
        return float(np.hypot(*self.shift_px))


def is_blank(picture: np.ndarray) -> bool:
    """Whether a picture (h, w) shows nothing at all: all of one grey."""
    low, high = np.percentile(picture[::_EVERY, ::_EVERY], [1.0, 99.0])
    return bool(high - low < _LEAST_RANGE)


def texture(picture: np.ndarray) -> np.ndarray:
    """What `likeness` compares: edges and texture of a picture (h, w) at half its resolution, none beyond measure."""
    grey = np.ascontiguousarray(picture[::HALF, ::HALF], dtype=np.float32)
    fine = cv2.GaussianBlur(grey, (0, 0), _FINE_PX) - cv2.GaussianBlur(grey, (0, 0), _COARSE_PX)
    scale = robust_sigma(fine)
    window = cv2.createHanningWindow(fine.shape[::-1], cv2.CV_32F)
    return window * np.clip(fine / max(scale, 1e-3), -_MOST_SIGMAS, _MOST_SIGMAS)


def likeness(first: np.ndarray, second: np.ndarray) -> Likeness:
    """Of two textures of one shape: how clearly `first` is `second`, and by how much it is shifted."""
    cross = fft.rfft2(first) * np.conj(fft.rfft2(second))
    size = np.abs(cross)
    surface = fft.irfft2(cross / np.maximum(size, 1e-6 * max(float(size.max()), 1e-6)), first.shape)
    place = np.unravel_index(int(np.argmax(surface)), surface.shape)
    scatter = max(float(surface.std()), 1e-12)
    y, x = (HALF * (k if k <= n // 2 else k - n) for k, n in zip(place, surface.shape))
    return Likeness(float(surface[place]) / scatter, (float(x), float(y)))


def _gain(grey: np.ndarray, first: np.ndarray) -> float:
    """Of still pixels (n,) over the same of the first picture: sums of those near the median, which whole grey levels
    would make coarse."""
    ratio = grey / first
    middle = np.median(ratio)
    still = np.abs(ratio - middle) < _STILL * middle
    return float(grey[still].sum() / first[still].sum()) if still.any() else 0.0


def exposures(pictures: Sequence[np.ndarray], full_scale: float) -> np.ndarray:
    """How much brighter each picture (h, w) is than they are in the median, (n,): what moves covers few pixels."""
    some = [np.asarray(picture[::_EVERY, ::_EVERY], dtype=float) for picture in pictures]
    use = (some[0] > _LEAST_GREY) & (some[0] < _MOST_SHARE * full_scale)
    if not use.any():
        return np.ones(len(some))
    gains = np.array([_gain(grey[use], some[0][use]) for grey in some])
    middle = float(np.median(gains))
    return gains / middle if middle > 0 else np.ones(len(some))
