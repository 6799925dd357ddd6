"""What frames scatter about the fit at a wanted angle, and what is told of a slip that jumps."""

import numpy as np
import pytest

from vision.truth.at_angle import Smooth, _scatter, _unfitted, at_angle, expected_scatter
from vision.truth.value import FIELDS

THETA_RAD = np.radians(np.arange(0.5, 6.0, 0.5))


def frames(covariance: np.ndarray, slip: np.ndarray) -> Smooth:
    """Each frame's slip is one of the parameters."""
    size = len(THETA_RAD)
    return Smooth(THETA_RAD, np.zeros(size), {"slip": slip}, {"slip": np.eye(size)}, covariance)


@pytest.mark.parametrize("shared", [0.0, 0.8])
def test_scatter_expected_is_that_of_draws(shared):
    """RMS over 4000 draws of a mean square with 4 degrees of freedom: known to 1 %, four times that. What all frames
    share is no scatter."""
    size, rng = len(THETA_RAD), np.random.default_rng(2)
    covariance = 0.01**2 * ((1.0 - shared) * np.eye(size) + shared * np.ones((size, size)))
    draws = rng.multivariate_normal(np.zeros(size), covariance, size=4000)
    seen = [_unfitted(frames(covariance, 0.3 * THETA_RAD**2 + one), "slip", np.radians(3.0)) for one in draws]
    expected = expected_scatter(frames(covariance, draws[0]), "slip", np.radians(3.0))
    assert np.sqrt(np.mean(np.square(seen))) == pytest.approx(expected, rel=0.04)
    assert expected == pytest.approx(0.01 * np.sqrt(1.0 - shared))


def test_small_jumps_that_few_frames_show_are_known_by_students_t():
    """Frames to and fro by far more than their sigmas, too little to be jumps: left over four degrees of freedom, the
    line's t of 2.78 over 1.96. As far as chance lets them, their scatter stands as it is."""
    size = len(THETA_RAD)
    zigzag = 0.01 * (-1.0) ** np.arange(size)
    for sigma, widened in ((1e-6, 2.776 / 1.960), (0.01, 1.0)):
        smooth = frames(sigma**2 * np.eye(size), zigzag)
        left = _unfitted(smooth, "slip", np.radians(3.0))
        assert _scatter(smooth, "slip", np.radians(3.0)) == pytest.approx(widened * left, rel=1e-3)


TOOTH_RAD, JUMP_MM, SIGMA_MM, TOUCH_RAD = np.radians(0.8), 0.3, 0.004, np.radians(0.02)


def teeth(theta_rad: np.ndarray) -> dict[str, np.ndarray]:
    """A contact that rests for a tooth, then jumps; what follows from angle and slip."""
    slip = JUMP_MM * np.floor(theta_rad / TOOTH_RAD)
    built_up = 60.0 * theta_rad - 0.7 * slip
    return {name: slip if name == "slip" else built_up for name in FIELDS}


@pytest.mark.parametrize("step_deg", [0.1, 0.3, 0.5])
def test_what_jumps_holds_the_jump_in_its_sigma(step_deg):
    """A truth that is one of two places, with the middle and half of the distance stated, is off by one sigma; frames
    and touch err by their own. Of 300 none is beyond four."""
    rng, off = np.random.default_rng(5), []
    for _ in range(300):
        theta = np.radians(np.arange(rng.uniform(0.02, step_deg + 0.02), 5.0, step_deg))
        size, wanted = len(theta), np.radians(rng.uniform(2.0, 4.0))
        values = {name: v + SIGMA_MM * rng.standard_normal(size) for name, v in teeth(theta).items()}
        own = {name: np.eye(size, size + 1) for name in values}
        covariance = np.diag([SIGMA_MM**2] * size + [TOUCH_RAD**2])
        shown = theta + TOUCH_RAD * rng.standard_normal()
        at = at_angle(Smooth(shown, np.eye(size + 1)[-1], values, own, covariance), wanted, "")
        assert "slips in jumps" in at.status and at.theta_rad == wanted
        told = [(getattr(at, field), truth) for field, truth in zip(FIELDS.values(), teeth(wanted).values())]
        off.append([abs(value.value - float(truth)) / value.sigma for value, truth in told])
    assert np.max(off) < 4.0
    assert np.all(np.mean(np.array(off) < 1.96, axis=0) > 0.93)
