"""Where another rod is in a picture, nothing is learnt of this one."""

import numpy as np

from vision.pictures.others import BESIDE_ROD_PX, RodLines, mask_rods
from vision.pictures.pixel_noise import Noise
from vision.wire.bands import cut_pieces, read_band

LINE = np.stack([np.linspace(10.0, 90.0, 9), np.linspace(20.0, 40.0, 9)], axis=1)
RODS = {
    "other": RodLines(
        np.array([0, 2]), np.stack([LINE, LINE + np.array([0.0, 30.0])]), np.array([2.0, 3.5])
    )
}


def test_what_lies_near_a_line_is_covered_and_no_more():
    """OpenCV rounds a width to whole pixels, and a line's ends are round: half a pixel, and one, to either side."""
    mask = mask_rods(RODS, 2, (100, 110))
    rows, columns = np.nonzero(np.ones_like(mask))
    start, step = LINE[0] + [0.0, 30.0], LINE[-1] - LINE[0]
    px = np.stack([columns, rows], axis=1) - start
    share = np.clip(px @ step / (step @ step), 0.0, 1.0)
    away = np.linalg.norm(px - share[:, None] * step, axis=1).reshape(mask.shape)
    wide = 3.5 + BESIDE_ROD_PX
    assert mask[away < wide - 1.0].all() and not mask[away > wide + 1.5].any()


def test_frames_without_another_rod_are_covered_nowhere():
    assert mask_rods({}, 0, (10, 10)) is None
    assert not mask_rods(RODS, 1, (100, 110)).any()


def test_a_line_of_unknown_place_covers_nothing():
    """One that passes behind a camera has no picture."""
    lost = {"other": RodLines(np.array([0]), np.full((1, 3, 2), np.nan), np.array([2.0]))}
    assert not mask_rods(lost, 0, (20, 20)).any()


def test_shrunk_lines_lie_where_shrunk_pictures_have_them():
    half = RODS["other"].shrunk(2)
    np.testing.assert_allclose(half.middle_px[0], (LINE + 0.5) / 2 - 0.5)
    np.testing.assert_allclose(half.half_px, [1.0, 1.75])
    assert RODS["other"].shrunk(1) is RODS["other"]


def test_hidden_pixels_weigh_nothing_and_a_piece_that_lacks_its_rod_is_none():
    rng = np.random.default_rng(0)
    grey = rng.normal(50.0, 1.0, (40, 60))
    curve, place = np.stack([np.arange(5.0, 55.0), np.full(50, 20.0)], axis=1), np.arange(50.0)
    hidden = np.zeros(grey.shape, bool)
    hidden[:14, :] = True  # beside the rod, seven pixels away
    hidden[:, 30:33] = True  # across it
    bands = [
        read_band(grey, grey, curve, place, np.full(50, 2.0), 9, mask) for mask in (None, hidden)
    ]
    whole, lacking = (cut_pieces([band], 10, Noise(0.0, 1.0)) for band in bands)
    assert (whole.weight > 0).all() and whole.show_rod(3.0).all()
    assert (lacking.weight == 0).sum() == hidden[11:30, 5:55].sum()
    assert lacking.show_rod(3.0).tolist() == [True, True, False, True, True]
