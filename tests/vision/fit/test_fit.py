"""The reprojection fit against scenes made from its own model: exact without noise, gradients, stated scatter."""

import numpy as np
import pytest

from tests.scenes.model_scenes import (
    WIRE,
    begun,
    scene,
    with_points,
)
from vision.fit.problem import State, bends
from vision.fit.quantities import measure
from vision.fit.solve import least_squares, linearise, solve
from vision.fit.touch import first_touch
from vision.geometry.centreline import centrelines
from vision.geometry.contact import contact_frame_angles


def test_noiseless_points_give_the_model_back_to_a_nanometre():
    """Rung 1: the priors are the only pull, and points known to a millionth of a pixel leave them none."""
    problem, truth = scene()
    problem = with_points(problem, truth, sigma=1e-6)
    found, _ = solve(problem, begun(problem, truth), scales=(1e9,) * 20 + (2e9,))
    here, true = (measure(problem, s.vector, s.arcs_mm) for s in (found, truth))
    for name in ("d_x", "x", "y", "z"):
        assert here.whisk[name] == pytest.approx(true.whisk[name], abs=1e-6)
    assert here.whisk["touch"] == pytest.approx(true.whisk["touch"], abs=1e-8)
    assert np.allclose(
        here.frame["slip"][problem.touching], true.frame["slip"][problem.touching], atol=1e-6
    )


@pytest.mark.parametrize("apart", [1.0, 1e-3, 1e-7, 0.0])
def test_least_squares_are_those_of_singular_values_however_alike_two_columns_are(rng, apart):
    matrix = rng.standard_normal((40, 5)) * 10.0 ** np.arange(-6, 4, 2)
    matrix[:, 4] = 1e6 * matrix[:, 1] + apart * matrix[:, 4]
    target = rng.standard_normal(40)
    found = least_squares(matrix, target)
    best = np.linalg.lstsq(matrix, target, rcond=None)[0]
    np.testing.assert_allclose(matrix @ found, matrix @ best, rtol=1e-7, atol=1e-7)


def test_least_squares_of_a_column_of_zeros_leave_it_and_of_nan_there_are_none(rng):
    """Cholesky's factor of NaN is no failure to LAPACK: a fit that diverged went on without a word."""
    matrix = rng.standard_normal((40, 5))
    matrix[:, 2] = 0.0
    assert least_squares(matrix, matrix @ np.ones(5)) == pytest.approx([1.0, 1.0, 0.0, 1.0, 1.0])
    matrix[3, 1] = np.nan
    with pytest.raises(np.linalg.LinAlgError):
        least_squares(matrix, np.ones(40))


def test_jacobian_is_the_derivative_of_the_residual(rng):
    """Rung 2: central differences of the whole residual, the contact arcs left to find themselves."""
    problem, truth = scene()
    problem = with_points(problem, truth, rng)
    state = State(truth.vector + 1e-3 * rng.standard_normal(problem.size), truth.arcs_mm)
    linear, _ = linearise(problem, state)
    for k in range(problem.size):
        step = (1e-5 if k >= problem.first_bend or 2 <= k < 4 else 1e-3) * np.eye(problem.size)[k]
        ahead, behind = (
            linearise(problem, State(state.vector + s * step, state.arcs_mm))[0].residual
            for s in (1, -1)
        )
        column = (ahead - behind) / (2 * np.max(step))
        scale = max(1.0, np.max(np.abs(column)))
        assert np.allclose(linear.jacobian[:, k], column, atol=3e-3 * scale)


@pytest.mark.slow
def test_scatter_is_as_stated(rng):
    """Rung 3, small: 60 draws tell a standard deviation to 9 %; three of these are allowed."""
    problem, truth = scene()
    true = measure(problem, truth.vector, truth.arcs_mm).whisk
    z = {name: [] for name in ("d_x", "touch", "beta")}
    for _ in range(60):
        seen = with_points(problem, truth, rng)
        found, covariance = solve(seen, begun(seen, truth), scales=(30.0, 1e9, 1e9, 1e9))
        here = measure(seen, found.vector, found.arcs_mm).whisk
        for name in z:
            gradient = _gradient(seen, found, name)
            z[name].append((here[name] - true[name]) / np.sqrt(gradient @ covariance @ gradient))
    for name, values in z.items():
        # offsets and tilts of the lines have priors that these draws do not use: scatter may be smaller, not larger
        assert np.std(values) < 1.27, name
        assert abs(np.mean(values)) < 0.5, name


def _gradient(problem, state, name):
    from vision.fit.quantities import jacobians

    return jacobians(problem, state)[1].whisk[name]


def test_touch_and_slopes_are_those_of_the_conventions():
    for beta in (-50.0, 0.0, 40.0):
        problem, truth = scene(beta_deg=beta)
        straight = truth.vector.copy()
        straight[4:12] = 0.0
        touch = first_touch(problem, straight)
        assert np.degrees(touch.motor_rad) == pytest.approx(2.3, abs=1e-6)
        assert np.linalg.norm(touch.point_mm) == pytest.approx(60.0, abs=1e-6)
        found = contact_frame_angles(problem.axis.direction, touch.motor_rad)
        assert np.degrees(found) == pytest.approx([beta, 0.0], abs=1e-6)


def test_slip_is_positive_up_a_bar_that_leans_forward():
    """beta > 0 and pushing give sigma > 0, d_y > 0 and d_z > 0; mirrored, sigma and d_z change sign."""
    problem, truth = scene(beta_deg=40.0)
    measured = measure(problem, truth.vector, truth.arcs_mm).frame
    late = np.flatnonzero(problem.touching)[2:]
    assert np.all(measured["slip"][late] > 0)
    assert np.all(measured["d_y"][late] > 0) and np.all(measured["d_z"][late] > 0)


def test_a_bent_wire_keeps_its_length():
    curves = centrelines(
        np.zeros((2, 4)), np.array([-0.3, 0.1]), np.array(60.0), np.array(0.05), WIRE
    )
    steps = np.linalg.norm(np.diff(curves.points_mm, axis=0), axis=1)
    # a chord of an arc of 1.25 mm bent by 0.01 rad is 5e-6 of itself short
    assert steps.sum() == pytest.approx(100.0, abs=1e-3)
    assert np.allclose(np.linalg.norm(curves.tangents, axis=1), 1.0, atol=1e-12)


def test_bends_stand_where_frames_may_bend():
    problem, truth = scene()
    angles = bends(problem, truth.vector)
    assert np.all(angles[~problem.bent] == 0) and np.all(angles[problem.bent][:, 0] < 0)
