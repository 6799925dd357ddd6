"""Printed ChArUco boards and markers as prints, cell by cell, from OpenCV's own dictionaries."""

from dataclasses import dataclass
from typing import ClassVar

import cv2
import numpy as np

from bench.rig.plate import Print

_MARKER_MM = 10.0  # side of a marker on hub or block


@dataclass(frozen=True)
class Ink:
    """Reflectances of paper and print."""

    white: float = 0.8
    black: float = 0.04


@dataclass(frozen=True)
class PrintedSquares:
    """Squares in columns and rows; the board frame is the print's."""

    squares: tuple[int, int]
    square_mm: float

    @property
    def size_mm(self) -> tuple[float, float]:
        """Return width and height."""
        return self.squares[0] * self.square_mm, self.squares[1] * self.square_mm

    @property
    def T_print_board(self) -> np.ndarray:
        """Return the board frame's pose (3, 4) on the print."""
        return np.eye(3, 4)


@dataclass(frozen=True)
class PrintedBoard(PrintedSquares):
    """A ChArUco board as session.toml names it.

    Raises ValueError for a dictionary that OpenCV does not know, or a marker that does not fit its
    square.
    """

    marker_mm: float
    dictionary: str
    legacy: bool = False
    inverted: bool = False
    is_found_in_parts: ClassVar[bool] = True

    def __post_init__(self):
        if not self.dictionary.startswith("DICT_") or not hasattr(cv2.aruco, self.dictionary):
            raise ValueError(f"{self.dictionary!r} is no ArUco dictionary")
        if not 0 < self.marker_mm < self.square_mm:
            raise ValueError("a board's marker is smaller than its square, and both are positive")

    def opencv(self) -> cv2.aruco.CharucoBoard:
        """Return the board as OpenCV has it."""
        return self._charuco(self.square_mm, self.marker_mm)

    def _charuco(self, square, marker):
        """Return OpenCV's board with squares and markers of these sizes."""
        dictionary = _dictionary(self.dictionary)
        board = cv2.aruco.CharucoBoard(tuple(self.squares), square, marker, dictionary)
        board.setLegacyPattern(self.legacy)
        return board

    @property
    def corners_mm(self) -> np.ndarray:
        """Return the inner corners in the board frame, (n, 3)."""
        return np.asarray(self.opencv().getChessboardCorners(), float)

    def to_print(self, ink: Ink, margin_mm: float) -> Print:
        """Print the board within a white margin; the print's coordinates are the board frame's."""
        modules = _dictionary(self.dictionary).markerSize + 2
        cells = modules + 2  # of a square, each way: a marker's modules, and a gap on either side
        columns, rows = self.squares
        picture = self._charuco(cells, modules).generateImage((columns * cells, rows * cells))
        x_mm = self._cell_edges_mm(columns, modules)
        y_mm = self._cell_edges_mm(rows, modules)
        paper, printed = ink.white, ink.black
        if self.inverted:
            paper, printed = printed, paper
        tones = np.where(picture > 0, paper, printed)
        return Print(tones, x_mm, y_mm).frame(margin_mm, paper)

    def _cell_edges_mm(self, count, modules):
        """Return the edges (n,) of the cells of `count` squares in a row, markers of `modules`."""
        gap = (self.square_mm - self.marker_mm) / 2
        marker = gap + self.marker_mm / modules * np.arange(modules + 1)
        starts = self.square_mm * np.arange(count)
        cell_starts = np.add.outer(starts, np.append(0, marker))
        return np.append(cell_starts, count * self.square_mm)


def marker_count(dictionary: str) -> int:
    """Return how many markers a dictionary has."""
    return len(_dictionary(dictionary).bytesList)


def marker_print(dictionary: str, number: int, ink: Ink) -> Print:
    """Print one marker in a white frame of a seventh of its side, centred on the plate's origin."""
    is_black = _is_black(dictionary, number)
    edges = np.linspace(-_MARKER_MM / 2, _MARKER_MM / 2, len(is_black) + 1)
    marker = Print(np.where(is_black, ink.black, ink.white), edges, edges)
    return marker.frame(_MARKER_MM / 7, ink.white)


def _dictionary(name):
    """Return OpenCV's dictionary of a name."""
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


def _is_black(dictionary, number):
    """Return which modules (rows, columns) of a marker are black, its border's included."""
    predefined = _dictionary(dictionary)
    modules = predefined.markerSize + 2
    return cv2.aruco.generateImageMarker(predefined, number, modules) == 0
