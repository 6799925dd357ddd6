"""How thick a rod looks: by the evidence of other widths about the same lines.

A highlight or a dark rim is no edge, and light from one side draws one edge alone, so that what is bright or dark tells
no width. But light that the lens leaves outside the edges has the background behind it, which is known: of each width
the most probable light is taken, with each common shift of the line and each blur that may go with it.
"""

import numpy as np
from scipy.interpolate import CubicSpline

from vision.lines.bands import Pieces
from vision.lines.binned import binned
from vision.lines.common_shift import EVIDENCE_COUNTS, NO_CHANCE, doubts_of
from vision.lines.joint import BLUR_SIGMA, Task
from vision.lines.shading import Knots
from vision.lines.trace import BIN_PX, WIRE_WAVES

_STEP, _LOG_WIDTHS = 0.2, np.array([-0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6])  # half and nearly twice as thick
_NEAR = np.linspace(-0.2, 0.2, 5)  # about the best of these
_SHIFTS_PX = np.linspace(-1.5, 1.5, 9)  # a wire told half as thick again is taken by one of its edges
_LOG_BLURS = np.array([-0.3, 0.0, 0.3])
_TOLD_BY = 50  # pieces
_FINE = 601


def log_width(pieces: Pieces, blur_px: float, knots: Knots) -> tuple[float, float] | None:
    """Mean and sigma of the logarithm of the rod's width over the given one, which is not asked closer where it is the
    likeliest of some. None where the likeliest is half or twice as thick: that is another thing, or a shadow beside it.

    pieces: where the rod lies, but for a shift of all; blur_px: of the lens.
    """
    some = pieces.select(slice(None, None, 1 + len(pieces) // _TOLD_BY))
    pieces = Task(binned(some, BIN_PX)[0], WIRE_WAVES, knots, blur_px).tempered().pieces
    rough = _against(pieces, _LOG_WIDTHS, np.zeros(1), blur_px, knots, NO_CHANCE)
    best = float(_LOG_WIDTHS[np.argmin(rough)])
    if best in _LOG_WIDTHS[[0, -1]]:
        return None
    if best == 0.0:
        return 0.0, 0.5 * _STEP
    logs = best + _NEAR
    against = _against(pieces, logs, _LOG_BLURS, blur_px, knots, np.inf)
    overstated = max(1.0, against.min() / max(int(np.sum(pieces.weight > 0)), 1))
    fine = np.linspace(logs[0], logs[-1], _FINE)
    left = CubicSpline(logs, EVIDENCE_COUNTS / overstated * (against - against.min()))(fine)
    chance = np.exp(-0.5 * (left - left.min()))
    mean = float(np.average(fine, weights=chance))
    return mean, float(np.sqrt(np.average((fine - mean) ** 2, weights=chance)))


def _against(pieces: Pieces, logs: np.ndarray, log_blurs: np.ndarray, blur_px: float, knots: Knots,
             no_chance: float) -> np.ndarray:
    """Minus twice the log evidence (w,) of pieces so much thicker, at the best common shift and blur."""
    doubts = doubts_of(pieces, _SHIFTS_PX, blur_px * np.exp(log_blurs), WIRE_WAVES, knots, np.ones(len(pieces)),
                       no_chance, np.exp(logs))
    doubts += (log_blurs / BLUR_SIGMA) ** 2
    fine = np.linspace(_SHIFTS_PX[0], _SHIFTS_PX[-1], _FINE)
    return np.min(CubicSpline(_SHIFTS_PX, doubts, axis=1)(fine), axis=(1, 2))
