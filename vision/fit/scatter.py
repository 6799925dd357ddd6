"""How the wire's line points scatter about a fit, and how alike neighbours err: their sigmas as residuals show them.

A point errs by its noise and by what its neighbours share: what is behind the wire, and its light. In path-traced
frames neighbours along the wire are nearly independent while the same place of the next frames errs alike by two
fifths; in rasterised ones both are less. So it is measured, for each camera of each whisk.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.fit.problem import Problem, State, point_rows
from vision.fit.solve import linear_at
from vision.geometry.robust import robust_sigma
from vision.wire.points import Observed

# [sigma] Of the camera's scatter: an outlier is not what all share. Study: coverage.py points.
_CLIP_SIGMAS = 3.0
# [1] A correlation that is less is the noise of some hundred points. Derived.
_NO_MORE = 0.05
# [points, 1] How far apart neighbours are compared, and the most that a variance grows by for
# them. Set by eye. Study: coverage.py points.
_MOST_STEPS, _MOST_ALIKE = 8, 8.0
# [mm] Of the place along the wire, for the same place in other frames: about a piece. Study:
# coverage.py points.
_BIN_MM = 2.5


@dataclass(frozen=True)
class Scatter:
    """Of one camera: standard deviation, px, of its points about the fit; by how much errors that neighbours along the
    wire share, and those that a place shares over frames, make the variance of a mean larger: 1 where there are none.
    """

    sigma_px: float
    along: float
    over_frames: float


def inflated_by_residuals(problem: Problem, state: State, least_shared: float = 1.0) -> Problem:
    """The same problem with the wire points' sigmas as large as their residuals show, and shared errors counted once.

    The excess over the points' own sigmas is one figure a camera (median of the residuals, so that outliers do
    not set it). state: what was fitted to these points. least_shared: what is shared makes the variance of a mean this
    many times as large at least.
    """
    residuals, cameras = _residuals_px(problem, state), range(len(problem.cameras))
    scatter = [_scatter(problem, residuals, camera) for camera in cameras]
    own = [_own_sigma_px(problem, camera) for camera in cameras]
    excess = [
        float(np.sqrt(max(seen.sigma_px**2 - few**2, 0.0))) for seen, few in zip(scatter, own)
    ]
    wider = [float(np.sqrt(max(one.along * one.over_frames, least_shared))) for one in scatter]
    seen = [
        _inflated(one, excess[one.camera], wider[one.camera]) if one.frame >= 0 else one
        for one in problem.seen
    ]
    return replace(
        problem,
        seen=seen,
        neighbour_correlation=[(one.along - 1.0) / (one.along + 1.0) for one in scatter],
    )


def scatter_px(problem: Problem, state: State) -> list[float]:
    """Standard deviation in px of each camera's wire points about the fit, by their median; 0 where it has none."""
    residuals = _residuals_px(problem, state)
    return [
        _sigma_px(_of_wire(problem, residuals, camera)) for camera in range(len(problem.cameras))
    ]


def _residuals_px(problem: Problem, state: State) -> list[np.ndarray]:
    """Of each of the problem's observations, (n,) px."""
    linear = linear_at(problem, state)
    return [linear.residual[rows] * seen.points.sigma_px for seen, rows in point_rows(problem)]


def _of_wire(problem: Problem, values: Sequence, camera: int) -> list:
    """Those of the values, one for each observation, that are of the wire in one camera, frame by frame."""
    return [
        value
        for value, seen in zip(values, problem.seen)
        if seen.camera == camera and seen.frame >= 0
    ]


def _sigma_px(residuals: Sequence[np.ndarray]) -> float:
    return robust_sigma(np.concatenate(residuals)) if residuals else 0.0


def _scatter(problem: Problem, residuals: Sequence[np.ndarray], camera: int) -> Scatter:
    mine = _of_wire(problem, residuals, camera)
    sigma = _sigma_px(mine)
    if sigma == 0.0:
        return Scatter(sigma, 1.0, 1.0)
    clipped = [np.clip(values / sigma, -_CLIP_SIGMAS, _CLIP_SIGMAS) for values in mine]
    places = [seen.points.place for seen in _of_wire(problem, problem.seen, camera)]
    by_place = np.array([_binned(*pair, problem.wire.length_mm) for pair in zip(places, clipped)])
    return Scatter(sigma, _inflation(_padded(clipped)), _inflation(by_place.T))


def _padded(rows: Sequence[np.ndarray]) -> np.ndarray:
    """Rows of unequal length as one array (k, n), NaN where a row has ended."""
    padded = np.full((len(rows), max(map(len, rows))), np.nan)
    for row, values in zip(padded, rows):
        row[: len(values)] = values
    return padded


def _binned(place_mm, values, length_mm: float) -> np.ndarray:
    """Mean (n,) of the values in each stretch of the wire, NaN where there is none."""
    edges = np.arange(0.0, length_mm + _BIN_MM, _BIN_MM)
    count = np.histogram(place_mm, edges)[0]
    total = np.histogram(place_mm, edges, weights=values)[0]
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _inflation(rows: np.ndarray) -> float:
    """How much larger the variance of a row's mean is than were its values (k, n) independent, by the correlations of
    neighbours; NaN is no value. Taken up to the first that is none."""
    power, length, whole = np.nanmean(rows**2), rows.shape[1], 1.0
    for step in range(1, min(_MOST_STEPS, length - 1) + 1):
        products = rows[:, step:] * rows[:, :-step]
        shared = np.nanmean(products) / power if np.any(np.isfinite(products)) else 0.0
        if shared < _NO_MORE:
            break
        whole += 2.0 * shared * (1.0 - step / length)
    return float(min(whole, _MOST_ALIKE))


def _own_sigma_px(problem: Problem, camera: int) -> float:
    """Median sigma of a camera's wire points; 0 where it has none."""
    mine = [seen.points.sigma_px for seen in _of_wire(problem, problem.seen, camera)]
    return float(np.median(np.concatenate(mine))) if mine else 0.0


def _inflated(seen: Observed, excess_px: float, wider: float) -> Observed:
    sigma = np.hypot(seen.points.sigma_px, excess_px) * wider
    return replace(seen, points=replace(seen.points, sigma_px=sigma))
