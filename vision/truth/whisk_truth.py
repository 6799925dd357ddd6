"""One whisk: wire and bar traced in all its frames and fitted together, by turns."""

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
from vision.touched.one_view import seen_from_one_side
from vision.truth.moving_bar import BarInFrames
from vision.truth.strategies import BarMiddles, Outline, Touch, TouchByClearance, early, ways_to_see
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
# where a wire is seen at all its points lie on one line to a tenth of a pixel
_MOST_SCATTER_PX = 0.7


@dataclass(frozen=True)
class _Look:
    """What is taken for known before a round: bar, and where it is in each frame from there (f, 3) if it moves, rest
    shape (2, 4), bend (f, 2) and contact arc (f,) in each frame, the curves by frame, which frames touch or are free
    (f,), and by a round before each camera's lens blur, px."""

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
    """The fit after the last round, of the frames that make the truth.

    Fills whisk.light with how each camera sees the wire. Raises Refused where there is no touch to fit.
    """
    *others, last = ways_to_see(whisk) if whisk.motion is None else [_moving(whisk)]
    for way in others:
        try:
            return _fitted_by(whisk, *way)
        except (Misled, TooFewFrames):
            raise
        except Refused:
            continue
    return _fitted_by(whisk, *last)


def _moving(whisk: WhiskPictures) -> tuple[BarInFrames, Touch]:
    """How a bar that moves is seen. Raises Refused where the cameras do not know it in space."""
    if seen_from_one_side(whisk.cameras, whisk.bar.axis) or len(whisk.views) < 2:
        raise Refused(
            "an object that moves or gives way is seen by two cameras or more, from different sides",
            code="moving_object_from_one_side",
        )
    return BarInFrames(whisk.views, whisk.rods.bar.radius_mm, whisk.settings), TouchByClearance()


def _fitted_by(
    whisk: WhiskPictures, bar: BarMiddles | BarInFrames | Outline, touch: Touch
) -> FittedWhisk:
    whisk, look = _first_look(whisk, touch)
    for _ in range(whisk.settings.rounds):
        seen = _trace_all(whisk, bar, look, last=False)
        if len({one.camera for one in seen if one.frame >= 0}) < touch.fewest_cameras:
            raise Refused("a single camera sees wire and bar", code="single_camera")
        problem, state, answer = _fit(whisk, look, seen, touch)
        whisk = whisk.yielding_as(problem, state)
        _check_scatter(problem, state)
        look = _Look(
            bar_axis(problem, state.vector).upward(),
            shifts_mm(problem, state.vector),
            rest_shape(problem, state.vector),
            bends(problem, state.vector),
            state.arcs_mm,
            _fitted_curves(problem, state, whisk.frames),
            *touch.parted(problem, state, answer),
            _blurs_px(whisk),
        )
    return FittedWhisk.of(
        *_fit(whisk, look, _trace_all(whisk, bar, look, last=True), touch), whisk.frames
    )


def _first_look(whisk: WhiskPictures, touch: Touch) -> tuple[WhiskPictures, _Look]:
    """The whisk in the frames to fit, and what coarse points tell of them."""
    axis, wire = whisk.bar.axis, whisk.rods.wire
    rest, coarse = coarse_shapes(whisk)
    if whisk.is_thinned and not begins_free(whisk.angles_rad, np.array(list(coarse.values()))):
        raise TooFewFrames("too few of the frames before touch were looked at")
    whisk = whisk.during(touch.near(whisk.motor, coarse))
    bend = np.array([coarse[f] for f in whisk.frames])
    touching, free = touch.first(whisk.angles_rad, bend)
    arcs = np.array([contact_arc(rest, b, m, axis, wire) for b, m in zip(bend, whisk.angles_rad)])
    curves = {
        f: one_curve(rest, b, a, m, wire) for (f, m), b, a in zip(whisk.motor.items(), bend, arcs)
    }
    came = np.zeros((1, 3)) if whisk.motion is None else whisk.motion.expected_mm
    if whisk.gives is not None:
        came = _given_way(whisk, list(curves.values()), touching)
        first = int(np.argmax(touching))
        whisk = whisk.yielding(
            came, float(np.mean(whisk.angles_rad[[np.flatnonzero(free[:first])[-1], first]]))
        )
    return whisk, _Look(axis, came, rest, bend, arcs, curves, touching, free)


