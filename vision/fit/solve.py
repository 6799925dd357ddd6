"""One reprojection fit over all cameras and frames of a whisk: bar, rest shape, and the bend in
each frame.

Shared by all frames: the bar's axis and the whisker's rest shape. Each touching frame adds the two
components of its bend and one observation, that axis and centreline are bar radius + whisker radius
apart. What the pictures may be wrong in as a whole (a shift of the seen line from the rod's axis,
by light and lens) enters as an offset and a tilt per camera with a prior, and so ends up in the
stated uncertainty.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import groupby

import numpy as np

from vision.fit.bend_onset import Onset
from vision.fit.blocks import BAR_MODES_PX, BAR_OFFSET_PX, Block, columns_of
from vision.fit.differences import Perturbation, perturbed
from vision.fit.problem import (
    BAR_TILT_ARM_MM,
    CONTACT_SIGMA_MM,
    Problem,
    State,
    bar_axes,
    bar_axis,
    curves_of,
    rest_shape,
    shifts_mm,
    wire_modes,
)
from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves, centrelines
from vision.geometry.contact import clearance
from vision.geometry.grazing import sights_beside
from vision.geometry.newton import cauchy_weights
from vision.geometry.silhouette import edges
from vision.wire.points import LinePoints, Observed

# [sigma] Width of the Cauchy weights once the state is near: 95 % efficient on Gaussian noise at
# 2.4, more at 4. Study: coverage.py points.
LAST_SCALE = 4.0
# [steps] Of differences (0.1 mm, 1 mrad; bends 10 mrad): a state that moved by less keeps its
# Jacobian. Study: gradients.py.
_ALIKE = 1000.0
# [sigma] A step that moves all parameters together by less is the last. Derived.
_STILL_SIGMA = 0.01
# [sigmas] Of the Cauchy weights, round by round: wide while the state is still off by many. Set
# by eye.
_SCALES = (30.0, 10.0, *[LAST_SCALE] * 4)
# [rad] Of bend in one step: the rod's shape is not linear beyond. Stated.
_LONGEST_RAD = 0.3

# Residuals (n,) and Jacobian rows (n, size) of some observations, over their sigma.
_Part = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Linear:
    """Residuals (n,) over their sigma, their Jacobian (n, size), and which are line points (robust
    weights).
    """

    residual: np.ndarray
    jacobian: np.ndarray
    is_point: np.ndarray


def linearise(
    problem: Problem, state: State, jacobian: np.ndarray | None = None
) -> tuple[Linear, State]:
    """Return residuals and Jacobian at a state, and the state with its contact arcs brought up to
    date.

    jacobian: that of a state nearby, taken as it is, which saves nine tenths of the work.
    """
    vector = state.vector
    if jacobian is None:
        moved, moves = perturbed(problem, vector)
    else:
        moved, moves = vector[None], []
    curves, arcs = curves_of(problem, moved, state.arcs_mm)
    parts = []
    for (camera, on_wire), group in groupby(problem.seen, key=_camera_and_rod):
        if on_wire:
            parts.append(_wire_part(problem, camera, list(group), curves, moves, vector))
        else:
            parts.append(_bar_part(problem, camera, list(group), bool(moves), vector))
    parts.append(_contact_part(problem, moved, curves, arcs, moves, vector))
    parts.append(_prior_part(problem, vector))
    if problem.onset is not None:
        parts.append(_onset_part(problem, problem.onset, moved, moves, vector))
    residual = np.concatenate([part[0] for part in parts])
    if jacobian is None:
        jacobian = np.concatenate([part[1] for part in parts])
    is_point = np.arange(len(residual)) < problem.contact_rows.start
    return Linear(residual, jacobian, is_point), replace(state, arcs_mm=arcs[0])


def _camera_and_rod(seen: Observed) -> tuple[int, bool]:
    """Return the camera of an observation and whether it is of the wire: those alike are predicted
    together.
    """
    return seen.camera, seen.frame >= 0


@lru_cache(maxsize=1)
def linear_at(problem: Problem, state: State) -> Linear:
    """Return `linearise`, kept for the next call with the same arguments: each of a fit's
    uncertainties needs it.
    """
    return linearise(problem, state)[0]


def _together(group: Sequence[Observed]) -> LinePoints:
    """Return the line points of all observations of a group."""
    points = [seen.points for seen in group]
    names = LinePoints.__dataclass_fields__
    fields = {name: np.concatenate([getattr(p, name) for p in points]) for name in names}
    return LinePoints(**fields)


def _of_each_point(group: Sequence[Observed], values: Sequence[int]) -> np.ndarray:
    """Return one value of each observation (n,) for each of its points."""
    return np.repeat(values, [len(seen.points) for seen in group])


def _wire_part(
    problem: Problem,
    number: int,
    group: Sequence[Observed],
    curves: Curves,
    moves: Sequence[Perturbation],
    vector: np.ndarray,
) -> _Part:
    """Return residuals and Jacobian rows of one camera's points of the wire, all frames."""
    points = _together(group)
    frame = _of_each_point(group, [seen.frame for seen in group])
    positions = curves.at_one_each(frame, points.place)  # (copies, n, 3) mm
    camera = problem.cameras.cameras[number]
    px, by_point, _ = camera.project_with_jacobians(positions[0])
    along_normal = np.einsum("ni,nij->nj", points.normal, by_point)
    change_px = np.einsum("cnj,nj->cn", positions[1:] - positions[0], along_normal)
    jacobian = np.zeros((len(points), problem.size))
    row = np.arange(len(points))
    for move, by_step in zip(moves, change_px):
        column = move.column[frame]
        moves_point = column >= 0
        jacobian[row[moves_point], column[moves_point]] = by_step[moves_point] / move.step
    swing_rad = problem.motor_rad
    modes = wire_modes(problem.wire.length_mm, points.place, swing_rad[frame], swing_rad)
    modes = np.hstack([modes, points.shared_px])
    return _over_sigma(points, px, jacobian, problem.blocks.wire_offsets[number], modes, vector)


