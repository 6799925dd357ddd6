"""Beam against spline: silent on wires that are beams, loud on wires that are none where the truth suffers."""

import numpy as np
import pytest

from bench.rig.protocol_tables import WhiskerTable
from tests.studies.accuracy.broken_beams import broken, check_of, joint, loose_clamp, softer_outside
from tests.studies.accuracy.scenes import as_problem, draw_scene, line_points
from vision.fit.beam_check import BeamCheck, Compared, _fit_added, _LeastSquares
from vision.fit.covariance import chance_of
from vision.geometry.rods import Wire


def checked(seed: int, softness=None, shape="cylinder", given="cylinder") -> BeamCheck:
    """The check of a drawn scene with noisy points and exact cameras; given: the shape that the fit is told."""
    scene, rng = (
        draw_scene(seed, whisker=WhiskerTable(shape=shape)),
        np.random.default_rng([seed, 30]),
    )
    seen = line_points(scene, rng)
    if softness is not None:
        seen = broken(scene, seen, softness)
    wire = Wire(given, scene.wire.length_mm, scene.wire.diameter_mm)
    return check_of(as_problem(scene, scene.cameras, wire, scene.bar, seen))


@pytest.mark.parametrize("seed", range(4))
def test_a_wire_that_is_a_beam_is_none_by_chance_alone(seed):
    check = checked(seed)
    assert check.alarm == "" and check.chance > 1e-3
    for moved in (check.d_x, check.touch, check.slip):
        assert abs(moved.spline - moved.beam) < 4 * moved.difference_sigma


@pytest.mark.parametrize(
    "seed, softness", [(3, softer_outside(1.5)), (4, joint(30.0, 5.0)), (3, loose_clamp(3.0))]
)
def test_what_gives_way_is_told_where_it_moves_the_truth(seed, softness):
    """Rods that are softer outside, jointed, or loose in the clamp move touch or slip by over a sigma; the spline
    brings back what the whole rod gave, but for its noise (four sigma) and its few knots (a third of the move)."""
    whole, given_way = checked(seed), checked(seed, softness)
    assert given_way.alarm
    moves = []
    for name in ("touch", "slip"):
        before, after = getattr(whole, name), getattr(given_way, name)
        move, left = abs(after.beam - before.beam), abs(after.spline - before.beam)
        assert left < 4 * after.difference_sigma + move / 3
        moves.append(move / after.sigma)
    assert max(moves) > 1.0


def test_a_cone_entered_as_a_cylinder_is_told():
    assert checked(1, shape="cone", given="cylinder").alarm != ""
    assert checked(1, shape="cone", given="cone").alarm == ""


def test_little_is_no_alarm_however_sure():
    small, large = Compared(60.0, 60.004, 0.0005, 0.01), Compared(0.2, 0.24, 0.005, 0.01)
    assert BeamCheck(small, small, small, 0.1, 1e-12).alarm == ""
    said = "slip at 5.7 deg is +0.0400 ± 0.0050 mm from the beam's, 4.0 of its stated sigma"
    assert said in BeamCheck(small, small, large, 0.1, 1e-12).alarm
    assert BeamCheck(small, small, large, 0.1, 0.01).alarm == ""
    assert BeamCheck(small, small, large, 0.1, float("nan")).alarm == ""


def test_lines_that_tell_nothing_are_no_departure():
    """No point lies on a bent wire: nothing is told, and nothing breaks."""
    found = _fit_added(_least_squares(np.ones(3), np.eye(3)), np.zeros((3, 2)))
    assert chance_of(found.values, found.covariance) == 1.0
    assert np.isnan(chance_of(found.values, np.nan * found.covariance))


def _least_squares(residual, jacobian):
    """Return a problem without priors of their own, by cameras that are exact."""
    return _LeastSquares(
        residual, jacobian, np.zeros((1, 3)), np.zeros((len(residual), 1)), np.zeros((1, 1))
    )


def test_one_step_is_the_joint_fit(rng):
    """A linear problem solved without and then with more columns is the problem solved at once."""
    own, rows, residual = (
        rng.standard_normal((40, 3)),
        rng.standard_normal((40, 2)),
        rng.standard_normal(40),
    )
    residual = residual - own @ np.linalg.lstsq(own, residual)[0]
    found = _fit_added(_least_squares(residual, own), rows)
    whole = np.hstack([own, rows])
    at_once = np.linalg.lstsq(whole, -residual)[0]
    # the check's own wide prior (50) pulls by 1 in 40 * 50² = 1e-5 of what is found
    both = np.concatenate([found.parameters_by @ found.values, found.values])
    np.testing.assert_allclose(both, at_once, atol=1e-5)
    covariance = np.linalg.inv(whole.T @ whole)[3:, 3:]
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-4)
