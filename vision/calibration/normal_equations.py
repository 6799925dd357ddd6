"""The normal equations of an adjustment, formed picture by picture with its instant eliminated.

A picture's instant touches only that picture. Shapes: s pictures ("shots"), G = 16 C + 4 global
parameters, V views, p = 26 or 38 parameters that a picture depends on: 20 of them global, the rest
poses of its view and that view's neighbours.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vision.calibration.bundle import (
    CLOCK,
    N_BOARD,
    N_CAMERA,
    N_VIEW,
    BundleState,
    Priors,
    Sightings,
    predict,
)
from vision.geometry.rotation import pose_difference

_GLOBAL = N_CAMERA + N_BOARD


class Shots(NamedTuple):
    """Pictures, a row each: camera and view (s,), and where their p parameters stand.

    columns (s, 20): among the globals. poses (s, 6 or 18): among all views' (6 V).
    """

    camera: np.ndarray
    view: np.ndarray
    columns: np.ndarray
    poses: np.ndarray


class Instants(NamedTuple):
    """The eliminated equation of each picture's instant.

    precision, gradient (s,). coupling (s, p): to the picture's other parameters.
    """

    precision: np.ndarray
    gradient: np.ndarray
    coupling: np.ndarray

    @staticmethod
    def none(pictures: int, parameters: int) -> "Instants":
        """Return the equations of pictures that have no instants of their own."""
        coupling = np.zeros((pictures, parameters))
        return Instants(np.ones(pictures), np.zeros(pictures), coupling)


class Equations(NamedTuple):
    """The normal equations: A (G, G), a (G,) of the globals; B (G, 6 V); C, c (6 V,) of the views.

    C is kept as its lower band (b, 6 V), C[i − j, j] being row i, column j: views touch only their
    neighbours in time.
    """

    A: np.ndarray
    a: np.ndarray
    B: np.ndarray
    C: np.ndarray
    c: np.ndarray


@dataclass(frozen=True, eq=False)
class Normal:
    """The cost at a state and, where it is finite, its normal equations."""

    cost: float
    residual_px: np.ndarray
    shots: Shots | None = None
    instants: Instants | None = None
    equations: Equations | None = None


def normal_equations(
    state: BundleState, seen: Sightings, corners_mm: np.ndarray, priors: Priors, width: float
) -> Normal:
    """Return the cost and the normal equations at a state."""
    px, J = predict(state, seen, corners_mm)
    residual_px = seen.px - px
    squared = np.sum(residual_px**2, axis=1) / seen.sigma_px**2
    if not np.all(np.isfinite(squared)):
        return Normal(np.inf, residual_px)
    loss, weight = _cauchy(squared, width)
    rows = _weighted(J, residual_px, np.sqrt(weight) / seen.sigma_px)
    shots = _shots(state, seen)
    blocks = _shot_blocks(rows, seen.shot_starts())
    instants, cost = _eliminate_instants(blocks, shots, state, priors)
    equations, prior_cost = _with_priors(_assemble(blocks, shots, state), state, priors)
    cost += np.sum(loss) + prior_cost
    return Normal(float(cost), residual_px, shots, instants, equations)


def _cauchy(squared: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Return Cauchy's loss, width² log(1 + u²/width²), and weight, of squared residuals u² (n,).

    For infinite width they are u² and 1.
    """
    if np.isinf(width):
        return squared, np.ones_like(squared)
    ratio = squared / width**2
    return width**2 * np.log1p(ratio), 1.0 / (1.0 + ratio)


def _weighted(J: np.ndarray, residual: np.ndarray, root: np.ndarray) -> np.ndarray:
    """Return J (n, 2, p) with the residuals (n, 2) as last column, times the weights' roots (n,)."""
    return np.dstack([J, residual]) * root[:, None, None]


def _shots(state: BundleState, seen: Sightings) -> Shots:
    """Return the pictures of the sightings, and where their parameters stand."""
    starts = seen.shot_starts()
    camera = seen.camera[starts]
    view = seen.view[starts]
    of_camera = N_CAMERA * camera[:, None] + np.arange(N_CAMERA)
    of_board = N_CAMERA * len(state.lens) + np.arange(N_BOARD)
    columns = np.hstack([of_camera, np.tile(of_board, (len(starts), 1))])
    views = view[:, None]
    if state.trajectory is not None:
        views = np.hstack([views, state.trajectory.neighbours[view]])
    poses = N_VIEW * views[:, :, None] + np.arange(N_VIEW)
    return Shots(camera, view, columns, poses.reshape(len(starts), -1))


