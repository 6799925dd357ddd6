"""Cameras calibrated from pictures of a body in a session folder."""

import shutil

import cv2
import numpy as np
import pytest
from scipy.special import chdtri

from bench.base.errors import BadInput
from bench.cameras.calibrate_session import calibrate_cameras_command
from tests.scenes.bodies import body_picture, box_faces
from vision.boards import Body
from vision.calibration import read_cameras
from vision.geometry.rotation import apply, compose, exp_rotation, invert_transform
from vision.geometry.triangulate import triangulate

SIZE_PX = (800, 600)
BODY = Body((5, 5), 7.0, marker_mm=5.0, dictionary="DICT_4X4_100", first_ids=(0, 20, 50))
# Three sides of a cube that meet in the corner towards the cameras.
TURNS = np.array([[0.0, 0.0, 0.0], [0.0, -0.5 * np.pi, 0.0], [0.5 * np.pi, 0.0, 0.0]])
CENTRES_MM = np.array([[0.0, 0.0, -20.0], [20.0, 0.0, 0.0], [0.0, 20.0, 0.0]])
VIEWS = 9
POINT_SIGMA_PX = 0.05
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
PRINCIPAL_PX = np.array([402.0, 297.0])
MATRIX = np.array([[FOCAL_PX, 0, PRINCIPAL_PX[0]], [0, FOCAL_PX, PRINCIPAL_PX[1]], [0, 0, 1.0]])
SECOND = np.column_stack([exp_rotation([0.0, 0.4, 0.0]), [-85.0, 0.0, 17.0]])


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """Make a session folder with pictures of the body by two cameras."""
    rng = np.random.default_rng(3)
    folder = tmp_path_factory.mktemp("body")
    (folder / "session.toml").write_text(TOML)
    faces = box_faces(TURNS, CENTRES_MM, 35.0)
    for k in range(VIEWS):
        towards = exp_rotation([-0.6, 0.0, 0.0]) @ exp_rotation([0.0, 0.6, 0.0])
        R = exp_rotation(rng.normal(0, 0.22, 3)) @ towards
        T = np.column_stack([R, rng.normal([0, 0, 220.0], [8.0, 6.0, 20.0])])
        for name, camera in (("left", np.eye(3, 4)), ("right", SECOND)):
            (folder / "boards" / name).mkdir(parents=True, exist_ok=True)
            picture = body_picture(BODY, compose(camera, T), faces, MATRIX, SIZE_PX, rng)
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


def test_contacts_before_a_body_on_the_rig_are_where_they_are(session, tmp_path):
    """In the rig's frame by the body that stands there; χ² of 36 numbers, one in 10 000 to either side."""
    copy = tmp_path / "session"
    shutil.copytree(session, copy)
    rng = np.random.default_rng(5)
    towards = exp_rotation([-0.6, 0.0, 0.0]) @ exp_rotation([0.0, 0.6, 0.0])
    T_left_body = np.column_stack([towards, [0.0, 0.0, 220.0]])
    T_rig_body = np.column_stack([exp_rotation([0.3, -0.2, 0.1]), [70.0, 10.0, -20.0]])
    T_left_rig = compose(T_left_body, invert_transform(T_rig_body))
    true = {"left": T_left_rig, "right": compose(SECOND, T_left_rig)}
    contacts_mm = T_rig_body[:, 3] + rng.uniform(-25.0, 25.0, (12, 3))
    faces = box_faces(TURNS, CENTRES_MM, 35.0)
    (copy / "boards" / "rig").mkdir()
    seen_px = {}
    for name, T_camera_rig in true.items():
        T = compose(T_camera_rig, T_rig_body)
        picture = body_picture(BODY, T, faces, MATRIX, SIZE_PX, rng)
        cv2.imwrite(str(copy / "boards" / "rig" / f"{name}.png"), picture)
        in_camera_mm = apply(T_camera_rig, contacts_mm)
        px = FOCAL_PX * in_camera_mm[:, :2] / in_camera_mm[:, 2:] + PRINCIPAL_PX
        seen_px[name] = px + POINT_SIGMA_PX * rng.standard_normal(px.shape)
    stated = compose(T_rig_body, faces[0]).tolist()  # the body's frame is its first face's
    (copy / "session.toml").write_text(f"{TOML}[rig]\nT_rig_board = {stated}\nexact = true\n")
    assert calibrate_cameras_command(copy, tmp_path / "cameras.toml") == 0
    made = read_cameras(tmp_path / "cameras.toml", {})
    points = triangulate(made, seen_px, dict.fromkeys(seen_px, np.full(12, POINT_SIGMA_PX)))
    error_mm = points.mm - contacts_mm
    z = error_mm / np.sqrt(np.einsum("nii->ni", points.covariance(made)))
    assert chdtri(36, 1.0 - 1e-4) < np.sum(z**2) < chdtri(36, 1e-4)


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
