"""ChArUco corners to a few hundredths of a pixel, each with its sigma.

OpenCV finds the board and names its corners; their places come from a fit of two crossing blurred edges to
the picture itself (`vision.boards.saddle`), because OpenCV's own scatter by 0.12 to 0.28 px where the picture is
noisy or soft.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from vision.boards.saddle import fit_saddles
from vision.geometry.board import Board
from vision.geometry.refusals import Refused

# [corners] Fewer fix no plane, so that nothing can be said of edges at a corner. Derived.
MIN_CORNERS = 4
# [1] A wire, bar or glare beside a corner: the picture misses the model by this many times the
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
class Corners:
    """Corners of one board in one picture: ids (n,), px (n, 2), sigma_px (n,) one standard deviation per axis.
    Refused where these are not as many."""

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
        """A view in which no board is seen."""
        return Corners(np.empty(0), np.empty((0, 2)), np.empty(0))

    def __len__(self) -> int:
        return len(self.ids)

    def chosen(self, which: np.ndarray) -> "Corners":
        """The corners that the mask or index array `which` names."""
        return Corners(self.ids[which], self.px[which], self.sigma_px[which])


def find_corners(grey: np.ndarray, board: Board) -> Corners:
    """The board's inner corners in a grey picture, uint8 or uint16; `Corners.none()` where the board is not
    seen.

    Markers of the dictionary that are not the board's are ignored. A board printed white on black
    (`board.inverted`) is looked for in the inverted picture, which is the only one in which OpenCV finds it.
    """
    ids, px = detect(grey, board)
    return refine_corners(grey, px, ids, board)


def edge_blur_px(grey: np.ndarray, board: Board) -> float:
    """Median blur of the board's edges, px, one sigma of a Gaussian; NaN where no board is seen."""
    ids, px = detect(grey, board)
    frames = _local_frames(px, ids, board)
    if frames is None:
        return float("nan")
    saddles = fit_saddles(grey, px, frames, _border(board))
    return (
        float(np.median(saddles.blur_px[saddles.converged]))
        if np.any(saddles.converged)
        else float("nan")
    )


def detect(grey: np.ndarray, board: Board) -> tuple[np.ndarray, np.ndarray]:
    """OpenCV's own corners: ids (n,) and px (n, 2), good to about 0.2 px."""
    picture = to_8_bit(grey)
    detector = cv2.aruco.CharucoDetector(board.opencv())
    px, ids, _, _ = detector.detectBoard(255 - picture if board.inverted else picture)
    if ids is None or len(ids) < MIN_CORNERS:
        return np.empty(0, dtype=int), np.empty((0, 2))
    return ids.reshape(-1).astype(int), px.reshape(-1, 2).astype(float)


def to_8_bit(grey: np.ndarray) -> np.ndarray:
    """Deeper pictures stretched to their own range: a 12-bit camera fills only a sixteenth of 16 bits."""
    if grey.dtype == np.uint8:
        return grey
    brightest = np.percentile(grey[::4, ::4], _BRIGHTEST_PERCENT)
    return np.clip(grey * (255.0 / max(brightest, 1.0)), 0, 255).astype(np.uint8)


def refine_corners(
    grey: np.ndarray, px_guess: np.ndarray, ids: np.ndarray, board: Board
) -> Corners:
    """Corners near known places px_guess (n, 2) of the board's corners ids (n,): no detection, only the
    saddle fit.

    Guesses may be off by a third of a square or 4 px, whichever is less. Corners that are hidden, out of
    the picture or disturbed by something beside them are left out.
    """
    ids, px_guess = np.asarray(ids, dtype=int), np.asarray(px_guess, dtype=float).reshape(-1, 2)
    frames = _local_frames(px_guess, ids, board)
    if frames is None:
        return Corners.none()
    saddles = fit_saddles(grey, px_guess, frames, _border(board))
    good = saddles.converged & _same_board(saddles, ids, board)
    return Corners(ids[good], saddles.px[good], saddles.sigma_px[good])


def _border(board: Board) -> float:
    """White rim between a marker and its square's edge, in squares: what a fit may see beside an edge."""
    return 0.5 * (1.0 - board.marker_mm / board.square_mm)


def _local_frames(px: np.ndarray, ids: np.ndarray, board: Board) -> np.ndarray | None:
    """How one square along board x and y looks in the picture at each corner: (n, 2, 2) px, columns x and y.

    From one plane-to-picture homography; None where the corners fix none.
    """
    if len(ids) < MIN_CORNERS:
        return None
    squares = board.corners_mm[ids, :2] / board.square_mm
    H, _ = cv2.findHomography(squares, px, 0)
    if H is None or not np.all(np.isfinite(H)) or abs(np.linalg.det(H)) < 1e-12:
        return None
    scale = np.column_stack([squares, np.ones(len(squares))]) @ H[2]
    return (H[None, :2, :2] - px[:, :, None] * H[None, 2:, :2]) / scale[:, None, None]


def _same_board(saddles, ids: np.ndarray, board: Board) -> np.ndarray:
    """Corners that look like the board's other corners: colours alternate, blur, contrast and misfit are alike."""
    good = saddles.converged
    if not good.any():
        return good
    columns = board.squares[0] - 1
    colour = np.where((ids % columns + ids // columns) % 2 == 0, 1.0, -1.0) * saddles.contrast
    alike = np.sign(colour) == np.sign(np.median(colour[good]))
    for value in (np.abs(colour), saddles.blur_px):
        ratio = value / np.median(value[good])
        alike &= (ratio < _ODD_FACTOR) & (ratio > 1 / _ODD_FACTOR)
    return alike & (saddles.misfit < _DISTURBED_RATIO * np.median(saddles.misfit[good]))
