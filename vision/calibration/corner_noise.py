"""How large the corners' errors are, learned from the residuals, and which corners are no corners.

A corner's variance is (sigma of its own fit)² + (model error of its camera)². The model error stands for
what a corner's fit cannot know: print, lens beyond its terms, blur, motion. It is first read from the
median of the residuals, which half of the corners being wrong does not move; corners beyond REJECT_SIGMA of
that are left out once; then it is what makes the mean square of the rest one. Rejecting again by the
smaller figure would eat the data from the tails inward.
"""

from dataclasses import dataclass, replace

import numpy as np

from vision.calibration.adjust import Solution, adjust_bundle
from vision.calibration.bundle import BundleState, Priors, Sightings, predict
from vision.geometry.refusals import Refused

# [sigma] One Gaussian corner in 25 000 lies beyond (two axes): exp(−4.5²/2). Points of the rig
# err by 0.017 px at 3.5, by 0.016 at 4.5 and 6. Study: thresholds.py calibration.corner_noise
# REJECT_SIGMA ….
REJECT_SIGMA = 4.5
# [sigma] Of Cauchy's loss while outliers are still in: 95 % efficient on Gaussian noise at 2.4.
# moves nothing on the fixtures between 2 and 5. Study: thresholds.py calibration.corner_noise
# _ROBUST_WIDTH ….
_ROBUST_WIDTH = 3.0
# [px] Before anything is known of the residuals. moves nothing on the fixtures between 0.1 and
# 1.0. Study: thresholds.py calibration.corner_noise _FIRST_ERROR_PX ….
_FIRST_ERROR_PX = 0.3
# [1] Median of the squared length of a two-dimensional Gaussian of unit sigma. Derived.
_MEDIAN_SQUARED = 2 * np.log(2)
# [rounds] Of adjusting and learning the noise anew; instants and their scatter settle more
# slowly. Study: cameras.py.
_ROUNDS, _ROUNDS_MOVING = 2, 5
# [corners] A shot with fewer says less than the six parameters of its pose. Derived.
_MIN_SHOT = 4
# [instants] Fewer give no scatter. Derived.
_MIN_LATE = 8
# [1] Of all cameras' lateness, below which none is taken: no camera is exactly on time. Set by
# eye.
_LEAST_LATE_SHARE = 0.02
# [1] Of the residuals' number, left over however many parameters are fitted: keeps the model
# error finite. Stated.
_LEAST_FREEDOM = 0.1
# [steps] Of a bisection: 2⁻⁵⁰ is rounding. Derived.
_HALVINGS = 50


@dataclass(frozen=True, eq=False)
class Settled:
    """An adjustment with its noise: the solution over the kept corners, `seen` with the sigmas used (all
    corners), kept (n,) bool, residual_px (n, 2) of all corners, error_px (C,) model error of each camera, known as
    used."""

    solution: Solution
    seen: Sightings
    kept: np.ndarray
    residual_px: np.ndarray
    error_px: np.ndarray
    priors: Priors

    def rms_px(self, camera: int) -> float:
        """Root mean square length of the kept residuals of one camera, as OpenCV counts it."""
        rows = self.kept & (self.seen.camera == camera)
        return (
            float(np.sqrt(np.mean(np.sum(self.residual_px[rows] ** 2, axis=1))))
            if rows.any()
            else np.nan
        )


def settle(
    state: BundleState,
    seen: Sightings,
    corners_mm: np.ndarray,
    priors: Priors,
    *,
    error_px: np.ndarray | None = None,
    rounds: int | None = None,
    rough: bool = False,
) -> Settled:
    """Adjusts robustly, learns each camera's model error, drops outliers once and adjusts by least squares.

    Where the state has a trajectory, priors.late_sigma_s is where the search for each camera's scatter of instants
    begins. error_px (C,): model errors to begin with. rounds: of learning the noise anew, where it is nearly known.
    rough: robustly and once only, to see how large the errors are. Raises Refused
    where no corner agrees with the others.
    """
    moving = state.trajectory is not None
    error = np.full(len(state.lens), _FIRST_ERROR_PX) if error_px is None else error_px
    for _ in range(rounds or (_ROUNDS_MOVING if moving else _ROUNDS)):
        weighed = _weighed(seen, error)
        solution = adjust_bundle(
            state, weighed, corners_mm, priors, width=_ROBUST_WIDTH, tolerance=1e-4
        )
        _require_finite(solution)
        state, error = solution.state, _error_by_median(solution.residual_px, seen, len(error))
        priors = _with_lateness(priors, state, seen) if moving else priors
        if rough:
            return Settled(
                solution,
                weighed,
                np.ones(len(seen), dtype=bool),
                solution.residual_px,
                error,
                priors,
            )
    kept = _inliers(solution.residual_px, _weighed(seen, error))
    if not kept.any():
        raise Refused("no corner agrees with the others: is this the board as described?")
    for _ in range(2):
        error = _error_by_mean(solution.residual_px, seen, kept, error, priors)
        used = _weighed(seen, error).chosen(kept)
        solution = adjust_bundle(state, used, corners_mm, priors)
        state = solution.state
        solution = replace(solution, residual_px=seen.px - predict(state, seen, corners_mm)[0])
    return Settled(solution, _weighed(seen, error), kept, solution.residual_px, error, priors)


