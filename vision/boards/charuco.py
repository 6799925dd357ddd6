"""The ChArUco board: a checkerboard with markers in its white squares, which name its corners."""

from dataclasses import dataclass, field
from functools import lru_cache

import cv2
import numpy as np

from vision.boards.corners import MIN_CORNERS, none_detected
from vision.boards.diagnosis import why_no_charuco
from vision.boards.marker_size import check_marker_size
from vision.boards.markers import marker_dictionary
from vision.boards.saddle_board import CheckeredBoard, require_marker_fits
from vision.geometry.checks import require


@dataclass(frozen=True)
class CharucoBoard(CheckeredBoard):
    """A ChArUco board in OpenCV's frame: origin top left, z into the board. A point's id is its
    ChArUco id.

    legacy: OpenCV's pattern from before 4.6. inverted: printed white on black. first_id: of its
    markers, which are numbered on from there. Raises Refused for a board that cannot be.
    """

    marker_mm: float
    dictionary: str
    legacy: bool = False
    inverted: bool = False
    first_id: int = 0

    kind: str = field(default="charuco", init=False)

    def __post_init__(self):
        """Raise Refused for counts, lengths or a dictionary that cannot be."""
        super().__post_init__()
        require_marker_fits(self.marker_mm, self.square_mm)
        require(
            self.dictionary.startswith("DICT_") and hasattr(cv2.aruco, self.dictionary),
            f"board dictionary {self.dictionary!r} is not one of OpenCV's, such as DICT_5X5_100",
        )
        available = len(marker_dictionary(self.dictionary).bytesList)
        require(
            0 <= self.first_id <= available - self.marker_count,
            f"board of {self.squares[0]} x {self.squares[1]} squares needs {self.marker_count} markers"
            f"{f' from {self.first_id} on' if self.first_id else ''}, {self.dictionary} has {available}",
        )

    @property
    def marker_count(self) -> int:
        """Return the number of markers: one on every second square."""
        return self.squares[0] * self.squares[1] // 2

    @property
    def is_white_on_black(self) -> bool:
        """Return whether the board, and markers with it, are printed white on black."""
        return self.inverted

    @property
    def spare_markers(self) -> tuple[str, int]:
        """Return the board's dictionary, and the first number that the board does not use."""
        return self.dictionary, self.first_id + self.marker_count

    def opencv(self) -> cv2.aruco.CharucoBoard:
        """Return the board as OpenCV's object, with only the markers of its dictionary that it
        uses.

        Comparing pictures with a thousand markers takes 40 % of detection. (The other markers are
        as far from the board's as they are in the whole dictionary, so that they are not taken for
        it.)
        """
        return _opencv_board(self)

    @property
    def clear_mm(self) -> float:
        """Return the width of the white rim between a marker and its square's edge."""
        return 0.5 * (self.square_mm - self.marker_mm)

    def detect(self, picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return OpenCV's own corners, ids (n,) and px (n, 2), good to about 0.2 px.

        Markers of the dictionary that are not the board's are ignored. A board printed white on
        black is searched in the inverted picture, the only one in which OpenCV finds it.
        """
        ids, px, _ = self.detect_with_markers(picture)
        return ids, px

    def detect_with_markers(
        self, picture: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, ...]]:
        """Return OpenCV's corners, ids (n,) and px (n, 2), and its markers' outlines, (1, 4, 2) px
        each.

        All three are empty where there are fewer than MIN_CORNERS.
        """
        detector = cv2.aruco.CharucoDetector(self.opencv())
        px, ids, markers, _ = detector.detectBoard(255 - picture if self.inverted else picture)
        if ids is None or len(ids) < MIN_CORNERS:
            return *none_detected(), ()
        return ids.reshape(-1).astype(int), px.reshape(-1, 2).astype(float), markers

    def why_not_found(self, greys: list[np.ndarray], *, mirrored: bool = False) -> str | None:
        """Return a sentence naming the setting that would find the board; None if it is found."""
        return why_no_charuco(greys, self, mirrored=mirrored)

    def check_print(self, greys: list[np.ndarray]) -> None:
        """Raise Refused where marker_mm and square_mm contradict the markers in pictures."""
        check_marker_size(greys, self)


@lru_cache(maxsize=32)
def _opencv_board(board: CharucoBoard) -> cv2.aruco.CharucoBoard:
    """Make OpenCV's board, once for each board: OpenCV warns of narrow borders each time."""
    whole = marker_dictionary(board.dictionary)
    markers = whole.bytesList[board.first_id :][: board.marker_count]
    own = cv2.aruco.Dictionary(markers, whole.markerSize, whole.maxCorrectionBits)
    square_mm = float(board.square_mm)
    charuco = cv2.aruco.CharucoBoard(board.squares, square_mm, float(board.marker_mm), own)
    charuco.setLegacyPattern(board.legacy)
    return charuco
