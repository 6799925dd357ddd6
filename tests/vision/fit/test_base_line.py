"""Base lines of a whisk's free frames: where the whisker turns about is found again, as sure as light allows."""

from dataclasses import replace

import numpy as np
import pytest

from tests.scenes.model_scenes import CAMERAS, scene, with_points
from vision.calibration.swing import by_swing
from vision.fit.base_line import base_lines, drift_sigma_px
from vision.fit.converged_fit import ConvergedFit
from vision.fit.problem import State, wire_modes
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
    lines = base_lines(ConvergedFit(problem, state))
    np.testing.assert_allclose(lines.motor_rad, problem.motor_rad[~problem.touching])


def test_the_step_is_found_again():
    problem, state = a_whisk()
    made = by_swing(base_lines(ConvergedFit(problem, state)))
    # The lines may be off as a whole by 0.25 px (0.05 mm); what prior and light share is a few per cent of the step.
    np.testing.assert_allclose(made.step[4:], STEP[4:], atol=0.02)
    assert made.step[2] == pytest.approx(STEP[2], rel=0.15)


@pytest.mark.slow
def test_noise_scatters_as_each_frame_says(rng):
    """Along the whisker the fan alone decides: its own sigma must be the sampled one."""
    strokes = [base_lines(ConvergedFit(p, s)) for p, s in (a_whisk(rng=rng) for _ in range(40))]
    placed = [by_swing(lines) for lines in strokes]
    own = [placement.covariance - placement.shared for placement in placed]
    along = np.array([[placement.step[3], np.sqrt(c[3, 3])] for placement, c in zip(placed, own)])
    # 40 draws: a standard deviation scatters by 11 %; three of these.
    assert np.std(along[:, 0]) == pytest.approx(np.mean(along[:, 1]), rel=0.35)


def test_cameras_that_err_together_shift_and_turn_the_swing_as_much():
    problem, state = a_whisk()
    sigma = np.array([2e-3, 3e-3, 1e-3, 0.3, 0.2, 0.1])
    by_placement = problem.cameras.by_placement
    covariance = by_placement @ np.diag(sigma**2) @ by_placement.T
    moving = replace(
        problem, cameras=replace(problem.cameras, covariance=covariance, by_error=None)
    )
    still, moved = (
        by_swing(base_lines(ConvergedFit(one, state))).covariance for one in (problem, moving)
    )
    scale = np.outer(sigma, sigma)
    # To first order exact; the step that is found, 4 mrad and 0.3 mm at 50 mm, is what is left out.
    np.testing.assert_allclose((moved - still) / scale, np.eye(6), atol=0.02)


def drifting(problem, camera, drift, share):
    """The problem with a camera's lines of the wire off by a share of the sigma of one of their drifts."""
    sigma_px = drift_sigma_px(problem, camera)[drift]
    seen = []
    for one in problem.seen:
        if one.frame >= 0 and one.camera == camera:
            points = one.points
            motor = np.full(len(points), problem.motor_rad[one.frame])
            modes = wire_modes(problem.wire.length_mm, points.place, motor, problem.motor_rad)
            off_px = share * sigma_px * modes[:, 2 + drift]
            one = replace(
                one, points=replace(points, px=points.px + off_px[:, None] * points.normal)
            )
        seen.append(one)
    return replace(problem, seen=seen)


def test_what_drifts_as_the_whisker_turns_is_in_the_sigma_of_the_axis_s_lean_and_the_centre_along():
    """In the others a line that wanders, alike in all frames, counts for more."""
    problem, state = a_whisk()
    lines = base_lines(ConvergedFit(problem, state))
    placement = by_swing(lines)
    share = 0.01
    steps = []
    for camera in range(len(problem.cameras)):
        for drift in range(4):
            moved = by_swing(
                base_lines(ConvergedFit(drifting(problem, camera, drift, share), state))
            )
            steps.append((moved.step - placement.step) / share)
    sigma = np.sqrt(np.diag(placement.shared - lines.shared_covariance))
    leans_and_along = [0, 1, 3]
    by_hand = np.linalg.norm(steps, axis=0)
    # A mode's mean over the stroke passes for a curved whisker in part, which turns the lines a little.
    np.testing.assert_allclose(by_hand[leans_and_along], sigma[leans_and_along], rtol=0.05)


def test_no_free_frame_gives_no_line():
    problem, state = a_whisk(touch_deg=0.1)
    assert base_lines(ConvergedFit(problem, state)) is None
