"""The adjustment: Levenberg–Marquardt with pictures' instants and board poses eliminated.

A picture's instant touches only that picture, and a view's pose only the cameras that saw it. So the
normal equations are formed picture by picture, the instant is eliminated there, then the six of each
view (Schur complement). The work grows linearly with views; what is left to solve is as small as the
cameras are few, and its inverse is the covariance of what is kept, everything eliminated being
marginalised.

Shapes: s pictures ("shots"), G = 16 C + 3 global parameters, V views, p = 25 or 37 parameters that a
picture depends on: 19 of them global, the rest poses of its view and that view's neighbours.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solveh_banded

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
# [1] Keeps a view whose few corners fix no pose solvable; of what is fixed it changes the tenth
# digit. Study: thresholds.py calibration.adjust _RIDGE ….
_RIDGE = 1e-10
# [1] Share of the cost a step: where iterations run out while it falls by less, the rest is below
# a tenth of a sigma. Study: thresholds.py calibration.adjust _NEARLY_AT_REST ….
_NEARLY_AT_REST = 1e-4
# [steps] More than any adjustment here takes; one that runs out of them has not converged. Stated.
_MOST_STEPS = 60
# [1] Of the normal matrix's diagonal, at first (Levenberg–Marquardt); the solution does not depend
# on it, nor on the next two. Derived.
_DAMPED = 1e-4
# [1] At least. Derived.
_LEAST_DAMPED = 1e-12
# [1] At most. Derived.
_MOST_DAMPED = 1e8
# [1] What a step that helps makes of the damping. Derived.
_EASED = 0.1
# [1] What a step that does not help makes of it. Derived.
_STIFFENED = 10.0


@dataclass(frozen=True, eq=False)
class Solution:
    """The state of least cost.

    residual_px (n, 2): seen − predicted. covariance (G, G): of the global parameters with all view
    poses marginalised; rows of held parameters are 0.
    """

    state: BundleState
    residual_px: np.ndarray
    covariance: np.ndarray
    cost: float
    converged: bool


def adjust_bundle(
    state: BundleState,
    seen: Sightings,
    corners_mm: np.ndarray,
    priors: Priors,
    *,
    width: float = np.inf,
    tolerance: float = 1e-8,
) -> Solution:
    """Find the state of least cost from `state`, by Levenberg–Marquardt.

    corners_mm (m, 3): of the board. width: of Cauchy's loss in sigmas, inf for least squares.
    tolerance: relative fall of the cost at which the iteration ends.
    """
    normal = _normal_equations(state, seen, corners_mm, priors, width)
    damping = _DAMPED
    converged = False
    fall = np.inf
    for _ in range(_MOST_STEPS if np.isfinite(normal.cost) else 0):
        steps = _solve_step(normal, priors.free, damping)
        trial_state = state.stepped(*steps)
        trial = _normal_equations(trial_state, seen, corners_mm, priors, width)
        if trial.cost <= normal.cost * (1 + 1e-13):
            fall = (normal.cost - trial.cost) / (1e-12 + normal.cost)
            converged = fall <= tolerance
            state = trial_state
            normal = trial
            damping = max(damping * _EASED, _LEAST_DAMPED)
        else:
            damping *= _STIFFENED
            converged = damping > _MOST_DAMPED
        if converged:
            break
    covariance = _covariance(normal, priors.free)
    converged = converged or fall < _NEARLY_AT_REST
    return Solution(state, normal.residual_px, covariance, normal.cost, converged)


class _Shots(NamedTuple):
    """Pictures, a row each: camera and view (s,), and where their p parameters stand.

    columns (s, 19): among the globals. poses (s, 6 or 18): among all views' (6 V).
    """

    camera: np.ndarray
    view: np.ndarray
    columns: np.ndarray
    poses: np.ndarray


class _Instants(NamedTuple):
    """The eliminated equation of each picture's instant.

    precision, gradient (s,). coupling (s, p): to the picture's other parameters.
    """

    precision: np.ndarray
    gradient: np.ndarray
    coupling: np.ndarray


class _Equations(NamedTuple):
    """Normal equations: A (G, G), a (G,) of the globals; B (G, 6 V); C, c (6 V,) of the views.

    C is kept as its lower band (b, 6 V), C[i − j, j] being row i, column j: views touch only their
    neighbours in time.
    """

    A: np.ndarray
    a: np.ndarray
    B: np.ndarray
    C: np.ndarray
    c: np.ndarray


@dataclass(frozen=True, eq=False)
class _Normal:
    """The cost at a state and, where it is finite, its normal equations."""

    cost: float
    residual_px: np.ndarray
    shots: _Shots | None = None
    instants: _Instants | None = None
    equations: _Equations | None = None


def _normal_equations(
    state: BundleState, seen: Sightings, corners_mm: np.ndarray, priors: Priors, width: float
) -> _Normal:
    """Return the cost and the normal equations at a state."""
    px, J = predict(state, seen, corners_mm)
    residual_px = seen.px - px
    squared = np.sum(residual_px**2, axis=1) / seen.sigma_px**2
    if not np.all(np.isfinite(squared)):
        return _Normal(np.inf, residual_px)
    loss, weight = _cauchy(squared, width)
    root = np.sqrt(weight) / seen.sigma_px
    rows = np.concatenate([J, residual_px[:, :, None]], axis=2) * root[:, None, None]
    shots = _shots(state, seen)
    blocks = _shot_blocks(rows, seen.shot_starts())
    instants, instants_cost = _eliminate_instants(blocks, shots, state, priors)
    equations = _assemble(blocks, shots, state)
    priors_cost = _add_priors(equations, state, priors)
    _hold(equations, np.repeat(~priors.view_free, N_VIEW))
    cost = float(np.sum(loss) + instants_cost + priors_cost)
    return _Normal(cost, residual_px, shots, instants, equations)


def _cauchy(squared: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Return Cauchy's loss, width² log(1 + u²/width²), and its weight, of squared residuals u² (n,).

    For infinite width they are u² and 1.
    """
    if np.isinf(width):
        return squared, np.ones_like(squared)
    ratio = squared / width**2
    return width**2 * np.log1p(ratio), 1.0 / (1.0 + ratio)


