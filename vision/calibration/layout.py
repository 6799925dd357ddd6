"""Which camera saw the board where and when: views laid out for one adjustment, and where it starts.

Board views are each camera's own, or shared where all cameras looked at the board at once. The board standing on the
rig, where there is one, is view 0 and shared by all.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vision.boards.corners import Corners
from vision.calibration.board_motion import Trajectory
from vision.calibration.bundle import BundleState, Sightings
from vision.calibration.first_guess import board_pose, chain_cameras, most_central
from vision.geometry.board import Board
from vision.geometry.refusals import Refused
from vision.geometry.rotation import compose, invert_transform, log_rotation

# [rad] Views that have nothing to do with each other agree as loosely as this and the next once
# in a hundred. Derived.
_SAME_TURN_RAD = np.radians(10.0)
# [1] Share of the distance; see above. Derived.
_SAME_SHIFT = 0.1
# [1] Most views of one index must agree. Origin not known beyond *most*. Study: cameras.py.
_SAME_SHARE = 0.6
# [views] Fewer views of one index tell no share. Origin not known. Study: cameras.py.
_MIN_SHARED = 5


@dataclass(frozen=True, eq=False)
class Alone:
    """One camera by itself: its lens (9,), model error px, and by view index its usable views and board poses."""

    lens: np.ndarray
    error_px: float
    views: Mapping[int, Corners]
    poses: Mapping[int, np.ndarray]


@dataclass(frozen=True, eq=False)
class Layout:
    """seen: all corners. first: the state to start from. trajectory: the views in time; None where views are not
    shared. index (V,): of each view in its camera's series, -1 for the board on the rig."""

    seen: Sightings
    first: BundleState
    trajectory: Trajectory | None
    index: np.ndarray


def looked_at_once(cameras: Mapping[str, Alone]) -> bool:
    """Are views of one index of one instant (to within a hand's motion), rather than each camera's own series?"""
    alone = list(cameras.values())
    pairs = [_agreement(a, b) for k, a in enumerate(alone) for b in alone[k + 1 :]]
    judged = [share for share, count in pairs if count >= _MIN_SHARED]
    return bool(judged) and float(np.median(judged)) >= _SAME_SHARE


def _agreement(a: Alone, b: Alone) -> tuple[float, int]:
    """Share of the views of both cameras that agree on T_b_a, and how many views there are."""
    shared = [compose(b.poses[k], invert_transform(a.poses[k])) for k in a.poses if k in b.poses]
    if not shared:
        return 0.0, 0
    centre = most_central(shared)
    far = np.median([np.linalg.norm(T[:, 3]) for T in [*a.poses.values(), *b.poses.values()]])
    turn = np.linalg.norm(log_rotation(np.array(shared)[:, :, :3] @ centre[:, :3].T), axis=1)
    shift = np.linalg.norm(np.array(shared)[:, :, 3] - centre[:, 3], axis=1)
    return float(np.mean((turn < _SAME_TURN_RAD) & (shift < _SAME_SHIFT * far))), len(shared)


def lay_out(
    cameras: Mapping[str, Alone],
    T_camera_world: np.ndarray,
    *,
    standing: Mapping[str, Corners] | None = None,
    T_rig_board: np.ndarray | None = None,
    together: bool,
    times_s: Mapping[str, Sequence[float]] | None = None,
) -> Layout:
    """One table of everything seen, and the first state, for cameras placed at T_camera_world (C, 3, 4).

    standing: the board on the rig, where there is one. together: views of one index are of one instant, or of
    times_s[camera][index] where given.
    """
    groups = _shared_groups(cameras) if together else _own_groups(cameras)
    boards = [] if standing is None else [T_rig_board]
    shots = [] if standing is None else [(c, 0, standing[name]) for c, name in enumerate(cameras)]
    blank = [np.nan] * len(boards)
    for group in groups:
        best = max(group, key=lambda seen: len(seen[2]))
        boards.append(compose(invert_transform(T_camera_world[best[0]]), best[3]))
        shots += [(c, len(boards) - 1, view) for c, _, view, _ in group]
    lenses = np.array([alone.lens for alone in cameras.values()])
    state = BundleState(lenses, np.asarray(T_camera_world), np.array(boards))
    index = np.array([-1] * len(blank) + [group[0][1] for group in groups])
    if not together:
        return Layout(gather(shots), state, None, index)
    rank = np.argsort(np.argsort([-len(a.views) for a in cameras.values()], kind="stable"))
    times = _times(groups, list(cameras), times_s, rank)
    since = [0.0] * len(cameras) * len(blank) + [t - now for now, ts in times for t in ts]
    trajectory = Trajectory(np.array(blank + [now for now, _ in times]), rank)
    return Layout(gather(shots, since), state, trajectory, index)


