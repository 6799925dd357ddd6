"""Two views of one picture, one of them in a mirror: one lens, poses by the board seen in both.

The rig's own cameras are the oracle: they share no code with what is tested.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bench.rig import boards, build
from bench.rig.protocol import load
from vision.boards.charuco import CharucoBoard
from vision.boards.corners import Corners
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.views import BoardViews, MeasuredPose
from vision.geometry.crop import Crop
from vision.geometry.refusals import Refused
from vision.geometry.rotation import apply

PROTOCOL = load("mirror")
T_RIG_BOARD = build.T_rig_board(PROTOCOL)
BOARD = CharucoBoard((7, 5), 10.0, 7.4, "DICT_5X5_100")
SIGMA_PX = 0.05
WHOLE_PX = (640, 1020)
CROPS = {
    "high": Crop("high", WHOLE_PX, 0, 490, 640, 530),
    "mirrored": Crop("high", WHOLE_PX, 0, 0, 640, 490, mirrored=True),
}
SEEDS = range(100, 112)
RIG_POINTS = np.array([[x, 0.0, z] for x in (20.0, 50.0, 80.0) for z in (-15.0, 0.0, 15.0)])


def true_cameras():
    return {camera.name: camera for camera in build.cameras(PROTOCOL)}


def seen(camera, T: np.ndarray, rng) -> Corners:
    px = camera.project(apply(T, BOARD.corners_mm))
    ids = np.flatnonzero(np.all((px > 5) & (px < np.array(camera.size_px) - 6), axis=1))
    noise = SIGMA_PX * rng.standard_normal((len(ids), 2))
    return Corners(ids, px[ids] + noise, np.full(len(ids), SIGMA_PX))


def views_of(seed: int, crops=CROPS) -> BoardViews:
    rng = np.random.default_rng(seed)
    cameras = true_cameras()
    poses = boards.draw_shared_poses(build.board(PROTOCOL), list(cameras.values()), 12, rng)
    held = {name: [seen(c, T, rng) for T in poses] for name, c in cameras.items()}
    rig = {name: seen(c, T_RIG_BOARD, rng) for name, c in cameras.items()}
    sizes_px = {name: c.size_px for name, c in cameras.items()}
    return BoardViews(held, sizes_px, rig, crops=crops)


@cache
def calibrated(seed: int):
    return calibrate_cameras(views_of(seed), BOARD, MeasuredPose(T_RIG_BOARD))


def test_both_views_have_one_lens_and_one_error_of_it():
    made = calibrated(100).cameras
    high, mirrored = made["high"].lens, made["mirrored"].lens
    whole = high + np.eye(9)[3] * CROPS["high"].top
    np.testing.assert_allclose(mirrored, CROPS["mirrored"].lens_of(whole), rtol=0, atol=1e-9)
    own = made.covariance[:9, :9]
    signs = CROPS["mirrored"].lens_signs
    np.testing.assert_allclose(made.covariance[15:24, 15:24], own * np.outer(signs, signs))
    np.testing.assert_allclose(made.covariance[:9, 15:24], own * signs)
    # What the errors' draws are made from says the same: c_x of the two views moves oppositely.
    c_x = made.by_error[2] + made.by_error[17]
    assert np.linalg.norm(c_x) < 1e-6 * np.linalg.norm(made.by_error[2])


def test_intervals_of_both_views_hold():
    truth = true_cameras()
    chi2 = []
    for seed in SEEDS:
        made = calibrated(seed).cameras
        for camera in made:
            px, _, J = camera.project_with_jacobians(RIG_POINTS)
            own = made.parameters_of(camera.name)
            Sigma = np.einsum("nij,jk,nlk->nil", J, made.covariance[own, own], J)
            error = px - truth[camera.name].project(RIG_POINTS)
            chi2.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(Sigma), error))
    # Points of one camera err together: some 6 of the 18 numbers of each of 24 cameras are independent,
    # so the mean of chi²/2 scatters by √(2/144) = 0.12.
    assert 0.55 < np.mean(chi2) / 2 < 1.5


def test_one_lens_is_known_better_than_two():
    shared = calibrated(100).cameras
    apart = calibrate_cameras(views_of(100, crops={}), BOARD, MeasuredPose(T_RIG_BOARD)).cameras
    for row in (0, 15):  # f_x
        assert shared.covariance[row, row] < 0.7 * apart.covariance[row, row]


def test_a_split_view_needs_no_more_than_one_view_of_its_own():
    views = views_of(1)
    few = [view if k < 2 else Corners.none() for k, view in enumerate(views.boards["mirrored"])]
    views = replace(views, boards={**views.boards, "mirrored": few})
    made = calibrate_cameras(views, BOARD, MeasuredPose(T_RIG_BOARD))
    assert [report.views for report in made.report] == [12, 2]


def test_without_the_rig_s_board_the_views_are_placed_by_the_board_in_both():
    made = calibrate_cameras(replace(views_of(2), rig={}), BOARD, None).cameras
    truth = true_cameras()
    apart_mm = np.linalg.norm(truth["high"].centre_mm - truth["mirrored"].centre_mm)
    found_mm = np.linalg.norm(made["high"].centre_mm - made["mirrored"].centre_mm)
    assert abs(found_mm - apart_mm) < 2e-3 * apart_mm  # some sigmas of f_x over f_x


def test_a_board_that_is_never_in_both_views_places_none():
    views = replace(views_of(3), rig={})
    none = Corners.none()
    high = [view if k % 2 else none for k, view in enumerate(views.boards["high"])]
    mirrored = [none if k % 2 else view for k, view in enumerate(views.boards["mirrored"])]
    views = replace(views, boards={"high": high, "mirrored": mirrored})
    with pytest.raises(Refused, match="camera mirrored never sees the board at the same time"):
        calibrate_cameras(views, BOARD, None)