def _shots(state: BundleState, seen: Sightings) -> _Shots:
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
    return _Shots(camera, view, columns, poses.reshape(len(starts), -1))


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
    blocks: np.ndarray, shots: _Shots, state: BundleState, priors: Priors
) -> tuple[_Instants, float]:
    """Eliminate each picture's instant from its block (s, p, p + 1), in place.

    Returns the eliminated equations, and the cost of the instants' priors. A picture that gives its
    view its time has no instant of its own.
    """
    precision = np.ones(len(blocks))
    late_s = np.zeros(len(blocks))
    is_free = np.zeros(len(blocks), dtype=bool)
    if state.trajectory is not None and priors.late_sigma_s is not None:
        precision = priors.late_sigma_s[shots.camera] ** -2.0
        late_s = state.instants[shots.view, shots.camera]
        is_free = ~state.trajectory.is_reference(shots.view, shots.camera)
    gradient = (blocks[:, CLOCK, -1] - precision * late_s) * is_free
    coupling = blocks[:, :, CLOCK] * is_free[:, None]
    cost = float(np.sum(precision * late_s**2))
    precision = precision + blocks[:, CLOCK, CLOCK]
    row = np.column_stack([coupling, gradient])
    blocks -= coupling[:, :, None] * row[:, None] / precision[:, None, None]
    return _Instants(precision, gradient, coupling), cost


def _assemble(blocks: np.ndarray, shots: _Shots, state: BundleState) -> _Equations:
    """Add up the blocks (s, p, p + 1) of all pictures where their parameters stand."""
    columns = shots.columns
    poses = shots.poses
    size = N_CAMERA * len(state.lens) + N_BOARD
    size_views = N_VIEW * len(state.T_world_board)
    A = np.zeros((size, size))
    a = np.zeros(size)
    B = np.zeros((size, size_views))
    c = np.zeros(size_views)
    np.add.at(A, (columns[:, :, None], columns[:, None]), blocks[:, :_GLOBAL, :_GLOBAL])
    np.add.at(a, columns, blocks[:, :_GLOBAL, -1])
    np.add.at(B, (columns[:, :, None], poses[:, None]), blocks[:, :_GLOBAL, _GLOBAL:-1])
    np.add.at(c, poses, blocks[:, _GLOBAL:, -1])

    below = poses[:, :, None] - poses[:, None]  # rows below the diagonal
    column = np.broadcast_to(poses[:, None], below.shape)
    is_lower = below >= 0
    C = np.zeros((below.max() + 1, size_views))
    views = blocks[:, _GLOBAL:, _GLOBAL:-1]
    np.add.at(C, (below[is_lower], column[is_lower]), views[is_lower])
    return _Equations(A, a, B, C, c)


