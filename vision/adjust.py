"""The adjustment: Levenberg–Marquardt with pictures' instants and board poses eliminated.

A picture's instant touches only that picture, and a view's pose only the cameras that saw it. So the normal
equations are formed picture by picture, the instant is eliminated there, then the six of each view (Schur
complement). The work grows linearly with views; what is left to solve is as small as the cameras are few,
and its inverse is the covariance of what is kept, everything eliminated being marginalised.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vision.bundle import N_BOARD, N_CAMERA, Knowledge, Sightings, State, predict
from vision.rotation import pose_difference

_TIME = N_CAMERA - 2  # a picture being late moves its corners as the camera's clock offset does
_GLOBAL = N_CAMERA + N_BOARD


@dataclass(frozen=True, eq=False)
class Solution:
    """The state of least cost, its residuals (n, 2) px (seen − predicted), and the covariance (17 C + 3
    squared) of the global parameters with all view poses marginalised; rows of held parameters are 0."""

    state: State
    residual_px: np.ndarray
    covariance: np.ndarray
    cost: float
    iterations: int
    converged: bool


def robust_weight(squared: np.ndarray, width: float) -> np.ndarray:
    """Cauchy's weight of a corner whose squared residual, in sigmas, is `squared`; all 1 for infinite
    width.
    """
    return 1.0 / (1.0 + squared / width**2)


def robust_cost(squared: np.ndarray, width: float) -> np.ndarray:
    """Cauchy's cost, width² log(1 + u²/width²); the square itself for infinite width."""
    return squared if np.isinf(width) else width**2 * np.log1p(squared / width**2)


@dataclass(frozen=True, eq=False)
class _Shots:
    """Pictures: their camera, view (s,), their columns among the globals (s, 20), and what eliminating each
    one's instant left behind: its own weight and gradient (s,), its coupling to the 26 columns (s, 26)."""

    camera: np.ndarray
    view: np.ndarray
    columns: np.ndarray
    weight: np.ndarray
    gradient: np.ndarray
    coupling: np.ndarray


@dataclass(frozen=True, eq=False)
class _Normal:
    """Normal equations: A (G, G), a (G,) of the globals; B (V, G, 6); C (V, 6, 6), c (V, 6) of the views."""

    A: np.ndarray
    a: np.ndarray
    B: np.ndarray
    C: np.ndarray
    c: np.ndarray
    shots: _Shots
    cost: float
    residual_px: np.ndarray


def _normal_equations(
    state: State, seen: Sightings, corners_mm: np.ndarray, known: Knowledge, width: float
) -> _Normal:
    px, J = predict(state, seen, corners_mm)
    residual = seen.px - px
    squared = np.sum(residual**2, axis=1) / seen.sigma_px**2
    if not np.all(np.isfinite(squared)):
        return _Normal(*(None,) * 6, cost=np.inf, residual_px=residual)
    root = np.sqrt(robust_weight(squared, width)) / seen.sigma_px
    J, r = J * root[:, None, None], residual * root[:, None]
    blocks = np.add.reduceat(
        J.transpose(0, 2, 1) @ np.concatenate([J, r[:, :, None]], axis=2), seen.shot_starts()
    )
    shots, blocks, late_cost = _without_instants(blocks, state, seen, known)
    parts = _assemble(blocks, shots, len(known.free), len(state.T_world_board))
    cost = float(np.sum(robust_cost(squared, width)) + late_cost)
    return _with_knowledge(parts, shots, cost, residual, state, known)


def _without_instants(blocks: np.ndarray, state: State, seen: Sightings, known: Knowledge):
    """Eliminates each picture's instant from its block (26 × 27, the last column being the gradient)."""
    starts, size = seen.shot_starts(), len(known.free)
    camera, view = seen.camera[starts], seen.view[starts]
    own = N_CAMERA * camera[:, None] + np.arange(N_CAMERA)
    shared = np.broadcast_to(np.arange(size - N_BOARD, size), (len(starts), N_BOARD))
    columns = np.concatenate([own, shared], axis=1)
    if known.late_sigma_s is None:
        nothing = np.zeros(len(starts))
        return _Shots(camera, view, columns, nothing + 1, nothing, np.zeros((len(starts), 26))), blocks, 0.0
    information, late = known.late_sigma_s[camera] ** -2.0, state.instants[view, camera]
    weight = blocks[:, _TIME, _TIME] + information
    gradient = blocks[:, _TIME, -1] - information * late
    coupling = blocks[:, :, _TIME]
    lost = coupling[:, :, None] * np.concatenate([coupling, gradient[:, None]], axis=1)[:, None] / weight[:, None, None]
    shots = _Shots(camera, view, columns, weight, gradient, coupling)
    return shots, blocks - lost, float(np.sum(information * late**2))


