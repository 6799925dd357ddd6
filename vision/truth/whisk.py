"""One whisk: wire and bar traced in all its frames and fitted together, by turns."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vision.bar.edges import measure_edges
from vision.bar.line import BarLine, measure_bars
from vision.bar.one_view import seen_from_one_side
from vision.bar.search import SeenBar, of_mean
from vision.fit.first_bends import Sight, contact_arc, find_rest, follow_bends
from vision.fit.problem import BAR, REST, Problem, State, bar_axis, bends, curves_of, rest_shape
from vision.fit.scatter import inflated_by_residuals, scatter_px
from vision.fit.solve import LAST_SCALE, solve
from vision.fit.touch import FEWEST_FREE, frames_by_touch, frames_that_touch, touch_and_sigma
from vision.fit.touch_by_onset import touch_by_onset
from vision.geometry.camera import Cameras
from vision.geometry.centreline import Curves, one_curve
from vision.geometry.contact import BarAxis, outline_of_bar, upward
from vision.geometry.errors import Misled, Refused
from vision.geometry.rods import Rods
from vision.geometry.settings import VisionSettings
from vision.lines.one_sided import WireAppearance, seen_width
from vision.lines.points import LinePoints, Observed
from vision.lines.shading import Knots
from vision.lines.trace import NEAR_CLAMP_MM, clear_of_bar, observed, to_points, trace, unsaturated, wire_pieces
from vision.pictures.view import View

_WIRE_KNOT_MM = 12.0
BESIDE_BAR_PX = 4.0
# Frames from so far before touch on make the truth, four at least: light on a whisker that stands farther away is
# another, and what its line is off by does not cancel in the differences. Those frames tell where the rig is.
_NEAR_TOUCH_RAD, _FEWEST_NEAR = np.radians(3.5), 4
# What changes slowly over a wide stroke passes for the whisker's turn, which takes up what would show it as scatter.
_FREE_SHARED = 4.0
_MOST_SCATTER_PX = 0.7  # where a wire is seen at all its points lie on one line to a tenth of a pixel
NEVER_TOUCHES = "the whisker never touches"
STARTS_TOUCHING = "touches from the start: fewer than two frames of free stroke"


@dataclass(frozen=True)
class _Look:
    """What is taken for known before a round: bar, rest shape (2, 4), bend (f, 2) and contact arc (f,) in each frame,
    the curves by frame, and which frames touch or are free (f,)."""

    axis: BarAxis
    rest_mm: np.ndarray
    bend_rad: np.ndarray
    arcs_mm: np.ndarray
    curves: Mapping[int, Curves]
    touching: np.ndarray
    free: np.ndarray


def fit_whisk(views: Sequence[View], cameras: Cameras, rods: Rods, bar: SeenBar, motor: Mapping[int, float],
              light: dict[str, WireAppearance],
              settings: VisionSettings) -> tuple[Problem, State, np.ndarray, list[int]]:
    """Problem and state after the last round, how its parameters answer (see `Uncertainty`), and the frames in it: all
    but those far before touch.

    light: filled with how each camera sees the wire. Raises Refused where there is no touch to fit.
    """
    edges, one_side = _resolved_by_edges(cameras, bar), seen_from_one_side(cameras, bar.axis)
    fitted = partial(_fitted_to, views, cameras, rods, bar, motor, light, settings, edges)
    try:
        return fitted(by_onset=one_side)
    except Misled:
        raise
    except Refused:
        if one_side or not edges:
            raise
    return fitted(by_onset=True)  # one camera sees the wire, too: it alone tells when that begins to bend


def _fitted_to(views, cameras: Cameras, rods: Rods, bar: SeenBar, motor: Mapping[int, float],
               light: dict[str, WireAppearance], settings: VisionSettings, edges: Collection[str], *, by_onset: bool):
    """`fit_whisk` with touch by the frames that touch, or by the onset of bending."""
    motor, look = _first_look(views, cameras, rods, bar.axis, motor, by_onset)
    lines: dict[str, BarLine] = {}
    for _ in range(settings.rounds):
        seen = _trace_all(views, rods, look, motor, light, lines, settings, edges=edges, last=False)
        if edges and not by_onset and len({one.camera for one in seen if one.frame >= 0}) < 2:
            raise Refused("a single camera sees wire and bar")
        problem, state, answer = _fit(seen, cameras, rods, look, motor, by_onset)
        _check_scatter(problem, state)
        look = _next_look(problem, state, answer, look, motor, by_onset)
    seen = _trace_all(views, rods, look, motor, light, lines, settings, edges=edges, last=True)
    return *_fit(seen, cameras, rods, look, motor, by_onset), list(motor)


def _resolved_by_edges(cameras: Cameras, bar: SeenBar) -> list[str]:
    """Cameras whose edges of the bar resolve how far away it is: where all stand on one side, or a single one sees it.
    None where two see it from different sides."""
    seeing = [name for name in cameras.names if name in bar.seen_by]
    if seen_from_one_side(cameras, bar.axis):
        return seeing or list(cameras.names)
    return seeing if len(seeing) == 1 else []


def _first_look(views, cameras, rods: Rods, axis: BarAxis, motor: Mapping[int, float],
                by_onset: bool) -> tuple[Mapping[int, float], _Look]:
    """The frames to fit, and what coarse points tell of them."""
    early = _early(motor)
    sights = [Sight.of(view, rods, axis, list(motor)) for view in views]
    rest = find_rest(sights, cameras, axis, early)
    coarse = follow_bends(sights, axis, rest, motor)
    motor = motor if by_onset else near_touch(motor, coarse)
    angles, bend = np.array(list(motor.values())), np.array([coarse[f] for f in motor])
    touching, free = frames_that_touch(angles, bend)
    if by_onset:  # a bend along the sight is not seen at first
        free = np.arange(len(angles)) < len(early)
        touching = touching & ~free
    elif not np.any(touching):
        raise Refused(NEVER_TOUCHES)
    if np.sum(~touching) < FEWEST_FREE:
        raise Refused(STARTS_TOUCHING)
    arcs = np.array([contact_arc(rest, b, m, axis, rods.wire) for b, m in zip(bend, angles)])
    curves = {f: one_curve(rest, b, a, m, rods.wire) for f, b, a, m in zip(motor, bend, arcs, angles)}
    return motor, _Look(axis, rest, bend, arcs, curves, touching, free)


def _fit(seen: list[Observed], cameras: Cameras, rods: Rods, look: _Look, motor: Mapping[int, float],
         by_onset: bool) -> tuple[Problem, State, np.ndarray]:
    """The fit to all lines, with sigmas as large as residuals show: problem, state, and how the parameters answer."""
    problem = Problem(cameras, rods, look.axis, np.array(list(motor.values())),
                      look.touching, ~look.free, seen)
    state, covariance = solve(problem, _begin(problem, look))
    if by_onset:
        problem, state = touch_by_onset(problem, state, covariance)
        state, _ = solve(problem, state)
    problem = inflated_by_residuals(problem, state)
    return problem, *solve(problem, state, scales=[LAST_SCALE] * 3)


def _next_look(problem: Problem, state: State, answer, look: _Look, motor: Mapping[int, float],
               by_onset: bool) -> _Look:
    """What a fit tells; which frames touch: by clearance, or where cameras do not tell it, by the onset of bending."""
    touching, free = problem.touching, look.free
    if not by_onset:
        touching, free = frames_by_touch(problem.motor_rad, *touch_and_sigma(problem, state.vector, answer))
        if np.sum(free) < FEWEST_FREE:
            raise Refused(STARTS_TOUCHING)
        if not np.any(touching):
            raise Refused(NEVER_TOUCHES)
    return _Look(upward(bar_axis(problem, state.vector)), rest_shape(state.vector), bends(problem, state.vector),
                 state.arcs_mm, _fitted(problem, state, motor), touching, free)


def _check_scatter(problem: Problem, state: State) -> None:
    """Raises Misled where a camera's lines are not those of one wire."""
    scatter = scatter_px(problem, state)
    worst = int(np.argmax(scatter))
    if scatter[worst] > _MOST_SCATTER_PX:
        found = f"its lines of the wire scatter by {scatter[worst]:.1f} px, {_MOST_SCATTER_PX:g} is allowed"
        raise Misled(problem.cameras.names[worst], found)


