"""Light profiles across a bar: the measurements that the evidence of its position is computed from.

A profile is the light along a line across the bar. The bar is divided along its axis into a few
segments, and the pixels of a segment are averaged into one profile on a regular grid across the
bar, with a step of STEP_PX.

Each pixel is shared between the two nearest bins of the grid by linear interpolation weights, so
that nothing jumps when the grid is moved by a fraction of a step. For bin b of a segment with
pixels i, weights w_i = 1 / sigma_i² and interpolation weights a_ib:

    W_b     = sum_i a_ib w_i                      total weight of the bin
    y_b     = sum_i a_ib w_i y_i / W_b            its light
    sigma_b = sqrt(1 / W_b + T_b / n_b)           its standard deviation

The variance has two terms: noise of the pixels, and texture T_b that the n_b patches of the segment
show beyond that noise (printed patterns, compression). Errors of bins next to each other are
correlated; `variance_inflation` states by how much. Because all bins lie on one grid, the normal
equations of all positions of the bar are a few products of matrices (`evidence.py`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import uniform_filter1d

from vision.pictures.view import SATURATED
from vision.touched.patches import FULL_SCALE, TINY, PatchDifferences, PatchSums
from vision.touched.pattern import Pattern, sum_pattern
from vision.wire.bands import Pieces

# [px] Step of the grid across the bar: a third of a lens blur. Study: thresholds.py
# touched.profiles STEP_PX ….
STEP_PX = 0.25
# [px] The profile's length beyond either edge: wide compared with the blur, and a shadow's border
# is seldom as near. Study: bar_scenes.py.
OUTSIDE_PX = 6.0
# [px] The profile's length inside either edge of a thick bar: pixels farther in do not constrain
# the edge, and cost time. By 5 or 12 a slope moves by 1.0 or 1.2 sigma. Study: thresholds.py
# touched.profiles _INSIDE_PX ….
_INSIDE_PX = 8.0
# [1] Least sigma of what the model does not explain, over the contrast; larger model errors show
# in the misfit. Study: bar_starts.py.
_MODEL_ERROR_SHARE = 0.001
# [px] Greatest distance across at which errors count as correlated: a lens blur. Study:
# bar_starts.py.
_CORRELATION_PX = 1.0
# [steps] Window over which the texture is averaged: the distance of correlated errors. Derived.
_TEXTURE_WINDOW = 5
# [1] Median of the square of a standard Gaussian variable. Derived.
_MEDIAN_SQUARED = 0.455
# [1] Largest texture over the one that the median gives: the edge of a bar that is tilted against
# its expected axis passes a few patches only, and is no texture. Study: bar_scenes.py.
_LARGEST_OVER_MEDIAN = 3.0
# [bins] Weight of the prior that a segment has the mean texture: half the bins of a segment. By 25 or
# 100 a d_x moves by 0.3 sigma, and in the sun another of two bars is taken, whose slope is off by 10°.
# Study: thresholds.py touched.profiles _PRIOR_BINS ….
_PRIOR_BINS = 50


@dataclass(frozen=True)
class Profiles:
    """Light profiles of k segments of a bar, on a grid of b bins across it.

    offset_px (b,): the grid, from the bar's expected middle.
    light, sigma (k, b): in parts of full scale; sigma is infinite where a bin has no pixel.
    background, background_slope (k, b): light of the picture without rods, about its median, and
    its slope per px.
    light_per_grey (k, b): derivative of the light by the grey level.
    place_mm (k,): the segments' middles along the bar. radius_px: half the bar's width.
    variance_inflation: variance of a mean over bins, over that of independent bins.
    is_saturated: whether the light on the bar is brighter somewhere than its pixels can say.
    pattern: what the patches of each segment differ by.
    """

    offset_px: np.ndarray
    light: np.ndarray
    sigma: np.ndarray
    background: np.ndarray
    background_slope: np.ndarray
    light_per_grey: np.ndarray
    place_mm: np.ndarray
    radius_px: float
    variance_inflation: float
    is_saturated: bool
    pattern: Pattern

    def __len__(self) -> int:
        """Return the number of segments."""
        return len(self.place_mm)

    @cached_property
    def is_observed(self) -> np.ndarray:
        """Return which bins (k, b) have a pixel."""
        return np.isfinite(self.sigma)

    @cached_property
    def contrast(self) -> float:
        """Return the range of the light in the median segment."""
        ranges = []
        for light, is_observed in zip(self.light, self.is_observed):
            ranges.append(light_range(light[is_observed]))
        return float(np.median(ranges))

    @cached_property
    def weight(self) -> np.ndarray:
        """Return the inverse variance (k, b) of the light about a model of it."""
        return 1.0 / (self.sigma**2 + (_MODEL_ERROR_SHARE * self.contrast) ** 2)

    @cached_property
    def moments(self) -> np.ndarray:
        """Return the products (9, k, b) of w, the background g, its slope s and the light y for the
        normal equations, with what the pattern adds to them.

        In this order, which `evidence._Design.products` has, too: w, w g, w s, w g², w g s, w s²,
        w y, w g y, w s y.
        """
        one = np.ones_like(self.light)
        first = np.stack([one, self.background, self.background_slope])
        products = [*first, *(first[[1, 1, 2]] * first[[1, 2, 2]]), *(first * self.light)]
        moments = self.weight * np.stack(products)
        moments[3:6] += self.pattern.background
        moments[7:] += self.pattern.light
        return moments

    @cached_property
    def power(self) -> np.ndarray:
        """Return the weighted sum (k,) of the light's square, over its profile and pattern."""
        return np.sum(self.weight * self.light**2, axis=1) + self.pattern.power

    @cached_property
    def log_jacobian(self) -> np.ndarray:
        """Return the term (k,) that makes −2 log evidence of the light that of the grey levels.

        Evidences under two transfer curves are comparable only as densities of the same data, the
        grey levels.
        """
        whitened = np.where(self.is_observed, np.sqrt(self.weight) * self.light_per_grey, 1.0)
        return -2.0 * np.sum(np.log(whitened), axis=1)


