"""Fewer numbers for a first look: pixels of a piece that lie equally far from the rod's axis are averaged."""

import numpy as np

from vision.wire.bands import Pieces


def binned(pieces: Pieces, width_px: float) -> tuple[Pieces, float]:
    """The pieces with pixels of like offset averaged by their weights, and the variance of offsets in a bin, px².

    All but the blur is linear in what is averaged; a bin blurs by as much as the offsets in it vary (see `without`).
    """
    first = np.floor(np.min(pieces.offset_px, axis=1) / width_px)
    bins = (np.floor(pieces.offset_px / width_px) - first[:, None]).astype(int)
    count = int(bins.max(initial=0)) + 1
    place = bins + count * np.arange(len(pieces))[:, None]
    weight = pieces.weight**2
    total = sums(weight, place, count)
    share = weight / np.maximum(total, 1e-300).ravel()[place]
    mean = {
        name: sums(share * getattr(pieces, name), place, count)
        for name in ("offset_px", "grey", "background", "slope", "curvature")
    }
    spread = (pieces.offset_px - mean["offset_px"].ravel()[place]) ** 2
    values = {name: getattr(pieces, name) for name in pieces.__dataclass_fields__} | mean
    fewer = Pieces(**values | {"weight": np.sqrt(total)})
    return fewer.columns(np.any(total > 0, axis=0)), float(
        np.sum(spread * weight) / max(np.sum(weight), 1e-300)
    )


def without(blur_px: float, variance_px2: float) -> float:
    """The lens blur where binned pieces show this one."""
    return float(np.sqrt(max(blur_px**2 - variance_px2, 0.25 * blur_px**2)))


def sums(values: np.ndarray, place: np.ndarray, count: int) -> np.ndarray:
    """Sums (s, count) of values (s, p) by their places in it."""
    size = len(values)
    return np.bincount(place.ravel(), values.ravel(), size * count).reshape(size, count)
