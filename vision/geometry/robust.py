"""How wide a normal distribution is, from deviations of which some are outliers."""

import numpy as np

_MEDIAN = 0.6745  # of |x| of the standard normal distribution


def robust_sigma(deviations: np.ndarray) -> float:
    """Standard deviation of the normal distribution whose deviations have this median size (MAD)."""
    return float(np.median(np.abs(deviations))) / _MEDIAN
