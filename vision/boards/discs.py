"""The disc: a printed circle seen in perspective, fitted to the grey picture.

Model, with e the distance of a pixel from the edge of an ellipse about (x0, y0), to first order:

    grey = level + gx dx + gy dy + contrast · erf(e / (√2 s))

Ten parameters: centre, the ellipse's form against the one that the board's plane predicts (its
elongation both ways, its size), the edge's blur, contrast, level and the light's slope. The pattern
is the same after half a turn, so whatever blur and size are, they move no centre.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import erf

from vision.boards.edge_pixels import Windows, cut_where
from vision.boards.saddle import (
    CONTRAST,
    PLACE,
    Saddles,
    fit_windows,
    in_light,
    report_fit,
    with_linear_part,
)

# [parameters] Elongation along the half diameters, and between them. A layout, no threshold.
_ALONG, _BETWEEN = 2, 3
# [parameters] Logarithms of the blur, px, and of the size over the predicted. A layout, no threshold.
_LOG_BLUR, _LOG_SIZE = 4, 5
# [px] Where the fit starts: as of saddles (vision/boards/saddle.py). Stated.
_FIRST_BLUR_PX = 1.0
# [px] Pixels farther from the edge say nothing of it: as of saddles (vision/boards/edge_pixels.py).
# Stated.
_BAND_PX = 6.0
# [parameters] That have no derivative in closed form here. A layout, no threshold.
_CURVED = slice(0, 6)
# [1] Step of a central difference, px or 1: its error is 1e-8 of the derivative. Derived.
_STEP = 1e-4


@dataclass(frozen=True, eq=False)
class DiscWindows(Windows):
    """The pixels about each disc's edge. axes (n, 2, 2): px, in its columns the two half diameters
    that are predicted.
    """

    axes: np.ndarray


def cut_discs(
    grey: np.ndarray, px_guess: np.ndarray, axes: np.ndarray, clear: float
) -> DiscWindows:
    """Return the pixels near the edges of discs at guesses (n, 2) px, with half diameters axes (n,
    2, 2) px. clear: how far from the centre nothing else is printed, in half diameters.
    """
    reach_px = int(np.ceil(np.linalg.norm(axes, axis=1).max() * clear))

    def shows_edge(offset: np.ndarray) -> np.ndarray:
        """Return which pixels at offsets (n, 2, k) show the edge, (n, k) bool."""
        radius, from_edge_px = _from_edge(np.linalg.solve(axes, offset), axes)
        return (radius < clear) & (np.abs(from_edge_px) < _BAND_PX)

    windows = cut_where(grey, px_guess, reach_px, shows_edge)
    return DiscWindows(windows.anchor, windows.offset, windows.grey, windows.weight, axes)


def _from_edge(unit: np.ndarray, axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the radius (n, k) of places (n, 2, k) in half diameters, and their distance (n, k) px
    from the edge, to first order.
    """
    radius = np.maximum(np.linalg.norm(unit, axis=1), 1e-6)
    outward = unit / radius[:, None]
    radius_by_px = np.swapaxes(np.linalg.inv(axes), 1, 2) @ outward  # (n, 2, k)
    return radius, (radius - 1.0) / np.linalg.norm(radius_by_px, axis=1)


def fit_discs(windows: DiscWindows, px_guess: np.ndarray) -> Saddles:
    """Fit the disc nearest each guess (n, 2) px: its centre is that of the ellipse in the picture."""
    start = np.zeros((len(px_guess), 10))
    start[:, PLACE] = px_guess - windows.anchor
    start[:, _LOG_BLUR] = np.log(_FIRST_BLUR_PX)
    start = with_linear_part(windows, start, predict_discs)
    parameters, converged = fit_windows(windows, start, predict_discs)
    discs = report_fit(windows, parameters, converged, predict_discs)
    return replace(discs, blur_px=np.exp(parameters[:, _LOG_BLUR]))


def _edge_difference(windows: DiscWindows, p: np.ndarray, column: int) -> np.ndarray:
    """Return the change (n, k) of the disc's grey from a step before to a step beyond a parameter."""
    step = np.zeros(10)
    step[column] = _STEP
    return _edge(windows, p + step) - _edge(windows, p - step)


def predict_discs(windows: DiscWindows, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Predict the grey (n, k) by the parameters p (n, 10), with its Jacobian (n, 10, k)."""
    offset = windows.offset - p[:, PLACE, None]  # (n, 2, k) px from the centre
    J = np.empty((len(p), 10, offset.shape[2]))
    J[:, CONTRAST] = _edge(windows, p)
    contrast = p[:, CONTRAST, None]
    for column in range(*_CURVED.indices(10)):
        by_column = _edge_difference(windows, p, column) / (2.0 * _STEP)
        J[:, column] = contrast * by_column
    return in_light(offset, p, J), J


def _edge(windows: DiscWindows, p: np.ndarray) -> np.ndarray:
    """Return the blurred edge, −1 within the disc to 1 beyond, (n, k), by parameters p (n, 10)."""
    along = p[:, _ALONG]
    between = p[:, _BETWEEN]
    elongation = np.array([[1.0 + along, between], [between, 1.0 - along]])  # (2, 2, n)
    size = np.exp(p[:, _LOG_SIZE, None, None])
    axes = size * (windows.axes @ elongation.transpose(2, 0, 1))  # (n, 2, 2)
    offset = windows.offset - p[:, PLACE, None]
    in_half_diameters = np.linalg.solve(axes, offset)
    _, from_edge_px = _from_edge(in_half_diameters, axes)
    blur_px = np.exp(p[:, _LOG_BLUR, None])
    return erf(from_edge_px / (np.sqrt(2.0) * blur_px))
