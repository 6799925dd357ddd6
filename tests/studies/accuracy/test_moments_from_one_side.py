"""Moments of whisks whose cameras see the bar from one side."""

import numpy as np
import pytest

from tests.studies.accuracy.moments_from_one_side import moment_errors, scene_of, seen_whisk


@pytest.mark.parametrize("seed", [0, 1])
def test_moments_are_right_where_the_slope_is_not_known(seed):
    """A whisk without a truth: its moments are known to a per cent, within three of their sigmas."""
    scene = scene_of(seed, angle_deg=0.05, slope_deg=0.0, bar_px=1.0)
    seen, slope_sigma_rad = seen_whisk(scene)
    assert np.degrees(slope_sigma_rad) > 20.0 and not seen.has_truth
    error, sigma = moment_errors(scene, seen)
    assert np.all(np.abs(error) < 3.0 * sigma) and np.all(sigma < 0.01)
