"""The whole truth of one trial, from its pictures alone.

    pictures → coarse bar → bar's line ┐
                                       ├→ one fit over cameras and frames → touch, contact, slip, with sigma
    pictures → coarse bends → wire's line points ┘

Nothing here knows of a gauge.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.bar import HALF, changed, find_bar, settle_axis
from vision.bar_edges import measure_edges
from vision.bar_line import FAR_PX, NEAR_PX, measure_bar
from vision.base_line import base_lines
from vision.beam_check import check_beam
from vision.contact import BarAxis
from vision.effort import VisionSettings
from vision.errors import Refused
from vision.fit import LAST_SCALE, Observed, Problem, State, bar_axis, bends, curves_of, honest, rest_shape, solve
from vision.line import WAVES, LinePoints, Noise, measure_noise
from vision.one_sided import Lit, one_sided_lines, seen_width
from vision.one_view import see_bar_alone, seen_from_one_side, touch_by_onset
from vision.quantities import calibration_share, jacobians
from vision.report import to_whisk
from vision.scene import Bar, Cameras, Wire
from vision.shading import Knots
from vision.swing import contact_arc, find_rest, follow_bends, one_curve, outline_of_bar
from vision.touch import FEWEST_FREE, first_touch, frames_by_touch, frames_that_touch
from vision.trace import MEAN_OF, View, clear_of_bar, observed, settle, to_points, trace, wire_pieces
from vision.truth import TrialTruth, WhiskTruth
from vision.wire import Curves

_WIRE_KNOT_MM = 12.0
_NEAR_CLAMP_MM = 6.0  # hub and set-screw hide or shade the wire up to here
_BESIDE_BAR_PX = 4.0
_SEARCH_PX = 1.5
_ROUNDS_FIRST, _ROUNDS_AGAIN = 5, 3
_MEDIAN_OF = 11  # frames: more would not make the bar clearer
# Frames from so far before touch on make the truth, four at least: light on a whisker that stands farther away is
# another, and what its line is off by does not cancel in the differences. Those frames tell where the rig is.
_NEAR_TOUCH_RAD, _FEWEST_NEAR = np.radians(3.5), 4
_FEWEST_SHARE = 0.7  # of the frames that the best camera has: a camera with fewer costs more than it tells

_NEVER_TOUCHES = "the whisker never touches"
_STARTS_TOUCHING = "touches from the start: fewer than two frames of free stroke"

_USUAL = VisionSettings()


@dataclass(frozen=True)
class _Rods:
    """What stands in front of the cameras."""

    wire: Wire
    bar: Bar

    @property
    def reach_mm(self) -> float:
        """Distance between the two axes while they touch, for a uniform wire."""
        return self.bar.radius_mm + 0.5 * self.wire.diameter_mm

    @property
    def reach_sigma_mm(self) -> float:
        return 0.5 * float(np.hypot(self.bar.diameter_sigma_mm, self.wire.diameter_sigma_mm))


def observe_trial(frames: Mapping[str, Mapping[int, np.ndarray]], time_s, motor_rad, whisks: Sequence[slice],
                  cameras: Cameras, wire: Wire, bar: Bar, background: Mapping[str, np.ndarray | None],
                  settings: VisionSettings = _USUAL) -> TrialTruth:
    """Truth of a trial: bar, first touch, contact and slip in each whisk.

    frames: per camera the grey pictures by frame index (a missing index is a lost frame); time_s, motor_rad (n,)
    at each frame; whisks: slices of frame indices, one a forward stroke; background: the scene without whisker and
    bar, or None. What keeps a whisk from having a truth is its status; raises Refused only for input that no
    trial could be seen with.
    """
    time_s, motor_rad = np.asarray(time_s, dtype=float), np.asarray(motor_rad, dtype=float)
    rods = _Rods(wire, bar)
    try:
        views = _views(frames, cameras, background)
        used = cameras.subset([view.camera.name for view in views])
        axis = _see_bar(views, used, rods, motor_rad, settings)
    except Refused as reason:
        return _nothing(whisks, str(reason))
    lights = [{} for _ in whisks]
    rows = [_see_whisk(number, range(*where.indices(len(time_s))), views, used, rods, axis, time_s, motor_rad,
                       lights[number], settings) for number, where in enumerate(whisks)]
    return TrialTruth(axis.point_mm, axis.direction, np.full((4, 4), np.nan), tuple(rows), one_sided_lines(lights))


def _nothing(whisks, reason: str) -> TrialTruth:
    rows = tuple(WhiskTruth(number, None, status=reason) for number in range(len(whisks)))
    return TrialTruth(np.full(3, np.nan), np.full(3, np.nan), np.full((4, 4), np.nan), rows)


def _views(frames, cameras: Cameras, background) -> list[View]:
    views = []
    for camera in cameras:
        pictures = frames.get(camera.name, {})
        if len(pictures) < 3:
            continue
        first, second = list(pictures.values())[:2]
        known = background.get(camera.name)
        known = np.zeros(first.shape) if known is None else np.asarray(known, dtype=float)
        views.append(View(camera, pictures, known, measure_noise(first, second)))
    if not views:
        raise Refused("no camera has three frames or more")
    return views


def _median_picture(view: View) -> np.ndarray:
    """Median of some frames at every HALF-th pixel: where the wire moves it vanishes."""
    return np.median([picture[::HALF, ::HALF] for picture in view.some(_MEDIAN_OF)], axis=0)


def _quieter(noise: Noise, count: int) -> Noise:
    """Noise of a mean of `count` frames beside one picture of the background."""
    share = 1.0 / count + 1.0
    return Noise(noise.floor * share, noise.gain * share)


def _see_bar(views, cameras: Cameras, rods: _Rods, motor_rad, settings: VisionSettings) -> BarAxis:
    """The bar's axis from the pictures of all frames, before any wire is known."""
    changes = {view.camera.name: changed(_median_picture(view), view.background[::HALF, ::HALF], view.noise)
               for view in views}
    axis = _see_bar_by_lines(changes, views, cameras, rods, motor_rad, settings) if len(views) > 1 else None
    if axis is not None and not seen_from_one_side(cameras, axis):
        return axis
    change = changes[views[0].camera.name]
    return see_bar_alone(change, _of_mean(views[0]), rods.wire, rods.bar.radius_mm, motor_rad, settings)


