"""One reprojection fit over all cameras and frames of a whisk: bar, rest shape, and the bend in each frame.

Shared by all frames: the bar's axis and the whisker's rest shape. Each touching frame adds the two components of
its bend and one observation, that axis and centreline are bar radius + whisker radius apart. What the pictures may
be wrong in as a whole (a shift of the seen line from the rod's axis, by light and lens) enters as an offset and a
tilt per camera with a prior, and so ends up in the stated uncertainty.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import groupby

import numpy as np

from vision.fit.bend_onset import Onset
from vision.fit.differences import perturbed, steps
from vision.fit.problem import (
    BAR,
    BAR_MODES_PX,
    BAR_OFFSET_PX,
    BAR_PRIOR,
    BAR_TILT_ARM_MM,
    BEND_PRIOR_RAD,
    CONTACT_SIGMA_MM,
    PULL_PRIOR,
    REACH,
    REST,
    REST_PRIOR_MM,
    Problem,
    State,
    bar_axes,
    bar_axis,
    curves_of,
    rest_shape,
    shifts_mm,
    wire_modes,
)
from vision.geometry.centreline import Curves, centrelines
from vision.geometry.contact import clearance
from vision.geometry.grazing import sights_beside
from vision.geometry.newton import cauchy_weights
from vision.geometry.silhouette import edges
from vision.wire.points import LinePoints, Observed

# [sigma] Width of the Cauchy weights once the state is near: 95 % efficient on Gaussian noise at
# 2.4, more at 4. Study: coverage.py points.
LAST_SCALE = 4.0
# [steps] Of differences (0.1 mm, 1 mrad; bends 10 mrad): so near, slopes are taken to be what
# they were. Study: gradients.py.
_ALIKE = 1000.0
# [sigma] A step that moves all parameters together by less is the last. Derived.
_STILL_SIGMA = 0.01
# [sigmas] Of the Cauchy weights, round by round: wide while the state is still off by many. Set
# by eye.
_SCALES = 30.0, 10.0, *[LAST_SCALE] * 4
# [rad] Of bend in one step: the rod's shape is not linear beyond. Stated.
_LONGEST_RAD = 0.3


@dataclass(frozen=True)
class Linear:
    """Residuals (n,) over their sigma, their Jacobian (n, size), and which are line points (robust weights)."""

    residual: np.ndarray
    jacobian: np.ndarray
    is_point: np.ndarray


def linearise(
    problem: Problem, state: State, jacobian: np.ndarray | None = None
) -> tuple[Linear, State]:
    """Residuals and Jacobian at a state; the state comes back with its contact arcs brought up to date.

    jacobian: that of a state nearby, taken as it is, which saves nine tenths of the work.
    """
    moved, columns = (
        perturbed(problem, state.vector) if jacobian is None else (state.vector[None], [])
    )
    curves, arcs = curves_of(problem, moved, state.arcs_mm)
    alike = groupby(problem.seen, key=lambda seen: (seen.camera, seen.frame >= 0))
    blocks = [
        _wire_block(problem, camera, list(seen), curves, columns, state.vector)
        if on_wire
        else _bar_block(problem, camera, list(seen), columns, state.vector)
        for (camera, on_wire), seen in alike
    ]
    count = sum(len(block[0]) for block in blocks)
    blocks += [
        _contact_block(problem, moved, curves, arcs, columns, state.vector),
        _prior_block(problem, state.vector),
    ]
    if problem.onset is not None:
        blocks.append(_onset_block(problem, problem.onset, moved, columns, state.vector))
    residual = np.concatenate([block[0] for block in blocks])
    if jacobian is None:
        jacobian = np.concatenate([block[1] for block in blocks])
    return (
        Linear(residual, jacobian, np.arange(len(residual)) < count),
        replace(state, arcs_mm=arcs[0]),
    )


@lru_cache(maxsize=1)
def linear_at(problem: Problem, state: State) -> Linear:
    """`linearise`, kept for the next who asks the same: a fit that is done is asked for each of its uncertainties."""
    return linearise(problem, state)[0]


def _together(group: Sequence[Observed]) -> LinePoints:
    """The line points of all of them."""
    return LinePoints(
        *(
            np.concatenate([getattr(seen.points, name) for seen in group])
            for name in LinePoints.__dataclass_fields__
        )
    )


def _wire_block(
    problem: Problem, number: int, group: Sequence[Observed], curves: Curves, columns, vector
):
    """Residuals and Jacobian rows of one camera's points of the wire, all frames."""
    frame, points = (
        np.repeat([s.frame for s in group], [len(s.points) for s in group]),
        _together(group),
    )
    positions = curves.at_one_each(frame, points.place)
    px, by_point, _ = problem.cameras.cameras[number].project_with_jacobians(positions[0])
    along_normal = np.einsum("ni,nij->nj", points.normal, by_point)
    moved = np.einsum("cnj,nj->cn", positions[1:] - positions[0], along_normal)
    jacobian, row = np.zeros((len(points), problem.size)), np.arange(len(points))
    for (step, names), by_step in zip(columns, moved):
        bent = names[frame] >= 0
        jacobian[row[bent], names[frame][bent]] = by_step[bent] / step
    modes = wire_modes(
        problem.wire.length_mm, points.place, problem.motor_rad[frame], problem.motor_rad
    )
    modes = np.hstack([modes, points.shared_px])
    return _over_sigma(points, px, jacobian, problem.wire_off(number), modes, vector)


