"""Pixels of the bar as profiles across it: light, what is behind it, and how sure each is, stretch by stretch.

Each pixel is shared between the two nearest places of a regular grid across the bar, so that nothing jumps as the bar
is looked for a little beside; on that grid the normal equations of all positions are one product of matrices
(`evidence.py`). What pieces of a stretch differ by beyond noise, texture of the bench or compression, counts as noise.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import uniform_filter1d

from vision.wire.bands import Pieces

# [grey] Of a picture of 8 bit. Stated.
FULL_SCALE = 255.0
# [px] Of the grid across, between whose places pixels are shared: a third of a lens blur. Study:
# thresholds.py bar.profiles STEP_PX ….
STEP_PX = 0.25
# [px] Beyond either edge, wherever it is looked for: wide beside the blur, and a shadow's border
# is seldom as near. Study: bar_scenes.py.
# beyond either edge, wherever it is looked for: a shadow's border is seldom as near
OUTSIDE_PX = 6.0
# [px] Of a thick bar so much inside either edge is looked at: farther in nothing tells of the
# edge, and it costs time. Set by eye. Study: bar_scenes.py.
_RIM_PX = 8.0
# [1] Of the contrast: least sigma of what no such model explains; what there is beyond shows in
# the misfit. Study: bar_starts.py.
_MODEL_SHARE = 0.001
# [px] A lens blur: how far across the errors of neighbours are taken to go together. Study:
# bar_starts.py.
_ALIKE_PX = 1.0
# [steps] Of the grid over which texture is averaged: as far as neighbours go together. Derived.
_SMOOTHED = 5
# [1] Median of a squared Gaussian; and how many times the variance by the median is texture yet:
# the edge of a bar that is looked for tilted passes a few pieces. Study: bar_scenes.py.
_MEDIAN_SQUARED, _FEW_DIFFER = 0.455, 3.0
# [1] In place of none, where it is divided by. Derived.
_NOTHING = 1e-100
# [steps] For which a stretch counts as rough as the others: half of what one has. Set by eye.
# Study: bar_starts.py.
_AS_ROUGH = 50


@dataclass(frozen=True)
class Profiles:
    """Stretches of the bar, seen across. offset_px (b,): the grid, from where the middle is expected; in each stretch
    light, sigma, behind, steep, by_grey (k, b): light in parts of full scale, its sigma (infinite where nothing is
    seen), the light of the picture without rods, about its median, and its slope per px, and the light's derivative by
    grey; place_mm (k,): along the bar; radius_px: half its width; alike: by how much errors that neighbours share make
    a mean's variance larger.
    """

    offset_px: np.ndarray
    light: np.ndarray
    sigma: np.ndarray
    behind: np.ndarray
    steep: np.ndarray
    by_grey: np.ndarray
    place_mm: np.ndarray
    radius_px: float
    alike: float

    def __len__(self) -> int:
        return len(self.place_mm)

    @cached_property
    def seen(self) -> np.ndarray:
        """Where (k, b) anything is seen."""
        return np.isfinite(self.sigma)

    @cached_property
    def contrast(self) -> float:
        """What the light varies by, of the median stretch."""
        return float(
            np.median([light_range(light[seen]) for light, seen in zip(self.light, self.seen)])
        )

    @cached_property
    def weight(self) -> np.ndarray:
        """One over the variance (k, b) of what a model leaves."""
        return 1.0 / (self.sigma**2 + (_MODEL_SHARE * self.contrast) ** 2)

    @cached_property
    def moments(self) -> np.ndarray:
        """Weighted products (9, k, b) of what light is made of, in the order of `evidence._normal`."""
        behind, steep = self.weight * self.behind, self.weight * self.steep
        return np.stack(
            [
                self.weight,
                behind,
                steep,
                behind * self.behind,
                behind * self.steep,
                steep * self.steep,
                self.weight * self.light,
                behind * self.light,
                steep * self.light,
            ]
        )

    @cached_property
    def in_grey(self) -> np.ndarray:
        """What makes minus twice the log evidence (k,) that of grey levels."""
        root = np.where(self.seen, np.sqrt(self.weight) * self.by_grey, 1.0)
        return -2.0 * np.sum(np.log(root), axis=1)


def profiles(pieces: Pieces, count: int, reach_px: float, gamma: float) -> Profiles:
    """So many stretches of the bar, or fewer where there are few pieces, for middles up to reach_px off."""
    radius = float(np.median(pieces.radius_px))
    stretched = pieces.offset_px * (radius / pieces.radius_px)[:, None]
    half = int(np.ceil((radius + reach_px + OUTSIDE_PX) / STEP_PX))
    place = stretched / STEP_PX + half
    seen = (place >= 0) & (place < 2 * half)
    seen &= np.abs(stretched) > radius - reach_px - _RIM_PX
    light, slope = _light(pieces.grey, gamma)
    weight = np.where(seen, (pieces.weight / slope) ** 2, 0.0)
    behind, by_background = _light(pieces.background, gamma)
    order = np.argsort(pieces.place)
    values = [np.ones_like(light), light, behind, by_background * pieces.slope, slope]
    added = _shared(weight, values, place, 2 * half + 1)[:, order]
    stretches = np.array_split(np.arange(len(pieces)), max(1, min(count, len(pieces) // 2)))
    offset, place_mm = STEP_PX * np.arange(-half, half + 1), pieces.place[order]
    return _profiles(
        added, stretches, offset, np.array([place_mm[some].mean() for some in stretches]), radius
    )


def _shared(weight, values, place, size: int) -> np.ndarray:
    """Weighted sums (v + 1, s, size) of values (s, p), each pixel between the two nearest whole places; and of the
    shares themselves, which make variances of weighted means."""
    before = np.clip(np.floor(place), 0, size - 2)
    part = np.clip(place - before, 0.0, 1.0)
    rows = size * np.arange(len(place))[:, None] + before.astype(int)
    both = np.concatenate([rows.ravel(), rows.ravel() + 1])
    share = np.concatenate([(1.0 - part).ravel(), part.ravel()])
    weighted = share * np.tile(weight.ravel(), 2)
    return np.stack(
        [
            np.bincount(both, weighted * one, len(place) * size).reshape(-1, size)
            for one in (*(np.tile(one.ravel(), 2) for one in values), share)
        ]
    )


def _light(grey, gamma: float):
    """Light in parts of full scale, and its derivative by grey."""
    share = np.maximum(grey, 1.0) / FULL_SCALE
    return share**gamma, gamma / FULL_SCALE * share ** (gamma - 1.0)


def _profiles(added, stretches, offset_px, place_mm, radius_px: float) -> Profiles:
    """Of sums (6, s, b) over the pieces, in their order along the bar: weights, and weighted light, light behind, its
    slope across, the light's derivative by grey, and shares of pixels."""
    own = added[0]
    of_stretch = np.zeros((len(stretches), len(own)))
    for row, some in zip(of_stretch, stretches):
        row[some] = 1.0
    total = of_stretch @ own
    seen = total > 0
    light, behind, steep, by_grey = (
        (of_stretch @ part) / np.where(seen, total, 1.0) for part in added[1:5]
    )
    there = np.where(own > 0, own, 1.0)
    texture, alike = _texture(
        of_stretch[:, 1:-1], own, added[1] / there, added[2] / there, added[5] / there**2
    )
    number = np.where(seen, total**2 / np.where(seen, of_stretch @ own**2, 1.0), 1.0)
    sigma = np.where(seen, np.sqrt(1.0 / np.where(seen, total, 1.0) + texture / number), np.inf)
    middle = [np.median(row[some]) if np.any(some) else 0.0 for row, some in zip(behind, seen)]
    behind = behind - np.array(middle)[:, None]
    return Profiles(offset_px, light, sigma, behind, steep, by_grey, place_mm, radius_px, alike)


