"""A body with boards on its faces: cameras and faces come back within their sigmas, from drawn points."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from tests.scenes.bodies import box_faces
from vision.boards.body import Body
from vision.boards.corners import Corners, by_face
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.held_out import check_held_out
from vision.calibration.normal_equations import common_modes
from vision.calibration.views import BoardViews
from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import apply, compose, exp_rotation, pose_difference

SIZE_PX = (1280, 960)
BODY = Body((6, 6), 6.0, marker_mm=4.4, dictionary="DICT_4X4_250", first_ids=(0, 18, 40, 80))
NOISE_PX = 0.05
VIEWS = 12
SEEDS = 5
# Four sides of a box of some 40 mm that nobody built exactly, each seen from outside: x to the right, y down, z inwards.
TURNS = np.array([[0.0, 0.0, 0.0], [0.01, -1.56, 0.0], [0.0, 3.13, 0.02], [1.58, 0.01, 0.0]])
CENTRES_MM = np.array([[0, 0, -20.0], [20.1, 0.1, 0], [0.0, 0.2, 20.3], [0.1, 20.2, 0.0]])


def true_faces():
    """Return the poses (4, 3, 4) of the faces before the body's middle, normals outward being −z."""
    return box_faces(TURNS, CENTRES_MM, 36.0)


def on_first(T):
    """Return poses of faces (F, 3, 4) in the frame of the first."""
    inverse = np.column_stack([T[0, :, :3].T, -T[0, :, :3].T @ T[0, :, 3]])
    return np.array([compose(inverse, face) for face in T])


def two_cameras():
    """Return two cameras that look at a place 240 mm before the first, 50° apart."""
    second = exp_rotation([0.0, 0.87, 0.0])
    shift = np.array([0.0, 0.0, 240.0]) - second @ [0.0, 0.0, 240.0]
    poses = [np.eye(3, 4), np.column_stack([second, shift])]
    lens = [np.array([-0.12, 0.05, 4e-4, -3e-4, 0.0]), np.array([0.06, -0.05, -4e-4, 2e-4, 0.0])]
    made = []
    for k, T in enumerate(poses):
        K = np.array([[2400.0 + 30 * k, 0, 640.0 + 9 * k], [0, 2404.0 + 30 * k, 470.0], [0, 0, 1]])
        made.append(Camera(f"cam{k}", SIZE_PX, K, lens[k], T, np.nan))
    return Cameras(tuple(made), np.zeros((30, 30)))


