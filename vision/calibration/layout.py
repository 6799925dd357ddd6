"""Which camera saw the board where and when: views laid out for one adjustment, and its start.

Board views are each camera's own, or shared where all cameras saw the board at one instant. The
board standing on the rig, where there is one, is view 0 and shared by all.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from vision.boards.corners import Corners
from vision.calibration.board_motion import Trajectory
from vision.calibration.bundle import BundleState, Sightings
from vision.calibration.first_guess import (
    board_pose,
    chain_cameras,
    most_central,
    relative_poses,
)
from vision.geometry.board import Board
from vision.geometry.refusals import Refused
from vision.geometry.rotation import angle_between, compose, invert_transform

# [rad] Views that have nothing to do with each other agree as loosely as this and the next once
# in a hundred. Derived.
_SAME_TURN_RAD = np.radians(10.0)
# [1] Share of the distance; see above. Derived.
_SAME_SHIFT = 0.1
# [1] Most views of one index must agree. Origin not known beyond *most*. Study: cameras.py.
_SAME_SHARE = 0.6
# [views] Fewer views of one index give no share. Origin not known. Study: cameras.py.
_MIN_SHARED = 5


@dataclass(frozen=True, eq=False)
class Alone:
    """One camera by itself.

    lens (9,). error_px: model error. views, poses: by view index its usable views and
    T_camera_board (3, 4).
    """

    lens: np.ndarray
    error_px: float
    views: Mapping[int, Corners]
    poses: Mapping[int, np.ndarray]


@dataclass(frozen=True, eq=False)
class Layout:
    """All views of all cameras, for one adjustment.

    seen: all corners. first: the state to start from. trajectory: the views in time; None where
    views are not shared. index (V,): of each view in its camera's series, -1 for the board on the
    rig.
    """

    seen: Sightings
    first: BundleState
    trajectory: Trajectory | None
    index: np.ndarray


class _Shot(NamedTuple):
    """A camera's picture of the board: the camera's number, the view's index in its series.

    On the rig, where pose and time are given otherwise, index is -1.
    """

    camera: int
    index: int
    corners: Corners
    T_camera_board: np.ndarray | None = None
    time_s: float = np.nan


def saw_board_at_once(cameras: Mapping[str, Alone]) -> bool:
    """Return whether views of one index are of one instant, to within a hand's motion.

    Else they are each camera's own series.
    """
    shares = []
    for a, b in combinations(cameras.values(), 2):
        relative = relative_poses(a.poses, b.poses)
        if len(relative) >= _MIN_SHARED:
            distances = [T[:, 3] for T in (*a.poses.values(), *b.poses.values())]
            distance_mm = float(np.median(np.linalg.norm(distances, axis=1)))
            shares.append(_share_in_agreement(np.array(relative), distance_mm))
    return bool(shares) and float(np.median(shares)) >= _SAME_SHARE


def _share_in_agreement(relative: np.ndarray, distance_mm: float) -> float:
    """Return the share of the transforms (n, 3, 4) that agree with the most central one.

    distance_mm: of the boards, to which shifts are compared.
    """
    centre = most_central(relative)
    turn = angle_between(relative[:, :, :3], centre[:, :3])
    shift_mm = np.linalg.norm(relative[:, :, 3] - centre[:, 3], axis=1)
    return float(np.mean((turn < _SAME_TURN_RAD) & (shift_mm < _SAME_SHIFT * distance_mm)))


def lay_out(
    cameras: Mapping[str, Alone],
    T_camera_world: np.ndarray,
    *,
    standing: Mapping[str, Corners] | None = None,
    T_rig_board: np.ndarray | None = None,
    together: bool,
    times_s: Mapping[str, Sequence[float]] | None = None,
) -> Layout:
    """Return a table of all corners, and the first state, for cameras at T_camera_world (C, 3, 4).

    standing: the board on the rig, where there is one. together: views of one index are of one
    instant, or of times_s[camera][index] where given.
    """
    views = _group_shots(cameras, together, times_s if together else None)
    T_world_board = [_world_pose(group, T_camera_world) for group in views]
    if standing is not None:
        views.insert(0, [_Shot(c, -1, standing[name]) for c, name in enumerate(cameras)])
        T_world_board.insert(0, T_rig_board)
    state = _first_state(cameras, T_camera_world, T_world_board)
    index = np.array([group[0].index for group in views])
    trajectory = elapsed_s = None
    if together:
        trajectory, elapsed_s = _in_time(views, _rank_by_views(cameras))
    return Layout(gather(_numbered(views), elapsed_s), state, trajectory, index)


def _first_state(
    cameras: Mapping[str, Alone], T_camera_world: np.ndarray, T_world_board: Sequence[np.ndarray]
) -> BundleState:
    """Return the state with each camera's own lens at T_camera_world (C, 3, 4), boards at V poses."""
    lenses = np.array([alone.lens for alone in cameras.values()])
    return BundleState(lenses, np.asarray(T_camera_world), np.array(T_world_board))


