"""The transfer curve and lens blur of a camera by the printed edges of a board in one of its pictures.

Light is blurred by the lens before the sensor's transfer curve makes grey levels of it. Under grey
∝ light^(1/gamma) a blurred edge between black and white is skew: white reaches into black. At a
corner of a board white lies on opposite sides of an edge before and behind the corner, so its edges
are displaced to opposite sides there, and stay straight in light. Each corner is fitted by the
saddle of `vision.boards.saddle` in light, seen through a curve whose gamma is free; the median of
all corners is the camera's.
"""

from dataclasses import replace

import numpy as np

from vision.boards.corners import Corners, by_face, find_corners, to_8_bit
from vision.boards.edge_pixels import Windows
from vision.boards.saddle import BLUR, fit_windows, predict_saddles, start_parameters
from vision.geometry.board import Board
from vision.geometry.optics import UNKNOWN, Optics
from vision.geometry.robust import robust_sigma
from vision.pictures.view import SATURATED

# [corners] Fewer have no median that an odd one would not move. Derived.
_FEWEST_CORNERS = 4
# [1] Sigma of the logarithm of gamma in common to all corners of a board: ink that spreads by an
# eighth of a lens blur moves edges as much. Boards in 31 views of path-traced scenes are 0.16 off
# at most, 0.07 RMS. Study: optics.py.
_PRINT_LOG_SIGMA = 0.12
# [1] Sigma of the blur's logarithm between the board's depth and the rods'. Boards of path-traced
# scenes are 0.16 off at most, 0.05 RMS. Study: optics.py.
_DEPTH_LOG_SIGMA = 0.1
# [px] Edges that are sharper were sharpened by the camera, which is no transfer curve: at 0.25 to
# 0.4 px two webcams' pictures give gammas of 0.6 to 1.7; at 0.49 to 1.5 px seven other cameras'
# give 0.6 to 1.3. Study: optics.py.
_LEAST_BLUR_PX = 0.45
# [1] Sigma of the median of Gaussian values over that of their mean. Derived.
_MEDIAN_BY_MEAN = 1.2533
# [parameters] Of a saddle in light; gamma's logarithm is the next. A layout.
_SADDLE = slice(0, 10)
# [1] Gamma at which the fit begins: between those of sensors and of screens. Derived.
_FIRST_GAMMA = 1.5
# [1] Least light, over full scale: noise makes the fit's light negative, where the curve has no
# value. Derived.
_LEAST_LIGHT = 1e-4


def estimate_optics(grey: np.ndarray, board: Board) -> Optics:
    """Estimate transfer curve and lens blur of the camera that took a grey picture (h, w).

    The optics are unknown where the picture shows too little of the board, or edges that no lens
    makes.
    """
    picture = to_8_bit(grey)
    faces = by_face(find_corners(picture, board), board)
    corners = max(faces, key=len, default=Corners.none())
    cut = board.cut(picture, corners.px, corners.ids)
    if cut is None:
        return UNKNOWN
    windows, axes = cut
    windows = replace(windows, weight=windows.weight * (windows.grey < SATURATED * 255.0))
    light = 255.0 * (windows.grey / 255.0) ** _FIRST_GAMMA
    saddles = start_parameters(replace(windows, grey=light), corners.px, axes)
    log_gammas = np.full((len(saddles), 1), np.log(_FIRST_GAMMA))
    start = np.concatenate([saddles, log_gammas], axis=1)
    fitted, converged = fit_windows(windows, start, _predict_grey)
    return _optics_of(fitted[converged])


def _optics_of(fitted: np.ndarray) -> Optics:
    """Return the optics by the medians over the corners' fitted parameters (n, p)."""
    if len(fitted) < _FEWEST_CORNERS:
        return UNKNOWN
    log_blur, blur_scatter = _median(fitted[:, BLUR].mean(axis=1))
    if log_blur < np.log(_LEAST_BLUR_PX):
        return UNKNOWN
    log_gamma, gamma_scatter = _median(fitted[:, -1])
    log_blur_sigma = _MEDIAN_BY_MEAN * blur_scatter / np.sqrt(len(fitted))
    return Optics(
        gamma=float(np.exp(log_gamma)),
        # uneven light, a shadow's border, disturbs neighbouring corners alike: no mean of many
        log_gamma_sigma=float(np.hypot(gamma_scatter, _PRINT_LOG_SIGMA)),
        blur_px=float(np.exp(log_blur)),
        log_blur_sigma=float(np.hypot(log_blur_sigma, _DEPTH_LOG_SIGMA)),
    )


def _median(values: np.ndarray) -> tuple[float, float]:
    """Return the median of values (n,), and the sigma of one of them by their median deviation."""
    median = np.median(values)
    return float(median), robust_sigma(values - median)


def _predict_grey(windows: Windows, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Predict the grey (n, k) by parameters p (n, 11) of a saddle in light, with its Jacobian (n,
    11, k).
    """
    light, by_saddle = predict_saddles(windows, p[:, _SADDLE])
    share = np.maximum(light / 255.0, _LEAST_LIGHT)
    power = np.exp(-p[:, -1:])  # 1 / gamma
    curve = share**power
    by_light = power * curve / share
    by_log_gamma = -255.0 * power * curve * np.log(share)
    J = np.concatenate([by_light[:, None] * by_saddle, by_log_gamma[:, None]], axis=1)
    return 255.0 * curve, J
