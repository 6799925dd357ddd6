"""The saddle: where two printed edges cross, fitted to the grey picture.

Model, with e1, e2 the distances of a pixel from the two edges through the corner (x0, y0):

    grey = level + gx dx + gy dy + contrast · erf(e1 / (√2 s1)) · erf(e2 / (√2 s2))

Ten parameters: corner, the two edges' directions and blurs, contrast, level and the light's slope. The
pattern is the same after half a turn, so whatever the blur is, it moves no corner. All corners of a picture
are fitted side by side (Levenberg–Marquardt, a damping each). Pixels taken are those along the edges and
away from the markers.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import convolve1d
from scipy.special import erf

# [px] Reach along the edges. A lens bends an edge by k1 x t²/f over the distance t, which moves
# the corner by a third of that at the arm's end: at 24 px 0.003 px for k1 = −0.1, f = 2000 px, x
# = 0.3, and 0.03 px in the corners of a webcam with k1 = −0.33. Shorter is noisier: drawn corners
# err by 0.024, 0.019 and 0.016 px at 16, 24 and 32. Study: thresholds.py boards.saddle REACH_PX
# ….
REACH_PX = 24
# [squares] Half a square, so that no two corners share a pixel's noise. Derived.
_ARM_SQUARES = 0.5
# [px] Pixels nearer to a marker hold its blur. Rig corners err by 0.035 px at 0.75, by 0.034 from
# 1.0 to 3.0. Study: thresholds.py boards.saddle _CLEAR_OF_MARKER_PX ….
_CLEAR_OF_MARKER_PX = 1.5
# [px] Pixels farther from an edge say nothing of it: drawn corners err by 0.026 px at 3, 0.019 at
# 6, 0.017 at 8 and 12. Study: thresholds.py boards.saddle _BAND_PX ….
_BAND_PX = 6.0
# [px] A fit that runs farther than this from OpenCV's corner found another. moves nothing on the
# fixtures between 2 and 8. Study: thresholds.py boards.saddle _MAX_SHIFT_PX ….
_MAX_SHIFT_PX = 4.0
# [squares] The same on small boards. moves nothing on the fixtures between 0.15 and 0.6. Study:
# thresholds.py boards.saddle _MAX_SHIFT_SQUARES ….
_MAX_SHIFT_SQUARES = 1.0 / 3.0
# [pixels] Over four times the nine parameters. moves nothing on the fixtures between 10 and 160.
# Study: thresholds.py boards.saddle _MIN_PIXELS ….
_MIN_PIXELS = 40
# [1] Against what the model leaves over, and against rounding. Origin not known; moves nothing on
# the fixtures between 1.5 and 6. Study: thresholds.py boards.saddle _LEAST_CONTRAST ….
_LEAST_CONTRAST = 3.0
# [grey levels] Sigma of rounding to whole levels, 1/√12. Derived.
_ROUNDING = 0.3
# [steps] The fit ends before. Corners are the same with 8 and with 30. Study: thresholds.py
# boards.saddle _ITERATIONS ….
_ITERATIONS = 15
# [px] A tenth of a good corner's sigma. moves nothing on the fixtures between 0.0005 and 0.01.
# Study: thresholds.py boards.saddle _CONVERGED_PX ….
_CONVERGED_PX = 2e-3
# [px] Where the fit starts. moves nothing on the fixtures between 0.6 and 2. Study: thresholds.py
# boards.saddle _FIRST_BLUR_PX ….
_FIRST_BLUR_PX = 1.0
# [px] Sharper is a pixel's edge, softer no edge. Origin not known; (0.4, 4) and (0.1, 12) leave
# the fixtures as they are. Study: thresholds.py boards.saddle _BLUR_LIMITS_PX ….
_BLUR_LIMITS_PX = (0.2, 8.0)
# [px] How far apart two pixels' noise still goes together. z of rig corners 1.18, 1.13, 1.15 with
# 1, 3, 5. Study: thresholds.py boards.saddle LAGS ….
LAGS = 3
# [px] Keeps a step of the fit within twice the limits above. Derived.
_BLUR_SEARCH_PX = (0.1, 20.0)

X, Y, TURN_1, TURN_2, BLUR_1, BLUR_2, CONTRAST, LEVEL, SLOPE_X, SLOPE_Y = range(10)


@dataclass(frozen=True, eq=False)
class Saddles:
    """Fitted corners, a row each: px (n, 2); sigma_px, contrast, blur_px, misfit (grey levels), converged: (n,)."""

    px: np.ndarray
    sigma_px: np.ndarray
    contrast: np.ndarray
    blur_px: np.ndarray
    misfit: np.ndarray
    converged: np.ndarray


@dataclass(frozen=True, eq=False)
class _Windows:
    """Pixels along each corner's edges, (n, k) each, padded with weight 0: offsets dx, dy from the anchor
    (n, 2), grey, weight 0 or 1."""

    anchor: np.ndarray
    dx: np.ndarray
    dy: np.ndarray
    grey: np.ndarray
    weight: np.ndarray

    def chosen(self, which: np.ndarray) -> "_Windows":
        return _Windows(*(getattr(self, name)[which] for name in self.__dataclass_fields__))


def fit_saddles(
    grey: np.ndarray, px_guess: np.ndarray, frames: np.ndarray, border: float
) -> Saddles:
    """Fits the corner nearest each guess.

    grey: (height, width). px_guess: (n, 2). frames: (n, 2, 2) px, one square along board x and y as seen at
    the corner (columns). border: clear rim between a square's edge and its marker, in squares.
    """
    windows = _cut_windows(grey, px_guess, frames, border)
    start = _start(windows, px_guess, frames)
    parameters, settled = _levenberg_marquardt(windows, start)
    return _report(windows, parameters, settled, px_guess, frames)


def _cut_windows(
    grey: np.ndarray, px_guess: np.ndarray, frames: np.ndarray, border: float
) -> _Windows:
    reach = int(np.ceil(min(REACH_PX, _ARM_SQUARES * np.linalg.norm(frames, axis=1).max())))
    grid = np.stack(
        np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1))
    ).reshape(2, -1)
    anchor = np.round(px_guess).astype(int)
    off = grid + (anchor - px_guess)[:, :, None]
    place = anchor[:, :, None] + grid
    inside = (place >= 0).all(axis=1) & (place < np.array(grey.shape[::-1])[:, None]).all(axis=1)
    taken = inside & _along_edges(off, frames, border) & (np.sum(grid**2, axis=0) <= reach**2)
    return _packed(grey, anchor, grid, taken)


def _packed(grey: np.ndarray, anchor: np.ndarray, grid: np.ndarray, taken: np.ndarray) -> _Windows:
    """Only the pixels taken, moved to the front of each row."""
    count = max(int(taken.sum(axis=1).max(initial=0)), 1)
    order = np.argsort(~taken, axis=1, kind="stable")[:, :count]
    weight = np.take_along_axis(taken, order, axis=1)
    dx, dy = grid[0][order], grid[1][order]
    rows = np.clip(anchor[:, 1:] + dy, 0, grey.shape[0] - 1)
    columns = np.clip(anchor[:, :1] + dx, 0, grey.shape[1] - 1)
    return _Windows(*(a.astype(float) for a in (anchor, dx, dy, grey[rows, columns], weight)))


def _along_edges(off: np.ndarray, frames: np.ndarray, border: float) -> np.ndarray:
    """Which pixels, offset `off` (n, 2, k) from the guess, see the two edges and no marker. (n, k) bool."""
    in_squares = np.abs(np.linalg.solve(frames, off))
    px_per_square = np.abs(np.linalg.det(frames))[:, None] / np.linalg.norm(
        frames[:, :, ::-1], axis=1
    )
    band_px = np.clip(border * px_per_square - _CLEAR_OF_MARKER_PX, _CLEAR_OF_MARKER_PX, _BAND_PX)
    beside = in_squares * px_per_square[:, :, None] < band_px[:, :, None]
    return beside.any(axis=1) & np.all(in_squares < _ARM_SQUARES, axis=1)


def _start(windows: _Windows, px_guess: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """First parameters (n, 10): edges as the homography has them, then level, slope and contrast by least squares."""
    p = np.zeros((len(px_guess), 10))
    p[:, [X, Y]] = px_guess - windows.anchor
    # Edge 1 runs along board y and edge 2 along board x; each is named by the direction of its normal.
    p[:, TURN_1] = np.arctan2(-frames[:, 0, 1], frames[:, 1, 1])
    p[:, TURN_2] = np.arctan2(frames[:, 0, 0], -frames[:, 1, 0])
    p[:, BLUR_1] = p[:, BLUR_2] = np.log(_FIRST_BLUR_PX)
    p[:, CONTRAST] = 1.0
    _, J = _model(windows, p)
    linear = [CONTRAST, LEVEL, SLOPE_X, SLOPE_Y]
    normal, gradient = _normal_equations(J[:, linear], windows.grey, windows.weight)
    p[:, linear] = _solve(normal, gradient, np.zeros(len(p)))
    return p


def _model(windows: _Windows, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Grey (n, k) that the parameters p (n, 10) predict, and its Jacobian (n, 10, k)."""
    dx = windows.dx - p[:, X, None]
    dy = windows.dy - p[:, Y, None]
    contrast = p[:, CONTRAST, None]
    f1, by_1 = _edge(dx, dy, p[:, TURN_1, None], p[:, BLUR_1, None])
    f2, by_2 = _edge(dx, dy, p[:, TURN_2, None], p[:, BLUR_2, None])
    J = np.empty((len(p), 10, windows.dx.shape[1]))
    J[:, X] = contrast * (by_1[0] * f2 + f1 * by_2[0]) - p[:, SLOPE_X, None]
    J[:, Y] = contrast * (by_1[1] * f2 + f1 * by_2[1]) - p[:, SLOPE_Y, None]
    J[:, TURN_1], J[:, TURN_2] = contrast * by_1[2] * f2, contrast * by_2[2] * f1
    J[:, BLUR_1], J[:, BLUR_2] = contrast * by_1[3] * f2, contrast * by_2[3] * f1
    J[:, CONTRAST], J[:, LEVEL], J[:, SLOPE_X], J[:, SLOPE_Y] = f1 * f2, 1.0, dx, dy
    grey = (
        contrast * J[:, CONTRAST]
        + p[:, LEVEL, None]
        + p[:, SLOPE_X, None] * dx
        + p[:, SLOPE_Y, None] * dy
    )
    return grey, J


