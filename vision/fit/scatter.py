"""How the wire's line points scatter about a fit, and how correlated neighbours are: sigmas by
residuals.

A point errs by its noise and by what its neighbours share: what is behind the wire, and its light.
In path-traced frames neighbours along the wire are nearly independent while the same place of the
next frames has an error in common with it by two fifths; in rasterised ones both are less. So it is
measured, for each camera of each whisk.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.fit.problem import Problem, State, point_rows
from vision.fit.solve import residuals
from vision.geometry.robust import robust_sigma

# [sigma] Of the camera's scatter: an outlier is not what all share. Study: coverage.py points.
_CLIP_SIGMAS = 3.0
# [1] A correlation that is less is the noise of some hundred points. Derived.
_NO_MORE = 0.05
# [points] How far apart neighbours are compared, at most. By 4 or 16 a slip moves by 0.07 sigma, its
# sigma by 8 %. Study: thresholds.py fit.scatter _MOST_STEPS ….
_MOST_STEPS = 8
# [1] The most that a variance grows by for neighbours. By 4 a slip moves by 0.03 sigma, its sigma by
# 4 %; 16 moves nothing. Study: thresholds.py fit.scatter _MOST_ALIKE ….
_MOST_ALIKE = 8.0
# [mm] Of the place along the wire, for the same place in other frames: about a piece. Study:
# coverage.py points.
_BIN_MM = 2.5


@dataclass(frozen=True)
class PointScatter:
    """Scatter of one camera's wire points.

    sigma_px: their standard deviation about the fit. along, over_frames: factors by which errors
    that neighbours along the wire share, and those that a place shares over frames, make the
    variance of a mean larger; 1 where there are none.
    """

    sigma_px: float
    along: float
    over_frames: float

    @property
    def neighbour_correlation(self) -> float:
        """Return the correlation of neighbours along the wire that makes `along` of a mean."""
        return (self.along - 1.0) / (self.along + 1.0)


def inflated_by_residuals(problem: Problem, state: State, least_shared: float = 1.0) -> Problem:
    """Return the problem with the wire points' sigmas by their residuals, and shared errors counted
    once.

    The excess over the points' own sigmas is one figure a camera (median of the residuals, so that
    outliers do not set it). state: what was fitted to these points. least_shared: the least factor
    by which shared errors make the variance of a mean larger.
    """
    residuals = _residuals_px(problem, state)
    scatter = []
    excess_px = []
    factor = []
    for camera in range(len(problem.cameras)):
        own = _scatter(problem, residuals, camera)
        stated_px = _stated_sigma_px(problem, camera)
        scatter.append(own)
        excess_px.append(float(np.sqrt(max(own.sigma_px**2 - stated_px**2, 0.0))))
        factor.append(float(np.sqrt(max(own.along * own.over_frames, least_shared))))
    seen = []
    for one in problem.seen:
        if one.on_wire:
            sigma_px = np.hypot(one.points.sigma_px, excess_px[one.camera]) * factor[one.camera]
            one = replace(one, points=replace(one.points, sigma_px=sigma_px))
        seen.append(one)
    correlation = [own.neighbour_correlation for own in scatter]
    return replace(problem, seen=seen, neighbour_correlation=correlation)


def scatter_px(problem: Problem, state: State) -> list[float]:
    """Return the standard deviation in px of each camera's wire points about the fit, by their
    median; 0 where it has none.
    """
    residuals = _residuals_px(problem, state)
    cameras = range(len(problem.cameras))
    return [_sigma_px(_of_wire(problem, residuals, camera)) for camera in cameras]


def _residuals_px(problem: Problem, state: State) -> list[np.ndarray]:
    """Return the residuals (n,) px of each of the problem's observations."""
    over_sigma = residuals(problem, state)
    return [over_sigma[rows] * seen.points.sigma_px for seen, rows in point_rows(problem)]


def _of_wire(problem: Problem, values: Sequence, camera: int) -> list:
    """Select of values, one for each observation, those of the wire in one camera, frame by
    frame.
    """
    is_own = [seen.camera == camera and seen.on_wire for seen in problem.seen]
    return [value for value, own in zip(values, is_own) if own]


def _sigma_px(residuals: Sequence[np.ndarray]) -> float:
    """Return the robust sigma of all residuals; 0 of none."""
    return robust_sigma(np.concatenate(residuals)) if residuals else 0.0


def _scatter(problem: Problem, residuals: Sequence[np.ndarray], camera: int) -> PointScatter:
    """Return the scatter of one camera's wire points, by the residuals (n,) px of all
    observations.
    """
    own = _of_wire(problem, residuals, camera)
    sigma = _sigma_px(own)
    if sigma == 0.0:
        return PointScatter(sigma, 1.0, 1.0)
    clipped = [np.clip(values / sigma, -_CLIP_SIGMAS, _CLIP_SIGMAS) for values in own]
    by_place = []
    for seen, values in zip(_of_wire(problem, problem.seen, camera), clipped):
        by_place.append(_binned(seen.points.place, values, problem.wire.length_mm))
    return PointScatter(sigma, _inflation(_padded(clipped)), _inflation(np.transpose(by_place)))


def _padded(rows: Sequence[np.ndarray]) -> np.ndarray:
    """Return rows of unequal length as one array (k, n), NaN where a row has ended."""
    padded = np.full((len(rows), max(map(len, rows))), np.nan)
    for row, values in zip(padded, rows):
        row[: len(values)] = values
    return padded


def _binned(place_mm: np.ndarray, values: np.ndarray, length_mm: float) -> np.ndarray:
    """Return the mean (n,) of the values in each segment of the wire, NaN where there is none."""
    edges = np.arange(0.0, length_mm + _BIN_MM, _BIN_MM)
    count = np.histogram(place_mm, edges)[0]
    total = np.histogram(place_mm, edges, weights=values)[0]
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _inflation(rows: np.ndarray) -> float:
    """Return how much larger the variance of a row's mean is than were its values (k, n)
    independent.

    It follows from the correlations of neighbours, up to the first that is none. NaN is no value.
    """
    power = np.nanmean(rows**2)
    length = rows.shape[1]
    inflation = 1.0
    for step in range(1, min(_MOST_STEPS, length - 1) + 1):
        products = rows[:, step:] * rows[:, :-step]
        if not np.any(np.isfinite(products)):
            break
        correlation = np.nanmean(products) / power
        if correlation < _NO_MORE:
            break
        inflation += 2.0 * correlation * (1.0 - step / length)
    return float(min(inflation, _MOST_ALIKE))


def _stated_sigma_px(problem: Problem, camera: int) -> float:
    """Return the median sigma of a camera's wire points; 0 where it has none."""
    own = [seen.points.sigma_px for seen in _of_wire(problem, problem.seen, camera)]
    return float(np.median(np.concatenate(own))) if own else 0.0
