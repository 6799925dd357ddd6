"""Markers of the board's dictionary that are not the board's: on the hub, on a clamp.

OpenCV finds a marker to about a pixel; where its corners are follows from the printed pattern as a
whole, laid over the picture by a homography (Evangelidis & Psarakis 2008, `cv2.findTransformECC`).
"""

from dataclasses import dataclass

import cv2
import numpy as np

from vision.boards.corners import to_8_bit
from vision.geometry.board import Board

# [px] Side of a module of the pattern that is laid over the picture. Stated.
_MODULE_PX = 10
# [px] Blur of that pattern, sigma: a fifth of a module, as of a marker in focus. Stated.
_PATTERN_BLUR_PX = 2.0
# [px] Pixels about a marker that are cut out with it: its white rim, and what OpenCV's corners are
# off by. Stated.
_MARGIN_PX = 15
# [1] Correlation of pattern and picture: less is glare, a hidden corner, or no marker. Set by eye;
# 0.93 to 0.97 on steel-sample.
_LEAST_CORRELATION = 0.85
# [1] Rounds of the fit at most, and the gain of correlation at which it ends. Stated.
_CRITERIA = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-7)
# [px] Width of the filter that takes the picture's noise off before its gradient. Stated.
_FILTER_PX = 5


@dataclass(frozen=True, eq=False)
class Marker:
    """A marker in a picture: its number in the dictionary, and its corners px (4, 2) in OpenCV's
    order.
    """

    number: int
    px: np.ndarray


def find_other_markers(grey: np.ndarray, board: Board) -> list[Marker]:
    """Find the markers of the board's dictionary that the board does not use, in a grey picture."""
    picture = to_8_bit(grey)
    if board.inverted:
        picture = 255 - picture
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    outlines, numbers, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(picture)
    found = []
    for outline, number in zip(outlines, () if numbers is None else numbers.ravel()):
        if number < board.marker_count:
            continue
        px = _refine(picture, dictionary, int(number), outline.reshape(4, 2))
        if px is not None:
            found.append(Marker(int(number), px))
    return found


def _refine(
    picture: np.ndarray, dictionary: cv2.aruco.Dictionary, number: int, outline_px: np.ndarray
) -> np.ndarray | None:
    """Return a marker's corners (4, 2), px, by its whole pattern; None where that does not fit."""
    pattern, corners = _pattern(dictionary, number)
    low = np.maximum(np.floor(outline_px.min(axis=0) - _MARGIN_PX).astype(int), 0)
    high = np.ceil(outline_px.max(axis=0)).astype(int) + _MARGIN_PX
    window = picture[low[1] : high[1], low[0] : high[0]].astype(np.float32)
    first = cv2.getPerspectiveTransform(corners, (outline_px - low).astype(np.float32))
    try:
        correlation, H = cv2.findTransformECC(
            pattern,
            window,
            first.astype(np.float32),
            cv2.MOTION_HOMOGRAPHY,
            _CRITERIA,
            None,
            _FILTER_PX,
        )
    except cv2.error:  # it does not converge
        return None
    if correlation < _LEAST_CORRELATION:
        return None
    return cv2.perspectiveTransform(corners[:, None], H.astype(float))[:, 0] + low


def _pattern(dictionary: cv2.aruco.Dictionary, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the picture of a marker in a white rim, and its corners (4, 2) px in that picture."""
    modules = dictionary.markerSize + 2
    marker = cv2.aruco.generateImageMarker(dictionary, number, modules)
    framed = np.pad(marker, 1, constant_values=255)
    large = np.kron(framed, np.ones((_MODULE_PX, _MODULE_PX), dtype=np.uint8))
    pattern = cv2.GaussianBlur(large.astype(np.float32), (0, 0), _PATTERN_BLUR_PX)
    near = _MODULE_PX - 0.5
    far = (modules + 1) * _MODULE_PX - 0.5
    corners = [[near, near], [far, near], [far, far], [near, far]]
    return pattern, np.array(corners, dtype=np.float32)
