"""First look at a whisk: the whisker's rest shape from its free stroke, then its bend frame by frame.

Coarse: to a pixel or two, enough for the bands that `trace` reads.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vision.fit.blocks import REST_PRIOR_MM
from vision.fit.problem import Problem, rest_shape, start
from vision.fit.solve import solve
from vision.geometry.camera import Cameras
from vision.geometry.centreline import REST_POWERS, Curves, centrelines, one_curve
from vision.geometry.contact import Axis, closest_arc, outline_of_bar
from vision.geometry.newton import cauchy_weights
from vision.geometry.refusals import Refused
from vision.geometry.rods import Rods, Wire
from vision.geometry.silhouette import outline
from vision.pictures.view import View, median_of
from vision.wire.coarse import Votes, likely_curve, votes
from vision.wire.points import LinePoints, Observed
from vision.wire.trace import NEAR_CLAMP_MM, clear_of_bar, wire_pieces

# [px] Length of a piece of the first look. Set by eye. Study: thresholds.py fit.first_bends
# _PIECE_PX ….
_PIECE_PX = 16
# [px] How far to either side of where the last two frames lead to a wire is looked for. Set by
# eye. Study: thresholds.py fit.first_bends _REACH_PX ….
_REACH_PX = 26
# [px] From curve to curve that is tried: half of a wire's width. Derived.
_STEP_PX = 2
# [sigma] Of the rest shape's prior (`fit/problem.py`) within which a wire is looked for: 95 % of
# what is believed. Derived.
_REST_SIGMAS = 2.0
# [px] RMS along the wire, from bend to bend that is tried: 2 px at the tip. Derived.
_BEND_PX = 1.0
# [frames] More would not make what stands still clearer: its noise is 0.38 of a frame's. Derived.
_MEDIAN_OF = 11
# [rad] A round that moves bends by less is the last: a hundredth of a millimetre at the tip.
# Derived.
_STILL_RAD = 1e-4
# [rad] Priors of a frame's bend, and of its part along the bar where one camera sees it: only
# friction pushes there. Set by eye. Study: coverage.py alone.
_PULL_RAD, _ALONG_BAR_RAD = 0.2, 0.02
# [px] Pieces nearer to the bar's outline show its edge. Set by eye. Study: thresholds.py
# fit.first_bends _BESIDE_BAR_PX ….
_BESIDE_BAR_PX = 8.0
# [sigmas] Of the Cauchy weights of the rest shape's coarse points, round by round. Set by eye.
_REST_SCALES = (20.0, 10.0, 5.0, 3.0, 2.0, 2.0)
# [px, rad] Scale of the Cauchy weights of a frame's coarse points, half a wire's width; and a
# whisker that is pushed by 45° bends so far, by 1.5 times the push. Set by eye.
_CAUCHY_PX, _MOST_BEND_RAD = 2.0, 1.2


@dataclass(frozen=True, eq=False)
class Sight:
    """One camera's pictures of a whisk, what stands still in them, and the bar's outline."""

    view: View
    rods: Rods
    still: np.ndarray
    still_share: float
    bar_px: tuple[np.ndarray, np.ndarray]

    @classmethod
    def of(
        cls, view: View, rods: Rods, axis: Axis, frames: Sequence[int], bar_mm: float
    ) -> "Sight":
        """frames: those of the whisk, in which the wire moves; bar_mm: radius within which the bar is."""
        frames = [
            frames[k]
            for k in np.unique(np.linspace(0, len(frames) - 1, _MEDIAN_OF).round().astype(int))
        ]
        still = median_of([view.frames[frame] for frame in frames])
        return cls(
            view, rods, still, 0.5 * np.pi / len(frames), outline_of_bar(view.camera, axis, bar_mm)
        )

    def votes(self, curves: Mapping[int, Curves], reach_px: int = _REACH_PX) -> Votes:
        """Where the wire may be beside predicted curves by frame, clear of hub and bar."""
        pieces = wire_pieces(self.view, curves, self.rods.wire, _PIECE_PX, reach_px - 3, self.still)
        clear = clear_of_bar(pieces, *self.bar_px, _BESIDE_BAR_PX) & (pieces.place > NEAR_CLAMP_MM)
        return votes(pieces.select(clear), self.still_share, reach_px)


def find_rest(
    sights: Sequence[Sight], cameras: Cameras, axis: Axis, motor_rad: Mapping[int, float]
) -> np.ndarray:
    """Rest shape (2, 4) in mm from frames {index: motor angle} in which nothing touches.

    Raises Refused where no whisker is seen to swing.
    """
    motor, rods, seen = np.array(list(motor_rad.values())), sights[0].rods, []
    straight = np.zeros((2, REST_POWERS))
    curves = {
        f: one_curve(straight, np.zeros(2), rods.wire.length_mm, m, rods.wire)
        for f, m in motor_rad.items()
    }
    for number, sight in enumerate(sights):
        points, source = _resting_points(sight, curves)
        seen += [Observed(k, number, points.select(source == f)) for k, f in enumerate(motor_rad)]
    if not any(len(one.points) for one in seen):
        raise Refused("no whisker is seen where the motor angle says it should be")
    nothing = np.zeros(len(motor), dtype=bool)
    problem = Problem(cameras, rods, axis, motor, nothing, nothing, seen)
    state, _ = solve(problem, start(problem, rods.wire.length_mm / 2), scales=_REST_SCALES)
    return rest_shape(problem, state.vector)


def _resting_points(sight: Sight, curves: Mapping[int, Curves]) -> tuple[LinePoints, np.ndarray]:
    """Points to a pixel or two of a wire that lies to the straight one alike in all frames, and the frame of each; none
    where none is surely seen."""
    straight, length_mm = next(iter(curves.values())), sight.rods.wire.length_mm
    _, px_per_mm = outline(sight.view.camera, straight.points_mm, straight.tangents, 1.0)
    most = _REST_SIGMAS * REST_PRIOR_MM[:3] * np.max(px_per_mm)  # of offset, slope, curvature
    seen = sight.votes(curves, int(np.ceil(most[1])))
    along = seen.pieces.place / length_mm
    shapes = np.stack([1.0 - along, along, along * (1.0 - along)], axis=1)
    count = np.ceil(most / _STEP_PX)
    best, sure = likely_curve([seen], shapes, [np.arange(-n, n + 1) * _STEP_PX for n in count])
    points, keep = seen.points(shapes @ best), np.full(len(shapes), sure)
    return points.select(keep), seen.pieces.source[keep]


def follow_bends(
    sights: Sequence[Sight], axis: Axis, rest_mm: np.ndarray, motor_rad: Mapping[int, float]
) -> dict[int, np.ndarray]:
    """Bend (2,) in rad of every frame in order, each looked for near where the last two lead to."""
    bend_rad: dict[int, np.ndarray] = {}
    pull, wire = _pull(axis, len(sights)), sights[0].rods.wire
    last, before = np.zeros(2), np.zeros(2)
    for frame, motor in motor_rad.items():
        guess = 2 * last - before
        arc = contact_arc(rest_mm, guess, motor, axis, wire)
        seen = [
            sight.votes({frame: one_curve(rest_mm, guess, arc, motor, wire)}) for sight in sights
        ]
        model = _Model([sight.view for sight in sights], rest_mm, arc, motor, wire)
        before, last = last, _fit_bend(model, *_likely_bend(model, seen, guess), pull)
        bend_rad[frame] = last
    return bend_rad


@dataclass(frozen=True, eq=False)
class _Model:
    """Where one frame's wire is expected, by its bend: views, rest shape, contact arc, motor angle, wire."""

    views: Sequence[View]
    rest_mm: np.ndarray
    arc_mm: float
    motor_rad: float
    wire: Wire

    def px(self, bend, seen: Sequence[LinePoints]) -> np.ndarray:
        """Distances (…, n) in px from line points of all cameras to the predicted lines; bend (…, 2)."""
        shape = np.shape(bend)[:-1]
        curves = centrelines(
            np.broadcast_to(self.rest_mm, (*shape, 2, REST_POWERS)),
            bend,
            np.full(shape, self.arc_mm),
            np.full(shape, self.motor_rad),
            self.wire,
        )
        off = []
        for view, points in zip(self.views, seen):
            expected = view.camera.project(curves.at(points.place)[0].reshape(-1, 3)).reshape(
                *shape, -1, 2
            )
            off.append(np.sum(points.normal * (expected - points.px), axis=-1))
        return np.concatenate(off, axis=-1)

    def slopes(
        self, bend, seen: Sequence[LinePoints], step: float = 1e-5
    ) -> tuple[np.ndarray, np.ndarray]:
        """The same of one bend (2,), and its derivatives (n, 2) by the bend."""
        left, *moved = self.px(bend + step * np.eye(3, 2, -1), seen)
        return left, (np.stack(moved, axis=1) - left[:, None]) / step


