"""The turns of a hub by its marker: exact without noise, as sure as they say, and no turn of too few frames."""

import numpy as np
import pytest

from tests.scenes.model_scenes import CAMERAS
from vision.calibration.hub_marker import MarkerSighting
from vision.calibration.hub_turns import marker_turns
from vision.geometry.centreline import rotation_z
from vision.geometry.refusals import Refused

IN_HUB = np.array([[-16.0, 6.0, 4.0], [-4.0, 6.0, 4.0], [-4.0, -6.0, 4.0], [-16.0, -6.0, 4.0]])
TURNS_RAD = np.radians(
    [0.0, 0.7, 1.1, 2.5, 4.0, 4.1, 3.0, 1.0]
)  # forward, and some of the way back


def sightings(scatter_px=0.0, bias_px=0.0, rng=None, frames=8):
    """A marker's sightings before two cameras, of which no motor angle is known."""
    rng = rng or np.random.default_rng(0)
    found = []
    for camera in CAMERAS:
        bias = bias_px * rng.standard_normal((4, 2))
        for frame, turn in enumerate(TURNS_RAD[:frames]):
            px = camera.project(IN_HUB @ rotation_z(0.3 + turn).T) + bias
            px += scatter_px * rng.standard_normal((4, 2))
            found.append(MarkerSighting(40, camera.name, ("", 10 + frame), np.nan, px))
    return found


def test_without_noise_the_turns_are_exact():
    found = marker_turns(sightings(), CAMERAS)
    assert found.frame.tolist() == list(range(10, 10 + len(TURNS_RAD)))
    # soft ends: the cost changes by less than 1e-8 of itself, of residuals of 1e-3 px
    np.testing.assert_allclose(found.turn_rad, TURNS_RAD, atol=1e-6)
    diagonal = rotation_z(0.3) @ (IN_HUB[2] - IN_HUB[0])
    assert found.azimuth_rad == pytest.approx(np.arctan2(diagonal[1], diagonal[0]), abs=1e-6)


@pytest.mark.parametrize("bias_px", [0.0, 0.02])
def test_the_stated_sigmas_are_the_sampled_ones(bias_px):
    rng = np.random.default_rng(7)
    z2 = []
    for _ in range(12):
        found = marker_turns(sightings(0.05, bias_px, rng), CAMERAS)
        error = (found.turn_rad - TURNS_RAD)[1:]
        z2.append(error @ np.linalg.solve(found.covariance[1:, 1:], error) / len(error))
    # A mean of 12 sessions of 7 turns each scatters by √(2/84) = 0.15. The sigmas are of a scatter that
    # is itself known from some 80 residuals by a median, to a fifth: a factor of 0.64 to 1.44 of squares.
    assert 0.64 * (1.0 - 3 * 0.15) < np.mean(z2) < 1.44 * (1.0 + 3 * 0.15)


@pytest.mark.parametrize(
    ("seen", "count"),
    [
        (sightings(frames=4), 4),
        ([one for one in sightings() if one.camera == CAMERAS.names[0]], 0),
    ],
)
def test_a_marker_that_two_cameras_see_in_too_few_frames_is_refused(seen, count):
    with pytest.raises(Refused, match=f"by two cameras in {count} frames, 5 are needed"):
        marker_turns(seen, CAMERAS)
