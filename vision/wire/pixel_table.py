"""Pixels that belong to segments, as a table with a row for each segment."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class PixelTable:
    """Where pixels (n,) stand in a table of this shape, a row for each segment.

    order (n,): the pixels by segment and then by offset. row, column (n,): of each in that order; a
    short row's pixels stand in the middle.
    """

    order: np.ndarray
    row: np.ndarray
    column: np.ndarray
    shape: tuple[int, int]

    @staticmethod
    def by_segment(segment: np.ndarray, offset_px: np.ndarray, count: int) -> "PixelTable":
        """Return the table of pixels (n,) in `count` segments, by the segment and offset of each."""
        order = np.lexsort((offset_px, segment))
        own = np.bincount(segment, minlength=count)  # pixels of each segment
        most = int(own.max())
        first = np.cumsum(own) - own  # in that order, of each segment
        indent = (most - own) // 2  # of a short row
        column = np.arange(len(order)) + np.repeat(indent - first, own)
        return PixelTable(order, segment[order], column, (count, max(most, 1)))

    def filled(self, values: np.ndarray) -> np.ndarray:
        """Return the table of values (n,), 0 where no pixel stands."""
        table = np.zeros(self.shape)
        table[self.row, self.column] = values[self.order]
        return table
