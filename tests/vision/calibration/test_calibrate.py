"""Calibration against the truth of a recorded-like session, and refusals that say what to record."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.studies.accuracy.board_scenes import (
    BOARD,
    SIZE_PX,
    T_RIG_BOARD,
    WORK_MM,
    a_recording,
    moving_board,
    noisy,
    noisy_view_at,
)
from vision.boards.corners import Corners
from vision.boards.static_board import camera_moved, mean_view
from vision.boards.sufficiency import check_lens
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.normal_equations import common_modes
from vision.calibration.views import BoardViews, MeasuredPose
from vision.geometry.board import printed_corners
from vision.geometry.camera import Camera
from vision.geometry.refusals import Refused
from vision.geometry.rotation import apply, exp_rotation
from vision.geometry.triangulate import triangulate

SIGMA_PX = 0.04
# The session's contract: 0 to 100 mm along x, a bar's ± 30 mm to either side.
RIG_POINTS = np.array(
    [[x, 0.0, z] for x in np.linspace(0, 100, 11) for z in (-30.0, -15.0, 0.0, 15.0, 30.0)]
)
ON_RIG_MM = apply(T_RIG_BOARD, BOARD.corners_mm)
# A print that came out 0.3 % longer along y than along x.
STRETCH = 0.003
STRETCHED_MM = BOARD.corners_mm * [1 - STRETCH / 2, 1 + STRETCH / 2, 1.0]


@pytest.fixture(scope="module")
def steel_views(small_session):
    from bench.cameras.board_views import read_board_views
    from bench.session.session import load_session

    session = load_session(small_session)
    return session, read_board_views(session)


@pytest.fixture(scope="module")
def true_cameras(small_session):
    truth = json.loads((small_session / "truth.json").read_text())["cameras"]
    return {
        name: Camera(
            name, (t["width"], t["height"]), t["K"], t["dist"], np.column_stack([t["R"], t["t"]])
        )
        for name, t in truth.items()
    }


def test_a_recorded_session_against_its_truth(steel_views, true_cameras):
    from bench.cameras.calibrate_session import calibrate_from

    made = calibrate_from(*steel_views)
    for camera in made.cameras:
        px, _, J = camera.project_with_jacobians(RIG_POINTS)
        own = made.cameras.parameters_of(camera.name)
        sigma = np.sqrt(np.einsum("nij,jk,nik->ni", J, made.cameras.covariance[own, own], J))
        error = px - true_cameras[camera.name].project(RIG_POINTS)
        assert np.abs(error).max() < 0.10
        assert np.abs(error / sigma).max() < 3.0
        assert np.median(sigma) < 0.05  # honest, and not by being wide


def test_corners_of_the_rig_picture_are_as_sure_as_they_say(steel_views, true_cameras):
    session, views = steel_views
    points = session.board.corners_mm @ session.T_rig_board[:, :3].T + session.T_rig_board[:, 3]
    for name, view in views.rig.items():
        error = view.px - true_cameras[name].project(points)[view.ids]
        # 70 values scatter by 8 %; the print's own picture errs a little beside the noise.
        assert 0.75 < np.sqrt(np.mean((error / view.sigma_px[:, None]) ** 2)) < 1.4
        assert error.std() < 0.045


def test_the_mean_over_the_trials_is_better_than_one_picture(steel_views, true_cameras):
    session, views = steel_views
    points = session.board.corners_mm @ session.T_rig_board[:, :3].T + session.T_rig_board[:, 3]
    for name, view in views.rig.items():
        mean = mean_view(view, views.trials[name])
        truth = true_cameras[name].project(points)
        assert (mean.px - truth[mean.ids]).std() < 0.6 * (view.px - truth[view.ids]).std()


def calibrated(boards, rig, *sigmas, board=BOARD, **how):
    views = BoardViews(boards, dict.fromkeys(boards, SIZE_PX), rig)
    return calibrate_cameras(views, board, MeasuredPose(T_RIG_BOARD, *sigmas), **how)


@pytest.fixture(scope="module")
def recording():
    return a_recording(views=10)


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def test_a_wild_corner_is_left_out(recording, rng):
    boards, rig = recording.seen(SIGMA_PX, rng)
    first = boards["high"][0]
    wild = first.px.copy()
    wild[3] += [2.0, -1.0]
    boards["high"][0] = replace(first, px=wild)
    made = calibrated(boards, rig)
    assert made.report[0].left_out >= 1
    error = made.cameras["high"].project(WORK_MM) - recording.cameras["high"].project(WORK_MM)
    assert np.abs(error).max() < 0.25


def test_errors_larger_than_stated_are_noticed(recording, rng):
    """Corners that say 0.02 px and err by 0.1 px: the model error makes up for it."""
    boards, rig = recording.seen(0.1, rng)
    boards = {
        n: [Corners(v.ids, v.px, 0.2 * v.sigma_px) for v in views] for n, views in boards.items()
    }
    made = calibrated(boards, rig)
    for report in made.report:
        # 700 values scatter by 3 %, ten parameters' share besides.
        assert abs(report.error_px - 0.098) < 0.012


def test_the_rig_board_s_own_error_reaches_every_camera(recording, rng):
    boards, rig = recording.seen(SIGMA_PX, rng)
    exact = calibrated(boards, rig).cameras
    loose = calibrated(boards, rig, 0.5).cameras
    added = loose.covariance - exact.covariance
    R = [c.T_camera_rig[:, :3] for c in exact]
    for a in (0, 1):
        for b in (0, 1):  # shared: the cross term is as large as the own
            block = added[15 * a + 12 : 15 * a + 15, 15 * b + 12 : 15 * b + 15]
            np.testing.assert_allclose(block, 0.25 * R[a] @ R[b].T, atol=0.02)


def test_a_square_s_own_error_is_an_observation(recording, rng):
    boards, rig = recording.seen(SIGMA_PX, rng)
    unsure = replace(BOARD, square_sigma_mm=0.15)  # 1 %
    made = calibrated(boards, rig, board=unsure)
    exact = calibrated(boards, rig)
    camera = made.cameras["high"]
    # A board grown about its origin looks the same from a camera that stands farther from that origin by as much.
    depth = (camera.T_camera_rig[:, :3] @ T_RIG_BOARD[:, 3] + camera.T_camera_rig[:, 3])[2]
    before, after = (np.sqrt(c.cameras.covariance[14, 14]) for c in (exact, made))
    assert after**2 - before**2 == pytest.approx((0.01 * depth) ** 2, rel=0.1)


@pytest.fixture(scope="module")
def stretched():
    return a_recording(views=10, printed_mm=STRETCHED_MM)


@pytest.mark.parametrize("error_mm", [0.0, 0.05])
def test_points_of_a_print_come_back(rng, error_mm):
    """Twelve views of a camera, 0.04 px a corner: to 0.004 mm in four draws; an exact print moves by 0.0005 mm at most."""
    errors_mm = rng.normal(0.0, error_mm, BOARD.corners_mm.shape)
    printed_mm = BOARD.corners_mm + errors_mm
    views = a_recording(views=12, printed_mm=printed_mm).seen(SIGMA_PX, rng)[0]["high"]
    made = calibrate_cameras(BoardViews({"high": views}, {"high": SIZE_PX}), BOARD, None)
    modes = common_modes(BOARD, np.arange(len(errors_mm)))
    left_mm = (made.points_mm - errors_mm).ravel()
    left_mm -= modes @ (modes.T @ left_mm)
    assert np.sqrt(np.mean(left_mm**2)) < 0.002 + 0.1 * error_mm
    assert any("points lie" in note for note in made.notes) == (error_mm > 0.0)


def test_a_stretched_print_is_found_within_its_sigma_and_named(stretched, rng):
    unsure = replace(BOARD, stretch_sigma=0.001)
    z = []
    for _ in range(6):
        made = calibrated(*stretched.seen(SIGMA_PX, rng), board=unsure)
        z.append((made.board[1] - STRETCH) / np.sqrt(made.board_covariance[1, 1]))
        assert made.warnings[0].codes == ("board_stretched",)
        assert any("longer along y than along x by +0." in note for note in made.notes)
    # chi² of six Gaussian draws lies between these in 99.8 of 100 cases.
    assert 0.38 < np.sum(np.square(z)) < 22.5


def test_a_stretch_that_its_sigma_lets_be_is_no_warning(stretched, rng):
    unsure = replace(BOARD, stretch_sigma=0.002)
    made = calibrated(*stretched.seen(SIGMA_PX, rng), board=unsure)
    assert not made.warnings and made.board[1] == pytest.approx(STRETCH, abs=5e-4)


def test_lengths_by_a_stretched_board_hold_within_their_sigma(stretched, rng):
    z = {0.0: [], 0.001: []}
    for _ in range(6):
        boards, rig = stretched.seen(SIGMA_PX, rng)
        for sigma, deviations in z.items():
            made = calibrated(boards, rig, board=replace(BOARD, stretch_sigma=sigma))
            deviations.append(_length_deviations(made.cameras, stretched.cameras))
    rms = {sigma: np.sqrt(np.mean(np.square(deviations))) for sigma, deviations in z.items()}
    # Three lengths in six draws: the RMS of 18 Gaussian deviations lies between these in 99.8 of 100 cases.
    assert 0.52 < rms[0.001] < 1.52
    assert rms[0.0] > 3.0  # taken as exact, the print's stretch is in every length


def _length_deviations(made, true):
    """Triangulated lengths along x, z and y of the rig less the true ones, over their stated sigmas."""
    ends_mm = np.array([[0, 0, 0], [100, 0, 0], [0, 0, 30], [0, 30, 0]], dtype=float)
    px = {camera.name: camera.project(ends_mm) for camera in true}
    points = triangulate(made, px, {name: np.full(len(ends_mm), 1e-3) for name in px})
    along = (ends_mm[1:] - ends_mm[0]) / np.linalg.norm(ends_mm[1:], axis=1)[:, None]
    by_cameras = np.einsum("ni,nij->nj", along, points.by_cameras[1:] - points.by_cameras[0])
    sigma_mm = np.sqrt(np.einsum("nj,jk,nk->n", by_cameras, made.covariance, by_cameras))
    lengths_mm = np.linalg.norm(points.mm[1:] - points.mm[0], axis=1)
    return (lengths_mm - np.linalg.norm(ends_mm[1:], axis=1)) / sigma_mm


def test_an_upright_board_leaves_its_stretch_as_unsure_as_stated(rng):
    """A board never turned in its plane, nor tilted by much: pixels that are not square explain the same."""
    upright = a_recording(views=10, tilt_rad=0.2, spin_rad=0.0, printed_mm=STRETCHED_MM)
    boards, rig = upright.seen(SIGMA_PX, rng)
    made = calibrated(boards, rig, board=replace(BOARD, stretch_sigma=0.001))
    assert np.sqrt(made.board_covariance[1, 1]) > 0.0008 and not made.warnings


def test_a_camera_that_stands_still_before_a_stretched_board_has_not_moved(stretched, rng):
    boards, rig = stretched.seen(SIGMA_PX, rng)
    made = calibrated(boards, rig, board=replace(BOARD, stretch_sigma=0.001))
    as_printed, _ = printed_corners(BOARD.corners_mm, made.board)
    later = noisy(stretched.rig["high"], SIGMA_PX, rng)
    camera = made.cameras["high"]
    shift_px, _ = camera_moved(camera, later, apply(T_RIG_BOARD, as_printed))
    as_stated_px, _ = camera_moved(camera, later, ON_RIG_MM)
    # Forty corners of 0.04 px place the board to 0.015 px, in both pictures.
    assert shift_px < 0.1 and as_stated_px > 0.3


def few(boards, rig):
    return {n: v[:4] for n, v in boards.items()}, rig


def without_rig_board(boards, rig):
    return boards, rig | {"low": Corners.none()}


@pytest.mark.parametrize(
    "spoil, words", [(few, "well seen in 4 views"), (without_rig_board, "camera low: 0 corners")]
)
def test_too_little_is_refused(recording, rng, spoil, words):
    with pytest.raises(Refused, match=words):
        calibrated(*spoil(*recording.seen(SIGMA_PX, rng)))


@pytest.mark.parametrize("how", [{"tilt_rad": 0.02}, {"tilt_rad": 0.19, "depth": (0.99, 1.01)}])
def test_views_that_hardly_settle_a_lens_give_a_sigma_that_holds(rng, how):
    recording = a_recording(views=10, **how)
    made = calibrated(*recording.seen(SIGMA_PX, rng))
    for camera in made.cameras:
        own = made.cameras.parameters_of(camera.name)
        focal_sigma = np.sqrt(made.cameras.covariance[own, own][0, 0])
        # Nine lenses in 400 are 2.3 sigma off: two of four here are more rarely than once in 300.
        assert abs(camera.lens[0] - recording.cameras[camera.name].lens[0]) < 2.3 * focal_sigma


def test_views_that_do_not_settle_a_lens_are_refused_with_what_to_record(rng):
    upright = a_recording(views=10, tilt_rad=0.0, depth=(0.99, 1.01))
    words = "focal length is known to .* %, 2 % is allowed; the board was tilted by up to"
    with pytest.raises(Refused, match=words):
        calibrated(*upright.seen(0.2, rng))


def test_work_outside_all_views_is_refused(recording, rng):
    aside = np.array(
        [[x, 0.0, 0.0] for x in np.linspace(100, 140, 5)]
    )  # in the picture, right of every view
    boards, rig = recording.seen(SIGMA_PX, rng)
    left = {n: [v.select(v.px[:, 0] < 700) for v in views] for n, views in boards.items()}
    rig = {n: v.select(v.px[:, 0] < 700) for n, v in rig.items()}
    with pytest.raises(
        Refused, match=r"whisker and bar will be lies outside .* at the right of the picture"
    ):
        calibrated(left, rig, work_points_mm=aside)


def suzie(matrix, distortion):
    return Camera("suzie", (1920, 1080), matrix, distortion, np.eye(3, 4))


def test_over_fitted_lenses_are_refused():
    """Two calibrations of the public repository suzie13/Whisker-Robot-Project, 1920 x 1080."""
    wild = [
        -2.912144150739864,
        0.011063557294453519,
        -0.27781540758819406,
        0.11957148513743394,
        625.4938967961976,
    ]
    folded = [
        -0.23820125090035102,
        3.6368781282348848,
        -0.0030323996843331486,
        -0.0076102186785494685,
        -16.363127666,
    ]
    with pytest.raises(Refused, match="differ by 13 %"):
        check_lens(suzie([[3753.7, 0, 545.4], [0, 3323.4, 683.4], [0, 0, 1]], wild))
    with pytest.raises(Refused, match="p1 or p2"):
        check_lens(suzie([[3753.7, 0, 545.4], [0, 3753.4, 683.4], [0, 0, 1]], wild))
    with pytest.raises(Refused, match="folds the picture"):
        check_lens(suzie([[1361.7, 0, 939.4], [0, 1349.9, 574.2], [0, 0, 1]], folded))


def test_a_camera_that_stands_still_has_not_moved(recording, rng):
    camera = recording.cameras["high"]
    shifts = [
        np.divide(*camera_moved(camera, noisy(recording.rig["high"], SIGMA_PX, rng), ON_RIG_MM))
        for _ in range(40)
    ]
    # The shift is a root mean square over six fitted parameters: about one sigma, rarely two.
    assert 0.5 < np.mean(shifts) < 1.5 and max(shifts) < 2.5


def test_a_knock_of_a_tenth_of_a_degree_is_seen(recording, rng):
    camera = recording.cameras["high"]
    turn, t = np.array([np.radians(0.1), 0, 0]), camera.T_camera_rig[:, 3]
    knocked = camera.moved(
        np.concatenate([np.zeros(9), turn, np.cross(turn, t)])
    )  # about its own centre
    shift, sigma = camera_moved(knocked, noisy(recording.rig["high"], SIGMA_PX, rng), ON_RIG_MM)
    # 2000 px of focal length times 0.1 degrees.
    assert shift == pytest.approx(3.5, abs=0.5) and sigma < 0.05


def test_disturbed_corners_do_not_enter_the_mean(rng):
    exact = a_recording(views=1).rig["high"]
    frames = [noisy(exact, SIGMA_PX, rng) for _ in range(30)]
    for frame in frames[:20]:  # a rod beside corner 2 in most frames, always on the same side
        frame.px[2] += [0.6, 0.1]
    mean = mean_view(noisy(exact, SIGMA_PX, rng), frames)
    assert np.abs(mean.px - exact[1]).max() < 5 * SIGMA_PX / np.sqrt(11)
    assert mean.sigma_px[2] > mean.sigma_px[1]


@pytest.mark.slow
def test_predicted_sigmas_are_the_sampled_ones():
    """The small form of tests/studies/accuracy/cameras_montecarlo.py, which draws a thousand."""
    from tests.studies.accuracy.cameras_montecarlo import sample_calibrations

    for sample in sample_calibrations(80, seed=3, views=8):
        # 80 draws of some eight independent directions: the pooled ratio scatters by 1/√(2·640) = 2.8 %.
        assert abs(np.sqrt(np.mean((sample.error / sample.sigma) ** 2)) - 1) < 0.11
        assert 0.92 < sample.coverage < 0.98


@pytest.mark.slow
@pytest.mark.parametrize("rig", [{}, {"rig_sigma_mm": 0.1, "rig_sigma_rad": np.radians(0.1)}])
def test_a_thousand_calibrations(rig):
    from tests.studies.accuracy.cameras_montecarlo import sample_calibrations

    for sample in sample_calibrations(1000, seed=0, **rig):
        # A standard deviation of 1000 draws scatters by 2.2 %.
        assert np.abs(sample.ratio - 1).max() < 0.10
        assert 0.93 < sample.coverage < 0.97


def elsewhere(T, rng):
    """The pose T of a board, held by hand a second time: 2 degrees and 4 mm off, each about an axis."""
    turn = exp_rotation(np.radians(2.0) * rng.standard_normal(3))
    middle = T[:, :3] @ BOARD.corners_mm.mean(axis=0) + T[:, 3] + 4.0 * rng.standard_normal(3)
    return np.column_stack(
        [turn @ T[:, :3], middle - turn @ T[:, :3] @ BOARD.corners_mm.mean(axis=0)]
    )


@pytest.fixture
def same_order(recording, rng):
    """Each camera's own series of the same fourteen poses, in one order, a hand's accuracy apart; rig views."""
    poses = [moving_board(0.9 * k) for k in range(14)]
    boards = {
        c.name: [noisy_view_at(c, elsewhere(T, rng), SIGMA_PX, rng) for T in poses]
        for c in recording.cameras
    }
    return boards, recording.seen(SIGMA_PX, rng)[1]


def test_series_of_their_own_that_look_alike_are_each_camera_s_own(recording, same_order):
    """Taken for views that both cameras had at once, they gave lenses 20 % off, or were refused for another cause."""
    made = calibrated(*same_order)
    assert not made.together and made.timing is None
    assert any("they did not: so taken, corners of camera" in note for note in made.notes)
    for report, camera in zip(made.report, made.cameras):
        assert report.rms_px < 2 * SIGMA_PX and report.left_out == 0
        assert (
            np.abs(camera.lens - recording.cameras[camera.name].lens)[0]
            < 5 * report.intrinsics_sigma[0]
        )


def test_series_of_their_own_do_not_place_cameras(same_order):
    boards, _ = same_order
    with pytest.raises(
        Refused,
        match=r"by itself 0\.0. px; record views that all cameras see at once, a board at rest",
    ):
        calibrate_cameras(BoardViews(boards, dict.fromkeys(boards, SIZE_PX)), BOARD, None)


@pytest.fixture
def single_shots(recording, rng):
    """A board in the hand, shot every seven seconds, which moves before the second camera's picture."""
    boards = {camera.name: [] for camera in recording.cameras}
    for k in range(24):
        T = moving_board(7.3 * k)
        for camera, moved_mm in zip(recording.cameras, (0.0, 0.12)):
            shifted = T + np.column_stack([np.zeros((3, 3)), moved_mm * rng.standard_normal(3)])
            boards[camera.name].append(noisy_view_at(camera, shifted, SIGMA_PX, rng))
    return boards, recording.seen(SIGMA_PX, rng)[1]


def test_single_shots_of_a_hand_held_board_get_no_instants_but_a_warning(single_shots):
    boards, _ = single_shots
    made = calibrate_cameras(BoardViews(boards, dict.fromkeys(boards, SIZE_PX)), BOARD, None)
    assert made.timing is None and made.together
    assert [warning.codes for warning in made.warnings] == [("boards_not_at_once",)]
    assert "held-out views" in made.warnings[0]


def test_single_shots_with_a_board_on_the_rig_are_each_camera_s_own(single_shots):
    made = calibrated(*single_shots)
    assert made.timing is None and not made.together and not made.warnings
    assert any("pictures late by an offset do not explain it" in note for note in made.notes)


def test_views_that_no_lens_explains_are_refused(recording, rng):
    """A board that bends as it is held: each view another way."""
    boards, rig = recording.seen(SIGMA_PX, rng)
    for view in boards["high"]:
        view.px[:, 1] += 2.0 * np.sin(
            BOARD.corners_mm[view.ids, 0] / 20.0 + rng.uniform(0, 2 * np.pi)
        )
    with pytest.raises(
        Refused, match=r"camera high: corners are off by .* px an axis .*: the board is not flat"
    ):
        calibrated(boards, rig)
