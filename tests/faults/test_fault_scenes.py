"""The faults that studies make are those that they are named after."""

import json

import cv2
import numpy as np

from tests.scenes.faults import BOARD, stretched_board
from vision.boards import find_corners


def test_a_stretched_print_has_its_corners_farther_apart_along_x(small_session):
    """To four sigma of a corner (0.05 px), of more than 1 px by which the outer ones move."""
    share = 0.01
    camera = json.loads((small_session / "truth.json").read_text())["cameras"]["low"]
    K = np.array(camera["K"])
    distortion = np.array(camera["dist"])
    grey = cv2.imread(str(small_session / "boards" / "rig" / "low.png"), cv2.IMREAD_GRAYSCALE)
    before = find_corners(grey, BOARD)
    after = find_corners(stretched_board(grey, share, K, distortion), BOARD)
    mm = BOARD.corners_mm[before.ids, :2]
    flat = cv2.undistortPoints(before.px.reshape(-1, 1, 2), K, distortion).reshape(-1, 2)
    to_picture, _ = cv2.findHomography(mm, flat)
    longer = mm.copy()
    longer[:, 0] += share * (mm[:, 0] - mm[:, 0].mean())
    rays = cv2.perspectiveTransform(longer.reshape(-1, 1, 2), to_picture)
    rays = cv2.convertPointsToHomogeneous(rays)
    wanted, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), K, distortion)
    wanted = wanted.reshape(-1, 2)[np.isin(before.ids, after.ids)]
    np.testing.assert_allclose(after.px[np.isin(after.ids, before.ids)], wanted, atol=0.2)
    assert np.abs(wanted - before.px[np.isin(before.ids, after.ids)]).max() > 1.0