def _shot_blocks(rows: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Return JᵀJ and Jᵀr of each picture, (s, p, p + 1), from weighted rows (n, 2, p + 1).

    Pictures are filled up with zeros to one length: one product for all is ten times as fast as one
    a corner.
    """
    count = np.diff(np.append(starts, len(rows)))
    shot = np.repeat(np.arange(len(starts)), count)
    padded = np.zeros((len(starts), count.max(), *rows.shape[1:]))
    padded[shot, np.arange(len(rows)) - starts[shot]] = rows
    padded = padded.reshape(len(starts), -1, rows.shape[2])
    return np.swapaxes(padded[:, :, :-1], 1, 2) @ padded


def _eliminate_instants(
    blocks: np.ndarray, shots: Shots, state: BundleState, priors: Priors
) -> tuple[Instants, float]:
    """Eliminate each picture's instant from its block (s, p, p + 1), in place.

    Returns the eliminated equations, and the cost of the instants' priors. A picture that gives its
    view its time has no instant of its own.
    """
    if state.trajectory is None or priors.late_sigma_s is None:
        return Instants.none(*blocks.shape[:2]), 0.0
    is_free = ~state.trajectory.is_reference(shots.view, shots.camera)
    late_s = state.instants[shots.view, shots.camera]
    prior = priors.late_sigma_s[shots.camera] ** -2.0  # precision, 1/s²
    precision = blocks[:, CLOCK, CLOCK] + prior
    gradient = is_free * (blocks[:, CLOCK, -1] - prior * late_s)
    instants = Instants(precision, gradient, is_free[:, None] * blocks[:, :, CLOCK])
    _take_off(blocks, instants)
    return instants, float(np.sum(prior * late_s**2))


def _take_off(blocks: np.ndarray, instants: Instants) -> None:
    """Subtract from the pictures' blocks (s, p, p + 1) what their instants explain, in place."""
    coupling = instants.coupling
    row = np.column_stack([coupling, instants.gradient])
    blocks -= coupling[:, :, None] * row[:, None] / instants.precision[:, None, None]


def _assemble(blocks: np.ndarray, shots: Shots, state: BundleState) -> Equations:
    """Add up the blocks (s, p, p + 1) of all pictures where their parameters stand."""
    size = N_CAMERA * len(state.lens) + N_BOARD
    size_views = N_VIEW * len(state.T_world_board)
    columns = shots.columns
    poses = shots.poses
    rows = blocks[:, :_GLOBAL]
    by_globals = (columns[:, :, None], columns[:, None])
    by_views = (columns[:, :, None], poses[:, None])
    return Equations(
        A=_sum_at((size, size), by_globals, rows[:, :, :_GLOBAL]),
        a=_sum_at(size, columns, rows[:, :, -1]),
        B=_sum_at((size, size_views), by_views, rows[:, :, _GLOBAL:-1]),
        C=_lower_band(blocks[:, _GLOBAL:, _GLOBAL:-1], poses, size_views),
        c=_sum_at(size_views, poses, blocks[:, _GLOBAL:, -1]),
    )


def _sum_at(shape, index, values: np.ndarray) -> np.ndarray:
    """Return an array of this shape with the values added up at their indices, 0 elsewhere."""
    total = np.zeros(shape)
    np.add.at(total, index, values)
    return total


def _lower_band(blocks: np.ndarray, poses: np.ndarray, size: int) -> np.ndarray:
    """Add up blocks (s, q, q) at rows and columns `poses` (s, q) to a lower band (b, size)."""
    below = poses[:, :, None] - poses[:, None]  # rows below the diagonal
    column = np.broadcast_to(poses[:, None], below.shape)
    is_lower = below >= 0
    index = (below[is_lower], column[is_lower])
    return _sum_at((below.max() + 1, size), index, blocks[is_lower])


def _with_priors(
    equations: Equations, state: BundleState, priors: Priors
) -> tuple[Equations, float]:
    """Return the equations, changed in place, with the priors added and views held, and their cost."""
    cost = _add_priors(equations, state, priors)
    _hold(equations, np.repeat(~priors.view_free, N_VIEW))
    return equations, cost


def _add_priors(equations: Equations, state: BundleState, priors: Priors) -> float:
    """Add the observations besides the pictures, in place; return their cost."""
    precision = 1.0 / priors.sigma**2
    residual = np.where(precision == 0, 0.0, priors.mean - state.global_values())
    equations.A[np.diag_indices(len(residual))] += precision
    equations.a[:] += precision * residual
    cost = np.sum(precision * residual**2)
    view = priors.pose_view
    if view is not None and priors.view_free[view]:
        rows = slice(N_VIEW * view, N_VIEW * (view + 1))
        precision = 1.0 / priors.pose_sigma**2
        residual = -pose_difference(priors.pose_T, state.T_world_board[view])
        equations.C[0, rows] += precision
        equations.c[rows] += precision * residual
        cost += np.sum(precision * residual**2)
    return float(cost)


def _hold(equations: Equations, held: np.ndarray) -> None:
    """Give the held parameters (6 V,) of the views, and those that nothing depends on, no step."""
    C = equations.C
    held = held | (C[0] == 0)
    equations.B[:, held] = 0.0
    equations.c[held] = 0.0
    C[:, held] = 0.0
    for offset in range(1, len(C)):
        C[offset, :-offset][held[offset:]] = 0.0
    C[0, held] = 1.0