def _numbered(views: Sequence[Sequence[_Shot]]) -> list[tuple[int, int, Corners]]:
    """Return camera, view and corners of all shots."""
    shots = []
    for view, group in enumerate(views):
        shots += [(shot.camera, view, shot.corners) for shot in group]
    return shots


def _rank_by_views(cameras: Mapping[str, Alone]) -> np.ndarray:
    """Return the rank (C,) of each camera, 0 for the one with most views."""
    counts = [-len(alone.views) for alone in cameras.values()]
    return np.argsort(np.argsort(counts, kind="stable"))


def _group_shots(
    cameras: Mapping[str, Alone],
    together: bool,
    times_s: Mapping[str, Sequence[float]] | None,
) -> list[list[_Shot]]:
    """Group the shots of all cameras to views: one an index, or each its own.

    Indices stand for times where none are given.
    """
    groups: dict[tuple[int, ...], list[_Shot]] = {}
    for c, (name, alone) in enumerate(cameras.items()):
        for k, corners in alone.views.items():
            time_s = float(times_s[name][k] if times_s else k)
            shot = _Shot(c, k, corners, alone.poses[k], time_s)
            groups.setdefault((k,) if together else (c, k), []).append(shot)
    return [groups[key] for key in sorted(groups)]


def _world_pose(group: Sequence[_Shot], T_camera_world: np.ndarray) -> np.ndarray:
    """Return T_world_board (3, 4) of a view, by the shot with most corners."""
    best = max(group, key=lambda shot: len(shot.corners))
    return compose(invert_transform(T_camera_world[best.camera]), best.T_camera_board)


def _in_time(
    views: Sequence[Sequence[_Shot]], camera_rank: np.ndarray
) -> tuple[Trajectory, list[float]]:
    """Return the views in time, and of each shot its time after its view's own time, s.

    A view's own time is that of the picture whose camera ranks first.
    """
    view_time_s = []
    elapsed_s = []
    for group in views:
        reference = min(group, key=lambda shot: camera_rank[shot.camera])
        view_time_s.append(reference.time_s)
        for shot in group:
            elapsed_s.append(0.0 if shot.index < 0 else shot.time_s - reference.time_s)
    return Trajectory(np.array(view_time_s), camera_rank), elapsed_s


def place_cameras(
    cameras: Mapping[str, Alone],
    standing: Mapping[str, Corners] | None,
    board: Board,
    T_rig_board: np.ndarray | None,
    *,
    together: bool,
) -> np.ndarray:
    """Return T_camera_world (C, 3, 4) to begin with.

    The world is the rig frame, or the first camera's without a board on the rig. Raises Refused
    where cameras cannot be placed relative to each other.
    """
    if standing is not None:
        lenses = {name: alone.lens for name, alone in cameras.items()}
        return place_before_rig(lenses, standing, board, T_rig_board)
    if len(cameras) > 1 and not together:
        raise Refused(
            "no picture shows the board on the rig, nor do the cameras see it at once in views of one number, so "
            "they cannot be placed in one frame: record the one or the other"
        )
    chained = chain_cameras({name: alone.poses for name, alone in cameras.items()})
    return np.array([chained[name] for name in cameras])


def place_before_rig(
    lenses: Mapping[str, np.ndarray],
    standing: Mapping[str, Corners],
    board: Board,
    T_rig_board: np.ndarray,
) -> np.ndarray:
    """Return T_camera_rig (C, 3, 4) of cameras by their lenses (9,), each by the board on the rig."""
    T_board_rig = invert_transform(T_rig_board)
    poses = []
    for name, lens in lenses.items():
        T_camera_board = board_pose(standing[name], board.corners_mm, lens)
        poses.append(compose(T_camera_board, T_board_rig))
    return np.array(poses)


def gather(
    shots: Sequence[tuple[int, int, Corners]], times_s: Sequence[float] | None = None
) -> Sightings:
    """Return the sightings of shots (camera, view, corners).

    times_s: of each shot, after its view's own time; None for 0.
    """
    if times_s is None:
        times_s = np.zeros(len(shots))
    order = sorted(range(len(shots)), key=lambda k: (shots[k][1], shots[k][0]))
    cameras, views, corners = zip(*(shots[k] for k in order))
    count = [len(view) for view in corners]
    return Sightings(
        camera=np.repeat(cameras, count),
        view=np.repeat(views, count),
        corner=np.concatenate([view.ids for view in corners]),
        px=np.concatenate([view.px for view in corners]),
        sigma_px=np.concatenate([view.sigma_px for view in corners]),
        time_s=np.repeat(np.asarray(times_s)[order], count),
    )