def _own_groups(cameras: Mapping[str, Alone]) -> list[list[tuple]]:
    """A group a view: (camera, index, corners, pose) of the one camera that has it."""
    return [
        [(c, k, view, a.poses[k])]
        for c, a in enumerate(cameras.values())
        for k, view in a.views.items()
    ]


def _shared_groups(cameras: Mapping[str, Alone]) -> list[list[tuple]]:
    """A group an index: (camera, index, corners, pose) of every camera that has it."""
    indices = sorted(set().union(*(a.views for a in cameras.values())))
    return [
        [(c, k, a.views[k], a.poses[k]) for c, a in enumerate(cameras.values()) if k in a.views]
        for k in indices
    ]


def _times(groups, names: list[str], times_s, rank: np.ndarray) -> list[tuple[float, list[float]]]:
    """(the view's own time, each picture's) for each group; indices stand for times where none are given.

    A view's own time is that of the picture whose camera ranks first: it sees the board where the view has it.
    """
    each = [
        [float(times_s[names[c]][k]) if times_s else float(k) for c, k, _, _ in group]
        for group in groups
    ]
    firsts = [int(np.argmin([rank[c] for c, *_ in group])) for group in groups]
    return [(times[first], times) for first, times in zip(firsts, each)]


def place_cameras(
    cameras: Mapping[str, Alone],
    standing: Mapping[str, Corners] | None,
    board: Board,
    T_rig_board: np.ndarray | None,
    *,
    together: bool,
) -> np.ndarray:
    """T_camera_world (C, 3, 4) to begin with; the world is the rig frame, or the first camera's.

    Raises Refused where cameras cannot be placed relative to each other.
    """
    if standing is not None:
        T_board_rig = invert_transform(T_rig_board)
        poses = {
            name: board_pose(standing[name], board.corners_mm, alone.lens)
            for name, alone in cameras.items()
        }
        return np.array([compose(poses[name], T_board_rig) for name in cameras])
    if len(cameras) == 1:
        return np.eye(3, 4)[None]
    if not together:
        raise Refused(
            "there is no picture of the board on the rig, so the cameras cannot be placed in one frame"
        )
    last = max(max(a.poses) for a in cameras.values())
    chained = chain_cameras(
        {n: [a.poses.get(k) for k in range(last + 1)] for n, a in cameras.items()}
    )
    return np.array([chained[name] for name in cameras])


def gather(shots: Sequence[tuple], times_s: Sequence[float] | None = None) -> Sightings:
    """Sightings of shots (camera, view, Corners), each with its picture's time after the view's own."""
    times_s = np.zeros(len(shots)) if times_s is None else times_s
    order = sorted(range(len(shots)), key=lambda k: shots[k][1::-1])
    count = [len(shots[k][2]) for k in order]
    return Sightings(
        np.repeat([shots[k][0] for k in order], count),
        np.repeat([shots[k][1] for k in order], count),
        np.concatenate([shots[k][2].ids for k in order]),
        np.concatenate([shots[k][2].px for k in order]),
        np.concatenate([shots[k][2].sigma_px for k in order]),
        np.repeat([times_s[k] for k in order], count),
    )
