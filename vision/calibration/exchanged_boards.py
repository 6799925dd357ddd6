"""Whether each camera's board views are its own: its lens must explain its picture of the rig board.

Boards exchanged between two cameras give each the other's lens, and all views agree with
themselves. The board on the rig is a plane seen in perspective: a lens whose focal length,
principal point or distortion is another's leaves residuals that no pose of it takes up.
"""

from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from vision.boards.corners import Corners
from vision.calibration.adjust import adjust_bundle
from vision.calibration.bundle import BundleState
from vision.calibration.first_guess import board_pose
from vision.calibration.layout import Alone, gather
from vision.calibration.priors import pose_priors
from vision.geometry.board import Board
from vision.geometry.refusals import Refused

# [1] Residuals by the camera's own lens over those by another's, in each picture. What is wrong with
# the right lens would have to point so far towards the other one, in both pictures, as directions in
# the nine dimensions of lenses do once in 20 000. Lenses 4 % apart have 3 and more in one picture, 12
# and 20 in the small session's. Derived; study: exchanged_boards.py.
_CLEAR_RATIO = 1.5


def check_own_lenses(
    cameras: Mapping[str, Alone],
    standing: Mapping[str, Corners],
    board: Board,
    *,
    same_in_trials: bool,
) -> list[str]:
    """Return a note on each pair of cameras whose lenses are too much alike for the check.

    standing: the board on the rig in each camera. same_in_trials: whether the trials' frames show
    it as these pictures do. Raises Refused, naming the cameras, where other lenses explain the
    pictures of two or more cameras clearly better than their own.
    """
    lenses = {name: alone.lens for name, alone in cameras.items()}
    residual_px = lens_residuals_px(lenses, standing, board)
    folders = {name: f"boards/{name}" for name in cameras}
    exchange = _exchange(residual_px, folders)
    if exchange is not None:
        pictures = "" if same_in_trials else ", or their pictures in boards/rig,"
        found = f"{exchange.whose}{pictures} are exchanged: {exchange.fits}"
        raise Refused(f"{found}: give each camera its own", "boards_exchanged")
    return _notes_on_alike(list(folders.values()), residual_px)


def check_imported_lenses(
    lenses: Mapping[str, np.ndarray], standing: Mapping[str, Corners], board: Board
) -> None:
    """Raise Refused, naming the cameras, where the lenses of a file are exchanged.

    lenses: of each camera, (9,). standing: the board on the rig in each.
    """
    residual_px = lens_residuals_px(lenses, standing, board)
    exchange = _exchange(residual_px, {name: name for name in lenses})
    if exchange is not None:
        found = f"the lenses of {exchange.whose} are exchanged: {exchange.fits}"
        raise Refused(found, "boards_exchanged")


class _Exchange(NamedTuple):
    """Whose lenses are exchanged, and how well pictures are fitted by them: parts of sentences."""

    whose: str
    fits: str


def _exchange(residual_px: np.ndarray, lenses: Mapping[str, str]) -> _Exchange | None:
    """Return which cameras' lenses are exchanged; None where none are.

    residual_px (C, C): of each camera's view by each lens. lenses: what each camera's is called.
    """
    names = list(lenses)
    called = list(lenses.values())
    better = _better_lenses(residual_px)
    if not better:
        return None
    fits = []
    for own, other in better.items():
        fits.append(
            f"camera {names[own]}'s picture of the board on the rig by the lens of {called[other]} "
            f"to {residual_px[own, other]:.3f} px, by that of {called[own]} to {residual_px[own, own]:.3f} px"
        )
    return _Exchange(" and ".join(called[k] for k in better), "; ".join(fits))


def _better_lenses(residual_px: np.ndarray) -> dict[int, int]:
    """Return by camera the other one whose lens explains its picture, where all of these do so clearly better.

    residual_px (C, C): of each camera's view by each lens.
    """
    own, best = linear_sum_assignment(np.log(residual_px))
    moved = best != own
    is_clear = np.diag(residual_px) > _CLEAR_RATIO * residual_px[own, best]
    return dict(zip(own[moved], best[moved])) if np.all(is_clear[moved]) else {}


def _notes_on_alike(folders: list[str], residual_px: np.ndarray) -> list[str]:
    """Return a note on each pair of cameras whose lenses explain each other's picture as well.

    folders: of the cameras' boards. residual_px (C, C): of each camera's view by each lens.
    """
    notes = []
    for a, b in combinations(range(len(folders)), 2):
        if _are_alike(residual_px[np.ix_([a, b], [a, b])]):
            notes.append(
                f"The board on the rig does not tell whether {folders[a]} and {folders[b]} are exchanged: "
                "the two lenses are too much alike."
            )
    return notes


def lens_residuals_px(
    lenses: Mapping[str, np.ndarray], standing: Mapping[str, Corners], board: Board
) -> np.ndarray:
    """Return the root mean square residual an axis of each camera's view (C, ) by each lens (, C).

    lenses: of each camera, (9,). Each fit has a board pose of its own; infinite where a lens gives
    none.
    """
    residual_px = np.empty((len(lenses), len(lenses)))
    for row, name in enumerate(lenses):
        for column, lens in enumerate(lenses.values()):
            residual_px[row, column] = _residual_px(lens, standing[name], board)
    return residual_px


def _are_alike(residual_px: np.ndarray) -> bool:
    """Return whether two lenses explain two pictures (2, 2) nearly as well when exchanged."""
    exchanged = residual_px[0, 1] * residual_px[1, 0]
    return bool(exchanged < _CLEAR_RATIO**2 * residual_px[0, 0] * residual_px[1, 1])


def _residual_px(lens: np.ndarray, view: Corners, board: Board) -> float:
    """Return the root mean square residual an axis of a view by a lens, px, with a pose fitted."""
    try:
        T_camera_board = board_pose(view, board.corners_mm, lens)
    except Refused:
        return np.inf
    state = BundleState(lens[None], np.eye(3, 4)[None], T_camera_board[None], board.stated_terms)
    fitted = adjust_bundle(state, gather([(0, 0, view)]), board, pose_priors(1, 1, board))
    return float(np.sqrt(np.mean(fitted.residual_px**2)))
