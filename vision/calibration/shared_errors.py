"""By how much sigmas of lenses are too small where the corners of a view err together.

A board that bends in the hand, blur along its motion and a focus that breathes move the corners of a
view alike, so that fifty corners are fewer observations than fifty. How lenses scatter is then seen
from view to view: the gradients of the cost by a camera's lens, a sum over each view, are as large
as independent corners make them, or larger. Their covariance between the inverse normal matrices
(the sandwich of White 1980, by clusters, with the small-sample correction CR2 of Bell and McCaffrey
2002) is the one that halves of real sets of views agree with.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vision.calibration.adjust import adjust_bundle
from vision.calibration.bundle import (
    CLOCK,
    N_CAMERA,
    Priors,
    SharedLenses,
    Sightings,
    predict,
)
from vision.calibration.corner_noise import Adjustment
from vision.geometry.board import Board
from vision.geometry.lens import LENS_TERMS

# [1] Of a view's share of what is known of the lens, at most: a view that alone determines a
# direction says nothing of its scatter. Stated.
_MOST_LEVERAGE = 0.95
# [1] Of the largest eigenvalue, below which a direction is not determined: rounding. Derived.
_LEAST_EIGENVALUE = 1e-13
# [1] Factor from which the report says it: six independent views scatter to 1.2. Study:
# real_calibration.py.
_NOTED = 1.3
# [parameters] A layout, no threshold.
_N_LENS = len(LENS_TERMS)


def with_shared_errors(
    adjustment: Adjustment, board: Board, names: Sequence[str]
) -> tuple[Adjustment, list[str]]:
    """Return the adjustment with each camera's corners weighted as its views scatter, and notes.

    names: of the cameras.
    """
    factor = shared_error_factors(adjustment, board)
    if np.all(factor == 1.0):
        return adjustment, []
    seen = replace(
        adjustment.seen, sigma_px=adjustment.seen.sigma_px * factor[adjustment.seen.camera]
    )
    solution = adjust_bundle(
        adjustment.solution.state, seen.select(adjustment.kept), board, adjustment.priors
    )
    residual_px = seen.px - predict(solution.state, seen, board)[0]
    solution = replace(solution, residual_px=residual_px)
    notes = [
        f"Corners of a view of camera {name} err together: sigmas are {own:.1f} times those of corners by themselves."
        for name, own in zip(names, factor)
        if own > _NOTED
    ]
    return replace(adjustment, solution=solution, seen=seen, residual_px=residual_px), notes


def shared_error_factors(adjustment: Adjustment, board: Board) -> np.ndarray:
    """Return by how much the sigmas of each camera's lens are too small, (C,), 1 or more, by all views
    of that lens.
    """
    state = adjustment.solution.state
    seen = adjustment.seen.select(adjustment.kept)
    px, J = predict(state, seen, board)
    residual = (seen.px - px) / seen.sigma_px[:, None]
    J = J / seen.sigma_px[:, None, None]
    shared = adjustment.priors.shared or SharedLenses.none(len(state.lens))
    factors = np.ones(len(state.lens))
    for first in np.unique(shared.first):
        shots = []
        for camera in np.flatnonzero(shared.first == first):
            shots += _shots(camera, seen, J, residual, shared.signs[camera])
        factors[shared.first == first] = _factor(first, shots, adjustment.priors, len(state.board))
    return factors


def _shots(
    camera: int, seen: Sightings, J: np.ndarray, residual: np.ndarray, signs: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return whitened derivatives (2 n, p) and residuals (2 n,) of each picture of a camera.

    J (points, 2, p), residual (points, 2): of all cameras. signs: of the camera's lens in what is shared.
    """
    shots = []
    for view in np.unique(seen.view[seen.camera == camera]):
        rows = (seen.camera == camera) & (seen.view == view)
        by_lens = J[rows].reshape(-1, J.shape[2])
        by_lens[:, :_N_LENS] *= signs
        shots.append((by_lens, residual[rows].ravel()))
    return shots


def _factor(
    camera: int, shots: list[tuple[np.ndarray, np.ndarray]], priors: Priors, n_board: int
) -> float:
    """Return by how much the sigmas of one camera's lens are too small.

    shots: whitened derivatives (2 n, p) and residuals (2 n,) of each picture. n_board: terms of the board.
    """
    of_prior, columns = _columns(camera, priors, n_board)
    prior = np.diag(priors.sigma[of_prior] ** -2.0)
    information = []
    gradients = []
    for J, residual in shots:
        design = _without_pose(J, columns, n_board)
        information.append(design.T @ design)
        gradients.append(design.T @ residual)
    stated, sandwich = _two_covariances(prior, information, gradients)
    lens = slice(0, _N_LENS)
    ratio = np.trace(np.linalg.solve(stated[lens, lens], sandwich[lens, lens])) / _N_LENS
    return float(np.sqrt(max(ratio, 1.0)))


def _two_covariances(
    prior: np.ndarray, information: list[np.ndarray], gradients: list[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the stated covariance (k, k), of independent corners, and the sandwich (k, k), by how
    pictures scatter; both with each parameter in units of its conditional sigma.

    prior (k, k): precision. information (k, k), gradients (k,): of each picture.
    """
    normal = prior + np.sum(information, axis=0)
    scale = 1.0 / np.sqrt(np.diag(normal))
    units = np.outer(scale, scale)
    root, inverse_root = _roots(normal * units)
    scatter = prior * units
    for shot, gradient in zip(information, gradients):
        leverage = inverse_root @ (shot * units) @ inverse_root
        whitened = _corrected(leverage) @ (inverse_root @ (scale * gradient))
        scatter += np.outer(root @ whitened, root @ whitened)
    stated = inverse_root @ inverse_root
    return stated, stated @ scatter @ stated


def _without_pose(J: np.ndarray, columns: np.ndarray, n_board: int) -> np.ndarray:
    """Return the derivatives (2 n, k) of a picture by `columns` (k,) that no pose or instant takes up."""
    by_instant = J[:, CLOCK]
    by_pose = J[:, N_CAMERA + n_board :]
    basis, size, _ = np.linalg.svd(np.column_stack([by_instant, by_pose]), full_matrices=False)
    basis = basis[:, size > _LEAST_EIGENVALUE * size[0]]
    wanted = J[:, columns]
    return wanted - basis @ (basis.T @ wanted)


def _columns(camera: int, priors: Priors, n_board: int) -> tuple[np.ndarray, np.ndarray]:
    """Return where a camera's lens and the free terms of the board stand among the globals, and
    among the columns of `predict`.
    """
    board_terms = np.flatnonzero(priors.free[-n_board:])
    of_prior = np.append(
        N_CAMERA * camera + np.arange(_N_LENS), len(priors.free) - n_board + board_terms
    )
    return of_prior, np.append(np.arange(_N_LENS), N_CAMERA + board_terms)


def _roots(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the symmetric root of a positive matrix and the root's inverse."""
    values, vectors = np.linalg.eigh(matrix)
    values = np.maximum(values, _LEAST_EIGENVALUE * values[-1])
    return (vectors * np.sqrt(values)) @ vectors.T, (vectors / np.sqrt(values)) @ vectors.T


def _corrected(leverage: np.ndarray) -> np.ndarray:
    """Return (1 − leverage)^(−1/2): what a view took of its own residuals, given back."""
    values, vectors = np.linalg.eigh(leverage)
    left = 1.0 - np.minimum(values, _MOST_LEVERAGE)
    return (vectors / np.sqrt(left)) @ vectors.T
