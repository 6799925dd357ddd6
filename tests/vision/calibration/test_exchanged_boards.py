"""Whose lens is whose, by the board on the rig: told, refused, or said not to be told."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.studies.accuracy.board_scenes import BOARD, noisy, rig_view, two_cameras
from vision.calibration.exchanged_boards import check_own_lenses
from vision.geometry.refusals import Refused


def check(lenses, *, same_in_trials=True):
    """Notes on cameras high and low with these lenses."""
    rng = np.random.default_rng(4)
    standing = {camera.name: noisy(rig_view(camera), 0.04, rng) for camera in two_cameras()}
    alone = {name: SimpleNamespace(lens=lens) for name, lens in lenses.items()}
    return check_own_lenses(alone, standing, BOARD, same_in_trials=same_in_trials)


def test_each_with_its_own_lens_says_nothing():
    assert not check({camera.name: camera.lens for camera in two_cameras()})


@pytest.mark.parametrize(
    "same_in_trials, words", [(True, "low are exch"), (False, "low, or their pict")]
)
def test_exchanged_lenses_are_refused_with_both_names(same_in_trials, words):
    high, low = two_cameras()
    with pytest.raises(Refused, match=f"boards/high and boards/{words}") as refusal:
        check({"high": low.lens, "low": high.lens}, same_in_trials=same_in_trials)
    assert refusal.value.code == "boards_exchanged"


@pytest.mark.parametrize("share", [1.001, 0.999])
def test_lenses_too_much_alike_are_said_not_to_be_told(share):
    """Whichever way round: a lens of both pictures' own, and one a thousandth longer."""
    high = two_cameras()["high"]
    longer = np.concatenate([share * high.lens[:2], high.lens[2:]])
    notes = check_with_one_lens(high, high.lens, longer)
    assert len(notes) == 1 and "does not tell whether boards/high and boards/low" in notes[0]


def check_with_one_lens(camera, own, other):
    """Notes on two cameras with pictures by one lens, seen from two sides."""
    rng = np.random.default_rng(5)
    raised = camera.moved(np.concatenate([np.zeros(9), [0.1, 0.0, 0.0], [0.0, 0.0, 30.0]]))
    standing = {
        "high": noisy(rig_view(camera), 0.04, rng),
        "low": noisy(rig_view(raised), 0.04, rng),
    }
    alone = {"high": SimpleNamespace(lens=own), "low": SimpleNamespace(lens=other)}
    return check_own_lenses(alone, standing, BOARD, same_in_trials=True)
