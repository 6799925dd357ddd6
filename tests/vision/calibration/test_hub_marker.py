"""The axis by a marker on the hub: exact without noise, as sure as it says, and no marker at rest."""

import numpy as np
import pytest

from tests.scenes.model_scenes import CAMERAS
from vision.calibration.hub_marker import MarkerSighting, by_marker, first_axis
from vision.geometry.centreline import rotation_z
from vision.geometry.refusals import Refused
from vision.geometry.rotation import exp_rotation

STEP = np.array([0.004, -0.006, 0.0, 0.08, -0.05, 0.0])
CONSTRAINED = [0, 1, 3, 4]
IN_HUB = np.array([[-16.0, 6.0, 4.0], [-4.0, 6.0, 4.0], [-4.0, -6.0, 4.0], [-16.0, -6.0, 4.0]])


def sightings(width_deg=8.0, turn=1.0, scatter_px=0.0, bias_px=0.0, drift=0.0, rng=None, frames=12):
    """A marker's sightings before two cameras; turn: over the motor's; drift: of the bias, 1/rad."""
    rng = rng or np.random.default_rng(0)
    found = []
    for camera in CAMERAS:
        bias, change = bias_px * rng.standard_normal((2, 4, 2))
        for frame, angle in enumerate(np.radians(np.linspace(0.5, 0.5 + width_deg, frames))):
            points = IN_HUB @ rotation_z(turn * angle).T @ exp_rotation(STEP[:3]).T + STEP[3:]
            px = (
                camera.project(points)
                + bias
                + drift * angle * change
                + scatter_px * rng.standard_normal((4, 2))
            )
            found.append(MarkerSighting(40, camera.name, ("trial", frame), angle, px))
    return found


def test_without_noise_the_axis_is_exact():
    # soft_l1 ends where the cost changes by less than 1e-8 of itself.
    np.testing.assert_allclose(by_marker(sightings(), CAMERAS).step, STEP, atol=1e-5)


@pytest.mark.parametrize("size", [{"bias_px": 0.02}, {"bias_px": 0.2, "drift": 3.0}])
def test_the_stated_sigmas_are_the_sampled_ones(size):
    rng = np.random.default_rng(4)
    made = []
    for _ in range(12):
        made.append(by_marker(sightings(scatter_px=0.05, rng=rng, **size), CAMERAS))
    error = np.array([m.step - STEP for m in made])[:, CONSTRAINED]
    sigma = np.sqrt([np.diag(m.covariance) for m in made])[:, CONSTRAINED]
    # A mean of z² of 12 sessions whose four values go together scatters by √(2/12) = 0.41: three of those.
    assert 0.05 < np.mean((error / sigma) ** 2) < 2.25


def test_what_a_marker_does_not_show_is_left_open():
    covariance = by_marker(sightings(scatter_px=0.05), CAMERAS).covariance
    assert covariance[2, 2] >= 1.0 and covariance[5, 5] >= 1e6


def test_the_first_axis_is_the_axis():
    axis = first_axis(sightings(scatter_px=0.05, bias_px=0.2), CAMERAS)
    R = exp_rotation(STEP[:3])
    assert np.degrees(np.arccos(axis[:, 2] @ R[:, 2])) < 1.5
    away = axis[:, 3] - STEP[3:]
    assert np.linalg.norm(away - R[:, 2] * (away @ R[:, 2])) < 0.5


@pytest.mark.parametrize("unlike", [{"turn": 0.0}, {"turn": 0.5}, {"width_deg": 1.0}])
def test_a_marker_that_does_not_turn_as_the_motor_does_shows_nothing(unlike):
    seen = sightings(**unlike)
    assert first_axis(seen, CAMERAS) is None
    with pytest.raises(Refused, match="no marker is seen to turn"):
        by_marker(seen, CAMERAS)


def test_one_camera_alone_shows_no_axis():
    seen = [one for one in sightings() if one.camera == "one"]
    assert first_axis(seen, CAMERAS) is None
