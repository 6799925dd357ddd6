"""The printed ChArUco board."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np

from vision.geometry.checks import require, require_length, require_sigma


@dataclass(frozen=True)
class Board:
    """A ChArUco board. squares = (along x, along y); frame as OpenCV's: origin top left, z into the board."""

    squares: tuple[int, int]
    square_mm: float
    marker_mm: float
    dictionary: str
    legacy: bool = False
    inverted: bool = False
    square_sigma_mm: float = 0.0

    def __post_init__(self):
        object.__setattr__(self, "squares", tuple(int(n) for n in self.squares))
        require(
            len(self.squares) == 2 and min(self.squares) >= 2,
            f"board squares = {list(self.squares)}: two counts, each 2 or more",
        )
        require_length("board", square_mm=self.square_mm, marker_mm=self.marker_mm)
        require_sigma("board", square_sigma_mm=self.square_sigma_mm)
        require(
            self.marker_mm < self.square_mm,
            f"board marker_mm = {self.marker_mm} is not smaller than square_mm = {self.square_mm}",
        )
        require(
            self.dictionary.startswith("DICT_") and hasattr(cv2.aruco, self.dictionary),
            f"board dictionary {self.dictionary!r} is not one of OpenCV's, such as DICT_5X5_100",
        )
        require(
            self.marker_count <= self.markers_in_dictionary,
            f"board of {self.squares[0]} x {self.squares[1]} squares needs {self.marker_count} markers, "
            f"{self.dictionary} has {self.markers_in_dictionary}",
        )

    @property
    def marker_count(self) -> int:
        """One marker on every second square."""
        return self.squares[0] * self.squares[1] // 2

    @property
    def markers_in_dictionary(self) -> int:
        """How many markers the dictionary has."""
        return len(self._opencv_dictionary().bytesList)

    def _opencv_dictionary(self) -> cv2.aruco.Dictionary:
        return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))

    def opencv(self) -> cv2.aruco.CharucoBoard:
        """The same board as OpenCV's object, with no more of its dictionary than the board has: comparing what is seen
        with a thousand markers took 40 % of detection. (Others are as far from the board's as before: not taken.)
        """
        return _opencv_board(self)

    @cached_property
    def corners_mm(self) -> np.ndarray:
        """Inner corners in the board frame, ((nx − 1)(ny − 1), 3); the row is the ChArUco id."""
        x = np.arange(1, self.squares[0]) * self.square_mm
        y = np.arange(1, self.squares[1]) * self.square_mm
        corners = np.column_stack(
            [np.tile(x, len(y)), np.repeat(y, len(x)), np.zeros(len(x) * len(y))]
        )
        corners.setflags(write=False)
        return corners


@lru_cache(maxsize=32)
def _opencv_board(board: Board) -> cv2.aruco.CharucoBoard:
    """Made once: OpenCV warns of narrow borders each time."""
    whole = board._opencv_dictionary()
    own = cv2.aruco.Dictionary(
        whole.bytesList[: board.marker_count], whole.markerSize, whole.maxCorrectionBits
    )
    made = cv2.aruco.CharucoBoard(
        board.squares, float(board.square_mm), float(board.marker_mm), own
    )
    made.setLegacyPattern(board.legacy)
    return made
