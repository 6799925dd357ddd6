"""A rod's segments in one camera, with what is known beforehand of their shading and of the lens
blur.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vision.wire.bands import Pieces
from vision.wire.shading import Knots, contrast_of

# [1] Prior sigma of the logarithm of the blur: a lens in focus, 0.5 to 1.3 px with the pixel's own
# width; pixels that say otherwise overrule it. Study: wire_scenes.py.
BLUR_SIGMA = 0.25
# [1] Error of the model of light over the contrast, at one distance from the axis in all segments
# alike. In 65 views of 30 path-traced scenes common offsets are 0.17 px RMS and 1.3 sigma; with
# 0.003 0.19 and 1.4, with 0.0015 0.24 and 1.7, with 0.03 0.26 and 1.7. Study: wire_scenes.py.
_MODEL_ERROR_SHARE = 0.006
# [px] Pixels within this distance across share that error: the bin of the first pass. Stated.
_MODEL_ERROR_BIN_PX = 0.3


@dataclass(frozen=True)
class ShadedSegments:
    """What is to be explained: segments, by so many shading functions at these knots.

    blur_px, blur_sigma: prior of the lens blur, and of its logarithm.
    seen_blur_px: the blur of an earlier pass, which said where the segments are expected; else None.
    """

    pieces: Pieces
    terms: int
    knots: Knots
    blur_px: float
    blur_sigma: float = BLUR_SIGMA
    seen_blur_px: float | None = None

    @cached_property
    def knot_weights(self) -> np.ndarray:
        """Return the weight (s, knots) of each knot in the shading of each segment."""
        return self.knots.weights(self.pieces)

    def of(self, some: slice) -> "ShadedSegments":
        """Return the task of some of the segments."""
        return replace(self, pieces=self.pieces.select(some))

    def tempered(self) -> "ShadedSegments":
        """Return the task with the weights of pixels bounded by the error of the model of light.

        Of pixels at one distance from the axis, many together count no more than that error allows.
        """
        pieces = self.pieces
        model_error = _MODEL_ERROR_SHARE * contrast_of(pieces)
        bins = np.floor(pieces.offset_px / _MODEL_ERROR_BIN_PX).astype(int)
        bins -= bins.min(initial=0)
        total = np.bincount(bins.ravel(), np.ravel(pieces.weight**2))
        weight = pieces.weight / np.sqrt(1.0 + total[bins] * model_error**2)
        return replace(self, pieces=replace(pieces, weight=weight))

    def blur_deviation(self, log_blur: np.ndarray | float) -> np.ndarray | float:
        """Return how many prior sigmas the logarithm of the blur lies from the prior."""
        return (log_blur - np.log(self.blur_px)) / self.blur_sigma