def _edge(dx, dy, turn, log_blur) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """A blurred edge erf(e / (√2 s)), −1 to 1, with its derivatives by x0, y0, turn and log s. Each (n, k).

    NumPy 1.26 takes a column's exp otherwise, by 1e-16, where its result happens to lie right behind in memory.
    """
    cosine, sine, blur = np.cos(turn), np.sin(turn), np.exp(log_blur.copy())
    t = (cosine * dx + sine * dy) / blur
    slope = np.sqrt(2 / np.pi) * np.exp(-0.5 * t * t)
    per_px = slope / blur
    return erf(t / np.sqrt(2)), (
        -per_px * cosine,
        -per_px * sine,
        per_px * (cosine * dy - sine * dx),
        -slope * t,
    )


def _normal_equations(
    J: np.ndarray, residual: np.ndarray, weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """JᵀWJ (n, m, m) and JᵀWr (n, m) for J (n, m, k)."""
    JW = J * weight[:, None, :]
    return JW @ J.transpose(0, 2, 1), (JW @ residual[:, :, None])[:, :, 0]


def _solve(normal: np.ndarray, gradient: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Marquardt's step: the diagonal is raised by `damping` (n,) times itself, and never left at zero."""
    diagonal = np.einsum("nii->ni", normal)
    raised = normal + np.einsum(
        "ni,ij->nij", diagonal * damping[:, None] + 1e-9 * (1 + diagonal), np.eye(normal.shape[1])
    )
    return np.linalg.solve(raised, gradient[:, :, None])[:, :, 0]


def _levenberg_marquardt(windows: _Windows, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Best parameters (n, 10) and whether each corner came to rest (n,). Corners at rest are worked on no more."""
    state = [p, *_evaluate(windows, p), np.full(len(p), 1e-3)]
    moving = np.arange(len(p))
    for _ in range(_ITERATIONS):
        now = [values[moving] for values in state]
        step = _solve(now[2], now[3], now[4])
        tried = _within_limits(now[0] + step)
        new = [tried, *_evaluate(windows.chosen(moving), tried), now[4] * 0.2]
        worse = new[1] > now[1]
        for old, values, held in zip(state, new, [*now[:4], now[4] * 10.0]):
            values[worse] = held[worse]
            old[moving] = values
        moving = moving[np.linalg.norm(step[:, :2], axis=1) >= _CONVERGED_PX]
        if not len(moving):
            break
    return state[0], ~np.isin(np.arange(len(p)), moving)


def _within_limits(p: np.ndarray) -> np.ndarray:
    p[:, [BLUR_1, BLUR_2]] = np.clip(p[:, [BLUR_1, BLUR_2]], *np.log(_BLUR_SEARCH_PX))
    return p


def _evaluate(windows: _Windows, p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    grey, J = _model(windows, p)
    residual = windows.grey - grey
    normal, gradient = _normal_equations(J, residual, windows.weight)
    return np.sum(windows.weight * residual**2, axis=1), normal, gradient


def _report(windows: _Windows, p, settled, px_guess: np.ndarray, frames: np.ndarray) -> Saddles:
    grey, J = _model(windows, p)
    residual = (windows.grey - grey) * windows.weight
    pixels = windows.weight.sum(axis=1)
    misfit = np.sqrt(np.sum(residual**2, axis=1) / np.maximum(pixels - p.shape[1], 1))
    sigma = misfit * _spread_per_grey(windows, J, residual / np.maximum(misfit, 1e-9)[:, None])
    blur = np.exp(0.5 * (p[:, BLUR_1] + p[:, BLUR_2]))
    px = windows.anchor + p[:, :2]
    shift = np.linalg.norm(px - px_guess, axis=1)
    square_px = np.linalg.norm(frames, axis=1).min(axis=1)
    good = settled & (pixels >= _MIN_PIXELS) & (sigma > 0) & np.isfinite(sigma)
    good &= shift < np.minimum(_MAX_SHIFT_PX, _MAX_SHIFT_SQUARES * square_px)
    good &= np.abs(p[:, CONTRAST]) > _LEAST_CONTRAST * np.maximum(misfit, _ROUNDING)
    good &= (blur > _BLUR_LIMITS_PX[0]) & (blur < _BLUR_LIMITS_PX[1])
    return Saddles(px, sigma, p[:, CONTRAST], blur, misfit, good)


def _spread_per_grey(windows: _Windows, J: np.ndarray, unit_residual: np.ndarray) -> np.ndarray:
    """Sigma of a corner per axis for pixel noise of one grey level, (n,).

    Noise of neighbouring pixels goes together (demosaicing, compression, a soft lens before a noisy codec),
    which a plain (JᵀJ)⁻¹ does not see: here it was 2.4 times too small. With the influence of each pixel on
    the corner a = (JᵀJ)⁻¹ Jᵀ, the variance is aᵀ C a, C being the residuals' own correlation, taken as separable.
    """
    normal, _ = _normal_equations(J, unit_residual, windows.weight)
    influence = np.linalg.pinv(normal, hermitian=True)[:, :2] @ (J * windows.weight[:, None, :])
    along_x, along_y = (
        _correlation(_on_grid(windows, unit_residual[:, None])[:, 0], axis) for axis in (2, 1)
    )
    a = _on_grid(windows, influence)
    Ca = convolve1d(
        convolve1d(a, along_x, axis=3, mode="constant"), along_y, axis=2, mode="constant"
    )
    return np.sqrt(np.maximum(0.5 * np.sum(a * Ca, axis=(1, 2, 3)), 0.0))


def _on_grid(windows: _Windows, values: np.ndarray) -> np.ndarray:
    """Values (n, m, k) of the packed pixels on square grids (n, m, side, side), 0 where no pixel is taken."""
    reach = int(max(np.abs(windows.dx).max(), np.abs(windows.dy).max()))
    side = 2 * reach + 1
    cell = ((windows.dy + reach) * side + windows.dx + reach).astype(int)
    grid = np.zeros((*values.shape[:2], side * side))
    rows = np.arange(len(values))[:, None, None]
    planes = np.arange(values.shape[1])[None, :, None]
    np.add.at(grid, (rows, planes, cell[:, None, :]), values * windows.weight[:, None, :])
    return grid.reshape(*values.shape[:2], side, side)


def _correlation(residual: np.ndarray, axis: int) -> np.ndarray:
    """Correlation of residuals (n, side, side) at lags −LAGS to LAGS along an axis, over all corners together."""
    taken = (residual != 0).astype(float)
    lags = [_lag_mean(residual, taken, axis, lag) for lag in range(LAGS + 1)]
    one_sided = np.array(lags) / max(lags[0], 1e-12)
    return np.concatenate([one_sided[:0:-1], one_sided])


def _lag_mean(residual: np.ndarray, taken: np.ndarray, axis: int, lag: int) -> float:
    def shifted(a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        size = a.shape[axis] - lag
        return a.take(range(size), axis), a.take(range(lag, size + lag), axis)

    (r0, r1), (t0, t1) = shifted(residual), shifted(taken)
    return float(np.sum(r0 * r1) / max(np.sum(t0 * t1), 1.0))
