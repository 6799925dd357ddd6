"""The adjustment: Levenberg–Marquardt with pictures' instants and board poses eliminated.

A picture's instant touches only that picture, and a view's pose only the cameras that saw it. So the normal
equations are formed picture by picture, the instant is eliminated there, then the six of each view (Schur
complement). The work grows linearly with views; what is left to solve is as small as the cameras are few,
and its inverse is the covariance of what is kept, everything eliminated being marginalised.
"""

from dataclasses import dataclass

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
# [1] Of the normal matrix's diagonal, at first, at least and at most (Levenberg–Marquardt); the
# solution does not hang on them. Derived.
_DAMPED, _LEAST_DAMPED, _MOST_DAMPED = 1e-4, 1e-12, 1e8
# [1] What a step that helps, or does not, makes of the damping. Derived.
_EASED, _STIFFENED = 0.1, 10.0


@dataclass(frozen=True, eq=False)
class Solution:
    """The state of least cost, its residuals (n, 2) px (seen − predicted), and the covariance (16 C + 3
    squared) of the global parameters with all view poses marginalised; rows of held parameters are 0."""

    state: BundleState
    residual_px: np.ndarray
    covariance: np.ndarray
    cost: float
    iterations: int
    converged: bool


def robust_weight(squared: np.ndarray, width: float) -> np.ndarray:
    """Cauchy's weight of a corner whose squared residual, in sigmas, is `squared`; all 1 for infinite width."""
    return 1.0 / (1.0 + squared / width**2)


def robust_cost(squared: np.ndarray, width: float) -> np.ndarray:
    """Cauchy's cost, width² log(1 + u²/width²); the square itself for infinite width."""
    return squared if np.isinf(width) else width**2 * np.log1p(squared / width**2)


@dataclass(frozen=True, eq=False)
class _Shots:
    """Pictures: camera, view (s,); columns among the globals (s, 19) and among all views' (s, 6 or 18); and what
    eliminating each one's instant left: its weight and gradient (s,), its coupling to those columns (s, 25 or 37)."""

    camera: np.ndarray
    view: np.ndarray
    columns: np.ndarray
    poses: np.ndarray
    weight: np.ndarray
    gradient: np.ndarray
    coupling: np.ndarray


@dataclass(frozen=True, eq=False)
class _Normal:
    """Normal equations: A (G, G), a (G,) of the globals; B (G, 6 V); C, c (6 V,) of the views.

    C is kept as its lower band (b, 6 V), C[i − j, j] being row i, column j: views touch only their neighbours in time.
    """

    A: np.ndarray
    a: np.ndarray
    B: np.ndarray
    C: np.ndarray
    c: np.ndarray
    shots: _Shots
    cost: float
    residual_px: np.ndarray


def _normal_equations(
    state: BundleState, seen: Sightings, corners_mm: np.ndarray, priors: Priors, width: float
) -> _Normal:
    px, J = predict(state, seen, corners_mm)
    residual = seen.px - px
    squared = np.sum(residual**2, axis=1) / seen.sigma_px**2
    if not np.all(np.isfinite(squared)):
        return _Normal(*(None,) * 6, cost=np.inf, residual_px=residual)
    root = np.sqrt(robust_weight(squared, width)) / seen.sigma_px
    weighed = np.concatenate([J, residual[:, :, None]], axis=2) * root[:, None, None]
    blocks = _shot_blocks(weighed, seen.shot_starts())
    shots, blocks, late_cost = _without_instants(blocks, state, seen, priors)
    parts = _assemble(blocks, shots, state)
    cost = float(np.sum(robust_cost(squared, width)) + late_cost)
    return _with_priors(parts, shots, cost, residual, state, priors)


