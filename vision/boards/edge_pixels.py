"""The pixels that show the two edges through a corner of a board, for all corners of a picture."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vision.geometry.rows import Rows

# [px] Reach along the edges. A lens bends an edge by k1 x t²/f over the distance t, which moves
# the corner by a third of that at the arm's end: at 24 px 0.003 px for k1 = −0.1, f = 2000 px, x
# = 0.3, and 0.03 px in the corners of a webcam with k1 = −0.33. Shorter is noisier: drawn corners
# err by 0.024, 0.019 and 0.016 px at 16, 24 and 32. Study: thresholds.py boards.edge_pixels
# REACH_PX ….
REACH_PX = 24
# [squares] Half a square, so that no two corners share a pixel's noise. Derived.
_ARM_SQUARES = 0.5
# [px] Pixels nearer to a marker hold its blur. Rig corners err by 0.035 px at 0.75, by 0.034 from
# 1.0 to 3.0. Study: thresholds.py boards.edge_pixels _CLEAR_OF_MARKER_PX ….
_CLEAR_OF_MARKER_PX = 1.5
# [px] Pixels farther from an edge say nothing of it: drawn corners err by 0.026 px at 3, 0.019 at
# 6, 0.017 at 8 and 12. Study: thresholds.py boards.edge_pixels _BAND_PX ….
_BAND_PX = 6.0


@dataclass(frozen=True, eq=False)
class Windows(Rows):
    """The pixels along each corner's edges, padded to k of them with weight 0.

    anchor (n, 2): whole px. offset (n, 2, k): whole px from the anchor, x and y. grey (n, k).
    weight (n, k): 0 or 1.
    """

    anchor: np.ndarray
    offset: np.ndarray
    grey: np.ndarray
    weight: np.ndarray

    def in_single_precision(self) -> "Windows":
        """Return the windows with offsets, grey and weights in single precision."""
        return Windows(
            self.anchor,
            self.offset.astype(np.float32),
            self.grey.astype(np.float32),
            self.weight.astype(np.float32),
        )

    def on_grid(self, values: np.ndarray) -> np.ndarray:
        """Return values (n, m, k) of the pixels on square grids (n, m, side, side).

        Cells whose pixel is not used are 0, as the values of padding must be.
        """
        reach = int(np.abs(self.offset).max())
        side = 2 * reach + 1
        cell = (self.offset[:, 1] + reach) * side + self.offset[:, 0] + reach  # (n, k)
        grid = np.zeros((*values.shape[:2], side * side))
        np.put_along_axis(grid, np.broadcast_to(cell[:, None], values.shape), values, axis=2)
        return grid.reshape(*values.shape[:2], side, side)


def cut_windows(grey: np.ndarray, px_guess: np.ndarray, axes: np.ndarray, border: float) -> Windows:
    """Return the pixels that show the two edges of each corner.

    grey (height, width). px_guess (n, 2). axes (n, 2, 2): px, in its columns one square along
    board x and y in the picture at the corner. border: clear rim between a square's edge and its
    marker, in squares.
    """
    return cut_where(
        grey, px_guess, _reach_px(axes), lambda offset: _shows_edges(offset, axes, border)
    )


def cut_where(
    grey: np.ndarray,
    px_guess: np.ndarray,
    reach_px: int,
    is_wanted: Callable[[np.ndarray], np.ndarray],
) -> Windows:
    """Return the pixels within reach of guesses (n, 2) px that are wanted.

    is_wanted: of offsets (n, 2, k) px from the guesses, (n, k) bool.
    """
    grid = _disc(reach_px)
    anchor = np.round(px_guess).astype(int)
    place = anchor[:, :, None] + grid  # (n, 2, cells) px
    is_used = _is_inside(place, grey) & is_wanted(place - px_guess[:, :, None])
    order = _used_first(is_used)
    weight = np.take_along_axis(is_used, order, axis=1).astype(float)
    # x and y a row each in memory: interleaved, a picture takes a sixth longer
    offset = np.ascontiguousarray(np.swapaxes(grid[:, order], 0, 1))
    return Windows(anchor, offset, _grey_at(grey, anchor[:, :, None] + offset), weight)


def _reach_px(axes: np.ndarray) -> int:
    """Return how far from their corners edges are used, whole px, for axes (n, 2, 2)."""
    longest_px = np.linalg.norm(axes, axis=1).max()
    return int(np.ceil(min(REACH_PX, _ARM_SQUARES * longest_px)))


def _last_px(picture: np.ndarray) -> np.ndarray:
    """Return the last column and row (2, 1) of a picture."""
    return np.array(picture.shape[::-1])[:, None] - 1


def _is_inside(place: np.ndarray, picture: np.ndarray) -> np.ndarray:
    """Return which places (n, 2, cells), x and y in px, lie in a picture, (n, cells) bool."""
    return np.all((place >= 0) & (place <= _last_px(picture)), axis=1)


def _grey_at(grey: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return the grey levels (n, k) at places (n, 2, k), x and y in px; outside, those of the rim."""
    column, row = np.clip(place, 0, _last_px(grey)).swapaxes(0, 1)
    return grey[row, column].astype(float)


def _disc(reach: int) -> np.ndarray:
    """Return the whole pixels (2, cells), x and y, within reach of 0."""
    span = np.arange(-reach, reach + 1)
    grid = np.stack(np.meshgrid(span, span)).reshape(2, -1)
    return np.ascontiguousarray(grid[:, np.sum(grid**2, axis=0) <= reach**2])


def _used_first(is_used: np.ndarray) -> np.ndarray:
    """Return the indices (n, k) of each corner's used cells, from masks (n, cells), then of others.

    k is the largest number of used cells.
    """
    count = max(int(is_used.sum(axis=1).max()), 1)
    return np.argsort(~is_used, axis=1, kind="stable")[:, :count]


def _shows_edges(offset: np.ndarray, axes: np.ndarray, border: float) -> np.ndarray:
    """Return which pixels show the two edges and no marker, (n, k) bool.

    offset (n, 2, k): px from the guess.
    """
    in_squares = np.abs(np.linalg.inv(axes) @ offset)
    across_px = np.linalg.norm(axes[:, :, ::-1], axis=1)
    px_per_square = np.abs(np.linalg.det(axes))[:, None] / across_px
    clear_px = border * px_per_square - _CLEAR_OF_MARKER_PX
    band_px = np.clip(clear_px, _CLEAR_OF_MARKER_PX, _BAND_PX)
    is_near_edge = in_squares * px_per_square[:, :, None] < band_px[:, :, None]
    return is_near_edge.any(axis=1) & np.all(in_squares < _ARM_SQUARES, axis=1)