def _over_sigma(
    points: LinePoints,
    px: np.ndarray,
    jacobian: np.ndarray,
    offsets: Block,
    modes: np.ndarray,
    vector: np.ndarray,
) -> _Part:
    """Return residuals of points predicted at px (n, 2), and their Jacobian, over sigma.

    modes (n, k): shapes in which the whole line may be off, by the parameters of the block
    `offsets`.
    """
    jacobian[:, offsets.slice] = modes
    residual = np.sum(points.normal * (px - points.px), axis=1) + modes @ vector[offsets.slice]
    return residual / points.sigma_px, jacobian / points.sigma_px[:, None]


def _bar_part(
    problem: Problem,
    number: int,
    group: Sequence[Observed],
    with_jacobian: bool,
    vector: np.ndarray,
) -> _Part:
    """Return residuals and Jacobian rows of one camera's points of the bar: of its middle, or of an
    edge.
    """
    points = _together(group)
    if problem.is_rounded:
        return _outline_part(problem, number, points, with_jacobian, vector)
    side = _of_each_point(group, [seen.side for seen in group])
    frame = _of_each_point(group, [seen.bar_in for seen in group])
    blocks = problem.blocks
    wider = [blocks.reach] if np.any(side) else []
    moved_blocks = [blocks.bar_axis, *wider, blocks.motion] if with_jacobian else []
    columns, moved = _moved_alone(problem, moved_blocks, vector)
    camera = problem.cameras.cameras[number]
    px = _bar_px(problem, camera, moved, points, side, frame)
    jacobian = np.zeros((len(points), problem.size))
    change_px = np.einsum("knj,nj->nk", px[1:] - px[0], points.normal)
    jacobian[:, columns] = change_px / blocks.steps[columns]
    modes = np.stack([np.ones(len(points)), points.place / BAR_TILT_ARM_MM], axis=1)
    return _over_sigma(points, px[0], jacobian, blocks.bar_offsets[number], modes, vector)