def coarse_shapes(whisk: WhiskPictures) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Rest shape (2, 4), mm, and the bend (2,), rad, of every frame, to a pixel or two. Raises Refused where no whisker
    is seen to swing."""
    axis = whisk.bar.axis
    sights = [
        SwingPictures.of(view, whisk.rods, axis, whisk.frames, whisk.bar_swept_mm)
        for view in whisk.views
    ]
    free = np.array(whisk.frames)[early(whisk.angles_rad)]
    rest = find_rest(sights, whisk.cameras, axis, whisk.during(free.tolist()).motor)
    return rest, follow_bends(sights, axis, rest, whisk.motor)


def _given_way(whisk: WhiskPictures, curves: Sequence[Curves], touching: np.ndarray) -> np.ndarray:
    """How far (f, 3) the bar has come, where it touches curves that have passed where it stood."""
    came = np.zeros((len(curves), 3))
    for k in np.flatnonzero(touching).tolist():
        distance, arc, _ = clearance(curves[k], whisk.bar.axis)
        away = np.cross(whisk.bar.axis.direction, curves[k].at(np.atleast_1d(arc))[1][0])
        away *= np.sign(away[1]) / np.linalg.norm(away)
        came[k] = max(whisk.rods.reach_mm(arc) - distance, 0.0) * away
    return came


def _fit(
    whisk: WhiskPictures, look: _Look, seen: list[Observed], touch: Touch
) -> tuple[Problem, State, np.ndarray]:
    """The fit to all lines, with sigmas as large as residuals show: problem, state, and how the parameters answer."""
    problem = Problem(
        whisk.cameras,
        whisk.rods,
        look.axis,
        whisk.angles_rad,
        look.touching,
        ~look.free,
        seen,
        motion=whisk.motion,
        onset=whisk.onset,
    )
    problem, state = touch.settled(problem, *solve(problem, _begin(problem, look)))
    problem = inflated_by_residuals(problem, state)
    return problem, *solve(problem, state, scales=[LAST_SCALE] * 3)


def _check_scatter(problem: Problem, state: State) -> None:
    """Raises Misled where a camera's lines are not those of one wire."""
    scatter = scatter_px(problem, state)
    worst = int(np.argmax(scatter))
    if scatter[worst] > _MOST_SCATTER_PX:
        found = f"its lines of the wire scatter by {scatter[worst]:.1f} px, {_MOST_SCATTER_PX:g} is allowed"
        raise Misled(problem.cameras.names[worst], found)


def free_stroke(whisk: WhiskPictures, fitted: FittedWhisk) -> tuple[Problem, State]:
    """All frames before touch and what is seen in them, about the bar and the shape at rest of a fit."""
    problem, state, wire = fitted.problem, fitted.state, whisk.rods.wire
    touched = {f for f, bent in zip(fitted.frames, problem.bent) if bent}
    whisk = whisk.during([f for f in whisk.frames if f not in touched])
    rest, axis = rest_shape(problem, state.vector), bar_axis(problem, state.vector)
    curves = {
        f: one_curve(rest, np.zeros(2), wire.length_mm, angle, wire)
        for f, angle in whisk.motor.items()
    }
    seen = [
        one
        for view in whisk.views
        for one in trace_wire(whisk, view, axis, curves, _blurs_px(whisk))
    ]
    nothing = np.zeros(len(curves), dtype=bool)
    alone = replace(
        problem,
        motor_rad=whisk.angles_rad,
        touching=nothing,
        bent=nothing,
        seen=seen,
        motion=whisk.motion,
    )
    there = State(state.vector[: problem.first_bend], np.full(len(curves), 0.5 * wire.length_mm))
    there, _ = solve(alone, there, scales=[LAST_SCALE] * 3)
    return inflated_by_residuals(alone, there, _FREE_SHARED), there


