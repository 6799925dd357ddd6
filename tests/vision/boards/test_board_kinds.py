"""Boards of every kind, in pictures by a known camera: points unbiased, as sure as they say."""

import cv2
import numpy as np
import pytest

from tests.scenes.board_prints import KINDS, NAMES, picture_of, pose_before
from tests.studies.accuracy.board_scenes import two_cameras
from vision.boards import (
    AprilGrid,
    AsymmetricCircles,
    CharucoBoard,
    Checkerboard,
    CircleGrid,
    find_corners,
)
from vision.boards.circle_grid import perspective_shift
from vision.boards.saddle_board import SaddleBoard
from vision.geometry import lens
from vision.geometry.refusals import Refused
from vision.geometry.rotation import apply, exp_rotation

CAMERA = two_cameras()["high"]
# Kalibr's y goes up: its boards are looked at from the other side of their z.
_UPRIGHT = {"aprilgrid": np.diag([1.0, -1.0, -1.0])}


def seen(board, rng, middle_mm=(0.0, 0.0, 400.0), tilt=0.5):
    """A picture of a board at a random tilt, and the true places of its points, px."""
    lean = exp_rotation(np.array([*rng.uniform(-tilt, tilt, 2), 0.0]))
    turn = exp_rotation(np.array([0.0, 0.0, rng.uniform(-0.4, 0.4)])) @ lean
    T = pose_before(board, CAMERA, middle_mm, turn @ _UPRIGHT.get(board.kind, np.eye(3)))
    true_px = lens.project(apply(T, board.corners_mm), CAMERA.lens)
    return picture_of(board, CAMERA, T, rng), true_px


def errors(found, true_px, board):
    """Errors (n, 2) px of points, under the names that no picture can tell from the right ones."""
    names = (np.arange(len(true_px)), *board.hidden_turns)
    return min((found.px - true_px[n][found.ids] for n in names), key=lambda e: np.abs(e).sum())


@pytest.mark.parametrize("board", KINDS, ids=NAMES)
def test_points_are_unbiased_and_as_sure_as_they_say(board):
    rng = np.random.default_rng(5)
    off, z = [], []
    for _ in range(2):
        grey, true_px = seen(board, rng)
        found = find_corners(grey, board)
        assert len(found) > 0.9 * len(board.corners_mm)
        off.append(errors(found, true_px, board))
        z.append(off[-1] / found.sigma_px[:, None])
    off, z = np.concatenate(off), np.concatenate(z)
    # noise of 2 grey levels at a contrast of 165: some 0.005 px; 140 values or more scatter by 6 %
    assert np.abs(off.mean(axis=0)).max() < 0.003
    assert 0.7 < np.sqrt(np.mean(z**2)) < 1.25


@pytest.mark.parametrize("board", KINDS[1:], ids=NAMES[1:])
def test_a_board_that_is_found_needs_no_word_and_another_gets_one(board):
    grey, _ = seen(board, np.random.default_rng(1), tilt=0.2)
    assert board.why_not_found([grey]) is None
    blank = np.full_like(grey, 128)
    assert find_corners(blank, board).ids.size == 0
    words = board.why_not_found([blank])
    assert words and "\n" not in words


def test_a_checkerboard_of_another_size_or_cut_off_is_named():
    board = Checkerboard((8, 7), 13.0)
    rng = np.random.default_rng(2)
    grey, _ = seen(board, rng, tilt=0.1)
    assert "one of 8 x 7 is" in Checkerboard((10, 7), 13.0).why_not_found([grey])
    cut, _ = seen(board, rng, middle_mm=(-100.0, 0.0, 400.0), tilt=0.1)
    assert len(find_corners(cut, board)) == 0
    assert "beyond the picture's edge" in board.why_not_found([cut])


