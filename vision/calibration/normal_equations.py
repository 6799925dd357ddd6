"""The normal equations of an adjustment, formed picture by picture, with what is a picture's own eliminated.

A picture's instant, and how far the board was from its path then, touch only that picture. The board's
points are free only where these are held. Shapes: s pictures ("shots"), G = 16 C + B global parameters,
V views, p = 16 + B + 6 or 18 parameters that a picture depends on: 16 + B of them global, the rest poses
of its view and that view's neighbours.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from vision.calibration.bundle import (
    CLOCK,
    N_CAMERA,
    N_PICTURE,
    N_VIEW,
    BundleState,
    Priors,
    Sightings,
    predict_with_own,
)
from vision.geometry.board import PRINT_TERMS, Board
from vision.geometry.rotation import pose_difference, skew

# [points] Three determine the motion of a face. Derived.
_FEWEST_POINTS = 3
# [columns] Of a board's terms: scale and stretch. A layout, no threshold.
_SIZES = [PRINT_TERMS.index(name) - len(PRINT_TERMS) for name in ("scale", "stretch")]


class Shots(NamedTuple):
    """Pictures, a row each: camera and view (s,), and where their p parameters stand.

    columns (s, 16 + B): among the globals. poses (s, 6 or 18): among all views' (6 V).
    """

    camera: np.ndarray
    view: np.ndarray
    columns: np.ndarray
    poses: np.ndarray


class OwnEquations(NamedTuple):
    """The eliminated equations of each picture's own parameters.

    precision (s, 7, 7), gradient (s, 7). coupling (s, 7, p): to the picture's other parameters.
    """

    precision: np.ndarray
    gradient: np.ndarray
    coupling: np.ndarray

    def of_free(self, is_free: np.ndarray) -> "OwnEquations":
        """Return the equations with the parameters free that are so in is_free (s, 7), others held."""
        both = is_free[:, :, None] & is_free[:, None]
        return OwnEquations(
            np.where(both, self.precision, np.eye(N_PICTURE)),
            is_free * self.gradient,
            is_free[:, :, None] * self.coupling,
        )


class NormalEquations(NamedTuple):
    """The normal equations: A (G, G), a (G,) of the globals, with the board's points (3 m) behind them
    where these are free; B (G, 6 V); C, c (6 V,) of the views.

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
    """The cost at a state and, where it is finite, its normal equations; own is None where pictures have no
    parameters of their own.
    """

    cost: float
    residual_px: np.ndarray
    shots: Shots | None = None
    own: OwnEquations | None = None
    equations: NormalEquations | None = None


def normal_equations(
    state: BundleState, seen: Sightings, board: Board, priors: Priors, width: float
) -> LinearisedCost:
    """Return the cost and the normal equations at a state."""
    predicted = predict_with_own(state, seen, board)
    residual_px = seen.px - predicted.px
    squared = np.sum(residual_px**2, axis=1) / seen.sigma_px**2
    if not np.all(np.isfinite(squared)):
        return LinearisedCost(np.inf, residual_px)
    loss, weight = cauchy(squared, width)
    root = (np.sqrt(weight) / seen.sigma_px)[:, None, None]
    of_pictures = np.dstack([predicted.by_departure, predicted.J, residual_px]) * root
    rows = _SightingRows(of_pictures, predicted.by_point * root, seen, board)
    return _with_equations(residual_px, float(np.sum(loss)), rows, state, priors)


def _with_equations(
    residual_px: np.ndarray, loss: float, rows: "_SightingRows", state: BundleState, priors: Priors
) -> LinearisedCost:
    """Return the cost and the normal equations by the rows of all sightings and by the priors.

    residual_px (n, 2), loss: of the sightings.
    """
    shots = _shots(state, rows.seen)
    blocks = _shot_blocks(rows.of_pictures, rows.seen.shot_starts())
    others = blocks[:, N_VIEW:, N_VIEW:]
    own = None
    cost = 0.0
    if state.trajectory is not None and priors.picture_sigma is not None:
        own, cost = _own_equations(blocks, shots, state, priors)
        others = _without_own(others, own)
    equations = _assemble(others, shots, state)
    if priors.point_sigma_mm:
        equations = rows.with_points(equations, shots, state, priors.point_sigma_mm)
        cost += np.sum(state.points_mm**2) / priors.point_sigma_mm**2
    equations, prior_cost = _with_priors(equations, state, priors)
    cost += loss + prior_cost
    return LinearisedCost(float(cost), residual_px, shots, own, equations)


