"""First look at a whisk: the whisker's rest shape from its free stroke, then its bend frame by frame.

Coarse: to a pixel or two, enough for the bands that `trace` reads.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from vision.fit.problem import BAR, REST, Problem, start
from vision.fit.solve import solve
from vision.geometry.camera import Cameras
from vision.geometry.centreline import REST_POWERS, Curves, one_curve
from vision.geometry.contact import BarAxis, closest_arc, outline_of_bar
from vision.geometry.errors import Refused
from vision.geometry.newton import cauchy_weights
from vision.geometry.rods import Rods, Wire
from vision.lines.bands import strongest_shift
from vision.lines.points import LinePoints, Observed
from vision.lines.trace import clear_of_bar, wire_pieces
from vision.pictures.view import View

_PIECE_PX = 16
_REACH_PX = 26
_SIGMA_PX = 1.0
_STILL_RAD = 1e-4  # a hundredth of a millimetre at the tip
_PULL_RAD, _ALONG_BAR_RAD = 0.2, 0.02
_BESIDE_BAR_PX = 8.0
_SHARE = 0.35  # a rod's window holds at least this part of all difference in its band


def _bars_px(views: Sequence[View], rods: Rods, axis: BarAxis) -> list:
    return [outline_of_bar(view.camera, axis, rods.bar.radius_mm) for view in views]


def coarse_points(view: View, curves: Mapping[int, Curves], wire: Wire, bar_px) -> tuple[LinePoints, np.ndarray]:
    """Line points to a pixel, away from the bar (see `outline_of_bar`), and the frame of each."""
    pieces = wire_pieces(view, curves, wire, _PIECE_PX, _REACH_PX - 3)
    pieces = pieces.select(clear_of_bar(pieces, *bar_px, _BESIDE_BAR_PX))
    shift, share = strongest_shift(pieces, _REACH_PX)
    good = (share > _SHARE) & (np.abs(shift) < _REACH_PX - 4)
    px = pieces.foot_px + shift[:, None] * pieces.normal
    points = LinePoints(px, pieces.normal, np.full(len(pieces), _SIGMA_PX), pieces.place)
    return points.select(good), pieces.source[good]


def find_rest(views: Sequence[View], cameras: Cameras, rods: Rods, axis: BarAxis,
              motor_rad: Mapping[int, float]) -> np.ndarray:
    """Rest shape (2, 4) in mm from frames {index: motor angle} in which nothing touches.

    Raises Refused where no whisker is seen to swing.
    """
    motor, wire = np.array(list(motor_rad.values())), rods.wire
    rest = np.zeros((2, REST_POWERS))
    bars_px = _bars_px(views, rods, axis)
    for _ in range(2):
        curves = {f: one_curve(rest, np.zeros(2), wire.length_mm, m, wire) for f, m in motor_rad.items()}
        seen = []
        for number, (view, bar_px) in enumerate(zip(views, bars_px)):
            points, source = coarse_points(view, curves, wire, bar_px)
            seen += [Observed(k, number, points.select(source == f)) for k, f in enumerate(motor_rad)]
        if sum(len(s.points) for s in seen) < 8 * len(motor_rad):
            raise Refused("no whisker is seen where the motor angle says it should be")
        nothing = np.zeros(len(motor), dtype=bool)
        problem = Problem(cameras, rods, axis, motor, nothing, nothing, seen)
        state, _ = solve(problem, start(problem, wire.length_mm / 2), scales=(20.0, 10.0, 5.0, 3.0, 2.0, 2.0))
        rest = state.vector[BAR:BAR + REST].reshape(2, REST_POWERS)
    return rest


def follow_bends(views: Sequence[View], rods: Rods, axis: BarAxis, rest_mm,
                 motor_rad: Mapping[int, float]) -> dict[int, np.ndarray]:
    """Bend (2,) in rad of every frame in order, each looked for near where the last two lead to."""
    found: dict[int, np.ndarray] = {}
    wire = rods.wire
    pull, bars_px = _pull(axis, len(views)), _bars_px(views, rods, axis)
    last, before = np.zeros(2), np.zeros(2)
    for frame, motor in motor_rad.items():
        guess = 2 * last - before
        arc = contact_arc(rest_mm, guess, motor, axis, wire)
        curve = one_curve(rest_mm, guess, arc, motor, wire)
        seen = [coarse_points(view, {frame: curve}, wire, bar_px)[0] for view, bar_px in zip(views, bars_px)]
        bend = _fit_bend(views, seen, rest_mm, guess, arc, motor, wire, pull)
        found[frame] = bend
        before, last = last, bend
    return found


def _pull(axis: BarAxis, views: int) -> np.ndarray:
    """Inverse covariance (2, 2) of a bend before it is seen: weak, but for one view, to which a part of it is hidden:
    the bar pushes at right angles to itself, and friction adds a part of that."""
    if views > 1:
        return np.eye(2) / _PULL_RAD**2
    along = axis.direction[1:] / np.linalg.norm(axis.direction[1:])
    return np.eye(2) / _PULL_RAD**2 + np.outer(along, along) / _ALONG_BAR_RAD**2


def contact_arc(rest_mm, bend, motor, axis: BarAxis, wire: Wire) -> float:
    straight = one_curve(rest_mm, np.zeros(2), wire.length_mm, motor, wire)
    arc = np.clip(closest_arc(straight, axis), 1.0, wire.length_mm)
    bent = one_curve(rest_mm, bend, arc, motor, wire)
    return float(np.clip(closest_arc(bent, axis), 1.0, wire.length_mm))


def _fit_bend(views, seen: Sequence[LinePoints], rest_mm, bend, arc, motor, wire: Wire, pull, rounds: int = 8):
    """Least squares on the two components of the bend, Cauchy weights of 2 px, a pull (2, 2) towards none."""
    bend, step = np.array(bend, dtype=float), 1e-5
    for _ in range(rounds):
        left, columns = _bend_residual(views, seen, rest_mm, bend, arc, motor, wire), []
        for k in range(2):
            moved = _bend_residual(views, seen, rest_mm, bend + step * np.eye(2)[k], arc, motor, wire)
            columns.append((moved - left) / step)
        weight = cauchy_weights(left, 2.0)
        jacobian = np.stack(columns, axis=1)
        normal = jacobian.T @ (weight[:, None] * jacobian) + pull
        change = np.linalg.solve(normal, jacobian.T @ (weight * left) + pull @ bend)
        bend = np.clip(bend - change, -0.5, 0.5)
        if np.max(np.abs(change)) < _STILL_RAD:
            break
    return bend


def _bend_residual(views, seen, rest_mm, bend, arc, motor, wire: Wire) -> np.ndarray:
    """Distance in px from line points to the predicted line, all cameras."""
    curve = one_curve(rest_mm, bend, arc, motor, wire)
    parts = [np.sum(points.normal * (view.camera.project(curve.at(points.place)[0]) - points.px), axis=1)
             for view, points in zip(views, seen)]
    return np.concatenate(parts)
