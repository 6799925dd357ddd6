"""One whisk: wire and object traced in all its frames and fitted together, by turns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.fit.converged_fit import ConvergedFit
from vision.fit.first_bends import SwingPictures, contact_arc, find_rest, follow_bends
from vision.fit.problem import Problem, State, at_rest
from vision.fit.scatter import inflated_by_residuals, scatter_px
from vision.fit.solve import LAST_SCALE, solve
from vision.geometry.centreline import Curves, centrelines, unbent_curves
from vision.geometry.contact import clearance
from vision.geometry.refusals import Misled, Refused
from vision.geometry.rotation import unit
from vision.geometry.touched import Axis
from vision.truth.line_source import LineSource
from vision.truth.strategies import Strategy, Touch, early, strategies
from vision.truth.traced_lines import blurs_px
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures
from vision.truth.whisk_place import WhiskPlace
from vision.wire.points import Observed

# [1] Least factor on the variances of the free stroke that places the rig. An error that changes
# slowly over a wide stroke is fitted as part of the whisker's turn, so that residuals do not show it.
# Study: tests/bench/trials/test_placing_pictures.py.
FREE_SHARED = 4.0


@dataclass(frozen=True)
class ExpectedWhisk:
    """What is expected before a pass, in f frames.

    place: of object and wire. rest_mm (2, 4): rest shape. bend_rad (f, 2), arcs_mm (f,): bends and
    contact arcs. touching, free (f,) bool.
    """

    place: WhiskPlace
    rest_mm: np.ndarray
    bend_rad: np.ndarray
    arcs_mm: np.ndarray
    touching: np.ndarray
    free: np.ndarray


def fit_whisk(whisk: WhiskPictures) -> FittedWhisk:
    """Fit wire and object to the frames that make the truth.

    Fills whisk.light with how each camera sees the wire. Raises Refused where there is no touch to
    fit.
    """
    *others, last = strategies(whisk)
    for strategy in others:
        try:
            return _fit_by(whisk, strategy)
        except Misled:
            raise
        except Refused:
            continue
    return _fit_by(whisk, last)


def _fit_by(whisk: WhiskPictures, strategy: Strategy) -> FittedWhisk:
    """Fit a whisk by one strategy. Raises Refused where it does not serve."""
    whisk, expected = _expect_coarsely(whisk, strategy.touch)
    lines = whisk.make_lines(whisk, strategy.reader)
    if whisk.earlier is not None:
        lines.begin_as(whisk.earlier)
    return fit_lines(whisk, lines, expected, strategy.touch)


def fit_lines(
    whisk: WhiskPictures, lines: LineSource, expected: ExpectedWhisk, touch: Touch
) -> FittedWhisk:
    """Fit the lines of a whisk pass by pass, each time near the curves of the pass before.

    Raises Refused where the lines determine no touch.
    """
    for _ in range(whisk.settings.rounds):
        seen = lines.all_points(expected.place, last=False)
        require_cameras(seen, touch)
        fit, covariance = _fit(whisk, expected, seen, touch)
        whisk = whisk.yielding_as(fit)
        check_scatter(fit, lines.most_scatter_px)
        touching, free = touch.split_by_fit(fit.problem, fit.state, covariance)
        expected = ExpectedWhisk(
            place=_fitted_place(whisk, fit),
            rest_mm=fit.rest_mm,
            bend_rad=fit.bend_rad,
            arcs_mm=fit.state.arcs_mm,
            touching=touching,
            free=free,
        )
    return fit_last(whisk, lines, expected, touch)


def require_cameras(seen: Sequence[Observed], touch: Touch) -> None:
    """Raise Refused where fewer cameras see the wire than touch is found with."""
    if len({one.camera for one in seen if one.on_wire}) < touch.fewest_cameras:
        raise Refused("a single camera sees wire and bar", code="single_camera")


def fit_last(
    whisk: WhiskPictures, lines: LineSource, expected: ExpectedWhisk, touch: Touch
) -> FittedWhisk:
    """Fit a whisk's lines near where a pass before has them, with all that enters their sigmas.

    Raises Refused where the fit shows no free stroke.
    """
    seen = lines.all_points(expected.place, last=True)
    fit, covariance = _fit(whisk, expected, seen, touch)
    # Raises where the last fit shows no free stroke.
    touch.split_by_fit(fit.problem, fit.state, covariance)
    return FittedWhisk(fit.problem, fit.state, whisk.frames, lines)


def _expect_coarsely(whisk: WhiskPictures, touch: Touch) -> tuple[WhiskPictures, ExpectedWhisk]:
    """Return the whisk in the frames to fit, and what coarse points say of them."""
    return expect_by_bends(whisk, touch, *coarse_shapes(whisk))


def expect_by_bends(
    whisk: WhiskPictures, touch: Touch, rest_mm: np.ndarray, coarse: Mapping[int, np.ndarray]
) -> tuple[WhiskPictures, ExpectedWhisk]:
    """Return the whisk in the frames to fit, and what its rest shape (2, 4) and bends say of them.

    coarse: by frame the bend (2,), rad. Raises Refused where they show no touch.
    """
    whisk = whisk.during(touch.frames_to_fit(whisk.motor, coarse))
    bend = np.array([coarse[f] for f in whisk.frames])
    touching, free = touch.split_by_bends(whisk.angles_rad, bend)
    curves, arcs_mm = coarse_curves(whisk, rest_mm, coarse)
    came = _expected_to_come_mm(whisk)
    if whisk.gives is not None:
        came = _given_way_mm(whisk, list(curves.values()), touching)
        whisk = whisk.yielding(came, _coarse_touch_rad(whisk, touching, free))
    place = WhiskPlace(whisk.bar.axis, curves, whisk.bar_swept_mm, came)
    return whisk, ExpectedWhisk(place, rest_mm, bend, arcs_mm, touching, free)


def _expected_to_come_mm(whisk: WhiskPictures) -> np.ndarray:
    """Return the bar's expected displacement (f, 3), mm, (1, 3) where it stands."""
    return np.zeros((1, 3)) if whisk.motion is None else whisk.motion.expected_mm


