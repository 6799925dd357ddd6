"""A first pass for a rod near a predicted curve, coarse to a pixel or two, and up to a hundred off.

A short segment of a thin, dim wire before noise, print or a shadow's border does not say where the
wire is; all segments of a curve together do. So no segment decides. Each spreads a vote over where a
rod may be, and of all smooth curves the one with most votes is taken (the Hough transform; for
targets in noise, "track before detect").

A pixel does not show the rod where one of two pictures explains it. The picture without rods lacks
the shadows of hub and bar. The picture of what stands still in the trial has these shadows, and not
the wire, which moves.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from vision.geometry.sampling import grid_points
from vision.wire.bands import Pieces
from vision.wire.binned import sums
from vision.wire.points import LinePoints

# [px] Least step from curve to curve that is tried; a thicker wire's is half of its width. Derived.
_LEAST_STEP_PX = 2
# [px] Largest distance of the wire from the nearest curve that is tried: twice their step.
# Derived.
_NEAR_PX = 4
# [px] Sigma of a point that has all votes of its segment: segments are placed to a pixel. Stated.
_SIGMA_PX = 1.0
# [1] Votes of a point that has none: its sigma is finite then, and so large that it has no weight.
# Derived.
_LEAST_VOTE = 1e-9
# [sigma] Votes of a curve above the mean by which it is surely a wire. In noise alone the best of
# all curves has 3.4, one in 100 times 6, and ten times more rarely each sigma more; a wire as bright
# as the noise has 18. Study: tests/vision/wire/test_coarse.py.
_SURE_SIGMAS = 8.0
# [widths] Of the rod, over which the mean is subtracted: shade on what is behind changes over
# more. Derived.
_SHADE_WIDTHS = 3
# [1] A background scaled by more than this from 1 is none: the segment shows something else. By 0.3
# or 0.8 touch moves by 0.08 sigma. Study: thresholds.py wire.coarse _PLAIN_GAIN ….
_PLAIN_GAIN = 0.5
# [1] Keeps a background that does not vary in a segment from making its two equations singular.
# Derived.
_WEAK = 1e-3


@dataclass(frozen=True)
class Votes:
    """The votes of segments of a predicted curve for where a rod is.

    share (s, 2 reach + 1): of the contrast near each segment that neither picture explains, the part
    that a rod at a shift of -reach, …, reach px would explain.
    changed (s, 2 reach + 1): the same part of the contrast that the picture without rods does not
    explain. A wire that moves by less than its width is partly in the picture of what stands still,
    so that `share` would put it to one side.
    """

    pieces: Pieces
    share: np.ndarray
    changed: np.ndarray

    @property
    def reach_px(self) -> int:
        """Return the largest shift."""
        return self.share.shape[1] // 2

    @property
    def step_px(self) -> int:
        """Return the step from curve to curve in which the wire is not missed: half of its width."""
        if not len(self.pieces):
            return _LEAST_STEP_PX
        return max(_LEAST_STEP_PX, round(float(np.median(self.pieces.radius_px))))

    def points(self, shift_px: np.ndarray, near_px: int = _NEAR_PX) -> LinePoints:
        """Return the middle of each segment's votes within near_px of a curve, shift_px (s,) off the
        predicted one.

        A segment that the picture of what stands still explains has no votes, however much it differs
        from the picture without rods: before a lens cap that is so everywhere.
        """
        near = np.rint(shift_px).astype(int)[:, None] + np.arange(-near_px, near_px + 1)
        share = self._squared_votes(near)
        total = np.sum(share, axis=1)
        mean = np.sum(share * near, axis=1) / np.maximum(total, 1e-12)
        shift = np.where(total > 0.0, mean, shift_px)
        px = self.pieces.foot_px + shift[:, None] * self.pieces.normal
        vote = np.sqrt(np.max(share, axis=1, initial=_LEAST_VOTE**2))
        return LinePoints(px, self.pieces.normal, _SIGMA_PX / np.sqrt(vote), self.pieces.place)

    def _squared_votes(self, shifts_px: np.ndarray) -> np.ndarray:
        """Return the squared votes (s, n) at whole shifts (s, n): weak ones far from the strongest
        are no wire.
        """
        reach = self.reach_px
        column = np.clip(shifts_px + reach, 0, 2 * reach)
        share = np.take_along_axis(self.changed, column, axis=1)
        has_votes = np.any(self.share > 0.0, axis=1, keepdims=True)
        return np.where((np.abs(shifts_px) <= reach) & has_votes, share, 0.0) ** 2


def likely_curve(
    seen: Sequence[Votes], shapes_px: np.ndarray, grids: Sequence[np.ndarray]
) -> tuple[np.ndarray, bool]:
    """Find the curve with most votes of all segments, and whether it surely has more than noise
    gives.

    A curve is a sum of shapes (s, k), with coefficients (k,) from the grids; s: segments in all.
    Of equal ones that nearest to the predicted curve is returned.
    """
    share = np.concatenate([one.share for one in seen])
    if len(share) == 0:
        return np.zeros(len(grids)), False
    coefficients = grid_points(*grids)
    widest = np.maximum([grid[-1] for grid in grids], 1e-12)
    total = _votes_of_curves(share, coefficients, shapes_px)
    total -= _LEAST_VOTE * np.sum((coefficients / widest) ** 2, axis=1)
    best = int(np.argmax(total))
    return coefficients[best], bool(total[best] > _most_by_noise(share))


def _most_by_noise(share: np.ndarray) -> float:
    """Return the votes that no curve through noise has; share (s, 2 reach + 1): see `Votes`."""
    expected = len(share) * np.mean(share)
    return expected + _SURE_SIGMAS * np.sqrt(len(share)) * np.std(share)


def _votes_of_curves(
    share: np.ndarray, coefficients: np.ndarray, shapes_px: np.ndarray
) -> np.ndarray:
    """Return the votes (c,) of curves, coefficients (c, k) of shapes (s, k); none beyond the reach.

    share (s, 2 reach + 1): see `Votes`.
    """
    total = np.zeros(len(coefficients))
    middle = share.shape[1] // 2 + 1
    for row, shape in zip(np.pad(share, ((0, 0), (1, 1))), shapes_px):
        column = np.rint(coefficients @ shape).astype(int) + middle
        total += row.take(column, mode="clip")
    return total


def votes(pieces: Pieces, static_share: float, reach_px: int) -> Votes:
    """Return the votes, at shifts up to reach_px, of those segments that have any.

    The segments are of bands that hold what stands still as second background. static_share:
    variance of that one's noise over one picture's. The picture without rods is as noisy as a frame:
    counted as exact, its noise would drown a dim rod.
    """
    width_px = 1
    if len(pieces):
        width_px = 2 * max(1, round(float(np.median(pieces.radius_px)))) + 1
    place, count = _places(pieces, reach_px)
    pixels = np.maximum(sums((pieces.weight > 0).astype(float), place, count), 1.0)
    changed = _mean_residual(pieces, pieces.background, 1.0, place, pixels, width_px)
    moving = _mean_residual(pieces, pieces.static, static_share, place, pixels, width_px)
    weaker = np.minimum(changed**2, moving**2)
    unexplained = np.where(changed * moving > 0.0, weaker, 0.0)
    share = _share(unexplained * pixels - 1.0, width_px)
    has_votes = np.any(share > 0.0, axis=1)
    changed_share = _share(changed**2 * pixels - 1.0, width_px)
    return Votes(pieces.select(has_votes), share[has_votes], changed_share[has_votes])


def _mean_residual(
    pieces: Pieces,
    background: np.ndarray,
    variance_share: float,
    place: np.ndarray,
    pixels: np.ndarray,
    width_px: int,
) -> np.ndarray:
    """Return the mean residual of a background in each column (s, c), over the noise, without slow
    shade.
    """
    residual = _unexplained(pieces, background, variance_share)
    mean = sums(residual, place, pixels.shape[1]) / pixels
    return mean - uniform_filter1d(mean, _SHADE_WIDTHS * width_px, axis=1)


def _share(energy: np.ndarray, width_px: int) -> np.ndarray:
    """Return the part of the energy (s, c) of each row that a window of so many columns holds."""
    window = width_px * uniform_filter1d(energy, width_px, axis=1, mode="constant")
    total = np.sum(np.maximum(energy, 0.0), axis=1, keepdims=True)
    return np.maximum(window, 0.0) / np.maximum(total, 1e-9)


def _places(pieces: Pieces, reach_px: int) -> tuple[np.ndarray, int]:
    """Return of each pixel its column, a px wide, among those of all segments, and columns a
    segment.
    """
    count = 2 * reach_px + 1
    column = np.clip(np.rint(pieces.offset_px).astype(int) + reach_px, 0, count - 1)
    return column + count * np.arange(len(pieces))[:, None], count


def _unexplained(pieces: Pieces, background: np.ndarray, variance_share: float) -> np.ndarray:
    """Return the residual (s, p), over its noise, of a background with a gain and an offset a
    segment.

    variance_share: variance of the background's noise over one picture's.
    """
    weight = pieces.weight
    behind = background * weight
    grey = pieces.grey * weight
    design = np.stack([behind, weight], axis=1)  # (s, 2, p)
    normal = design @ np.swapaxes(design, 1, 2) + _WEAK * np.eye(2)
    gain, offset = np.linalg.solve(normal, design @ grey[:, :, None])[:, :, 0].T
    is_plain = np.abs(gain - 1.0) < _PLAIN_GAIN
    gain = np.where(is_plain, gain, 1.0)[:, None]
    offset = np.where(is_plain, offset, 0.0)[:, None]
    residual = grey - gain * behind - offset * weight
    return residual / np.sqrt(1.0 + variance_share * gain**2)
