"""Cameras calibrated from pictures of a body in a session folder."""

import shutil

import cv2
import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.cameras.calibrate_session import calibrate_cameras_command
from tests.scenes.bodies import body_picture, box_faces
from vision.boards import Body
from vision.calibration import read_cameras
from vision.geometry.rotation import compose, exp_rotation

SIZE_PX = (800, 600)
BODY = Body((5, 5), 7.0, marker_mm=5.0, dictionary="DICT_4X4_100", first_ids=(0, 20, 50))
# Three sides of a cube that meet in the corner towards the cameras.
TURNS = np.array([[0.0, 0.0, 0.0], [0.0, -0.5 * np.pi, 0.0], [0.5 * np.pi, 0.0, 0.0]])
CENTRES_MM = np.array([[0.0, 0.0, -20.0], [20.0, 0.0, 0.0], [0.0, 20.0, 0.0]])
VIEWS = 9
TOML = """format = 1
[board]
kind = "body"
squares = [5, 5]
square_mm = 7.0
marker_mm = 5.0
dictionary = "DICT_4X4_100"
first_ids = [0, 20, 50]
exact = true
"""
FOCAL_PX = 1400.0
SECOND = np.column_stack([exp_rotation([0.0, 0.4, 0.0]), [-85.0, 0.0, 17.0]])


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """Make a session folder with pictures of the body by two cameras."""
    rng = np.random.default_rng(3)
    folder = tmp_path_factory.mktemp("body")
    (folder / "session.toml").write_text(TOML)
    K = np.array([[FOCAL_PX, 0, 402.0], [0, FOCAL_PX, 297.0], [0, 0, 1.0]])
    faces = box_faces(TURNS, CENTRES_MM, 35.0)
    for k in range(VIEWS):
        towards = exp_rotation([-0.6, 0.0, 0.0]) @ exp_rotation([0.0, 0.6, 0.0])
        R = exp_rotation(rng.normal(0, 0.22, 3)) @ towards
        T = np.column_stack([R, rng.normal([0, 0, 220.0], [8.0, 6.0, 20.0])])
        for name, camera in (("left", np.eye(3, 4)), ("right", SECOND)):
            (folder / "boards" / name).mkdir(parents=True, exist_ok=True)
            picture = body_picture(BODY, compose(camera, T), faces, K, SIZE_PX, rng)
            cv2.imwrite(str(folder / "boards" / name / f"{k:03d}.png"), picture)
    return folder


def test_cameras_are_calibrated_from_a_body(session, tmp_path):
    assert calibrate_cameras_command(session, tmp_path / "cameras.toml") == 0
    cameras = read_cameras(tmp_path / "cameras.toml", {})
    sigma = np.sqrt(np.diag(cameras.covariance))
    for k, camera in enumerate(cameras):
        error_px = np.abs(camera.lens[:2] - FOCAL_PX)
        assert np.all(error_px < 4.5 * sigma[15 * k : 15 * k + 2])
        assert np.all(sigma[15 * k : 15 * k + 2] < 1e-3 * FOCAL_PX)


@pytest.mark.parametrize(
    "stated, pictures, words",
    [
        ("first_ids = [0, 20, 70]", VIEWS, "no view shows the face of markers 70 to 81"),
        ("first_ids = [62, 75, 88]", 1, "not laid out as on a board of 5 x 5 squares"),
    ],
)
def test_wrong_numbers_of_markers_are_one_line(session, stated, pictures, words, tmp_path):
    copy = tmp_path / "session"
    shutil.copytree(session, copy)
    for spare in sorted((copy / "boards" / "left").iterdir())[pictures:]:
        spare.unlink()
    (copy / "session.toml").write_text(TOML.replace("first_ids = [0, 20, 50]", stated))
    with pytest.raises(BadInput, match=words) as refused:
        calibrate_cameras_command(copy, tmp_path / "cameras.toml")
    assert "\n" not in str(refused.value)
