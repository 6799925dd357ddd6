"""The saddle: where two printed edges cross, fitted to the grey picture.

Model, with e1, e2 the distances of a pixel from the two edges through the corner (x0, y0):

    grey = level + gx dx + gy dy + contrast · erf(e1 / (√2 s1)) · erf(e2 / (√2 s2))

Ten parameters: corner, the two edges' directions and blurs, contrast, level and the light's slope.
The pattern is the same after half a turn, so whatever the blur is, it moves no corner. All corners
of a picture are fitted side by side (Levenberg–Marquardt, a damping each), to the pixels along the
edges and away from the markers.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.ndimage import convolve1d

from vision.boards.edge_pixels import Windows

# [px] A fit that runs farther than this from OpenCV's corner found another. Moves nothing on the
# fixtures between 2 and 8. Study: thresholds.py boards.saddle _MAX_SHIFT_PX ….
_MAX_SHIFT_PX = 4.0
# [squares] The same on small boards. Moves nothing on the fixtures between 0.15 and 0.6. Study:
# thresholds.py boards.saddle _MAX_SHIFT_SQUARES ….
_MAX_SHIFT_SQUARES = 1.0 / 3.0
# [pixels] Four times the ten parameters. Moves nothing on the fixtures between 10 and 160.
# Study: thresholds.py boards.saddle _MIN_PIXELS ….
_MIN_PIXELS = 40
# [1] Against what the model leaves over, and against rounding. Moves nothing on the fixtures
# between 1.5 and 6. Study: thresholds.py boards.saddle _LEAST_CONTRAST ….
_LEAST_CONTRAST = 3.0
# [grey levels] Sigma of rounding to whole levels, 1/√12. Derived.
_ROUNDING = 0.3
# [steps] The fit ends before: most corners take 8, those as sharp as a pixel up to 40. Study:
# thresholds.py boards.saddle _ITERATIONS ….
_ITERATIONS = 50
# [corners] Evaluated together: arrays that stay in the processor's cache. No result depends on it.
# Study: tests/studies/speed/beside.py.
_BATCH = 12
# [px] A tenth of a good corner's sigma. Moves nothing on the fixtures between 0.0005 and 0.01.
# Study: thresholds.py boards.saddle _CONVERGED_PX ….
_CONVERGED_PX = 2e-3
# [px] Where the fit starts. Moves nothing on the fixtures between 0.6 and 2. Study: thresholds.py
# boards.saddle _FIRST_BLUR_PX ….
_FIRST_BLUR_PX = 1.0
# [px] Softer is no edge. 4 and 12 leave the fixtures as they are. Study:
# thresholds.py boards.saddle _MOST_BLUR_PX ….
_MOST_BLUR_PX = 8.0
# [px] How far apart two pixels' noise is still correlated. z of rig corners 1.18, 1.13, 1.15 with
# 1, 3, 5. Study: thresholds.py boards.saddle LAGS ….
LAGS = 3
# [px] Blurs of the search. The least is a pixel's own aperture, 1/√12: no edge is sharper, and one
# that were would lie between two pixels' middles at no place of its own. Derived.
_BLUR_SEARCH_PX = (0.29, 20.0)

# [columns] Of the parameters: the corner. A layout, no threshold.
PLACE = slice(0, 2)
# [columns] Directions of both edges. A layout, no threshold.
TURN = slice(2, 4)
# [columns] Logarithms of both edges' blurs. A layout, no threshold.
BLUR = slice(4, 6)
# [columns] What the grey depends on linearly: contrast, level and slope. A layout, no threshold.
LINEAR = slice(6, 10)
# [columns] The light's slope along x and y. A layout, no threshold.
SLOPE = slice(8, 10)
CONTRAST, LEVEL = range(6, 8)
# [columns] Of a saddle besides its place: they converge with it, so that their last step is not looked
# at. A layout, no threshold.
_BESIDES_PLACE = slice(2, 10)

# [1] Of the error function: Abramowitz and Stegun, Handbook of Mathematical Functions, 7.1.26. Derived.
_ERF_P = 0.3275911
# [1] The same formula's polynomial, from k on. Derived.
_ERF_A = (0.254829592, -0.284496736, 1.421413741, -1.453152027, 1.061405429)

# Grey (n, k) of windows by parameters (n, m), and its Jacobian (n, m, k).
Predict = Callable[[Windows, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Saddles:
    """Fitted corners, a row each.

    px (n, 2). sigma_px (n,): one standard deviation per axis. contrast, misfit (n,): grey levels.
    blur_px (n,): one sigma of a Gaussian. converged (n,): whether the fit found a corner.
    """

    px: np.ndarray
    sigma_px: np.ndarray
    contrast: np.ndarray
    blur_px: np.ndarray
    misfit: np.ndarray
    converged: np.ndarray


def fit_saddles(windows: Windows, axes: np.ndarray, px_guess: np.ndarray) -> Saddles:
    """Fit the corner nearest each guess (n, 2) px; windows and axes are as of `cut_windows`."""
    quick = windows.in_single_precision()  # a step errs by less than 1e-6 px
    start = start_parameters(quick, px_guess, axes)
    parameters, converged = fit_windows(quick, start, predict_saddles)
    saddles = report_fit(windows, parameters, converged, predict_saddles)
    plausible = converged & _is_plausible(saddles, px_guess, axes)
    has_pixels = windows.weight.sum(axis=1) >= _MIN_PIXELS
    return replace(saddles, converged=plausible & has_pixels)


def start_parameters(windows: Windows, px_guess: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return the parameters (n, 10) that the fit starts from.

    Edges as the homography has them; contrast, level and slope by least squares.
    """
    p = np.zeros((len(px_guess), 10))
    p[:, PLACE] = px_guess - windows.anchor
    # Edge 1 runs along board y, edge 2 along board x; each is named by the direction of its normal.
    normal_1 = np.arctan2(-axes[:, 0, 1], axes[:, 1, 1])
    normal_2 = np.arctan2(axes[:, 0, 0], -axes[:, 1, 0])
    p[:, TURN] = np.column_stack([normal_1, normal_2])
    p[:, BLUR] = np.log(_FIRST_BLUR_PX)
    p[:, CONTRAST] = 1.0
    return with_linear_part(windows, p, predict_saddles)