def drawn_views(rng, faces=None):
    """Return the corners of the body in both cameras as it turns, its points off as `point_sigma_mm` says."""
    faces = true_faces() if faces is None else faces
    cameras = two_cameras()
    flat = BODY.flat_mm[: len(BODY.flat_mm) // len(faces)]
    points = np.concatenate([apply(T, flat) for T in faces])
    points += _in_shape(rng.normal(0.0, BODY.point_sigma_mm, points.shape), points, faces)
    boards = {camera.name: [] for camera in cameras}
    for k in range(VIEWS):
        R = exp_rotation([0.0, 2 * np.pi * k / VIEWS, 0.0]) @ exp_rotation(rng.normal(0, 0.25, 3))
        T = np.column_stack([exp_rotation([-0.6, 0.2, 0.0]) @ R, rng.normal([0, 0, 240], 8.0)])
        for camera in cameras:
            boards[camera.name].append(_seen(camera, T, faces, points, rng))
    return BoardViews(boards, dict.fromkeys(boards, SIZE_PX))


def _in_shape(errors_mm, points_mm, faces):
    """Return errors of points (m, 3) without what moves a face as one, or changes all faces alike in size."""
    modes = common_modes(BODY.placed(faces), np.arange(len(points_mm)))
    return errors_mm - (modes @ (modes.T @ errors_mm.ravel())).reshape(-1, 3)


def _seen(camera, T_world_body, faces, points, rng):
    """Return the corners on faces that are turned to a camera by more than 15°."""
    in_camera = apply(camera.T_camera_rig, apply(T_world_body, points))
    outward = -(camera.T_camera_rig[:, :3] @ T_world_body[:, :3] @ faces[:, :, 2].T).T  # (F, 3)
    towards = -in_camera / np.linalg.norm(in_camera, axis=1, keepdims=True)
    is_seen = np.sum(outward[BODY.face_of] * towards, axis=1) > np.sin(np.radians(15.0))
    px = camera.project(apply(T_world_body, points))
    is_seen &= np.all((px > 0) & (px < SIZE_PX), axis=1)
    ids = np.flatnonzero(is_seen)
    return Corners(
        ids, px[ids] + rng.normal(0, NOISE_PX, (len(ids), 2)), np.full(len(ids), NOISE_PX)
    )


@pytest.fixture(scope="module")
def made():
    """Return calibrations by draws of several seeds, with their views."""
    found = []
    for seed in range(SEEDS):
        views = drawn_views(np.random.default_rng(seed))
        found.append((calibrate_cameras(views, BODY, None), views))
    return found


def test_faces_come_back_within_their_sigmas(made):
    squared = 0.0
    count = 0
    for calibration, _ in made:
        faces = calibration.placed_board.faces_at(calibration.board)
        truth = on_first(true_faces())
        error = np.concatenate([pose_difference(*pair) for pair in zip(truth[1:], faces[1:])])
        covariance = calibration.board_covariance[: len(error), : len(error)]
        squared += error @ np.linalg.solve(covariance, error)
        count += len(error)
    assert chi2.ppf(1e-4, count) < squared < chi2.ppf(1 - 1e-4, count)


def test_cameras_come_back_within_their_sigmas(made):
    terms = [
        0,
        1,
        2,
        3,
        6,
        7,
    ]  # k1, k2 and k3 stand in for each other, and have priors that are no draws
    poses = list(range(24, 30))
    squared = 0.0
    count = 0
    for calibration, _ in made:
        error = []
        truth = two_cameras()
        for found, true in zip(calibration.cameras, truth):
            error += (found.lens - true.lens).tolist() + 6 * [0.0]
        T_found = calibration.cameras["cam1"].T_camera_rig
        error[24:] = pose_difference(truth["cam1"].T_camera_rig, T_found)
        rows = [*terms, *(15 + np.array(terms)), *poses]
        error = np.array(error)[rows]
        covariance = calibration.cameras.covariance[np.ix_(rows, rows)]
        squared += error @ np.linalg.solve(covariance, error)
        count += len(rows)
    assert chi2.ppf(1e-4, count) < squared < chi2.ppf(1 - 1e-4, count)


def test_held_out_views_err_by_the_noise(made):
    calibration, _ = made[0]
    views = drawn_views(np.random.default_rng(0))
    rms_px = check_held_out(calibration, views.boards, [True] * VIEWS).joint.joint_px
    # two axes of noise, less six parameters of a pose of some 150 coordinates
    assert 0.9 * NOISE_PX * np.sqrt(2) < rms_px < 1.1 * NOISE_PX * np.sqrt(2)


def test_a_face_that_no_view_shows_is_named():
    views = drawn_views(np.random.default_rng(0))
    with pytest.raises(Refused, match="no view shows the face of markers 200 to 217"):
        calibrate_cameras(views, replace(BODY, first_ids=(*BODY.first_ids, 200)), None)


def test_a_face_that_is_never_seen_with_another_is_named():
    views = drawn_views(np.random.default_rng(0))
    apart = {}
    for name, series in views.boards.items():
        apart[name] = [by_face(view, BODY)[0] if len(view) else view for view in series]
    with pytest.raises(Refused, match="is in no picture with another face"):
        calibrate_cameras(replace(views, boards=apart), BODY, None)


@pytest.mark.parametrize(
    "change, words",
    [
        ({"first_ids": (0, 17)}, "share markers, each has 18"),
        ({"first_ids": (0,)}, "a body has two faces or more"),
        ({"first_ids": (0, 240)}, "needs 18 markers from 240 on, DICT_4X4_250 has 250"),
        ({"first_ids": (-1, 40)}, "needs 18 markers from -1 on"),
    ],
)
def test_bodies_that_cannot_be(change, words):
    with pytest.raises(Refused, match=words):
        replace(BODY, **change)
