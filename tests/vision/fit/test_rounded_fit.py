"""The fit of a ring, a sphere and a cone: without noise it is exact."""

import numpy as np
import pytest

from tests.scenes.model_scenes import rounded_scene, with_outline
from vision.fit.problem import State, bar_axis
from vision.fit.quantities import measure
from vision.fit.solve import linearise, residuals, solve
from vision.geometry.cone import Cone
from vision.geometry.ring import Ring
from vision.geometry.sphere import Sphere


def ring(spot, inwards, along):
    return spot + (3.0 + 30.0) * inwards, np.cross(along, inwards)


def sphere(spot, inwards, along):
    return spot + 15.0 * inwards, along


def cone(spot, inwards, along):
    return spot + 6.0 / np.tan(0.3) * along, np.cos(0.3) * along - np.sin(0.3) * inwards


THINGS = {
    "ring": (Ring(6.0, 0.0, 60.0), ring),
    "sphere": (Sphere(30.0), sphere),
    "cone": (Cone(0.3), cone),
}


@pytest.fixture(params=THINGS, scope="module")
def scene(request):
    return rounded_scene(*THINGS[request.param])


def off(problem, state):
    """A start that knows the bends to a fifth, the object to half a millimetre and 0.01 rad, and no rest shape."""
    vector = state.vector.copy()
    vector[: problem.first_bend] = 0.0
    vector[:4], vector[problem.blocks.shift_along.start] = [0.5, -0.4, 0.01, -0.01], 0.5
    vector[problem.first_bend :] *= 0.8
    return State(vector, state.arcs_mm)


def test_without_noise_touch_slope_and_slip_are_exact(scene):
    """But for what the priors pull: 1e-3 mm."""
    problem, truth = scene
    problem = with_outline(problem, truth)
    found, _ = solve(problem, off(problem, truth), scales=[30.0] * 4 + [10.0] * 8)
    here, there = (measure(problem, one.vector, one.arcs_mm) for one in (found, truth))
    assert there.whisk["touch"] == pytest.approx(np.radians(2.3), abs=0.01)
    for name, tolerance in {"touch": 2e-5, "d_x": 3e-3, "beta": 1e-3}.items():
        assert here.whisk[name] == pytest.approx(there.whisk[name], abs=tolerance)
    np.testing.assert_allclose(
        here.frame["slip"][problem.touching], there.frame["slip"][problem.touching], atol=1e-3
    )
    np.testing.assert_allclose(
        bar_axis(problem, found.vector).point_mm, problem.axis.point_mm, atol=0.02
    )


def test_derivatives_of_the_outline_are_those_of_differences(scene):
    problem, truth = scene
    problem = with_outline(problem, truth)
    rows = slice(sum(len(one.points) for one in problem.seen if one.frame >= 0) // 2, None)
    linear, _ = linearise(problem, truth)
    jacobian = linear.jacobian
    for k in (0, 1, 2, 3, problem.blocks.shift_along.start, problem.blocks.outline_bias.start):
        step = 1e-4 * (np.arange(problem.size) == k)
        ahead, behind = (
            residuals(problem, State(truth.vector + way * step, truth.arcs_mm)) for way in (1, -1)
        )
        count = np.sum(linear.is_point)
        np.testing.assert_allclose(
            jacobian[rows, k][: count // 4],
            ((ahead - behind) / 2e-4)[rows][: count // 4],
            atol=2e-2 * max(np.abs(jacobian[:, k]).max(), 1e-9),
        )