def _see_bar_by_lines(changes, views, cameras: Cameras, rods: _Rods, motor_rad, settings: VisionSettings) -> BarAxis:
    """Where the sights of two cameras or more cross."""
    span = float(np.min(motor_rad)), float(np.max(motor_rad))
    axis = find_bar(changes, cameras, rods.bar.radius_mm, rods.reach_mm, span, rods.wire.length_mm)
    for off_px in (FAR_PX, NEAR_PX):
        lines = _bar_lines(views, axis, rods, {}, settings, off_px=off_px)
        axis = settle_axis(axis, cameras, {name: line.points for name, line in lines.items()}, rods.bar.radius_mm)
        if max((line.moved_px for line in lines.values()), default=0.0) < NEAR_PX:
            break
    return axis


def _bar_lines(views, axis: BarAxis, rods: _Rods, wires, settings: VisionSettings, *, off_px: float = 0.0,
               last: bool = False):
    """The bar's line in each camera that shows enough of it."""
    found = {view.camera.name: measure_bar(_of_mean(view), view.mean, axis, rods.bar.radius_mm,
                                           wires.get(view.camera.name, []), settings, off_px=off_px, last=last)
             for view in views}
    return {name: line for name, line in found.items() if line is not None}


def _of_mean(view: View) -> View:
    """The view with the noise of its mean picture."""
    return replace(view, noise=_quieter(view.noise, min(len(view.frames), MEAN_OF)))


def _see_whisk(number: int, indices, views, cameras, rods: _Rods, axis: BarAxis, time_s, motor_rad,
               light: dict[str, Lit], settings: VisionSettings) -> WhiskTruth:
    """Truth of one whisk; its status where there is none."""
    views, left_out = _with_frames(views, indices)
    seen = [f for f in indices if all(f in view.frames for view in views)]
    if len(seen) < 4:
        few = f"{len(seen)} frames seen by every camera, 4 are needed"
        return WhiskTruth(number, None, status="; ".join(filter(None, [few, left_out])))
    cameras = cameras.subset([view.camera.name for view in views])
    motor = {f: float(motor_rad[f]) for f in seen}
    try:
        problem, state, covariance, near = _fit_whisk(views, cameras, rods, axis, motor, light, settings)
    except (Refused, np.linalg.LinAlgError) as reason:
        status = str(reason) if isinstance(reason, Refused) else "the fit of wire and bar does not settle"
        return WhiskTruth(number, None, cameras=len(views), frames_used=len(seen), status=status)
    measured, by_parameter = jacobians(problem, state)
    lens = calibration_share(problem, state, covariance)
    rows = [f for f in indices if f >= near[0]]
    whisk = to_whisk(number, rows, near, time_s, motor_rad, problem, state, measured, by_parameter, covariance,
                     lens, views, rods.bar.radius_mm, settings)
    beam = check_beam(problem, state, covariance + lens, measured, by_parameter)
    status = "; ".join(filter(None, [whisk.status, beam.alarm, left_out]))
    far = _free_stroke(views, rods, problem, state, motor, near, light, settings) if near[0] > seen[0] else None
    return replace(whisk, base=base_lines(*(far or (problem, state)), lens), beam=beam, status=status)


