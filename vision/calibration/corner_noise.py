"""How large the corners' errors are, learned from the residuals, and which corners are no corners.

A corner's variance is (sigma of its own fit)² + (model error of its camera)². The model error
stands for what a corner's fit cannot know: print, lens beyond its terms, blur, motion. It is first
read from the median of the residuals, which half of the corners being wrong does not move; corners
beyond REJECT_SIGMA of that are left out once; then it is what makes the mean square of the rest
one. Rejecting again by the smaller figure would eat the data from the tails inward.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from vision.calibration.adjust import Solution, adjust_bundle
from vision.calibration.bundle import LATENESS, N_PICTURE, BundleState, Priors, Sightings, predict
from vision.geometry.board import Board
from vision.geometry.refusals import Refused

# [sigma] One Gaussian corner in 25 000 lies beyond (two axes): exp(−4.5²/2). Points of the rig
# err by 0.017 px at 3.5, by 0.016 at 4.5 and 6. Study: thresholds.py calibration.corner_noise
# REJECT_SIGMA ….
REJECT_SIGMA = 4.5
# [sigma] Of Cauchy's loss while outliers are still in: 95 % efficient on Gaussian noise at 2.4.
# moves nothing on the fixtures between 2 and 5. Study: thresholds.py calibration.corner_noise
# ROBUST_WIDTH ….
ROBUST_WIDTH = 3.0
# [px] Before anything is known of the residuals. moves nothing on the fixtures between 0.1 and
# 1.0. Study: thresholds.py calibration.corner_noise _FIRST_ERROR_PX ….
_FIRST_ERROR_PX = 0.3
# [1] Median of the squared length of a two-dimensional Gaussian of unit sigma. Derived.
_MEDIAN_SQUARED = 2 * np.log(2)
# [rounds] Of adjusting and learning the noise anew. Study: cameras.py.
_ROUNDS = 2
# [rounds] Of cameras that are not triggered: instants and their scatter converge more slowly.
# Study: cameras.py.
_ROUNDS_MOVING = 5
# [corners] A shot with fewer says less than the six parameters of its pose. Derived.
_MIN_SHOT = 4
# [pictures] Fewer give no scatter of what is their own. Derived.
_MIN_LATE = 8
# [1] Of all cameras' scatter, below which none is taken: no camera is exactly on time. Stated.
_LEAST_LATE_SHARE = 0.02
# [columns] Of a picture's own parameters with one scatter: instant, turn, shift. A layout, no threshold.
_OF_ONE_SCATTER = ([LATENESS], slice(1, 4), slice(4, 7))
# [parameters] That the pictures determine: fewer have no scatter. Derived.
_LEAST_FITTED = 1.0
# [mm] Scatter of the board's points, at least: no print is better. Stated.
_LEAST_POINT_SIGMA_MM = 0.001
# [1] Of the residuals' number, left over however many parameters are fitted: keeps the model
# error finite. Stated.
_LEAST_FREEDOM = 0.1
# [1] Of a variance, to which its root is found: rounding. Derived.
_ROOT_PRECISION = 1e-15


@dataclass(frozen=True, eq=False)
class Adjustment:
    """An adjustment with the noise learned from it.

    solution: over the kept corners. seen: all corners with the sigmas used. kept (n,) bool.
    residual_px (n, 2): of all corners. error_px (C,): model error of each camera. priors: as used
    last.
    """

    solution: Solution
    seen: Sightings
    kept: np.ndarray
    residual_px: np.ndarray
    error_px: np.ndarray
    priors: Priors

    def rms_px(self, camera: int) -> float:
        """Return the root mean square length of one camera's kept residuals, as OpenCV counts it;
        NaN of none.
        """
        residual_px = self.residual_px[self.kept & (self.seen.camera == camera)]
        if not len(residual_px):
            return np.nan
        return float(np.sqrt(np.mean(np.sum(residual_px**2, axis=1))))


def adjust_coarse(state: BundleState, seen: Sightings, board: Board, priors: Priors) -> Adjustment:
    """Adjust robustly and once, to see how large each camera's model error is.

    Raises Refused where the views contradict each other from the start.
    """
    error = np.full(len(state.lens), _FIRST_ERROR_PX)
    solution, error, priors = _adjust_robustly(state, seen, board, priors, error)
    kept = np.ones(len(seen), dtype=bool)
    weighted = seen.with_error(np.full(len(state.lens), _FIRST_ERROR_PX))
    return Adjustment(solution, weighted, kept, solution.residual_px, error, priors)


def adjust_with_noise(
    state: BundleState,
    seen: Sightings,
    board: Board,
    priors: Priors,
    *,
    error_px: np.ndarray | None = None,
    rounds: int | None = None,
) -> Adjustment:
    """Adjust robustly, learn each camera's model error, drop outliers once, and adjust by least
    squares.

    Where the state has a trajectory, priors.picture_sigma is where the search for the scatter of what is
    each camera's pictures' own begins. error_px (C,): model errors to begin with. rounds: of learning the
    noise anew, where it is nearly known. Raises Refused where no corner agrees with the others.
    """
    error = np.full(len(state.lens), _FIRST_ERROR_PX) if error_px is None else error_px
    for _ in range(rounds or (_ROUNDS if state.trajectory is None else _ROUNDS_MOVING)):
        solution, error, priors = _adjust_robustly(state, seen, board, priors, error)
        state = solution.state
    return _without_outliers(solution, seen, board, priors, error)


def _adjust_robustly(
    state: BundleState, seen: Sightings, board: Board, priors: Priors, error: np.ndarray
) -> tuple[Solution, np.ndarray, Priors]:
    """Adjust robustly with model errors (C,), px; return the solution, and the errors and priors that
    its residuals show.
    """
    solution = adjust_bundle(
        state, seen.with_error(error), board, priors, width=ROBUST_WIDTH, tolerance=1e-4
    )
    if not np.isfinite(solution.cost):
        raise Refused(
            "the views contradict each other from the start: is this the board as described?"
        )
    if state.trajectory is not None:
        priors = _with_scatter(priors, solution, seen)
    return solution, _error_by_median(solution.residual_px, seen, len(error)), priors


def _without_outliers(
    solution: Solution, seen: Sightings, board: Board, priors: Priors, error: np.ndarray
) -> Adjustment:
    """Drop outliers and adjust by least squares, from a robust solution and its model errors (C,).

    Raises Refused where no corner is left.
    """
    residual_px = solution.residual_px
    kept = _inliers(residual_px, seen.with_error(error))
    if not kept.any():
        raise Refused("no corner agrees with the others: is this the board as described?")
    for _ in range(2):
        fitted = solution.fitted_points + solution.fitted_pictures.sum()
        error = _error_by_mean(residual_px, seen, kept, error, priors, fitted)
        priors = _with_print_errors(priors, solution)
        weighted = seen.with_error(error)
        solution = adjust_bundle(solution.state, weighted.select(kept), board, priors)
        residual_px = seen.px - predict(solution.state, seen, board)[0]
    solution = replace(solution, residual_px=residual_px)
    return Adjustment(solution, weighted, kept, residual_px, error, priors)


def _with_scatter(priors: Priors, solution: Solution, seen: Sightings) -> Priors:
    """Return the priors with each camera's scatter of what is its pictures' own as the fitted values have
    it (MacKay, Neural Computation 4, 415, 1992).

    A camera with few pictures that may stray gets the scatter of all.
    """
    squared, count = _squares_of_pictures(solution.state, seen)
    sigma = priors.picture_sigma.copy()  # (C, 7)
    for columns in _OF_ONE_SCATTER:
        own_squared = squared[:, columns].sum(axis=1)
        own_fitted = solution.fitted_pictures[:, columns].sum(axis=1)
        if own_fitted.sum() < _LEAST_FITTED:
            continue
        overall = np.sqrt(own_squared.sum() / own_fitted.sum())
        for c in range(len(sigma)):
            scatter = overall
            if count[c] >= _MIN_LATE and own_fitted[c] >= _LEAST_FITTED:
                scatter = np.sqrt(own_squared[c] / own_fitted[c])
            sigma[c, columns] = max(scatter, _LEAST_LATE_SHARE * overall)
    return replace(priors, picture_sigma=sigma)


def _squares_of_pictures(state: BundleState, seen: Sightings) -> tuple[np.ndarray, np.ndarray]:
    """Return of each camera the sum of squares (C, 7) of what is its pictures' own, and of how many
    pictures that may stray, (C,).
    """
    squared = np.zeros((len(state.lens), N_PICTURE))
    count = np.zeros(len(squared), dtype=int)
    starts = seen.shot_starts()
    may_stray = state.trajectory.may_stray(seen.view[starts], seen.camera[starts])
    view = seen.view[starts][may_stray]
    camera = seen.camera[starts][may_stray]
    np.add.at(squared, camera, state.pictures[view, camera] ** 2)
    np.add.at(count, camera, 1)
    return squared, count


def _with_print_errors(priors: Priors, solution: Solution) -> Priors:
    """Return the priors with the scatter of the board's points as the fitted points have it (MacKay,
    Neural Computation 4, 415, 1992)."""
    if solution.fitted_points < _LEAST_FITTED:
        return priors
    squared_mm2 = np.sum(solution.state.points_mm**2) / solution.fitted_points
    return replace(priors, point_sigma_mm=max(float(np.sqrt(squared_mm2)), _LEAST_POINT_SIGMA_MM))


def _error_by_median(residual: np.ndarray, seen: Sightings, n_cameras: int) -> np.ndarray:
    """Return each camera's model error (C,), px, by the median of its squared residuals."""
    excess = np.sum(residual**2, axis=1) / _MEDIAN_SQUARED - seen.sigma_px**2
    variances = np.zeros(n_cameras)
    for c in range(n_cameras):
        own = excess[seen.camera == c]
        if len(own):
            variances[c] = max(np.median(own), 0.0)
    return np.sqrt(variances)


