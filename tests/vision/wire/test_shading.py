"""Where a rod's shading may change: along it, and where it turns far with its angle too."""

from types import SimpleNamespace

import numpy as np

from vision.wire.shading import Knots

PLACES = np.array([0.0, 10.0, 20.0])


def test_a_rod_that_hardly_turns_has_one_shading():
    knots = Knots.of_turning(PLACES, {0: 0.0, 1: np.radians(6.0)})
    assert len(knots) == 3 and len(knots.turn_rad) == 1


def test_a_rod_that_turns_far_has_a_shading_linear_in_place_and_angle():
    knots = Knots.of_turning(PLACES, {4: 0.0, 5: np.radians(6.0), 9: np.radians(24.0)})
    np.testing.assert_allclose(np.degrees(knots.turn_rad), [0.0, 8.0, 16.0, 24.0])
    weights = knots.weights(SimpleNamespace(place=np.array([2.5, 20.0]), source=np.array([5, 9])))
    # Linear interpolation gives back what is linear in both: here 1 + place, times 1 + angle.
    values = np.outer(1.0 + knots.turn_rad, 1.0 + PLACES).ravel()
    np.testing.assert_allclose(
        weights @ values, [3.5 * (1 + np.radians(6.0)), 21.0 * (1 + np.radians(24.0))]
    )
