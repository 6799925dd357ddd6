"""Fewer numbers for a first pass: pixels of a segment that lie equally far from the axis are
averaged.
"""

from dataclasses import replace

import numpy as np

from vision.wire.bands import Pieces

# [1] In place of a bin's weight where the bin is empty. Derived.
_TINY = 1e-300
# [1] Share of blur² that is left at least where that of the bins is taken off. Derived.
_LEAST_BLUR_SHARE = 0.25


def binned(pieces: Pieces, width_px: float) -> tuple[Pieces, float]:
    """Return the segments with pixels of one offset averaged, and the variance of offsets in a bin,
    px².

    Pixels count by their squared weights. All but the blur is linear in what is averaged; a bin
    blurs by as much as the offsets in it vary (see `without`).
    """
    place, count = _bins(pieces.offset_px, width_px)
    weight = pieces.weight**2
    total = sums(weight, place, count)
    share = weight / np.maximum(total, _TINY).ravel()[place]
    means = {"weight": np.sqrt(total)}
    for name in ("offset_px", "grey", "background", "slope", "curvature"):
        means[name] = sums(share * getattr(pieces, name), place, count)
    fewer = replace(pieces, **means).columns(np.any(total > 0, axis=0))
    deviation = pieces.offset_px - means["offset_px"].ravel()[place]
    variance_px2 = float(np.sum(deviation**2 * weight) / max(np.sum(weight), _TINY))
    return fewer, variance_px2


def _bins(offset_px: np.ndarray, width_px: float) -> tuple[np.ndarray, int]:
    """Return the bin of each pixel (s, p), counted through all segments, and the bins a segment
    has.
    """
    bins = np.floor(offset_px / width_px)
    bins -= np.min(bins, axis=1, keepdims=True)
    count = int(bins.max(initial=0)) + 1
    return bins.astype(int) + count * np.arange(len(bins))[:, None], count


def without(blur_px: float, variance_px2: float) -> float:
    """Return the lens blur where binned segments show this blur, px."""
    return float(np.sqrt(max(blur_px**2 - variance_px2, _LEAST_BLUR_SHARE * blur_px**2)))


def sums(values: np.ndarray, place: np.ndarray, count: int) -> np.ndarray:
    """Return the sums (s, count) of values (s, p) by their places in it."""
    size = len(values)
    return np.bincount(place.ravel(), values.ravel(), size * count).reshape(size, count)
