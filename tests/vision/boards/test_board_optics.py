"""The transfer curve and lens blur of a camera, by a board's printed edges."""

import cv2
import numpy as np
import pytest

from tests.scenes.board_pictures import BLUR_PX, clean_picture
from tests.studies.accuracy.board_scenes import BOARD
from vision.boards.board_optics import estimate_optics
from vision.boards.body import Body
from vision.boards.corners import find_corners
from vision.geometry.optics import Optics, known_gamma, probable_gammas

# A pixel sees the print 4 x 4 times: its own width is in the picture.
BLUR_WITH_PIXEL_PX = np.hypot(BLUR_PX, 12**-0.5)


def through_curve(light, gamma, rng, noise=2.0):
    """Grey levels of light (h, w) behind a transfer curve, with noise."""
    grey = 255.0 * (light / 255.0) ** (1.0 / gamma) + noise * rng.standard_normal(light.shape)
    return np.clip(np.round(grey), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("gamma", [1.0, 1.6, 2.2])
def test_printed_edges_show_curve_and_blur_of_a_camera(rng, gamma):
    """35 corners in noise of two levels: gamma within 0.8 % in five draws of each, blur within 0.4 %."""
    optics = estimate_optics(through_curve(clean_picture(BOARD), gamma, rng), BOARD)
    assert abs(np.log(optics.gamma / gamma)) < 0.03
    assert abs(np.log(optics.blur_px / BLUR_WITH_PIXEL_PX)) < 0.01
    assert optics.log_gamma_sigma < 0.25 and optics.log_blur_sigma < 0.15


def test_a_lens_out_of_focus_shows_by_its_blur(rng):
    """2.05 px with the pixel's own width, behind a curve: read up to 3.0 % too small in five draws, for markers are near."""
    light = cv2.GaussianBlur(clean_picture(BOARD), (0, 0), 1.7)
    optics = estimate_optics(through_curve(light, 2.2, rng), BOARD)
    assert abs(np.log(optics.blur_px / np.hypot(BLUR_WITH_PIXEL_PX, 1.7))) < 0.05


def test_a_body_shows_curve_and_blur_by_its_fullest_face(rng):
    """Two faces in one picture, one of them in part: each corner is that of its own face."""
    body = Body((8, 6), 15.0, marker_mm=11.0, dictionary="DICT_5X5_100", first_ids=(0, 24))
    whole, part = (clean_picture(face) for face in body.faces)
    optics = estimate_optics(through_curve(np.vstack([whole, part[:320]]), 1.6, rng), body)
    assert abs(np.log(optics.gamma / 1.6)) < 0.03
    assert abs(np.log(optics.blur_px / BLUR_WITH_PIXEL_PX)) < 0.01


def test_pixels_that_are_cut_off_show_no_curve(rng):
    """White beyond full scale is a skew edge as well."""
    light = clean_picture(BOARD)
    bright = np.minimum(light * 255.0 / np.percentile(light, 95.0) * 1.15, 255.0)
    optics = estimate_optics(through_curve(bright, 1.0, rng), BOARD)
    assert abs(np.log(optics.gamma)) < 0.2


def test_nothing_is_known_without_a_board_or_by_edges_that_no_lens_makes(rng):
    """Every third pixel shows edges of 0.38 px, and the board."""
    blank = np.full((480, 640), 128, dtype=np.uint8)
    sharp = through_curve(np.ascontiguousarray(clean_picture(BOARD)[::3, ::3]), 1.0, rng)
    assert len(find_corners(sharp, BOARD)) > 20
    for grey in (blank, sharp):
        assert estimate_optics(grey, BOARD) == Optics()


def test_cameras_of_one_kind_share_what_one_of_them_knows():
    encoded = Optics(gamma=2.1, log_gamma_sigma=0.15)
    assert probable_gammas([Optics(), Optics()]) == {1.0: 0.5, 2.2: 0.5}
    assert probable_gammas([Optics(), encoded]) == {2.2: 1.0}
    assert known_gamma([Optics(), encoded]) == 2.2
    assert known_gamma([Optics()]) == 1.0


def test_between_two_curves_none_is_excluded():
    """Midway in the logarithm both are 2.6 sigma off."""
    halves = probable_gammas([Optics(gamma=np.sqrt(2.2), log_gamma_sigma=0.15)])
    assert halves == pytest.approx({1.0: 0.5, 2.2: 0.5})


def test_a_known_blur_and_what_is_believed_of_lenses_are_weighed():
    """Half the sigma is four times the weight; of an unknown blur what is believed remains."""
    blur_px, sigma = Optics(blur_px=1.0, log_blur_sigma=0.1).blur_with(2.0, 0.2)
    assert blur_px == pytest.approx(2.0**0.2)
    assert sigma == pytest.approx(0.1 / np.sqrt(1.25))
    assert Optics().blur_with(0.8, 0.25) == pytest.approx((0.8, 0.25))
