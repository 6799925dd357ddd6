"""Overlays are painted where things are: in the picture, in its enlargement, at any scale."""

import numpy as np
import pytest
from PIL import Image, ImageDraw

from bench.base.drawing import is_drawn, save_picture
from bench.report.overlays import (
    _LEGEND_PX,
    _PANEL_PX,
    _draw_view,
    _panel,
    _whisker_view,
    _write_legend,
)
from bench.report.painting import as_8_bit, polyline

GREY = np.full((720, 1280), 100, np.uint16)
BAR = np.array([[300.0, 0.0], [300.0, 719.0]])
LINES = {
    "wire": np.array([[100.0, 360.0], [500.0, 360.0]]),
    "bar_left": BAR,
    "bar_right": BAR + np.array([40.0, 0.0]),
    "contact": np.array([300.0, 360.0]),
}
YELLOW, GREEN, RED = (255, 217, 47), (77, 175, 74), (228, 26, 28)


def is_at(picture: np.ndarray, place_px, colour) -> bool:
    """Whether a line of this colour passes within a pixel of here."""
    x, y = np.round(place_px).astype(int)
    near = picture[y - 1 : y + 2, x - 1 : x + 2].astype(int)
    return bool(np.min(np.max(np.abs(near - colour), axis=-1)) < 40)


@pytest.mark.parametrize("scale", [0.4, 1.0, 2.7])
def test_lines_lie_where_they_were_found_at_any_scale(scale):
    corner = np.array([90.0, 300.0])
    view = _draw_view(as_8_bit(GREY), corner, scale, (900, 400), LINES)
    assert is_at(view, scale * (np.array([200.0, 360.0]) - corner), YELLOW)
    assert is_at(view, scale * (np.array([300.0, 320.0]) - corner), GREEN)
    assert is_at(view, scale * (np.array([340.0, 320.0]) - corner), GREEN)
    assert is_at(view, scale * (LINES["contact"] - corner), RED)


def test_the_picture_lies_under_its_lines():
    """A bright pixel, enlarged three times, covers nine."""
    grey = np.zeros((50, 60), np.uint8)
    grey[20, 30] = 255
    nowhere = {name: np.full_like(line, np.nan) for name, line in LINES.items()}
    view = _draw_view(grey, (25.0, 15.0), 3.0, (30, 30), nowhere)[..., 0]
    rows, columns = np.nonzero(view)
    assert len(rows) == 9 and rows.mean() == columns.mean() == 15.0


def test_the_panel_holds_the_whisker_and_the_contact_enlarged():
    corner, scale = _whisker_view(GREY.shape, LINES["wire"])
    shown = scale * (LINES["wire"] - corner)
    assert np.all(shown >= 0) and np.all(shown <= _PANEL_PX)
    panel = _panel(GREY, LINES)
    assert panel.shape == (_PANEL_PX[1], _PANEL_PX[0], 3)
    middle = np.array(_PANEL_PX) - 12 - 186 / 2
    assert is_at(panel, middle, RED)


def test_a_frame_that_its_camera_dropped_has_an_empty_panel():
    assert np.ptp(_panel(None, LINES)) == 0


def test_a_line_breaks_where_a_point_is_missing():
    picture = np.zeros((20, 60, 3), np.uint8)
    polyline(
        picture,
        np.array([[5.0, 10.0], [20.0, 10.0], [np.nan, np.nan], [40.0, 10.0], [55.0, 10.0]]),
        YELLOW,
    )
    assert (
        np.all(picture[10, 5:20, 0])
        and not np.any(picture[10, 23:38])
        and np.all(picture[10, 41:55, 0])
    )


def test_a_painted_picture_carries_its_hash(tmp_path):
    painted = np.arange(4 * 5 * 3, dtype=np.uint8).reshape(4, 5, 3)
    save_picture(painted, tmp_path / "a.png", "x")
    assert is_drawn(tmp_path / "a.png", "x") and not is_drawn(tmp_path / "a.png", "y")
    with Image.open(tmp_path / "a.png") as picture:
        picture.verify()  # the checksums of all parts
    assert np.array_equal(np.asarray(Image.open(tmp_path / "a.png")), painted)


def test_the_legend_shows_each_colour_and_fits_below_the_panels():
    picture = Image.new("RGB", (2 * _PANEL_PX[0] + 10, _LEGEND_PX), "white")
    _write_legend(ImageDraw.Draw(picture), 0)
    drawn = np.asarray(picture).astype(int)
    for colour in (YELLOW, GREEN, RED):
        assert np.any(np.all(drawn == colour, axis=-1))
    for edge in (drawn[:, -8:], drawn[-2:]):
        assert np.all(edge == 255)  # no word is cut off
