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
from scipy.special import erf

# Reach along the edges. Longer arms gain little (sigma falls with the root of the length) and see the lens
# bend the edge: at 12 px the bend of a lens with k1 = -0.1 moves the corner by less than 0.005 px.
REACH_PX = 12
# Pixels nearer to a marker than this hold its blur.
_CLEAR_OF_MARKER_PX = 1.5
# Arms end before the next corner, in squares.
_ARM_SQUARES = 0.8
_MAX_SHIFT_PX = 4.0
_MAX_SHIFT_SQUARES = 1.0 / 3.0
_MIN_PIXELS = 40
_ITERATIONS = 15
_CONVERGED_PX = 2e-3
_FIRST_BLUR_PX = 1.0
_BLUR_LIMITS_PX = (0.2, 8.0)

X, Y, TURN_1, TURN_2, BLUR_1, BLUR_2, CONTRAST, LEVEL, SLOPE_X, SLOPE_Y = range(10)


@dataclass(frozen=True, eq=False)
class Saddles:
    """Fitted corners, a row each: px (n, 2); sigma_px, contrast, blur_px, misfit (grey levels), converged:
    (n,).
    """

    px: np.ndarray
    sigma_px: np.ndarray
    contrast: np.ndarray
    blur_px: np.ndarray
    misfit: np.ndarray
    converged: np.ndarray


@dataclass(frozen=True, eq=False)
class _Windows:
    """Pixels about each corner: offsets from its anchor dx, dy (k,), grey (n, k), weight 0 or 1 (n, k)."""

    anchor: np.ndarray
    dx: np.ndarray
    dy: np.ndarray
    grey: np.ndarray
    weight: np.ndarray


def fit_saddles(grey: np.ndarray, px_guess: np.ndarray, frames: np.ndarray, border: float) -> Saddles:
    """Fits the corner nearest each guess.

    grey: (height, width). px_guess: (n, 2). frames: (n, 2, 2) px, one square along board x and y as seen at
    the corner (columns). border: clear rim between a square's edge and its marker, in squares.
    """
    windows = _cut_windows(grey, px_guess, frames, border)
    start = _start(windows, px_guess, frames)
    parameters, settled = _levenberg_marquardt(windows, start)
    return _report(windows, parameters, settled, px_guess, frames)


def _cut_windows(grey: np.ndarray, px_guess: np.ndarray, frames: np.ndarray, border: float) -> _Windows:
    reach = np.arange(-REACH_PX, REACH_PX + 1)
    dx, dy = (a.ravel().astype(float) for a in np.meshgrid(reach, reach))
    anchor = np.round(px_guess)
    columns = anchor[:, :1] + dx
    rows = anchor[:, 1:] + dy
    height, width = grey.shape
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    columns = np.clip(columns, 0, width - 1).astype(int)
    rows = np.clip(rows, 0, height - 1).astype(int)
    off = np.stack([dx + (anchor - px_guess)[:, :1], dy + (anchor - px_guess)[:, 1:]], axis=1)
    weight = inside & _along_edges(off, frames, border) & (dx * dx + dy * dy <= REACH_PX**2)
    return _Windows(anchor, dx, dy, grey[rows, columns].astype(float), weight.astype(float))


def _along_edges(off: np.ndarray, frames: np.ndarray, border: float) -> np.ndarray:
    """Which pixels, offset `off` (n, 2, k) from the guess, see the two edges and no marker. (n, k) bool."""
    in_squares = np.linalg.solve(frames, off)
    clear_px = border * np.abs(np.linalg.det(frames))[:, None] / np.linalg.norm(frames[:, :, ::-1], axis=1)
    width_px = np.maximum(clear_px - _CLEAR_OF_MARKER_PX, _CLEAR_OF_MARKER_PX)
    px_per_square = clear_px / border
    beside = np.abs(in_squares) * px_per_square[:, :, None] < width_px[:, :, None]
    return beside.any(axis=1) & np.all(np.abs(in_squares) < _ARM_SQUARES, axis=1)


