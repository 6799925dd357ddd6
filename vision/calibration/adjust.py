"""The adjustment: Levenberg–Marquardt with what is a picture's own, points and board poses eliminated.

A view's pose touches only the cameras that saw it, so that all poses are eliminated from the normal
equations (Schur complement) after what is a picture's own. The work grows linearly with views; what
is left to solve is as small as the cameras are few, and its inverse is the covariance of what is
kept, everything eliminated being marginalised. Where the board's points are free they are eliminated
last.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solveh_banded

from vision.calibration.bundle import N_CAMERA, N_PICTURE, N_VIEW, BundleState, Priors, Sightings
from vision.calibration.normal_equations import (
    LinearisedCost,
    NormalEquations,
    common_modes,
    normal_equations,
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
    board's points the pictures determine. fitted_pictures (C, 7): how many of the parameters that are the
    pictures' own, by camera.
    """

    state: BundleState
    residual_px: np.ndarray
    covariance: np.ndarray
    cost: float
    converged: bool
    fitted_points: float
    fitted_pictures: np.ndarray


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
        """Return which directions of the globals and the points are free."""
        modes = np.zeros((0, 0))
        if self.priors.point_sigma_mm:
            modes = common_modes(self.board, self.seen.corner)
        return _Free(self.priors.directions(), modes)

    def fitted_points(self, normal: LinearisedCost) -> float:
        """Return how many coordinates of the board's points the pictures determine."""
        modes = self.free.modes
        if normal.equations is None or not len(modes):
            return 0.0
        H = normal.equations.A[-len(modes) :, -len(modes) :]
        variance = np.trace(_solve_but_modes(H, np.eye(len(modes)), modes))
        freedom = len(modes) - modes.shape[1]
        return float(freedom - self.priors.point_sigma_mm**-2.0 * variance)

    def fitted_pictures(self, normal: LinearisedCost, state: BundleState) -> np.ndarray:
        """Return how many of the parameters (C, 7) that are its pictures' own each camera's corners determine."""
        fitted = np.zeros((len(state.lens), N_PICTURE))
        if normal.own is None:
            return fitted
        sigma = self.priors.picture_sigma
        may_stray = state.trajectory.may_stray(normal.shots.view, normal.shots.camera)
        camera = normal.shots.camera[may_stray]
        covariances = np.linalg.inv(normal.own.precision[may_stray])
        is_free = sigma[camera] > 0
        precision = np.where(is_free, sigma[camera], np.inf) ** -2.0
        np.add.at(fitted, camera, is_free - precision * np.einsum("sii->si", covariances))
        return fitted


@dataclass(frozen=True, eq=False)
class _Free:
    """Which directions of the globals and the points are free.

    directions (G, F): how the globals move with the free ones. modes (3 m, k): orthonormal changes of
    the points that are held at 0; (0, 0) where all points are held.
    """

    directions: np.ndarray
    modes: np.ndarray

    def of(self, equations: NormalEquations) -> NormalEquations:
        """Return the equations (F + 3 m) of the free globals and the points."""
        A, a, B, C, c = equations
        D = self.directions
        size = len(D)
        coupling = D.T @ A[:size, size:]
        return NormalEquations(
            A=np.block([[D.T @ A[:size, :size] @ D, coupling], [coupling.T, A[size:, size:]]]),
            a=np.append(D.T @ a[:size], a[size:]),
            B=np.vstack([D.T @ B[:size], B[size:]]),
            C=C,
            c=c,
        )


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
    return Solution(
        state,
        normal.residual_px,
        _covariance(normal, problem.free),
        normal.cost,
        converged,
        fitted_points=problem.fitted_points(normal),
        fitted_pictures=problem.fitted_pictures(normal, state),
    )


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
    """Return Marquardt's step of the globals (G,), the views (V, 6), the pictures (V, C, 7) and
    the points (m, 3), 0 (1, 3) of points that are held.
    """
    equations = free.of(normal.equations)
    reduced, gradient, CB, Cc = _eliminate_views(equations, damping)
    np.einsum("ii->i", reduced)[...] += damping * np.diag(equations.A)
    reduced, gradient, by_globals, constant = _eliminate_points(reduced, gradient, free)
    free_step = _solve_scaled(reduced, gradient)
    of_points = constant - by_globals @ free_step
    step = free.directions @ free_step
    view_steps = (Cc - CB @ np.append(free_step, of_points)).reshape(-1, N_VIEW)
    point_steps = of_points.reshape(-1, 3) if len(of_points) else np.zeros((1, 3))
    return step, view_steps, _picture_steps(normal, step, view_steps), point_steps


