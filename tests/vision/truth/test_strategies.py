"""Which frames touch, where clearance tells it and where bends do."""

import numpy as np
import pytest

from tests.scenes.model_scenes import scene
from vision.fit.touch import touch_and_sigma
from vision.geometry.refusals import Refused
from vision.truth.strategies import TouchByClearance

TOUCH_DEG = 2.3  # between the second and the third of seven frames, 0.9 degrees apart


def answer(problem, state, touch_sigma_deg: float) -> np.ndarray:
    """A covariance by which touch is known to this."""
    one = np.eye(problem.size)
    return one * (np.radians(touch_sigma_deg) / touch_and_sigma(problem, state.vector, one)[1]) ** 2


def test_clearance_parts_the_frames_where_it_knows_touch():
    problem, state = scene(touch_deg=TOUCH_DEG)
    touching, free = TouchByClearance().split_by_fit(problem, state, answer(problem, state, 0.01))
    assert free.tolist() == [True] * 2 + [False] * 5 and np.all(touching == ~free)


@pytest.mark.parametrize("touch_sigma_deg", [1.0, 3.0])
def test_where_sights_hardly_cross_frames_stay_as_bends_parted_them(touch_sigma_deg):
    """Three sigma reach before the first frame: by clearance alone none would be free, and the whisk be refused."""
    problem, state = scene(touch_deg=TOUCH_DEG)
    touching, free = TouchByClearance().split_by_fit(
        problem, state, answer(problem, state, touch_sigma_deg)
    )
    assert np.all(free == ~problem.bent) and np.all(touching == problem.touching)


def test_what_clearance_is_sure_of_bends_do_not_change():
    """Touch 20 degrees before the frames, known to a degree: all of them touch, whatever bends say."""
    problem, state = scene(touch_deg=TOUCH_DEG)
    state.vector[5] += 100.0 * np.radians(20.0)  # the resting whisker's slope, mm at its tip
    with pytest.raises(Refused, match="touches from the start"):
        TouchByClearance().split_by_fit(problem, state, answer(problem, state, 1.0))
