"""One camera alone: where the bar is from its two edges, when it is touched from when the whisker bends."""

from dataclasses import replace

import numpy as np
import pytest

from tests.scenes.model_scenes import CAMERAS, REACH, begun, camera, scene, with_points
from tests.studies.accuracy.bar_lines import (
    AWAY_MM,
    CENTRE,
    RADIUS_MM,
    edges_px,
    noisy_view,
    painted,
)
from tests.studies.accuracy.lines import squares
from vision.fit.bend_onset import Onset, onset
from vision.fit.converged_fit import ConvergedFit
from vision.fit.covariance import variance_by_cause
from vision.fit.problem import State, bar_axis
from vision.fit.solve import linearise, solve
from vision.fit.touch_by_onset import touch_by_onset
from vision.geometry.camera import Cameras
from vision.geometry.contact import BarAxis
from vision.geometry.polyline import normals
from vision.geometry.silhouette import grazed
from vision.geometry.vision_settings import VisionSettings
from vision.touched.axis import settle_axis
from vision.touched.edges import measure_edges
from vision.touched.object_view import ObjectView
from vision.touched.one_view import axis_from_edges, seen_from_one_side
from vision.wire.points import LinePoints, Observed

PLACES_MM = np.array([-20.0, 20.0])


def edge_points(view, axis, radius_mm, sigma_px=0.12):
    """Two points on each edge of a bar's exact outline, by side; each with the normal of its own edge."""
    points = axis.point_mm + PLACES_MM[:, None] * axis.direction
    px = [
        view.project(edge)
        for edge in grazed(view, points, np.broadcast_to(axis.direction, points.shape), radius_mm)
    ]
    across = normals(0.5 * (px[0] + px[1]))[0]
    low, high = sorted(px, key=lambda edge: float(np.mean(edge @ across)))
    return {
        side: LinePoints(edge, normals(edge), np.full(2, sigma_px), PLACES_MM)
        for side, edge in ((-1, low), (1, high))
    }


def alone(onset_at=None):
    """A whisk before the first camera only, its bar told by its edges; and the state that is its truth."""
    problem, truth = scene()
    (view,) = cameras = Cameras(CAMERAS.cameras[:1])
    offsets_of_second = np.r_[
        problem.blocks.wire_offsets[1].slice, problem.blocks.bar_offsets[1].slice
    ]
    problem = replace(problem, cameras=cameras, onset=onset_at)
    truth = State(np.delete(truth.vector, offsets_of_second), truth.arcs_mm)
    problem = with_points(problem, truth)
    wire = [seen for seen in problem.seen if seen.frame >= 0]
    edges = edge_points(view, problem.axis, REACH - 0.5)
    return replace(
        problem, seen=wire + [Observed(-1, 0, points, side) for side, points in edges.items()]
    ), truth


def test_edges_give_the_axis_back():
    """A cylinder's grazing planes are exact: what is left is the iteration that takes the lens's distortion back."""
    view = camera("one", (38, -175, 335))
    axis = BarAxis(np.array([60.0, 3.0, 1.0]), np.array([0.1, 0.5, np.sqrt(0.74)]))
    found = axis_from_edges(edge_points(view, axis, 3.0), view, 3.0)
    assert np.allclose(found.direction, axis.direction, atol=1e-6)
    away = found.point_mm - axis.point_mm
    assert np.linalg.norm(away - (away @ axis.direction) * axis.direction) < 1e-4


def test_edges_of_a_drawn_bar_lie_where_they_say(rng):
    """From a pixel off and 4 % too wide, both edges within three of their own sigmas, an eighth of a pixel."""
    angle, across_mm = 1.2, 0.7
    view = noisy_view(painted, squares, angle, across_mm, rng)
    across = np.array([-np.sin(angle), np.cos(angle), 0.0])
    axis = BarAxis(
        (across_mm + 0.2) * across - [0, 0, 0.04 * AWAY_MM],
        np.array([np.cos(angle), np.sin(angle), 0.0]),
    )
    found = measure_edges(ObjectView(view, RADIUS_MM, VisionSettings()), axis, coarse=True)
    seen = sorted(
        [
            (float(np.mean((p.px - CENTRE) @ across[:2])), float(p.sigma_px.max()))
            for p in found.values()
        ]
    )
    for (at, sigma), true in zip(seen, edges_px(across_mm)):
        assert sigma < 0.15
        assert abs(at - true) < 3 * sigma


