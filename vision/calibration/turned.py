"""Boards that are the same after a turn: their points named alike in all cameras.

Each camera names the points from the upper left of its own picture. Where cameras saw the board at
once, their place relative to each other is the same in all views with the right names, and another
one in every view with wrong ones.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np

from vision.boards.corners import Corners
from vision.boards.sufficiency import MIN_VIEWS, fixes_pose, usable_views
from vision.calibration.first_guess import board_pose, first_lens, transform_distances, with_pose
from vision.calibration.one_picture import calibrate_alone
from vision.calibration.views import BoardViews
from vision.geometry.board import Board
from vision.geometry.refusals import Refused
from vision.geometry.rotation import compose, invert_transform

# [rad] Median over the views by which a place of one camera before another may differ between views
# of one instant: half of what `layout` takes for one instant. Stated.
_SAME = 0.1
# [1] The best place must agree so many times better than one by other names. Stated.
_CLEARLY_BETTER = 2.0
ViewsOf = TypeVar("ViewsOf", bound=BoardViews)


def with_turns_resolved(views: ViewsOf, board: Board) -> ViewsOf:
    """Return the views with points of the board named in each camera as in the first.

    Cameras that did not see the board at once keep their names. Raises Refused where the board was
    never turned enough for names to show.
    """
    names = list(views.boards)
    if not board.hidden_turns or len(names) < 2:
        return views
    turns = (np.arange(len(board.corners_mm)), *board.hidden_turns)
    sight = {name: _Sight(views, name, board, turns) for name in names}
    first = sight[names[0]]
    for name in names[1:]:
        choice = _choose(first, sight[name], name)
        if choice is None:
            continue
        T_other_first, turn_of = choice
        views = _with_boards_renamed(
            views, name, [turns[turn_of.get(k, 0)] for k in range(len(views.boards[name]))]
        )
        if name in views.rig and names[0] in views.rig:
            turn = _nearest(first.rig_poses, sight[name].rig_poses, T_other_first)
            views = _with_rig_renamed(views, name, turns[turn])
    return views


def _with_boards_renamed(views: ViewsOf, name: str, orders: Sequence[np.ndarray]) -> ViewsOf:
    """Return the views with the points of each of a camera's board views in an order of its own."""
    boards = views.boards[name]
    renamed = [_renamed(view, order) for view, order in zip(boards, orders, strict=True)]
    return replace(views, boards={**views.boards, name: renamed})


def _with_rig_renamed(views: ViewsOf, name: str, order: np.ndarray) -> ViewsOf:
    """Return the views with the points of the board on the rig in one order, in a camera's trials too."""
    rig = {**views.rig, name: _renamed(views.rig[name], order)}
    in_trials = [_renamed(view, order) for view in views.trials.get(name, ())]
    return replace(views, rig=rig, trials={**views.trials, name: in_trials})


class _Sight:
    """One camera's poses of the board, T_camera_board (turns, 3, 4), by view and on the rig."""

    def __init__(
        self, views: BoardViews, name: str, board: Board, turns: Sequence[np.ndarray]
    ) -> None:
        """Calibrate the camera by itself, which needs no right names."""
        usable = usable_views(views.boards[name], board)
        size_px = views.sizes_px[name]
        lens = first_lens(list(usable.values()), board.corners_mm, size_px)
        seen = with_pose(usable, board.corners_mm, lens)
        if len(seen) >= MIN_VIEWS:
            adjusted = calibrate_alone(list(seen.values()), board, size_px)
            lens = adjusted.solution.state.lens[0]

        poses = partial(_poses, board=board, lens=lens, turns=turns)
        self.poses: Mapping[int, np.ndarray] = {k: poses(view) for k, view in seen.items()}
        on_rig = views.rig.get(name, Corners.none())
        self.rig_poses = poses(on_rig) if fixes_pose(on_rig, board) else None


def _poses(
    view: Corners, board: Board, lens: np.ndarray, turns: Sequence[np.ndarray]
) -> np.ndarray:
    """Return T_camera_board (turns, 3, 4) of a view, with the board's points named by each turn."""
    named = [_renamed(view, turn) for turn in turns]
    return np.array([board_pose(view, board.corners_mm, lens) for view in named])


def _renamed(view: Corners, turn: np.ndarray) -> Corners:
    """Return a view's points under their names after a turn."""
    return replace(view, ids=turn[view.ids])


def _candidates(first: _Sight, other: _Sight, shared: Sequence[int]) -> np.ndarray:
    """Return T_other_first (views, turns, 3, 4) by each shared view and each turn of the board in it."""
    candidates = []
    for k in shared:
        T_first_board = invert_transform(first.poses[k][0])
        candidates.append([compose(pose, T_first_board) for pose in other.poses[k]])
    return np.array(candidates)


def _check_unambiguous(score: float, rivals: np.ndarray, name: str) -> None:
    """Raise Refused where another pose of the camera has a score (n,) that is not clearly worse."""
    if len(rivals) and rivals.min() < _CLEARLY_BETTER * score:
        raise Refused(
            f"camera {name}: the board looks the same after a turn, and its views do not tell which way round it was: "
            "turn and tilt it more between views, or take a board with an odd number of squares one way and an even "
            "one the other"
        )


def _choose(first: _Sight, other: _Sight, name: str) -> tuple[np.ndarray, dict[int, int]] | None:
    """Return T_other_first (3, 4), and the turn of each view of the other camera; None where they
    saw the board each at a time of its own.
    """
    shared = sorted(first.poses.keys() & other.poses.keys())
    if len(shared) < MIN_VIEWS:
        return None
    candidates = _candidates(first, other, shared)  # (views, turns, 3, 4)
    flat = candidates.reshape(-1, 3, 4)
    distance = transform_distances(flat, flat).reshape(len(flat), *candidates.shape[:2])
    score = np.median(distance.min(axis=2), axis=1)  # (views * turns,)
    best = int(np.argmin(score))
    if score[best] > _SAME:
        return None
    _check_unambiguous(score[best], score[distance[best].ravel() > _SAME], name)
    turn_of = dict(zip(shared, distance[best].argmin(axis=1).tolist()))
    return flat[best], turn_of


def _nearest(first: np.ndarray | None, other: np.ndarray | None, T_other_first: np.ndarray) -> int:
    """Return the turn by which another camera's board on the rig stands as the first one's does."""
    if first is None or other is None:
        return 0
    expected = compose(T_other_first, first[0])
    return int(transform_distances(expected[None], other)[0].argmin())
