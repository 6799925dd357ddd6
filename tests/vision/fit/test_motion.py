"""A bar that moves through the whisk or gives way: the fit finds its way, touch and slip are those of the bar where it
is."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.scenes.model_scenes import begun, scene, with_points
from vision.fit.bend_onset import Onset
from vision.fit.motion import Gives, Motion, StatedVelocity, Yielding, between
from vision.fit.problem import State, bar_axis
from vision.fit.quantities import measure
from vision.fit.solve import linearise, solve
from vision.fit.touch import first_touch

VELOCITY = np.array([1.0, 2.0, -1.5])


def moving(frames=6):
    """A bar at constant velocity, frames 0.09 s apart, counted from the fourth."""
    return Motion.steady(StatedVelocity(VELOCITY, 0.5, 0.27), 0.09 * np.arange(frames))


@cache
def giving():
    """Problem and truth of a bar that gives way, a tenth of a millimetre at the end by each power each way; its touch
    is said 0.1° too early."""
    standing, state = scene(frames=6)
    said = Gives(float(first_touch(standing, state.vector).motor_rad) - np.radians(0.1), 0.1)
    problem, truth = scene(
        frames=6, motion=Yielding(said, standing.motor_rad, standing.axis.direction)
    )
    return replace(problem, onset=Onset(said.touch_rad, 1e-6)), truth


def test_how_a_bar_gives_way_is_found_with_the_rest():
    """From nothing known of it and without noise: touch, distance, and where the bar is in each frame."""
    problem, truth = giving()
    begin = begun(problem, truth)
    found, _ = solve(with_points(problem, truth, sigma=1e-6), begin, scales=(1e9,) * 10 + (2e9,))
    here, true = (measure(problem, s.vector, s.arcs_mm) for s in (found, truth))
    assert here.whisk["touch"] == pytest.approx(true.whisk["touch"], abs=1e-6)
    assert here.whisk["d_x"] == pytest.approx(true.whisk["d_x"], abs=1e-4)
    shifts = [
        problem.motion.shift_mm(s.vector[problem.blocks.motion.slice]) for s in (found, truth)
    ]
    assert np.abs(shifts[1]).max() > 0.05
    assert shifts[0] == pytest.approx(shifts[1], abs=1e-4)


def test_a_bar_that_gives_way_stands_until_touch():
    problem, truth = giving()
    shift = problem.motion.shift_mm(truth.vector[problem.blocks.motion.slice])
    touch = first_touch(problem, truth.vector).motor_rad
    assert not shift[problem.motor_rad < touch].any()
    assert shift[problem.motor_rad > touch].any(axis=1).all()
    assert problem.motion.shift_mm(problem.motion.values(shift))[-1] == pytest.approx(
        shift[-1], abs=0.02
    )


def test_a_motion_is_found_with_the_rest():
    """The velocity that is told is off by 0.1 mm/s each way; without noise it is found across the bar, and what is left
    along it is not seen."""
    problem, truth = scene(frames=6, motion=moving())
    seen = with_points(problem, truth, sigma=1e-6)
    found, _ = solve(seen, begun(problem, truth), scales=(1e9,) * 10 + (2e9,))
    here, true = (measure(problem, s.vector, s.arcs_mm) for s in (found, truth))
    assert here.whisk["d_x"] == pytest.approx(true.whisk["d_x"], abs=1e-5)
    assert here.whisk["touch"] == pytest.approx(true.whisk["touch"], abs=1e-7)
    off = found.vector[problem.blocks.motion.slice] - 0.1
    along = bar_axis(problem, truth.vector).direction
    assert off - (off @ along) * along == pytest.approx(np.zeros(3), abs=1e-5)


def test_slip_is_over_the_bar():
    """Of the same curves, a bar that moves along itself takes its own way from the slip."""
    problem, truth = scene(frames=6, motion=moving())
    here = measure(problem, truth.vector, truth.arcs_mm)
    axis, touch = bar_axis(problem, truth.vector), here.whisk["touch"]
    points = np.stack([here.frame[name] for name in "xyz"], axis=1)
    first = np.array([here.whisk[name] for name in "xyz"])
    seconds = 0.09 * (problem.motor_rad - touch) / np.radians(0.9)
    went = seconds[:, None] * (VELOCITY + 0.1)
    slip = (points - first - went) @ axis.direction
    assert here.frame["slip"][problem.touching] == pytest.approx(slip[problem.touching], abs=1e-9)


@pytest.mark.parametrize("made", [lambda: scene(frames=6, motion=moving()), giving])
def test_jacobian_is_the_derivative_of_the_residual(rng, made):
    problem, truth = made()
    problem = with_points(problem, truth, rng)
    state = State(truth.vector + 1e-3 * rng.standard_normal(problem.size), truth.arcs_mm)
    linear, _ = linearise(problem, state)
    for k in [0, 2, *range(problem.size)[problem.blocks.motion.slice], problem.first_bend]:
        step = (1e-5 if k in (2, problem.first_bend) else 1e-3) * np.eye(problem.size)[k]
        ahead, behind = (
            linearise(problem, State(state.vector + s * step, state.arcs_mm))[0].residual
            for s in (1, -1)
        )
        column = (ahead - behind) / (2 * np.max(step))
        assert np.allclose(
            linear.jacobian[:, k], column, atol=3e-3 * max(1.0, np.max(np.abs(column)))
        )


def test_between_frames_the_bar_goes_as_the_motor_does():
    motor, shift = np.array([0.0, 1.0, 3.0]), np.array([[0.0, 0, 0], [1.0, 0, 0], [5.0, 0, 0]])
    at = np.array([-0.5, 0.5, 2.0, 4.0])
    found = between(motor, np.broadcast_to(shift, (4, 3, 3)), at)
    assert found[:, 0] == pytest.approx([-0.5, 0.5, 3.0, 7.0])
