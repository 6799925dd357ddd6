"""ChArUco corners to a few hundredths of a pixel, each with its sigma.

OpenCV finds the board and names its corners; their places come from a fit of two crossing blurred
edges to the picture itself (`vision.boards.saddle`), because OpenCV's own scatter by 0.12 to
0.28 px where the picture is noisy or soft.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from vision.boards.edge_pixels import Windows, cut_windows
from vision.boards.saddle import Saddles, fit_saddles
from vision.geometry.board import Board
from vision.geometry.refusals import Refused
from vision.geometry.rows import Rows

# [corners] Fewer fix no plane, so that edges at a corner have no direction. Derived.
MIN_CORNERS = 4
# [1] A wire, bar or glare near a corner: the picture misses the model by this many times the
# board's usual miss; over 500 pixels the ratio of two clean corners stays within 1.2. Moves
# nothing on the fixtures between 1.4 and 4. Study: thresholds.py boards.corners _DISTURBED_RATIO
# ….
_DISTURBED_RATIO = 1.8
# [1] Blur or contrast this far from the board's median is no printed corner. Set by eye; moves
# nothing on the fixtures between 1.5 and 3. Study: thresholds.py boards.corners _ODD_FACTOR ….
_ODD_FACTOR = 2.0
# [%] Of the pixels: beyond are glints, not the board's white. Set by eye.
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


def find_corners(grey: np.ndarray, board: Board) -> Corners:
    """Find the board's inner corners in a grey picture, uint8 or uint16.

    Returns `Corners.none()` where the board is not seen. Markers of the dictionary that are not the
    board's are ignored. A board printed white on black (`board.inverted`) is searched in the
    inverted picture, which is the only one in which OpenCV finds it.
    """
    ids, px = detect(grey, board)
    return refine_corners(grey, px, ids, board)


def refine_corners(
    grey: np.ndarray, px_guess: np.ndarray, ids: np.ndarray, board: Board
) -> Corners:
    """Fit the board's corners `ids` (n,) near known places px_guess (n, 2), without detection.

    Guesses may be off by a third of a square or 4 px, whichever is less. Corners that are hidden,
    out of the picture or disturbed by something near them are left out.
    """
    ids = np.asarray(ids, dtype=int)
    px_guess = np.asarray(px_guess, dtype=float).reshape(-1, 2)
    cut = cut_corners(grey, px_guess, ids, board)
    if cut is None:
        return Corners.none()
    windows, frames = cut
    saddles = fit_saddles(windows, frames, px_guess)
    if not saddles.converged.any():
        return Corners.none()
    good = saddles.converged & _resemble_others(saddles, ids, board)
    return Corners(ids[good], saddles.px[good], saddles.sigma_px[good])


def detect(grey: np.ndarray, board: Board) -> tuple[np.ndarray, np.ndarray]:
    """Return OpenCV's own corners: ids (n,) and px (n, 2), good to about 0.2 px."""
    ids, px, _ = detect_with_markers(grey, board)
    return ids, px


def detect_with_markers(
    grey: np.ndarray, board: Board
) -> tuple[np.ndarray, np.ndarray, Sequence[np.ndarray]]:
    """Return OpenCV's corners, ids (n,) and px (n, 2), and its markers' outlines, (1, 4, 2) px
    each.

    All three are empty where there are fewer than MIN_CORNERS.
    """
    picture = to_8_bit(grey)
    detector = cv2.aruco.CharucoDetector(board.opencv())
    px, ids, markers, _ = detector.detectBoard(255 - picture if board.inverted else picture)
    if ids is None or len(ids) < MIN_CORNERS:
        return np.empty(0, dtype=int), np.empty((0, 2)), ()
    return ids.reshape(-1).astype(int), px.reshape(-1, 2).astype(float), markers


def to_8_bit(grey: np.ndarray) -> np.ndarray:
    """Convert a deeper picture to 8 bit, scaled to its own range.

    A 12-bit camera fills only a sixteenth of 16 bits.
    """
    if grey.dtype == np.uint8:
        return grey
    brightest = np.percentile(grey[::4, ::4], _BRIGHTEST_PERCENT)
    return np.clip(grey * (255.0 / max(brightest, 1.0)), 0, 255).astype(np.uint8)


def cut_corners(
    grey: np.ndarray, px: np.ndarray, ids: np.ndarray, board: Board
) -> tuple[Windows, np.ndarray] | None:
    """Return the pixels about corners at guesses (n, 2) px, and one square in the picture at each,
    (n, 2, 2) px. None where the guesses fix no plane.
    """
    frames = _local_frames(px, ids, board)
    if frames is None:
        return None
    # The white rim between a marker and its square's edge, in squares.
    border = 0.5 * (1.0 - board.marker_mm / board.square_mm)
    return cut_windows(grey, px, frames, border), frames


def _local_frames(px: np.ndarray, ids: np.ndarray, board: Board) -> np.ndarray | None:
    """Return one square along board x and y in the picture at each corner: (n, 2, 2) px, columns x
    and y.

    From one plane-to-picture homography; None where the corners fix none.
    """
    if len(ids) < MIN_CORNERS:
        return None
    squares = board.corners_mm[ids, :2] / board.square_mm
    H, _ = cv2.findHomography(squares, px, 0)
    if H is None or not np.all(np.isfinite(H)) or abs(np.linalg.det(H)) < 1e-12:
        return None
    depth = squares @ H[2, :2] + H[2, 2]
    return (H[:2, :2] - px[:, :, None] * H[2, :2]) / depth[:, None, None]


def _resemble_others(saddles: Saddles, ids: np.ndarray, board: Board) -> np.ndarray:
    """Return which corners resemble the board's other corners, (n,) bool.

    Colours alternate; blur, contrast and misfit are alike.
    """
    good = saddles.converged
    columns = board.squares[0] - 1
    is_even = (ids % columns + ids // columns) % 2 == 0
    contrast = np.where(is_even, saddles.contrast, -saddles.contrast)
    alike = np.sign(contrast) == np.sign(np.median(contrast[good]))
    for value in (np.abs(contrast), saddles.blur_px):
        ratio = value / np.median(value[good])
        alike &= (ratio < _ODD_FACTOR) & (ratio > 1 / _ODD_FACTOR)
    return alike & (saddles.misfit < _DISTURBED_RATIO * np.median(saddles.misfit[good]))
