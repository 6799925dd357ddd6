"""How noisy a pixel is at its grey level, measured on pictures of one scene."""

from dataclasses import dataclass

import numpy as np

from vision.geometry.robust import robust_sigma

# [classes] Of grey levels, of whose medians a line is made: enough for one. Stated.
_CLASSES = 12
# [grey levels²] That of rounding is 1/12. Derived.
_LEAST_VARIANCE = 0.1


@dataclass(frozen=True)
class Noise:
    """Variance of a pixel at grey level g: floor + gain · g (grey levels squared)."""

    floor: float
    gain: float

    def times(self, share: float) -> "Noise":
        """Noise of so many times the variance."""
        return Noise(self.floor * share, self.gain * share)

    def sigma(self, grey: np.ndarray) -> np.ndarray:
        """Standard deviation at the grey level, never under a third of a level (rounding)."""
        return np.sqrt(np.maximum(self.floor + self.gain * np.maximum(grey, 0.0), 1.0 / 12.0))


def measure_noise(first: np.ndarray, second: np.ndarray) -> Noise:
    """Noise from two pictures of the same scene: median absolute difference in classes of equal grey.

    Medians leave out what moved between the two. Every third pixel of every third row is plenty.
    """
    first, second = first[::3, ::3], second[::3, ::3]
    mean = 0.5 * (first.astype(float) + second)
    return noise_by_level(mean, np.abs(first.astype(float) - second) / np.sqrt(2.0))


def noise_by_level(level: np.ndarray, deviation: np.ndarray) -> Noise:
    """Noise from absolute deviations at grey levels (both of any one shape), by medians in classes of equal grey."""
    edges = np.unique(np.quantile(level, np.linspace(0, 1, _CLASSES + 1)))
    classes = np.digitize(level, edges[1:-1])
    rows = [
        (
            np.median(level[classes == k]),
            robust_sigma(deviation[classes == k]) ** 2,
            np.sum(classes == k),
        )
        for k in range(max(len(edges) - 1, 1))
        if np.any(classes == k)
    ]
    middle, variance, count = np.array(rows).T
    if len(middle) > 1 and np.ptp(middle) >= 1.0:
        gain, floor = np.polyfit(
            middle, variance, 1, w=np.sqrt(count) / np.maximum(variance, _LEAST_VARIANCE)
        )
        if gain > 0:
            return Noise(max(float(floor), _LEAST_VARIANCE), float(gain))
    return Noise(max(float(np.average(variance, weights=count)), _LEAST_VARIANCE), 0.0)