def test_one_side_is_less_than_a_degree():
    axis = BarAxis(np.array([60.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))

    def turned(deg):
        return camera(
            str(deg),
            60 * np.eye(3)[0]
            + 400 * np.array([np.sin(np.radians(deg)), -np.cos(np.radians(deg)), 0.3]),
        )

    assert seen_from_one_side(Cameras((turned(0.0),)), axis)
    assert seen_from_one_side(Cameras((turned(0.0), turned(0.6))), axis)
    assert not seen_from_one_side(Cameras((turned(0.0), turned(2.0))), axis)


def test_rows_of_edges_and_onset_are_derivatives(rng):
    problem, truth = alone(Onset(np.radians(2.3), np.radians(0.1)))
    state = State(truth.vector + 1e-3 * rng.standard_normal(problem.size), truth.arcs_mm)
    linear, _ = linearise(problem, state)
    for k in range(problem.size):
        step = (1e-5 if k >= problem.first_bend or 2 <= k < 4 else 1e-3) * np.eye(problem.size)[k]
        ahead, behind = (
            linearise(problem, State(state.vector + s * step, state.arcs_mm))[0].residual
            for s in (1, -1)
        )
        column = (ahead - behind) / (2 * np.max(step))
        # one-sided differences, off by half their step times the curvature
        assert np.allclose(
            linear.jacobian[:, k], column, atol=3e-3 * max(1.0, np.max(np.abs(column)))
        )


def test_edges_tell_how_far_away_the_bar_is():
    """From 8 mm nearer: lines and edges are exact, only the priors of rest shape and bend pull, by a third of a mm."""
    problem, truth = alone()
    (view,) = problem.cameras
    sight = (problem.axis.point_mm - view.centre_mm) / np.linalg.norm(
        problem.axis.point_mm - view.centre_mm
    )
    near = replace(
        problem, axis=BarAxis(problem.axis.point_mm - 8.0 * sight, problem.axis.direction)
    )
    found, _ = solve(near, begun(near, truth))
    axis = bar_axis(near, found.vector)
    away = axis.point_mm - problem.axis.point_mm
    away = away - (away @ axis.direction) * axis.direction
    assert np.linalg.norm(away) < 0.3
    fit = ConvergedFit(near, found)
    gradient = fit.by_parameter.whisk["d_x"]
    parts = variance_by_cause(fit, gradient)
    assert sum(parts.values()) == pytest.approx(gradient @ fit.fit_covariance @ gradient, rel=1e-6)


def test_touch_is_when_the_whisker_begins_to_bend():
    """The frames of a whisk with every frame but the first two free to bend: touch at 2.3 degrees comes back."""
    problem, truth = alone()
    bent = np.arange(len(problem.motor_rad)) >= 2
    wide = replace(problem, bent=bent, touching=problem.touching & bent)
    vector = np.concatenate([truth.vector[: problem.first_bend], np.zeros(2 * int(bent.sum()))])
    true = truth.vector[problem.first_bend :]
    vector[-len(true) :] = true
    state, covariance = solve(wide, State(vector, truth.arcs_mm))
    found, state = touch_by_onset(wide, state, covariance)
    assert (
        abs(found.onset.motor_rad - np.radians(2.3)) < 2 * found.onset.sigma_rad < np.radians(0.6)
    )
    assert len(state.vector) == found.size
    assert np.all(found.touching == problem.touching)


def test_an_onset_is_found_within_its_sigma(rng):
    """Ten draws of a bend that grows from 2.1 degrees on, known to 0.02 degrees a frame."""
    motor = np.radians(np.arange(0.4, 7.0, 0.6))
    grown = 0.4 * np.clip(motor - np.radians(2.1), 0.0, None)
    sigma = np.radians(0.02)
    for _ in range(10):
        found = onset(
            motor, grown + sigma * rng.standard_normal(len(motor)), sigma**2 * np.eye(len(motor))
        )
        assert found.sigma_rad < np.radians(0.4)
        assert abs(found.motor_rad - np.radians(2.1)) < 3 * found.sigma_rad


def test_no_bend_is_no_onset(rng):
    motor, sigma = np.radians(np.arange(0.4, 7.0, 0.6)), np.radians(0.02)
    assert (
        onset(motor, sigma * rng.standard_normal(len(motor)), sigma**2 * np.eye(len(motor))) is None
    )


def test_a_bar_is_counted_by_its_direction_with_positive_z():
    """Else slope and slip come out turned by 180 degrees: a search round the sight may end on either."""
    up = BarAxis(np.array([60.0, 5.0, 0.0]), np.array([0.0, 0.6, 0.8]))
    down = BarAxis(up.point_mm, -up.direction)
    assert up.upward() is up and np.array_equal(down.upward().direction, up.direction)
    assert np.allclose(settle_axis(down, Cameras(()), {}, 3.0).direction, up.direction)
