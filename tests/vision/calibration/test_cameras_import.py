"""Camera TOML of caliscope and aniposelib: read as they are meant, refused where they cannot be used."""

from dataclasses import replace

import numpy as np
import pytest

from tests.studies.accuracy.board_scenes import BOARD, T_RIG_BOARD, noisy, rig_view, two_cameras
from vision.calibration.cameras_import import import_cameras, place_on_rig
from vision.geometry.board import printed_corners
from vision.geometry.refusals import Refused
from vision.geometry.rotation import log_rotation

ANIPOSE = """
[cam_0]
name = "high"
size = [1280, 720]
matrix = [[2010.0, 0.0, 644.6], [0.0, 2012.4, 359.6], [0.0, 0.0, 1.0]]
distortions = [-0.11, 0.14, 0.0006, -0.0004, 0.0]
rotation = [{w[0]}, {w[1]}, {w[2]}]
translation = [{t[0]}, {t[1]}, {t[2]}]
{more}

[metadata]
adjusted = true
error = 0.3
"""


def anipose_text(more=""):
    T = two_cameras()["high"].T_camera_rig
    return ANIPOSE.format(w=log_rotation(T[:, :3]), t=T[:, 3], more=more)


def test_aniposelib_s_vectors_become_poses(tmp_path):
    (tmp_path / "calibration.toml").write_text(anipose_text())
    made, true = import_cameras(tmp_path / "calibration.toml"), two_cameras()["high"]
    assert made.names == ("high",)
    np.testing.assert_allclose(made["high"].T_camera_rig, true.T_camera_rig, atol=1e-9)
    np.testing.assert_array_equal(made["high"].lens, true.lens)


def test_caliscope_s_metres_become_millimetres(real):
    made = import_cameras(real / "calibration" / "multi4_b" / "camera_array.toml")
    assert made.names == ("cam_0", "cam_1", "cam_2", "cam_3")
    np.testing.assert_allclose(
        made["cam_0"].T_camera_rig[:, 3], [171.25994, -32.34536, 1208.38646], atol=1e-4
    )
    assert made["cam_3"].lens[0] == 639.8834321530571


def test_both_files_of_caliscope_give_the_same_cameras(real):
    folder = real / "calibration" / "multi4_b"
    one, other = (
        import_cameras(folder / "camera_array.toml"),
        import_cameras(folder / "config.toml"),
    )
    for a, b in zip(one, other):
        np.testing.assert_array_equal(a.T_camera_rig, b.T_camera_rig)


@pytest.mark.parametrize(
    "text, words",
    [
        (anipose_text("fisheye = true"), "fisheye"),
        (anipose_text().replace('"high"', '"a\\u0000b"'), "cannot be printed"),
        (anipose_text().replace("rotation", "turn"), "rotation missing"),
        (anipose_text().replace("-0.11, 0.14, 0.0006", "-2.91, 0.011, -0.278"), "over-fitted"),
        (anipose_text().replace("2012.4", "1700.0"), "differ by 18 %"),
        (anipose_text().replace("2012.4", "1" + 400 * "0"), "int too large"),
        (anipose_text().replace("-0.11", "1" + 400 * "0"), "distortion is no list of numbers"),
        ("[metadata]\nerror = 1.0\n", "no camera"),
        ("[[", "not TOML"),
    ],
)
def test_what_cannot_be_used_is_refused(tmp_path, text, words):
    (tmp_path / "calibration.toml").write_text(text)
    with pytest.raises(Refused, match=words):
        import_cameras(tmp_path / "calibration.toml")


def test_a_print_s_size_and_stretch_are_in_where_imported_cameras_stand():
    true, rng = two_cameras(), np.random.default_rng(3)
    printed_mm, _ = printed_corners(BOARD.corners_mm, np.array([0.002, -0.002, 0.0, 0.0]))
    views = {c.name: noisy(rig_view(c, printed_mm=printed_mm), 0.05, rng) for c in true}
    unsure = replace(BOARD, square_sigma_mm=0.002 * BOARD.square_mm, stretch_sigma=0.002)
    for board, bounds in ((unsure, (0.0, 4.0)), (BOARD, (4.0, np.inf))):
        made = place_on_rig(true, views, board, T_RIG_BOARD)
        off_mm = [
            camera.T_camera_rig[2, 3] - true[camera.name].T_camera_rig[2, 3] for camera in made
        ]
        sigma_mm = np.sqrt(np.diag(made.covariance)[14::15])
        # One size for both cameras: in a Gaussian draw beyond 4 sigma once in 16 000.
        assert bounds[0] < np.abs(off_mm / sigma_mm).max() < bounds[1]


def test_imported_cameras_are_placed_by_the_board_on_the_rig():
    true, rng = two_cameras(), np.random.default_rng(2)
    elsewhere = true.moved(np.tile(np.r_[np.zeros(9), 0.3, -0.2, 0.1, 20, 30, 40], 2))
    views = {c.name: noisy(rig_view(c), 0.05, rng) for c in true}
    made = place_on_rig(elsewhere, views, BOARD, T_RIG_BOARD)
    for k, camera in enumerate(made):
        points = np.array([[50.0, 0, 0], [0, 0, 0]])
        px, _, J = camera.project_with_jacobians(points)
        own = slice(15 * k, 15 * k + 15)
        sigma = np.sqrt(np.einsum("nij,jk,nik->ni", J, made.covariance[own, own], J))
        assert not made.covariance[own, own][:9].any()
        # Four values a camera; 4.5 sigma happens once in 10⁵.
        assert np.abs((px - true[camera.name].project(points)) / sigma).max() < 4.5
