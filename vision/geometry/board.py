"""The printed board: points in a plane, or on the flat faces of a body, which cameras are calibrated by."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from vision.geometry.checks import require, require_length, require_sigma

# How a print differs from the stated board: its mean square's relative size less 1, the share by
# which it is longer along y than along x, and its warps.
PRINT_TERMS = ("scale", "stretch", "warp_x_mm", "warp_y_mm")
# [mm] By which a point lies beside its place, per axis, before its board is seen: rows of a laser
# print, and paper that is glued on, err by 0.02. Study: real_cube.py.
POINT_SIGMA_MM = 0.03


@dataclass(frozen=True)
class Board(ABC):
    """A board whose points lie in rows; what is printed there, and how it is found, a kind says.

    squares: cells (along x, along y). square_mm: side of one. square_sigma_mm: of the mean square.
    stretch_sigma: of the share by which the print is longer along y than along x. What has a sigma
    of 0 is exact. Raises Refused for a board that cannot be.
    """

    squares: tuple[int, int]
    square_mm: float
    square_sigma_mm: float = field(default=0.0, kw_only=True)
    stretch_sigma: float = field(default=0.0, kw_only=True)

    # The kind's name in session.toml.
    kind: str = field(init=False)

    def __post_init__(self):
        """Raise Refused for counts or lengths that cannot be."""
        object.__setattr__(self, "squares", tuple(int(n) for n in self.squares))
        require(
            len(self.squares) == 2 and min(self.squares) >= 2,
            f"board squares = {list(self.squares)}: two counts, each 2 or more",
        )
        require_length("board", square_mm=self.square_mm)
        require_sigma(
            "board", square_sigma_mm=self.square_sigma_mm, stretch_sigma=self.stretch_sigma
        )

    @property
    @abstractmethod
    def grid(self) -> tuple[int, int]:
        """Return the number of points in a row, and of rows."""

    @cached_property
    @abstractmethod
    def corners_mm(self) -> np.ndarray:
        """Return the points in the board frame, (m, 3), row by row; the index is the point's id."""

    @property
    def flat_mm(self) -> np.ndarray:
        """Return the points in the plane of the face that each is printed on, (m, 3), z = 0."""
        return self.corners_mm

    @cached_property
    def face_of(self) -> np.ndarray:
        """Return the number of the flat face that each point is printed on, (m,)."""
        return np.zeros(len(self.flat_mm), dtype=int)

    @property
    def shape_sigma(self) -> np.ndarray:
        """Return how far the parameters of the shape are from 0, (s,): none of a plane."""
        return np.zeros(0)

    @property
    def point_sigma_mm(self) -> float:
        """Return how far each point lies from its place on its face, per axis, before it is seen."""
        return POINT_SIGMA_MM

    @property
    def stated_terms(self) -> np.ndarray:
        """Return the terms of the board as stated, all 0: of its shape, then PRINT_TERMS, (s + 4,)."""
        return np.zeros(len(self.shape_sigma) + len(PRINT_TERMS))

    def printed(self, terms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the points as they are (m, 3), mm, and their derivatives by the terms
        (m, 3, s + 4).

        terms (s + 4,): parameters of the shape, then PRINT_TERMS.
        """
        return printed_corners(self.corners_mm, terms)

    @property
    def neighbours(self) -> np.ndarray:
        """Return the ids of points that are neighbours in a row or a column of a face, (p, 2)."""
        columns, rows = self.grid
        ids = np.arange(columns * rows).reshape(rows, columns)
        left = ids[:, :-1].ravel()
        right = ids[:, 1:].ravel()
        upper = ids[:-1].ravel()
        lower = ids[1:].ravel()
        in_rows = np.column_stack([left, right])
        in_columns = np.column_stack([upper, lower])
        return np.concatenate([in_rows, in_columns])

    @property
    def hidden_turns(self) -> tuple[np.ndarray, ...]:
        """Return the ids (m,) of the points after each turn of the board that no picture shows."""
        return ()

    @property
    def is_white_on_black(self) -> bool:
        """Return whether the board, and markers with it, are printed white on black."""
        return False

    @property
    def spare_markers(self) -> tuple[str, int]:
        """Return a dictionary of markers, and the first number that the board does not use."""
        return "DICT_5X5_100", 0

    @abstractmethod
    def detect(self, picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ids (n,) and places (n, 2) px of the points in a picture of 8 bits, as OpenCV
        finds them; both empty where it does not.
        """

    @abstractmethod
    def refine(self, grey: np.ndarray, px_guess: np.ndarray, ids: np.ndarray) -> "Corners":  # noqa: F821
        """Fit the points `ids` (n,) near known places px_guess (n, 2) to a grey picture; return
        `vision.boards.Corners` of those that are neither hidden nor disturbed.
        """

    def cut(self, grey: np.ndarray, px: np.ndarray, ids: np.ndarray) -> tuple | None:
        """Return the pixels about crossing edges at points (n, 2) px and a frame at each; None where
        the board has no such edges, or too few are seen.
        """
        return None

    @abstractmethod
    def why_not_found(self, greys: list[np.ndarray], *, mirrored: bool = False) -> str | None:
        """Return a sentence on why the board is not found in some grey pictures; None if it is.

        mirrored: whether they were flipped left to right, as seen in a mirror.
        """

    def check_print(self, greys: list[np.ndarray]) -> None:  # noqa: B027
        """Raise Refused where a second known length on the board contradicts the pictures."""


def grid_mm(x_mm: np.ndarray, y_mm: np.ndarray) -> np.ndarray:
    """Return the points (n m, 3) of a grid with columns at x_mm (n,) and rows at y_mm (m,)."""
    x_grid, y_grid = np.meshgrid(x_mm, y_mm)
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
