"""The adjustment: its gradients are finite differences, without noise it is exact, its cost is linear in views."""

from dataclasses import replace

import numpy as np
import pytest

from tests.studies.accuracy.board_scenes import (
    BOARD,
    SIZE_PX,
    T_RIG_BOARD,
    WORK_MM,
    Film,
    a_recording,
    moving_board,
    noisy_view_at,
)
from vision.boards.body import Body
from vision.boards.checkerboard import Checkerboard
from vision.calibration.adjust import adjust_bundle
from vision.calibration.board_motion import Trajectory
from vision.calibration.bundle import (
    DEPARTURE,
    N_BOARD,
    N_CAMERA,
    N_PICTURE,
    N_VIEW,
    BundleState,
    SharedLenses,
    Sightings,
    predict,
    predict_with_own,
)
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.corner_noise import ROBUST_WIDTH, adjust_with_noise
from vision.calibration.held_out import camera_alone
from vision.calibration.instants_help import chance_of_one_instant
from vision.calibration.layout import gather, lay_out
from vision.calibration.one_picture import calibrate_alone
from vision.calibration.priors import allow_lateness, joint_priors, lens_priors, pose_priors
from vision.calibration.views import BoardViews, MeasuredPose
from vision.geometry.rotation import exp_rotation, left_jacobian, log_rotation

VIEWS, CAMERAS = 4, 2
PLANE = Checkerboard((5, 4), 15.0)
FACES = [np.eye(3, 4), np.column_stack([exp_rotation([0.0, -1.4, 0.1]), [48.0, 2.0, 1.0]])]
FACED = Body((4, 3), 15.0, marker_mm=11.0, dictionary="DICT_5X5_100", first_ids=(0, 6)).placed(
    np.array(FACES)
)
# s, rad and mm: of what is a picture's own.
OWN_SIGMA = [0.05] + [0.1] * 3 + [3.0] * 3
TIMES_S = np.array([0.0, 0.2, 0.5, 0.7])


def a_state(board, moving):
    rng = np.random.default_rng(0)
    turns = [exp_rotation(np.array([0.15, 0.05, 0.1]) * (k + 1)) for k in range(VIEWS)]
    boards = np.array(
        [np.column_stack([R, [5 * k, 3 * k, 300 + 4 * k]]) for k, R in enumerate(turns)]
    )
    cameras = np.array([np.eye(3, 4), np.column_stack([exp_rotation([0.1, 0.3, 0]), [10, 20, 30]])])
    one = [1000, 1010, 640, 360, -0.2, 0.1, 1e-3, -1e-3, 0.05]
    other = [900, 910, 600, 350, 0.1, 0.1, 1e-3, 2e-3, 0.05]
    return BundleState(
        np.array([one, other]),
        cameras,
        boards,
        board=np.append(rng.normal(0, 0.05, len(board.shape_sigma)), [0.01, 0.02, 0.3, -0.4]),
        points_mm=rng.normal(0, 0.1, board.corners_mm.shape),
        clock=np.array([0, 0.05]),
        pictures=rng.normal(0, OWN_SIGMA, (VIEWS, CAMERAS, N_PICTURE)),
        trajectory=Trajectory(TIMES_S, np.arange(CAMERAS)) if moving else None,
    )


def all_sightings(board):
    count = len(board.corners_mm)
    view, camera, corner = np.array(list(np.ndindex(VIEWS, CAMERAS, count))).T
    n = len(view)
    return Sightings(camera, view, corner, np.zeros((n, 2)), np.ones(n), 0.1 * camera)


def differences(board, state, seen, globals_step, view_step):
    none = np.zeros((VIEWS, CAMERAS, N_PICTURE))
    up = predict(state.move(globals_step, view_step, none), seen, board)[0]
    return up - predict(state.move(-globals_step, -view_step, none), seen, board)[0]


# Step of each parameter: central differences err by step² f‴/6, and by rounding of 1e-13 · 1e3 px / step.
STEPS = [1e-2] * 4 + [1e-4] * 5 + [1e-5] * 3 + [1e-3] * 3 + [1e-5]


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("board", [PLANE, FACED], ids=["plane", "body"])
def test_gradients_by_cameras_and_board_are_finite_differences(board, moving):
    state, seen = a_state(board, moving), all_sightings(board)
    J = predict(state, seen, board)[1]
    size = N_CAMERA * CAMERAS + len(state.board)
    for column in range(size):
        own = column < N_CAMERA * CAMERAS
        local = column % N_CAMERA if own else N_CAMERA + column - N_CAMERA * CAMERAS
        step = np.zeros(size)
        step[column] = STEPS[local] if own else 1e-4
        numeric = differences(board, state, seen, step, np.zeros((VIEWS, 6))) / (2 * step[column])
        of = seen.camera == column // N_CAMERA if own else np.ones(len(seen), dtype=bool)
        analytic = J[:, :, local] * of[:, None]
        np.testing.assert_allclose(analytic, numeric, atol=1e-6 * max(np.abs(numeric).max(), 1e-3))


