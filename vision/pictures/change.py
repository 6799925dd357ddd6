"""Where a picture differs from the one without rods, and how surely."""

import numpy as np
from scipy.ndimage import uniform_filter

from vision.geometry.robust import robust_sigma
from vision.pictures.pixel_noise import Noise

# [px] Every second pixel: a coarse look needs no more. Stated.
HALF = 2
# [sigmas] A difference up to here is no change, and by so much more it is a sure one. Set by eye.
_NOISE_SIGMAS, _SURE_SIGMAS = 3.0, 6.0


def changed(grey: np.ndarray, background: np.ndarray, noise: Noise) -> np.ndarray:
    """How surely each pixel (h, w) differs from the background, from 0 to 1, smoothed over 3 × 3 pixels.

    Both pictures are given at every HALF-th pixel. The outermost pixels are 0.

    The scale is the median of the differences themselves: most of the picture has not changed, and a picture of
    the background may be noisier than the frames.
    """
    difference = uniform_filter(grey - background, 3) / noise.sigma(0.5 * (grey + background))
    z = np.abs(difference) / max(robust_sigma(difference), 1e-6)
    return np.pad(np.clip((z - _NOISE_SIGMAS) / _SURE_SIGMAS, 0.0, 1.0)[1:-1, 1:-1], 1)