def _require_finite(solution: Solution) -> None:
    if not np.isfinite(solution.cost):
        raise Refused(
            "the views contradict each other from the start: is this the board as described?"
        )


def _with_lateness(priors: Priors, state: BundleState, seen: Sightings) -> Priors:
    """Each camera's scatter of instants as the instants found have it; of pictures that give their view its time, none.

    A camera with few others keeps the scatter of all.
    """
    starts = seen.shot_starts()
    camera, view = seen.camera[starts], seen.view[starts]
    loose = ~state.trajectory.is_reference(view, camera)
    squared = np.where(loose, state.instants[view, camera] ** 2, np.nan)
    overall = np.nanmean(squared)
    of = [squared[loose & (camera == c)] for c in range(len(priors.late_sigma_s))]
    sigma = np.sqrt([np.mean(s) if len(s) >= _MIN_LATE else overall for s in of])
    return replace(priors, late_sigma_s=np.maximum(sigma, _LEAST_LATE_SHARE * np.sqrt(overall)))


def _weighed(seen: Sightings, error_px: np.ndarray) -> Sightings:
    return replace(seen, sigma_px=np.hypot(seen.sigma_px, error_px[seen.camera]))


def _error_by_median(residual: np.ndarray, seen: Sightings, n_cameras: int) -> np.ndarray:
    excess = np.sum(residual**2, axis=1) / _MEDIAN_SQUARED - seen.sigma_px**2
    medians = [
        np.median(excess[seen.camera == c]) if (seen.camera == c).any() else 0.0
        for c in range(n_cameras)
    ]
    return np.sqrt(np.maximum(medians, 0.0))


def _inliers(residual: np.ndarray, weighed: Sightings) -> np.ndarray:
    kept = np.sum(residual**2, axis=1) < (REJECT_SIGMA * weighed.sigma_px) ** 2
    starts = weighed.shot_starts()
    left = np.add.reduceat(kept.astype(int), starts)
    return kept & np.repeat(left >= _MIN_SHOT, np.diff(np.append(starts, len(kept))))


def _error_by_mean(
    residual, seen: Sightings, kept: np.ndarray, error: np.ndarray, priors: Priors
) -> np.ndarray:
    """Model error at which the kept residuals' mean square is what so many fitted parameters leave of it."""
    squared = np.sum(residual**2, axis=1)
    parameters = priors.free.sum() + 6 * priors.view_free.sum()
    parameters += len(seen.shot_starts()) if priors.late_sigma_s is not None else 0
    left = max(1.0 - parameters / max(2 * kept.sum(), 1), _LEAST_FREEDOM)
    return np.array(
        [
            _match(squared[rows] / left, seen.sigma_px[rows])
            for rows in _by_camera(seen, kept, len(error))
        ]
    )


def _by_camera(seen: Sightings, kept: np.ndarray, n_cameras: int) -> list[np.ndarray]:
    return [np.flatnonzero(kept & (seen.camera == c)) for c in range(n_cameras)]


def _match(squared: np.ndarray, sigma: np.ndarray) -> float:
    """e ≥ 0 with mean(squared / (2 (sigma² + e²))) = 1, by bisection on e²; 0 where sigma alone explains it."""
    if not len(squared) or np.mean(squared / (2 * sigma**2)) <= 1:
        return 0.0
    low, high = 0.0, float(np.mean(squared))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if np.mean(squared / (2 * (sigma**2 + middle))) > 1:
            low = middle
        else:
            high = middle
    return float(np.sqrt(high))
