"""Where a homography maps places, and how fast it does."""

import numpy as np


def map_places(H: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what a homography maps places (n, 2) to, (n, 2), and the denominators (n,) of that."""
    mapped = np.column_stack([places, np.ones(len(places))]) @ H.T
    return mapped[:, :2] / mapped[:, 2:], mapped[:, 2]


def slopes_of(H: np.ndarray, mapped: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Return the derivatives (n, 2, 2) of mapped places (n, 2) by the places; depth (n,): their
    denominators.
    """
    return (H[:2, :2] - mapped[:, :, None] * H[2, :2]) / depth[:, None, None]
