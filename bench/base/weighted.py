"""Means of values weighted by their sigmas: of values with a cause in common, and of independent ones."""

import numpy as np


def weighted_mean(values: np.ndarray, sigmas: np.ndarray) -> tuple[float, float]:
    """Return the mean of values (n,), weighted by their sigmas (n,), and its standard deviation.

    How much of each sigma is common to all is not known: so it is not divided by their number.
    Where the values scatter by more, the scatter of the mean counts.
    """
    weights, mean, squares = _weighted(values, sigmas)
    return mean, float(max(weights @ sigmas, np.sqrt(squares)))


def independent_mean(values: np.ndarray, sigmas: np.ndarray) -> tuple[float, float]:
    """Return the mean of two or more independent values (n,), and its standard deviation.

    That is by their sigmas (n,), or by their scatter where that is more.
    """
    _, mean, squares = _weighted(values, sigmas)
    count = len(values)
    scatter = np.sqrt(count / (count - 1) * squares)
    return mean, float(max(scatter, np.sum(sigmas**-2.0) ** -0.5))


def _weighted(values: np.ndarray, sigmas: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Return the weights (n,), the mean, and the sum of the squared weighted residuals."""
    precisions = sigmas**-2.0
    weights = precisions / np.sum(precisions)
    mean = float(weights @ values)
    return weights, mean, np.sum(weights**2 * (values - mean) ** 2)
