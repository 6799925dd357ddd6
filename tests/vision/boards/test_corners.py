"""Corners: unbiased, as sure as they say, and silent about what is hidden or disturbed."""

import cv2
import numpy as np
import pytest

from tests.scenes.board_pictures import UPRIGHT_H, picture, true_px
from tests.studies.accuracy.board_scenes import BOARD
from vision.boards.charuco import CharucoBoard
from vision.boards.corners import Corners, detect, find_corners, refine_corners


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def test_opencv_s_corners_are_not_half_a_pixel_off(rng):
    """OpenCV 4.12 and 4.13 are: +0.50 px on both axes. Its scatter here is below 0.1 px, its mean far below."""
    ids, px = detect(picture(BOARD, rng), BOARD)
    assert np.all(np.abs((px - true_px(BOARD)[ids]).mean(axis=0)) < 0.1)


def test_corners_without_noise(rng):
    found = find_corners(picture(BOARD, rng), BOARD)
    error = found.px - true_px(BOARD)[found.ids]
    assert len(found) == len(BOARD.corners_mm)
    # Grey is rounded to whole levels (0.3 of 150) and looked at 4 x 4 times a pixel: some 0.005 px.
    assert np.abs(error.mean(axis=0)).max() < 0.003
    assert error.std() < 0.01


@pytest.mark.parametrize("correlated", [False, True])
def test_sigma_is_the_scatter(rng, correlated):
    errors, sigmas = [], []
    for _ in range(6):
        found = find_corners(picture(BOARD, rng, noise=8.0, correlated=correlated), BOARD)
        errors.append((found.px - true_px(BOARD)[found.ids]).ravel())
        sigmas.append(np.repeat(found.sigma_px, 2))
    ratio = np.sqrt(np.mean((np.concatenate(errors) / np.concatenate(sigmas)) ** 2))
    # 420 values: the ratio scatters by 3.4 %; pixels' noise is taken as separable and alike all over: ± 10 % more.
    assert 0.8 < ratio < 1.2
    assert np.median(np.concatenate(sigmas)) < (0.06 if correlated else 0.03)


def test_edges_as_sharp_as_a_pixel_along_its_rows_are_corners(rng):
    """Between two pixels' middles such an edge has no place of its own, and webcams sharpen theirs."""
    grey = picture(BOARD, rng, noise=2.0, blur_px=0.0, is_upright=True)
    found = find_corners(grey, BOARD)
    assert len(found) == len(BOARD.corners_mm)
    # The picture looks at the print 4 times a pixel.
    assert np.abs(found.px - true_px(BOARD, UPRIGHT_H)[found.ids]).max() < 0.125
    assert found.sigma_px.max() < 0.125


def test_an_inverted_print_is_found_only_as_such(rng):
    grey = picture(BOARD, rng, noise=2.0, invert=True)
    inverted = CharucoBoard(
        BOARD.squares, BOARD.square_mm, BOARD.marker_mm, BOARD.dictionary, inverted=True
    )
    assert len(find_corners(grey, BOARD)) == 0
    found = find_corners(grey, inverted)
    assert np.abs(found.px - true_px(BOARD)[found.ids]).max() < 0.1


def test_twelve_bits_in_sixteen_give_the_same_corners(rng):
    grey = picture(BOARD, rng, noise=2.0)
    eight, sixteen = find_corners(grey, BOARD), find_corners(grey.astype(np.uint16) * 16, BOARD)
    assert eight.ids.tolist() == sixteen.ids.tolist()
    np.testing.assert_allclose(eight.px, sixteen.px, atol=0.02)


def test_known_places_need_no_detection(rng):
    grey = picture(BOARD, rng, noise=3.0)
    guess = true_px(BOARD) + rng.uniform(-2, 2, (len(BOARD.corners_mm), 2))
    found = refine_corners(grey, guess, np.arange(len(guess)), BOARD)
    assert len(found) > 0.9 * len(guess)
    assert np.abs(found.px - true_px(BOARD)[found.ids]).max() < 0.1


def test_a_rod_before_the_board_takes_its_corners_away(rng):
    """What is hidden is not reported, and what is reported beside the rod is still in its place."""
    grey = picture(BOARD, rng, noise=3.0)
    places = true_px(BOARD)
    ends = [tuple(int(v) for v in places[k]) for k in (3, 31)]  # along a column of corners
    cv2.line(grey, *ends, 90, 26, cv2.LINE_AA)
    found = refine_corners(grey, places, np.arange(len(places)), BOARD)
    assert not {3, 10, 17, 24, 31} & set(found.ids.tolist())
    assert len(found) == 30
    assert np.abs(found.px - places[found.ids]).max() < 0.1


def test_nothing_is_found_where_nothing_is():
    blank = np.full((480, 640), 128, dtype=np.uint8)
    assert len(find_corners(blank, BOARD)) == 0
    assert len(refine_corners(blank, true_px(BOARD), np.arange(35), BOARD)) == 0
    assert len(refine_corners(blank, np.empty((0, 2)), np.empty(0), BOARD)) == 0


def test_chosen_keeps_rows_together():
    three = Corners([4, 5, 6], [[1, 2], [3, 4], [5, 6]], [0.1, 0.2, 0.3])
    two = three.select(np.array([True, False, True]))
    assert (two.ids.tolist(), two.px.tolist(), two.sigma_px.tolist()) == (
        [4, 6],
        [[1, 2], [5, 6]],
        [0.1, 0.3],
    )
