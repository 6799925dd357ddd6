"""Lens blur, vignetting, noise and grey levels: from brightness to what a camera writes."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sensor:
    """Noise in grey levels of an 8-bit scale: `read` of every pixel, `shot` of one level, `grain` in parts of the
    level.

    `vignetting`: light lost in the picture's corner; `bits` 8, 12 or 16.
    """

    blur_px: float
    vignetting: float
    read: float
    shot: float
    grain: float
    bits: int = 8

    def exposed(self, brightness: np.ndarray, rng: np.random.Generator | None) -> np.ndarray:
        """Grey levels (uint8 or uint16) of a picture in parts of full scale; without `rng` there is no noise."""
        level = brightness * self._falloff(brightness.shape) * np.float32(255)
        if rng is not None:
            spread = np.sqrt(
                self.read**2 + self.shot**2 * np.abs(level) + (self.grain * level) ** 2
            )
            level += spread.astype(np.float32) * rng.standard_normal(level.shape, np.float32)
        top = 2**self.bits - 1
        return np.clip(np.rint(level * np.float32(top / 255)), 0, top).astype(
            np.uint8 if self.bits == 8 else np.uint16
        )

    def _falloff(self, shape):
        rows, columns = (np.linspace(-1, 1, n, dtype=np.float32) for n in shape)
        return 1 - np.float32(self.vignetting / 2) * np.add.outer(rows**2, columns**2)
