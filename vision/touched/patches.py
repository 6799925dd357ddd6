"""Patches of a bar's band, each some pixels long, in bins across the bar, and what neighbouring ones
differ by."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vision.geometry.optics import light_of
from vision.wire.bands import Pieces

# [grey] Largest value of a picture of 8 bit. Stated.
FULL_SCALE = 255.0
# [1] Divisor in place of zero. Derived.
TINY = 1e-100


@dataclass(frozen=True)
class PatchSums:
    """Weighted sums (s, b) over the pixels of each of s patches, in bins across the bar.

    weight: of the weights; the next four: of weight times that quantity; variance_share: of
    interpolation weight times pixel weight, which over weight² is the variance of the patch's mean.
    """

    weight: np.ndarray
    light: np.ndarray
    background: np.ndarray
    background_slope: np.ndarray
    light_per_grey: np.ndarray
    variance_share: np.ndarray

    @classmethod
    def along_bar(
        cls, pieces: Pieces, is_used: np.ndarray, position: np.ndarray, bins: int, gamma: float
    ) -> "PatchSums":
        """Return the sums of pieces, in their order along the bar.

        is_used, position (s, p): of the pixels, which of them count and their places, in bins.
        """
        light, light_per_grey = light_of(pieces.grey[is_used], FULL_SCALE, gamma)
        background, background_per_grey = light_of(pieces.background[is_used], FULL_SCALE, gamma)
        background_slope = background_per_grey * pieces.slope[is_used]
        weight = (pieces.weight[is_used] / light_per_grey) ** 2
        patch, _ = np.nonzero(is_used)
        patch = np.argsort(np.argsort(pieces.place))[patch]  # its number along the bar
        shared = _SharedPixels.between(position[is_used], patch, weight, (len(pieces), bins))
        return cls(
            weight=shared.sums(1.0),
            light=shared.sums(light),
            background=shared.sums(background),
            background_slope=shared.sums(background_slope),
            light_per_grey=shared.sums(light_per_grey),
            variance_share=shared.sums(shared.share),
        )

    def mean(self, sums: np.ndarray) -> np.ndarray:
        """Return sums (s, b) over the weight, 0 where there is none."""
        return sums / np.where(self.weight > 0, self.weight, 1.0)


@dataclass(frozen=True)
class PatchDifferences:
    """The light of each patch, but the outermost two, minus the mean of its two neighbours'.

    So light that changes steadily along the bar is no difference. All (s - 2, b).
    light, background, background_slope: of light and its slope, the latter two of the picture
    without rods. noise: the variance of `light` by the pixels' noise. weight: one over the variance
    that patches of their weights have, 0 where a bin has hardly any of a pixel: rounding decides
    whether it has one.
    """

    light: np.ndarray
    background: np.ndarray
    background_slope: np.ndarray
    noise: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, patches: PatchSums) -> "PatchDifferences":
        """Return the differences of patches along the bar."""
        variance = _sum_variances(1.0 / np.maximum(patches.weight, TINY))
        return cls(
            light=_second_difference(patches.mean(patches.light)),
            background=_second_difference(patches.mean(patches.background)),
            background_slope=_second_difference(patches.mean(patches.background_slope)),
            noise=_sum_variances(patches.mean(patches.mean(patches.variance_share))),
            weight=np.where(variance < 0.1 / TINY, 1.0 / variance, 0.0),
        )

    @cached_property
    def residual(self) -> np.ndarray:
        """Return the light without the share of the background that explains it best, bin by
        bin."""
        power = np.maximum(np.sum(self.weight * self.background**2, axis=0), TINY)
        share = np.sum(self.weight * self.light * self.background, axis=0) / power
        return self.light - np.clip(share, 0.0, 1.0) * self.background

    @cached_property
    def relative(self) -> np.ndarray:
        """Return the weights, 1 where all patches weigh the same."""
        power = np.maximum(np.sum(self.weight**2, axis=0), TINY)
        return self.weight * np.sum(self.weight, axis=0) / power

    def patch_variance(self, variance: np.ndarray) -> np.ndarray:
        """Return the variance (b,) of one patch by those of all differences, averaged across.

        The difference to the mean of two neighbours has 1.5 times the variance of one patch.
        """
        number = np.maximum(np.sum(self.relative, axis=0), TINY)
        return np.sum(self.relative * variance, axis=0) / (1.5 * number)


@dataclass(frozen=True)
class _SharedPixels:
    """Pixels (n,), each shared between the two bins nearest to its position.

    cell (2 n,): first the bin below each pixel, then that above, counted through all patches.
    share (2, n): interpolation weights. weight (2, n): the same times the pixels' weights. shape:
    how many patches and bins there are.
    """

    cell: np.ndarray
    share: np.ndarray
    weight: np.ndarray
    shape: tuple[int, int]

    @classmethod
    def between(
        cls, position: np.ndarray, patch: np.ndarray, weight: np.ndarray, shape: tuple[int, int]
    ) -> "_SharedPixels":
        """Return pixels at positions (n,), in bins, of patches by their number (n,)."""
        bins = shape[1]
        below = np.clip(np.floor(position), 0, bins - 2)
        fraction = np.clip(position - below, 0.0, 1.0)
        first = bins * patch + below.astype(int)
        share = np.stack([1.0 - fraction, fraction])
        return cls(np.concatenate([first, first + 1]), share, share * weight, shape)

    def sums(self, values: np.ndarray | float) -> np.ndarray:
        """Return the weighted sums (s, b) of values of the pixels (n,), or of their shares (2, n)."""
        weighted = np.ravel(self.weight * values)
        return np.bincount(self.cell, weighted, self.shape[0] * self.shape[1]).reshape(self.shape)


def _second_difference(values: np.ndarray) -> np.ndarray:
    """Return each row but the outermost two of values (s, b) minus the mean of its two
    neighbours."""
    return values[1:-1] - 0.5 * (values[:-2] + values[2:])


def _sum_variances(variance: np.ndarray) -> np.ndarray:
    """Return the variance (s - 2, b) of `_second_difference` from those of independent rows (s,
    b)."""
    return variance[1:-1] + 0.25 * (variance[:-2] + variance[2:])