def _coarse_touch_rad(whisk: WhiskPictures, touching: np.ndarray, free: np.ndarray) -> float:
    """Return the motor angle between the first frame that touches and the last free one before.

    touching, free (f,) bool.
    """
    first = int(np.argmax(touching))
    last_free = np.flatnonzero(free[:first])[-1]
    return float(np.mean(whisk.angles_rad[[last_free, first]]))


def coarse_shapes(whisk: WhiskPictures) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Return the rest shape (2, 4), mm, and by frame the bend (2,), rad, to a pixel or two.

    Raises Refused where no whisker is seen to swing.
    """
    axis = whisk.bar.axis
    earlier = whisk.earlier
    if earlier is None:
        sights = _sights(whisk)
        free = np.array(whisk.frames)[early(whisk.angles_rad)]
        rest = find_rest(sights, whisk.cameras, axis, whisk.during(free.tolist()).motor)
        return rest, follow_bends(sights, axis, rest, whisk.motor)
    bend_rad = None
    if earlier.bends is not None and whisk.motion is None:
        bend_rad = earlier.bends.at(whisk.frames, whisk.angles_rad)
    if bend_rad is None:
        return earlier.rest_mm, follow_bends(_sights(whisk), axis, earlier.rest_mm, whisk.motor)
    return earlier.rest_mm, dict(zip(whisk.frames, bend_rad))


def _sights(whisk: WhiskPictures) -> list[SwingPictures]:
    """Return each camera's pictures of a whisk with what stands still in them."""
    sights = []
    for view in whisk.views:
        sights.append(
            SwingPictures.of(view, whisk.rods, whisk.bar.axis, whisk.frames, whisk.bar_swept_mm)
        )
    return sights


def coarse_curves(
    whisk: WhiskPictures, rest_mm: np.ndarray, bend_rad: Mapping[int, np.ndarray]
) -> tuple[dict[int, Curves], np.ndarray]:
    """Return by frame the wire's centreline, and its contact arcs (f,), mm.

    rest_mm (2, 4): rest shape. bend_rad: by frame the bend (2,).
    """
    wire = whisk.rods.wire
    motor_rad = whisk.angles_rad
    bends = np.array([bend_rad[frame] for frame in whisk.frames])
    arcs_mm = contact_arc(rest_mm, bends, motor_rad, whisk.bar.axis, wire)
    rests_mm = np.broadcast_to(rest_mm, (len(bends), *rest_mm.shape))
    curves = centrelines(rests_mm, bends, arcs_mm, motor_rad, wire)
    return {frame: curves.one(k) for k, frame in enumerate(whisk.frames)}, arcs_mm


def _given_way_mm(
    whisk: WhiskPictures, curves: Sequence[Curves], touching: np.ndarray
) -> np.ndarray:
    """Return the displacement (f, 3) of a bar that gives way, mm: by how far curves pass its place."""
    axis = whisk.bar.axis
    came = np.zeros((len(curves), 3))
    for k in np.flatnonzero(touching).tolist():
        distance, arc, _ = clearance(curves[k], axis, whisk.rods.wire)
        _, tangents = curves[k].at(np.atleast_1d(arc))
        normal = unit(np.cross(axis.direction, tangents[0]))
        away = normal * np.sign(normal[1])  # the way that the whisker pushes
        past_mm = max(whisk.rods.reach_mm(arc) - distance, 0.0)
        came[k] = past_mm * away
    return came


def _fit(
    whisk: WhiskPictures, expected: ExpectedWhisk, seen: list[Observed], touch: Touch
) -> tuple[ConvergedFit, np.ndarray]:
    """Fit all lines, with sigmas as large as residuals show.

    Returns with the fit the parameters' covariance (size, size) by noise and priors.
    """
    prior = whisk.axis_prior(expected.place.axis)
    problem = Problem(
        cameras=whisk.cameras,
        rods=whisk.rods,
        axis=prior.axis,
        motor_rad=whisk.angles_rad,
        touching=expected.touching,
        bent=~expected.free,  # may bend
        seen=seen,
        motion=whisk.motion,
        onset=whisk.onset,
        axis_sigma=prior.sigma,
    )
    state, covariance = solve(problem, _begin(problem, expected))
    problem, state = touch.with_touch(problem, state, covariance)
    problem = inflated_by_residuals(problem, state)
    state, covariance = solve(problem, state, scales=[LAST_SCALE] * 3)
    return ConvergedFit(problem, state), covariance


