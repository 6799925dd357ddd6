"""The width of a distribution: by deviations of which some are outliers, or by its density."""

import numpy as np

# [1] Median of the size of a standard normal deviate. Derived.
_MEDIAN = 0.6745


def robust_sigma(deviations: np.ndarray) -> float:
    """Return the standard deviation of the normal distribution whose deviations have this median
    size (MAD).
    """
    return float(np.median(np.abs(deviations))) / _MEDIAN


def mean_and_sigma(values: np.ndarray, density: np.ndarray) -> tuple[float, float]:
    """Return mean and standard deviation of a distribution whose density (n,), up to a factor, is
    known at evenly spaced values (n,).
    """
    mean = float(np.average(values, weights=density))
    return mean, float(np.sqrt(np.average((values - mean) ** 2, weights=density)))
