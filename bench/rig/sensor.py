"""Vignetting, noise and grey levels: from brightness to what a camera writes."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sensor:
    """A camera's lens blur, vignetting and noise.

    blur_px: sigma of the lens blur. vignetting: share of the light that is lost in the picture's
    corner. Noise in grey levels of an 8-bit scale: read of every pixel, shot of one level; grain as
    a share of the level. bits: 8, 12 or 16 of the pictures.
    """

    blur_px: float
    vignetting: float
    read: float
    shot: float
    grain: float
    bits: int = 8

    def expose(self, brightness: np.ndarray, rng: np.random.Generator | None) -> np.ndarray:
        """Return the grey levels (uint8 or uint16) of a picture in parts of full scale.

        Without rng there is no noise.
        """
        level = brightness * self._falloff(brightness.shape) * np.float32(255)
        if rng is not None:
            shot_variance = self.shot**2 * np.abs(level)
            sigma = np.sqrt(self.read**2 + shot_variance + (self.grain * level) ** 2)
            level += sigma.astype(np.float32) * rng.standard_normal(level.shape, np.float32)
        full_scale = 2**self.bits - 1
        grey = np.clip(np.rint(level * np.float32(full_scale / 255)), 0, full_scale)
        return grey.astype(np.uint8 if self.bits == 8 else np.uint16)

    def _falloff(self, shape):
        """Return the share of the light that arrives in each pixel (rows, columns)."""
        rows, columns = (np.linspace(-1, 1, count, dtype=np.float32) for count in shape)
        return 1 - np.float32(self.vignetting / 2) * np.add.outer(rows**2, columns**2)