def _likely_bend(
    model: _Model, seen: Sequence[Votes], guess
) -> tuple[np.ndarray, list[LinePoints]]:
    """The bend with most votes of all cameras, or the guess where none surely has more than noise; points near it."""
    none = np.zeros(sum(len(one.pieces) for one in seen))
    _, slopes = model.slopes(guess, _points_of(seen, none))
    _, px_per_rad, turned = np.linalg.svd(slopes / np.sqrt(max(len(none), 1)), full_matrices=False)
    count = np.minimum(_REACH_PX / _BEND_PX, 2.0 * _PULL_RAD * px_per_rad / _BEND_PX)
    grids = [
        np.arange(-n, n + 1) * _BEND_PX / max(scale, 1e-9)
        for n, scale in zip(np.floor(count), px_per_rad)
    ]
    best, sure = likely_curve(seen, slopes @ turned.T, grids)
    change = best @ turned if sure else np.zeros(2)
    return guess + change, _points_of(seen, slopes @ change)


def _points_of(seen: Sequence[Votes], shift_px) -> list[LinePoints]:
    """Points of each camera near a curve that lies shift_px (s,) away from the predicted one, s of all cameras."""
    ends = np.cumsum([len(one.pieces) for one in seen])[:-1]
    return [one.points(shift) for one, shift in zip(seen, np.split(shift_px, ends))]