@pytest.mark.parametrize("moving", [False, True])
def test_gradients_by_points_of_the_board_are_finite_differences(moving):
    state, seen = a_state(FACED, moving), all_sightings(FACED)
    by_point = predict_with_own(state, seen, FACED).by_point
    for axis in range(3):
        step = 1e-3 * np.eye(3)[axis]
        up, down = [replace(state, points_mm=state.points_mm + s) for s in (step, -step)]
        numeric = (predict(up, seen, FACED)[0] - predict(down, seen, FACED)[0]) / 2e-3
        largest = np.abs(numeric).max()
        np.testing.assert_allclose(by_point[:, :, axis], numeric, atol=1e-6 * largest)


def test_gradients_by_departures_from_the_path_are_finite_differences():
    state, seen = a_state(PLANE, moving=True), all_sightings(PLANE)
    by_departure = predict_with_own(state, seen, PLANE).by_departure
    for k in range(N_VIEW):
        step = 1e-5 if k < 3 else 1e-3
        ends = []
        for sign in (1, -1):
            pictures = state.pictures.copy()
            pictures[..., DEPARTURE.start + k] += sign * step
            ends.append(predict(replace(state, pictures=pictures), seen, PLANE)[0])
        numeric = (ends[0] - ends[1]) / (2 * step)
        np.testing.assert_allclose(
            by_departure[:, :, k], numeric, atol=1e-6 * np.abs(numeric).max()
        )


@pytest.mark.parametrize("moving", [False, True])
def test_gradients_by_board_poses_are_finite_differences(moving):
    state, seen = a_state(PLANE, moving), all_sightings(PLANE)
    J = predict(state, seen, PLANE)[1][:, :, N_CAMERA + N_BOARD :]
    touched = [seen.view]
    if moving:
        touched += list(state.trajectory.neighbours[seen.view].T)
    for view, k in np.ndindex(VIEWS, N_VIEW):
        step = np.zeros((VIEWS, 6))
        step[view, k] = 1e-5 if k < 3 else 1e-3
        still = np.zeros(N_CAMERA * CAMERAS + N_BOARD)
        numeric = differences(PLANE, state, seen, still, step) / (2 * step[view, k])
        analytic = sum(
            J[:, :, N_VIEW * b + k] * (who == view)[:, None] for b, who in enumerate(touched)
        )
        np.testing.assert_allclose(analytic, numeric, atol=1e-6 * np.abs(numeric).max())


def test_left_jacobian_is_that_of_the_exponential():
    w, d = np.array([0.4, -0.3, 0.7]), 1e-6 * np.array([0.3, 0.9, -0.2])
    moved = log_rotation(exp_rotation(w + d) @ exp_rotation(w).T)
    np.testing.assert_allclose(moved, left_jacobian(w) @ d, atol=1e-11)


def test_without_noise_cameras_come_out_exact():
    recording = a_recording(views=8)
    boards, rig = recording.seen(0.0, np.random.default_rng(0))
    made = calibrate_cameras(
        BoardViews(boards, dict.fromkeys(boards, SIZE_PX), rig), BOARD, MeasuredPose(T_RIG_BOARD)
    )
    for camera in made.cameras:
        # Corners carry 1e-9 px as sigma, the lens priors weigh against that by (1e-9)²; what is left is where the
        # adjustment stops: relative changes of the cost below 1e-8.
        np.testing.assert_allclose(
            camera.project(WORK_MM), recording.cameras[camera.name].project(WORK_MM), atol=1e-4
        )


def test_a_moving_board_seen_late_is_followed():
    """Two cameras look at a board in motion; the second is late by 40 ms and by 20 ms more or less."""
    rng, recording = np.random.default_rng(5), a_recording(views=2)
    times = np.arange(24) * 0.15
    late = np.column_stack([np.zeros(24), 0.04 + 0.02 * rng.standard_normal(24)])
    boards = {name: [] for name in recording.cameras.names}
    for k, t in enumerate(times):
        for c, camera in enumerate(recording.cameras):
            boards[camera.name].append(
                noisy_view_at(camera, moving_board(t + late[k, c]), 0.02, rng)
            )
    rig = recording.seen(0.02, rng)[1]
    sizes = dict.fromkeys(boards, SIZE_PX)
    views = BoardViews(boards, sizes, rig, times_s=dict.fromkeys(boards, times))
    made = calibrate_cameras(views, BOARD, MeasuredPose(T_RIG_BOARD))
    assert made.together and made.timing is not None
    assert any("held-out views" in note for note in made.notes)
    # The mean of 24 latenesses that scatter by 20 ms is known to 4 ms; four of these.
    assert abs(made.timing.offset_s[1] - made.timing.offset_s[0] - 0.04) < 0.016
    for camera in made.cameras:
        assert (
            np.abs(camera.project(WORK_MM) - recording.cameras[camera.name].project(WORK_MM)).max()
            < 0.25
        )


