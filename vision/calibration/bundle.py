"""What an adjustment of cameras is about: what was seen, the parameters, and how the pictures follow from
them.

Every observation is a corner of the board, seen by one camera in one view. Parameters:

- of each camera, CAMERA_COLUMNS: nine of the lens, w and v of its pose, clock offset (16);
- of the board, BOARD_COLUMNS: relative size, warp along x and y (3);
- of each view: w and v of the board's pose (6);
- where the board moves and cameras are not triggered together, of each picture: how late it is (1).

Poses move as T ← (Exp(w) R, t + v). `vision.calibration.adjust` finds the parameters.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from vision.calibration.board_motion import Trajectory
from vision.geometry import lens as lens_model
from vision.geometry.rotation import exp_rotation, left_jacobian, skew

CAMERA_COLUMNS = (
    *lens_model.LENS_TERMS,
    "w_x",
    "w_y",
    "w_z",
    "v_x",
    "v_y",
    "v_z",
    "clock_offset_s",
)
BOARD_COLUMNS = ("scale", "warp_x_mm", "warp_y_mm")
# [parameters] A layout, no threshold.
N_CAMERA, N_BOARD, N_VIEW = len(CAMERA_COLUMNS), len(BOARD_COLUMNS), 6
# [columns] A layout, no threshold.
POSE = slice(9, 15)
# [column] A layout, no threshold.
CLOCK = 15


@dataclass(frozen=True, eq=False)
class Sightings:
    """What was seen, a row a corner: camera, view, corner (n,) int, px (n, 2), sigma_px (n,), time_s (n,).

    time_s is the picture's time after the view's own time: 0 where cameras are triggered together or a view
    has one camera. Rows are kept sorted by view and camera.
    """

    camera: np.ndarray
    view: np.ndarray
    corner: np.ndarray
    px: np.ndarray
    sigma_px: np.ndarray
    time_s: np.ndarray

    def __len__(self) -> int:
        return len(self.camera)

    def chosen(self, which: np.ndarray) -> "Sightings":
        """The rows that the mask or index array names, in their order."""
        return Sightings(*(getattr(self, name)[which] for name in self.__dataclass_fields__))

    def shot_starts(self) -> np.ndarray:
        """First row of each shot, a shot being one camera's picture of one view."""
        change = (np.diff(self.view) != 0) | (np.diff(self.camera) != 0)
        return np.concatenate([[0], np.flatnonzero(change) + 1])


@dataclass(frozen=True, eq=False)
class BundleState:
    """All parameters. lens (C, 9); T_camera_world (C, 3, 4); T_world_board (V, 3, 4); board (3,):
    BOARD_COLUMNS; clock (C,): offset, s. instants (V, C): how much later than it should each picture was taken, s.
    trajectory: the views in time, along which the board moves between pictures of one view; None where cameras are
    triggered together.
    """

    lens: np.ndarray
    T_camera_world: np.ndarray
    T_world_board: np.ndarray
    board: np.ndarray = field(default_factory=lambda: np.zeros(N_BOARD))
    clock: np.ndarray | None = None
    instants: np.ndarray | None = None
    trajectory: Trajectory | None = None

    def __post_init__(self):
        if self.clock is None:
            object.__setattr__(self, "clock", np.zeros(len(self.lens)))
        if self.instants is None:
            object.__setattr__(
                self, "instants", np.zeros((len(self.T_world_board), len(self.lens)))
            )

    def globals(self) -> np.ndarray:
        """The values that priors speak of, (16 C + 3,); poses stand as 0."""
        per_camera = np.zeros((len(self.lens), N_CAMERA))
        per_camera[:, :9], per_camera[:, CLOCK] = self.lens, self.clock
        return np.concatenate([per_camera.ravel(), self.board])

    def stepped(
        self, global_step: np.ndarray, view_steps: np.ndarray, instant_steps: np.ndarray
    ) -> "BundleState":
        """Moved by (16 C + 3,), (V, 6) and (V, C)."""
        cameras = global_step[:-N_BOARD].reshape(-1, N_CAMERA)
        return replace(
            self,
            lens=self.lens + cameras[:, :9],
            T_camera_world=_moved(self.T_camera_world, cameras[:, POSE]),
            T_world_board=_moved(self.T_world_board, view_steps),
            board=self.board + global_step[-N_BOARD:],
            clock=self.clock + cameras[:, CLOCK],
            instants=self.instants + instant_steps,
        )


def _moved(T: np.ndarray, steps: np.ndarray) -> np.ndarray:
    R = exp_rotation(steps[:, :3]) @ T[:, :, :3]
    return np.concatenate([R, (T[:, :, 3] + steps[:, 3:])[:, :, None]], axis=2)


@dataclass(frozen=True, eq=False)
class Priors:
    """What is known beside the pictures, and what is held.

    free: (16 C + 3,) bool. mean, sigma: (16 C + 3,) of independent observations of the global parameters,
    sigma inf where there is none (poses: always inf). view_free: (V,) bool. pose_view, pose_T (3, 4),
    pose_sigma (6,): one view whose pose was measured (the board on the rig), in w rad and v mm; pose_view
    is None where there is none. late_sigma_s (C,): how far a picture's instant strays from its time; 0: not
    at all.
    """

    free: np.ndarray
    mean: np.ndarray
    sigma: np.ndarray
    view_free: np.ndarray
    pose_view: int | None = None
    pose_T: np.ndarray | None = None
    pose_sigma: np.ndarray | None = None
    late_sigma_s: np.ndarray | None = None


