"""Things drawn over each other in the samples of a window: the nearer over the farther."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.rig.window import Window


@dataclass(frozen=True, eq=False)
class Layer:
    """A thing in samples (n,) of a window: rows and columns, how much of each it covers, how bright it is there, and
    how far it (a tube: its axis) is from the camera, mm."""

    at: tuple[np.ndarray, np.ndarray]
    cover: np.ndarray
    tone: np.ndarray
    depth_mm: np.ndarray


def draw_layers(layers: Sequence[Layer], radiance: np.ndarray) -> None:
    """Over what is drawn: in each sample the nearer over the farther."""
    if not layers:
        return
    rows, columns = (np.concatenate([layer.at[axis] for layer in layers]) for axis in (0, 1))
    values = ([one.cover, one.tone, one.depth_mm] for one in layers)
    cover, tone, depth = (np.concatenate(column) for column in zip(*values))
    order = np.lexsort((-depth, columns, rows))
    rows, columns, cover, tone = rows[order], columns[order], cover[order], tone[order]
    first = np.append(True, (np.diff(rows) != 0) | (np.diff(columns) != 0))
    number = np.arange(len(rows))
    rank = number - np.maximum.accumulate(
        np.where(first, number, 0)
    )  # of each sample's layers from afar
    for nearer in range(int(rank.max()) + 1):
        now = rank == nearer
        at = rows[now], columns[now]
        radiance[at] += (cover[now] * (tone[now] - radiance[at])).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Front:
    """A still object that may hide what moves: how much of each sample of a window it covers, and how far it is, mm."""

    window: Window
    cover: np.ndarray
    depth_mm: np.ndarray

    @classmethod
    def of(cls, layer: Layer, window: Window) -> "Front":
        """A layer as it stands in its window."""
        cover, depth = np.zeros(window.shape, np.float32), np.full(window.shape, np.inf, np.float32)
        cover[layer.at], depth[layer.at] = layer.cover, layer.depth_mm
        return cls(window, cover, depth)

    def left_of(self, layer: Layer, window: Window) -> Layer:
        """What it leaves to see of a layer of a part of its window: nothing where it is nearer."""
        rows, columns = window.within(self.window)
        at = layer.at[0] + rows.start, layer.at[1] + columns.start
        hidden = self.cover[at] * (self.depth_mm[at] < layer.depth_mm)
        return Layer(layer.at, layer.cover * (1 - hidden), layer.tone, layer.depth_mm)
