"""The first pass over a whisk: the whisker's rest shape from its free stroke, then its bend by
frame.

Coarse: to a pixel or two, enough for the strips that `trace` reads.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from vision.fit.blocks import REST_PRIOR_MM
from vision.fit.problem import Problem, rest_shape, start
from vision.fit.solve import solve
from vision.geometry.camera import Camera, Cameras
from vision.geometry.centreline import (
    REST_POWERS,
    Curves,
    centrelines,
    unbent_centrelines,
    unbent_curves,
)
from vision.geometry.contact import closest_arc
from vision.geometry.newton import cauchy_weights
from vision.geometry.refusals import Refused
from vision.geometry.rods import Rods, Wire
from vision.geometry.sampling import spread
from vision.geometry.silhouette import outline
from vision.geometry.touched import Axis
from vision.pictures.view import MEDIAN_OF, View, median_of
from vision.wire.coarse import Votes, likely_curve, votes
from vision.wire.points import LinePoints, Observed
from vision.wire.trace import NEAR_CLAMP_MM, clear_of_bar, wire_pieces

# [px] Length of a piece of the wire in this first pass. 12 or 24 move touch by 0.1 sigma.
# Study: thresholds.py fit.first_bends PIECE_PX ….
PIECE_PX = 16
# [px] How far to either side of the place predicted by the last two frames a wire is searched for.
# 18 or 40 move nothing on the fixtures. Study: thresholds.py fit.first_bends _REACH_PX ….
_REACH_PX = 26
# [sigma] Of the rest shape's prior (`fit/problem.py`) within which a wire is searched for: 95 % of
# what is believed. Derived.
_REST_SIGMAS = 2.0
# [px] RMS along the wire, from bend to bend that is tried: 2 px at the tip. Derived.
_BEND_PX = 1.0
# [rad] A round that moves bends by less is the last: a hundredth of a millimetre at the tip.
# Derived.
_CONVERGED_RAD = 1e-4
# [rounds] Of the fit at most; it ends where the bend has converged. Stated.
_ROUNDS = 8
# [rad] Prior sigma of a frame's bend. Half or twice it moves d_x by 0.01 sigma. Study: thresholds.py
# fit.first_bends _PULL_RAD ….
_PULL_RAD = 0.2
# [rad] Prior sigma of its part along the bar where one camera sees it: only friction pushes there.
# Half or twice it moves slopes by 0.07 sigma. Study: thresholds.py fit.first_bends _ALONG_BAR_RAD …
# --cameras 1.
_ALONG_BAR_RAD = 0.02
# [px] Pieces nearer to the bar's outline show its edge. 4 or 16 move d_x by 0.15 sigma. Study:
# thresholds.py fit.first_bends _BESIDE_BAR_PX ….
_BESIDE_BAR_PX = 8.0
# [sigmas] Of the Cauchy weights of the rest shape's coarse points, round by round: wide while the
# shape is far off. From 5 on, or 2 at once, it is the same on the fixtures. Study: thresholds.py
# fit.first_bends _REST_SCALES ….
_REST_SCALES = (20.0, 10.0, 5.0, 3.0, 2.0, 2.0)
# [px] Scale of the Cauchy weights of a frame's coarse points: half a wire's width. Stated.
_CAUCHY_PX = 2.0
# [rad] The largest bend: by a push of 45° a clamped rod bends by 3/2 of it, 1.18. Derived.
_MOST_BEND_RAD = 1.2
# [rad] Step of differences of a bend: far above rounding, far below what curves. Derived.
_STEP_RAD = 1e-5


@dataclass(frozen=True, eq=False)
class SwingPictures:
    """One camera's pictures of a whisk, what stands still in them, and the bar's outline.

    static: median of its frames; static_share: variance of its noise over that of one picture. bar_px:
    middles (m, 2) and radii (m,) of discs that cover the bar.
    """

    view: View
    rods: Rods
    static: np.ndarray
    static_share: float
    bar_px: tuple[np.ndarray, np.ndarray]

    @classmethod
    def of(
        cls, view: View, rods: Rods, axis: Axis, frames: Sequence[int], bar_mm: float
    ) -> "SwingPictures":
        """Return the pictures of one camera.

        frames: those of the whisk, in which the wire moves; bar_mm: radius within which the bar is.
        """
        chosen = spread(frames, MEDIAN_OF)
        static = median_of([view.frames[frame] for frame in chosen])
        bar_px = axis.covering_discs(view.camera, bar_mm)
        return cls(view, rods, static, 0.5 * np.pi / len(chosen), bar_px)

    @classmethod
    def of_standing(cls, view: View, rods: Rods, axis: Axis, bar_mm: float) -> "SwingPictures":
        """Return the pictures of one camera in whose frames the wire has not moved yet.

        The picture without wire and bar then serves as that of what stands still.
        """
        bar_px = axis.covering_discs(view.camera, bar_mm)
        return cls(view, rods, view.background, 1.0, bar_px)

    def votes(self, curves: Mapping[int, Curves], reach_px: int = _REACH_PX) -> Votes:
        """Return where the wire may be near predicted curves by frame, clear of hub and bar."""
        pieces = wire_pieces(self.view, curves, self.rods.wire, PIECE_PX, reach_px - 3, self.static)
        clear = clear_of_bar(pieces, self.bar_px, _BESIDE_BAR_PX)
        clear &= pieces.place > NEAR_CLAMP_MM
        return votes(pieces.select(clear), self.static_share, reach_px)


def find_rest(
    sights: Sequence[SwingPictures], cameras: Cameras, axis: Axis, motor_rad: Mapping[int, float]
) -> np.ndarray:
    """Find the rest shape (2, 4) in mm from frames {index: motor angle} in which nothing touches.

    Raises Refused where no whisker is seen to swing.
    """
    rods = sights[0].rods
    curves = unbent_curves(np.zeros((2, REST_POWERS)), motor_rad, rods.wire)
    seen = []
    for camera, sight in enumerate(sights):
        seen += _resting_points(sight, camera, curves)
    if not any(len(one.points) for one in seen):
        raise Refused(
            "no whisker is seen where the motor angle says it should be", code="no_whisker_seen"
        )
    return fit_rest(seen, cameras, rods, axis, motor_rad)


def fit_rest(
    seen: Sequence[Observed],
    cameras: Cameras,
    rods: Rods,
    axis: Axis,
    motor_rad: Mapping[int, float],
) -> np.ndarray:
    """Return the rest shape (2, 4) in mm by coarse points of the wire in frames in which nothing touches."""
    motor = np.array(list(motor_rad.values()))
    none = np.zeros(len(motor), dtype=bool)
    problem = Problem(cameras, rods, axis, motor, none, none, seen)
    state, _ = solve(problem, start(problem, rods.wire.length_mm / 2), scales=_REST_SCALES)
    return rest_shape(problem, state.vector)


def _resting_points(
    sight: SwingPictures, camera: int, curves: Mapping[int, Curves]
) -> list[Observed]:
    """Return points, good to a pixel or two, of a wire that departs from the straight one by the
    same curve in all frames; none where no wire is surely seen.
    """
    most_px = _most_rest_px(sight.view, next(iter(curves.values())))
    found = sight.votes(curves, int(np.ceil(most_px[1])))
    shapes = _rest_modes(found.pieces.place / sight.rods.wire.length_mm)
    step_px = found.step_px
    grids = [np.arange(-n, n + 1) * step_px for n in np.ceil(most_px / step_px)]
    best, is_sure = likely_curve([found], shapes, grids)
    if not is_sure:
        return []
    points = found.points(shapes @ best, near_px=2 * step_px)
    source = found.pieces.source
    return [Observed(k, camera, points.select(source == own)) for k, own in enumerate(curves)]


def _most_rest_px(view: View, straight: Curves) -> np.ndarray:
    """Return the largest offset, slope and curvature (3,) that are tried of a resting wire, px."""
    _, px_per_mm = outline(view.camera, straight.points_mm, straight.tangents, 1.0)
    return _REST_SIGMAS * REST_PRIOR_MM[:3] * np.max(px_per_mm)


def _rest_modes(along: np.ndarray) -> np.ndarray:
    """Return offset, slope and curvature (s, 3) of a resting wire at shares (s,) of its length."""
    return np.stack([1.0 - along, along, along * (1.0 - along)], axis=1)


def follow_bends(
    sights: Sequence[SwingPictures],
    axis: Axis,
    rest_mm: np.ndarray,
    motor_rad: Mapping[int, float],
) -> dict[int, np.ndarray]:
    """Return the bend (2,) in rad of every frame in order, each searched for near the extrapolation
    of the last two.
    """

    def find(frame: int, motor: float, guess_rad: np.ndarray) -> np.ndarray:
        """Return the bend of one frame."""
        return find_bend(sights, axis, rest_mm, frame, motor, guess_rad)

    return bends_in_order(motor_rad, find)


def bends_in_order(
    motor_rad: Mapping[int, float], find: Callable[[int, float, np.ndarray], np.ndarray]
) -> dict[int, np.ndarray]:
    """Return the bend (2,) in rad of every frame in order.

    find: finds that of a frame at a motor angle near a guess (2,), the extrapolation of the last two
    frames.
    """
    bends_rad: dict[int, np.ndarray] = {}
    for frame, motor in motor_rad.items():
        bends_rad[frame] = find(frame, motor, next_bend(bends_rad.values()))
    return bends_rad


def next_bend(bends_rad: Iterable[np.ndarray]) -> np.ndarray:
    """Return the bend (2,) that follows some in order, rad, by the last two; before the first frame
    there was none.
    """
    *_, before, last = np.zeros(2), np.zeros(2), *bends_rad
    return 2 * last - before


def find_bend(
    sights: Sequence[SwingPictures],
    axis: Axis,
    rest_mm: np.ndarray,
    frame: int,
    motor_rad: float,
    guess_rad: np.ndarray,
) -> np.ndarray:
    """Return the bend (2,) in rad of one frame, searched for near a guess (2,)."""
    wire = sights[0].rods.wire
    cameras = [sight.view.camera for sight in sights]
    model = BendModel.near(cameras, rest_mm, axis, wire, motor_rad, guess_rad)
    predicted = {frame: model.curves(guess_rad)}
    seen = [sight.votes(predicted) for sight in sights]
    bend, points = _bend_by_votes(model, seen, guess_rad)
    return fit_bend(model, bend, points)


@dataclass(frozen=True, eq=False)
class BendModel:
    """Where one frame's wire is expected, by its bend.

    axis: of the object. arc_mm: where along itself the wire touches it.
    """

    cameras: Sequence[Camera]
    rest_mm: np.ndarray
    axis: Axis
    wire: Wire
    motor_rad: float
    arc_mm: float

    @classmethod
    def near(
        cls,
        cameras: Sequence[Camera],
        rest_mm: np.ndarray,
        axis: Axis,
        wire: Wire,
        motor_rad: float,
        bend_rad: np.ndarray,
    ) -> Self:
        """Return the model whose contact is that of a bend (2,), rad."""
        arc_mm = contact_arc(rest_mm, bend_rad, motor_rad, axis, wire)
        return cls(cameras, rest_mm, axis, wire, motor_rad, arc_mm)

    def curves(self, bend: np.ndarray) -> Curves:
        """Return the wire's centrelines (…) by bends (…, 2)."""
        shape = np.shape(bend)[:-1]
        rest = np.broadcast_to(self.rest_mm, (*shape, 2, REST_POWERS))
        arc = np.full(shape, self.arc_mm)
        return centrelines(rest, bend, arc, np.full(shape, self.motor_rad), self.wire)

    def distances_px(self, bend: np.ndarray, seen: Sequence[LinePoints]) -> np.ndarray:
        """Return distances (…, n) in px from line points of all cameras to the predicted lines;
        bend (…, 2).
        """
        curves = self.curves(bend)
        distances = []
        for camera, points in zip(self.cameras, seen):
            points_mm, _ = curves.at(points.place)
            offset_px = camera.project(points_mm) - points.px
            distances.append(np.sum(points.normal * offset_px, axis=-1))
        return np.concatenate(distances, axis=-1)

    def linearise(
        self, bend: np.ndarray, seen: Sequence[LinePoints]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return distances (n,) in px of one bend (2,), and their derivatives (n, 2) by the
        bend.
        """
        px = self.distances_px(bend + _STEP_RAD * np.eye(3, 2, -1), seen)  # (3, n)
        moved = np.stack([px[1], px[2]], axis=1)
        return px[0], (moved - px[0][:, None]) / _STEP_RAD


def _bend_by_votes(
    model: BendModel, seen: Sequence[Votes], guess: np.ndarray
) -> tuple[np.ndarray, list[LinePoints]]:
    """Return the bend with most votes of all cameras, and points near it; the guess where no bend
    surely has more votes than noise gives."""
    none = np.zeros(sum(len(one.pieces) for one in seen))
    _, slopes = model.linearise(guess, _points_of(seen, none))
    scaled = slopes / np.sqrt(max(len(none), 1))
    _, px_per_rad, turned = np.linalg.svd(scaled, full_matrices=False)
    grids = [_bend_grid(scale) for scale in px_per_rad]
    best, is_sure = likely_curve(seen, slopes @ turned.T, grids)
    change = best @ turned if is_sure else np.zeros(2)
    return guess + change, _points_of(seen, slopes @ change)


def _bend_grid(px_per_rad: float) -> np.ndarray:
    """Return the changes (n,) of a bend that are tried, rad, where it moves the wire by so much."""
    most_px = min(_REACH_PX, 2.0 * _PULL_RAD * px_per_rad)
    count = np.floor(most_px / _BEND_PX)
    return np.arange(-count, count + 1) * _BEND_PX / max(px_per_rad, 1e-9)


def _points_of(seen: Sequence[Votes], shift_px: np.ndarray) -> list[LinePoints]:
    """Return points of each camera near a curve that lies shift_px (s,) from the predicted one, s
    of all cameras.
    """
    ends = np.cumsum([len(one.pieces) for one in seen])[:-1]
    return [one.points(shift) for one, shift in zip(seen, np.split(shift_px, ends))]


def fit_bend(model: BendModel, bend: np.ndarray, seen: Sequence[LinePoints]) -> np.ndarray:
    """Fit the two components of the bend with Cauchy weights to coarse points by camera.

    bend (2,): to begin from, rad.
    """
    prior = _prior_information(model.axis, len(model.cameras))
    information = np.concatenate([points.sigma_px for points in seen]) ** -2.0
    for _ in range(_ROUNDS):
        residual, jacobian = model.linearise(bend, seen)
        weight = information * cauchy_weights(residual, _CAUCHY_PX)
        normal = jacobian.T @ (weight[:, None] * jacobian) + prior
        change = np.linalg.solve(normal, jacobian.T @ (weight * residual) + prior @ bend)
        bend = np.clip(bend - change, -_MOST_BEND_RAD, _MOST_BEND_RAD)
        if np.max(np.abs(change)) < _CONVERGED_RAD:
            break
    return bend


def _prior_information(axis: Axis, views: int) -> np.ndarray:
    """Return the inverse covariance (2, 2) of a bend before it is seen.

    It is weak. A single view does not see one component of the bend: there the prior says that the
    bar pushes at right angles to itself, and that friction adds a part of that along it.
    """
    information = np.eye(2) / _PULL_RAD**2
    if views > 1:
        return information
    along = axis.direction[1:] / np.linalg.norm(axis.direction[1:])
    return information + np.outer(along, along) / _ALONG_BAR_RAD**2


def contact_arc(
    rest_mm: np.ndarray, bend_rad: np.ndarray, motor_rad: ArrayLike, axis: Axis, wire: Wire
) -> np.ndarray:
    """Return the arc lengths (…), mm, at which whiskers of one rest shape (2, 4), mm, are nearest to the axis.

    bend_rad (…, 2), motor_rad (…).
    """
    rest_mm = np.broadcast_to(rest_mm, (*np.shape(motor_rad), 2, REST_POWERS))
    straight = unbent_centrelines(rest_mm, motor_rad, wire)
    arc_mm = np.clip(closest_arc(straight, axis, wire), 1.0, wire.length_mm)
    bent = centrelines(rest_mm, bend_rad, arc_mm, motor_rad, wire)
    return np.clip(closest_arc(bent, axis, wire), 1.0, wire.length_mm)
