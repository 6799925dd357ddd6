"""Evenly spread choices: some of a sequence, and all points of a grid."""

from collections.abc import Sequence

import numpy as np


def spread_indices(length: int, count: int) -> list[int]:
    """Return so many indices at most, spread evenly over a sequence from its first to its last."""
    return np.unique(np.linspace(0, length - 1, count).round().astype(int)).tolist()


def grid_points(*values: Sequence[float] | np.ndarray) -> np.ndarray:
    """Return all combinations (n, k) of k lists of values; the last list's change fastest."""
    return np.stack(np.meshgrid(*values, indexing="ij"), axis=-1).reshape(-1, len(values))
