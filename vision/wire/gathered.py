"""Normal equations of a rod's shading at many shifts, blurs and widths, from pixels summed once.

Segments that show enough of their background are summed beforehand (`summed_segments.py`), the
others are evaluated pixel by pixel.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from vision.wire.bands import Pieces
from vision.wire.cylinder import alike
from vision.wire.shading import SegmentEquations
from vision.wire.summed_segments import ShadingEquations, SummedSegments

# [px] Pixels farther than this from the rod's edges show the background alone. Derived.
_BACKGROUND_MARGIN_PX = 2.0
# [1] Share of a segment's pixels that must show the background alone, else it is not summed:
# without such pixels cubic interpolation leaves negative eigenvalues. Half or twice it moves
# nothing on the fixtures. Study: thresholds.py wire.gathered _LEAST_BACKGROUND_SHARE ….
_LEAST_BACKGROUND_SHARE = 0.15


class GatheredEquations:
    """Normal equations of the shading coefficients of all knots, for many shifts and models at
    once.
    """

    def __init__(
        self,
        pieces: Pieces,
        knot_weights: np.ndarray,
        robust: np.ndarray,
        *,
        each_pixel: bool = False,
    ):
        """Sum the pixels of the segments.

        knot_weights (s, knots): weight of each knot in the shading of each segment.
        robust (s,): weight of each segment.
        each_pixel: sum nothing beforehand. It is slower, and the matrices are positive semidefinite
        whatever the pixels show.
        """
        relative_radius = pieces.relative_radius
        gathers = _shows_enough_background(pieces) & (not each_pixel)
        self._groups: list[SummedSegments | _PixelSegments] = []
        self._relative_radii: list[np.ndarray | float] = []
        summed = np.flatnonzero(gathers)
        if len(summed):
            for group in alike(pieces.radius_px[summed]):
                some = summed[group]
                self._groups.append(
                    SummedSegments(pieces.select(some), knot_weights[some], robust[some])
                )
                self._relative_radii.append(float(np.mean(relative_radius[some])))
        others = np.flatnonzero(~gathers)
        if len(others):
            self._groups.append(
                _PixelSegments(pieces.select(others), knot_weights[others], robust[others])
            )
            self._relative_radii.append(relative_radius[others])

    def normal(
        self, shifts_px: Sequence[float], models: Sequence[tuple[float, float]], terms: int
    ) -> ShadingEquations:
        """Return the normal equations (shifts · models, …) of segments moved by each common shift,
        px at their mean half-width.

        models: of each how many times as thick the rod is, and the blur, px.
        terms: number of shading functions; size = knots × terms.
        """
        parts = []
        for group, relative_radius in zip(self._groups, self._relative_radii):
            moved_px = np.multiply.outer(shifts_px, relative_radius)
            parts.append(group.normal_at(moved_px, models, terms))
        return ShadingEquations(
            left=sum(part.left for part in parts),
            right=sum(part.right for part in parts),
            power=sum(part.power for part in parts),
        )


def exactly_if_needed(compute: Callable[[bool], np.ndarray]) -> np.ndarray:
    """Return `compute(False)` from summed pixels, or `compute(True)` from each pixel where that
    fails.

    Summed pixels may leave a matrix that is not positive definite, which raises LinAlgError.
    """
    try:
        return compute(False)
    except np.linalg.LinAlgError:
        return compute(True)


def _shows_enough_background(pieces: Pieces) -> np.ndarray:
    """Return which segments (s,) show enough background for the error of cubics to be negligible."""
    is_background = np.abs(pieces.offset_px) > pieces.radius_px[:, None] + _BACKGROUND_MARGIN_PX
    is_seen = pieces.weight > 0
    count = np.count_nonzero(is_background & is_seen, axis=1)
    return count > _LEAST_BACKGROUND_SHARE * is_seen.shape[1]


class _PixelSegments:
    """Segments that show little of the background: each model is evaluated at every pixel."""

    def __init__(self, pieces: Pieces, knot_weights: np.ndarray, robust: np.ndarray):
        self._pieces = pieces
        self._knot_weights = knot_weights
        self._robust = robust

    def normal_at(
        self, shifts_px: np.ndarray, models: Sequence[tuple[float, float]], terms: int
    ) -> ShadingEquations:
        """Return the normal equations (shifts · models, …) of the segments, moved by shifts (n, s)."""
        lefts = []
        rights = []
        powers = []
        for shift_px, (wider, blur_px) in product(shifts_px, models):
            moved = self._pieces.moved(shift_px)
            thick = replace(moved, radius_px=wider * moved.radius_px)
            equations = SegmentEquations(thick, blur_px, terms)
            left, right = equations.shared(self._knot_weights, self._robust)
            lefts.append(left)
            rights.append(right)
            powers.append(self._robust @ equations.power)
        return ShadingEquations(np.array(lefts), np.array(rights), np.array(powers))
