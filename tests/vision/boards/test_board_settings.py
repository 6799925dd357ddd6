"""A board entered wrongly: the setting that works is named, and nothing is gone on with."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.scenes.board_pictures import picture
from tests.studies.accuracy.board_scenes import BOARD
from vision.boards.diagnosis import why_no_charuco


@pytest.fixture
def greys():
    return [picture(BOARD, np.random.default_rng(1), noise=2.0)]


def test_the_right_board_needs_no_word(greys):
    assert why_no_charuco(greys, BOARD) is None


@pytest.mark.parametrize(
    "change, words",
    [
        ({"legacy": True}, "one with legacy = false is"),
        ({"inverted": True}, "one with inverted = false is"),
        ({"squares": (6, 8)}, r"one with squares = \[8, 6\] is"),
        ({"dictionary": "DICT_4X4_100"}, 'one with dictionary = "DICT_5X5_50" is'),
        (
            {"dictionary": "DICT_6X6_50", "inverted": True},
            'dictionary = "DICT_5X5_50", inverted = false is',
        ),
    ],
)
def test_the_setting_that_works_is_named(greys, change, words):
    assert re.search(words, why_no_charuco(greys, replace(BOARD, **change)))


def test_another_size_of_board_is_said_to_be_laid_out_otherwise(greys):
    reason = why_no_charuco(greys, replace(BOARD, squares=(9, 6)))
    assert (
        "markers of DICT_5X5_100 are seen" in reason
        and "not laid out as on a board of 9 x 6" in reason
    )


def test_no_board_at_all():
    assert "no marker of DICT_5X5_100" in why_no_charuco(
        [np.full((480, 640), 128, dtype=np.uint8)], BOARD
    )
