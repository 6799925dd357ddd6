"""How thick a rod appears: the evidence of other widths at the same lines.

A highlight or a dark rim is no edge, and light from one side draws one edge alone, so that what is
bright or dark says nothing about the width. But where the lens sees past the edges, it sees the
background, which is known. So for each width the most probable light is taken, with each common
shift of the line and each blur that may go with it.
"""

import numpy as np
from scipy.interpolate import CubicSpline

from vision.geometry.robust import mean_and_sigma
from vision.wire.bands import Pieces
from vision.wire.binned import binned
from vision.wire.common_shift import EVIDENCE_COUNTS, best_evidences
from vision.wire.shaded_segments import ShadedSegments
from vision.wire.shading import Knots
from vision.wire.trace import BIN_PX, WIRE_WAVES

# [1] Step of the logarithms of widths that are tried first: half of it is less than what light
# leaves of a wire 5 px wide. Derived.
_STEP = 0.2
# [1] Logarithms of widths that are tried first, from half to nearly twice. Derived.
_LOG_WIDTHS = np.array([-0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6])
# [1] About the best of these, tried with several blurs. Derived.
_NEAR = np.linspace(-0.2, 0.2, 5)
# [px] Common shifts: a wire entered half as thick again is taken by one of its edges, 1.3 px off.
# Derived.
_SHIFTS_PX = np.linspace(-1.5, 1.5, 9)
# [1] Blurs by their logarithm over the one found under the stated width. Derived.
_LOG_BLURS = np.array([-0.3, 0.0, 0.3])
# [segments] By which the width is found: as many as a tenth of a second allows. Derived.
_MOST_SEGMENTS = 50
# [nodes] Of the splines through the grids. Derived.
_FINE = 601


def log_width(pieces: Pieces, blur_px: float, knots: Knots) -> tuple[float, float] | None:
    """Return mean and sigma of the logarithm of the rod's width over the given one.

    pieces: where the rod lies, but for a common shift. blur_px: of the lens.
    The given width is not refined where it is the most probable of a coarse grid. None where the
    most probable is half or nearly twice as thick: that is another thing, or a shadow along the rod.
    """
    some = pieces.thinned(_MOST_SEGMENTS)
    averaged, _ = binned(some, BIN_PX)
    task = ShadedSegments(averaged, WIRE_WAVES, knots, blur_px).tempered()
    blurs_px = task.blur_px * np.exp(_LOG_BLURS)
    coarse = best_evidences(task, _SHIFTS_PX, blurs_px[1:2], wider=np.exp(_LOG_WIDTHS))
    best = float(_LOG_WIDTHS[np.argmin(coarse)])
    if best in _LOG_WIDTHS[[0, -1]]:
        return None
    if best == 0.0:
        return 0.0, 0.5 * _STEP
    logs = best + _NEAR
    evidences = best_evidences(task, _SHIFTS_PX, blurs_px, wider=np.exp(logs))
    return weigh_widths(logs, evidences, task.pieces)


def weigh_widths(logs: np.ndarray, evidences: np.ndarray, pieces: Pieces) -> tuple[float, float]:
    """Return mean and sigma of the logarithm of a width, by the evidences (w,) of some (w,).

    What no width explains of the segments' pixels is counted as noise.
    """
    pixels = max(int(np.sum(pieces.weight > 0)), 1)
    misfit = max(1.0, evidences.min() / pixels)
    return mean_and_sigma_between(logs, EVIDENCE_COUNTS / misfit * (evidences - evidences.min()))


def mean_and_sigma_between(places: np.ndarray, evidences: np.ndarray) -> tuple[float, float]:
    """Return mean and sigma of the density whose minus twice logarithm is known at some places
    (n,).
    """
    fine = np.linspace(places[0], places[-1], _FINE)
    values = CubicSpline(places, evidences)(fine)
    return mean_and_sigma(fine, np.exp(-0.5 * (values - values.min())))
