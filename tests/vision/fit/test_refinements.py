"""What the truth would be without a refinement, against fits that are made without it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from bench.rig.protocol_tables import MotorTable, PicturesTable, TrialTable, WhiskerTable
from tests.studies.accuracy.coverage import SCALES
from tests.studies.accuracy.scenes import as_problem, begin, draw_scene, line_points
from vision.fit import blocks, solve
from vision.fit import problem as model
from vision.fit.converged_fit import ConvergedFit
from vision.fit.problem import Problem
from vision.fit.refinements import left_out
from vision.geometry import centreline
from vision.geometry.camera import Cameras
from vision.geometry.centreline import Curves
from vision.geometry.rods import Wire
from vision.wire.one_sided import SeenWidth, WireAppearance

WHISKER = {"sag_mm": 0.3, "set_y_mm": 0.5, "set_z_mm": -0.4}


@cache
def drawn(seed: int, shape: str = "cylinder") -> ConvergedFit:
    """The fit to a drawn scene with noisy points and exact cameras."""
    scene = draw_scene(seed, whisker=WhiskerTable(shape=shape, **WHISKER))
    seen = line_points(scene, np.random.default_rng([seed, 30]))
    return fitted(as_problem(scene, scene.cameras, scene.wire, scene.bar, seen))


def fitted(problem: Problem) -> ConvergedFit:
    state, _ = solve.solve(problem, begin(problem), scales=SCALES)
    state, _ = solve.solve(problem, state, scales=(4.0, 4.0, 4.0))
    fit = ConvergedFit(problem, state)
    _ = fit.measured, fit.by_parameter, fit.linear, fit.inverse_normal  # by the model as it is now
    return fit


def moved(before: ConvergedFit, after: ConvergedFit) -> np.ndarray:
    """d_x, touch and slip at the end of the stroke, one less the other."""
    values = (
        [f.measured.whisk["d_x"], f.measured.whisk["touch"], f.measured.frame["slip"][f.last_frame]]
        for f in (after, before)
    )
    return np.subtract(*values)


def told(fit: ConvergedFit, name: str, light=()) -> np.ndarray:
    found = left_out(fit, dict(light))[name]
    return np.array([found.d_x_mm, found.touch_rad, found.slip_mm])


def sigmas(fit: ConvergedFit) -> np.ndarray:
    """By noise alone, of the same three."""
    rows = (
        fit.by_parameter.whisk["d_x"],
        fit.by_parameter.whisk["touch"],
        fit.by_parameter.frame["slip"][fit.last_frame],
    )
    return np.array([np.sqrt(row @ fit.inverse_normal @ row) for row in rows])


def small_angles(rest_mm, bend_rad, contact_mm, motor_rad, wire, _pull=0.0) -> Curves:
    """Centrelines whose slopes are no sines and whose arcs are distances."""
    true, straight = (
        centreline.centrelines(rest_mm, bend, contact_mm, motor_rad, wire)
        for bend in (bend_rad, np.zeros_like(bend_rad))
    )
    growth = centreline.tangent_growth(true.arc_mm, np.asarray(contact_mm)[..., None], wire)
    turn = np.swapaxes(centreline.rotation_z(motor_rad), -1, -2)
    tangents = straight.tangents @ np.swapaxes(turn, -1, -2)
    tangents[..., 1:] += growth[..., None] * np.asarray(bend_rad)[..., None, :]
    tangents[..., 0] = 1.0
    points = cumulative_simpson(tangents, x=true.arc_mm, axis=-2, initial=0.0)
    points[..., 1:] += np.asarray(rest_mm)[..., None, :, 0]
    return Curves(true.arc_mm, points @ turn, tangents @ turn)


def test_large_bending_is_what_a_fit_of_small_angles_differs_by(monkeypatch):
    fit = drawn(3)
    predicted = told(fit, "large bending")
    monkeypatch.setattr(model, "centrelines", small_angles)
    np.testing.assert_allclose(
        predicted, moved(fit, fitted(fit.problem)), atol=0.01 * sigmas(fit).max(), rtol=0.2
    )


def test_sag_and_set_are_what_a_straight_whisker_differs_by(monkeypatch):
    """A tenth is what large set leaves to the second order."""
    fit = drawn(3)
    stiff = blocks.REST_PRIOR_MM.copy()
    stiff[2:] = 1e-6
    predicted = told(fit, "sag and set")
    monkeypatch.setattr(blocks, "REST_PRIOR_MM", stiff)
    true = moved(fit, fitted(replace(fit.problem)))
    assert np.all(np.abs(predicted - true) < 0.1 * np.abs(true) + 0.1 * sigmas(fit))
    assert np.max(np.abs(true) / sigmas(fit)) > 0.5


def test_taper_left_out_is_seen_in_its_size():
    """A cone as a cylinder is tens of sigmas off, where nothing is linear: its size is told within a factor of two."""
    fit = drawn(1, "cone")
    wire = fit.problem.wire
    plain = Wire("cylinder", wire.length_mm, wire.diameter_mm)
    true = moved(fit, fitted(replace(fit.problem, rods=replace(fit.problem.rods, wire=plain))))
    predicted = told(fit, "taper")
    assert 0.5 < predicted[2] / true[2] < 2.0 and abs(true[2]) > 5 * sigmas(fit)[2]
    assert left_out(drawn(3), {})["taper"].why == "the whisker does not taper"


def test_a_tilt_that_is_held_is_held():
    """The step that holds psi at 0 changes psi by what it was, and the constrained optimum costs least."""
    fit = drawn(3)
    step = fit.inverse_normal @ fit.by_parameter.whisk["psi"]
    step *= -fit.measured.whisk["psi"] / (fit.by_parameter.whisk["psi"] @ step)
    assert fit.by_parameter.whisk["psi"] @ step == pytest.approx(-fit.measured.whisk["psi"])
    found = left_out(fit, {})["psi"]
    assert found.d_x_mm == pytest.approx(fit.by_parameter.whisk["d_x"] @ step)


def test_friction_along_the_whisker_is_what_a_fit_without_any_differs_by(monkeypatch):
    """In a push of 16 degrees that is held, which shows it."""
    held = [TrialTable(beta_deg=0.0, friction=0.3, static_friction=0.3)]
    motor, pictures = MotorTable(after_deg=16.1), PicturesTable(after_deg=16.0, step_deg=2.0)
    scene = draw_scene(3, whisker=WhiskerTable(), trials=held, motor=motor, pictures=pictures)
    fit = fitted(as_problem(scene, scene.cameras, scene.wire, scene.bar, line_points(scene)))
    predicted = told(fit, "friction along the whisker")
    monkeypatch.setattr(blocks, "PULL_PRIOR", 1e-6)
    true = moved(fit, fitted(replace(fit.problem)))
    assert np.all(np.abs(predicted - true) < 0.2 * np.abs(true) + 0.01 * sigmas(fit))
    assert np.max(np.abs(true) / sigmas(fit)) > 0.1


def test_light_from_one_side_moves_the_wire_in_its_camera_alone():
    fit = drawn(3)
    name = fit.problem.cameras.names[0]
    half = WireAppearance(1.0, SeenWidth(2.0, 5.0, 0.5))
    assert np.any(told(fit, "one-sided light", {name: half}) != 0)
    both = WireAppearance(1.0, SeenWidth(5.0, 5.0, 0.5))
    assert (
        left_out(fit, {name: both})["one-sided light"].why
        == "every camera sees both edges of the wire"
    )


def test_lens_terms_answer_by_the_calibration_s_covariance():
    """A term that nothing else is correlated with moves nothing else: d_x moves as by the term itself."""
    fit = drawn(3)
    assert "exact" in left_out(fit, {})["lens k1 k2"].why and np.isnan(told(fit, "lens k1 k2")[0])
    cameras = fit.problem.cameras
    free = Cameras(cameras.cameras, 1e-8 * np.eye(len(cameras.covariance)))
    loose = ConvergedFit(replace(fit.problem, cameras=free), fit.state)
    step = np.zeros((len(cameras), 15))
    step[:, 4:6] = [-camera.lens[4:6] for camera in cameras]
    other = fitted(replace(fit.problem, cameras=cameras.moved(step.ravel())))
    predicted, true = told(loose, "lens k1 k2"), moved(fit, other)
    assert np.all(np.abs(predicted - true) < 0.1 * np.abs(true) + 0.05 * sigmas(fit))
