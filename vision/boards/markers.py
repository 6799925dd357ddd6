"""Markers of a dictionary in a picture, as OpenCV finds them: their corners to about a pixel."""

import cv2
import numpy as np


def marker_dictionary(name: str) -> cv2.aruco.Dictionary:
    """Return OpenCV's dictionary of markers of a name, such as DICT_5X5_100."""
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


def detect_markers(
    picture: np.ndarray, dictionary: str, parameters: cv2.aruco.DetectorParameters | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers (n,) of a dictionary's markers in a picture of 8 bits, and their corners
    (n, 4, 2) px in OpenCV's order.

    parameters: of OpenCV's detector, where they are not its own.
    """
    chosen = parameters or cv2.aruco.DetectorParameters()
    detector = cv2.aruco.ArucoDetector(marker_dictionary(dictionary), chosen)
    outlines, numbers, _ = detector.detectMarkers(picture)
    if numbers is None:
        return np.empty(0, dtype=int), np.empty((0, 4, 2))
    return numbers.ravel().astype(int), np.array(outlines, dtype=float).reshape(-1, 4, 2)
