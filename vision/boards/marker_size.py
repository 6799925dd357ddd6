"""The markers are the board's second known length: a square entered wrong contradicts them.

How wide a marker is against a square is seen in any one picture, without a camera: the corners give
the plane's homography, and the markers are measured in it.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np

from vision.boards.corners import to_8_bit
from vision.boards.homography import fit_homography
from vision.geometry.refusals import Refused

if TYPE_CHECKING:
    from vision.boards.charuco import CharucoBoard

# [markers] A median of fewer may be two spoilt ones. Origin not known. Study:
# tests/vision/boards/test_marker_size.py.
_FEWEST_MARKERS = 6
# [1] Print and rounding. Study: tests/vision/boards/test_marker_size.py.
_TOLERANCE = 0.04
# [px] Blur, which eats or feeds a marker's rim by up to a pixel a side (0.7 px in the webcams).
# Study: tests/vision/boards/test_marker_size.py.
_RIM_PX = 2.0


def check_marker_size(greys: Sequence[np.ndarray], board: "CharucoBoard") -> None:
    """Raise Refused where marker_mm and square_mm contradict the markers in pictures."""
    sides = []
    for grey in greys:
        sides += _marker_sides(grey, board)
    if len(sides) < _FEWEST_MARKERS:
        return
    seen, side_px = np.median(sides, axis=0)
    entered = board.marker_mm / board.square_mm
    slack = _TOLERANCE + _RIM_PX / side_px
    if abs(seen / entered - 1) > slack:
        raise Refused(
            f"the markers are {seen:.3f} times as wide as the squares, but marker_mm = "
            f"{board.marker_mm:g} and square_mm = {board.square_mm:g} make it {entered:.3f} "
            f"({entered * (1 - slack):.2f} to {entered * (1 + slack):.2f} may be seen): measure "
            "both on the printed board and enter them"
        )


def _marker_sides(grey: np.ndarray, board: "CharucoBoard") -> list[tuple[float, float]]:
    """Measure the side of each marker in a picture: in squares, and in px."""
    ids, px, markers = board.detect_with_markers(to_8_bit(grey))
    if not len(ids):
        return []
    H = fit_homography(px, board.corners_mm[ids, :2] / board.square_mm)
    if H is None:
        return []
    sides = []
    for marker in markers:
        outline = marker.reshape(-1, 1, 2).astype(np.float32)
        flat = cv2.perspectiveTransform(outline, H)
        sides.append((np.sqrt(cv2.contourArea(flat)), np.sqrt(cv2.contourArea(outline))))
    return sides
