"""A first pose of a plane board: of its two mirrored poses the one that it was seen in."""

import numpy as np
import pytest

from tests.studies.accuracy.board_scenes import BOARD, SIZE_PX
from vision.boards.corners import Corners
from vision.calibration.first_guess import board_pose
from vision.geometry import lens as lens_model
from vision.geometry.rotation import apply, exp_rotation

LENS = np.array([2000.0, 2000.0, SIZE_PX[0] / 2, SIZE_PX[1] / 2, 0, 0, 0, 0, 0])
FACING = np.diag([1.0, -1.0, -1.0])


@pytest.mark.parametrize("tilt_deg", [-35.0, -15.0, 15.0, 35.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_tilted_board_is_not_taken_for_its_mirror_image(rng, axis, tilt_deg):
    """At 400 mm, with corners off by 0.05 px: the tilt itself is 2·tilt from its mirror image."""
    turn = exp_rotation(np.radians(tilt_deg) * np.eye(3)[axis])
    middle = BOARD.corners_mm.mean(axis=0)
    T = np.column_stack([turn @ FACING, np.array([0.0, 0.0, 400.0]) - turn @ FACING @ middle])
    px = lens_model.project(apply(T, BOARD.corners_mm), LENS)
    px += 0.05 * rng.standard_normal(px.shape)
    seen = Corners(np.arange(len(px)), px, np.full(len(px), 0.05))
    found = board_pose(seen, BOARD.corners_mm, LENS)[:, :3]
    off = np.arccos(np.clip((np.trace(found.T @ T[:, :3]) - 1) / 2, -1, 1))
    assert np.degrees(off) < 1.0
