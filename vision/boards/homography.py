"""Homographies: fitted to points of a plane, the places that they map to, and the derivatives of these."""

import cv2
import numpy as np


def fit_homography(places: np.ndarray, mapped: np.ndarray) -> np.ndarray | None:
    """Return the homography (3, 3) of least squares that maps places (n, 2) to others (n, 2); None
    where they determine none.
    """
    return cv2.findHomography(places, mapped, 0)[0]


def map_places(H: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what a homography maps places (n, 2) to, (n, 2), and the denominators (n,) of that."""
    mapped = np.column_stack([places, np.ones(len(places))]) @ H.T
    return mapped[:, :2] / mapped[:, 2:], mapped[:, 2]


def slopes_of(H: np.ndarray, mapped: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Return the derivatives (n, 2, 2) of mapped places (n, 2) by the places; depth (n,): their
    denominators.
    """
    return (H[:2, :2] - mapped[:, :, None] * H[2, :2]) / depth[:, None, None]
