"""A board that is not found: which setting would find it, for the user to enter. Nothing is gone on with by itself."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import cv2
import numpy as np

from vision.boards.corners import MIN_CORNERS, detect, to_8_bit
from vision.geometry.board import Board

# [1] Share of the board's corners by which a setting is believed. Set by eye: chance finds none,
# a sound view all; names a cause in a refusal, enters no number. Study:
# tests/vision/boards/test_board_settings.py.
_LEAST_SHARE = 0.3
# [1] And so many times what the setting entered finds. Set by eye, as above. Study:
# tests/vision/boards/test_board_settings.py.
_CLEARLY_MORE = 2.0
# [1, markers] A dictionary may be the one entered wrongly where it shows so large a part of the
# most markers, and more than so many. Set by eye.
_NEARLY_MOST, _SEVERAL = 0.7, 2


def why_not_found(greys: Sequence[np.ndarray], board: Board) -> str | None:
    """What is wrong with the board as entered, in a sentence naming the setting that works; None if it is well found.

    greys: a few pictures of the board (three to five are enough; 0.1 to 1 s a picture where nothing is found).
    """
    if not greys:
        return "there is no picture of the board"
    entered = corner_share(greys, board)
    if entered > _LEAST_SHARE:
        return None
    for candidates in (_other_print(board), _other_dictionary(greys, board)):
        best, share = _best(greys, candidates)
        if share > max(_LEAST_SHARE, _CLEARLY_MORE * entered):
            return (
                f"the board as entered ({_named(board)}) is not found, but one with {_difference(board, best)} is; "
                "if that is the board in the pictures, enter it"
            )
    return None if entered > 0 else _what_is_there(greys, board)


def corner_share(greys: Sequence[np.ndarray], board: Board) -> float:
    """Mean share of the board's corners that OpenCV finds and that lie as on a plane."""
    return float(np.mean([_plausible_count(grey, board) for grey in greys]) / len(board.corners_mm))


def _plausible_count(grey: np.ndarray, board: Board) -> int:
    """Corners on one homography: with a wrong layout some are found, at the wrong places."""
    ids, px = detect(grey, board)
    if len(ids) < MIN_CORNERS + 2:
        return 0
    squares = board.corners_mm[ids, :2] / board.square_mm
    H, good = cv2.findHomography(squares, px, cv2.RANSAC, 3.0)
    return 0 if H is None else int(good.sum())


def _best(greys: Sequence[np.ndarray], boards: Iterable[Board]) -> tuple[Board | None, float]:
    shares = [(board, corner_share(greys, board)) for board in boards]
    return max(shares, key=lambda candidate: candidate[1], default=(None, 0.0))


def _other_print(board: Board) -> list[Board]:
    """What people mix up first: inverted, legacy, columns for rows."""
    turned = dict.fromkeys((board.squares, board.squares[::-1]))
    variants = [
        replace(board, inverted=inverted, legacy=legacy, squares=squares)
        for inverted in (False, True)
        for legacy in (False, True)
        for squares in turned
    ]
    return [variant for variant in variants if variant != board]


def _other_dictionary(greys: Sequence[np.ndarray], board: Board) -> Iterable[Board]:
    """The dictionaries whose markers are seen, with the print as entered and otherwise."""
    for dictionary in _dictionaries_seen(greys, board):
        entered = replace(board, dictionary=dictionary)
        yield from (entered, *_other_print(entered))


def _dictionaries_seen(greys: Sequence[np.ndarray], board: Board) -> list[str]:
    """Dictionaries of which several markers are seen, the smallest of each kind that holds the board's markers."""
    counts = {
        name: _marker_count(greys, name) for name in _dictionaries() if name != board.dictionary
    }
    most = max(counts.values(), default=0)
    plain = [name for name, count in counts.items() if count > _NEARLY_MOST * most > _SEVERAL]
    return sorted((name for name in plain if _size(name) >= board.marker_count), key=_size)[:3]


def _dictionaries() -> list[str]:
    return sorted(n for n in dir(cv2.aruco) if n.startswith("DICT_") and "APRILTAG" not in n)


def _size(dictionary: str) -> int:
    return len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary)).bytesList)


def _marker_count(greys: Sequence[np.ndarray], dictionary: str) -> float:
    parameters = cv2.aruco.DetectorParameters()
    parameters.detectInvertedMarker = True
    predefined = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    detector = cv2.aruco.ArucoDetector(predefined, parameters)
    ids = [detector.detectMarkers(to_8_bit(grey))[1] for grey in greys]
    return float(np.mean([0 if i is None else len(i) for i in ids]))


def _what_is_there(greys: Sequence[np.ndarray], board: Board) -> str:
    count = _marker_count(greys, board.dictionary)
    if count < 1:
        return f"no marker of {board.dictionary} is seen, nor of another dictionary in that number: is this the board?"
    return (
        f"{count:.0f} markers of {board.dictionary} are seen a picture, but not laid out as on a board of "
        f"{board.squares[0]} x {board.squares[1]} squares: check squares, legacy and the printed board"
    )


def _named(board: Board) -> str:
    return ", ".join(f"{key} = {value}" for key, value in _settings(board).items())


def _difference(entered: Board, other: Board) -> str:
    before = _settings(entered)
    return ", ".join(
        f"{key} = {value}" for key, value in _settings(other).items() if before[key] != value
    )


def _settings(board: Board) -> dict[str, str]:
    """As session.toml has them."""
    return {
        "squares": str(list(board.squares)),
        "dictionary": f'"{board.dictionary}"',
        "legacy": str(board.legacy).lower(),
        "inverted": str(board.inverted).lower(),
    }