def with_linear_part(windows: Windows, p: np.ndarray, predict: Predict) -> np.ndarray:
    """Return parameters p (n, 10) with contrast, level and slope by least squares."""
    fit = _evaluate(windows, p.copy(), predict)
    normal = fit.normal[:, LINEAR, LINEAR]
    fit.p[:, LINEAR] += _solve(normal, fit.gradient[:, LINEAR], np.zeros(len(p)))
    return fit.p


def predict_saddles(windows: Windows, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Predict the grey (n, k) by the parameters p (n, 10), with its Jacobian (n, 10, k)."""
    offset = windows.offset - p[:, PLACE, None]  # (n, 2, k) px from the corner
    normals, tangents = _directions(p[:, TURN])
    # A copy, because NumPy 1.26 takes a strided column's exp otherwise, by 1e-16, where its result
    # happens to lie right behind in memory.
    blur_px = np.exp(p[:, BLUR, None].copy())
    distance_px = normals @ offset  # (n, 2, k) from each edge
    edges, by_t = _blurred_edge(distance_px / blur_px)
    # Each edge is multiplied by the other.
    by_distance = p[:, CONTRAST, None, None] / blur_px * by_t * edges[:, ::-1]
    J = np.empty((len(p), 10, offset.shape[2]), dtype=p.dtype)
    J[:, PLACE] = -normals.transpose(0, 2, 1) @ by_distance
    J[:, TURN] = by_distance * (tangents @ offset)
    J[:, BLUR] = -by_distance * distance_px
    J[:, CONTRAST] = edges[:, 0] * edges[:, 1]
    return in_light(offset, p, J), J


def _blurred_edge(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the grey at distances t from an edge, in blurs, −1 to 1, which is erf(t/√2); and its slope.

    By Abramowitz and Stegun, 7.1.26, to 1.5e-7, as the Gaussian is needed in any case: with SciPy's erf
    a picture takes a tenth longer.
    """
    gaussian = np.exp(-0.5 * t**2)
    k = 1.0 / (1.0 + _ERF_P * math.sqrt(0.5) * np.abs(t))
    beyond = np.full_like(k, _ERF_A[-1])  # by Horner's scheme
    for a in _ERF_A[-2::-1]:
        beyond *= k
        beyond += a
    return np.copysign(1.0 - beyond * k * gaussian, t), math.sqrt(2.0 / math.pi) * gaussian


def _directions(turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the normals of edges turned by (n, 2), and their tangents, (n, 2, 2), a row an edge."""
    cosine = np.cos(turn)
    sine = np.sin(turn)
    return np.stack([cosine, sine], axis=2), np.stack([-sine, cosine], axis=2)


def in_light(offset: np.ndarray, p: np.ndarray, J: np.ndarray) -> np.ndarray:
    """Return the grey (n, k) of marks in light with a slope, and complete its Jacobian (n, 10, k) in
    place.

    offset (n, 2, k): px from the mark. J: of marks in even light; its column of the contrast is the
    mark itself.
    """
    J[:, PLACE] -= p[:, SLOPE, None]
    J[:, LEVEL] = 1.0
    J[:, SLOPE] = offset
    grey = p[:, None, LINEAR] @ J[:, LINEAR]
    return grey[:, 0]


def _normal_equations(
    J: np.ndarray, residual: np.ndarray, weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return JᵀWJ (n, m, m) and JᵀWr (n, m) for J (n, m, k)."""
    JW = J * weight[:, None, :]
    gradient = JW @ residual[:, :, None]
    return JW @ J.transpose(0, 2, 1), gradient[:, :, 0]


def _solve(normal: np.ndarray, gradient: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Return Marquardt's step (n, m).

    The diagonal is raised by `damping` (n,) times itself, and never left at zero.
    """
    raised = normal.copy()
    diagonal = np.einsum("nii->ni", raised)
    diagonal += diagonal * damping[:, None] + 1e-9 * (1.0 + diagonal)
    return np.linalg.solve(raised, gradient[:, :, None])[:, :, 0]


def fit_windows(
    windows: Windows, start: np.ndarray, predict: Predict
) -> tuple[np.ndarray, np.ndarray]:
    """Fit all corners side by side: return their parameters (n, m) and which converged (n,).

    start (n, m): parameters to begin with, those of a saddle first. predict: the model. Levenberg
    and Marquardt's method; corners leave the iteration as they converge. (SciPy would fit one corner
    at a time.)
    """
    fit = _evaluate(windows, start.copy(), predict)
    damping = np.full(len(start), 1e-3)
    converged = np.zeros(len(start), dtype=bool)
    for _ in range(_ITERATIONS):
        active = np.flatnonzero(~converged)
        if not len(active):
            break
        step = fit.step(active, damping)
        there = _within_search(fit.p[active] + step)
        trial = _evaluate(windows.select(active), there, predict)
        is_better = trial.cost <= fit.cost[active]
        fit.accept(active, trial, is_better)
        damping[active] *= np.where(is_better, 0.2, 10.0)
        # The place, and what a model has beyond a saddle.
        judged = np.delete(step, _BESIDES_PLACE, axis=1)
        converged[active] = np.linalg.norm(judged, axis=1) < _CONVERGED_PX
    return fit.p, converged


def _within_search(p: np.ndarray) -> np.ndarray:
    """Return the parameters (n, m) with blurs within the limits of the search."""
    limited = p.copy()
    limited[:, BLUR] = np.clip(p[:, BLUR], *np.log(_BLUR_SEARCH_PX))
    return limited


class _Fit(NamedTuple):
    """A state of the fit: parameters p (n, m), cost (n,), JᵀWJ (n, m, m) and JᵀWr (n, m)."""

    p: np.ndarray
    cost: np.ndarray
    normal: np.ndarray
    gradient: np.ndarray

    def step(self, rows: np.ndarray, damping: np.ndarray) -> np.ndarray:
        """Return Marquardt's step (rows, m) of some corners.

        A blur at a limit of the search stays there where its gradient leads beyond.
        """
        gradient = self.gradient[rows]
        least, most = np.log(_BLUR_SEARCH_PX)
        log_blur = self.p[rows, BLUR]
        is_free = np.ones(gradient.shape, dtype=bool)
        is_free[:, BLUR] &= (log_blur > least) | (gradient[:, BLUR] > 0.0)
        is_free[:, BLUR] &= (log_blur < most) | (gradient[:, BLUR] < 0.0)
        normal = self.normal[rows] * (is_free[:, :, None] & is_free[:, None, :])
        return _solve(normal, gradient * is_free, damping[rows])

    def accept(self, rows: np.ndarray, trial: "_Fit", is_better: np.ndarray) -> None:
        """Take over the corners that are better in a trial of some corners (rows,), in place."""
        for values, trial_values in zip(self, trial):
            values[rows[is_better]] = trial_values[is_better]


def _evaluate(windows: Windows, p: np.ndarray, predict: Predict) -> _Fit:
    """Return the state of the fit of a model at its parameters p (n, m)."""
    corners, count = p.shape
    normal = np.empty((corners, count, count))
    fit = _Fit(p, np.empty(corners), normal, np.empty((corners, count)))
    for rows, some in _in_batches(windows):
        grey, J = predict(some, p[rows].astype(some.grey.dtype))
        residual = some.grey - grey
        fit.cost[rows] = np.sum(some.weight * residual**2, axis=1, dtype=float)
        fit.normal[rows], fit.gradient[rows] = _normal_equations(J, residual, some.weight)
    return fit


def _in_batches(windows: Windows) -> Iterator[tuple[slice, Windows]]:
    """Yield the windows of some corners at a time, and their rows."""
    for first in range(0, len(windows.grey), _BATCH):
        rows = slice(first, first + _BATCH)
        yield rows, windows.select(rows)


def report_fit(windows: Windows, p: np.ndarray, converged: np.ndarray, predict: Predict) -> Saddles:
    """Return the corners of the parameters p (n, 10) of a model, with their sigmas."""
    residual, influence = _residuals_and_influences(windows, p, predict)
    freedom = np.maximum(windows.weight.sum(axis=1) - p.shape[1], 1)
    misfit = np.sqrt(np.sum(residual**2, axis=1) / freedom)
    unit_residual = residual / np.maximum(misfit, 1e-9)[:, None]
    return Saddles(
        px=windows.anchor + p[:, PLACE],
        sigma_px=misfit * _sigma_per_grey(windows, unit_residual, influence),
        contrast=p[:, CONTRAST],
        blur_px=np.exp(p[:, BLUR].mean(axis=1)),
        misfit=misfit,
        converged=converged,
    )


def _residuals_and_influences(
    windows: Windows, p: np.ndarray, predict: Predict
) -> tuple[np.ndarray, np.ndarray]:
    """Return each pixel's residual (n, k), and its influence on the corner's place (n, 2, k), which is
    (JᵀWJ)⁻¹ JᵀW.
    """
    residual = np.empty(windows.grey.shape)
    influence = np.empty(windows.offset.shape)
    for rows, some in _in_batches(windows):
        grey, J = predict(some, p[rows])
        residual[rows] = some.weight * (some.grey - grey)
        normal, _ = _normal_equations(J, some.grey - grey, some.weight)
        inverse = np.linalg.pinv(normal, hermitian=True)
        influence[rows] = inverse[:, PLACE] @ J * some.weight[:, None, :]
    return residual, influence


def _is_plausible(saddles: Saddles, px_guess: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return which corners lie near their guess and have edges that can be printed ones, (n,)."""
    has_sigma = (saddles.sigma_px > 0) & np.isfinite(saddles.sigma_px)
    shift_px = np.linalg.norm(saddles.px - px_guess, axis=1)
    square_px = np.linalg.norm(axes, axis=1).min(axis=1)
    is_near = shift_px < np.minimum(_MAX_SHIFT_PX, _MAX_SHIFT_SQUARES * square_px)
    noise = np.maximum(saddles.misfit, _ROUNDING)
    stands_out = np.abs(saddles.contrast) > _LEAST_CONTRAST * noise
    is_sharp = saddles.blur_px < _MOST_BLUR_PX
    return has_sigma & is_near & stands_out & is_sharp


def _sigma_per_grey(
    windows: Windows, unit_residual: np.ndarray, influence: np.ndarray
) -> np.ndarray:
    """Return a corner's sigma per axis for pixel noise of one grey level, (n,).

    Noise of neighbouring pixels is correlated (demosaicing, compression, a soft lens before a noisy
    codec), which a plain (JᵀJ)⁻¹ neglects: by it sigmas were 2.4 times too small. With the
    influence a (n, 2, k) of each pixel on the corner, the variance is aᵀ C a, C being the
    residuals' own correlation, taken as separable.
    """
    residual = windows.on_grid(unit_residual[:, None])
    a = windows.on_grid(influence)
    Ca = a
    for axis in (3, 2):
        Ca = convolve1d(Ca, _correlation(residual, axis), axis=axis, mode="constant")
    variance = np.mean(np.sum(a * Ca, axis=(2, 3)), axis=1)  # of both axes
    return np.sqrt(np.maximum(variance, 0.0))


def _correlation(residual: np.ndarray, axis: int) -> np.ndarray:
    """Return the correlation (2 LAGS + 1,) of residuals on grids at lags along an axis.

    It is that of all corners together; cells that are 0 have no residual.
    """
    residual = np.ascontiguousarray(np.moveaxis(residual, axis, 0))
    is_used = residual != 0.0
    means = []
    for lag in range(LAGS + 1):
        stop = len(residual) - lag
        pairs = np.count_nonzero(is_used[:stop] & is_used[lag:])
        means.append(np.vdot(residual[:stop], residual[lag:]) / max(pairs, 1))
    one_sided = np.array(means) / max(means[0], 1e-12)
    return np.concatenate([one_sided[:0:-1], one_sided])
