"""Things drawn over each other in the samples of a window: the nearer over the farther."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.rig.window import Window


@dataclass(frozen=True, eq=False)
class Layer:
    """One thing in n samples of a window.

    index: rows (n,) and columns (n,) of the samples. cover (n,): share of each that it covers. tone
    (n,): its brightness there. depth_mm (n,): its distance (a tube: its axis') from the camera.
    """

    index: tuple[np.ndarray, np.ndarray]
    cover: np.ndarray
    tone: np.ndarray
    depth_mm: np.ndarray


def draw_layers(layers: Sequence[Layer], radiance: np.ndarray) -> None:
    """Draw layers over a window's samples (rows, columns), in each the nearer over the farther."""
    if not layers:
        return
    if len(layers) == 1:
        _blend(radiance, layers[0].index, layers[0].cover, layers[0].tone)
        return
    index = np.concatenate([layer.index for layer in layers], axis=1)  # (2, n)
    cover = np.concatenate([layer.cover for layer in layers])
    tone = np.concatenate([layer.tone for layer in layers])
    depth = np.concatenate([layer.depth_mm for layer in layers])
    sample = np.ravel_multi_index(tuple(index), radiance.shape)
    order, rank = _rank_by_depth(sample, depth)
    for nearer in range(int(rank.max()) + 1):
        chosen = order[rank == nearer]
        _blend(radiance, tuple(index[:, chosen]), cover[chosen], tone[chosen])


def _rank_by_depth(sample, depth):
    """Return the order (n,) of samples, farthest first, and the rank (n,) of each of that order
    within its own sample."""
    order = np.lexsort((-depth, sample))
    number = np.arange(len(order))
    is_farthest = np.diff(sample[order], prepend=-1) != 0
    return order, number - np.maximum.accumulate(np.where(is_farthest, number, 0))


def _blend(radiance, index, cover, tone):
    """Draw one tone (n,) a sample over what is there, as far as it covers the sample."""
    radiance[index] += (cover * (tone - radiance[index])).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Occluder:
    """A still object that may hide what moves.

    cover, depth_mm (rows, columns): share of each sample of the window that it covers, and how far
    it is from the camera there; infinitely far where it is not.
    """

    window: Window
    cover: np.ndarray
    depth_mm: np.ndarray

    @classmethod
    def from_layer(cls, layer: Layer, window: Window) -> "Occluder":
        """Make an occluder of a layer in its window."""
        cover = np.zeros(window.shape, np.float32)
        cover[layer.index] = layer.cover
        depth = np.full(window.shape, np.inf, np.float32)
        depth[layer.index] = layer.depth_mm
        return cls(window, cover, depth)

    def hide(self, layer: Layer, window: Window) -> Layer:
        """Return a layer of a part of this window, uncovered where the occluder is nearer."""
        index = window.index_in(self.window, layer.index)
        hidden = self.cover[index] * (self.depth_mm[index] < layer.depth_mm)
        return replace(layer, cover=layer.cover * (1 - hidden))
