"""The printed ChArUco board."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np

from vision.geometry.checks import require, require_length, require_sigma

# How a print differs from the stated board: its mean square's relative size less 1, the share by
# which it is longer along y than along x, and its warps.
PRINT_TERMS = ("scale", "stretch", "warp_x_mm", "warp_y_mm")


@dataclass(frozen=True)
class Board:
    """A ChArUco board in OpenCV's frame: origin top left, z into the board.

    squares: (along x, along y). square_sigma_mm: of the mean square. stretch_sigma: of the share by
    which the print is longer along y than along x. What has a sigma of 0 is exact. Raises Refused
    for a board that cannot be.
    """

    squares: tuple[int, int]
    square_mm: float
    marker_mm: float
    dictionary: str
    legacy: bool = False
    inverted: bool = False
    square_sigma_mm: float = 0.0
    stretch_sigma: float = 0.0

    def __post_init__(self):
        """Raise Refused for counts, lengths or a dictionary that cannot be."""
        object.__setattr__(self, "squares", tuple(int(n) for n in self.squares))
        require(
            len(self.squares) == 2 and min(self.squares) >= 2,
            f"board squares = {list(self.squares)}: two counts, each 2 or more",
        )
        require_length("board", square_mm=self.square_mm, marker_mm=self.marker_mm)
        require_sigma(
            "board", square_sigma_mm=self.square_sigma_mm, stretch_sigma=self.stretch_sigma
        )
        require(
            self.marker_mm < self.square_mm,
            f"board marker_mm = {self.marker_mm} is not smaller than square_mm = {self.square_mm}",
        )
        require(
            self.dictionary.startswith("DICT_") and hasattr(cv2.aruco, self.dictionary),
            f"board dictionary {self.dictionary!r} is not one of OpenCV's, such as DICT_5X5_100",
        )
        available = len(_dictionary(self.dictionary).bytesList)
        require(
            self.marker_count <= available,
            f"board of {self.squares[0]} x {self.squares[1]} squares needs {self.marker_count} markers, "
            f"{self.dictionary} has {available}",
        )

    @property
    def marker_count(self) -> int:
        """Return the number of markers: one on every second square."""
        return self.squares[0] * self.squares[1] // 2

    def opencv(self) -> cv2.aruco.CharucoBoard:
        """Return the board as OpenCV's object, with only the markers of its dictionary that it
        uses.

        Comparing pictures with a thousand markers takes 40 % of detection. (The other markers are
        as far from the board's as they are in the whole dictionary, so that they are not taken for
        it.)
        """
        return _opencv_board(self)

    @cached_property
    def corners_mm(self) -> np.ndarray:
        """Return the inner corners in the board frame, ((nx − 1)(ny − 1), 3); the row is the
        ChArUco id.
        """
        x = np.arange(1, self.squares[0]) * self.square_mm
        y = np.arange(1, self.squares[1]) * self.square_mm
        x_grid, y_grid = np.meshgrid(x, y)
        corners = np.stack([x_grid, y_grid, np.zeros_like(x_grid)], axis=-1).reshape(-1, 3)
        corners.setflags(write=False)
        return corners


def printed_corners(corners_mm: np.ndarray, terms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of a print (m, 3), mm, and their derivatives by PRINT_TERMS (m, 3, 4).

    corners_mm (m, 3): as stated. terms (4,): PRINT_TERMS. Size and stretch count from the board's
    origin, the mean of both directions being the size. Warp after mrcal: z = warp_x (1 − x²) +
    warp_y (1 − y²), x and y from −1 to 1 over the corners.
    """
    flat = corners_mm[:, :2]
    half = np.maximum(np.ptp(flat, axis=0) / 2, 1e-9)
    unit = (flat - flat.mean(axis=0)) / half
    by_terms = np.zeros((len(corners_mm), 3, len(PRINT_TERMS)))
    by_terms[:, :, 0] = corners_mm
    by_terms[:, :2, 1] = flat * [-0.5, 0.5]
    by_terms[:, 2, 2:] = 1.0 - unit**2
    return corners_mm + by_terms @ terms, by_terms


def _dictionary(name: str) -> cv2.aruco.Dictionary:
    """Return OpenCV's dictionary of markers of that name."""
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


@lru_cache(maxsize=32)
def _opencv_board(board: Board) -> cv2.aruco.CharucoBoard:
    """Make OpenCV's board, once for each board: OpenCV warns of narrow borders each time."""
    whole = _dictionary(board.dictionary)
    markers = whole.bytesList[: board.marker_count]
    own = cv2.aruco.Dictionary(markers, whole.markerSize, whole.maxCorrectionBits)
    square_mm = float(board.square_mm)
    charuco = cv2.aruco.CharucoBoard(board.squares, square_mm, float(board.marker_mm), own)
    charuco.setLegacyPattern(board.legacy)
    return charuco
