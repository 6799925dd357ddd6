"""One whisk: wire and object traced in all its frames and fitted together, by turns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vision.fit.first_bends import SwingPictures, contact_arc, find_rest, follow_bends
from vision.fit.problem import (
    Problem,
    State,
    bar_axis,
    bends,
    curves_of,
    rest_shape,
    shifts_mm,
)
from vision.fit.scatter import inflated_by_residuals, scatter_px
from vision.fit.solve import LAST_SCALE, solve
from vision.fit.touch import begins_free
from vision.geometry.centreline import Curves, one_curve
from vision.geometry.contact import clearance
from vision.geometry.refusals import Misled, Refused, TooFewFrames
from vision.geometry.touched import Axis
from vision.pictures.view import SATURATED, View
from vision.truth.readers import ObjectReader, WhereAbout
from vision.truth.strategies import Strategy, Touch, early, strategies
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures
from vision.wire.bands import Pieces
from vision.wire.one_sided import WireAppearance, seen_width
from vision.wire.points import Observed
from vision.wire.shading import Knots
from vision.wire.trace import NEAR_CLAMP_MM, clear_of_bar, observed, to_points, trace, wire_pieces

# [mm] Between knots of the wire's shading: light and finish are much the same a centimetre
# farther on. Study: thresholds.py truth.whisk _WIRE_KNOT_MM ….
_WIRE_KNOT_MM = 12.0
# [px] Beside the wire: three of a lens blur of a pixel. A piece that lacks a pixel within, for
# another whisker's wire, gives no point: of those that lacked some the wire scattered by 0.09 px,
# without them by 0.05. Study: arrays_seen.py.
_EDGE_PX = 3.0
# [px] Wire nearer to the bar's outline is mixed with it by the lens: four blurs. Study:
# thresholds.py truth.whisk _BESIDE_BAR_PX ….
BESIDE_BAR_PX = 4.0
# [1] Least that a variance grows by, of the free stroke that places the rig: what changes slowly
# over a wide stroke passes for the whisker's turn, which takes up what would show it as scatter.
# Study: tests/bench/trials/test_placing_pictures.py.
_FREE_SHARED = 4.0
# [px] A camera whose points scatter by more sees another thing: where a wire is seen at all its
# points lie on one line to a tenth of a pixel. Study: thresholds.py truth.whisk _MOST_SCATTER_PX
# ….
_MOST_SCATTER_PX = 0.7


@dataclass(frozen=True)
class _Expected:
    """What is expected before a pass, in f frames.

    axis: of the object. came_mm (f, 3): how far it is from there in each frame, if it moves.
    rest_mm (2, 4): rest shape. bend_rad (f, 2), arcs_mm (f,): bends and contact arcs. curves: of
    the wire, by frame. touching, free (f,) bool. blur_px: of each camera's lens, by the pass
    before.
    """

    axis: Axis
    came_mm: np.ndarray
    rest_mm: np.ndarray
    bend_rad: np.ndarray
    arcs_mm: np.ndarray
    curves: Mapping[int, Curves]
    touching: np.ndarray
    free: np.ndarray
    blur_px: Mapping[str, float] = field(default_factory=dict)


def fit_whisk(whisk: WhiskPictures) -> FittedWhisk:
    """Fit wire and object to the frames that make the truth.

    Fills whisk.light with how each camera sees the wire. Raises Refused where there is no touch to
    fit.
    """
    *others, last = strategies(whisk)
    for strategy in others:
        try:
            return _fit_by(whisk, strategy)
        except (Misled, TooFewFrames):
            raise
        except Refused:
            continue
    return _fit_by(whisk, last)


def _fit_by(whisk: WhiskPictures, strategy: Strategy) -> FittedWhisk:
    """Fit a whisk by one strategy, pass by pass. Raises Refused where it does not serve."""
    reader = strategy.reader
    touch = strategy.touch
    whisk, expected = _expect_coarsely(whisk, touch)
    for _ in range(whisk.settings.rounds):
        seen = _trace_all(whisk, reader, expected, last=False)
        if len({one.camera for one in seen if one.frame >= 0}) < touch.fewest_cameras:
            raise Refused("a single camera sees wire and bar", code="single_camera")
        problem, state, covariance = _fit(whisk, expected, seen, touch)
        whisk = whisk.yielding_as(problem, state)
        _check_scatter(problem, state)
        touching, free = touch.part_by_fit(problem, state, covariance)
        expected = _Expected(
            axis=bar_axis(problem, state.vector).upward(),
            came_mm=shifts_mm(problem, state.vector),
            rest_mm=rest_shape(problem, state.vector),
            bend_rad=bends(problem, state.vector),
            arcs_mm=state.arcs_mm,
            curves=_fitted_curves(problem, state, whisk.frames),
            touching=touching,
            free=free,
            blur_px=_blurs_px(whisk),
        )
    seen = _trace_all(whisk, reader, expected, last=True)
    problem, state, covariance = _fit(whisk, expected, seen, touch)
    return FittedWhisk.of(problem, state, covariance, whisk.frames)


def _expect_coarsely(whisk: WhiskPictures, touch: Touch) -> tuple[WhiskPictures, _Expected]:
    """Return the whisk in the frames to fit, and what coarse points say of them.

    Raises TooFewFrames where a thinned stroke has too few frames before touch.
    """
    axis = whisk.bar.axis
    wire = whisk.rods.wire
    rest, coarse = coarse_shapes(whisk)
    if whisk.is_thinned and not begins_free(whisk.angles_rad, np.array(list(coarse.values()))):
        raise TooFewFrames("too few of the frames before touch were looked at")
    whisk = whisk.during(touch.frames_to_fit(whisk.motor, coarse))
    bend = np.array([coarse[f] for f in whisk.frames])
    touching, free = touch.part_by_bends(whisk.angles_rad, bend)
    arcs = []
    curves = {}
    for f, own_bend in zip(whisk.frames, bend):
        motor_rad = whisk.motor[f]
        arcs.append(contact_arc(rest, own_bend, whisk.motor_rad[f], axis, wire))
        curves[f] = one_curve(rest, own_bend, arcs[-1], motor_rad, wire)
    came = np.zeros((1, 3)) if whisk.motion is None else whisk.motion.expected_mm
    if whisk.gives is not None:
        came = _given_way(whisk, list(curves.values()), touching)
        first = int(np.argmax(touching))
        last_free = np.flatnonzero(free[:first])[-1]
        touch_rad = float(np.mean(whisk.angles_rad[[last_free, first]]))
        whisk = whisk.yielding(came, touch_rad)
    arcs = np.array(arcs)
    return whisk, _Expected(axis, came, rest, bend, arcs, curves, touching, free)


def coarse_shapes(whisk: WhiskPictures) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Return the rest shape (2, 4), mm, and by frame the bend (2,), rad, to a pixel or two.

    Raises Refused where no whisker is seen to swing.
    """
    axis = whisk.bar.axis
    sights = [
        SwingPictures.of(view, whisk.rods, axis, whisk.frames, whisk.bar_swept_mm)
        for view in whisk.views
    ]
    free = np.array(whisk.frames)[early(whisk.angles_rad)]
    rest = find_rest(sights, whisk.cameras, axis, whisk.during(free.tolist()).motor)
    return rest, follow_bends(sights, axis, rest, whisk.motor)


