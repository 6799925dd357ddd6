"""The adjustment: Levenberg–Marquardt with pictures' instants, points and board poses eliminated.

A view's pose touches only the cameras that saw it, so that all poses are eliminated from the normal
equations (Schur complement) after the pictures' instants. The work grows linearly with views; what
is left to solve is as small as the cameras are few, and its inverse is the covariance of what is
kept, everything eliminated being marginalised. Where the board's points are free they are eliminated
last.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve, solveh_banded

from vision.calibration.bundle import N_CAMERA, N_VIEW, BundleState, Priors, Sightings
from vision.calibration.normal_equations import (
    LinearisedCost,
    NormalEquations,
    normal_equations,
    shape_changes,
)
from vision.geometry.board import Board

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
    poses marginalised; rows of held parameters are 0. fitted_points: how many coordinates of the
    board's points the pictures determine.
    """

    state: BundleState
    residual_px: np.ndarray
    covariance: np.ndarray
    cost: float
    converged: bool
    fitted_points: float = 0.0


@dataclass(frozen=True, eq=False)
class _Problem:
    """What was seen, of which board, and what is known besides.

    width: of Cauchy's loss in sigmas, inf for least squares.
    """

    seen: Sightings
    board: Board
    priors: Priors
    width: float

    def normal(self, state: BundleState) -> LinearisedCost:
        """Return the cost and the normal equations at a state."""
        return normal_equations(state, self.seen, self.board, self.priors, self.width)

    @cached_property
    def free(self) -> "_Free":
        """Return what is free of globals and points."""
        by_globals = self.priors.directions()
        if not self.priors.point_sigma_mm:
            return _Free(by_globals, *by_globals.shape)
        by_points = shape_changes(self.board, self.seen.corner)
        return _Free(block_diag(by_globals, by_points), *by_globals.shape)

    def fitted_points(self, normal: LinearisedCost) -> float:
        """Return how many coordinates of the board's points the pictures determine."""
        if normal.equations is None or not self.priors.point_sigma_mm:
            return 0.0
        size = self.free.n_globals
        changes = self.free.directions[size:, self.free.n_free_globals :]
        precision = changes.T @ normal.equations.A[size:, size:] @ changes
        prior = self.priors.point_sigma_mm**-2.0
        return float(len(precision) - prior * np.trace(np.linalg.inv(precision)))


class _Free(NamedTuple):
    """Hold how globals, and points behind them, move with the free ones.

    directions (G [+ 3 m], F + k). n_globals, n_free_globals: G and F.
    """

    directions: np.ndarray
    n_globals: int
    n_free_globals: int


def adjust_bundle(
    state: BundleState,
    seen: Sightings,
    board: Board,
    priors: Priors,
    *,
    width: float = np.inf,
    tolerance: float = 1e-8,
) -> Solution:
    """Find the state of least cost from `state`, by Levenberg–Marquardt.

    width: of Cauchy's loss in sigmas, inf for least squares.
    tolerance: relative fall of the cost at which the iteration ends.
    """
    problem = _Problem(seen, board, priors, width)
    state, normal, converged = _descend(problem, state, tolerance)
    covariance = _covariance(normal, problem.free)
    fitted = problem.fitted_points(normal)
    return Solution(state, normal.residual_px, covariance, normal.cost, converged, fitted)


def _descend(
    problem: _Problem, state: BundleState, tolerance: float
) -> tuple[BundleState, LinearisedCost, bool]:
    """Return the state of least cost, its equations, and whether the cost came to rest.

    tolerance: relative fall of the cost at which the iteration ends.
    """
    normal = problem.normal(state)
    damping = _DAMPED
    converged = False
    fall = np.inf
    for _ in range(_MOST_STEPS if np.isfinite(normal.cost) else 0):
        steps = _solve_step(normal, problem.free, damping)
        trial_state = state.move(*steps)
        trial = problem.normal(trial_state)
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
    return state, normal, converged or fall < _NEARLY_AT_REST


