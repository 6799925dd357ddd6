"""Grids of dark circles, in columns or with every second row shifted.

In perspective the centre of a circle's picture is not the picture of its centre. They are about r²
tan(tilt) / f apart, 0.1 px where r is 20 px. This shift follows from the board's plane and is subtracted.
"""

from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np

from vision.boards.corners import MIN_CORNERS, Corners, is_found, none_detected, to_8_bit
from vision.boards.discs import cut_discs, fit_discs
from vision.boards.homography import fit_homography, map_places
from vision.boards.saddle import Saddles
from vision.boards.saddle_board import is_undisturbed, is_usual, local_axes
from vision.boards.symmetry import possible_labels, turns_onto_itself, upper_left_first
from vision.geometry.board import Board, grid_mm
from vision.geometry.checks import require, require_length

# [px²] Least area of a dark spot that may be a circle: 5 px across. Stated.
_LEAST_AREA = 20.0
# [1] Largest area of a spot, of the picture's. Stated.
_MOST_AREA = 0.02
# [1] Of a circle's radius: a fit that runs farther found another. Stated.
_MOST_SHIFT = 0.3
# [pixels] Four times the ten parameters. Derived.
_MIN_PIXELS = 40
# [1] Share of the perspective's shift that is uncertain because lenses distort: with k1 = −0.1 a
# twentieth. Derived.
_SHIFT_SHARE = 0.05


