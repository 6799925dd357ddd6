"""The width of a normal distribution, from deviations of which some are outliers."""

import numpy as np

# [1] Median of the size of a standard normal deviate. Derived.
_MEDIAN = 0.6745


def robust_sigma(deviations: np.ndarray) -> float:
    """Return the standard deviation of the normal distribution whose deviations have this median
    size (MAD).
    """
    return float(np.median(np.abs(deviations))) / _MEDIAN