def _fitted_curves(problem: Problem, state: State, frames: Sequence[int]) -> dict[int, Curves]:
    curves, _ = curves_of(problem, state.vector, state.arcs_mm)
    return {f: curves.one(k) for k, f in enumerate(frames)}


def _blurs_px(whisk: WhiskPictures) -> dict[str, float]:
    """The lens blur of each camera in which the wire was traced."""
    return {name: light.blur_px for name, light in whisk.light.items()}


def _begin(problem: Problem, look: _Look) -> State:
    vector = np.zeros(problem.size)
    vector[problem.blocks.rest_shape.slice] = np.ravel(look.rest_mm)
    if problem.motion is not None and problem.motion.from_touch:
        vector[problem.blocks.motion.slice] = problem.motion.values(look.came_mm)
    vector[problem.first_bend :] = look.bend_rad[problem.bent].ravel()
    return State(vector, np.asarray(look.arcs_mm, dtype=float))


def _trace_all(
    whisk: WhiskPictures, bar: BarMiddles | BarInFrames | Outline, look: _Look, *, last: bool
) -> list[Observed]:
    """Line points of wire and bar in all cameras. Raises Refused where one of them is seen in none."""
    wires_px = {
        view.camera.name: [view.camera.project(curve.points_mm) for curve in look.curves.values()]
        for view in whisk.views
    }
    bars = bar.observed(look.axis, look.came_mm, list(look.curves), wires_px, last=last)
    seen = []
    for number, view in enumerate(whisk.views):
        seen += trace_wire(whisk, view, look.axis, look.curves, look.blur_px, last=last)
        seen += [
            Observed(-1, number, points, side, frame)
            for frame, side, points in bars.get(view.camera.name, [])
        ]
    require_both_rods(seen)
    return seen


def require_both_rods(seen: Sequence[Observed]) -> None:
    """Raises Refused where wire or bar is seen in no camera."""
    for rod, there in (
        ("wire clear of the bar", any(one.frame >= 0 for one in seen)),
        ("bar clear of the wire", any(one.frame < 0 for one in seen)),
    ):
        if not there:
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
    """Line points of the wire in one of a whisk's cameras, by frame, beside curves in each of them.

    seen_blur_px: by camera, of an earlier look that told the curves. Fills whisk.light with how the camera sees the
    wire.
    """
    pieces = clear_pieces(whisk, view, axis, curves)
    if len(pieces) == 0:
        return []
    traced = trace(
        pieces,
        wire_knots(whisk),
        seen_blur_px=(seen_blur_px or {}).get(view.camera.name),
        last=last,
    )
    whisk.light[view.camera.name] = WireAppearance(
        traced.blur_px, seen_width(traced.pieces, traced.blur_px), float(np.sqrt(traced.misfit))
    )
    points, source = to_points(traced)
    return observed(points, source, whisk.cameras.names.index(view.camera.name), list(curves))


def clear_pieces(
    whisk: WhiskPictures, view: View, axis: Axis, curves: Mapping[int, Curves]
) -> Pieces:
    """Pieces of the wire beside curves, clear of clamp and bar, in one of a whisk's cameras."""
    settings = whisk.settings
    pieces = wire_pieces(
        view, curves, whisk.rods.wire, settings.wire_piece_px, settings.wire_margin_px
    )
    if view.others:
        pieces = pieces.select(pieces.show_rod(_EDGE_PX))
    pieces = pieces.below(SATURATED * view.full_scale)
    outline = axis.covering_discs(view.camera, whisk.bar_swept_mm)
    return pieces.select(
        clear_of_bar(pieces, *outline, BESIDE_BAR_PX) & (pieces.place > NEAR_CLAMP_MM)
    )


def wire_knots(whisk: WhiskPictures) -> Knots:
    """Between what the wire's shading is linear."""
    return Knots.of_turning(
        np.arange(NEAR_CLAMP_MM, whisk.rods.wire.length_mm, _WIRE_KNOT_MM), whisk.motor
    )
