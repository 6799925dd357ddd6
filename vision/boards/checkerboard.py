"""The plain checkerboard, found whole or not at all.

Its upper left square is dark. After half a turn it looks different if it has an odd number of squares
one way and an even number the other. The points of any other one are named from the upper left of
the picture, and `vision.calibration.turned` makes the cameras agree.
"""

from dataclasses import dataclass, field

import cv2
import numpy as np

from vision.boards.corners import MIN_CORNERS, Corners, is_found, none_detected, to_8_bit
from vision.boards.saddle_board import CheckeredBoard
from vision.boards.symmetry import possible_labels, turns_onto_itself, upper_left_first
from vision.geometry.checks import require

# [squares] OpenCV's detector needs three corners either way. Stated.
_FEWEST_SQUARES = 4
_FLAGS = cv2.CALIB_CB_NORMALIZE_IMAGE
# [corners] The grid from which OpenCV goes on to all that is there, where it looks for no size. Stated.
_SMALLEST_GRID = (3, 3)


@dataclass(frozen=True)
class Checkerboard(CheckeredBoard):
    """A plain checkerboard: origin at the outer corner of a dark square, z into the board."""

    kind: str = field(default="checkerboard", init=False)

    def __post_init__(self):
        """Raise Refused for counts or lengths that cannot be."""
        super().__post_init__()
        require(
            min(self.squares) >= _FEWEST_SQUARES,
            f"board squares = {list(self.squares)}: a checkerboard needs {_FEWEST_SQUARES} or more each way",
        )

    @property
    def hidden_turns(self) -> tuple[np.ndarray, ...]:
        """Return the turns that put dark squares onto dark squares."""
        return tuple(ids for ids in turns_onto_itself(self)[1:] if self._is_dark_after(ids))

    def _is_dark_after(self, ids: np.ndarray) -> bool:
        """Return whether the first square between inner corners is dark as the corners (m,) turn it."""
        columns = self.grid[0]
        rows_of, columns_of = np.divmod(ids[[0, 1, columns, columns + 1]], columns)
        return bool((rows_of.min() + columns_of.min()) % 2 == 0)

    @property
    def clear_mm(self) -> float:
        """Return half a square: nothing is printed in it."""
        return 0.5 * self.square_mm

    def detect(self, picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return all corners; none where a part of the board is hidden or out of the picture."""
        is_found, px = cv2.findChessboardCornersSB(picture, self.grid, flags=_FLAGS)
        if not is_found:
            return none_detected()
        candidates = possible_labels(px.reshape(-1, 2).astype(float), self)
        dark_first = [px for px in candidates if self._darkness(px, picture) > 0]
        return np.arange(len(px)), upper_left_first(dark_first or candidates)

    def refine(self, grey: np.ndarray, px_guess: np.ndarray, ids: np.ndarray) -> Corners:
        """Fit saddles; return none where a whole outer row or column shows none.

        Of a board that is partly out of the picture OpenCV takes the edge for such a row, and then
        names all corners falsely.
        """
        corners = super().refine(grey, px_guess, ids)
        row, column = np.divmod(corners.ids, self.grid[0])
        sides = ((column, self.grid[0]), (row, self.grid[1]))
        for found, count in sides:
            if not np.isin([0, count - 1], found).all():
                return Corners.none()
        return corners

    def _darkness(self, px: np.ndarray, picture: np.ndarray) -> float:
        """Return by how many grey levels the squares that should be dark are darker than the others,
        summed over the squares between corners (m, 2) px.
        """
        columns, rows = self.grid
        corners = px.reshape(rows, columns, 2)
        upper = corners[:-1, :-1] + corners[:-1, 1:]
        lower = corners[1:, :-1] + corners[1:, 1:]
        middles = np.rint(0.25 * (upper + lower)).astype(int)  # (rows − 1, columns − 1, 2)
        grey = picture[middles[..., 1], middles[..., 0]].astype(float)
        square_row, square_column = np.indices(grey.shape)
        should_be_dark = (square_row + square_column) % 2 == 0
        return float(grey[~should_be_dark].sum() - grey[should_be_dark].sum())

    def why_not_found(self, greys: list[np.ndarray], *, mirrored: bool = False) -> str | None:
        """Return a sentence on what grid is seen in place of the board's; None if it is found."""
        if is_found(self, greys):
            return None
        entered = f"a checkerboard of {self.squares[0]} x {self.squares[1]} squares is not found"
        sizes = [size for grey in greys if (size := _largest_grid(to_8_bit(grey)))]
        if not sizes:
            return f"{entered}, nor one of another size: is it in view whole, flat, lit and sharp?"
        columns, rows = sorted(max(sizes, key=lambda size: size[0] * size[1]))
        if self.squares[0] > self.squares[1]:  # which way round it lies is not known
            columns, rows = rows, columns
        return (
            f"{entered}, but one of {columns + 1} x {rows + 1} is: enter that as squares if it is the board, "
            "else record views in which no part of the board is hidden or beyond the picture's edge"
        )


def _largest_grid(picture: np.ndarray) -> tuple[int, int] | None:
    """Return the number of inner corners (columns, rows) of whatever checkerboard is in a picture."""
    flags = _FLAGS | cv2.CALIB_CB_LARGER
    is_found, px, meta = cv2.findChessboardCornersSBWithMeta(picture, _SMALLEST_GRID, flags)
    if not is_found or meta is None or len(px) < MIN_CORNERS:
        return None
    return meta.shape[1], meta.shape[0]