def _texture(of_stretch, weight, light, behind, noise) -> tuple[np.ndarray, float]:
    """Variance (k, b) of what pieces of each stretch differ by beyond noise: texture of the bench, compression; and how
    alike neighbours across are, see `Profiles`. of_stretch (k, s - 2): 1 for its pieces, the first and last left out;
    weight, light, behind, noise (s, b): of each piece, the last one's a variance.

    By a piece and the mean of the two beside it, so that what changes steadily along the bar does not count, nor what
    follows the picture without rods, by the share that is seen. A product of one figure a stretch and one across. A
    piece of which a place has hardly a part of a pixel counts as little: whether it has any, rounding may say. Pieces
    differ by their noise at least: the only one that tells leaves nothing but rounding, beside which any is rough.
    """
    light, behind = (one[1:-1] - 0.5 * (one[:-2] + one[2:]) for one in (light, behind))
    doubt, noise = (
        one[1:-1] + 0.25 * (one[:-2] + one[2:])
        for one in (1.0 / np.maximum(weight, _NOTHING), noise)
    )
    told = np.where(doubt < 0.1 / _NOTHING, 1.0 / doubt, 0.0)
    share = np.sum(told * light * behind, axis=0) / np.maximum(
        np.sum(told * behind**2, axis=0), _NOTHING
    )
    left = light - np.clip(share, 0.0, 1.0) * behind
    counts = (
        told * np.sum(told, axis=0) / np.maximum(np.sum(told**2, axis=0), _NOTHING)
    )  # 1 where all tell as much
    number = np.maximum(np.sum(counts, axis=0), _NOTHING)
    spread, noise = (np.sum(counts * one, axis=0) / (1.5 * number) for one in (left**2, noise))
    # where a tilted bar's edge passes a few pieces differ
    usual = _weighted_median(left**2, told) / (1.5 * _MEDIAN_SQUARED)
    spread, noise = (
        uniform_filter1d(one, _SMOOTHED) for one in (np.minimum(spread, _FEW_DIFFER * usual), noise)
    )
    spread = np.maximum(spread, np.maximum(noise, _NOTHING))
    left = left * np.sqrt(counts / (1.5 * spread))
    rougher = (np.sum(of_stretch @ left**2, axis=1) + _AS_ROUGH) / (
        np.sum(of_stretch @ counts, axis=1) + _AS_ROUGH
    )
    return np.maximum(rougher[:, None] * spread - noise, 0.0), _alike(left)


def _weighted_median(values, weight) -> np.ndarray:
    """Of each column (b,) of values (s, b)."""
    order = np.argsort(values, axis=0)
    summed = np.cumsum(np.take_along_axis(weight, order, axis=0), axis=0)
    middle = np.argmax(summed >= 0.5 * summed[-1], axis=0)
    return np.take_along_axis(values, np.take_along_axis(order, middle[None], axis=0), axis=0)[0]


def _alike(left) -> float:
    """By how much the variance of a mean is larger than were neighbours across, of these (s, b), independent."""
    lags = range(1, 1 + round(_ALIKE_PX / STEP_PX))
    power = max(float(np.sum(left**2)), 1e-300)
    return max(
        1.0, 1.0 + 2.0 * sum(float(np.sum(left[:, lag:] * left[:, :-lag])) for lag in lags) / power
    )


def light_range(light: np.ndarray) -> float:
    """From dark to bright of light (n,), but for the outermost twentieths; a grey level at least."""
    if len(light) == 0:
        return 1.0 / FULL_SCALE
    low, high = np.interp(
        [0.05 * (len(light) - 1), 0.95 * (len(light) - 1)], np.arange(len(light)), np.sort(light)
    )
    return max(float(high - low), 1.0 / FULL_SCALE)
