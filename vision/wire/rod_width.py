"""How thick a rod looks: by the evidence of other widths about the same lines.

A highlight or a dark rim is no edge, and light from one side draws one edge alone, so that what is bright or dark tells
no width. But light that the lens leaves outside the edges has the background behind it, which is known: of each width
the most probable light is taken, with each common shift of the line and each blur that may go with it.
"""

import numpy as np
from scipy.interpolate import CubicSpline

from vision.wire.bands import Pieces
from vision.wire.binned import binned
from vision.wire.common_shift import EVIDENCE_COUNTS, NO_CHANCE, doubts_of
from vision.wire.joint import BLUR_SIGMA, ShadedSegments
from vision.wire.shading import Knots
from vision.wire.trace import BIN_PX, WIRE_WAVES

# [1] Logarithms of widths that are tried first, from half to nearly twice: half a step is less
# than what light leaves of a wire 5 px wide. Derived.
_STEP, _LOG_WIDTHS = (
    0.2,
    np.array([-0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6]),
)
# [1] About the best of these, tried with several blurs. Derived.
_NEAR = np.linspace(-0.2, 0.2, 5)
# [px] Of all pieces: a wire told half as thick again is taken by one of its edges, 1.3 px off.
# Derived.
_SHIFTS_PX = np.linspace(-1.5, 1.5, 9)
# [1] Blurs beside the one found under the stated width, of their logarithm. Derived.
_LOG_BLURS = np.array([-0.3, 0.0, 0.3])
# [pieces] That tell the width: as many as a tenth of a second allows. Derived.
_TOLD_BY = 50
# [nodes] Of the splines through the grids. Derived.
_FINE = 601


def log_width(pieces: Pieces, blur_px: float, knots: Knots) -> tuple[float, float] | None:
    """Mean and sigma of the logarithm of the rod's width over the given one, which is not asked closer where it is the
    likeliest of some. None where the likeliest is half or twice as thick: that is another thing, or a shadow beside it.

    pieces: where the rod lies, but for a shift of all; blur_px: of the lens.
    """
    some = pieces.select(slice(None, None, 1 + len(pieces) // _TOLD_BY))
    pieces = ShadedSegments(binned(some, BIN_PX)[0], WIRE_WAVES, knots, blur_px).tempered().pieces
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


def _against(
    pieces: Pieces,
    logs: np.ndarray,
    log_blurs: np.ndarray,
    blur_px: float,
    knots: Knots,
    no_chance: float,
) -> np.ndarray:
    """Minus twice the log evidence (w,) of pieces so much thicker, at the best common shift and blur."""
    doubts = doubts_of(
        pieces,
        _SHIFTS_PX,
        blur_px * np.exp(log_blurs),
        WIRE_WAVES,
        knots,
        np.ones(len(pieces)),
        no_chance,
        np.exp(logs),
    )
    doubts += (log_blurs / BLUR_SIGMA) ** 2
    fine = np.linspace(_SHIFTS_PX[0], _SHIFTS_PX[-1], _FINE)
    return np.min(CubicSpline(_SHIFTS_PX, doubts, axis=1)(fine), axis=(1, 2))