def _over_sigma(points: LinePoints, px, jacobian, off: slice, modes, vector):
    """Residuals of points predicted at px (n, 2), and their Jacobian, over sigma; with what the line is off by as a
    whole, in these modes (n, k)."""
    jacobian[:, off] = modes
    residual = np.sum(points.normal * (px - points.px), axis=1) + modes @ vector[off]
    return residual / points.sigma_px, jacobian / points.sigma_px[:, None]


def _bar_edges(
    problem: Problem, camera, vector, place_mm, wider_mm, frame
) -> tuple[np.ndarray, np.ndarray]:
    """Both edges (…, n, 2) of the bar's outline; wider_mm (…, n) or a number: added to the bar's radius; frame (n,): in
    which it is seen, of a bar that moves."""
    axis = bar_axis(problem, vector)
    points = (
        axis.point_mm[..., None, :] + np.asarray(place_mm)[:, None] * axis.direction[..., None, :]
    )
    if problem.motion is not None:
        points = points + shifts_mm(problem, vector)[..., frame, :]
    directions = np.broadcast_to(axis.direction[..., None, :], points.shape)
    radius_mm = np.broadcast_to(problem.rods.bar.radius_mm + wider_mm, points.shape[:-1])
    one, other = edges(camera, points.reshape(-1, 3), directions.reshape(-1, 3), radius_mm.ravel())
    return one.reshape(*points.shape[:-1], 2), other.reshape(*points.shape[:-1], 2)


def _bar_block(problem: Problem, number: int, group: Sequence[Observed], columns, vector):
    """Residuals and Jacobian rows of one camera's points of the bar: of its middle, or of an edge."""
    points = _together(group)
    if problem.is_rounded:
        return _limb_block(problem, number, points, bool(columns), vector)
    side, frame = (
        np.repeat(of, [len(s.points) for s in group])
        for of in zip(*((s.side, s.bar_in) for s in group))
    )
    moves = range(problem.size)[problem.bar_moves]
    moving = [*range(BAR), *([REACH] if np.any(side) else []), *moves] if columns else []
    step = steps(problem)[moving]
    moved = vector + step[:, None] * np.eye(problem.size)[moving]
    px = _bar_px(
        problem, problem.cameras.cameras[number], np.vstack([vector, moved]), points, side, frame
    )
    jacobian = np.zeros((len(points), problem.size))
    jacobian[:, moving] = np.einsum("knj,nj->nk", px[1:] - px[0], points.normal) / step
    modes = np.stack([np.ones(len(points)), points.place / BAR_TILT_ARM_MM], axis=1)
    return _over_sigma(points, px[0], jacobian, problem.bar_off(number), modes, vector)


def _limb_block(problem: Problem, number: int, points: LinePoints, by_all: bool, vector):
    """The same of points of a rounded object's outline: how far their sights pass outside of it."""
    along = problem.bar_moves.start
    moving = [*range(BAR), along] if by_all else []
    step = steps(problem)[moving]
    moved = np.vstack([vector, vector + step[:, None] * np.eye(problem.size)[moving]])
    camera, radius_mm = problem.cameras.cameras[number], problem.rods.bar.radius_mm
    grazing = sights_beside(camera, bar_axis(problem, moved), points.px, points.place)
    off_px = grazing.px_per_mm(camera, points.normal) * (
        grazing.outside_mm - radius_mm - vector[REACH]
    )
    jacobian = np.zeros((len(points), problem.size))
    jacobian[:, moving] = -(off_px[1:] - off_px[0]).T / step
    jacobian[:, REACH] = grazing.px_per_mm(camera, points.normal)
    outward = along + 1 + number
    jacobian[:, outward] = 1.0
    off_px[0] -= vector[outward]
    return _over_sigma(
        points,
        points.px - off_px[0][:, None] * points.normal,
        jacobian,
        problem.bar_off(number),
        points.normal * (BAR_OFFSET_PX / BAR_MODES_PX),
        vector,
    )  # moved along rows and columns alike


def _bar_px(problem: Problem, camera, vector, points: LinePoints, side, frame) -> np.ndarray:
    """Where the outline's middle or edge (…, n, 2) is expected; of an edge the reach's error is taken for the bar's."""
    one, other = _bar_edges(
        problem, camera, vector, points.place, vector[..., REACH, None] * (side != 0), frame
    )
    half = 0.5 * np.abs(np.sum((one - other) * points.normal, axis=-1, keepdims=True))
    return 0.5 * (one + other) + side[:, None] * half * points.normal


