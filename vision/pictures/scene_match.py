"""Whether two pictures show one still scene, and how it is shifted or brighter in one of them.

Phase correlation: of two pictures of one scene all spatial frequencies agree on one shift, however
the light and what moved differ. Its peak over the surface's own scatter is some 60 to 300 where a
scene has texture, and 5 to 11 for pictures of different scenes (the largest of a million normal
deviates is 5).
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
LEAST_PEAK = 20.0
# [px] Blur below which lies noise. At half and twice as much the least peak of three pictures with a
# texture falls from 114 to 59 and 73; other scenes have 12 at most. Study: thresholds.py.
_FINE_PX = 1.0
# [px] Blur beyond which lies shading; edges and texture lie between. At half and twice as much that peak
# falls to 103 and 48. Study: thresholds.py.
_COARSE_PX = 4.0
# [1] One bright edge counts no more. At half and twice as much that peak falls to 100 and 82. Study:
# thresholds.py.
_MOST_SIGMAS = 8.0
# [grey levels] Less between the darkest and the brightest hundredth is no picture. Stated.
_LEAST_RANGE = 3.0
# [px] Plenty for one number. Derived.
_EVERY = 4
# [1] Of the median ratio: noise of a dark pixel, less than what a moving rod changes. Known changes of
# brightness are missed by 0.34 % RMS, with 0.1 too, with 0.4 by 0.39 %. Study: thresholds.py.
_STILL = 0.2
# [grey levels] Black level below does not scale with exposure. Stated.
_LEAST_GREY = 16.0
# [1] Share of full scale above which a brighter picture may be saturated. Stated.
_MOST_SHARE = 0.6


@dataclass(frozen=True)
class Likeness:
    """How clearly two pictures show one scene, and how the first is shifted.

    peak: of the phase correlation, over its scatter. shift_px: (x, y), to HALF px.
    """

    peak: float
    shift_px: tuple[float, float]

    @property
    def is_same_scene(self) -> bool:
        """Return whether both show one scene."""
        return self.peak > LEAST_PEAK

    @property
    def shift_length_px(self) -> float:
        """Return the length of the shift; less than HALF px cannot be distinguished from none."""
        return float(np.hypot(*self.shift_px))


def is_blank(picture: np.ndarray) -> bool:
    """Return whether a picture (h, w) shows nothing at all: all of one grey."""
    low, high = np.percentile(picture[::_EVERY, ::_EVERY], [1.0, 99.0])
    return bool(high - low < _LEAST_RANGE)


def texture(picture: np.ndarray) -> np.ndarray:
    """Extract what `likeness` compares: edges and texture of a picture (h, w) at half resolution.

    They are in units of their own scatter, clipped, and fade out towards the picture's border.
    """
    grey = np.ascontiguousarray(picture[::HALF, ::HALF], dtype=np.float32)
    fine = cv2.GaussianBlur(grey, (0, 0), _FINE_PX)
    band = fine - cv2.GaussianBlur(grey, (0, 0), _COARSE_PX)
    scale = max(robust_sigma(band), 1e-3)
    window = cv2.createHanningWindow(band.shape[::-1], cv2.CV_32F)
    return window * np.clip(band / scale, -_MOST_SIGMAS, _MOST_SIGMAS)


def likeness(first: np.ndarray, second: np.ndarray) -> Likeness:
    """Compare two textures of one shape by phase correlation; the shift is that of the first."""
    cross = fft.rfft2(first) * np.conj(fft.rfft2(second))
    magnitude = np.abs(cross)
    floor = 1e-6 * max(float(magnitude.max()), 1e-6)
    phases = cross / np.maximum(magnitude, floor)  # each frequency counts alike
    surface = fft.irfft2(phases, first.shape)  # (h, w): the correlation at each shift
    row, column = np.unravel_index(int(np.argmax(surface)), surface.shape)
    scatter = max(float(surface.std()), 1e-12)
    peak = float(surface[row, column]) / scatter
    y = HALF * _signed(row, surface.shape[0])
    x = HALF * _signed(column, surface.shape[1])
    return Likeness(peak, (float(x), float(y)))


def _signed(index: int, size: int) -> int:
    """Return the shift that an index of a periodic axis stands for, at most half of `size`."""
    return index if index <= size // 2 else index - size


def exposures(pictures: Sequence[np.ndarray], full_scale: float) -> np.ndarray:
    """Return how much brighter each picture (h, w) is than they are in the median, (n,).

    What moves covers few pixels. All are 1 where the pictures are too dark or too bright to say.
    """
    samples = [picture[::_EVERY, ::_EVERY].astype(float) for picture in pictures]
    first = samples[0]
    usable = (first > _LEAST_GREY) & (first < _MOST_SHARE * full_scale)
    if not usable.any():
        return np.ones(len(samples))
    gains = np.array([_gain(sample[usable], first[usable]) for sample in samples])
    median = float(np.median(gains))
    return gains / median if median > 0 else np.ones(len(samples))


def _gain(grey: np.ndarray, first: np.ndarray) -> float:
    """Return how much brighter pixels (n,) are than those of the first picture.

    It is a ratio of sums over the pixels whose own ratio is near the median, because whole grey
    levels make single ratios coarse.
    """
    ratio = grey / first
    median = np.median(ratio)
    is_still = np.abs(ratio - median) < _STILL * median
    return float(grey[is_still].sum() / first[is_still].sum()) if is_still.any() else 0.0