def test_only_squares_of_like_parity_hide_half_a_turn():
    assert Checkerboard((8, 7), 13.0).hidden_turns == ()
    assert len(Checkerboard((9, 7), 13.0).hidden_turns) == 1
    assert len(Checkerboard((7, 7), 13.0).hidden_turns) == 3
    assert len(CircleGrid((5, 5), 10.0, 5.0).hidden_turns) == 3
    assert AsymmetricCircles((4, 11), 10.0, 5.0).hidden_turns == ()
    assert CharucoBoard((8, 6), 15.0, 11.0, "DICT_5X5_100").hidden_turns == ()


def test_a_checkerboard_upside_down_is_named_by_its_colours():
    board = Checkerboard((8, 7), 13.0)
    rng = np.random.default_rng(3)
    T = pose_before(board, CAMERA, (0.0, 0.0, 400.0), exp_rotation(np.array([0.0, 0.0, np.pi])))
    true_px = lens.project(apply(T, board.corners_mm), CAMERA.lens)
    found = find_corners(picture_of(board, CAMERA, T, rng), board)
    assert np.abs(found.px - true_px[found.ids]).max() < 0.1


def test_a_circle_s_picture_is_off_the_picture_of_its_centre_as_computed():
    """The ellipse through a tilted circle's rim, fitted by OpenCV, against the closed form."""
    board = CircleGrid((6, 5), 20.0, 14.0)
    K = np.array([[900.0, 0.0, 400.0], [0.0, 900.0, 300.0], [0.0, 0.0, 1.0]])
    turn = exp_rotation(np.array([0.6, -0.5, 0.2]))
    shift = np.array([-40.0, -30.0, 300.0])

    def project(points):
        p = (points @ turn.T + shift) @ K.T
        return p[:, :2] / p[:, 2:]

    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    rim = 7.0 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    centres = np.array(
        [cv2.fitEllipse(project(c + rim).astype(np.float32))[0] for c in board.corners_mm]
    )
    shift_px = perspective_shift(centres, board.corners_mm[:, :2], 7.0)
    assert np.abs(shift_px).max() > 0.2
    # float32 and OpenCV's algebraic fit leave some 0.003 px
    np.testing.assert_allclose(centres - shift_px, project(board.corners_mm), atol=0.02)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: Checkerboard((3, 8), 10.0), "4 or more each way"),
        (lambda: CircleGrid((5, 4), 10.0, 12.0), "touch each other"),
        (lambda: AprilGrid((6, 6), 10.0, 12.0), "not smaller than square_mm"),
        (lambda: AprilGrid((30, 30), 10.0, 8.0), "there are 587"),
    ],
)
def test_a_board_that_cannot_be_is_refused(make, words):
    with pytest.raises(Refused, match=words):
        make()


def test_an_aprilgrid_is_found_in_noise():
    """Unsmoothed, outlines of most tags are taken a module inside them, and on no plane."""
    board = next(board for board in KINDS if board.kind == "aprilgrid")
    lean = exp_rotation(np.array([0.3, 0.1, 0.0])) @ _UPRIGHT[board.kind]
    T = pose_before(board, CAMERA, (0.0, 0.0, 400.0), lean)
    grey = picture_of(board, CAMERA, T, np.random.default_rng(5), noise=8.0)
    true_px = lens.project(apply(T, board.corners_mm), CAMERA.lens)
    found = find_corners(grey, board)
    assert len(found) > 0.9 * len(board.corners_mm)
    assert np.abs((found.px - true_px[found.ids]) / found.sigma_px[:, None]).max() < 4.5


def test_a_row_that_is_the_board_s_edge_is_no_checkerboard():
    """OpenCV takes the edge for a row where the last one is out of the picture: all names are wrong then."""
    board = Checkerboard((8, 7), 13.0)
    T = pose_before(board, CAMERA, (0.0, 0.0, 400.0), np.eye(3))
    grey = picture_of(board, CAMERA, T, np.random.default_rng(5))
    row_up = board.corners_mm - [0.0, board.square_mm, 0.0]
    guess_px = lens.project(apply(T, row_up), CAMERA.lens)
    ids = np.arange(len(guess_px))
    assert len(SaddleBoard.refine(board, grey, guess_px, ids)) >= 30
    assert len(board.refine(grey, guess_px, ids)) == 0
