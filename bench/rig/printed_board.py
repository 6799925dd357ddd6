"""Printed ChArUco boards and markers as prints, cell by cell, from OpenCV's own dictionaries."""

from dataclasses import dataclass

import cv2
import numpy as np

from bench.rig.plate import Print


@dataclass(frozen=True)
class Ink:
    """Reflectances of paper and print."""

    white: float = 0.8
    black: float = 0.04


@dataclass(frozen=True)
class Board:
    """A ChArUco board as session.toml names it. Raises ValueError for a dictionary that OpenCV does not know."""

    squares: tuple[int, int]
    square_mm: float
    marker_mm: float
    dictionary: str
    legacy: bool = False
    inverted: bool = False

    def __post_init__(self):
        if not self.dictionary.startswith("DICT_") or not hasattr(cv2.aruco, self.dictionary):
            raise ValueError(f"{self.dictionary!r} is no ArUco dictionary")
        if not 0 < self.marker_mm < self.square_mm:
            raise ValueError("a board's marker is smaller than its square, and both are positive")

    def opencv(self) -> cv2.aruco.CharucoBoard:
        """The board as OpenCV has it."""
        predefined = _dictionary(self.dictionary)
        board = cv2.aruco.CharucoBoard(
            tuple(self.squares), self.square_mm, self.marker_mm, predefined
        )
        board.setLegacyPattern(self.legacy)
        return board

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height."""
        return self.squares[0] * self.square_mm, self.squares[1] * self.square_mm

    @property
    def corners_mm(self) -> np.ndarray:
        """Inner corners in the board frame, (n, 3)."""
        return np.asarray(self.opencv().getChessboardCorners(), float)

    def printed(self, ink: Ink, margin_mm: float) -> Print:
        """The board's print, its coordinates the board frame's, within a white margin."""
        board = self.opencv()
        modules = _dictionary(self.dictionary).markerSize + 2
        gap, module = (self.square_mm - self.marker_mm) / 2, self.marker_mm / modules
        step = np.concatenate([[0], gap + module * np.arange(modules + 1)])
        x, y = (
            np.append(np.add.outer(np.arange(n) * self.square_mm, step), n * self.square_mm)
            for n in self.squares
        )
        dark = np.ones((len(y) - 1, len(x) - 1), bool)
        per = modules + 2
        for marker, place in zip(board.getIds().ravel(), board.getObjPoints()):
            i, j = (int(c // self.square_mm) for c in np.asarray(place)[:, :2].mean(0))
            square = dark[j * per : (j + 1) * per, i * per : (i + 1) * per]
            square[:] = False
            square[1:-1, 1:-1] = _bits(self.dictionary, int(marker)) == 0
        dark = ~dark if self.inverted else dark
        print_ = Print(np.where(dark, ink.black, ink.white), x, y)
        return print_.framed(margin_mm, ink.black if self.inverted else ink.white)


def marker(dictionary: str, number: int, side_mm: float, ink: Ink) -> Print:
    """One marker in a white frame of a seventh of its side, centred on the plate's origin."""
    bits = _bits(dictionary, number)
    edges = np.linspace(-side_mm / 2, side_mm / 2, len(bits) + 1)
    return Print(np.where(bits == 0, ink.black, ink.white), edges, edges).framed(
        side_mm / 7, ink.white
    )


def _dictionary(name):
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


def _bits(dictionary, number):
    predefined = _dictionary(dictionary)
    return cv2.aruco.generateImageMarker(predefined, number, predefined.markerSize + 2)
