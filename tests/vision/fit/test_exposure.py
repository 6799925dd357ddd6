"""A frame that a jump of slip falls into says so by its blur, and slip of that frame alone gets a wider sigma."""

from dataclasses import replace

import numpy as np
import pytest

from tests.studies.accuracy.scenes import as_problem, begin, draw_scene, line_points
from vision.fit.converged_fit import ConvergedFit
from vision.fit.exposure import slip_in_exposure
from vision.fit.problem import bar_axis, curves_of
from vision.fit.solve import solve
from vision.geometry.contact import BarAxis, clearance

JUMPED, VARIANCE_MM2, SIGMA_PX2 = 2, 0.05**2, 0.05


@pytest.fixture(scope="module")
def fitted():
    """The fit to a scene of exact points."""
    scene = draw_scene(0)
    problem = as_problem(scene, scene.cameras, scene.wire, scene.bar, line_points(scene))
    state, _ = solve(problem, begin(problem), scales=(1e9,) * 8)
    return ConvergedFit(problem, state)


def slipped_px(fit, frame):
    """How far each of a frame's points moves (n,) as the wire slips by 1 mm along the bar."""
    problem, state = fit.problem, fit.state
    slip = fit.by_parameter.frame["slip"]
    own, step = problem.bend_of(frame), 1e-5

    def gap_and_lines(change):
        vector = state.vector.copy()
        vector[own] += change
        arcs = state.arcs_mm
        for _ in range(3):
            curves, arcs = curves_of(problem, vector, arcs)
        axis = bar_axis(problem, vector)
        lines = [
            np.sum(
                one.points.normal
                * problem.cameras.cameras[one.camera].project(
                    curves.at(one.points.place)[0][frame]
                ),
                axis=1,
            )
            for one in problem.seen
            if one.frame == frame
        ]
        return clearance(curves, BarAxis(axis.point_mm, axis.direction), problem.wire, arcs)[0][
            frame
        ], np.concatenate(lines)

    here, moved = gap_and_lines(np.zeros(2)), [gap_and_lines(step * one) for one in np.eye(2)]
    away = np.array([(one[0] - here[0]) / step for one in moved])
    bend = np.array([-away[1], away[0]])  # keeps touching
    lines = np.stack([(one[1] - here[1]) / step for one in moved], axis=1)
    return lines @ (bend / (slip[frame, own] @ bend))


def test_the_frame_that_jumped_is_told_and_its_slip_alone_is_less_sure(fitted, rng):
    """Blur of a part in 25 of a pixel² more, known to 0.05 in each of some 60 points."""
    problem, state = fitted.problem, fitted.state
    frame = np.flatnonzero(problem.touching)[JUMPED]
    px_per_mm, seen = slipped_px(fitted, frame), []
    for one in problem.seen:
        count = len(one.points)
        above = 0.3 + SIGMA_PX2 * rng.standard_normal(
            count
        )  # all are as blurred as the motor's speed makes them
        if one.frame == frame:
            mine, px_per_mm = np.split(px_per_mm, [count])
            above += VARIANCE_MM2 * mine**2
        widened = np.stack([above, np.full(count, SIGMA_PX2)], axis=1)
        seen.append(replace(one, points=replace(one.points, widened_px2=widened)))
    found = slip_in_exposure(ConvergedFit(replace(problem, seen=seen), state))
    assert np.flatnonzero(found.variance_mm2).tolist() == [frame]
    assert found.variance_mm2[frame] == pytest.approx(VARIANCE_MM2, rel=0.15)
    slip = fitted.by_parameter.frame["slip"]
    variances = np.einsum("fi,ij,fj->f", slip, found.covariance, slip)
    assert np.allclose(variances, found.variance_mm2, atol=1e-9)


def test_points_of_which_no_blur_is_known_say_nothing(fitted):
    """Lines that were not traced in pictures."""
    found = slip_in_exposure(fitted)
    assert not np.any(found.variance_mm2) and not np.any(found.covariance)
