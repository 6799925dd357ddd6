"""The length of a whisker that tapers is a given with a sigma: it is in every sigma of the truth, as the pictures leave it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.scenes.model_scenes import scene, with_points
from vision.fit.converged_fit import ConvergedFit
from vision.fit.problem import CONTACT_SIGMA_MM, State
from vision.fit.solve import solve
from vision.fit.touch import first_touch, touch_and_sigma
from vision.geometry.contact import clearance
from vision.geometry.rods import Bar, ProfiledWire, Rods, Wire

EXACT = Wire("cone", 100.0, 1.5)
STATED = replace(EXACT, length_sigma_mm=0.5)
LONGER = replace(EXACT, length_mm=100.5)
BAR = Bar(6.0)


@pytest.fixture(scope="module")
def drawn():
    """A whisk of a cone without noise, and the state that drew it."""
    problem, state = scene(frames=9, rods=Rods(EXACT, BAR))
    return with_points(problem, state), state


def fitted(drawn, wire):
    """Fit the whisk with a wire as stated: problem, state, covariance, and touch, slip and phi with their gradients."""
    problem, true = drawn
    bends = true.vector[problem.first_bend :]
    problem = replace(problem, rods=Rods(wire, BAR))
    vector = np.zeros(problem.size)
    vector[:12] = true.vector[:12]
    vector[problem.first_bend :] = bends
    state, _ = solve(problem, State(vector, true.arcs_mm))
    fit = ConvergedFit(problem, state)
    measured, by = fit.measured, fit.by_parameter
    found = {"touch": (float(measured.whisk["touch"]), by.whisk["touch"])}
    for name in ("slip", "phi"):
        found[name] = float(measured.frame[name][-1]), by.frame[name][-1]
    return problem, state, fit.fit_covariance, found


def test_what_the_pictures_leave_of_the_lengths_sigma_is_in_touch_slip_and_phi(drawn):
    """As much as a length wrong by its sigma moves them, times what the bend's shape leaves of that sigma."""
    _, _, exact, values = fitted(drawn, EXACT)
    _, _, _, moved = fitted(drawn, LONGER)
    problem, _, covariance, found = fitted(drawn, STATED)
    taper = problem.blocks.taper.start
    left = np.sqrt(covariance[taper, taper]) / STATED.taper_sigma_per_mm
    assert 0.2 < left < 0.9
    for name, (value, gradient) in found.items():
        before, without = values[name]
        added = gradient @ covariance @ gradient - without @ exact @ without
        assert np.sqrt(added) == pytest.approx(left * abs(moved[name][0] - before), rel=0.05)
        assert value == pytest.approx(before, abs=1e-3 * np.sqrt(added))


def test_touch_of_one_vector_is_that_of_a_batch(drawn):
    problem, state, covariance, _ = fitted(drawn, STATED)
    touch_rad, sigma_rad = touch_and_sigma(problem, state.vector, covariance)
    batch = first_touch(problem, np.stack([state.vector, state.vector])).motor_rad
    assert batch == pytest.approx([touch_rad, touch_rad], abs=1e-9)
    assert 0.0 < sigma_rad < 1e-3


def test_a_length_off_by_its_sigma_is_partly_seen(drawn):
    """The fit returns to the truth by the share of the length's variance that the bend's shape takes away."""
    _, _, _, values = fitted(drawn, EXACT)
    _, _, _, moved = fitted(drawn, LONGER)
    problem, _, covariance, found = fitted(drawn, replace(LONGER, length_sigma_mm=0.5))
    taper = problem.blocks.taper.start
    left = covariance[taper, taper] / STATED.taper_sigma_per_mm**2
    for name, (value, _) in found.items():
        off = moved[name][0] - values[name][0]
        assert value - values[name][0] == pytest.approx(left * off, rel=0.1)


def test_the_wire_of_a_fit_has_the_taper_that_it_ended_with(drawn):
    """As stated, half a millimetre longer, it would be 0.7 CONTACT_SIGMA_MM from where the fit has it."""
    problem, state, _, _ = fitted(drawn, replace(LONGER, length_sigma_mm=0.5))
    fit = ConvergedFit(problem, state)
    distance, arc, _ = clearance(fit.curves, fit.axes, fit.wire)
    gap = distance - replace(problem.rods, wire=fit.wire).reach_mm(arc)
    residual = (gap[problem.touching] - state.vector[problem.blocks.reach.start]) / CONTACT_SIGMA_MM
    assert residual == pytest.approx(fit.linear.residual[problem.contact_rows], abs=1e-3)


@pytest.mark.parametrize("wire", [EXACT, Wire("cylinder", 100.0, 1.0, 0.5, 0.02)])
def test_an_exact_taper_and_none_are_no_parameter(drawn, wire):
    problem, _ = drawn
    assert not len(replace(problem, rods=Rods(wire, BAR)).blocks.taper)


def test_an_error_of_the_taper_is_another_length():
    """Of a cone, of one cut off, and of measured diameters: radius, its change, and the bend."""
    arc_mm = np.array([5.0, 30.0, 60.0])
    error = 1.0 / 100.5 - 1.0 / 100.0
    for wire, longer in (
        (EXACT, LONGER),
        (
            Wire("tapered", 100.0, 1.5, tip_diameter_mm=0.3),
            Wire("tapered", 100.0, 1.5, tip_diameter_mm=0.3 - 150.0 * error),
        ),
        (
            ProfiledWire("tapered", 100.0, 1.5, tip_diameter_mm=0.3, widths=(1.0, -1.0, 0.2)),
            ProfiledWire(
                "tapered", 100.0, 1.5, tip_diameter_mm=0.3, widths=(1.0, -1.0 - 100.0 * error, 0.2)
            ),
        ),
    ):
        same = replace(wire, taper_error_per_mm=error)
        assert same.radius_mm(arc_mm) == pytest.approx(longer.radius_mm(arc_mm), rel=1e-12)
        assert same.radius_by_arc(arc_mm) == pytest.approx(longer.radius_by_arc(arc_mm), rel=1e-12)
        assert same.turn(arc_mm, 70.0) == pytest.approx(longer.turn(arc_mm, 70.0), rel=1e-12)
