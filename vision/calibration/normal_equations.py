"""The normal equations of an adjustment, formed picture by picture, with instants and points eliminated.

A picture's instant touches only that picture, a point of the board those in which it is seen. Points
are free only where instants are held. Shapes: s pictures ("shots"), G = 16 C + B global
parameters, V views, p = 16 + B + 6 or 18 parameters that a picture depends on: 16 + B of them global, the
rest poses of its view and that view's neighbours.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vision.calibration.bundle import (
    CLOCK,
    N_CAMERA,
    N_VIEW,
    BundleState,
    Priors,
    Sightings,
    predict_with_points,
)
from vision.geometry.board import Board
from vision.geometry.rotation import pose_difference, skew

# [points] Three determine the motion of a face. Derived.
_FEWEST_POINTS = 3


class Shots(NamedTuple):
    """Pictures, a row each: camera and view (s,), and where their p parameters stand.

    columns (s, 16 + B): among the globals. poses (s, 6 or 18): among all views' (6 V).
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


class EliminatedPoints(NamedTuple):
    """The eliminated equations of the board's points.

    step (m, 3): of each while nothing else moves. by_others (m, 3, G + 6 V): what a step of the globals and
    the views takes off it. fitted: how many coordinates the pictures determine, their priors counting
    for the rest.
    """

    step: np.ndarray
    by_others: np.ndarray
    fitted: float

    @staticmethod
    def none() -> "EliminatedPoints":
        """Return the equations of a board whose points are held."""
        return EliminatedPoints(np.zeros((1, 3)), np.zeros((1, 3, 1)), 0.0)

    def steps(self, others: np.ndarray) -> np.ndarray:
        """Return the steps (m, 3) of the points that go with those of globals and views (G + 6 V,)."""
        return self.step - self.by_others @ others if self.fitted else self.step


class NormalEquations(NamedTuple):
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
class LinearisedCost:
    """The cost at a state and, where it is finite, its normal equations."""

    cost: float
    residual_px: np.ndarray
    shots: Shots | None = None
    instants: Instants | None = None
    points: EliminatedPoints | None = None
    equations: NormalEquations | None = None


def normal_equations(
    state: BundleState, seen: Sightings, board: Board, priors: Priors, width: float
) -> LinearisedCost:
    """Return the cost and the normal equations at a state."""
    px, J, by_point = predict_with_points(state, seen, board)
    residual_px = seen.px - px
    squared = np.sum(residual_px**2, axis=1) / seen.sigma_px**2
    if not np.all(np.isfinite(squared)):
        return LinearisedCost(np.inf, residual_px)
    loss, weight = _cauchy(squared, width)
    root = (np.sqrt(weight) / seen.sigma_px)[:, None, None]
    rows = _SightingRows(np.dstack([J, residual_px]) * root, by_point * root, seen, board)
    return _with_equations(residual_px, float(np.sum(loss)), rows, state, priors)


def _with_equations(
    residual_px: np.ndarray, loss: float, rows: "_SightingRows", state: BundleState, priors: Priors
) -> LinearisedCost:
    """Return the cost and the normal equations by the rows of all sightings and by the priors.

    residual_px (n, 2), loss: of the sightings.
    """
    shots = _shots(state, rows.seen)
    blocks = _shot_blocks(rows.others, rows.seen.shot_starts())
    instants, cost = _eliminate_instants(blocks, shots, state, priors)
    equations = _assemble(blocks, shots, state)
    points = EliminatedPoints.none()
    if priors.point_sigma_mm:
        equations, points = rows.eliminate(equations, shots, state, priors.point_sigma_mm)
        cost += np.sum(state.points_mm**2) / priors.point_sigma_mm**2
    equations, prior_cost = _with_priors(equations, state, priors)
    cost += loss + prior_cost
    return LinearisedCost(float(cost), residual_px, shots, instants, points, equations)


