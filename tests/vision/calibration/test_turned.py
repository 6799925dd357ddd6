"""A board that looks the same after half a turn: named alike in both cameras, whatever each saw first."""

import numpy as np

from tests.studies.accuracy.board_scenes import T_RIG_BOARD, noisy, rig_view, two_cameras
from vision.boards import Checkerboard
from vision.calibration.turned import with_turns_resolved
from vision.calibration.views import BoardViews
from vision.geometry.rotation import apply, compose, exp_rotation, invert_transform

BOARD = Checkerboard((9, 7), 12.0)


def both_saw(rng, count=10):
    """Views of one board by both cameras at once, with names turned at random; and the true names."""
    cameras = two_cameras()
    high = cameras["high"]
    named = (np.arange(len(BOARD.corners_mm)), BOARD.hidden_turns[0])
    boards = {camera.name: [] for camera in cameras}
    turned = {camera.name: rng.integers(0, 2, count) for camera in cameras}
    for k in range(count):
        spin = exp_rotation(np.array([0.0, 0.0, rng.uniform(-0.5, 0.5)]))
        turn = spin @ exp_rotation(np.array([*rng.uniform(-0.5, 0.5, 2), 0.0]))
        middle = np.array([*rng.uniform(-15, 15, 2), 390.0 * rng.uniform(0.9, 1.15)])
        T_high_board = np.column_stack([turn, middle - turn @ BOARD.corners_mm.mean(axis=0)])
        T_rig_board = compose(invert_transform(high.T_camera_rig), T_high_board)
        for camera in cameras:
            px = camera.project(apply(T_rig_board, BOARD.corners_mm))
            boards[camera.name].append(noisy((named[turned[camera.name][k]], px), 0.03, rng))
    rig = {}
    for camera, turn in zip(cameras, (0, 1)):
        ids, px = rig_view(camera, T_RIG_BOARD, BOARD.corners_mm)
        rig[camera.name] = noisy((named[turn][ids], px), 0.03, rng)
    sizes_px = {camera.name: camera.size_px for camera in cameras}
    return BoardViews(boards, sizes_px, rig), turned


def test_points_are_named_as_in_the_first_camera():
    views, turned = both_saw(np.random.default_rng(0))
    assert np.any(turned["high"] != turned["low"])
    found = with_turns_resolved(views, BOARD)
    for high, low in zip(found.boards["high"], found.boards["low"]):
        np.testing.assert_array_equal(high.ids, low.ids)
    rig = [found.rig[name].ids for name in ("high", "low")]
    assert rig[0][0] == 0 and rig[1][0] == 0


def test_a_board_that_shows_how_it_lies_is_left_as_it_is():
    views, _ = both_saw(np.random.default_rng(1), count=1)
    assert with_turns_resolved(views, Checkerboard((10, 7), 12.0)) is views
