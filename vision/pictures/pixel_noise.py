"""The noise of a pixel at its grey level, measured on pictures of one scene."""

from dataclasses import dataclass

import numpy as np

from vision.geometry.robust import robust_sigma

# [classes] Of grey levels, of whose medians a line is made: enough for one. Stated.
_CLASSES = 12
# [grey levels²] That of rounding is 1/12. Derived.
_LEAST_VARIANCE = 0.1


@dataclass(frozen=True)
class Noise:
    """The variance of a pixel at grey level g: floor + gain · g, grey levels squared."""

    floor: float
    gain: float

    def times(self, share: float) -> "Noise":
        """Return noise of `share` times the variance."""
        return Noise(self.floor * share, self.gain * share)

    def sigma(self, grey: np.ndarray) -> np.ndarray:
        """Return the standard deviation at grey levels, a third of a level at least (rounding)."""
        return np.sqrt(np.maximum(self.floor + self.gain * np.maximum(grey, 0.0), 1.0 / 12.0))


def measure_noise(first: np.ndarray, second: np.ndarray) -> Noise:
    """Measure the noise by two pictures (h, w) of the same scene.

    A line is fitted to the median absolute differences in classes of equal grey; medians leave out
    what moved between the two. Every third pixel of every third row is plenty.
    """
    first = first[::3, ::3].astype(float)
    second = second[::3, ::3].astype(float)
    level = 0.5 * (first + second)
    deviation = np.abs(first - second) / np.sqrt(2.0)
    middle, variance, count = _medians_by_level(level, deviation)
    if np.ptp(middle) >= 1.0:
        weight = np.sqrt(count) / np.maximum(variance, _LEAST_VARIANCE)
        gain, floor = np.polyfit(middle, variance, 1, w=weight)
        if gain > 0:
            return Noise(max(float(floor), _LEAST_VARIANCE), float(gain))
    return Noise(max(float(np.average(variance, weights=count)), _LEAST_VARIANCE), 0.0)


def _medians_by_level(level: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    """Return median level, variance of the deviation and number of pixels by class of level, (3,
    classes).
    """
    order = np.argsort(level, axis=None)
    level = level.ravel()[order]
    deviation = deviation.ravel()[order]
    rank = np.linspace(0, len(level) - 1, _CLASSES + 1)
    edges = np.unique(np.interp(rank, np.arange(len(level)), level))
    first = np.searchsorted(level, edges[1:-1])
    rows = []
    for levels, deviations in zip(np.split(level, first), np.split(deviation, first)):
        if len(levels):
            variance = robust_sigma(deviations) ** 2
            rows.append((np.median(levels), variance, len(levels)))
    return np.array(rows).T
