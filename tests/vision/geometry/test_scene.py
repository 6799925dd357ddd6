"""The scene's objects: projection against OpenCV, Jacobians against finite differences, checks where made."""

import time

import cv2
import numpy as np
import pytest

from vision.boards.charuco import CharucoBoard
from vision.geometry.camera import N_PARAMETERS, Camera, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rods import Bar, Wire
from vision.geometry.rotation import exp_rotation


def a_camera(name="high", seed=0, **changes):
    rng = np.random.default_rng(seed)
    R = exp_rotation(np.array([2.2, 0.3, -0.1]) + 0.1 * rng.standard_normal(3))
    values = {
        "size_px": (1280, 720),
        "matrix": [[2010.0, 0, 644.5], [0, 2012.4, 359.5], [0, 0, 1]],
        "distortion": [-0.11, 0.14, 0.0006, -0.0004, 0.02],
        "T_camera_rig": np.column_stack([R, [-54.8, 4.5, 375.9]]),
        "rms_px": 0.05,
    }
    return Camera(name, **(values | changes))


def some_points(n=50, seed=1):
    return np.random.default_rng(seed).uniform([-10, -40, -40], [110, 40, 40], (n, 3))


def test_projection_is_opencv_s():
    camera, points = a_camera(), some_points()
    rotation = cv2.Rodrigues(camera.T_camera_rig[:, :3])[0]
    expected, _ = cv2.projectPoints(
        points, rotation, camera.T_camera_rig[:, 3], camera.matrix, camera.distortion
    )
    # Both are double precision on numbers of about 1e3.
    np.testing.assert_allclose(camera.project(points), expected[:, 0], atol=1e-9)


def test_behind_the_camera_is_nan():
    camera = a_camera()
    behind = camera.centre_mm - 50.0 * camera.rays(np.array([[640.0, 360.0]]))
    assert np.isnan(camera.project(behind)).all()


@pytest.mark.parametrize("parameter", range(N_PARAMETERS))
def test_jacobian_by_parameters_is_the_finite_difference(parameter):
    camera, points = a_camera(), some_points()
    # Central differences err by step² f‴/6 and by rounding, 1e-10/step: both below 1e-6 of f′ here.
    scale = [1e-2] * 4 + [1e-4] * 5 + [1e-5] * 3 + [1e-3] * 3
    step = np.zeros(N_PARAMETERS)
    step[parameter] = scale[parameter]
    numeric = (camera.moved(step).project(points) - camera.moved(-step).project(points)) / (
        2 * scale[parameter]
    )
    analytic = camera.project_with_jacobians(points)[2][:, :, parameter]
    np.testing.assert_allclose(analytic, numeric, rtol=1e-6, atol=1e-6 * np.abs(numeric).max())


def test_jacobian_by_point_is_the_finite_difference():
    camera, points = a_camera(), some_points()
    analytic = camera.project_with_jacobians(points)[1]
    for axis in range(3):
        step = 1e-3 * np.eye(3)[axis]
        numeric = (camera.project(points + step) - camera.project(points - step)) / 2e-3
        np.testing.assert_allclose(analytic[:, :, axis], numeric, rtol=1e-6, atol=1e-6)


def test_rays_lead_back_to_the_point():
    camera, points = a_camera(), some_points()
    rays = camera.rays(camera.project(points))
    along = points - camera.centre_mm
    across = along - np.sum(along * rays, axis=1, keepdims=True) * rays
    np.testing.assert_allclose(across, 0, atol=1e-8)
    assert np.all(np.sum(along * rays, axis=1) > 0)


def test_projection_of_1000_points_with_jacobians_takes_under_2_ms():
    camera, points = a_camera(), some_points(1000)
    durations = []
    for _ in range(20):
        begin = time.perf_counter()
        camera.project_with_jacobians(points)
        durations.append(time.perf_counter() - begin)
    assert min(durations) < 2e-3


def test_board_corners_are_opencv_s():
    board = CharucoBoard((8, 6), 15.0, 11.0, "DICT_5X5_100")
    np.testing.assert_allclose(board.corners_mm, board.opencv().getChessboardCorners(), atol=1e-5)


def test_wire_tapers_only_as_a_cone():
    assert Wire("cylinder", 100, 1).radius_mm(60) == 0.5
    np.testing.assert_allclose(
        Wire("cone", 100, 1).radius_mm(np.array([0, 50, 100, 120])), [0.5, 0.25, 0, 0]
    )


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: Wire("tube", 100, 1), "cylinder, cone"),
        (lambda: Wire("cone", -1, 1), "length_mm"),
        (lambda: Bar(0.0), "diameter_mm"),
        (lambda: CharucoBoard((8, 6), 15, 16, "DICT_5X5_100"), "not smaller"),
        (lambda: CharucoBoard((8, 6), 15, 11, "DICT_9X9"), "DICT_9X9"),
        (lambda: CharucoBoard((20, 20), 15, 11, "DICT_5X5_100"), "needs 200 markers"),
        (lambda: a_camera(matrix=np.diag([-5.0, 5, 1])), "fx, fy above 0"),
        (lambda: a_camera(distortion=[0, 0, 0, 0]), "distortion must be 5"),
        (lambda: a_camera(T_camera_rig=np.ones((3, 4))), "no rotation"),
        (lambda: Cameras((a_camera(), a_camera())), "share a name"),
        (lambda: Cameras((a_camera(),), np.eye(3)), "15 x 15"),
    ],
)
def test_what_cannot_be_is_refused_where_it_is_made(make, words):
    with pytest.raises(Refused, match=words):
        make()


def test_subset_keeps_each_camera_s_covariance():
    rng = np.random.default_rng(5)
    root = rng.standard_normal((45, 45))
    three = Cameras(tuple(a_camera(n) for n in "abc"), root @ root.T)
    two = three.subset(["c", "a"])
    assert two.names == ("c", "a")
    np.testing.assert_array_equal(two.covariance[:15, 15:], three.covariance[30:, :15])
