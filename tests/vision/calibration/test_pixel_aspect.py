"""A camera that squashes 16:9 to 4:3: calibrated as it is, named, and quiet where it is stated."""

import numpy as np
import pytest

from tests.studies.accuracy.board_scenes import BOARD, WORK_MM, board_views, noisy, two_cameras
from vision.boards.sufficiency import check_lens
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.views import BoardViews
from vision.geometry.camera import Camera, camera_matrix
from vision.geometry.refusals import Refused


def squashed(share: float) -> Camera:
    """The upper camera, its pictures squashed along their width."""
    high = two_cameras()["high"]
    lens = high.lens.copy()
    lens[[0, 2]] *= share
    size_px = (round(share * high.size_px[0]), high.size_px[1])
    return Camera("high", size_px, camera_matrix(lens), lens[4:], high.T_camera_rig)


def calibrated(camera: Camera, **stated):
    rng = np.random.default_rng(0)
    held = [noisy(view, 0.05, rng) for view in board_views(camera, 16, rng)]
    views = BoardViews({"high": held}, {"high": camera.size_px}, pixel_aspects=stated)
    return calibrate_cameras(views, BOARD, None)


def test_a_squashed_camera_is_calibrated_and_named():
    camera = squashed(0.75)
    made = calibrated(camera)
    assert [warning.codes for warning in made.warnings] == [("pixels_not_square",)]
    assert "pixel_aspect = 0.7" in made.warnings[0]
    fx, fy = made.cameras["high"].lens[:2]
    sigma_px = made.report[0].intrinsics_sigma[:2]
    ratio_sigma = np.hypot(*sigma_px) / fy
    assert fx / fy == pytest.approx(camera.lens[0] / camera.lens[1], abs=4 * ratio_sigma)


def test_what_is_stated_is_not_said_again():
    assert calibrated(squashed(0.75), high=0.75).warnings == ()


def test_what_is_seen_must_be_what_is_stated():
    with pytest.raises(Refused, match=r"fx/fy = 0\.7.*, but pixel_aspect is 0\.9"):
        calibrated(squashed(0.75), high=0.9)


def test_no_squash_is_a_lens_that_diverged_unless_stated():
    camera = squashed(0.88)
    with pytest.raises(Refused, match="differ by 12 %"):
        check_lens(camera)
    check_lens(camera, pixel_aspect=0.88)
    assert camera.project(WORK_MM).shape == (9, 2)
