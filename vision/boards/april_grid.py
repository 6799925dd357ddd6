"""The AprilGrid of Kalibr: tags in rows, with a small dark square in each gap between four of them.

So each corner of a tag is a crossing of two edges. Frame and numbers are Kalibr's: tag 0 lower
left, x along its row, y to the next row above, z out of the board.
"""

from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np

from vision.boards.corners import is_found, none_detected
from vision.boards.homography import fit_homography, map_places
from vision.boards.markers import detect_markers, marker_dictionary
from vision.boards.saddle_board import SaddleBoard, require_marker_fits
from vision.geometry.board import grid_mm
from vision.geometry.checks import require

_DICTIONARY = "DICT_APRILTAG_36h11"
# [modules] Widths of the dark rim about a tag's code: Kalibr's, and that of AprilTag's own pictures. A
# layout.
_RIMS = (2, 1)
# [1] Of a tag's side: the narrower of the two rims, one module of eight. A layout.
_RIM_SHARE = 1.0 / 8.0
# [px] Blur added to a picture before tags are looked for: in its noise outlines are taken a module
# inside a tag. Study: tests/vision/boards/test_board_kinds.py.
_SMOOTH_PX = (0.0, 1.0, 1.5)
# [columns, rows] Of a tag's corners, clockwise as OpenCV orders them, from the lower left of a tag as
# Kalibr prints it, upside down. A layout, no threshold.
_ORDER = ((1, 0), (0, 0), (0, 1), (1, 1))
# [1] Of a tag's side: corners lie off a plane's picture by less, through any lens here; those of a
# tag taken with a wrong rim by a fifth. Stated.
_MOST_OFF_PLANE = 0.1


@dataclass(frozen=True)
class AprilGrid(SaddleBoard):
    """A grid of AprilTags 36h11.

    squares: tags (along x, along y). square_mm: from tag to tag. marker_mm: side of a tag. Raises
    Refused for a board that cannot be.
    """

    marker_mm: float

    kind: str = field(default="aprilgrid", init=False)

    def __post_init__(self):
        """Raise Refused for counts or lengths that cannot be."""
        super().__post_init__()
        require_marker_fits(self.marker_mm, self.square_mm)
        available = len(marker_dictionary(_DICTIONARY).bytesList)
        require(
            self.tag_count <= available,
            f"board of {self.tag_count} tags: there are {available}",
        )

    @property
    def tag_count(self) -> int:
        """Return the number of tags."""
        return self.squares[0] * self.squares[1]

    @property
    def grid(self) -> tuple[int, int]:
        """Return the number of tags' corners along x and y."""
        return 2 * self.squares[0], 2 * self.squares[1]

    @cached_property
    def corners_mm(self) -> np.ndarray:
        """Return the tags' corners in the board frame, (4 nx ny, 3)."""
        x_mm, y_mm = [self._along(count) for count in self.squares]
        return grid_mm(x_mm, y_mm)

    def _along(self, count: int) -> np.ndarray:
        """Return where tags begin and end along a row of so many, (2 count,) mm."""
        return np.add.outer(np.arange(count) * self.square_mm, [0.0, self.marker_mm]).ravel()

    @property
    def spare_markers(self) -> tuple[str, int]:
        """Return the tags' dictionary, and the first number that the board does not use."""
        return _DICTIONARY, self.tag_count

    @property
    def cell_mm(self) -> float:
        """Return the gap between tags, whose edges two corners share, or twice a tag's rim."""
        return min(self.square_mm - self.marker_mm, 2.0 * _RIM_SHARE * self.marker_mm)

    @property
    def clear_mm(self) -> float:
        """Return half a cell: no code reaches into it."""
        return 0.5 * self.cell_mm

    def detect(self, picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners of the tags that are seen.

        Tags have the rim, and were printed the way up, by which their corners lie on one plane. The
        picture is searched as it is and smoothed; the search that finds most tags counts.
        """
        best = none_detected()
        for smooth_px in _SMOOTH_PX:
            smooth = cv2.GaussianBlur(picture, (0, 0), smooth_px) if smooth_px else picture
            found = self._on_a_plane(smooth)
            if len(found[0]) > len(best[0]):
                best = found
        return best

    def _on_a_plane(self, picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ids (n,) and pixels (n, 2) of tags' corners that are on one plane; none if none are."""
        best = none_detected()
        least = _MOST_OFF_PLANE
        for rim in _RIMS:
            numbers, outlines_px = self._tags(picture, rim)
            for turn in range(4) if len(numbers) > 1 else ():
                ids = self._corner_ids(numbers, np.roll(_ORDER, turn, axis=0))
                off_plane = self._off_plane(ids, outlines_px)
                if off_plane < least:
                    least = off_plane
                    best = ids, outlines_px.reshape(-1, 2)
        return best

    def _tags(self, picture: np.ndarray, rim: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers (n,) of tags with a rim of so many modules, and their outlines
        (n, 4, 2) px. A number that is seen twice is left out.
        """
        parameters = cv2.aruco.DetectorParameters()
        parameters.markerBorderBits = rim
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        numbers, outlines_px = detect_markers(picture, _DICTIONARY, parameters)
        values, counts = np.unique(numbers, return_counts=True)
        once = np.isin(numbers, values[counts == 1]) & (numbers < self.tag_count)
        return numbers[once], outlines_px[once]

    def _corner_ids(self, numbers: np.ndarray, order: np.ndarray) -> np.ndarray:
        """Return the ids (4 n,) of the corners of tags (n,), in an order (4, 2) of columns and rows."""
        row, column = np.divmod(numbers[:, None], self.squares[0])
        return ((2 * row + order[:, 1]) * self.grid[0] + 2 * column + order[:, 0]).ravel()

    def _off_plane(self, ids: np.ndarray, outlines_px: np.ndarray) -> float:
        """Return how far corners lie off a plane's picture in the median, in sides of a tag."""
        px = outlines_px.reshape(-1, 2)
        places_mm = self.corners_mm[ids, :2]
        H = fit_homography(places_mm, px)
        if H is None:
            return np.inf
        on_plane_px, _ = map_places(H, places_mm)
        off_px = np.linalg.norm(on_plane_px - px, axis=1)
        side_px = np.linalg.norm(outlines_px[:, 0] - outlines_px[:, 1], axis=1)
        return float(np.median(off_px) / np.median(side_px))

    def why_not_found(self, greys: list[np.ndarray], *, mirrored: bool = False) -> str | None:
        """Return a sentence on how many tags are seen; None if the board is found."""
        if is_found(self, greys):
            return None
        return (
            f"no tag of {_DICTIONARY} numbered 0 to {self.tag_count - 1} is seen: "
            "is this the board, of this family, lit and sharp?"
        )
