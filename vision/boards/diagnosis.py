"""A ChArUco board that is not found: which setting would find it, for the user to enter."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import cv2
import numpy as np

from vision.boards.corners import MIN_CORNERS, detect, to_8_bit
from vision.boards.markers import detect_markers, marker_dictionary

if TYPE_CHECKING:
    from vision.boards.charuco import CharucoBoard

# [1] Share of the board's corners by which a setting is believed. 0.15 to 0.5 name the same causes
# in refusals; it enters no number. Study: tests/vision/boards/test_board_settings.py.
_LEAST_SHARE = 0.3
# [1] And so many times what the setting entered finds. 1.4 to 3 name the same causes. Study:
# tests/vision/boards/test_board_settings.py.
_CLEARLY_MORE = 2.0
# [1] A dictionary may be the one entered wrongly where it shows so large a part of the most
# markers. 0.5 to 0.9 name the same causes in refusals; it enters no number. Study:
# tests/vision/boards/test_board_settings.py.
_NEARLY_MOST = 0.7
# [markers] And that part is more than so many. 1 to 4 name the same causes. Study:
# tests/vision/boards/test_board_settings.py.
_SEVERAL = 2
# [dictionaries] As many are tried with all prints: a bound on time. Stated.
_MOST_DICTIONARIES = 3
# [px] A corner farther from the homography is another thing. 1.5 to 6 name the same causes. Study:
# tests/vision/boards/test_board_settings.py.
_NEAR_PX = 3.0


def why_no_charuco(
    greys: Sequence[np.ndarray], board: "CharucoBoard", *, mirrored: bool = False
) -> str | None:
    """Return a sentence naming the setting that would find the board; None if it is found.

    greys: a few pictures of the board (three to five are enough; 0.1 to 1 s a picture where nothing
    is found). mirrored: whether they were flipped left to right, as seen in a mirror.
    """
    if not greys:
        return "there is no picture of the board"
    share = _corner_share(greys, board)
    if share > _LEAST_SHARE:
        return None
    flipped = [np.ascontiguousarray(grey[:, ::-1]) for grey in greys]
    if _corner_share(flipped, board) > max(_LEAST_SHARE, _CLEARLY_MORE * share):
        return _describe_flip(mirrored)
    settings = _settings(board)
    for candidates in (_other_prints(board), _boards_of_other_dictionaries(greys, board)):
        shares = {candidate: _corner_share(greys, candidate) for candidate in candidates}
        best = max(shares, key=shares.get, default=board)
        if shares.get(best, 0.0) > max(_LEAST_SHARE, _CLEARLY_MORE * share):
            difference = [line for line in _settings(best) if line not in settings]
            return (
                f"the board as entered ({', '.join(settings)}) is not found, but one with "
                f"{', '.join(difference)} is; if that is the board in the pictures, enter it"
            )
    return None if share > 0 else _describe_markers(greys, board)


def _describe_flip(mirrored: bool) -> str:
    """Return the sentence for a board that is found left to right alone; mirrored: as it is stated."""
    seen = "not in a mirror" if mirrored else "in a mirror"
    return (
        f"the board is found flipped left to right alone, so it is seen {seen}: set mirrored = "
        f"{str(not mirrored).lower()} under [[cameras]], with of and crop"
    )


def _corner_share(greys: Sequence[np.ndarray], board: "CharucoBoard") -> float:
    """Return the mean share of the board's corners that OpenCV finds and that lie as on a plane."""
    counts = [_count_corners(grey, board) for grey in greys]
    return float(np.mean(counts) / len(board.corners_mm))


def _count_corners(grey: np.ndarray, board: "CharucoBoard") -> int:
    """Count the corners on one homography: a wrong layout finds some, at the wrong places."""
    ids, px = detect(grey, board)
    if len(ids) < MIN_CORNERS + 2:
        return 0
    squares = board.corners_mm[ids, :2] / board.square_mm
    H, is_near = cv2.findHomography(squares, px, cv2.RANSAC, _NEAR_PX)
    return 0 if H is None else int(is_near.sum())


def _other_prints(board: "CharucoBoard") -> list["CharucoBoard"]:
    """Return the boards that people mix up first: inverted, legacy, columns for rows."""
    prints = []
    for inverted, legacy in product((False, True), repeat=2):
        for squares in dict.fromkeys((board.squares, board.squares[::-1])):
            prints.append(replace(board, inverted=inverted, legacy=legacy, squares=squares))
    return [other for other in prints if other != board]


def _boards_of_other_dictionaries(
    greys: Sequence[np.ndarray], board: "CharucoBoard"
) -> Iterator["CharucoBoard"]:
    """Yield the board in each other dictionary whose markers are seen, in all prints.

    The dictionaries are those of which several markers are seen, the smallest of each kind that
    holds the board's markers.
    """
    counts = {}
    for name in sorted(dir(cv2.aruco)):
        if name.startswith("DICT_") and "APRILTAG" not in name and name != board.dictionary:
            counts[name] = _count_markers(greys, name)
    least = _NEARLY_MOST * max(counts.values(), default=0)
    if least <= _SEVERAL:
        return
    sizes = {}
    for name, count in counts.items():
        size = len(marker_dictionary(name).bytesList)
        if count > least and size >= board.spare_markers[1]:
            sizes[name] = size
    for name in sorted(sizes, key=sizes.get)[:_MOST_DICTIONARIES]:
        entered = replace(board, dictionary=name)
        yield entered
        yield from _other_prints(entered)


def _count_markers(greys: Sequence[np.ndarray], dictionary: str) -> float:
    """Return how many markers of a dictionary are seen in a picture, on average."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.detectInvertedMarker = True
    counts = []
    for grey in greys:
        numbers, _ = detect_markers(to_8_bit(grey), dictionary, parameters)
        counts.append(len(numbers))
    return float(np.mean(counts))


def _describe_markers(greys: Sequence[np.ndarray], board: "CharucoBoard") -> str:
    """Return a sentence on what is seen of the board's dictionary where no setting finds it."""
    count = _count_markers(greys, board.dictionary)
    if count < 1:
        return (
            f"no marker of {board.dictionary} is seen, nor of another dictionary in that number: "
            "is this the board?"
        )
    return (
        f"{count:.0f} markers of {board.dictionary} are seen a picture, but not laid out as on a "
        f"board of {board.squares[0]} x {board.squares[1]} squares: check squares, legacy, the first "
        "marker's number and the printed board"
    )


def _settings(board: "CharucoBoard") -> list[str]:
    """Return the board's settings as lines of session.toml."""
    return [
        f"squares = {list(board.squares)}",
        f'dictionary = "{board.dictionary}"',
        f"legacy = {str(board.legacy).lower()}",
        f"inverted = {str(board.inverted).lower()}",
    ]
