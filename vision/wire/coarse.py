"""A first look for a rod beside a predicted curve, a pixel or two coarse and up to a hundred off.

A short piece of a thin, dim wire before noise, print or a shadow's border does not tell where it is; all pieces of a
curve together do. So no piece decides. Each spreads a vote over where a rod may be, and of all smooth curves that with
most votes is taken (the Hough transform; for targets in noise, "track before detect").

What a pixel shows is no rod's where either of two pictures explains it: that without rods, which has no shadow of hub
and bar, or what stands still in the trial, which a wire that moves is not in.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from vision.wire.bands import Pieces
from vision.wire.binned import sums
from vision.wire.points import LinePoints

# [px] A wire bends no farther than this out of the curves that are tried: twice their step.
# Derived.
_NEAR_PX = 4
# [px] Of a point that has all votes of its piece: pieces are placed to a pixel. Stated.
_SIGMA_PX = 1.0
# [1] Keeps the sigma of a point without any finite, and its weight nothing: 32 m of pixels.
# Derived.
_LEAST_VOTE = 1e-9
# [sigma] The best of all curves through noise has 3.4, one in 100 has 6, one in ten less each
# sigma on; a wire as bright as the noise has 18. Study: tests/vision/wire/test_coarse.py.
_SURE_SIGMAS = 8.0
# [1] Widths of the rod, over which the mean is taken off: shade on what is behind changes over
# more. Derived.
_SHADE_WIDTHS = 3
# [1] A background scaled by more than this from 1 is none: the piece shows something else. Set by
# eye. Study: thresholds.py lines.coarse _PLAIN_GAIN ….
# a background scaled by more than this from 1 is none: the piece shows something else
_PLAIN_GAIN = 0.5
# [1] Keeps a background that a piece cannot tell from making its two equations singular. Derived.
_WEAK = 1e-3


@dataclass(frozen=True)
class Votes:
    """Of pieces of a predicted curve the share (s, 2 reach + 1) of what is unexplained beside each that a rod at a
    shift of -reach, …, reach px would account for.

    share: by both pictures; changed: by that without rods alone. A wire that moves by less than its width is partly in
    what stands still, and seems to lie on the side that is not.
    """

    pieces: Pieces
    share: np.ndarray
    changed: np.ndarray

    @property
    def reach_px(self) -> int:
        """The largest shift."""
        return self.share.shape[1] // 2

    def points(self, shift_px: np.ndarray) -> LinePoints:
        """The middle of each piece's votes near a curve, shift_px (s,) away from the predicted one. A piece that what
        stands still explains has none: a lens cap differs from the picture without rods everywhere."""
        near = np.rint(shift_px).astype(int)[:, None] + np.arange(-_NEAR_PX, _NEAR_PX + 1)
        share = np.take_along_axis(
            self.changed, np.clip(near + self.reach_px, 0, 2 * self.reach_px), axis=1
        )
        share = (
            np.where(np.abs(near) <= self.reach_px, share, 0.0) ** 2
        )  # squared: what lies beside is no wire
        share = np.where(np.any(self.share > 0.0, axis=1, keepdims=True), share, 0.0)
        whole = np.sum(share, axis=1)
        shift = np.where(
            whole > 0.0, np.sum(share * near, axis=1) / np.maximum(whole, 1e-12), shift_px
        )
        px = self.pieces.foot_px + shift[:, None] * self.pieces.normal
        vote = np.sqrt(np.max(share, axis=1, initial=_LEAST_VOTE**2))
        return LinePoints(px, self.pieces.normal, _SIGMA_PX / np.sqrt(vote), self.pieces.place)


def likely_curve(
    seen: Sequence[Votes], shapes_px: np.ndarray, grids: Sequence[np.ndarray]
) -> tuple[np.ndarray, bool]:
    """Coefficients (k,) from the grids with which the sum of shapes (s, k) has most votes of all pieces (s in all), and
    whether it surely has more than curves through noise would. Of equal ones that nearest to the predicted curve."""
    mesh = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, len(grids))
    share = np.concatenate([one.share for one in seen])
    if len(share) == 0:
        return np.zeros(len(grids)), False
    padded, reach = np.pad(share, ((0, 0), (1, 1))), seen[0].reach_px
    total = -_LEAST_VOTE * np.sum((mesh / [max(grid[-1], 1e-12) for grid in grids]) ** 2, axis=1)
    for row, shape in zip(padded, shapes_px):
        total += row.take(np.rint(mesh @ shape).astype(int) + reach + 1, mode="clip")
    best, expected = int(np.argmax(total)), len(share) * np.mean(share)
    return mesh[best], bool(
        total[best] > expected + _SURE_SIGMAS * np.sqrt(len(share)) * np.std(share)
    )


def votes(pieces: Pieces, still_share: float, reach_px: int) -> Votes:
    """Votes of those pieces, of bands with what stands still, that have any, at shifts up to reach_px.

    still_share: what part of one picture's variance what stands still has. That without rods is as noisy as a frame: in
    a noise that is no difference a dim rod would drown.
    """
    wide = 2 * max(1, round(float(np.median(pieces.radius_px)))) + 1 if len(pieces) else 1
    place, count = _places(pieces, reach_px)
    pixels = np.maximum(sums((pieces.weight > 0).astype(float), place, count), 1.0)
    both = np.stack(
        [
            sums(_unexplained(pieces, background, share), place, count) / pixels
            for background, share in ((pieces.background, 1.0), (pieces.still, still_share))
        ]
    )
    both -= uniform_filter1d(both, _SHADE_WIDTHS * wide, axis=2)
    alike = np.where(both[0] * both[1] > 0.0, np.min(both**2, axis=0), 0.0)
    share, changed = _share(alike * pixels - 1.0, wide), _share(both[0] ** 2 * pixels - 1.0, wide)
    votes_at_all = np.any(share > 0.0, axis=1)
    return Votes(pieces.select(votes_at_all), share[votes_at_all], changed[votes_at_all])


def _share(energy, wide: int) -> np.ndarray:
    """Part of the energy (s, c) of each row that a window of so many columns holds."""
    window = wide * uniform_filter1d(energy, wide, axis=1, mode="constant")
    whole = np.sum(np.maximum(energy, 0.0), axis=1, keepdims=True)
    return np.maximum(window, 0.0) / np.maximum(whole, 1e-9)


def _places(pieces: Pieces, reach_px: int) -> tuple[np.ndarray, int]:
    """For each pixel its column, a px wide, among those of all pieces; and how many columns a piece has."""
    count = 2 * reach_px + 1
    column = np.clip(np.rint(pieces.offset_px).astype(int) + reach_px, 0, count - 1)
    return column + count * np.arange(len(pieces))[:, None], count


def _unexplained(pieces: Pieces, background, share: float) -> np.ndarray:
    """What a background with a gain and an offset of each piece's own leaves (s, p), over its noise; share: of one
    picture's variance that the background has."""
    columns = (
        np.stack([background, np.ones_like(background), pieces.grey], axis=1)
        * pieces.weight[:, None]
    )
    normal = columns @ columns.transpose(0, 2, 1)
    a, b, d = normal[:, 0, 0] + _WEAK, normal[:, 0, 1], normal[:, 1, 1] + _WEAK
    by_a, by_d = normal[:, 0, 2], normal[:, 1, 2]
    gain, offset = (np.array([d * by_a - b * by_d, a * by_d - b * by_a]) / (a * d - b * b))[
        ..., None
    ]
    plain = np.abs(gain - 1.0) < _PLAIN_GAIN
    gain, offset = np.where(plain, gain, 1.0), np.where(plain, offset, 0.0)
    return (columns[:, 2] - gain * columns[:, 0] - offset * columns[:, 1]) / np.sqrt(
        1.0 + share * gain**2
    )
