"""The markers are the board's second known length: a square entered wrong does not go with them.

How wide a marker is against a square is seen in any one picture, without a camera: the corners give the plane's
homography, and the markers are measured in it.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from vision.boards.corners import MIN_CORNERS, to_8_bit
from vision.geometry.board import Board
from vision.geometry.refusals import Refused

# [markers] A median of fewer may be two spoilt ones. Origin not known. Study:
# tests/vision/boards/test_marker_size.py.
_FEWEST_MARKERS = 6
# [1, px] Print and rounding; and blur, which eats or feeds a marker's rim by up to a pixel a side
# (0.7 px in the webcams). Study: tests/vision/boards/test_marker_size.py.
_TOLERANCE, _RIM_PX = 0.04, 2.0


def check_marker_size(greys: Sequence[np.ndarray], board: Board) -> None:
    """Raises Refused where marker_mm and square_mm do not go with the markers in these pictures of the board."""
    sides = np.concatenate([np.zeros((0, 2)), *(_sides(grey, board) for grey in greys)])
    if len(sides) < _FEWEST_MARKERS:
        return
    seen, side_px = np.median(sides, axis=0)
    entered = board.marker_mm / board.square_mm
    slack = _TOLERANCE + _RIM_PX / side_px
    if abs(seen / entered - 1) > slack:
        raise Refused(
            f"the markers are {seen:.3f} times as wide as the squares, but marker_mm = {board.marker_mm:g} and "
            f"square_mm = {board.square_mm:g} make it {entered:.3f} ({entered * (1 - slack):.2f} to "
            f"{entered * (1 + slack):.2f} may be seen): measure both on the printed board and enter them"
        )


def _sides(grey: np.ndarray, board: Board) -> np.ndarray:
    """Side of each marker in squares and in px, (m, 2)."""
    picture = to_8_bit(grey)
    detector = cv2.aruco.CharucoDetector(board.opencv())
    px, ids, markers, _ = detector.detectBoard(255 - picture if board.inverted else picture)
    if ids is None or len(ids) < MIN_CORNERS:
        return np.zeros((0, 2))
    squares = board.corners_mm[ids.ravel(), :2] / board.square_mm
    H, _ = cv2.findHomography(px.reshape(-1, 2).astype(float), squares, 0)
    if H is None:
        return np.zeros((0, 2))
    outlines = [marker.reshape(-1, 1, 2).astype(np.float32) for marker in markers]
    flat = [cv2.perspectiveTransform(outline, H) for outline in outlines]
    return np.sqrt(
        [
            [cv2.contourArea(a.astype(np.float32)), cv2.contourArea(b)]
            for a, b in zip(flat, outlines)
        ]
    )
