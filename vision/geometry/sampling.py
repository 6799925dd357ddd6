"""Evenly spread choices: some of a sequence, and all points of a grid."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

Item = TypeVar("Item")


def spread(items: Sequence[Item], most: int) -> list[Item]:
    """Return at most so many of the items, spread evenly from the first to the last."""
    if not len(items):
        return []
    places = np.linspace(0, len(items) - 1, most).round().astype(int)
    return [items[k] for k in np.unique(places).tolist()]


def grid_points(*values: Sequence[float] | np.ndarray) -> np.ndarray:
    """Return all combinations (n, k) of k lists of values; the last list's change fastest."""
    return np.stack(np.meshgrid(*values, indexing="ij"), axis=-1).reshape(-1, len(values))