def _eliminate_points(
    reduced: np.ndarray, gradient: np.ndarray, free: _Free
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Eliminate the points from a reduced matrix (F + 3 m, F + 3 m) and its gradient (F + 3 m,).

    Returns both of the free globals, and what the points' step is: a constant (3 m,) less a matrix
    (3 m, F) times that of the globals.
    """
    count = free.directions.shape[1]
    if not len(free.modes):
        return reduced, gradient, np.zeros((0, count)), np.zeros(0)
    coupling = reduced[:count, count:]
    right = np.column_stack([coupling.T, gradient[count:]])
    solved = _solve_but_modes(reduced[count:, count:], right, free.modes)
    by_globals = solved[:, :-1]
    constant = solved[:, -1]
    left = reduced[:count, :count] - coupling @ by_globals
    return left, gradient[:count] - coupling @ constant, by_globals, constant


def _solve_but_modes(matrix: np.ndarray, right: np.ndarray, modes: np.ndarray) -> np.ndarray:
    """Solve matrix · x = right (n, q) with modesᵀ x = 0 for some modes (n, k); the matrix is positive
    definite."""
    solved = cho_solve(cho_factor(matrix), np.column_stack([right, modes]))
    yielding = solved[:, right.shape[1] :]
    x = solved[:, : right.shape[1]]
    return x - yielding @ np.linalg.solve(modes.T @ yielding, modes.T @ x)


def _picture_steps(normal: LinearisedCost, step: np.ndarray, view_steps: np.ndarray) -> np.ndarray:
    """Return the steps (V, C, 7) of what is the pictures' own that go with those of globals and views."""
    shots = normal.shots
    own = normal.own
    of_cameras = len(step) + N_CAMERA - shots.columns.shape[1]
    steps = np.zeros((len(view_steps), of_cameras // N_CAMERA, N_PICTURE))
    if own is None:
        return steps
    others = np.hstack([step[shots.columns], view_steps.ravel()[shots.poses]])  # (s, p)
    gradient = own.gradient - np.einsum("skp,sp->sk", own.coupling, others)
    steps[shots.view, shots.camera] = np.linalg.solve(own.precision, gradient[:, :, None])[..., 0]
    return steps


def _eliminate_views(
    equations: NormalEquations, damping: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Eliminate the views' poses by the Schur complement.

    Returns the reduced matrix (F, F) and gradient (F,) of the other parameters, C⁻¹Bᵀ (6 V, F) and
    C⁻¹c (6 V,).
    """
    A, a, B, C, c = equations
    raised = C.copy()
    raised[0] *= (1.0 + damping) * (1.0 + _RIDGE)
    solved = solveh_banded(raised, np.column_stack([B.T, c]), lower=True, check_finite=False)
    CB = solved[:, :-1]
    Cc = solved[:, -1]
    return A - B @ CB, a - B @ Cc, CB, Cc


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
    """Return the covariance (G, G) of the globals, all poses, points and pictures being marginalised."""
    size, count = free.directions.shape
    if normal.equations is None or not count:
        return np.zeros((size, size))
    reduced, gradient, *_ = _eliminate_views(free.of(normal.equations))
    reduced, *_ = _eliminate_points(reduced, gradient, free)
    scale = np.outer(_unit_scale(reduced), _unit_scale(reduced))
    inverse = np.linalg.pinv(reduced * scale, rcond=1e-14, hermitian=True)
    return free.directions @ (inverse * scale) @ free.directions.T
