"""The markers' width against the squares': seen, and refused where what was entered does not go with it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.scenes.board_pictures import picture
from tests.studies.accuracy.board_scenes import BOARD
from vision.boards.marker_size import check_marker_size
from vision.geometry.refusals import Refused


@pytest.fixture
def greys():
    return [picture(BOARD, np.random.default_rng(1))]


def test_what_is_printed_is_taken(greys):
    check_marker_size(greys, BOARD)
    check_marker_size(
        greys, replace(BOARD, square_mm=2 * BOARD.square_mm, marker_mm=2 * BOARD.marker_mm)
    )
    check_marker_size([], BOARD)


@pytest.mark.parametrize(
    "wrong", [{"square_mm": 20.0}, {"square_mm": 12.0}, {"marker_mm": 8.0}, {"marker_mm": 13.0}]
)
def test_one_length_entered_wrong_is_refused(greys, wrong):
    board = replace(BOARD, **wrong)
    with pytest.raises(
        Refused, match=rf"0\.7\d+ times as wide.*square_mm = {board.square_mm:g} make it"
    ):
        check_marker_size(greys, board)
