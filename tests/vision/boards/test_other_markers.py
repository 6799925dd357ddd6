"""Markers besides the board's: found, named, their corners where they were drawn."""

import cv2
import numpy as np
import pytest

from vision.boards.charuco import CharucoBoard
from vision.boards.other_markers import find_other_markers

BOARD = CharucoBoard((8, 6), 15.0, 11.0, "DICT_5X5_100")
CORNERS_PX = np.array([[60.3, 40.2], [121.7, 47.9], [118.4, 101.6], [57.1, 92.8]])


def picture(number, rng, supersampled=8, beyond=255):
    """A blurred, noisy picture of one marker with its corners at CORNERS_PX; beyond: grey past its white rim."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    marker = cv2.aruco.generateImageMarker(dictionary, number, 7)
    large = np.kron(np.pad(marker, 1, constant_values=255), np.ones((40, 40), np.uint8))
    near, far = 39.5, 319.5
    ends = np.array([[near, near], [far, near], [far, far], [near, far]], dtype=np.float32)
    fine_px = (CORNERS_PX + 0.5) * supersampled - 0.5
    H = cv2.getPerspectiveTransform(ends, fine_px.astype(np.float32))
    size = (180 * supersampled, 140 * supersampled)
    fine = cv2.warpPerspective(large.astype(np.float32), H, size, borderValue=beyond)
    small = cv2.resize(fine, (180, 140), interpolation=cv2.INTER_AREA)
    grey = 40 + 0.5 * cv2.GaussianBlur(small, (0, 0), 0.9) + rng.normal(0, 2.0, small.shape)
    return np.clip(grey, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("beyond", [255, 0])
def test_corners_are_where_they_were_drawn_whatever_is_beyond_the_rim(rng, beyond):
    (marker,) = find_other_markers(picture(40, rng, beyond=beyond), BOARD)
    assert marker.number == 40
    # An edge of 60 px, steps of 127 grey levels over a blur of 0.9 px: noise of 2 moves it by 2/(127/(0.9·√2π)·√60)
    # = 0.005 px, at an edge's end twice as much along either side of the corner: four of those. A fit that takes the rim
    # to go on is 0.5 px off where it does not.
    np.testing.assert_allclose(marker.px, CORNERS_PX, atol=0.06)


def test_markers_of_the_board_are_none(rng):
    assert find_other_markers(picture(3, rng), BOARD) == []


def test_a_picture_without_markers_has_none(rng):
    assert find_other_markers(rng.integers(0, 255, (140, 180)).astype(np.uint8), BOARD) == []
