"""How wide an object appears of which nothing is known: the evidence of widths along its line.

Each width has its own background, by the pixels beyond it, and its own most probable light, shift
and blur. Where that is not the width between the steepest edges (`steepest_edges.py`), a shadow or
light from one side leaves open which it is.
"""

from dataclasses import replace

import numpy as np

from vision.pictures.pixel_noise import Noise
from vision.wire.bands import Pieces
from vision.wire.binned import binned
from vision.wire.common_shift import best_evidences
from vision.wire.rod_width import weigh_widths
from vision.wire.shaded_segments import ShadedSegments
from vision.wire.shading import Knots
from vision.wire.strip import noise_beside, with_background
from vision.wire.trace import BIN_PX, WIRE_WAVES

# [1] Logarithms of widths that are tried first, over the given one. Derived.
_LOG_WIDTHS = np.linspace(-0.45, 0.45, 7)
# [1] About the best of these. Derived.
_NEAR = np.linspace(-0.15, 0.15, 5)
# [px] Common shifts: an object entered half as thick again is taken by one of its edges. Derived.
_SHIFTS_PX = np.linspace(-1.2, 1.2, 5)
# [1] Blurs by their logarithm over the given one. Derived.
_LOG_BLURS = np.array([-0.4, 0.0, 0.4])
# [segments] By which the width of a part of the line is found. By 8 or 32 the sigma of lines of
# path-traced wires changes by a tenth. Study: thresholds.py wire.free_width _MOST_SEGMENTS ….
_MOST_SEGMENTS = 16


def log_width_of(pieces: Pieces, blur_px: float) -> float:
    """Return the mean logarithm of the width of segments (see `cut_strip`) over their given one.

    The segments lie where the object was found, and are wide enough to show what is behind an object
    half as thick again. Its light changes linearly from the first to the last.
    """
    some = pieces.thinned(_MOST_SEGMENTS)
    widest = replace(some, radius_px=some.radius_px * np.exp(_LOG_WIDTHS[-1]))
    noise = noise_beside(widest, blur_px)
    blurs_px = blur_px * np.exp(_LOG_BLURS)
    coarse = _evidences(some, _LOG_WIDTHS, noise, blurs_px[1:2])
    best = float(_LOG_WIDTHS[np.argmin(coarse)])
    logs = best + _NEAR
    evidences = _evidences(some, logs, noise, blurs_px)
    return weigh_widths(logs, evidences, some)[0]


def _evidences(pieces: Pieces, logs: np.ndarray, noise: Noise, blurs_px: np.ndarray) -> np.ndarray:
    """Return minus twice the log evidence of each width (w,), logarithms over that of the segments,
    at its best blur.
    """
    evidences = []
    for log in logs:
        wide = replace(pieces, radius_px=pieces.radius_px * np.exp(log))
        middle_px = float(np.median(blurs_px))
        evidences.append(_evidence(with_background(wide, middle_px, noise), blurs_px))
    return np.array(evidences)


def _evidence(pieces: Pieces, blurs_px: np.ndarray) -> float:
    """Return minus twice the log evidence of segments at their best common shift and blur."""
    averaged, _ = binned(pieces, BIN_PX)
    knots = Knots(pieces.place[[0, -1]])
    task = ShadedSegments(averaged, WIRE_WAVES, knots, float(np.median(blurs_px))).tempered()
    return float(best_evidences(task, _SHIFTS_PX, blurs_px)[0])