def _start(windows: _Windows, px_guess: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """First parameters (n, 10): edges as the homography has them, then level, slope and contrast by least
    squares.
    """
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
    J = np.empty((len(p), 10, len(windows.dx)))
    J[:, X] = contrast * (by_1[0] * f2 + f1 * by_2[0]) - p[:, SLOPE_X, None]
    J[:, Y] = contrast * (by_1[1] * f2 + f1 * by_2[1]) - p[:, SLOPE_Y, None]
    J[:, TURN_1], J[:, TURN_2] = contrast * by_1[2] * f2, contrast * by_2[2] * f1
    J[:, BLUR_1], J[:, BLUR_2] = contrast * by_1[3] * f2, contrast * by_2[3] * f1
    J[:, CONTRAST], J[:, LEVEL], J[:, SLOPE_X], J[:, SLOPE_Y] = f1 * f2, 1.0, dx, dy
    grey = contrast * J[:, CONTRAST] + p[:, LEVEL, None] + p[:, SLOPE_X, None] * dx + p[:, SLOPE_Y, None] * dy
    return grey, J


def _edge(dx, dy, turn, log_blur) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """A blurred edge erf(e / (√2 s)), −1 to 1, with its derivatives by x0, y0, turn and log s. Each (n,
    k).
    """
    cosine, sine, blur = np.cos(turn), np.sin(turn), np.exp(log_blur)
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
    """Best parameters (n, 10) and whether each corner came to rest (n,)."""
    cost, normal, gradient = _evaluate(windows, p)
    damping = np.full(len(p), 1e-3)
    settled = np.zeros(len(p), dtype=bool)
    for _ in range(_ITERATIONS):
        step = _solve(normal, gradient, damping)
        tried = p + step
        new_cost, new_normal, new_gradient = _evaluate(windows, tried)
        better = new_cost <= cost
        p = np.where(better[:, None], tried, p)
        cost = np.where(better, new_cost, cost)
        normal = np.where(better[:, None, None], new_normal, normal)
        gradient = np.where(better[:, None], new_gradient, gradient)
        damping = np.where(better, damping * 0.2, damping * 10.0)
        settled |= np.linalg.norm(step[:, :2], axis=1) < _CONVERGED_PX
        if settled.all():
            break
    return p, settled


def _evaluate(windows: _Windows, p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    grey, J = _model(windows, p)
    residual = windows.grey - grey
    normal, gradient = _normal_equations(J, residual, windows.weight)
    return np.sum(windows.weight * residual**2, axis=1), normal, gradient


def _report(windows: _Windows, p, settled, px_guess: np.ndarray, frames: np.ndarray) -> Saddles:
    cost, normal, _ = _evaluate(windows, p)
    pixels = windows.weight.sum(axis=1)
    misfit = np.sqrt(cost / np.maximum(pixels - p.shape[1], 1))
    covariance = np.linalg.pinv(normal, hermitian=True)[:, :2, :2]
    sigma = misfit * np.sqrt(0.5 * (covariance[:, 0, 0] + covariance[:, 1, 1]))
    blur = np.exp(0.5 * (p[:, BLUR_1] + p[:, BLUR_2]))
    px = windows.anchor + p[:, :2]
    shift = np.linalg.norm(px - px_guess, axis=1)
    square_px = np.linalg.norm(frames, axis=1).min(axis=1)
    good = settled & (pixels >= _MIN_PIXELS) & (sigma > 0) & np.isfinite(sigma)
    good &= shift < np.minimum(_MAX_SHIFT_PX, _MAX_SHIFT_SQUARES * square_px)
    good &= (blur > _BLUR_LIMITS_PX[0]) & (blur < _BLUR_LIMITS_PX[1])
    return Saddles(px, sigma, p[:, CONTRAST], blur, misfit, good)