def check_scatter(fit: ConvergedFit, most_px: float) -> None:
    """Raise Misled where a camera's lines are not those of one wire."""
    scatter = scatter_px(fit.problem, fit.state)
    worst = int(np.argmax(scatter))
    if scatter[worst] > most_px:
        raise Misled(
            fit.problem.cameras.names[worst],
            f"its lines of the wire scatter by {scatter[worst]:.1f} px, {most_px:g} is allowed",
        )


def free_stroke(whisk: WhiskPictures, fitted: FittedWhisk) -> ConvergedFit:
    """Fit all frames before touch, about the object and the rest shape of a fit."""
    problem = fitted.problem
    bent = {f for f, is_bent in zip(fitted.frames, problem.bent) if is_bent}
    before_touch = [f for f in whisk.frames if f not in bent]
    whisk = replace(whisk.during(before_touch), light=dict(whisk.light))
    place = _resting_place(whisk, fitted.axis, fitted.rest_mm)
    seen = _wire_points(whisk, place)
    nothing = np.zeros(len(place.curves), dtype=bool)
    alone = replace(
        problem,
        motor_rad=whisk.angles_rad,
        touching=nothing,
        bent=nothing,
        seen=seen,
        motion=whisk.motion,
    )
    start = _untouched_state(alone, fitted.state.vector[: problem.first_bend])
    state, _ = solve(alone, start, scales=[LAST_SCALE] * 3)
    return ConvergedFit(inflated_by_residuals(alone, state, FREE_SHARED), state)


def fit_before_touch(
    whisk: WhiskPictures, lines: LineSource, rest_mm: np.ndarray
) -> tuple[Axis, np.ndarray]:
    """Fit frames in which nothing touches; return the object's axis and the rest shape (2, 4), mm.

    rest_mm (2, 4): the rest shape to a pixel or two. Raises Refused where a line is not seen,
    Misled where a camera's are not those of one wire.
    """
    place = _resting_place(whisk, whisk.bar.axis, rest_mm)
    nothing = np.zeros(len(whisk.frames), dtype=bool)
    seen = lines.all_points(place, last=False)
    problem = Problem(
        cameras=whisk.cameras,
        rods=whisk.rods,
        axis=whisk.bar.axis,
        motor_rad=whisk.angles_rad,
        touching=nothing,
        bent=nothing,
        seen=seen,
    )
    state, _ = solve(problem, _untouched_state(problem, at_rest(problem, rest_mm)))
    fit = ConvergedFit(problem, state)
    check_scatter(fit, lines.most_scatter_px)
    return fit.axis.upward(), fit.rest_mm


def _untouched_state(problem: Problem, vector: np.ndarray) -> State:
    """Return a state of frames in which nothing touches: the contact is sought from the wire's middle on."""
    middle_mm = np.full(len(problem.motor_rad), 0.5 * problem.rods.wire.length_mm)
    return State(vector, middle_mm)


def _wire_points(whisk: WhiskPictures, place: WhiskPlace) -> list[Observed]:
    """Return the points of the wire by all cameras, where traced with the blur of each."""
    lines = whisk.make_lines(whisk, blur_px=blurs_px(whisk))
    seen = []
    for on_wire in lines.wire_points(place, last=True).values():
        seen += on_wire
    return seen


def _resting_place(whisk: WhiskPictures, axis: Axis, rest_mm: np.ndarray) -> WhiskPlace:
    """Return where an object and a wire of this rest shape (2, 4) are that is nowhere bent."""
    curves = unbent_curves(rest_mm, whisk.motor, whisk.rods.wire)
    return WhiskPlace(axis, curves, whisk.bar_swept_mm)


def _fitted_place(whisk: WhiskPictures, fit: ConvergedFit) -> WhiskPlace:
    """Return where a fit has object and wire."""
    return WhiskPlace(
        axis=fit.axis.upward(),
        curves={f: fit.curves.one(k) for k, f in enumerate(whisk.frames)},
        swept_mm=whisk.bar_swept_mm,
        came_mm=fit.shifts_mm,
    )


def _begin(problem: Problem, expected: ExpectedWhisk) -> State:
    """Return the state that is expected, the object where the problem counts it from."""
    vector = at_rest(problem, expected.rest_mm)
    if problem.motion is not None and problem.motion.from_touch:
        vector[problem.blocks.motion.slice] = problem.motion.values(expected.place.came_mm)
    vector[problem.first_bend :] = expected.bend_rad[problem.bent].ravel()
    return State(vector, np.asarray(expected.arcs_mm, dtype=float))
