"""The mean of values that have a cause in common."""

import numpy as np


def weighted_mean(values: np.ndarray, sigmas: np.ndarray) -> tuple[float, float]:
    """Return the mean of values (n,), weighted by their sigmas (n,), and its standard deviation.

    How much of each sigma is common to all is not known: so it is not divided by their number.
    Where the values scatter by more, the scatter of the mean counts.
    """
    weights = sigmas**-2.0 / np.sum(sigmas**-2.0)
    mean = float(weights @ values)
    scatter = np.sqrt(np.sum(weights**2 * (values - mean) ** 2))
    return mean, float(max(weights @ sigmas, scatter))