def cauchy(squared: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
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
    """Return JᵀJ and Jᵀr of each picture, (s, q, q + 1), from weighted rows (n, 2, q + 1).

    Pictures are filled up with zeros to one length: one product for all is ten times as fast as one
    a corner.
    """
    shots = len(starts)
    count = np.diff(np.append(starts, len(rows)))
    shot = np.repeat(np.arange(shots), count)  # (n,) of each row
    place = np.arange(len(rows)) - starts[shot]  # (n,) within its picture
    padded = np.zeros((shots, count.max(), *rows.shape[1:]))
    padded[shot, place] = rows
    padded = padded.reshape(shots, -1, rows.shape[2])
    return np.swapaxes(padded[:, :, :-1], 1, 2) @ padded


def _own_equations(
    blocks: np.ndarray, shots: Shots, state: BundleState, priors: Priors
) -> tuple[OwnEquations, float]:
    """Return the equations of each picture's own parameters, by its block (s, 6 + p, 6 + p + 1) with
    departures from the board's path first, and the cost of their priors.

    A picture that gives its view its time and its pose has none.
    """
    sigma = priors.picture_sigma[shots.camera]  # (s, 7)
    may_stray = state.trajectory.may_stray(shots.view, shots.camera)
    is_free = may_stray[:, None] & (sigma > 0)
    prior = np.where(is_free, sigma, np.inf) ** -2.0
    value = state.pictures[shots.view, shots.camera]
    own = [N_VIEW + CLOCK, *range(N_VIEW)]
    rows = blocks[:, own]
    equations = OwnEquations(
        precision=rows[:, :, own] + prior[:, :, None] * np.eye(N_PICTURE),
        gradient=rows[:, :, -1] - prior * value,
        coupling=rows[:, :, N_VIEW:-1],
    )
    return equations.of_free(is_free), float(np.sum(prior * value**2))


def _without_own(blocks: np.ndarray, own: OwnEquations) -> np.ndarray:
    """Return the pictures' blocks (s, p, p + 1) without what their own parameters explain of them."""
    right = np.dstack([own.coupling, own.gradient])
    return blocks - np.swapaxes(own.coupling, 1, 2) @ np.linalg.solve(own.precision, right)


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
    """Hold the weighted rows of sightings: by all but points, of_pictures (n, 2, 6 + p + 1), departures from the
    board's path being first and the residual last, and by the board's point of each, by_point (n, 2, 3).
    """

    of_pictures: np.ndarray
    by_point: np.ndarray
    seen: Sightings
    board: Board

    def with_points(
        self, equations: NormalEquations, shots: Shots, state: BundleState, sigma_mm: float
    ) -> NormalEquations:
        """Return the equations of globals and views with the board's points behind the globals.

        sigma_mm: of a point about its place, per axis.
        """
        prior = sigma_mm**-2.0
        H = prior * np.tile(np.eye(3), (len(self.board.corners_mm), 1, 1))
        np.add.at(H, self.seen.corner, np.swapaxes(self.by_point, 1, 2) @ self.by_point)
        W = self._couplings(shots, equations)  # (m, 3, G + 6 V + 1)
        W[:, :, -1] -= prior * state.points_mm
        of_points = W.reshape(-1, W.shape[2])
        size = len(equations.a)
        by_globals = of_points[:, :size]
        return NormalEquations(
            A=np.block([[equations.A, by_globals.T], [by_globals, block_diag(*H)]]),
            a=np.append(equations.a, of_points[:, -1]),
            B=np.vstack([equations.B, of_points[:, size:-1]]),
            C=equations.C,
            c=equations.c,
        )

    def _couplings(self, shots: Shots, equations: NormalEquations) -> np.ndarray:
        """Return how each point is coupled to globals and views, and its gradient, (m, 3, G + 6 V + 1)."""
        size = sum(equations.B.shape)
        W = np.zeros((len(self.board.corners_mm), 3, size + 1))
        others = self.of_pictures[:, :, N_VIEW:]
        for rows, globals_, poses in zip(self.seen.rows_by_shot(), shots.columns, shots.poses):
            columns = np.concatenate([globals_, len(equations.a) + poses, [size]])
            products = np.swapaxes(self.by_point[rows], 1, 2) @ others[rows]
            place = np.ix_(self.seen.corner[rows], np.arange(3), columns)
            W[place] += products
        return W


def common_modes(board: Board, seen: np.ndarray) -> np.ndarray:
    """Return an orthonormal basis (3 m, k) of those changes of a board's points that the points do not
    have as parameters, because others stand for them.

    These are the motions of a face as a whole, which are its pose, and a plane's scale and aspect,
    which no view distinguishes from distance and lens. seen (n,): the points seen. A face of which
    too few are seen has no motions.
    """
    is_seen = np.isin(np.arange(len(board.face_of)), seen)
    faces = np.unique(board.face_of)
    modes = []
    for face in faces:
        points = np.flatnonzero(is_seen & (board.face_of == face))
        if len(points) >= _FEWEST_POINTS:
            modes.append(_motions(board, points))
    if len(faces) == 1:
        by_size = board.printed(board.stated_terms)[1][:, :, _SIZES]
        modes.append(is_seen[:, None, None] * by_size)
    columns = np.concatenate(modes, axis=2).reshape(board.corners_mm.size, -1)
    return np.linalg.qr(columns)[0]


def _motions(board: Board, points: np.ndarray) -> np.ndarray:
    """Return the changes (m, 3, 6) of the board's points by a motion of some of them as a whole: three
    shifts, then three turns about their middle.
    """
    away = board.corners_mm[points] - board.corners_mm[points].mean(axis=0)
    shifts = np.broadcast_to(np.eye(3), (len(points), 3, 3))
    motions = np.zeros((*board.corners_mm.shape, N_VIEW))
    motions[points] = np.concatenate([shifts, -skew(away)], axis=2)
    return motions


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
    residual = np.where(precision == 0, 0.0, -state.global_values())
    equations.A[np.diag_indices(len(residual))] += precision
    equations.a[: len(residual)] += precision * residual
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
