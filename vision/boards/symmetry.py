"""How a board may be turned or mirrored onto itself, and which labels its points so may have."""

from functools import lru_cache

import numpy as np

from vision.geometry.board import Board

# [1] Of the board's half size: points nearer than this are one. Rounding. Derived.
_SAME = 1e-6


def turns_onto_itself(board: Board) -> tuple[np.ndarray, ...]:
    """Return the ids (m,) of a board's points as they are after each turn in its plane that puts
    its points onto its points, no turn first.
    """
    return _symmetries(board)[0]


@lru_cache(maxsize=32)
def _symmetries(board: Board) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]:
    """Return the ids (m,) after each quarter turn and after each mirroring that the points allow."""
    centred = _centred(board)
    quarter = np.array([[0, -1], [1, 0]])
    mirror = np.diag([-1, 1])
    kinds = []
    for first in (np.eye(2), mirror):
        found = []
        for turns in range(4):
            moved = centred @ (np.linalg.matrix_power(quarter, turns) @ first).T
            distance = np.linalg.norm(centred[:, None] - moved, axis=2)
            if distance.min(axis=1).max() < _SAME:
                found.append(distance.argmin(axis=1))
        kinds.append(tuple(found))
    return kinds[0], kinds[1]


def _centred(board: Board) -> np.ndarray:
    """Return the board's points (m, 2) about its middle, in units of half its diagonal."""
    flat = board.corners_mm[:, :2]
    low = flat.min(axis=0)
    high = flat.max(axis=0)
    return (flat - 0.5 * (low + high)) / (0.5 * np.linalg.norm(high - low))


def possible_labels(px: np.ndarray, board: Board) -> list[np.ndarray]:
    """Return the places px (m, 2) that OpenCV found, in each order that may be that of the board's ids.

    Orders differ by turns that the print allows; none is one of a mirrored board.
    """
    turned, mirrored = _symmetries(board)
    as_seen = _handedness(px, board) * _handedness(board.corners_mm[:, :2], board)
    return [px[order] for order in (turned if as_seen > 0 else mirrored)]


def _handedness(points: np.ndarray, board: Board) -> float:
    """Return the sign of the turn from a board's rows to its columns, by its points (m, 2)."""
    columns, rows = board.grid
    grid = points.reshape(rows, columns, 2)
    row_x, row_y = (grid[:, -1] - grid[:, 0]).mean(axis=0)
    column_x, column_y = (grid[-1] - grid[0]).mean(axis=0)
    return float(np.sign(row_x * column_y - row_y * column_x))


def upper_left_first(candidates: list[np.ndarray]) -> np.ndarray:
    """Return the places (m, 2) px of which the first lies highest and most to the left."""
    return min(candidates, key=lambda px: float(px[0].sum()))
