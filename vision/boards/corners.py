"""A board's points in pictures, to a few hundredths of a pixel, each with its sigma.

OpenCV finds the board and names its points; their places come from a fit of our own to the picture
itself (`vision.boards.saddle`: two crossing blurred edges; `vision.boards.discs`: a blurred disc),
because OpenCV's own scatter by 0.12 to 0.28 px where the picture is noisy or soft.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vision.geometry.board import Board
from vision.geometry.refusals import Refused
from vision.geometry.rows import Rows

# [corners] Fewer fix no plane, so that edges at a corner have no direction. Derived.
MIN_CORNERS = 4
# [%] Of the pixels: beyond are glints, not the board's white. 99 to 99.99 move nothing on the
# fixtures. Study: thresholds.py boards.corners _BRIGHTEST_PERCENT ….
_BRIGHTEST_PERCENT = 99.9


@dataclass(frozen=True, eq=False)
class Corners(Rows):
    """Corners of one board in one picture.

    ids (n,). px (n, 2). sigma_px (n,): one standard deviation per axis. Raises Refused where these
    differ in length.
    """

    ids: np.ndarray
    px: np.ndarray
    sigma_px: np.ndarray

    def __post_init__(self):
        object.__setattr__(self, "ids", np.asarray(self.ids, dtype=int).reshape(-1))
        object.__setattr__(self, "px", np.asarray(self.px, dtype=float).reshape(-1, 2))
        object.__setattr__(self, "sigma_px", np.asarray(self.sigma_px, dtype=float).reshape(-1))
        if not len(self.ids) == len(self.px) == len(self.sigma_px):
            raise Refused("corners: ids, px and sigma_px differ in length")

    @staticmethod
    def none() -> "Corners":
        """Return a view in which no board is seen."""
        return Corners(np.empty(0), np.empty((0, 2)), np.empty(0))

    def __len__(self) -> int:
        return len(self.ids)


def by_face(view: Corners, board: Board) -> list[Corners]:
    """Return the corners on each flat face that a view shows; all of them for a board in a plane."""
    face = board.face_of[view.ids]
    return [view.select(face == number) for number in np.unique(face)]


def find_corners(grey: np.ndarray, board: Board) -> Corners:
    """Find the board's points in a grey picture, uint8 or uint16.

    Returns `Corners.none()` where the board is not seen.
    """
    ids, px = detect(grey, board)
    return refine_corners(grey, px, ids, board)


def refine_corners(
    grey: np.ndarray, px_guess: np.ndarray, ids: np.ndarray, board: Board
) -> Corners:
    """Fit the board's points `ids` (n,) near known places px_guess (n, 2), without detection.

    Points that are hidden, out of the picture or disturbed by something near them are left out.
    """
    px_guess = np.asarray(px_guess, dtype=float).reshape(-1, 2)
    return board.refine(grey, px_guess, np.asarray(ids, dtype=int))


def none_detected() -> tuple[np.ndarray, np.ndarray]:
    """Return the ids (0,) and px (0, 2) of no points."""
    return np.empty(0, dtype=int), np.empty((0, 2))


def detect(grey: np.ndarray, board: Board) -> tuple[np.ndarray, np.ndarray]:
    """Return OpenCV's own points: ids (n,) and px (n, 2), good to about 0.2 px."""
    return board.detect(to_8_bit(grey))


def is_found(board: Board, greys: Sequence[np.ndarray]) -> bool:
    """Return whether any of some grey pictures shows the board."""
    return any(len(detect(grey, board)[0]) for grey in greys)


def to_8_bit(grey: np.ndarray) -> np.ndarray:
    """Convert a deeper picture to 8 bit, scaled to its own range.

    A 12-bit camera fills only a sixteenth of 16 bits.
    """
    if grey.dtype == np.uint8:
        return grey
    brightest = np.percentile(grey[::4, ::4], _BRIGHTEST_PERCENT)
    return np.clip(grey * (255.0 / max(brightest, 1.0)), 0, 255).astype(np.uint8)
