"""Means over groups of values."""

import numpy as np


def group_means(group: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the mean (k, …) of each group's values (n, …); group (n,): 0 to k - 1, none of them empty.

    >>> group_means(np.array([0, 1, 1]), np.array([3.0, 4.0, 8.0]))
    array([3., 6.])
    """
    count = np.bincount(group)
    total = np.zeros((len(count), *values.shape[1:]))
    np.add.at(total, group, values)
    return (total.T / count).T
