"""A whisk drawn from the fit's own model before two cameras, its line points with noise or without."""

from dataclasses import replace

import numpy as np

from vision.fit.problem import Problem, State, bar_axes, bar_axis, curves_of, shifts_mm
from vision.geometry.camera import Camera, Cameras
from vision.geometry.centreline import Curves, rotation_z
from vision.geometry.contact import BarAxis, clearance
from vision.geometry.polyline import normals
from vision.geometry.rods import Bar, Rods, Wire
from vision.geometry.rounded import RoundedAxis
from vision.geometry.silhouette import outline
from vision.wire.points import LinePoints, Observed

WIRE = Wire("cylinder", 100.0, 1.0)
REACH = 3.5
RODS = Rods(WIRE, Bar(2.0 * REACH - WIRE.diameter_mm))


def camera(name, centre, target=(55.0, 5.0, 0.0), focal=2000.0):
    """A camera at `centre` that looks at `target`, its picture upright."""
    centre, target = np.array(centre, dtype=float), np.array(target)
    z = (target - centre) / np.linalg.norm(target - centre)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(z, x), z])
    matrix = np.array([[focal, 0, 640.0], [0, focal, 360.0], [0, 0, 1]])
    return Camera(
        name, (1280, 720), matrix, np.array([-0.1, 0.1, 0, 0, 0]), np.column_stack([R, -R @ centre])
    )


CAMERAS = Cameras((camera("one", (38, -175, 335)), camera("two", (130, -325, 120))))


def scene(beta_deg=40.0, touch_deg=2.3, d_x=60.0, frames=7, motion=None, rods=RODS):
    """A problem without line points and the state that is its truth: a whisk whose contact keeps the reach. motion: of
    the bar; its parameters are off by 0.1 each."""
    motor = np.radians(0.7 + 0.9 * np.arange(frames))
    touch, beta = np.radians(touch_deg), np.radians(beta_deg)
    turn = rotation_z(touch)
    axis = BarAxis(
        turn @ (np.array([d_x, 0, 0]) + REACH * np.array([0, np.cos(beta), -np.sin(beta)])),
        turn @ np.array([0.0, np.sin(beta), np.cos(beta)]),
    )
    touching = motor > touch
    problem = Problem(CAMERAS, rods, axis, motor, touching, touching, [], motion=motion)
    vector = np.zeros(problem.size)
    vector[4:12] = [0.05, 0.1, -0.2, 0.0, -0.05, 0.1, -0.3, 0.0]
    vector[problem.blocks.motion.slice] = 0.1
    state = State(vector, np.full(frames, d_x))
    return problem, _bent_until_touching(problem, state)


def _bent_until_touching(problem, state, slope=0.35):
    """Bends whose contact is on the bar: their y component by secant, z a fixed share of it."""
    count = int(problem.bent.sum())
    low, high = np.zeros(count), np.full(count, -0.2)
    for _ in range(60):
        middle = 0.5 * (low + high)
        vector = state.vector.copy()
        vector[problem.first_bend :] = np.stack([middle, -slope * middle], axis=1).ravel()
        arcs = state.arcs_mm
        for _ in range(6):
            curves, arcs = curves_of(problem, vector, arcs)
        gap = (
            clearance(curves, bar_axes(problem, vector), problem.wire)[0]
            - problem.rods.reach_mm(arcs)
        )[problem.bent]
        low, high = np.where(gap < 0, middle, low), np.where(gap < 0, high, middle)
    return State(vector, arcs)


def rounded_scene(form, stands):
    """As `scene`, of an object that is no straight bar. stands: where it does, from the point (3,) that is touched, the
    way (3,) from the whisker into it and the direction (3,) of the bar that the contact sees."""
    turn, beta = rotation_z(np.radians(2.3)), np.radians(40.0)
    inwards, along = (
        turn @ [0, np.cos(beta), -np.sin(beta)],
        turn @ [0.0, np.sin(beta), np.cos(beta)],
    )
    spot = turn @ [60.0, 0.0, 0.0] + 0.5 * WIRE.diameter_mm * inwards
    axis = RoundedAxis(*stands(spot, inwards, along), form, spot)
    problem, state = scene()
    problem = replace(problem, axis=axis, rods=Rods(WIRE, form))
    vector = np.zeros(problem.size)
    vector[4:12] = state.vector[4:12]
    return problem, _bent_until_touching(
        problem, State(vector, np.full(len(problem.motor_rad), 60.0)), 0.9
    )


def with_outline(problem, state, rng=None, sigma=0.05):
    """The problem with line points of the wire, and points of a rounded object's outline."""
    axis, radius_mm = bar_axis(problem, state.vector), problem.rods.bar.radius_mm
    seen = [one for one in with_points(problem, state, rng, sigma).seen if one.frame >= 0]
    for number, view in enumerate(problem.cameras):
        points, ways = (
            of.reshape(-1, 3) for of in axis.silhouette(view.centre_mm, radius_mm, 25.0, 12)
        )
        px, by_point, _ = view.project_with_jacobians(points)
        normal = np.einsum("nij,nj->ni", by_point, ways)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        noise = 0.0 if rng is None else sigma * rng.standard_normal(len(px))[:, None]
        far = np.linalg.norm(points - view.centre_mm, axis=1)
        seen.append(
            Observed(
                -1, number, LinePoints(px + noise * normal, normal, np.full(len(px), sigma), far), 1
            )
        )
    return replace(problem, seen=seen)


def with_points(problem, state, rng=None, sigma=0.05):
    """The problem with line points of wire and bar drawn from the state, with noise where a generator is given."""
    curves, _ = curves_of(problem, state.vector, state.arcs_mm)
    seen = []
    for number, view in enumerate(problem.cameras):
        for frame in range(len(problem.motor_rad)):
            place = np.linspace(8.0, 95.0, 30)
            one = Curves(curves.arc_mm, curves.points_mm[frame], curves.tangents[frame])
            seen.append(
                Observed(frame, number, _points(view.project(one.at(place)[0]), place, sigma, rng))
            )
        if not isinstance(problem.axis, BarAxis):
            continue
        place = np.linspace(-25.0, 25.0, 20)
        for frame in range(1 if problem.motion is None else len(problem.motor_rad)):
            px = bar_middle(problem, view, state.vector, place, frame)
            seen.append(Observed(-1, number, _points(px, place, sigma, rng), bar_in=frame))
    return replace(problem, seen=seen)


def bar_middle(problem, camera, vector, place_mm, frame=0):
    """Middle (n, 2) of the bar's outline in a camera, at places (n,) along its axis; frame: of a bar that moves."""
    axis = bar_axis(problem, vector)
    points = axis.point_mm + shifts_mm(problem, vector)[frame] + place_mm[:, None] * axis.direction
    return outline(
        camera, points, np.broadcast_to(axis.direction, points.shape), problem.rods.bar.radius_mm
    )[0]


def _points(px, place, sigma, rng):
    normal = normals(px)
    noise = 0.0 if rng is None else sigma * rng.standard_normal(len(px))[:, None]
    return LinePoints(px + noise * normal, normal, np.full(len(px), sigma), place)


def begun(problem, state):
    """A start that knows the bends to a fifth and nothing of bar and rest shape but the expected axis."""
    vector = state.vector.copy()
    vector[: problem.first_bend] = 0.0
    vector[problem.first_bend :] *= 0.8
    return State(vector, state.arcs_mm)