def _contact_block(problem: Problem, moved, curves: Curves, arcs_mm, columns, vector):
    """Touching frames: signed distance from axis to centreline is reach + its error."""
    distance, arc, _ = clearance(curves, bar_axes(problem, moved), arcs_mm)
    distance = distance - problem.rods.reach_mm(arc)
    frames = np.flatnonzero(problem.touching)
    jacobian = np.zeros((len(frames), problem.size))
    for (step, names), row in zip(columns, distance[1:]):
        held = names[frames] >= 0
        jacobian[np.flatnonzero(held), names[frames[held]]] = (row - distance[0])[
            frames[held]
        ] / step
    jacobian[:, REACH] = -1.0
    residual = distance[0, frames] - vector[REACH]
    return residual / CONTACT_SIGMA_MM, jacobian / CONTACT_SIGMA_MM


def _onset_block(problem: Problem, onset: Onset, moved, columns, vector):
    """At the onset of bending the unbent whisker is the reach away from the axis."""
    rest, axis = rest_shape(moved), bar_axis(problem, moved)
    count = len(moved)
    curves = centrelines(
        rest,
        np.zeros((count, 2)),
        np.full(count, problem.wire.length_mm / 2),
        np.full(count, onset.motor_rad) + _later_rad(problem, moved),
        problem.wire,
    )
    distance, arc, _ = clearance(curves, axis)
    distance, sigma_mm = distance - problem.rods.reach_mm(arc), onset.sigma_rad * arc[0]
    jacobian = np.zeros((1, problem.size))
    alone = [*range(BAR + REST), *range(problem.size)[problem.bar_moves]] if columns else []
    for number, (k, (step, _)) in enumerate(zip(alone, columns)):
        jacobian[0, k] = (distance[number + 1] - distance[0]) / step
    jacobian[0, REACH] = -1.0
    residual = distance[:1] - vector[REACH]
    return residual / sigma_mm, jacobian / sigma_mm


def _later_rad(problem: Problem, vector: np.ndarray) -> np.ndarray | float:
    """By how much (…) a bar that gives way is touched later than said."""
    if problem.motion is None or not problem.motion.from_touch:
        return 0.0
    return np.radians(vector[..., problem.bar_moves.start])


def _prior_block(problem: Problem, vector):
    sigma = np.concatenate(
        [
            BAR_PRIOR,
            REST_PRIOR_MM,
            REST_PRIOR_MM,
            [max(problem.rods.reach_sigma_mm, 1e-6)],
            problem.light_px.ravel(),
            [] if problem.motion is None else problem.motion.sigma,
            problem.outline_prior,
            [PULL_PRIOR],
            np.full(problem.size - problem.first_bend, BEND_PRIOR_RAD),
        ]
    )
    return vector / sigma, np.diag(1.0 / sigma)


def robust_weights(linear: Linear, scale: float) -> np.ndarray:
    """Cauchy weights of line points; observations of touch and priors keep theirs."""
    return np.where(linear.is_point, cauchy_weights(linear.residual, scale), 1.0)


def solve(
    problem: Problem, state: State, *, scales: Sequence[float] = _SCALES
) -> tuple[State, np.ndarray]:
    """Gauss–Newton with Cauchy weights that narrow as `scales` (in sigmas) say; ends early once it stands still.

    Returns the state and its covariance (size, size) from noise and priors alone.
    """
    near_jacobian, geometry = None, np.r_[: BAR + REST, problem.bar_moves.start : problem.size]
    for scale in scales:
        linear, state = linearise(problem, state, near_jacobian)
        root = np.sqrt(robust_weights(linear, scale))
        jacobian = linear.jacobian * root[:, None]
        step = np.linalg.lstsq(jacobian, -linear.residual * root, rcond=None)[0]
        step = step * min(
            1.0, _LONGEST_RAD / max(np.max(np.abs(step[problem.first_bend :]), initial=0.0), 1e-9)
        )
        state = replace(state, vector=state.vector + step)
        if scale == scales[-1] and np.linalg.norm(jacobian @ step) < _STILL_SIGMA:
            break
        near_jacobian = (
            linear.jacobian
            if np.all(np.abs(step[geometry]) < _ALIKE * steps(problem)[geometry])
            else None
        )
    else:
        jacobian = weighted_jacobian(problem, state, scales[-1], near_jacobian)
    return state, np.linalg.inv(jacobian.T @ jacobian)


def weighted_jacobian(
    problem: Problem, state: State, scale: float = LAST_SCALE, jacobian: np.ndarray | None = None
) -> np.ndarray:
    """All observations' rows (n, size) over their sigma and robustly weighted: line points, touching, priors.

    jacobian: see `linearise`.
    """
    linear = (
        linear_at(problem, state) if jacobian is None else linearise(problem, state, jacobian)[0]
    )
    return linear.jacobian * np.sqrt(robust_weights(linear, scale))[:, None]