def near_touch(motor: Mapping[int, float], bend: Mapping[int, np.ndarray]) -> dict[int, float]:
    """The frames from a little before the first that surely touches."""
    angles = np.array(list(motor.values()))
    touching, _ = frames_that_touch(angles, np.array(list(bend.values())))
    if not np.any(touching):
        return dict(motor)
    first = int(np.argmax(touching))
    begin = min(int(np.argmax(angles > angles[first] - _NEAR_TOUCH_RAD)), max(first - _FEWEST_NEAR, 0))
    return dict(list(motor.items())[begin:])


def free_stroke(views: Sequence[View], rods: Rods, problem: Problem, state: State, motor: Mapping[int, float],
                near: Sequence[int], light: dict, settings: VisionSettings) -> tuple[Problem, State]:
    """All frames before touch and what is seen in them, about the bar and the shape at rest of a fit."""
    free = {f: angle for f, angle in motor.items() if f not in near or not problem.bent[near.index(f)]}
    rest, axis = rest_shape(state.vector), bar_axis(problem, state.vector)
    curves = {f: one_curve(rest, np.zeros(2), rods.wire.length_mm, angle, rods.wire) for f, angle in free.items()}
    seen = [one for number, view in enumerate(views)
            for one in trace_wire(number, view, rods, axis, free, curves, light, settings)]
    nothing = np.zeros(len(free), dtype=bool)
    alone = replace(problem, motor_rad=np.array(list(free.values())), touching=nothing, bent=nothing, seen=seen)
    there = State(state.vector[:problem.first_bend], np.full(len(free), 0.5 * rods.wire.length_mm))
    there, _ = solve(alone, there, scales=[LAST_SCALE] * 3)
    return inflated_by_residuals(alone, there, _FREE_SHARED), there


