"""A session's cameras carry the transfer curve and the lens blur that the board on the rig shows."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.cameras.session_cameras import calibrate_session
from bench.session.session import load_session
from vision.geometry.optics import UNKNOWN, known_gamma

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def ring():
    """A path-traced session with exact cameras: a linear sensor, blurred by 0.68 px and the pixel's own 0.29."""
    return load_session(ROOT / "fixtures" / "scenes" / "ring")


def test_cameras_brought_along_learn_them_from_the_rig_picture(ring, tmp_path):
    made = calibrate_session(ring, tmp_path)
    for camera in made.cameras:
        assert abs(np.log(camera.optics.gamma)) < 2.0 * camera.optics.log_gamma_sigma
        assert abs(np.log(camera.optics.blur_px / 0.74)) < 2.0 * camera.optics.log_blur_sigma
    assert known_gamma(camera.optics for camera in made.cameras) == 1.0


def test_what_is_known_of_them_is_part_of_the_result_s_hash(ring, tmp_path):
    without_board = replace(ring, board=None)
    blind = calibrate_session(without_board, tmp_path)
    assert all(camera.optics == UNKNOWN for camera in blind.cameras)
    assert blind.hash != calibrate_session(ring, tmp_path).hash