def _fit_bend(model: _Model, bend, seen: Sequence[LinePoints], pull, rounds: int = 8) -> np.ndarray:
    """Least squares on the two components of the bend, Cauchy weights of 2 px, a pull (2, 2) towards none."""
    sure = np.concatenate([points.sigma_px for points in seen]) ** -2.0
    for _ in range(rounds):
        left, jacobian = model.slopes(bend, seen)
        weight = sure * cauchy_weights(left, _CAUCHY_PX)
        normal = jacobian.T @ (weight[:, None] * jacobian) + pull
        change = np.linalg.solve(normal, jacobian.T @ (weight * left) + pull @ bend)
        bend = np.clip(bend - change, -_MOST_BEND_RAD, _MOST_BEND_RAD)
        if np.max(np.abs(change)) < _STILL_RAD:
            break
    return bend


def _pull(axis: Axis, views: int) -> np.ndarray:
    """Inverse covariance (2, 2) of a bend before it is seen: weak, but for one view, to which a part of it is hidden:
    the bar pushes at right angles to itself, and friction adds a part of that."""
    if views > 1:
        return np.eye(2) / _PULL_RAD**2
    along = axis.direction[1:] / np.linalg.norm(axis.direction[1:])
    return np.eye(2) / _PULL_RAD**2 + np.outer(along, along) / _ALONG_BAR_RAD**2


def contact_arc(
    rest_mm: np.ndarray, bend: np.ndarray, motor: float, axis: Axis, wire: Wire
) -> float:
    """Arc length in mm at which a whisker of this rest shape (2, 4), mm, and bend (2,), rad, is nearest to the axis."""
    straight = one_curve(rest_mm, np.zeros(2), wire.length_mm, motor, wire)
    arc = np.clip(closest_arc(straight, axis), 1.0, wire.length_mm)
    bent = one_curve(rest_mm, bend, arc, motor, wire)
    return float(np.clip(closest_arc(bent, axis), 1.0, wire.length_mm))