def test_a_shaken_board_seen_late_puts_no_lens_off():
    """A film at 30 frames a second of a board shaken at 4 Hz by 10 mm: between its frames it is up to 0.4 mm from the
    path through them, which put lenses 5 to 21 sigma off. Of 18 lens terms one in 1000 is off by 4."""
    cameras = a_recording(views=2).cameras
    boards = Film(shake_mm=10.0, frames=24).views(cameras, 0.05, np.random.default_rng(0))
    alone = {camera.name: camera_alone(camera, boards[camera.name], BOARD) for camera in cameras}
    layout = lay_out(alone, [camera.T_camera_rig for camera in cameras], together=True)
    priors = joint_priors(layout.first, BOARD, None, SharedLenses.none(2))
    priors = allow_lateness(priors, layout.trajectory, BOARD)
    first = replace(layout.first, trajectory=layout.trajectory)
    solution = adjust_with_noise(first, layout.seen, BOARD, priors).solution
    sigma = np.sqrt(np.diag(solution.covariance))
    for c, camera in enumerate(cameras):
        own = slice(N_CAMERA * c, N_CAMERA * c + 9)
        assert np.abs((solution.state.lens[c] - camera.lens) / sigma[own]).max() < 4.0


@pytest.mark.parametrize(
    "moved_mm, wrong_px, at_once", [(0.0, 0.0, True), (0.0, 3.0, True), (0.02, 0.0, False)]
)
def test_a_board_that_moves_by_less_than_a_corner_s_noise_is_noticed(moved_mm, wrong_px, at_once):
    """0.02 mm are 0.1 px of corners that are known to 0.05 px, but all of them alike; one wrong corner is no motion."""
    rng, cameras = np.random.default_rng(0), a_recording(views=2).cameras
    boards = {camera.name: [] for camera in cameras}
    for k in range(20):
        for camera in cameras:
            T = moving_board(0.7 * k)
            T[:, 3] += moved_mm * rng.standard_normal()
            boards[camera.name].append(noisy_view_at(camera, T, 0.05, rng))
    alone = {camera.name: camera_alone(camera, boards[camera.name], BOARD) for camera in cameras}
    layout = lay_out(alone, [camera.T_camera_rig for camera in cameras], together=True)
    layout.seen.px[300] += wrong_px
    priors = pose_priors(2, 20, BOARD)
    solution = adjust_bundle(layout.first, layout.seen, BOARD, priors, width=ROBUST_WIDTH)
    assert (chance_of_one_instant(solution, layout.seen, BOARD) > 0.01) == at_once


@pytest.mark.parametrize("sigma, each", [(1e-9, 0), (1e3, N_VIEW)])
def test_pictures_left_out_are_not_among_the_fitted(sigma, each):
    """Of seven parameters free to 1000 s, rad and mm a picture determines six, for its lateness moves the board, too; of
    seven free to 1e-9 none."""
    state, seen = a_state(PLANE, moving=True), all_sightings(PLANE)
    state = replace(state, pictures=np.zeros_like(state.pictures))
    seen = replace(seen, px=predict(state, seen, PLANE)[0])
    priors = pose_priors(CAMERAS, VIEWS, PLANE)
    priors = replace(priors, picture_sigma=np.full((CAMERAS, N_PICTURE), sigma))
    kept = seen.select((seen.view != 1) | (seen.camera != 1))
    starts = kept.shot_starts()
    strays = state.trajectory.may_stray(kept.view[starts], kept.camera[starts])
    fitted = adjust_bundle(state, kept, PLANE, priors).fitted_pictures
    assert fitted.sum() == pytest.approx(each * strays.sum(), abs=0.01)


def test_more_iterations_change_nothing_at_rest():
    recording = a_recording(views=6)
    boards, _ = recording.seen(0.05, np.random.default_rng(1))
    start = calibrate_alone(boards["high"], BOARD, SIZE_PX).solution.state
    corners = gather([(0, view, seen) for view, seen in enumerate(boards["high"])])
    priors = lens_priors(1, 6, BOARD)
    priors.free[9:15] = False
    settled = adjust_with_noise(start, corners, BOARD, priors)
    seen = settled.seen.select(settled.kept)
    again = adjust_bundle(settled.solution.state, seen, BOARD, settled.priors, tolerance=1e-14)
    sigma = np.sqrt(np.diag(again.covariance)[:9])
    assert np.all(np.abs(again.state.lens[0] - settled.solution.state.lens[0]) < 0.02 * sigma)


def test_cost_is_linear_in_views():
    from tests.studies.speed.cameras import seconds

    few, many = seconds(2, 15), seconds(2, 60)
    # Four times the views cost four times as much; a dense solve would cost up to 64 times. Twice for a busy machine.
    assert many < 8 * few