def _with_frames(views, indices) -> tuple[list[View], str]:
    """The views that have most of the frames, and a line on those left out: one camera's gaps are not all cameras'."""
    counts = [sum(f in view.frames for f in indices) for view in views]
    kept = [view for view, count in zip(views, counts) if count > _FEWEST_SHARE * max(counts)]
    lost = [f"camera {view.camera.name} was left out: {count} frames of {len(indices)}"
            for view, count in zip(views, counts) if count <= _FEWEST_SHARE * max(counts)]
    return kept, "; ".join(lost)


def _fit_whisk(views, cameras, rods: _Rods, axis: BarAxis, motor: Mapping[int, float], light: dict[str, Lit],
               settings: VisionSettings):
    """Problem and state after the last round, the parameters' covariance, and the frames in it: all but those far
    before touch.

    light: filled with how each camera sees the wire. Raises Refused where there is no touch to fit.
    """
    early = _early(motor)
    rest = find_rest(views, cameras, rods.wire, axis, rods.reach_mm, early)
    coarse = follow_bends(views, rods.wire, axis, rods.reach_mm, rest, motor)
    one_side = seen_from_one_side(cameras, axis)
    motor = motor if one_side else _near_touch(motor, coarse)
    angles, bend = np.array(list(motor.values())), np.array([coarse[f] for f in motor])
    touching, free = frames_that_touch(angles, bend)
    if one_side:  # a bend along the sight is not seen at first
        free = np.arange(len(angles)) < len(early)
        touching = touching & ~free
    elif not np.any(touching):
        raise Refused(_NEVER_TOUCHES)
    if np.sum(~touching) < FEWEST_FREE:
        raise Refused(_STARTS_TOUCHING)
    arcs = np.array([contact_arc(rest, b, m, axis, rods.wire) for b, m in zip(bend, angles)])
    curves = {f: one_curve(rest, b, a, m, rods.wire) for f, b, a, m in zip(motor, bend, arcs, angles)}
    for round_number in range(settings.rounds + 1):
        last = round_number == settings.rounds
        seen = _trace_all(views, cameras, rods, axis, motor, curves, light, settings, last=last)
        problem = Problem(cameras, rods.wire, rods.reach_mm, rods.reach_sigma_mm, axis, angles, touching, ~free, seen)
        fitted, covariance = solve(problem, _begin(problem, rest, bend, arcs))
        if one_side:
            problem, fitted = touch_by_onset(problem, fitted, covariance)
            fitted, _ = solve(problem, fitted)
        problem = honest(problem, fitted)
        fitted, covariance = solve(problem, fitted, scales=[LAST_SCALE] * 3)
        if last:
            break
        rest, bend, arcs = rest_shape(fitted.vector), bends(problem, fitted.vector), fitted.arcs_mm
        axis, curves = bar_axis(problem, fitted.vector), _fitted(problem, fitted, motor)
        if one_side:
            touching = problem.touching
            continue
        touch = float(first_touch(problem, fitted.vector).motor_rad)
        touching, free = frames_by_touch(angles, touch, np.radians(0.02))
        if np.sum(free) < FEWEST_FREE:
            raise Refused(_STARTS_TOUCHING)
        if not np.any(touching):
            raise Refused(_NEVER_TOUCHES)
    return problem, fitted, covariance, list(motor)


def _near_touch(motor: Mapping[int, float], bend: Mapping[int, np.ndarray]) -> dict[int, float]:
    """The frames from a little before the first that surely touches."""
    angles = np.array(list(motor.values()))
    touching, _ = frames_that_touch(angles, np.array(list(bend.values())))
    if not np.any(touching):
        return dict(motor)
    first = int(np.argmax(touching))
    begin = min(int(np.argmax(angles > angles[first] - _NEAR_TOUCH_RAD)), max(first - _FEWEST_NEAR, 0))
    return dict(list(motor.items())[begin:])