def _moved_alone(
    problem: Problem, blocks: Sequence[Block], vector: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the columns (k,) of some blocks, and the vector (k + 1, size) as it is and with each
    of them moved.
    """
    columns = columns_of(*blocks)
    moved = np.tile(vector, (len(columns) + 1, 1))
    moved[np.arange(1, len(moved)), columns] += problem.blocks.steps[columns]
    return columns, moved


def _bar_px(
    problem: Problem,
    camera: Camera,
    vector: np.ndarray,
    points: LinePoints,
    side: np.ndarray,
    frame: np.ndarray,
) -> np.ndarray:
    """Return where the outline's middle or edge (…, n, 2) is expected; of an edge the reach's error
    widens the bar.

    side, frame (n,): of each point, `Observed.side` and, of a bar that moves, the frame in which it
    is seen.
    """
    axis = bar_axis(problem, vector)
    direction = axis.direction[..., None, :]
    middle_mm = axis.point_mm[..., None, :] + points.place[:, None] * direction
    if problem.motion is not None:
        middle_mm = middle_mm + shifts_mm(problem, vector)[..., frame, :]
    shape = middle_mm.shape  # (…, n, 3)
    directions = np.broadcast_to(direction, shape)
    wider_mm = vector[..., problem.blocks.reach.slice] * (side != 0)
    radius_mm = np.broadcast_to(problem.rods.bar.radius_mm + wider_mm, shape[:-1])
    one, other = edges(
        camera, middle_mm.reshape(-1, 3), directions.reshape(-1, 3), radius_mm.ravel()
    )
    one = one.reshape(*shape[:-1], 2)
    other = other.reshape(*shape[:-1], 2)
    half_px = 0.5 * np.abs(np.sum((one - other) * points.normal, axis=-1, keepdims=True))
    return 0.5 * (one + other) + side[:, None] * half_px * points.normal


def _outline_part(
    problem: Problem, number: int, points: LinePoints, with_jacobian: bool, vector: np.ndarray
) -> _Part:
    """Return residuals and Jacobian rows of a rounded object's outline: how far its sights pass
    outside of it.
    """
    blocks = problem.blocks
    moved_blocks = [blocks.bar_axis, blocks.shift_along] if with_jacobian else []
    columns, moved = _moved_alone(problem, moved_blocks, vector)
    camera = problem.cameras.cameras[number]
    reach = blocks.reach.start
    grazing = sights_beside(camera, bar_axis(problem, moved), points.px, points.place)
    px_per_mm = grazing.px_per_mm(camera, points.normal)
    outside_mm = grazing.outside_mm - problem.rods.bar.radius_mm - vector[reach]
    off_px = px_per_mm * outside_mm  # (copies, n)
    outward = blocks.outline_bias.start + number
    jacobian = np.zeros((len(points), problem.size))
    jacobian[:, columns] = -(off_px[1:] - off_px[0]).T / blocks.steps[columns]
    jacobian[:, reach] = px_per_mm
    jacobian[:, outward] = 1.0
    off_px[0] -= vector[outward]
    px = points.px - off_px[0][:, None] * points.normal
    modes = points.normal * (BAR_OFFSET_PX / BAR_MODES_PX)  # along rows and columns alike
    return _over_sigma(points, px, jacobian, blocks.bar_offsets[number], modes, vector)


def _contact_part(
    problem: Problem,
    moved: np.ndarray,
    curves: Curves,
    arcs_mm: np.ndarray,
    moves: Sequence[Perturbation],
    vector: np.ndarray,
) -> _Part:
    """Return residuals and Jacobian rows of touching frames: distance from axis to centreline is
    reach + its error.
    """
    distance, arc, _ = clearance(curves, bar_axes(problem, moved), arcs_mm)
    gap = distance - problem.rods.reach_mm(arc)  # (copies, f) mm
    frames = np.flatnonzero(problem.touching)
    reach = problem.blocks.reach.start
    jacobian = np.zeros((len(frames), problem.size))
    for move, moved_gap in zip(moves, gap[1:]):
        column = move.column[frames]
        row = np.flatnonzero(column >= 0)
        change = (moved_gap - gap[0])[frames[row]]
        jacobian[row, column[row]] = change / move.step
    jacobian[:, reach] = -1.0
    residual = gap[0, frames] - vector[reach]
    return residual / CONTACT_SIGMA_MM, jacobian / CONTACT_SIGMA_MM


def _onset_part(
    problem: Problem,
    onset: Onset,
    moved: np.ndarray,
    moves: Sequence[Perturbation],
    vector: np.ndarray,
) -> _Part:
    """Return residual and Jacobian row of the onset: the unbent whisker is then the reach away from
    the axis.
    """
    count = len(moved)
    curves = centrelines(
        rest_shape(problem, moved),
        np.zeros((count, 2)),
        np.full(count, problem.wire.length_mm / 2),
        np.full(count, onset.motor_rad) + _later_rad(problem, moved),
        problem.wire,
    )
    distance, arc, _ = clearance(curves, bar_axis(problem, moved))
    gap = distance - problem.rods.reach_mm(arc)  # (copies,) mm
    sigma_mm = onset.sigma_rad * arc[0]
    reach = problem.blocks.reach.start
    jacobian = np.zeros((1, problem.size))
    for move, moved_gap in zip(moves, gap[1:]):
        if move.is_shared:
            jacobian[0, move.column[0]] = (moved_gap - gap[0]) / move.step
    jacobian[0, reach] = -1.0
    residual = gap[:1] - vector[reach]
    return residual / sigma_mm, jacobian / sigma_mm


def _later_rad(problem: Problem, vector: np.ndarray) -> np.ndarray | float:
    """Return by how much (…) a bar that gives way is touched later than `Gives` states."""
    if problem.motion is None or not problem.motion.from_touch:
        return 0.0
    return np.radians(vector[..., problem.blocks.motion.start])


def _prior_part(problem: Problem, vector: np.ndarray) -> _Part:
    """Return residuals and Jacobian rows of the parameters' priors."""
    sigma = problem.blocks.prior_sigma
    return vector / sigma, np.diag(1.0 / sigma)


def robust_weights(linear: Linear, scale: float) -> np.ndarray:
    """Return Cauchy weights (n,) of line points, and 1 of touching and priors."""
    return np.where(linear.is_point, cauchy_weights(linear.residual, scale), 1.0)


def solve(
    problem: Problem, state: State, *, scales: Sequence[float] = _SCALES
) -> tuple[State, np.ndarray]:
    """Return the fit's state and its covariance (size, size) from noise and priors alone.

    Gauss-Newton with Cauchy weights that narrow as `scales` (in sigmas) say; it ends early once a
    step is negligible.
    """
    blocks = problem.blocks
    geometry = columns_of(blocks.bar_axis, blocks.rest_shape, blocks.friction, blocks.bends)
    geometry = np.concatenate([geometry, blocks.placement])
    near = _ALIKE * blocks.steps[geometry]
    near_jacobian = None
    for scale in scales:
        linear, state = linearise(problem, state, near_jacobian)
        root = np.sqrt(robust_weights(linear, scale))
        jacobian = linear.jacobian * root[:, None]
        step = np.linalg.lstsq(jacobian, -linear.residual * root, rcond=None)[0]
        most_bend_rad = np.max(np.abs(step[blocks.bends.slice]), initial=0.0)
        step = step * min(1.0, _LONGEST_RAD / max(most_bend_rad, 1e-9))
        state = replace(state, vector=state.vector + step)
        if scale == scales[-1] and np.linalg.norm(jacobian @ step) < _STILL_SIGMA:
            break
        is_near = np.all(np.abs(step[geometry]) < near)
        near_jacobian = linear.jacobian if is_near else None
    else:
        jacobian = weighted_jacobian(problem, state, scales[-1], near_jacobian)
    return state, np.linalg.inv(jacobian.T @ jacobian)


def weighted_jacobian(
    problem: Problem, state: State, scale: float = LAST_SCALE, jacobian: np.ndarray | None = None
) -> np.ndarray:
    """Return all observations' rows (n, size) over their sigma and robustly weighted: line points,
    touching, priors.

    jacobian: see `linearise`.
    """
    if jacobian is None:
        linear = linear_at(problem, state)
    else:
        linear, _ = linearise(problem, state, jacobian)
    return linear.jacobian * np.sqrt(robust_weights(linear, scale))[:, None]