@dataclass(frozen=True)
class CircleGrid(Board):
    """Dark circles in rows and columns: origin at the first circle's centre, z into the board.

    squares: circles (along x, along y). square_mm: from circle to circle. marker_mm: a circle's
    diameter. Raises Refused for a board that cannot be.
    """

    marker_mm: float

    kind: str = field(default="circles", init=False)
    _flags = cv2.CALIB_CB_SYMMETRIC_GRID

    def __post_init__(self):
        """Raise Refused for counts or lengths that cannot be."""
        super().__post_init__()
        require_length("board", marker_mm=self.marker_mm)
        require(
            self.marker_mm < self.nearest_mm,
            f"board marker_mm = {self.marker_mm}: circles {self.nearest_mm:.4g} mm apart touch each other",
        )

    @property
    def grid(self) -> tuple[int, int]:
        """Return the number of circles in a row, and of rows."""
        return self.squares

    @property
    def nearest_mm(self) -> float:
        """Return the distance of neighbouring circles."""
        return self.square_mm

    @cached_property
    def corners_mm(self) -> np.ndarray:
        """Return the circles' centres in the board frame, (nx ny, 3)."""
        x_mm = np.arange(self.squares[0]) * self.square_mm
        return grid_mm(x_mm, np.arange(self.squares[1]) * self.square_mm)

    @property
    def hidden_turns(self) -> tuple[np.ndarray, ...]:
        """Return the turns that put circles onto circles."""
        return turns_onto_itself(self)[1:]

    def detect(self, picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return all circles; none where a part of the board is hidden or out of the picture."""
        detector = _spot_detector(picture.size)
        for flags in (self._flags, self._flags | cv2.CALIB_CB_CLUSTERING):
            is_found, px = cv2.findCirclesGrid(picture, self.grid, None, flags, detector)
            if is_found:
                candidates = possible_labels(px.reshape(-1, 2).astype(float), self)
                return np.arange(len(px)), upper_left_first(candidates)
        return none_detected()

    def refine(self, grey: np.ndarray, px_guess: np.ndarray, ids: np.ndarray) -> Corners:
        """Fit discs; guesses may be off by a third of a radius. The perspective's shift of their
        centres is taken off.
        """
        radius_mm = 0.5 * self.marker_mm
        axes = local_axes(px_guess, self.corners_mm[ids, :2] / radius_mm)
        if axes is None:
            return Corners.none()
        windows = cut_discs(grey, px_guess, axes, 0.5 * self.nearest_mm / radius_mm)
        discs = fit_discs(windows, px_guess)
        has_pixels = windows.weight.sum(axis=1) >= _MIN_PIXELS
        good = has_pixels & _is_disc(discs, px_guess, axes)
        if good.sum() < MIN_CORNERS:
            return Corners.none()
        shift_px = perspective_shift(discs.px[good], self.corners_mm[ids[good], :2], radius_mm)
        unknown_px = _SHIFT_SHARE * np.linalg.norm(shift_px, axis=1)
        sigma_px = np.hypot(discs.sigma_px[good], unknown_px / np.sqrt(2.0))
        return Corners(ids[good], discs.px[good] - shift_px, sigma_px)

    def why_not_found(self, greys: list[np.ndarray], *, mirrored: bool = False) -> str | None:
        """Return a sentence on how many dark spots are seen; None if the board is found."""
        if is_found(self, greys):
            return None
        counts = [len(_spot_detector(grey.size).detect(to_8_bit(grey))) for grey in greys]
        return (
            f"no grid of {self.squares[0]} x {self.squares[1]} circles is found, {max(counts, default=0)} dark spots "
            f"are seen where {self.squares[0] * self.squares[1]} should be: check squares, and that no part of the "
            "board is hidden or beyond the picture's edge"
        )


@dataclass(frozen=True)
class AsymmetricCircles(CircleGrid):
    """Dark circles in rows of which every second is shifted by half the distance in a row.

    squares: circles (in a row, rows), as OpenCV counts them. square_mm: from row to row, half of the
    distance in a row.
    """

    kind: str = field(default="asymmetric_circles", init=False)
    _flags = cv2.CALIB_CB_ASYMMETRIC_GRID

    @property
    def nearest_mm(self) -> float:
        """Return the distance of neighbouring circles, across the diagonal."""
        return float(np.sqrt(2.0) * self.square_mm)

    @cached_property
    def corners_mm(self) -> np.ndarray:
        """Return the circles' centres in the board frame, (nx ny, 3)."""
        x_mm = 2.0 * np.arange(self.squares[0]) * self.square_mm
        corners = np.array(grid_mm(x_mm, np.arange(self.squares[1]) * self.square_mm))
        is_shifted = np.arange(len(corners)) // self.squares[0] % 2 == 1
        corners[is_shifted, 0] += self.square_mm
        corners.setflags(write=False)
        return corners


def _spot_detector(size: int) -> cv2.SimpleBlobDetector:
    """Return OpenCV's detector of dark spots, for a picture of so many pixels."""
    parameters = cv2.SimpleBlobDetector_Params()
    parameters.minArea = _LEAST_AREA
    parameters.maxArea = _MOST_AREA * size
    return cv2.SimpleBlobDetector_create(parameters)


def _is_disc(discs: Saddles, px_guess: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return which discs converged near their guess and resemble the board's others, (n,) bool."""
    good = discs.converged & np.isfinite(discs.sigma_px) & (discs.sigma_px > 0)
    if not good.any():
        return good
    shift_px = np.linalg.norm(discs.px - px_guess, axis=1)
    good &= shift_px < _MOST_SHIFT * np.linalg.norm(axes, axis=1).min(axis=1)
    good &= discs.contrast > 0
    if not good.any():
        return good
    good &= is_usual(discs.contrast, good)
    return good & is_undisturbed(discs.misfit, good)


def perspective_shift(px: np.ndarray, places_mm: np.ndarray, radius_mm: float) -> np.ndarray:
    """Return by how much the centres of circles' pictures, (n, 2) px, lie off the pictures of their
    centres at places_mm (n, 2), (n, 2) px.
    """
    centres = np.column_stack([places_mm, np.ones(len(places_mm))])
    # the dual conic of a circle is H-covariant: its picture's last column is the centre
    circles = centres[:, :, None] * centres[:, None] - radius_mm**2 * np.diag([1.0, 1.0, 0.0])
    shift_px = np.zeros_like(px)
    for _ in range(2):
        H = fit_homography(places_mm, px - shift_px)
        of_picture = (H @ circles @ H.T)[:, :, 2]
        shift_px = of_picture[:, :2] / of_picture[:, 2:] - map_places(H, places_mm)[0]
    return shift_px