def _given_way(whisk: WhiskPictures, curves: Sequence[Curves], touching: np.ndarray) -> np.ndarray:
    """Return how far (f, 3) the bar has come where it touches curves that have passed its place."""
    axis = whisk.bar.axis
    came = np.zeros((len(curves), 3))
    for k in np.flatnonzero(touching).tolist():
        distance, arc, _ = clearance(curves[k], axis)
        _, tangents = curves[k].at(np.atleast_1d(arc))
        away = np.cross(axis.direction, tangents[0])
        away *= np.sign(away[1]) / np.linalg.norm(away)
        came[k] = max(whisk.rods.reach_mm(arc) - distance, 0.0) * away
    return came


def _fit(
    whisk: WhiskPictures, expected: _Expected, seen: list[Observed], touch: Touch
) -> tuple[Problem, State, np.ndarray]:
    """Fit all lines, with sigmas as large as residuals show.

    Returns problem, state, and the parameters' covariance by noise and priors.
    """
    problem = Problem(
        whisk.cameras,
        whisk.rods,
        expected.axis,
        whisk.angles_rad,
        expected.touching,
        ~expected.free,
        seen,
        motion=whisk.motion,
        onset=whisk.onset,
    )
    state, covariance = solve(problem, _begin(problem, expected))
    problem, state = touch.with_touch(problem, state, covariance)
    problem = inflated_by_residuals(problem, state)
    state, covariance = solve(problem, state, scales=[LAST_SCALE] * 3)
    return problem, state, covariance


def _check_scatter(problem: Problem, state: State) -> None:
    """Raise Misled where a camera's lines are not those of one wire."""
    scatter = scatter_px(problem, state)
    worst = int(np.argmax(scatter))
    if scatter[worst] > _MOST_SCATTER_PX:
        raise Misled(
            problem.cameras.names[worst],
            f"its lines of the wire scatter by {scatter[worst]:.1f} px, "
            f"{_MOST_SCATTER_PX:g} is allowed",
        )


def free_stroke(whisk: WhiskPictures, fitted: FittedWhisk) -> tuple[Problem, State]:
    """Fit all frames before touch, about the object and the rest shape of a fit."""
    problem = fitted.problem
    vector = fitted.state.vector
    wire = whisk.rods.wire
    touched = {f for f, bent in zip(fitted.frames, problem.bent) if bent}
    whisk = whisk.during([f for f in whisk.frames if f not in touched])
    rest = rest_shape(problem, vector)
    axis = bar_axis(problem, vector)
    curves = {}
    for f, motor_rad in whisk.motor.items():
        curves[f] = one_curve(rest, np.zeros(2), wire.length_mm, motor_rad, wire)
    seen = []
    for view in whisk.views:
        seen += trace_wire(whisk, view, axis, curves, _blurs_px(whisk))
    nothing = np.zeros(len(curves), dtype=bool)
    alone = replace(
        problem,
        motor_rad=whisk.angles_rad,
        touching=nothing,
        bent=nothing,
        seen=seen,
        motion=whisk.motion,
    )
    state = State(vector[: problem.first_bend], np.full(len(curves), 0.5 * wire.length_mm))
    state, _ = solve(alone, state, scales=[LAST_SCALE] * 3)
    return inflated_by_residuals(alone, state, _FREE_SHARED), state


