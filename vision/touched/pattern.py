"""Where the pattern behind a bar ends: what neighbouring patches of a segment differ by.

A profile is the mean of the patches of a segment, so that printed squares, holes and grain behind
the bar are averaged away. What remains of them is in the differences: beyond the bar's edge each
patch differs from its two neighbours as the picture without rods does there, and on the bar it does
not. For the second differences Δy of the light and Δg of that picture, bin by bin,

    Δy = λ (share · cover · Δg + share · leak · Δs) + ε

with the same share, cover and leak as those of the profiles (`evidence.py`). No model of the bar's
light is in it: light that changes steadily along the bar has no second difference. All terms are
quadratic in share, cover and leak, so six sums over the patches of a segment are enough.

λ is the part of Δg's variance in a segment that is pattern and not noise of the picture without
rods.
"""

from dataclasses import dataclass

import numpy as np

from vision.touched.patches import TINY, PatchDifferences

# [1] Variance of a bin's noise over that of independent pixels of its weight: each is shared between
# two bins. Derived.
_SHARED = 2.0 / 3.0
# [1] Evidence of differences over that of as many independent ones: a difference shares patches with
# the next two, correlated by −2/3 and 1/6, so a pattern's share has 1 + 2 (4/9 + 1/36) times the
# variance. Derived.
_INDEPENDENT = 1.0 / (1.0 + 2.0 * (4.0 / 9.0 + 1.0 / 36.0))


@dataclass(frozen=True)
class Pattern:
    """Weighted sums over the differences of each of k segments, in b bins across the bar.

    background (3, k, b): of Δg², Δg Δs and Δs². light (2, k, b): of Δg Δy and Δs Δy. power (k,): of
    Δy². least_chi2 (k,): of Δy without the share of Δg that explains it best, bin by bin: no
    bar leaves less.
    """

    background: np.ndarray
    light: np.ndarray
    power: np.ndarray
    least_chi2: np.ndarray

    def products(self, shares: np.ndarray) -> np.ndarray:
        """Return the products (k, n + 1, n + 1) of n columns and the light, which is last.

        shares (n, k, b): of the background's pattern in each column.
        """
        columns = len(shares)
        products = np.zeros((len(self.power), columns + 1, columns + 1))
        products[:, :columns, :columns] = np.einsum(
            "ikb,kb,jkb->kij", shares, self.background[0], shares
        )
        with_light = np.einsum("ikb,kb->ki", shares, self.light[0])
        products[:, :columns, columns] = with_light
        products[:, columns, :columns] = with_light
        products[:, columns, columns] = self.power
        return products


def sum_pattern(
    differences: PatchDifferences,
    membership: np.ndarray,
    texture: np.ndarray,
    noise_behind: float,
) -> Pattern:
    """Sum the differences between the patches of each segment.

    membership (k, s - 2): 1 for the differences of each segment. texture (k, b): variance between
    patches beyond the pixels' noise. noise_behind: variance of the background's noise over that of
    the light.
    """
    share = membership.T @ _pattern_share(differences, membership, noise_behind)[:, None]
    light = differences.light
    background = share * differences.background
    slope = share * differences.background_slope
    by_texture = 1.5 * differences.weight * (membership.T @ texture)
    variance = 1.0 + _SHARED * noise_behind * share + by_texture  # over that of the light's noise
    weight = _INDEPENDENT * differences.weight / variance

    def total(values: np.ndarray) -> np.ndarray:
        """Return the weighted sums (k, b) of values of the differences."""
        return membership @ (weight * values)

    power = total(light**2)
    return Pattern(
        background=np.stack([total(background**2), total(background * slope), total(slope**2)]),
        light=np.stack([total(background * light), total(slope * light)]),
        power=np.sum(power, axis=1),
        least_chi2=np.sum(np.minimum(power, total(differences.residual**2)), axis=1),
    )


def _pattern_share(
    differences: PatchDifferences, membership: np.ndarray, noise_behind: float
) -> np.ndarray:
    """Return λ (k,): the part of the background's variance in each segment that is no noise."""
    squares = differences.weight * differences.background**2  # over the light's own noise
    number = np.maximum(membership @ np.sum(differences.weight > 0.0, axis=1), 1)
    variance = membership @ np.sum(squares, axis=1) / number
    return np.clip(1.0 - _SHARED * noise_behind / np.maximum(variance, TINY), 0.0, 1.0)
