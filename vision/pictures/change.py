"""Where a picture differs from the one without rods, and with what confidence."""

import numpy as np
from scipy.ndimage import uniform_filter

from vision.geometry.robust import robust_sigma
from vision.pictures.pixel_noise import Noise

# [px] Every second pixel: a coarse search needs no more. Stated.
HALF = 2
# [sigmas] A difference up to here is no change. By 4.5 a ring's slope moves by 0.1 sigma, by 2 the
# ring loses its truth. Study: thresholds.py pictures.change _NOISE_SIGMAS … --sessions FOLDER.
_NOISE_SIGMAS = 3.0
# [sigmas] By so much more it is a certain one. 4 to 9 move nothing on the fixtures. Study:
# thresholds.py pictures.change _SURE_SIGMAS ….
_SURE_SIGMAS = 6.0


def change_confidence(grey: np.ndarray, background: np.ndarray, noise: Noise) -> np.ndarray:
    """Return the confidence, from 0 to 1, that each pixel (h, w) differs from the background.

    Both pictures are given at every HALF-th pixel, and smoothed over 3 × 3 of them. The outermost
    pixels are 0. The scale is the median of the differences themselves: most of the picture has not
    changed, and a picture of the background may be noisier than the frames.
    """
    sigma = noise.sigma(0.5 * (grey + background))
    difference = uniform_filter(grey - background, 3) / sigma
    z = np.abs(difference) / max(robust_sigma(difference), 1e-6)
    confidence = np.clip((z - _NOISE_SIGMAS) / _SURE_SIGMAS, 0.0, 1.0)
    return np.pad(confidence[1:-1, 1:-1], 1)
