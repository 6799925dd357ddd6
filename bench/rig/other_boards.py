"""Prints of the other kinds of board: checkerboards, circles, AprilGrids as Kalibr has them.

A print's coordinates begin in its upper left corner, x right, y down, z into it. The board frame of
circles begins in the first one's centre, that of an AprilGrid lower left, y up and z out of it.
"""

from dataclasses import dataclass
from typing import ClassVar, TypeAlias

import cv2
import numpy as np

from bench.rig.plate import CirclePrint, Print
from bench.rig.printed_board import Ink, PrintedBoard, PrintedSquares

_TAG_CELLS = 10  # of an AprilTag 36h11 with its rim of two, across


@dataclass(frozen=True)
class PrintedCheckerboard(PrintedSquares):
    """A plain checkerboard, its upper left square dark. dictionary: of the markers on the rig."""

    dictionary: str
    is_found_in_parts: ClassVar[bool] = False

    def to_print(self, ink: Ink, margin_mm: float) -> Print:
        """Print the board within a white margin."""
        columns, rows = self.squares
        is_dark = np.add.outer(np.arange(rows), np.arange(columns)) % 2 == 0
        x_mm = self.square_mm * np.arange(columns + 1)
        y_mm = self.square_mm * np.arange(rows + 1)
        tones = np.where(is_dark, ink.black, ink.white)
        return Print(tones, x_mm, y_mm).frame(margin_mm, ink.white)


@dataclass(frozen=True)
class PrintedCircles:
    """Dark circles in rows; marker_mm: their diameter. is_shifted: every second row by square_mm.

    squares: circles (in a row, rows). square_mm: from circle to circle, from row to row where shifted.
    """

    squares: tuple[int, int]
    square_mm: float
    marker_mm: float
    dictionary: str
    is_shifted: bool = False
    is_found_in_parts: ClassVar[bool] = False

    @property
    def centres_mm(self) -> np.ndarray:
        """Return the circles' centres in the board frame, row by row, (n, 2)."""
        step_mm = self.square_mm * (2.0 if self.is_shifted else 1.0)
        x_mm = np.tile(step_mm * np.arange(self.squares[0]), self.squares[1])
        row = np.repeat(np.arange(self.squares[1]), self.squares[0])
        if self.is_shifted:
            x_mm = x_mm + self.square_mm * (row % 2)
        return np.column_stack([x_mm, self.square_mm * row])

    @property
    def size_mm(self) -> tuple[float, float]:
        """Return width and height."""
        width, height = np.ptp(self.centres_mm, axis=0) + self.marker_mm
        return float(width), float(height)

    @property
    def T_print_board(self) -> np.ndarray:
        """Return the board frame's pose (3, 4) on the print."""
        radius_mm = 0.5 * self.marker_mm
        return np.column_stack([np.eye(3), [radius_mm, radius_mm, 0.0]])

    def to_print(self, ink: Ink, margin_mm: float) -> CirclePrint:
        """Print the board within a white margin."""
        radius_mm = 0.5 * self.marker_mm
        x_mm, y_mm = (np.array([-margin_mm, size + margin_mm]) for size in self.size_mm)
        centres_mm = self.centres_mm + radius_mm
        return CirclePrint(centres_mm, radius_mm, ink.white, ink.black, x_mm, y_mm)


@dataclass(frozen=True)
class PrintedAprilGrid:
    """Tags of AprilTag 36h11 in rows from below, a dark square in each gap between them.

    squares: tags. square_mm: from tag to tag. marker_mm: side of a tag.
    """

    squares: tuple[int, int]
    square_mm: float
    marker_mm: float
    dictionary: str
    is_found_in_parts: ClassVar[bool] = True

    @property
    def gap_mm(self) -> float:
        """Return the distance between tags."""
        return self.square_mm - self.marker_mm

    @property
    def size_mm(self) -> tuple[float, float]:
        """Return width and height, dark squares included."""
        width, height = (count * self.square_mm + self.gap_mm for count in self.squares)
        return width, height

    @property
    def T_print_board(self) -> np.ndarray:
        """Return the board frame's pose (3, 4) on the print."""
        lower_left = [self.gap_mm, self.size_mm[1] - self.gap_mm, 0.0]
        return np.column_stack([np.diag([1.0, -1.0, -1.0]), lower_left])

    def to_print(self, ink: Ink, margin_mm: float) -> Print:
        """Print the board within a white margin."""
        x_mm, y_mm = (self._cell_edges_mm(count) for count in self.squares)
        tones = np.where(self._dark_cells(), ink.black, ink.white)
        return Print(tones, x_mm, y_mm).frame(margin_mm, ink.white)

    def _dark_cells(self) -> np.ndarray:
        """Return which cells, rows × columns of modules and gaps, are dark."""
        columns, rows = self.squares
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
        period = _TAG_CELLS + 1  # a gap, and the modules of a tag
        is_dark = np.zeros((rows * period + 1, columns * period + 1), dtype=bool)
        is_dark[::period, ::period] = True
        for number in range(rows * columns):
            row, column = divmod(number, columns)
            tag = cv2.aruco.generateImageMarker(dictionary, number, _TAG_CELLS, borderBits=2)
            top = (rows - 1 - row) * period + 1
            left = column * period + 1
            upside_down = tag[::-1, ::-1]  # as Kalibr prints it
            is_dark[top : top + _TAG_CELLS, left : left + _TAG_CELLS] = upside_down == 0
        return is_dark

    def _cell_edges_mm(self, count: int) -> np.ndarray:
        """Return the edges of the cells of `count` tags in a row."""
        starts = self.square_mm * np.arange(count)
        modules = self.gap_mm + self.marker_mm / _TAG_CELLS * np.arange(_TAG_CELLS)
        edges = np.add.outer(starts, np.append(0.0, modules)).ravel()
        last = count * self.square_mm
        return np.append(edges, [last, last + self.gap_mm])


AnyBoard: TypeAlias = PrintedBoard | PrintedCheckerboard | PrintedCircles | PrintedAprilGrid
