"""A rod's line in frames that came after its shading was found: their positions alone are left.

The shading of a wire and the lens blur are alike in all frames of a camera (`joint.py`). Once they are
known by some frames, those that follow need a few Gauss–Newton steps of each segment by itself. What the
errors of shading and blur do to their positions is the same cause that moves the segments of the first
frames, so that all of them together are one set of line points.
"""

import numpy as np

from vision.wire.bands import Pieces
from vision.wire.binned import binned
from vision.wire.descent import positions_with_shared
from vision.wire.joint import widened_blurs
from vision.wire.shading import LONGEST_PX, Knots, SegmentEquations
from vision.wire.trace import BIN_PX, WIRE_WAVES, SegmentPositions, WireTrace

# [steps] From a curve that is a pixel or two off: each of `LONGEST_PX` at most. Derived.
_STEPS = 5
# [px] A segment whose last step is longer has not converged and gives no point. Half of the longest
# step. Stated.
_CONVERGED_PX = 0.5 * LONGEST_PX
# [px] The steps end where the median is shorter: a tenth of a segment's usual sigma. Derived.
_SHORT_STEP_PX = 0.005


def carry_on(pieces: Pieces, traced: WireTrace, knots: Knots) -> SegmentPositions:
    """Find where the rod lies in segments of later frames, by the shading and blur of traced ones.

    traced: by a last pass. knots: those of its shading.
    """
    light = traced.solved
    knot_weights = knots.weights(pieces)
    coefficients = knot_weights @ light.by_knot
    shift_px = _find_shifts(pieces, traced.blur_px, coefficients)
    here = SegmentEquations(pieces.moved(shift_px), traced.blur_px, WIRE_WAVES)
    linear = here.linearised(coefficients)
    moved = pieces.moved(shift_px + linear.step_px)
    chi2 = here.chi2(coefficients) / pieces.freedom
    has_converged = np.abs(linear.step_px) < _CONVERGED_PX
    sensitivity = positions_with_shared(linear, knot_weights) / linear.power[:, None]
    relative_radius = pieces.radius_px / np.mean(traced.pieces.radius_px)
    return SegmentPositions(
        px=moved.foot_px,
        normal=moved.normal,
        place=moved.place,
        source=moved.source,
        own_sigma_px=np.where(has_converged, linear.own_sigma_px(chi2), np.inf),
        chi2=chi2,
        shared_px=light.causes.all_shifts_px(sensitivity, relative_radius),
        widened_px2=widened_blurs(linear, traced.blur_px, np.maximum(chi2, 1.0)),
    )


def _find_shifts(pieces: Pieces, blur_px: float, coefficients: np.ndarray) -> np.ndarray:
    """Return by how much (s,) px segments are moved to where the rod lies, but for a last step.

    Each takes Gauss–Newton steps by itself, by averaged pixels. coefficients (s, terms): shading of each.
    """
    averaged, variance_px2 = binned(pieces, BIN_PX)
    blur_px = float(np.hypot(blur_px, np.sqrt(variance_px2)))
    shift_px = np.zeros(len(pieces))
    for _ in range(_STEPS):
        here = SegmentEquations(averaged.moved(shift_px), blur_px, WIRE_WAVES)
        step_px = here.linearised(coefficients).step_px
        shift_px = shift_px + step_px
        if np.median(np.abs(step_px)) < _SHORT_STEP_PX:
            break
    return shift_px