def _assemble(blocks: np.ndarray, shots: _Shots, size: int, n_views: int) -> tuple[np.ndarray, ...]:
    """Adds each picture's block where its parameters stand."""
    columns, view, m = shots.columns, shots.view, _GLOBAL
    A, a = np.zeros((size, size)), np.zeros(size)
    B, C, c = np.zeros((n_views, size, 6)), np.zeros((n_views, 6, 6)), np.zeros((n_views, 6))
    np.add.at(A, (columns[:, :, None], columns[:, None, :]), blocks[:, :m, :m])
    np.add.at(a, columns, blocks[:, :m, -1])
    np.add.at(B, (view[:, None, None], columns[:, :, None], np.arange(6)), blocks[:, :m, m:-1])
    np.add.at(C, view, blocks[:, m:, m:-1])
    np.add.at(c, view, blocks[:, m:, -1])
    return A, a, B, C, c


def _with_knowledge(parts, shots: _Shots, cost: float, residual: np.ndarray, state: State, known: Knowledge) -> _Normal:
    """Adds the observations beside the pictures, and takes out what is held."""
    A, a, B, C, c = parts
    weight = 1.0 / known.sigma**2
    miss = known.mean - state.globals()
    miss[weight == 0] = 0.0
    A = A + np.diag(weight)
    a = a + weight * miss
    cost += float(np.sum(weight * miss**2))
    if known.pose_view is not None and known.view_free[known.pose_view]:
        T, information = state.T_world_board[known.pose_view], 1.0 / known.pose_sigma**2
        off = -pose_difference(known.pose_T, T)
        C[known.pose_view] += np.diag(information)
        c[known.pose_view] += information * off
        cost += float(np.sum(information * off**2))
    held = ~known.view_free | (np.einsum("vii->v", C) == 0)
    B[held], c[held], C[held] = 0.0, 0.0, np.eye(6)
    return _Normal(A, a, B, C, c, shots, cost, residual)


def _solve_step(normal: _Normal, known: Knowledge, damping: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Marquardt's step of the globals (G,), the views (V, 6) and the instants (V, C)."""
    free = known.free
    raise_by = 1.0 + damping
    C = normal.C.copy()
    np.einsum("vii->vi", C)[...] *= raise_by
    reduced, gradient, BC = _eliminate(normal, C, free)
    np.einsum("ii->i", reduced)[...] += damping * np.diag(normal.A)[free]
    step = np.zeros(len(free))
    step[free] = _scaled_solve(reduced, gradient)
    views = np.linalg.solve(C, normal.c[:, :, None])[:, :, 0] - np.einsum("vgi,g->vi", BC, step[free])
    return step, views, _instant_steps(normal.shots, step, views, len(free) // N_CAMERA)


def _instant_steps(shots: _Shots, step: np.ndarray, views: np.ndarray, n_cameras: int) -> np.ndarray:
    with_others = np.concatenate([step[shots.columns], views[shots.view]], axis=1)
    instants = np.zeros((len(views), n_cameras))
    instants[shots.view, shots.camera] = (
        shots.gradient - np.sum(shots.coupling * with_others, axis=1)
    ) / shots.weight
    return instants


def _eliminate(normal: _Normal, C: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Schur complement: reduced matrix and gradient of the free globals, and B C⁻¹ (V, F, 6)."""
    B = normal.B[:, free]
    BC = np.linalg.solve(C, B.transpose(0, 2, 1)).transpose(0, 2, 1)
    flat, flat_BC = (M.transpose(1, 0, 2).reshape(B.shape[1], 6 * len(B)) for M in (B, BC))
    reduced = normal.A[np.ix_(free, free)] - flat_BC @ flat.T
    return reduced, normal.a[free] - flat_BC @ normal.c.ravel(), BC


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


def solve(
    state: State,
    seen: Sightings,
    corners_mm: np.ndarray,
    known: Knowledge,
    *,
    width: float = np.inf,
    max_iterations: int = 60,
    tolerance: float = 1e-9,
    between: Callable[[State], State] | None = None,
) -> Solution:
    """Least cost from `state`. width: of Cauchy's loss in sigmas, inf for least squares.

    tolerance: relative fall of the cost at which it is done. between: called after each accepted step, for
    what is taken as known within a step (the board's rates).
    """
    normal = _normal_equations(state, seen, corners_mm, known, width)
    damping, done, iteration = 1e-4, False, 0
    while not done and iteration < max_iterations and np.isfinite(normal.cost):
        iteration += 1
        tried = state.stepped(*_solve_step(normal, known, damping))
        trial = _normal_equations(tried, seen, corners_mm, known, width)
        if trial.cost <= normal.cost * (1 + 1e-13):
            done = normal.cost - trial.cost <= tolerance * (1e-12 + normal.cost)
            state, normal, damping = tried, trial, max(damping * 0.1, 1e-12)
            if between is not None:
                state = between(state)
                normal = _normal_equations(state, seen, corners_mm, known, width)
        else:
            damping *= 10.0
            done = damping > 1e8
    return _solution(state, normal, known, iteration, done)


def _solution(state: State, normal: _Normal, known: Knowledge, iterations: int, done: bool) -> Solution:
    covariance = np.zeros((len(known.free),) * 2)
    if np.isfinite(normal.cost) and known.free.any():
        reduced, _, _ = _eliminate(normal, normal.C, known.free)
        covariance[np.ix_(known.free, known.free)] = _inverse(reduced)
    return Solution(state, normal.residual_px, covariance, normal.cost, iterations, done)
