"""Base lines of a whisk's free frames: where the whisker turns about is found again, as sure as light allows."""

from dataclasses import replace

import numpy as np
import pytest

from tests.scenes.model_scenes import CAMERAS, scene, with_points
from vision.calibration.swing import by_swing
from vision.fit.base_line import base_lines
from vision.fit.problem import State
from vision.geometry.camera import Cameras
from vision.geometry.rotation import compose, exp_rotation, invert_transform

# Turn (rad) and shift (mm) of the true rig in the frame that the board gave.
STEP = np.array([0.0, 0.0, 0.004, 0.0, 0.3, -0.2])


def a_whisk(step=STEP, touch_deg=9.0, rng=None, sigma=0.02):
    """A straight whisker's whisk, seen by cameras that are placed `step` away from where they think."""
    problem, state = scene(touch_deg=touch_deg, frames=12)
    straight = State(np.zeros_like(state.vector), state.arcs_mm)
    seen = with_points(problem, straight, rng, sigma).seen
    away = invert_transform(np.column_stack([exp_rotation(step[:3]), step[3:]]))
    cameras = Cameras(
        tuple(replace(c, T_camera_rig=compose(c.T_camera_rig, away)) for c in CAMERAS)
    )
    return replace(problem, seen=seen, cameras=cameras), straight


def test_only_frames_before_touch_give_lines():
    problem, state = a_whisk()
    lines = base_lines(problem, state, np.zeros((problem.size,) * 2))
    np.testing.assert_allclose(lines.motor_rad, problem.motor_rad[~problem.touching])


def test_the_step_is_found_again():
    problem, state = a_whisk()
    made = by_swing(base_lines(problem, state, np.zeros((problem.size,) * 2)))
    # The lines may be off as a whole by 0.25 px (0.05 mm); what prior and light share is a few per cent of the step.
    np.testing.assert_allclose(made.step[4:], STEP[4:], atol=0.02)
    assert made.step[2] == pytest.approx(STEP[2], rel=0.15)


@pytest.mark.slow
def test_noise_scatters_as_each_frame_says(rng):
    """Along the whisker the fan alone decides: its own sigma must be the sampled one."""
    strokes = [
        base_lines(p, s, np.zeros((p.size,) * 2)) for p, s in (a_whisk(rng=rng) for _ in range(40))
    ]
    own = [by_swing(lines).covariance - lines.shared_covariance for lines in strokes]
    along = np.array(
        [[by_swing(lines).step[3], np.sqrt(c[3, 3])] for lines, c in zip(strokes, own)]
    )
    # 40 draws: a standard deviation scatters by 11 %; three of these.
    assert np.std(along[:, 0]) == pytest.approx(np.mean(along[:, 1]), rel=0.35)


def test_a_lens_s_own_uncertainty_is_shared_by_all_frames():
    problem, state = a_whisk()
    lens = np.zeros((problem.size,) * 2)
    lens[4, 4] = 0.3**2  # of the rest shape's offset in y
    shared = [
        base_lines(problem, state, own).shared_covariance for own in (np.zeros_like(lens), lens)
    ]
    # 0.3 mm across, and along the whisker the half of it by which a radian's turn may change it.
    assert np.trace((shared[1] - shared[0])[3:, 3:]) == pytest.approx(0.09 * (1 + 0.5**2), rel=1e-6)


def test_no_free_frame_gives_no_line():
    problem, state = a_whisk(touch_deg=0.1)
    assert base_lines(problem, state, np.zeros((problem.size,) * 2)) is None