def _cauchy(squared: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Return Cauchy's loss, width² log(1 + u²/width²), and weight, of squared residuals u² (n,).

    For infinite width they are u² and 1.
    """
    if np.isinf(width):
        return squared, np.ones_like(squared)
    ratio = squared / width**2
    return width**2 * np.log1p(ratio), 1.0 / (1.0 + ratio)


def _shots(state: BundleState, seen: Sightings) -> Shots:
    """Return the pictures of the sightings, and where their parameters stand."""
    starts = seen.shot_starts()
    camera = seen.camera[starts]
    view = seen.view[starts]
    of_camera = N_CAMERA * camera[:, None] + np.arange(N_CAMERA)
    of_board = N_CAMERA * len(state.lens) + np.arange(len(state.board))
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


def _assemble(blocks: np.ndarray, shots: Shots, state: BundleState) -> NormalEquations:
    """Add up the blocks (s, p, p + 1) of all pictures where their parameters stand."""
    size = N_CAMERA * len(state.lens) + len(state.board)
    shared = N_CAMERA + len(state.board)
    size_views = N_VIEW * len(state.T_world_board)
    columns = shots.columns
    poses = shots.poses
    of_globals = columns[:, :, None]
    rows = blocks[:, :shared]
    return NormalEquations(
        A=_sum_at((size, size), (of_globals, columns[:, None]), rows[:, :, :shared]),
        a=_sum_at(size, columns, rows[:, :, -1]),
        B=_sum_at((size, size_views), (of_globals, poses[:, None]), rows[:, :, shared:-1]),
        C=_lower_band(blocks[:, shared:, shared:-1], poses, size_views),
        c=_sum_at(size_views, poses, blocks[:, shared:, -1]),
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


class _SightingRows(NamedTuple):
    """Hold the weighted rows of sightings: by all but points, with the residual as last column, others
    (n, 2, p + 1), and by the board's point of each, own (n, 2, 3).
    """

    others: np.ndarray
    own: np.ndarray
    seen: Sightings
    board: Board

    def eliminate(
        self, equations: NormalEquations, shots: Shots, state: BundleState, sigma_mm: float
    ) -> tuple[NormalEquations, EliminatedPoints]:
        """Return the equations of globals and views without the points, and the points' own.

        sigma_mm: of a point about its place, per axis. The points of a face do not move as one: that is
        the face's pose. The views are then all coupled.
        """
        prior = sigma_mm**-2.0
        H = prior * np.tile(np.eye(3), (len(self.board.corners_mm), 1, 1))
        np.add.at(H, self.seen.corner, np.swapaxes(self.own, 1, 2) @ self.own)
        W = self._couplings(shots, equations)  # (m, 3, G + 6 V + 1)
        W[:, :, -1] -= prior * state.points_mm
        shape = _FaceShape.of(H, _rigid_modes(self.board, self.seen.corner))
        solved = shape.solve(W)
        points = solved.reshape(W.shape)
        return (
            _less(equations, _flat(W).T @ solved),
            EliminatedPoints(points[:, :, -1], points[:, :, :-1], shape.fitted(prior)),
        )

    def _couplings(self, shots: Shots, equations: NormalEquations) -> np.ndarray:
        """Return how each point is coupled to globals and views, and its gradient, (m, 3, G + 6 V + 1)."""
        size = sum(equations.B.shape)
        W = np.zeros((len(self.board.corners_mm), 3, size + 1))
        starts = self.seen.shot_starts()
        for shot, rows in enumerate(np.split(np.arange(len(self.seen)), starts[1:])):
            columns = [shots.columns[shot], len(equations.a) + shots.poses[shot], [size]]
            index = np.ix_(self.seen.corner[rows], np.arange(3), np.concatenate(columns))
            W[index] += np.swapaxes(self.own[rows], 1, 2) @ self.others[rows]
        return W


@dataclass(frozen=True, eq=False)
class _FaceShape:
    """Hold the points' equations H (m, 3, 3) for changes of faces in shape: no face moves as one.

    modes (3 m, 6 F): orthonormal motions of faces as one. yielding (3 m, 6 F): H⁻¹ modes. stiffness
    (6 F, 6 F): of the faces against these motions.
    """

    H: np.ndarray
    modes: np.ndarray
    yielding: np.ndarray
    stiffness: np.ndarray

    @staticmethod
    def of(H: np.ndarray, modes: np.ndarray) -> "_FaceShape":
        """Return the equations H with these motions held."""
        yielding = _flat(np.linalg.solve(H, modes.reshape(*H.shape[:2], -1)))
        stiffness = np.linalg.pinv(modes.T @ yielding, hermitian=True)
        return _FaceShape(H, modes, yielding, stiffness)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Return the solutions (3 m, k) for right sides (m, 3, k)."""
        solved = _flat(np.linalg.solve(self.H, right))
        solved -= self.yielding @ (self.stiffness @ (self.modes.T @ solved))
        return solved

    def fitted(self, prior: float) -> float:
        """Return how many coordinates the pictures determine; prior: precision of each, 1/mm²."""
        variance = np.trace(np.linalg.inv(self.H), axis1=1, axis2=2).sum()
        variance -= np.sum(self.stiffness * (self.yielding.T @ self.yielding))
        return float(len(self.modes) - np.sum(self.modes**2) - prior * variance)


def _flat(rows: np.ndarray) -> np.ndarray:
    """Return the coordinates of points, (m, 3, k), as rows (3 m, k)."""
    return rows.reshape(-1, rows.shape[2])


def _rigid_modes(board: Board, seen: np.ndarray) -> np.ndarray:
    """Return the orthonormal motions of each face of a board as one, (3 m, 6 F), over its points among
    those seen (n,); 0 where too few are.
    """
    faces = np.unique(board.face_of)
    is_seen = np.isin(np.arange(len(board.face_of)), seen)
    modes = np.zeros((*board.corners_mm.shape, len(faces), N_VIEW))
    for number, face in enumerate(faces):
        points = np.flatnonzero(is_seen & (board.face_of == face))
        if len(points) < _FEWEST_POINTS:
            continue
        away = board.corners_mm[points] - board.corners_mm[points].mean(axis=0)
        shifts = np.broadcast_to(np.eye(3), (len(points), 3, 3))
        motions = np.concatenate([shifts, -skew(away)], axis=2)
        modes[points, :, number] = np.linalg.qr(_flat(motions))[0].reshape(-1, 3, N_VIEW)
    return modes.reshape(-1, len(faces) * N_VIEW)


def _less(equations: NormalEquations, taken: np.ndarray) -> NormalEquations:
    """Return equations less what eliminated parameters explain, (G + 6 V + 1, G + 6 V + 1)."""
    A, a, B, C, c = equations
    size = len(a)
    views = taken[size:-1, size:-1]
    band = np.zeros_like(views)
    band[: len(C)] = C
    for offset in range(len(views)):
        band[offset, : len(views) - offset] -= np.diagonal(views, -offset)
    return NormalEquations(
        A - taken[:size, :size],
        a - taken[:size, -1],
        B - taken[:size, size:-1],
        band,
        c - taken[size:-1, -1],
    )


def _with_priors(
    equations: NormalEquations, state: BundleState, priors: Priors
) -> tuple[NormalEquations, float]:
    """Return the equations, changed in place, with the priors added and views held, and their cost."""
    cost = _add_priors(equations, state, priors)
    _hold(equations, np.repeat(~priors.view_free, N_VIEW))
    return equations, cost


def _add_priors(equations: NormalEquations, state: BundleState, priors: Priors) -> float:
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


def _hold(equations: NormalEquations, held: np.ndarray) -> None:
    """Give the held parameters (6 V,) of the views, and those that nothing depends on, no step."""
    C = equations.C
    held = held | (C[0] == 0)
    equations.B[:, held] = 0.0
    equations.c[held] = 0.0
    C[:, held] = 0.0
    for offset in range(1, len(C)):
        C[offset, :-offset][held[offset:]] = 0.0
    C[0, held] = 1.0