def _inliers(residual: np.ndarray, weighted: Sightings) -> np.ndarray:
    """Return the mask (n,) of corners within the rejection limit, in pictures that keep enough of
    them.
    """
    kept = np.sum(residual**2, axis=1) < (REJECT_SIGMA * weighted.sigma_px) ** 2
    starts = weighted.shot_starts()
    count = np.add.reduceat(kept.astype(int), starts)
    sizes = np.diff(np.append(starts, len(kept)))
    return kept & np.repeat(count >= _MIN_SHOT, sizes)


def _error_by_mean(
    residual,
    seen: Sightings,
    kept: np.ndarray,
    error: np.ndarray,
    priors: Priors,
    fitted: float,
) -> np.ndarray:
    """Return each camera's model error (C,), px, at which the kept residuals' mean square is what
    so many fitted parameters of points and pictures leave of it, and all of cameras, board and views.
    """
    parameters = priors.free.sum() + 6 * priors.view_free.sum() + fitted
    freedom = max(1.0 - parameters / max(2 * kept.sum(), 1), _LEAST_FREEDOM)
    squared = np.sum(residual**2, axis=1) / freedom
    errors = np.zeros(len(error))
    for c in range(len(error)):
        rows = kept & (seen.camera == c)
        errors[c] = _matching_error(squared[rows], seen.sigma_px[rows])
    return errors


def _matching_error(squared: np.ndarray, sigma: np.ndarray) -> float:
    """Return e ≥ 0 with mean(squared / (2 (sigma² + e²))) = 1; 0 where sigma alone explains the
    squares.
    """

    def excess(variance: float) -> float:
        """Return the mean square over the one that this e² explains, less 1."""
        return float(np.mean(squared / (2 * (sigma**2 + variance)))) - 1.0

    if not len(squared) or excess(0.0) <= 0:
        return 0.0
    largest = float(np.mean(squared))
    return float(np.sqrt(brentq(excess, 0.0, largest, xtol=_ROOT_PRECISION * largest)))