def _early(motor: Mapping[int, float]) -> dict[int, float]:
    """The frames of the first seventh of the stroke, two at least: taken as free for a first look."""
    angles = list(motor.values())
    limit = angles[0] + (angles[-1] - angles[0]) / 7.0
    count = max(2, sum(1 for angle in angles if angle <= limit))
    return dict(list(motor.items())[:count])


def _fitted(problem: Problem, state: State, motor) -> dict[int, Curves]:
    curves, _ = curves_of(problem, state.vector, state.arcs_mm)
    return {f: Curves(curves.arc_mm, curves.points_mm[k], curves.tangents[k]) for k, f in enumerate(motor)}


def _begin(problem: Problem, look: _Look) -> State:
    vector = np.zeros(problem.size)
    vector[BAR:BAR + REST] = np.ravel(look.rest_mm)
    vector[problem.first_bend:] = look.bend_rad[problem.bent].ravel()
    return State(vector, np.asarray(look.arcs_mm, dtype=float))


def _trace_all(views, rods: Rods, look: _Look, motor, light: dict, lines: dict[str, BarLine],
               settings: VisionSettings, *, edges: Collection[str], last: bool) -> list[Observed]:
    """Line points of wire and bar in all cameras. light: each camera's blur, found the first time; lines: the bar's,
    as measured the time before. edges: see `_resolved_by_edges`."""
    wires = {view.camera.name: [view.camera.project(curve.points_mm) for curve in look.curves.values()]
             for view in views}
    bar = _trace_bar(views, rods, look.axis, wires, lines, settings, edges)
    seen = []
    for number, view in enumerate(views):
        seen += trace_wire(number, view, rods, look.axis, motor, look.curves, light, settings, last=last)
        seen += [Observed(-1, number, points, side) for side, points in bar[number].items()]
    for rod, there in (("wire clear of the bar", any(one.frame >= 0 for one in seen)),
                       ("bar clear of the wire", any(one.frame < 0 for one in seen))):
        if not there:
            raise Refused(f"no camera shows enough of the {rod}")
    return seen


def _trace_bar(views, rods: Rods, axis: BarAxis, wires, lines: dict[str, BarLine], settings: VisionSettings,
               edges: Collection[str]) -> list[dict[int, LinePoints]]:
    """Per camera the points of the bar's middle (side 0), or of its two edges where these are seen and are to tell how
    far away it is."""
    if edges:
        asked = [view for view in views if view.camera.name in edges]
        found = {view.camera.name: measure_edges(of_mean(view), view.mean, axis, rods.bar.radius_mm,
                                                 wires[view.camera.name], settings) for view in asked}
    else:
        asked, found = views, {}
    measured = measure_bars(asked, axis, rods.bar.radius_mm, wires, settings, lines)
    lines.clear()
    lines.update(measured)
    middles = {name: {0: line.points} for name, line in lines.items() if line.is_bar}
    return [found.get(view.camera.name) or middles.get(view.camera.name, {}) for view in views]


def trace_wire(number: int, view: View, rods: Rods, axis: BarAxis, motor: Mapping[int, float],
               curves: Mapping[int, Curves], light: dict, settings: VisionSettings, *,
               last: bool = True) -> list[Observed]:
    """Line points of the wire in one camera, by frame. light: see `fit_whisk`."""
    pieces = wire_pieces(view, curves, rods.wire, settings.wire_piece_px, settings.wire_margin_px)
    pieces = unsaturated(pieces, view.full_scale)
    outline = outline_of_bar(view.camera, axis, rods.bar.radius_mm)
    pieces = pieces.select(clear_of_bar(pieces, *outline, BESIDE_BAR_PX) & (pieces.place > NEAR_CLAMP_MM))
    if len(pieces) == 0:
        return []
    knots = Knots.of_turning(np.arange(NEAR_CLAMP_MM, rods.wire.length_mm, _WIRE_KNOT_MM), motor)
    traced = trace(pieces, knots, last=last)
    light[view.camera.name] = WireAppearance(traced.blur_px, seen_width(traced.pieces, traced.blur_px),
                                             float(np.sqrt(traced.misfit)))
    points, source = to_points(traced)
    return observed(points, source, number, list(curves))