def _solve_step(
    normal: LinearisedCost, free: _Free, damping: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return Marquardt's step of the globals (G,), the views (V, 6), the instants (V, C) and the
    points (m, 3), 0 (1, 3) of points that are held.
    """
    directions = free.directions
    reduced, gradient, CB, Cc = _eliminate_views(normal.equations, directions, damping)
    curvature = np.einsum("gf,gf->f", directions, normal.equations.A @ directions)
    np.einsum("ii->i", reduced)[...] += damping * curvature
    reduced, gradient, by_globals, constant = _eliminate_points(reduced, gradient, free)
    global_step = _solve_scaled(reduced, gradient)
    free_step = np.append(global_step, constant - by_globals @ global_step)
    step = directions @ free_step
    view_steps = (Cc - CB @ free_step).reshape(-1, N_VIEW)
    of_globals = step[: free.n_globals]
    of_points = step[free.n_globals :].reshape(-1, 3)
    if not len(of_points):
        of_points = np.zeros((1, 3))
    return of_globals, view_steps, _instant_steps(normal, of_globals, view_steps), of_points


def _eliminate_points(
    reduced: np.ndarray, gradient: np.ndarray, free: _Free
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Eliminate the points from a reduced matrix (F + k, F + k) and its gradient (F + k,).

    Returns both of the free globals, and what the points' step is: a constant (k,) less a matrix (k, F)
    times that of the globals.
    """
    count = free.n_free_globals
    points = slice(count, None)
    if count == len(reduced):
        return reduced, gradient, np.zeros((0, count)), np.zeros(0)
    right = np.column_stack([reduced[points, :count], gradient[points]])
    solved = cho_solve(cho_factor(reduced[points, points]), right)
    coupling = reduced[:count, points]
    by_globals = solved[:, :-1]
    constant = solved[:, -1]
    left = reduced[:count, :count] - coupling @ by_globals
    return left, gradient[:count] - coupling @ constant, by_globals, constant


def _instant_steps(normal: LinearisedCost, step: np.ndarray, view_steps: np.ndarray) -> np.ndarray:
    """Return the steps (V, C) of the pictures' instants that go with those of globals and views."""
    shots = normal.shots
    instants = normal.instants
    others = np.hstack([step[shots.columns], view_steps.ravel()[shots.poses]])  # (s, p)
    gradient = instants.gradient - np.sum(instants.coupling * others, axis=1)
    of_cameras = len(step) + N_CAMERA - shots.columns.shape[1]
    instant_steps = np.zeros((len(view_steps), of_cameras // N_CAMERA))
    instant_steps[shots.view, shots.camera] = gradient / instants.precision
    return instant_steps


def _eliminate_views(
    equations: NormalEquations, directions: np.ndarray, damping: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Reduce the equations to what is free of globals and points: eliminate the views' poses by the
    Schur complement.

    directions (G, F): how these move with the free ones. Returns the reduced matrix (F, F) and
    gradient (F,) of the free globals, C⁻¹Bᵀ (6 V, F) and C⁻¹c (6 V,).
    """
    A, a, B, C, c = equations
    B = directions.T @ B
    raised = C.copy()
    raised[0] *= (1.0 + damping) * (1.0 + _RIDGE)
    solved = solveh_banded(raised, np.column_stack([B.T, c]), lower=True, check_finite=False)
    CB = solved[:, :-1]
    Cc = solved[:, -1]
    reduced = directions.T @ A @ directions - B @ CB
    return reduced, directions.T @ a - B @ Cc, CB, Cc


def _unit_scale(matrix: np.ndarray) -> np.ndarray:
    """Return the scale of each row and column with which the diagonal is 1: fx is 10³, k1 10⁻¹."""
    diagonal = np.diag(matrix)
    return 1.0 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))


def _solve_scaled(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Solve matrix · x = vector, with rows and columns scaled to a unit diagonal."""
    if not len(vector):
        return vector
    scale = _unit_scale(matrix)
    unit = matrix * np.outer(scale, scale)
    return scale * np.linalg.lstsq(unit, scale * vector, rcond=1e-14)[0]


def _covariance(normal: LinearisedCost, free: _Free) -> np.ndarray:
    """Return the covariance (G, G) of the globals, all poses, points and instants being marginalised."""
    size = free.n_globals
    if normal.equations is None or not free.n_free_globals:
        return np.zeros((size, size))
    reduced, gradient, *_ = _eliminate_views(normal.equations, free.directions)
    reduced, *_ = _eliminate_points(reduced, gradient, free)
    scale = np.outer(_unit_scale(reduced), _unit_scale(reduced))
    inverse = np.linalg.pinv(reduced * scale, rcond=1e-14, hermitian=True)
    directions = free.directions[:size, : free.n_free_globals]
    return directions @ (inverse * scale) @ directions.T