def _free_stroke(views, rods: _Rods, problem: Problem, state: State, motor: Mapping[int, float], near, light: dict,
                 settings: VisionSettings) -> tuple[Problem, State]:
    """All frames before touch and what is seen in them, about the bar and the shape at rest of a fit."""
    free = {f: angle for f, angle in motor.items() if f not in near or not problem.bent[near.index(f)]}
    rest, axis = rest_shape(state.vector), bar_axis(problem, state.vector)
    curves = {f: one_curve(rest, np.zeros(2), rods.wire.length_mm, angle, rods.wire) for f, angle in free.items()}
    seen = [one for number, view in enumerate(views)
            for one in _trace_wire(number, view, rods, axis, free, curves, light, settings)]
    nothing = np.zeros(len(free), dtype=bool)
    alone = replace(problem, motor_rad=np.array(list(free.values())), touching=nothing, bent=nothing, seen=seen)
    there = State(state.vector[:problem.first_bend], np.full(len(free), 0.5 * rods.wire.length_mm))
    return honest(alone, there), there


def _early(motor: Mapping[int, float]) -> dict[int, float]:
    """The frames of the first seventh of the stroke, two at least: taken as free for a first look."""
    angles = list(motor.values())
    limit = angles[0] + (angles[-1] - angles[0]) / 7.0
    count = max(2, sum(1 for angle in angles if angle <= limit))
    return dict(list(motor.items())[:count])


def _fitted(problem: Problem, state: State, motor) -> dict[int, Curves]:
    curves, _ = curves_of(problem, state.vector, state.arcs_mm)
    return {f: Curves(curves.arc_mm, curves.points_mm[k], curves.tangents[k]) for k, f in enumerate(motor)}


def _begin(problem: Problem, rest, bend, arcs) -> State:
    vector = np.zeros(problem.size)
    vector[4:12] = np.ravel(rest)
    vector[problem.first_bend:] = bend[problem.bent].ravel()
    return State(vector, np.asarray(arcs, dtype=float))


def _trace_all(views, cameras: Cameras, rods: _Rods, axis: BarAxis, motor, curves, light: dict,
               settings: VisionSettings, *,
               last: bool) -> list[Observed]:
    """Line points of wire and bar in all cameras. light: each camera's blur, found the first time. last: see
    `measure_bar`."""
    wires = {view.camera.name: [view.camera.project(curve.points_mm) for curve in curves.values()] for view in views}
    bar = _trace_bar(views, cameras, rods, axis, wires, settings, last=last)
    seen = []
    for number, view in enumerate(views):
        seen += _trace_wire(number, view, rods, axis, motor, curves, light, settings)
        seen += [Observed(-1, number, points, side) for side, points in bar[number].items()]
    for rod, there in (("wire clear of the bar", any(one.frame >= 0 for one in seen)),
                       ("bar clear of the wire", any(one.frame < 0 for one in seen))):
        if not there:
            raise Refused(f"no camera shows enough of the {rod}")
    return seen


def _trace_bar(views, cameras: Cameras, rods: _Rods, axis: BarAxis, wires, settings: VisionSettings, *,
               last: bool) -> list[dict[int, LinePoints]]:
    """Per camera the points of the bar's middle (side 0), or of its two edges where the cameras stand on one side."""
    if seen_from_one_side(cameras, axis):
        return [measure_edges(_of_mean(view), view.mean, axis, rods.bar.radius_mm, wires[view.camera.name],
                              settings) or {} for view in views]
    lines = _bar_lines(views, axis, rods, wires, settings, last=last)
    return [{0: lines[view.camera.name].points} if view.camera.name in lines else {} for view in views]


def _trace_wire(number: int, view: View, rods: _Rods, axis: BarAxis, motor, curves, light: dict,
                settings: VisionSettings) -> list[Observed]:
    pieces = wire_pieces(view, curves, rods.wire, settings.wire_piece_px, settings.wire_margin_px)
    outline = outline_of_bar(view.camera, axis, rods.bar.radius_mm)
    pieces = pieces.select(clear_of_bar(pieces, *outline, _BESIDE_BAR_PX) & (pieces.place > _NEAR_CLAMP_MM))
    if len(pieces) == 0:
        return []
    knots = Knots.of_turning(np.arange(_NEAR_CLAMP_MM, rods.wire.length_mm, _WIRE_KNOT_MM), motor)
    name, known = view.camera.name, light.get(view.camera.name)
    pieces, blur = (pieces, known.blur_px) if known else settle(pieces, knots, _SEARCH_PX)
    pieces, found, misfit = trace(pieces, blur, WAVES, knots, _ROUNDS_AGAIN if known else _ROUNDS_FIRST)
    light[name] = known or Lit(blur, seen_width(pieces, blur))
    points, source = to_points(pieces, found, misfit)
    return observed(points, source, number, list(curves))
