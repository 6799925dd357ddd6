"""What frames scatter about the fit at a wanted angle, and what is told of a slip that jumps."""

import numpy as np
import pytest

from vision.truth.at_angle import NearAngle, Smooth, at_angle
from vision.truth.value import FIELDS

THETA_RAD = np.radians(np.arange(0.5, 6.0, 0.5))
# An angle asks nothing of the cameras' errors.
NO_CAMERAS = np.zeros((0, 0))


def frames(covariance: np.ndarray, values: np.ndarray, name: str) -> Smooth:
    """Each frame's value is one of the parameters."""
    size = len(THETA_RAD)
    jacobian = {name: np.eye(size)}
    return Smooth(
        THETA_RAD,
        np.zeros(size),
        {name: values},
        jacobian,
        covariance,
        0.0 * covariance,
        NO_CAMERAS,
    )


@pytest.mark.parametrize("shared", [0.0, 0.8])
def test_scatter_expected_is_that_of_draws(shared):
    """RMS over 1000 draws of a mean square with 8 degrees of freedom: known to 0.8 %, four times that. What all frames
    share is no scatter of an angle."""
    size, rng, wanted = len(THETA_RAD), np.random.default_rng(2), np.radians(3.0)
    covariance = 0.01**2 * ((1.0 - shared) * np.eye(size) + shared * np.ones((size, size)))
    draws = rng.multivariate_normal(np.zeros(size), covariance, size=1000)
    seen = []
    for one in draws:
        smooth = frames(covariance, 0.3 * THETA_RAD**2 + one, "phi")
        seen.append(NearAngle(smooth, wanted).scatter("phi"))
    assert np.sqrt(np.mean([one.rms**2 for one in seen])) == pytest.approx(
        seen[0].expected, rel=0.03
    )
    assert seen[0].expected == pytest.approx(0.01 * np.sqrt(1.0 - shared))
    assert seen[0].freedom == pytest.approx(size - 3)


@pytest.mark.parametrize("name", ["phi", "slip"])
def test_small_jumps_that_few_frames_show_are_known_by_students_t(name):
    """Frames to and fro by far more than their sigmas, too little to be jumps, lengths as their pushing angles: left
    over 8 degrees of freedom, the parabola's t of 2.306 over 1.960, and each of the seven frames nearby moves the local
    fit at its middle by what a parabola's weights are, Σ w² = 1/3. As far as chance lets them, their scatter stands."""
    wanted = np.radians(3.0)
    zigzag = (
        0.01 * (-1.0) ** np.arange(len(THETA_RAD)) * (THETA_RAD / wanted if name == "slip" else 1.0)
    )
    for sigma, widened in ((1e-6, 2.306 / 1.960), (0.01, 1.0)):
        own = sigma * (THETA_RAD / wanted if name == "slip" else np.ones(len(THETA_RAD)))
        smooth = frames(np.diag(own**2), zigzag, name)
        near = NearAngle(smooth, wanted)
        left = near.scatter(name).rms
        assert left == pytest.approx(0.01, rel=0.2)
        with_fit = np.sqrt(4 / 3) if widened > 1.0 else 1.0
        assert near.between_frames_sigma(name) == pytest.approx(widened * with_fit * left, rel=0.02)


@pytest.mark.parametrize("first", range(8))
def test_frames_in_step_with_teeth_are_told_by_those_further_away(first):
    """Teeth of 3° in the force's angle, each a seventh longer than the one before, and frames of 1 mrad 0.7° apart:
    about the wanted angle they may lie on a smooth line, over the stroke they do not."""
    rng, ends = np.random.default_rng(first), 0.8 * 1.15 ** np.arange(40)
    theta = np.radians(np.arange(0.1 + 0.08 * first, 4.9, 0.7))
    tooth = np.searchsorted(np.radians(ends), theta)
    phase = (np.degrees(theta) - np.append(0.0, ends)[tooth]) / np.diff(ends, prepend=0.0)[tooth]
    smooth = Smooth(
        theta,
        np.zeros(len(theta)),
        {"phi": 0.5 - 0.05 * phase + 0.001 * rng.standard_normal(len(theta))},
        {"phi": np.eye(len(theta))},
        1e-6 * np.eye(len(theta)),
        np.zeros((len(theta), len(theta))),
        NO_CAMERAS,
    )
    assert NearAngle(smooth, np.radians(3.0)).between_frames_sigma("phi") > 0.01


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
        values = {
            name: v + SIGMA_MM * rng.standard_normal(size) for name, v in teeth(theta).items()
        }
        own = {name: np.eye(size, size + 1) for name in values}
        covariance = np.diag([SIGMA_MM**2] * size + [TOUCH_RAD**2])
        shown = theta + TOUCH_RAD * rng.standard_normal()
        touch_jacobian = np.eye(size + 1)[-1]
        shared = np.diag([0.0] * size + [TOUCH_RAD**2])
        smooth = Smooth(shown, touch_jacobian, values, own, covariance, shared, NO_CAMERAS)
        at = at_angle(smooth, wanted, "")
        assert 0.0 < at.slip_shared_mm <= at.slip_mm.sigma
        assert "slips_in_jumps" in at.status.codes and at.theta_rad == wanted
        told = [
            (getattr(at, field), truth)
            for field, truth in zip(FIELDS.values(), teeth(wanted).values())
        ]
        off.append([abs(value.value - float(truth)) / value.sigma for value, truth in told])
    assert np.max(off) < 4.0
    assert np.all(np.mean(np.array(off) < 1.96, axis=0) > 0.93)


@pytest.mark.parametrize("scatter_mm, jumps", [(0.02, False), (0.004, True)])
def test_a_slip_off_its_fit_jumps_where_frames_do_not_scatter_as_much(scatter_mm, jumps):
    """One frame 0.06 mm off a line leaves a residual of 2.4 sigmas as traces scatter, of 12 as pictures do."""
    slip_mm = 20.0 * THETA_RAD
    slip_mm[5] += 0.06
    smooth = frames(scatter_mm**2 * np.eye(len(THETA_RAD)), slip_mm, "slip")
    assert NearAngle(smooth, np.radians(3.0)).slip_jumps is jumps