def compute_profiles(pieces: Pieces, segments: int, reach_px: float, gamma: float) -> Profiles:
    """Compute the profiles of a bar whose middle is at most reach_px from where it is expected.

    pieces: patches of the bar's band, each some pixels long. segments: how many profiles; fewer
    where there are less than two patches for each. gamma: of the transfer curve, grey = 255
    light^(1/gamma).
    """
    radius_px = float(np.median(pieces.radius_px))
    offset_px = pieces.offset_px * (radius_px / pieces.radius_px)[:, None]  # at one common width
    half = int(np.ceil((radius_px + reach_px + OUTSIDE_PX) / STEP_PX))
    position = offset_px / STEP_PX + half
    is_used = (position >= 0) & (position < 2 * half)
    is_used &= np.abs(offset_px) > radius_px - reach_px - _INSIDE_PX
    patches = PatchSums.along_bar(pieces, is_used, position, 2 * half + 1, gamma)
    place_mm = _places_by_segment(pieces, segments)
    grid_px = STEP_PX * np.arange(-half, half + 1)
    is_saturated = _is_saturated(pieces, np.abs(offset_px) < radius_px)
    noise_behind = float(np.median(pieces.noise_behind))
    return _average_patches(patches, place_mm, grid_px, radius_px, is_saturated, noise_behind)