def _add_priors(equations: _Equations, state: BundleState, priors: Priors) -> float:
    """Add the observations besides the pictures, in place; return their cost."""
    precision = 1.0 / priors.sigma**2
    residual = np.where(precision == 0, 0.0, priors.mean - state.globals())
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


def _hold(equations: _Equations, held: np.ndarray) -> None:
    """Give the held parameters (6 V,) of the views, and those that nothing depends on, no step."""
    C = equations.C
    held = held | (C[0] == 0)
    equations.B[:, held] = 0.0
    equations.c[held] = 0.0
    C[:, held] = 0.0
    for offset in range(1, len(C)):
        C[offset, :-offset][held[offset:]] = 0.0
    C[0, held] = 1.0


def _solve_step(
    normal: _Normal, free: np.ndarray, damping: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Marquardt's step of the globals (G,), the views (V, 6) and the instants (V, C)."""
    reduced, gradient, CB, Cc = _eliminate_views(normal.equations, free, damping)
    np.einsum("ii->i", reduced)[...] += damping * np.diag(normal.equations.A)[free]
    step = np.zeros(len(free))
    step[free] = _solve_scaled(reduced, gradient)
    view_steps = Cc - CB @ step[free]

    shots = normal.shots
    instants = normal.instants
    others = np.hstack([step[shots.columns], view_steps[shots.poses]])  # (s, p)
    gradient = instants.gradient - np.sum(instants.coupling * others, axis=1)
    instant_steps = np.zeros((len(view_steps) // N_VIEW, len(free) // N_CAMERA))
    instant_steps[shots.view, shots.camera] = gradient / instants.precision
    return step, view_steps.reshape(-1, N_VIEW), instant_steps


def _eliminate_views(
    equations: _Equations, free: np.ndarray, damping: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Eliminate the views' poses by the Schur complement.

    Returns the reduced matrix (F, F) and gradient (F,) of the free globals, C⁻¹Bᵀ (6 V, F) and
    C⁻¹c (6 V,).
    """
    A, a, B, C, c = equations
    B = B[free]
    raised = C.copy()
    raised[0] *= (1.0 + damping) * (1.0 + _RIDGE)
    solved = solveh_banded(raised, np.column_stack([B.T, c]), lower=True, check_finite=False)
    CB = solved[:, :-1]
    Cc = solved[:, -1]
    return A[np.ix_(free, free)] - B @ CB, a[free] - B @ Cc, CB, Cc


def _unit_scale(matrix: np.ndarray) -> np.ndarray:
    """Return the scale of each row and column with which the diagonal is 1: fx is 10³, k1 10⁻¹."""
    diagonal = np.diag(matrix)
    return 1.0 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))


def _solve_scaled(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Solve with rows and columns scaled to a unit diagonal."""
    if not len(vector):
        return vector
    scale = _unit_scale(matrix)
    unit = matrix * np.outer(scale, scale)
    return scale * np.linalg.lstsq(unit, scale * vector, rcond=1e-14)[0]


def _covariance(normal: _Normal, free: np.ndarray) -> np.ndarray:
    """Return the covariance (G, G) of the globals, all poses and instants being marginalised."""
    covariance = np.zeros((len(free), len(free)))
    if normal.equations is not None and free.any():
        reduced, *_ = _eliminate_views(normal.equations, free)
        scale = np.outer(_unit_scale(reduced), _unit_scale(reduced))
        inverse = np.linalg.pinv(reduced * scale, rcond=1e-14, hermitian=True)
        covariance[np.ix_(free, free)] = inverse * scale
    return covariance