def predict(
    state: BundleState, seen: Sightings, corners_mm: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (n, 2) and their Jacobian (n, 2, 25 or 37).

    Its columns: the seeing camera's 16, the board's 3, the view's 6; with a trajectory also the 6 of the view before
    and the 6 of the view after.
    """
    width = N_CAMERA + N_BOARD + N_VIEW * (1 if state.trajectory is None else 3)
    px, J = np.empty((len(seen), 2)), np.empty((len(seen), 2, width))
    points, by_board = _printed(state, seen, corners_mm)
    paths = _Paths.of(state)
    for camera in np.unique(seen.camera):
        rows = np.flatnonzero(seen.camera == camera)
        px[rows], J[rows] = _predict_one(
            state, camera, seen.chosen(rows), points[rows], by_board[rows], paths
        )
    return px, J


def _printed(
    state: BundleState, seen: Sightings, corners_mm: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Board points (n, 3) in the board frame and d point / d (scale, warp_x, warp_y) (n, 3, 3).

    Warp after mrcal: z = warp_x (1 − x²) + warp_y (1 − y²), x and y from −1 to 1 over the corners.
    """
    half = np.maximum(np.ptp(corners_mm[:, :2], axis=0) / 2, 1e-9)
    unit = (corners_mm[:, :2] - corners_mm[:, :2].mean(axis=0)) / half
    by_board = np.zeros((len(corners_mm), 3, N_BOARD))
    by_board[:, :, 0] = corners_mm
    by_board[:, 2, 1:] = 1.0 - unit**2
    points = corners_mm + by_board @ state.board
    return points[seen.corner], by_board[seen.corner]


def _predict_one(state: BundleState, camera: int, seen: Sightings, points, by_board, paths):
    T_board, T_camera = state.T_world_board[seen.view], state.T_camera_world[camera]
    turned = np.einsum("nij,nj->ni", T_board[:, :, :3], points)
    motion = _motion(state, camera, seen, paths)
    moved = np.einsum("nij,nj->ni", motion.turn, turned)
    R = T_camera[:, :3]
    in_camera = (moved + T_board[:, :, 3] + motion.shift_mm) @ R.T
    px, by_x, by_lens = lens_model.project_with_jacobians(
        in_camera + T_camera[:, 3], state.lens[camera]
    )
    by_world = by_x @ R
    by_turn = -by_world @ skew(moved)
    columns = [by_lens, -by_x @ skew(in_camera), by_x]
    columns.append(
        by_turn @ motion.turn_rate[:, :, None] + by_world @ motion.shift_rate_mm_s[:, :, None]
    )
    columns.append(by_world @ motion.turn @ T_board[:, :, :3] @ by_board)
    columns += [by_turn @ w for w in motion.turn_by_poses] + [
        by_world * v for v in motion.shift_by_poses
    ]
    order = [*range(5), *(5 + k + side for k in range(motion.poses) for side in (0, motion.poses))]
    return px, np.concatenate([columns[k] for k in order], axis=2)


@dataclass(frozen=True, eq=False)
class _Motion:
    """How the board moved from the view's own time to the instant of a picture, a row a corner.

    turn (n, 3, 3) about the board's origin and shift_mm (n, 3); their rates, rad/s and mm/s (n, 3); and how turn (as a
    small rotation) and shift follow the w and v of the view's own pose and of those before and after: a list of
    (n, 3, 3) and of (n, 1, 1).
    """

    turn: np.ndarray
    shift_mm: np.ndarray
    turn_rate: np.ndarray
    shift_rate_mm_s: np.ndarray
    turn_by_poses: list[np.ndarray]
    shift_by_poses: list[np.ndarray]

    @property
    def poses(self) -> int:
        return len(self.turn_by_poses)


@dataclass(frozen=True, eq=False)
class _Paths:
    """From each view's pose to those before and after: paths (V, 2, 6), and of their turns' left Jacobians the inverse
    (V, 2, 3, 3)."""

    paths: np.ndarray
    inverse: np.ndarray

    @staticmethod
    def of(state: BundleState) -> "_Paths | None":
        if state.trajectory is None:
            return None
        paths = state.trajectory.paths(state.T_world_board)
        return _Paths(paths, np.linalg.inv(left_jacobian(paths[:, :, :3])))


def _motion(state: BundleState, camera: int, seen: Sightings, board: _Paths | None) -> _Motion:
    n = len(seen)
    if board is None:
        still, eye = np.zeros((n, 3)), np.broadcast_to(np.eye(3), (n, 3, 3))
        return _Motion(eye, still, still, still, [eye], [np.ones((n, 1, 1))])
    elapsed = seen.time_s + state.instants[seen.view, camera] + state.clock[camera]
    shares, rates = state.trajectory.shares(seen.view, elapsed)
    path, rate = (np.einsum("nk,nki->ni", s, board.paths[seen.view]) for s in (shares, rates))
    turn, J = exp_rotation(path[:, :3]), left_jacobian(path[:, :3])
    # log(Exp(w) X) grows by J⁻¹ w, log(X Exp(-w)) by -J⁻ᵀ w, J being that of log X.
    inverse = board.inverse[seen.view] * shares[:, :, None, None]
    by_neighbours = [J @ inverse[:, k] for k in (0, 1)]
    by_own = turn - J @ np.swapaxes(inverse.sum(axis=1), 1, 2)
    parts = [1.0 - shares.sum(axis=1), shares[:, 0], shares[:, 1]]
    return _Motion(
        turn,
        path[:, 3:],
        np.einsum("nij,nj->ni", J, rate[:, :3]),
        rate[:, 3:],
        [by_own, *by_neighbours],
        [part[:, None, None] for part in parts],
    )