def _places_by_segment(pieces: Pieces, segments: int) -> list[np.ndarray]:
    """Return the places of the patches of each segment, mm; fewer segments than asked for where there
    are less than two patches for each.
    """
    number = max(1, min(segments, len(pieces) // 2))
    return np.array_split(np.sort(pieces.place), number)


def _is_saturated(pieces: Pieces, is_inside: np.ndarray) -> bool:
    """Return whether a pixel inside the bar is saturated. is_inside: as the pieces' pixels."""
    is_bright = np.nan_to_num(pieces.grey) >= SATURATED * FULL_SCALE
    return bool(np.any(is_bright & is_inside))


def _average_patches(
    patches: PatchSums,
    place_mm: Sequence[np.ndarray],
    offset_px: np.ndarray,
    radius_px: float,
    is_saturated: bool,
    noise_behind: float,
) -> Profiles:
    """Average patches into the profiles of k segments.

    place_mm: of the patches, by segment, in their order along the bar. offset_px (b,): of the bins.
    radius_px, is_saturated: as of `Profiles`. noise_behind: as of `Pieces`.
    """
    averages = _Averages(_membership([len(some) for some in place_mm]), patches.weight)
    inner = averages.membership[:, 1:-1]  # of patches with two neighbours
    differences = PatchDifferences.of(patches)
    texture, variance_inflation = _estimate_texture(inner, differences)
    background = averages.mean(patches.background)
    return Profiles(
        offset_px=offset_px,
        light=averages.mean(patches.light),
        sigma=averages.sigma(texture),
        background=_about_median(background, averages.is_observed),
        background_slope=averages.mean(patches.background_slope),
        light_per_grey=averages.mean(patches.light_per_grey),
        place_mm=np.array([some.mean() for some in place_mm]),
        radius_px=radius_px,
        variance_inflation=variance_inflation,
        is_saturated=is_saturated,
        pattern=sum_pattern(differences, inner, texture, noise_behind),
    )


def _membership(counts: Sequence[int]) -> np.ndarray:
    """Return a matrix (k, s), 1 for the patches of each of k segments and 0 for all others.

    counts (k,): how many patches each segment has, one segment's behind the other's.
    """
    segment = np.repeat(np.arange(len(counts)), counts)
    return (segment == np.arange(len(counts))[:, None]).astype(float)


@dataclass(frozen=True, eq=False)
class _Averages:
    """The averages of k segments over their patches, bin by bin.

    membership (k, s): 1 for the patches of each segment. weight (s, b): of the patches' bins.
    """

    membership: np.ndarray
    weight: np.ndarray

    @cached_property
    def _total(self) -> np.ndarray:
        """Return the segments' weight (k, b)."""
        return self.membership @ self.weight

    @cached_property
    def is_observed(self) -> np.ndarray:
        """Return which bins (k, b) have a weight."""
        return self._total > 0

    @cached_property
    def _divisor(self) -> np.ndarray:
        """Return the segments' weight (k, b), 1 where they have none."""
        return np.where(self.is_observed, self._total, 1.0)

    @cached_property
    def _number(self) -> np.ndarray:
        """Return the effective number (k, b) of patches that make an average."""
        squares = np.where(self.is_observed, self.membership @ self.weight**2, 1.0)
        return np.where(self.is_observed, self._total**2 / squares, 1.0)

    def mean(self, sums: np.ndarray) -> np.ndarray:
        """Return the segments' means (k, b) of sums (s, b) over patches."""
        return self.membership @ sums / self._divisor

    def sigma(self, texture: np.ndarray) -> np.ndarray:
        """Return the sigma (k, b) of means with the variance (k, b) between patches beyond their
        noise, infinite where nothing is observed.
        """
        variance = 1.0 / self._divisor + texture / self._number
        return np.where(self.is_observed, np.sqrt(variance), np.inf)


def _about_median(background: np.ndarray, is_observed: np.ndarray) -> np.ndarray:
    """Return each row of a background (k, b) minus its median over the bins that are observed."""
    medians = []
    for row, some in zip(background, is_observed):
        medians.append(np.median(row[some]) if np.any(some) else 0.0)
    return background - np.array(medians)[:, None]


def _estimate_texture(membership, differences: PatchDifferences) -> tuple[np.ndarray, float]:
    """Estimate the variance (k, b) between patches beyond their noise, and the inflation by
    correlated bins.

    membership (k, s - 2): 1 for the patches of each segment, the first and last patch of the bar
    left out.

    The variance is the product of one factor for each segment and one function across the bar. The
    spread is at least the noise: where a single patch has pixels, the fitted share of the
    background leaves only rounding, compared with which any other segment would be rough.
    """
    squares = differences.residual**2
    by_median = _weighted_median(squares, differences.weight) / (1.5 * _MEDIAN_SQUARED)
    spread = np.minimum(differences.patch_variance(squares), _LARGEST_OVER_MEDIAN * by_median)
    spread = uniform_filter1d(spread, _TEXTURE_WINDOW)
    noise = uniform_filter1d(differences.patch_variance(differences.noise), _TEXTURE_WINDOW)
    spread = np.maximum(spread, np.maximum(noise, TINY))
    standardised = differences.residual * np.sqrt(differences.relative / (1.5 * spread))
    power = np.sum(membership @ standardised**2, axis=1)
    bins = np.sum(membership @ differences.relative, axis=1)
    roughness = (power + _PRIOR_BINS) / (bins + _PRIOR_BINS)  # (k,) of each segment
    texture = np.maximum(roughness[:, None] * spread - noise, 0.0)
    return texture, _estimate_variance_inflation(standardised)


def _weighted_median(values, weight) -> np.ndarray:
    """Return the weighted median (b,) of each column of values (s, b)."""
    order = np.argsort(values, axis=0)
    cumulative = np.cumsum(np.take_along_axis(weight, order, axis=0), axis=0)
    middle = np.argmax(cumulative >= 0.5 * cumulative[-1], axis=0)
    row = np.take_along_axis(order, middle[None], axis=0)
    return np.take_along_axis(values, row, axis=0)[0]


def _estimate_variance_inflation(residual) -> float:
    """Estimate the variance of a mean over bins, over that of independent bins, by autocorrelation
    of residuals (s, b).

    1 + 2 sum_lag rho(lag), at least 1, over lags up to _CORRELATION_PX.
    """
    power = max(float(np.sum(residual**2)), 1e-300)
    correlated = 0.0
    for lag in range(1, 1 + round(_CORRELATION_PX / STEP_PX)):
        correlated += float(np.sum(residual[:, lag:] * residual[:, :-lag]))
    return max(1.0, 1.0 + 2.0 * correlated / power)


def light_range(light: np.ndarray) -> float:
    """Return the range of light (n,) between its 5th and 95th percentile, a grey level at least."""
    if len(light) == 0:
        return 1.0 / FULL_SCALE
    low, high = np.percentile(light, [5.0, 95.0])
    return max(float(high - low), 1.0 / FULL_SCALE)
