"""Where the two edges of a thin object are steepest across it, in many segments together.

An edge of the object is as sharp as the lens, a shadow next to it or the turn of light on it is
softer: the steepest place on each side says how wide the object is.
"""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from vision.geometry.grouped import group_means
from vision.wire.bands import Pieces

# [px] Bins of the profile across. Derived.
_BIN_PX = 0.5
# [bins] Blur of the profile before its slope is taken. Derived.
_SMOOTH_BINS = 1.2
# [1] Edges lie between so many half-widths from the curve. From 0.4 on points of path-traced wires
# scatter by 1.44 sigma in place of 1.32; up to 2.2 they are the same. Study: thresholds.py
# wire.steepest_edges _WINDOW ….
_WINDOW = (0.55, 1.7)
# [px] And within so much of the half-width at least. Stated.
_LEAST_WINDOW_PX = 1.0
# [px] Half-width of anything, at least. Derived.
_LEAST_RADIUS_PX = 0.5
# [steps] Of the equation for the half-width: its error falls by a third each. Derived.
_STEPS = 20


def steepest_edges(pieces: Pieces) -> tuple[float, float]:
    """Return the offsets of the two edges of segments (see `cut_strip`), px at their mean half-width.

    The squared slope is the median of all segments': what crosses a few does not count, nor does it
    matter which of them are darker than what is behind and which brighter.
    """
    offset_px, steepness = _steepness(pieces)
    low, high = (
        _peak(offset_px, steepness, best) for best in _steepest(pieces, offset_px, steepness)
    )
    return low, high


def _steepest(pieces: Pieces, offset_px: np.ndarray, steepness: np.ndarray) -> list[int]:
    """Return where of the offsets (m,) the squared slope (m,) is largest, on either side."""
    radius_px = float(np.mean(pieces.radius_px))
    nearest = min(_WINDOW[0] * radius_px, max(radius_px - _LEAST_WINDOW_PX, 0.0))
    farthest = max(_WINDOW[1] * radius_px, radius_px + _LEAST_WINDOW_PX)
    found = []
    for side in (-1.0, 1.0):
        beside = side * offset_px
        allowed = (beside >= nearest) & (beside <= farthest)
        found.append(int(np.argmax(np.where(allowed, steepness, -1.0))))
    return found


def half_width_of(edges_px: np.ndarray, blur_px: float) -> np.ndarray:
    """Return the half-widths (n,) of even objects whose steepest edges lie at edges_px (n, 2).

    Under a lens blur of the object's own size its edges move apart: of a box of half-width r under a
    blur s they are at x, where r = x tanh(x r / s²).
    """
    half_px = np.maximum(0.5 * (edges_px[:, 1] - edges_px[:, 0]), _LEAST_RADIUS_PX)
    variance_px2 = blur_px**2 + (_SMOOTH_BINS * _BIN_PX) ** 2
    radius_px = half_px
    for _ in range(_STEPS):
        radius_px = half_px * np.tanh(half_px * radius_px / variance_px2)
    return np.maximum(radius_px, _LEAST_RADIUS_PX)


def _steepness(pieces: Pieces) -> tuple[np.ndarray, np.ndarray]:
    """Return offsets (m,) px across, at the mean half-width, and the median squared slope there."""
    relative = float(np.mean(pieces.radius_px)) / pieces.radius_px
    place = pieces.offset_px * relative[:, None] / _BIN_PX  # (s, p) bins
    is_known = pieces.weight > 0
    known_place = np.where(is_known, place, 0.0)
    shortest_right = np.min(np.max(known_place, axis=1))
    shortest_left = np.min(-np.min(known_place, axis=1))
    half = int(min(shortest_right, shortest_left))
    bins = np.arange(-half, half + 1)
    slopes = []
    for one, grey, known in zip(place, pieces.grey, is_known):
        slopes.append(_slope_of_profile(bins, one[known], grey[known]))
    return bins * _BIN_PX, np.median(np.square(slopes), axis=0)


def _slope_of_profile(bins: np.ndarray, place: np.ndarray, grey: np.ndarray) -> np.ndarray:
    """Return the slope at bins (m,) of grey levels (n,) at places (n,), in bins, smoothed."""
    order = np.argsort(place)
    profile = np.interp(bins, place[order], _mean_of_bins(place, grey)[order])
    return np.gradient(gaussian_filter1d(profile, _SMOOTH_BINS, mode="nearest"))


def _mean_of_bins(place: np.ndarray, grey: np.ndarray) -> np.ndarray:
    """Return for each pixel (n,) the mean grey level of those in its bin."""
    _, bins = np.unique(np.rint(place), return_inverse=True)
    return group_means(bins, grey)[bins]


def _peak(offset_px: np.ndarray, values: np.ndarray, best: int) -> float:
    """Return the offset of the parabola's top through the largest value and its neighbours."""
    if best in (0, len(values) - 1):
        return float(offset_px[best])
    before, here, after = values[best - 1 : best + 2]
    bend = before - 2.0 * here + after
    if bend >= 0.0:
        return float(offset_px[best])
    bins_to_top = 0.5 * (before - after) / bend
    return float(offset_px[best] + np.clip(bins_to_top, -1.0, 1.0) * _BIN_PX)