def _fitted_curves(problem: Problem, state: State, frames: Sequence[int]) -> dict[int, Curves]:
    """Return by frame the wire's centreline of a fit."""
    curves, _ = curves_of(problem, state.vector, state.arcs_mm)
    return {f: curves.one(k) for k, f in enumerate(frames)}


def _blurs_px(whisk: WhiskPictures) -> dict[str, float]:
    """Return the lens blur of each camera in which the wire was traced."""
    return {name: light.blur_px for name, light in whisk.light.items()}


def _begin(problem: Problem, expected: _Expected) -> State:
    """Return the state that is expected, the object where the problem counts it from."""
    vector = np.zeros(problem.size)
    vector[problem.blocks.rest_shape.slice] = np.ravel(expected.rest_mm)
    if problem.motion is not None and problem.motion.from_touch:
        vector[problem.blocks.motion.slice] = problem.motion.values(expected.came_mm)
    vector[problem.first_bend :] = expected.bend_rad[problem.bent].ravel()
    return State(vector, np.asarray(expected.arcs_mm, dtype=float))


def _trace_all(
    whisk: WhiskPictures, reader: ObjectReader, expected: _Expected, *, last: bool
) -> list[Observed]:
    """Trace wire and object in all cameras. Raises Refused where one of them is seen in none."""
    curves = expected.curves
    wires_px = {}
    for view in whisk.views:
        lines_px = [view.camera.project(curve.points_mm) for curve in curves.values()]
        wires_px[view.camera.name] = lines_px
    about = WhereAbout(expected.axis, expected.came_mm, list(curves), wires_px)
    lines = reader.read(about, last=last)
    seen = []
    for number, view in enumerate(whisk.views):
        seen += trace_wire(whisk, view, expected.axis, curves, expected.blur_px, last=last)
        for line in lines.get(view.camera.name, []):
            seen.append(Observed(-1, number, line.points, line.side, line.frame))
    require_both_rods(seen)
    return seen


def require_both_rods(seen: Sequence[Observed]) -> None:
    """Raise Refused where wire or bar is seen in no camera."""
    for rod, is_seen in (
        ("wire clear of the bar", any(one.frame >= 0 for one in seen)),
        ("bar clear of the wire", any(one.frame < 0 for one in seen)),
    ):
        if not is_seen:
            raise Refused(f"no camera shows enough of the {rod}", code="rod_hidden")


def trace_wire(
    whisk: WhiskPictures,
    view: View,
    axis: Axis,
    curves: Mapping[int, Curves],
    seen_blur_px: Mapping[str, float] | None = None,
    *,
    last: bool = True,
) -> list[Observed]:
    """Trace the wire in one of a whisk's cameras near its curves by frame.

    seen_blur_px: by camera, of the pass that gave the curves. Fills whisk.light with how the camera
    sees the wire.
    """
    name = view.camera.name
    pieces = clear_pieces(whisk, view, axis, curves)
    if len(pieces) == 0:
        return []
    blur_px = (seen_blur_px or {}).get(name)
    traced = trace(pieces, wire_knots(whisk), seen_blur_px=blur_px, last=last)
    width = seen_width(traced.pieces, traced.blur_px)
    whisk.light[name] = WireAppearance(traced.blur_px, width, float(np.sqrt(traced.misfit)))
    points, source = to_points(traced)
    return observed(points, source, whisk.cameras.names.index(name), list(curves))


def clear_pieces(
    whisk: WhiskPictures, view: View, axis: Axis, curves: Mapping[int, Curves]
) -> Pieces:
    """Cut out the wire near its curves, clear of clamp and object, in one of a whisk's cameras."""
    settings = whisk.settings
    pieces = wire_pieces(
        view, curves, whisk.rods.wire, settings.wire_piece_px, settings.wire_margin_px
    )
    if view.others:
        pieces = pieces.select(pieces.show_rod(_EDGE_PX))
    pieces = pieces.below(SATURATED * view.full_scale)
    middle_px, radius_px = axis.covering_discs(view.camera, whisk.bar_swept_mm)
    is_clear = clear_of_bar(pieces, middle_px, radius_px, BESIDE_BAR_PX)
    return pieces.select(is_clear & (pieces.place > NEAR_CLAMP_MM))


def wire_knots(whisk: WhiskPictures) -> Knots:
    """Return the knots between which the wire's shading is linear."""
    length_mm = whisk.rods.wire.length_mm
    return Knots.of_turning(np.arange(NEAR_CLAMP_MM, length_mm, _WIRE_KNOT_MM), whisk.motor)
