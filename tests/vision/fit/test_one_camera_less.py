"""Cameras left out in turn: silent where they agree, loud and within the sigmas where one is off."""

from dataclasses import replace

import numpy as np
import pytest

from tests.scenes.model_scenes import CAMERAS, begun, camera, scene, with_points
from vision.fit.converged_fit import ConvergedFit
from vision.fit.one_camera_less import contradiction, covariance_of, leave_out_each
from vision.fit.quantities import jacobians
from vision.fit.scatter import inflated_by_residuals
from vision.fit.solve import solve
from vision.geometry.camera import Cameras

THREE = Cameras((*CAMERAS.cameras, camera("three", (-80, -250, 200))))
# The first two stand so near to each other that by themselves they hardly know how far away wire and bar are.
NEAR = Cameras(
    (CAMERAS.cameras[0], camera("near", (60, -190, 330)), camera("three", (-80, -250, 200)))
)


def left_out(rng, cameras=THREE, off_px=0.0):
    """Problem, state, quantities and the fit without each camera; off_px: shift of all lines of the last."""
    problem, true = scene()
    problem = with_points(replace(problem, cameras=cameras), _of(problem, true, cameras), rng)
    seen = [
        _shifted(one, off_px) if one.camera == len(cameras) - 1 else one for one in problem.seen
    ]
    problem = replace(problem, seen=seen)
    state, _ = solve(problem, begun(problem, _of(problem, true, cameras)))
    problem = inflated_by_residuals(problem, state)
    state, _ = solve(problem, state)
    fit = ConvergedFit(problem, state)
    return problem, state, fit, fit.measured, fit.by_parameter, leave_out_each(fit)


def _of(problem, true, cameras):
    """The true state as a problem with other cameras has it."""
    vector = np.zeros(replace(problem, cameras=cameras).size)
    vector[:12], bends = true.vector[:12], 2 * int(problem.bent.sum())
    vector[-bends:] = true.vector[-bends:]
    return replace(true, vector=vector)


def _shifted(one, off_px):
    return replace(one, points=replace(one.points, px=one.points.px + off_px * one.points.normal))


@pytest.mark.parametrize("seed", range(3))
def test_cameras_that_agree_do_not_contradict_each_other(seed):
    problem, *_, found = left_out(np.random.default_rng(seed))
    assert [one.camera for one in found] == ["one", "two", "three"]
    assert contradiction(found) == ""
    assert not covariance_of(found, problem.size).any()


def test_two_cameras_are_not_compared(rng):
    assert left_out(rng, CAMERAS)[-1] == []


def test_the_step_is_what_a_fit_without_the_camera_finds(rng):
    """To a twentieth of the stated sigma: one linear step from a solution nearby."""
    problem, state, _, measured, _, found = left_out(rng)
    alone, _ = solve(replace(problem, seen=[one for one in problem.seen if one.camera != 2]), state)
    there, _ = jacobians(problem, alone)
    moved = np.array(
        [there.whisk[name] - measured.whisk[name] for name in ("d_x", "touch", "beta")]
    )
    assert np.all(np.abs(moved - found[2].moved[:3]) < 0.05 * found[2].sigma[:3])


def test_a_camera_that_is_off_widens_the_sigmas_and_is_told(rng):
    """Two pixels of all lines, as of a camera that was knocked: the truth lies within three of the wider sigmas."""
    problem, _, fitted, measured, by, found = left_out(rng, off_px=2.0)
    assert contradiction(found)
    whole = fitted.fit_covariance + covariance_of(found, problem.size)
    gradient, error = by.whisk["d_x"], measured.whisk["d_x"] - 60.0
    before, after = (
        float(np.sqrt(gradient @ one @ gradient)) for one in (fitted.fit_covariance, whole)
    )
    assert abs(error) > 3.0 * before
    assert abs(error) < 3.0 * after


def test_a_camera_off_is_told_where_the_others_hardly_know_the_bar(rng):
    """What leaving it out moves is within what the others know; its lines are not where they have them."""
    problem, _, fitted, measured, by, found = left_out(rng, NEAR, off_px=2.0)
    third = found[2]
    assert np.all(np.abs(third.moved) < 2.0 * third.moved_sigma)
    assert third.contradicts
    assert abs(third.line_offset_px) == pytest.approx(2.0, abs=4.0 * third.line_offset_sigma_px)
    whole, gradient = fitted.fit_covariance + covariance_of(found, problem.size), by.whisk["d_x"]
    assert abs(measured.whisk["d_x"] - 60.0) < 3.0 * np.sqrt(gradient @ whole @ gradient)


def test_cameras_that_hardly_know_the_bar_agree_with_a_third(rng):
    problem, *_, found = left_out(rng, NEAR)
    assert found[2].moved_sigma[0] > 3.0 * found[2].sigma[0]
    assert contradiction(found) == ""
    assert not covariance_of(found, problem.size).any()