def _shot_blocks(weighed: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """JᵀJ and Jᵀr of each picture, (s, p, p + 1), from the rows (n, 2, p + 1) of all corners.

    Pictures are filled up with zeros to one length: one product for all is ten times as fast as one a corner.
    """
    count = np.diff(np.append(starts, len(weighed)))
    padded = np.zeros((len(starts), count.max(), *weighed.shape[1:]))
    padded[
        np.repeat(np.arange(len(starts)), count), np.arange(len(weighed)) - np.repeat(starts, count)
    ] = weighed
    padded = padded.reshape(len(starts), -1, weighed.shape[2])
    return np.swapaxes(padded[:, :, :-1], 1, 2) @ padded


def _without_instants(blocks: np.ndarray, state: BundleState, seen: Sightings, priors: Priors):
    """Eliminates each picture's instant from its block (25 × 26 or 37 × 38, the last column being the gradient)."""
    starts = seen.shot_starts()
    camera, view = seen.camera[starts], seen.view[starts]
    columns, poses = _columns(state, camera, view)
    if state.trajectory is None or priors.late_sigma_s is None:
        nothing = np.zeros(len(starts))
        return (
            _Shots(camera, view, columns, poses, nothing + 1, nothing, 0 * blocks[:, :, 0]),
            blocks,
            0.0,
        )
    information, late = priors.late_sigma_s[camera] ** -2.0, state.instants[view, camera]
    loose = ~state.trajectory.is_reference(view, camera)
    weight = blocks[:, CLOCK, CLOCK] + information
    gradient = (blocks[:, CLOCK, -1] - information * late) * loose
    coupling = blocks[:, :, CLOCK] * loose[:, None]
    lost = coupling[:, :, None] * np.concatenate([coupling, gradient[:, None]], axis=1)[:, None]
    shots = _Shots(camera, view, columns, poses, weight, gradient, coupling)
    return shots, blocks - lost / weight[:, None, None], float(np.sum(information * late**2))


def _columns(
    state: BundleState, camera: np.ndarray, view: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where a picture's parameters stand among the globals (s, 19) and among the views' (s, 6 or 18)."""
    size = N_CAMERA * len(state.lens)
    own = N_CAMERA * camera[:, None] + np.arange(N_CAMERA)
    shared = np.broadcast_to(size + np.arange(N_BOARD), (len(view), N_BOARD))
    views = view[:, None]
    if state.trajectory is not None:
        views = np.concatenate([views, state.trajectory.neighbours[view]], axis=1)
    poses = (N_VIEW * views[:, :, None] + np.arange(N_VIEW)).reshape(len(view), -1)
    return np.concatenate([own, shared], axis=1), poses


def _assemble(blocks: np.ndarray, shots: _Shots, state: BundleState) -> tuple[np.ndarray, ...]:
    """Adds each picture's block where its parameters stand."""
    columns, poses, m = shots.columns, shots.poses, _GLOBAL
    size, n = N_CAMERA * len(state.lens) + N_BOARD, N_VIEW * len(state.T_world_board)
    apart = poses[:, :, None] - poses[:, None, :]
    A, a, B, c = np.zeros((size, size)), np.zeros(size), np.zeros((size, n)), np.zeros(n)
    C = np.zeros((int(apart.max()) + 1, n))
    np.add.at(A, (columns[:, :, None], columns[:, None, :]), blocks[:, :m, :m])
    np.add.at(a, columns, blocks[:, :m, -1])
    np.add.at(B, (columns[:, :, None], poses[:, None, :]), blocks[:, :m, m:-1])
    lower = apart >= 0
    np.add.at(
        C,
        (apart[lower], np.broadcast_to(poses[:, None, :], apart.shape)[lower]),
        blocks[:, m:, m:-1][lower],
    )
    np.add.at(c, poses, blocks[:, m:, -1])
    return A, a, B, C, c


def _with_priors(
    parts, shots: _Shots, cost: float, residual, state: BundleState, priors: Priors
) -> _Normal:
    """Adds the observations beside the pictures, and takes out what is held."""
    A, a, B, C, c = parts
    weight = 1.0 / priors.sigma**2
    miss = priors.mean - state.globals()
    miss[weight == 0] = 0.0
    A = A + np.diag(weight)
    a = a + weight * miss
    cost += float(np.sum(weight * miss**2))
    if priors.pose_view is not None and priors.view_free[priors.pose_view]:
        rows = N_VIEW * priors.pose_view + np.arange(N_VIEW)
        information = 1.0 / priors.pose_sigma**2
        off = -pose_difference(priors.pose_T, state.T_world_board[priors.pose_view])
        C[0, rows] += information
        c[rows] += information * off
        cost += float(np.sum(information * off**2))
    _hold(B, C, c, np.repeat(~priors.view_free, N_VIEW) | (C[0] == 0))
    return _Normal(A, a, B, C, c, shots, cost, residual)


def _hold(B: np.ndarray, C: np.ndarray, c: np.ndarray, held: np.ndarray) -> None:
    """Makes the held (6 V,) parameters of the views stand by themselves, with no step to take."""
    B[:, held], c[held], C[:, held] = 0.0, 0.0, 0.0
    for offset in range(1, len(C)):
        C[offset, :-offset][held[offset:]] = 0.0
    C[0, held] = 1.0


def _solve_step(
    normal: _Normal, priors: Priors, damping: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Marquardt's step of the globals (G,), the views (V, 6) and the instants (V, C)."""
    free = priors.free
    C = normal.C.copy()
    C[0] *= 1.0 + damping
    reduced, gradient, CB, Cc = _eliminate(normal, C, free)
    np.einsum("ii->i", reduced)[...] += damping * np.diag(normal.A)[free]
    step = np.zeros(len(free))
    step[free] = _scaled_solve(reduced, gradient)
    views = Cc - CB @ step[free]
    instants = _instant_steps(normal.shots, step, views, len(free) // N_CAMERA)
    return step, views.reshape(-1, N_VIEW), instants


def _instant_steps(
    shots: _Shots, step: np.ndarray, views: np.ndarray, n_cameras: int
) -> np.ndarray:
    with_others = np.concatenate([step[shots.columns], views[shots.poses]], axis=1)
    instants = np.zeros((len(views) // N_VIEW, n_cameras))
    instants[shots.view, shots.camera] = (
        shots.gradient - np.sum(shots.coupling * with_others, axis=1)
    ) / shots.weight
    return instants


def _eliminate(normal: _Normal, C: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, ...]:
    """Schur complement: reduced matrix and gradient of the free globals, C⁻¹Bᵀ (6 V, F) and C⁻¹c (6 V,)."""
    B = normal.B[free]
    firm = C.copy()
    firm[0] *= 1.0 + _RIDGE
    solved = solveh_banded(firm, np.column_stack([B.T, normal.c]), lower=True, check_finite=False)
    CB, Cc = solved[:, :-1], solved[:, -1]
    return normal.A[np.ix_(free, free)] - B @ CB, normal.a[free] - B @ Cc, CB, Cc


def _scale(matrix: np.ndarray) -> np.ndarray:
    diagonal = np.diag(matrix)
    return 1.0 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))


def _scaled_solve(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Solves with rows and columns scaled to a unit diagonal: fx is 10³, k1 is 10⁻¹."""
    if not len(vector):
        return vector
    scale = _scale(matrix)
    return scale * np.linalg.lstsq(matrix * np.outer(scale, scale), scale * vector, rcond=1e-14)[0]


def _inverse(matrix: np.ndarray) -> np.ndarray:
    scale = _scale(matrix)
    return np.linalg.pinv(matrix * np.outer(scale, scale), rcond=1e-14, hermitian=True) * np.outer(
        scale, scale
    )


def adjust_bundle(
    state: BundleState,
    seen: Sightings,
    corners_mm: np.ndarray,
    priors: Priors,
    *,
    width: float = np.inf,
    max_iterations: int = 60,
    tolerance: float = 1e-8,
) -> Solution:
    """Least cost from `state`. width: of Cauchy's loss in sigmas, inf for least squares.

    tolerance: relative fall of the cost at which it is done.
    """
    normal = _normal_equations(state, seen, corners_mm, priors, width)
    damping, done, iteration, fall = _DAMPED, False, 0, np.inf
    while not done and iteration < max_iterations and np.isfinite(normal.cost):
        iteration += 1
        tried = state.stepped(*_solve_step(normal, priors, damping))
        trial = _normal_equations(tried, seen, corners_mm, priors, width)
        if trial.cost <= normal.cost * (1 + 1e-13):
            fall = (normal.cost - trial.cost) / (1e-12 + normal.cost)
            done = fall <= tolerance
            state, normal, damping = tried, trial, max(damping * _EASED, _LEAST_DAMPED)
        else:
            damping *= _STIFFENED
            done = damping > _MOST_DAMPED
    return _solution(state, normal, priors, iteration, done or fall < _NEARLY_AT_REST)


def _solution(
    state: BundleState, normal: _Normal, priors: Priors, iterations: int, done: bool
) -> Solution:
    covariance = np.zeros((len(priors.free),) * 2)
    if np.isfinite(normal.cost) and priors.free.any():
        reduced, *_ = _eliminate(normal, normal.C, priors.free)
        covariance[np.ix_(priors.free, priors.free)] = _inverse(reduced)
    return Solution(state, normal.residual_px, covariance, normal.cost, iterations, done)
