"""The model of an adjustment of cameras: what was seen, the parameters, and how the pictures follow
from them.

Every observation is a corner of the board, seen by one camera in one view. Parameters:

- of each camera, CAMERA_COLUMNS: nine of the lens, w and v of its pose, clock offset (16);
- of the board (B): those of its shape, where it is a body of several faces, then PRINT_TERMS:
  relative size, stretch, warp along x and y (4);
- of each of the board's points, where these are not exact: how far it is from its place (3), a face's
  points not moving as one;
- of each view: w and v of the board's pose (6);
- where the board moves and cameras are not triggered together, of each picture: how late it is (1), and
  w and v of the board's pose then about its path through the views (6).

Poses move as T ← (Exp(w) R, t + v). `vision.calibration.adjust` finds the parameters.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Self

import numpy as np

from vision.calibration.board_motion import Trajectory
from vision.geometry import lens as lens_model
from vision.geometry.board import PRINT_TERMS, Board
from vision.geometry.camera import PARAMETERS
from vision.geometry.crop import Crop
from vision.geometry.rotation import exp_rotation, left_jacobian, moved_pose, skew
from vision.geometry.rows import Rows

CAMERA_COLUMNS = (*PARAMETERS, "clock_offset_s")
N_CAMERA = len(CAMERA_COLUMNS)
N_BOARD = len(PRINT_TERMS)
# [parameters] A layout, no threshold.
N_VIEW = 6
# [parameters] A layout, no threshold: a picture's own.
N_PICTURE = 7
# [column] A layout, no threshold: of a picture's own parameters.
LATENESS = 0
# [columns] A layout, no threshold: of a picture's own parameters.
DEPARTURE = slice(1, 7)
# [columns] A layout, no threshold.
POSE = slice(9, 15)
# [column] A layout, no threshold.
CLOCK = 15


@dataclass(frozen=True, eq=False)
class Sightings(Rows):
    """The corners that were seen, a row each, sorted by view and camera.

    camera, view, corner (n,): indices. px (n, 2). sigma_px (n,). time_s (n,): of the picture after
    the view's own time, 0 where cameras are triggered together or a view has one camera.
    """

    camera: np.ndarray
    view: np.ndarray
    corner: np.ndarray
    px: np.ndarray
    sigma_px: np.ndarray
    time_s: np.ndarray

    def __len__(self) -> int:
        return len(self.camera)

    def shot_starts(self) -> np.ndarray:
        """Return the first row of each shot, a shot being one camera's picture of one view."""
        is_new = (np.diff(self.view) != 0) | (np.diff(self.camera) != 0)
        return np.concatenate([[0], np.flatnonzero(is_new) + 1])

    def rows_by_shot(self) -> list[np.ndarray]:
        """Return the rows of each shot."""
        return np.split(np.arange(len(self)), self.shot_starts()[1:])

    def pictures_by_view(self, views: int) -> np.ndarray:
        """Return how many pictures there are of each of so many views, (views,)."""
        return np.bincount(self.view[self.shot_starts()], minlength=views)

    def with_error(self, error_px: np.ndarray) -> Self:
        """Return the corners with their camera's model error in their sigmas; error_px (C,)."""
        return replace(self, sigma_px=np.hypot(self.sigma_px, error_px[self.camera]))

    def with_equal_sigmas(self) -> Self:
        """Return the corners with a sigma of 1 px each."""
        return replace(self, sigma_px=np.ones(len(self)))


@dataclass(frozen=True, eq=False)
class BundleState:
    """All parameters.

    lens (C, 9). T_camera_world (C, 3, 4). T_world_board (V, 3, 4). board (B,): its
    shape and PRINT_TERMS. points_mm (m, 3): how far its points are from there, in its frame; (1, 3) for
    all of them. clock (C,): offset, s. pictures (V, C, 7): how much later than it should each picture was
    taken, s, and w, rad, and v, mm, of the board's pose then about its path.
    trajectory: the views in time, along which the board moves between pictures of one view; None
    where cameras are triggered together.
    """

    lens: np.ndarray
    T_camera_world: np.ndarray
    T_world_board: np.ndarray
    board: np.ndarray = field(default_factory=lambda: np.zeros(N_BOARD))
    points_mm: np.ndarray = field(default_factory=lambda: np.zeros((1, 3)))
    clock: np.ndarray | None = None
    pictures: np.ndarray | None = None
    trajectory: Trajectory | None = None

    def __post_init__(self):
        cameras = len(self.lens)
        if self.clock is None:
            object.__setattr__(self, "clock", np.zeros(cameras))
        if self.pictures is None:
            shape = (len(self.T_world_board), cameras, N_PICTURE)
            object.__setattr__(self, "pictures", np.zeros(shape))

    def global_values(self) -> np.ndarray:
        """Return the values that priors constrain, (16 C + B,); poses stand as 0."""
        per_camera = np.zeros((len(self.lens), N_CAMERA))
        per_camera[:, :9] = self.lens
        per_camera[:, CLOCK] = self.clock
        return np.concatenate([per_camera.ravel(), self.board])

    def move(
        self,
        global_step: np.ndarray,
        view_steps: np.ndarray,
        picture_steps: np.ndarray,
        point_steps: np.ndarray | float = 0.0,
    ) -> "BundleState":
        """Return the state moved by steps (16 C + B,), (V, 6), (V, C, 7) and (m, 3)."""
        of_cameras = N_CAMERA * len(self.lens)
        cameras = global_step[:of_cameras].reshape(-1, N_CAMERA)
        return replace(
            self,
            lens=self.lens + cameras[:, :9],
            T_camera_world=moved_pose(self.T_camera_world, cameras[:, POSE]),
            T_world_board=moved_pose(self.T_world_board, view_steps),
            board=self.board + global_step[of_cameras:],
            points_mm=self.points_mm + point_steps,
            clock=self.clock + cameras[:, CLOCK],
            pictures=self.pictures + picture_steps,
        )


@dataclass(frozen=True, eq=False)
class Priors:
    """What is known besides the pictures, and what is held.

    free (16 C + B,): bool. sigma (16 C + B,): about 0, of independent observations of the global
    parameters, inf where there is none (poses: always inf). view_free (V,): bool. pose_view,
    pose_T (3, 4), pose_sigma (6,): one view whose pose was measured (the board on the rig), in w
    rad and v mm; pose_view is None where there is none. picture_sigma (C, 7): how far a picture's own
    parameters stray from 0; None: not at all. shared: cameras with one lens, of which all but the first have no
    free lens or clock of their own; None: each has its own. point_sigma_mm: how far the board's points are
    from their places, per axis; 0: not at all.
    """

    free: np.ndarray
    sigma: np.ndarray
    view_free: np.ndarray
    pose_view: int | None = None
    pose_T: np.ndarray | None = None
    pose_sigma: np.ndarray | None = None
    picture_sigma: np.ndarray | None = None
    shared: "SharedLenses | None" = None
    point_sigma_mm: float = 0.0

    def observed(self, where: slice, sigma: Sequence[float]) -> Self:
        """Return the priors with some global parameters free and about 0 within a sigma each; those
        whose sigma is 0 are held.
        """
        own_sigma = np.array(sigma)
        free = self.free.copy()
        free[where] = own_sigma > 0
        sigmas = self.sigma.copy()
        sigmas[where] = np.where(own_sigma > 0, own_sigma, np.inf)
        return replace(self, free=free, sigma=sigmas)

    def directions(self) -> np.ndarray:
        """Return how the global parameters move with the free ones, (16 C + B, F)."""
        moved = np.eye(len(self.free))
        if self.shared is not None:
            moved = self.shared.moved_by(moved)
        return moved[:, self.free]


@dataclass(frozen=True, eq=False)
class SharedLenses:
    """Which cameras are parts of one picture, and so have one lens and one clock.

    first (C,): of each camera the first one with its lens, itself where it is the first. signs (C, 9): derivative
    of its lens terms by those of that one.
    """

    first: np.ndarray
    signs: np.ndarray

    @classmethod
    def of(cls, crops: Sequence[Crop]) -> "SharedLenses":
        """Return which of the cameras with these crops (C,) share a lens."""
        pictures = [crop.of for crop in crops]
        first = np.array([pictures.index(name) for name in pictures])
        signs = np.array([crop.lens_signs for crop in crops])
        return cls(first, signs * signs[first])

    @classmethod
    def none(cls, cameras: int) -> "SharedLenses":
        """Return that each of so many cameras has a lens of its own."""
        return cls(np.arange(cameras), np.ones((cameras, len(lens_model.LENS_TERMS))))

    def tied(self) -> np.ndarray:
        """Return the mask (C, 16) of parameters that are another camera's."""
        mask = np.zeros((len(self.first), N_CAMERA), dtype=bool)
        mask[self.first != np.arange(len(self.first))] = True
        mask[:, POSE] = False
        return mask

    def moved_by(self, step: np.ndarray) -> np.ndarray:
        """Return steps (16 C + B, F) of which the tied parameters follow those that they share."""
        followed = step.copy()
        terms = [*range(len(lens_model.LENS_TERMS)), CLOCK]
        for camera, first in enumerate(self.first.tolist()):
            if camera != first:
                signs = np.append(self.signs[camera], 1.0)
                of_first = [N_CAMERA * first + term for term in terms]
                own = [N_CAMERA * camera + term for term in terms]
                followed[own] = signs[:, None] * step[of_first]
        return followed


def predict(state: BundleState, seen: Sightings, board: Board) -> tuple[np.ndarray, np.ndarray]:
    """Predict the pixels (n, 2) of all sightings, and their Jacobian (n, 2, 16 + B + 6 or 18).

    Its columns: the camera's 16, the board's B, the view's 6; with a trajectory also the 6 of
    the view before and the 6 of the view after.
    """
    whole = predict_with_own(state, seen, board)
    return whole.px, whole.J


class Prediction(NamedTuple):
    """Pixels px (n, 2) of sightings, and their derivatives.

    J (n, 2, 16 + B + 6 or 18): as of `predict`. by_point (n, 2, 3): by the board's point of each.
    by_departure (n, 2, 6): by w and v of the board's pose about its path.
    """

    px: np.ndarray
    J: np.ndarray
    by_point: np.ndarray
    by_departure: np.ndarray


def predict_with_own(state: BundleState, seen: Sightings, board: Board) -> Prediction:
    """Predict the pixels of all sightings, with the derivatives by what is a point's or a picture's own."""
    points_mm, by_board = board.printed(state.board)
    points_mm = points_mm + state.points_mm
    motion = _board_motion(state, seen)
    placed = _place_corners(state, seen, motion, points_mm)
    px, by_x, by_lens = _project(state, seen.camera, placed.in_camera)

    by_world = by_x @ placed.R_camera
    by_turn = -by_world @ skew(placed.turned)  # Exp(w) y = y + w × y to first order
    by_time = motion.by_time(by_turn, by_world)
    by_camera = [by_lens, -by_x @ skew(placed.in_camera), by_x, by_time]
    by_point = by_world @ motion.turn @ placed.R_board
    by_views = motion.by_poses(by_turn, by_world)
    J = np.concatenate([*by_camera, by_point @ by_board[seen.corner], *by_views], axis=2)
    by_departure = np.concatenate([by_turn @ motion.by_departure, by_world], axis=2)
    return Prediction(px, J, by_point, by_departure)


def _project(
    state: BundleState, camera: np.ndarray, turned: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Project points (n, 3), turned to the axes of their cameras (n,), through the cameras' lenses.

    Returns px (n, 2), and their derivatives by the points (n, 2, 3) and by the lens (n, 2, 9).
    """
    px = np.empty((len(camera), 2))
    by_x = np.empty((len(camera), 2, 3))
    by_lens = np.empty((len(camera), 2, 9))
    for c in np.unique(camera):
        rows = camera == c
        x_camera = turned[rows] + state.T_camera_world[c, :, 3]
        projected = lens_model.project_with_jacobians(x_camera, state.lens[c])
        px[rows], by_x[rows], by_lens[rows] = projected
    return px, by_x, by_lens


class _Motion(NamedTuple):
    """How the board moved from the view's own time to the instant of a picture, a row a corner.

    turn (n, 3, 3): about the board's origin. shift_mm (n, 3). turn_rate, shift_rate_mm_s (n, 3):
    rad/s and mm/s. turn_by_poses (n, p, 3, 3), shift_by_poses (n, p): derivatives of the turn (as a
    small rotation) by w, and of the shift by v, of p poses: the view's own and, with a trajectory,
    those before and after. by_departure (n, 3, 3): derivative of the turn by w of the departure.
    """

    turn: np.ndarray
    shift_mm: np.ndarray
    turn_rate: np.ndarray
    shift_rate_mm_s: np.ndarray
    turn_by_poses: np.ndarray
    shift_by_poses: np.ndarray
    by_departure: np.ndarray

    @staticmethod
    def none(count: int) -> "_Motion":
        """Return the motion of a board that stands still, for `count` corners."""
        zero = np.zeros((count, 3))
        eye = np.broadcast_to(np.eye(3), (count, 3, 3))
        return _Motion(eye, zero, zero, zero, eye[:, None], np.ones((count, 1)), eye)

    def departed(self, departure: np.ndarray) -> "_Motion":
        """Return the motion with w and v (n, 6) of the board's pose about its path besides."""
        aside = exp_rotation(departure[:, :3])
        return self._replace(
            turn=aside @ self.turn,
            shift_mm=self.shift_mm + departure[:, 3:],
            turn_rate=np.einsum("nij,nj->ni", aside, self.turn_rate),
            turn_by_poses=aside[:, None] @ self.turn_by_poses,
            by_departure=left_jacobian(departure[:, :3]),
        )

    def by_time(self, by_turn: np.ndarray, by_shift: np.ndarray) -> np.ndarray:
        """Return the derivative (n, 2, 1) of pixels by the time of their picture, px/s.

        by_turn, by_shift (n, 2, 3): their derivatives by the board's turn and shift.
        """
        turning = by_turn @ self.turn_rate[:, :, None]
        return turning + by_shift @ self.shift_rate_mm_s[:, :, None]

    def by_poses(self, by_turn: np.ndarray, by_shift: np.ndarray) -> list[np.ndarray]:
        """Return the derivatives (n, 2, 3) of pixels by w and v of each of p poses in turn."""
        columns = []
        for pose in range(self.shift_by_poses.shape[1]):
            columns.append(by_turn @ self.turn_by_poses[:, pose])
            columns.append(by_shift * self.shift_by_poses[:, pose, None, None])
        return columns


class _Placed(NamedTuple):
    """Where corners were at the instants of their pictures, a row each.

    R_board, R_camera (n, 3, 3): of the view and the camera. turned (n, 3): from the board's origin,
    along the world's axes, mm. in_camera (n, 3): from the world's origin, along the camera's axes,
    mm.
    """

    R_board: np.ndarray
    R_camera: np.ndarray
    turned: np.ndarray
    in_camera: np.ndarray


def _place_corners(
    state: BundleState, seen: Sightings, motion: _Motion, points_mm: np.ndarray
) -> _Placed:
    """Return where the sightings' corners were, points_mm (m, 3) being the board as printed."""
    R_board = state.T_world_board[seen.view, :, :3]
    R_camera = state.T_camera_world[seen.camera, :, :3]
    in_view = np.einsum("nij,nj->ni", R_board, points_mm[seen.corner])
    turned = np.einsum("nij,nj->ni", motion.turn, in_view)
    world = turned + state.T_world_board[seen.view, :, 3] + motion.shift_mm
    return _Placed(R_board, R_camera, turned, np.einsum("nij,nj->ni", R_camera, world))


def _board_motion(state: BundleState, seen: Sightings) -> _Motion:
    """Return how the board moved from the time of each sighting's view to that of its picture."""
    if state.trajectory is None:
        return _Motion.none(len(seen))
    view = seen.view
    shares, rates = state.trajectory.shares(view, _elapsed_s(state, seen))  # (n, 2)
    paths = state.trajectory.paths(state.T_world_board)  # (V, 2, 6)
    path = np.einsum("nk,nki->ni", shares, paths[view])
    rate = np.einsum("nk,nki->ni", rates, paths[view])
    turn = exp_rotation(path[:, :3])
    J = left_jacobian(path[:, :3])
    by_path = _inverse_jacobians(paths)[view] * shares[:, :, None, None]
    along = _Motion(
        turn=turn,
        shift_mm=path[:, 3:],
        turn_rate=np.einsum("nij,nj->ni", J, rate[:, :3]),
        shift_rate_mm_s=rate[:, 3:],
        turn_by_poses=_turn_by_poses(turn, J, by_path),
        shift_by_poses=np.column_stack([1.0 - shares.sum(axis=1), shares]),
        by_departure=np.broadcast_to(np.eye(3), turn.shape),
    )
    return along.departed(state.pictures[view, seen.camera, DEPARTURE])


def _elapsed_s(state: BundleState, seen: Sightings) -> np.ndarray:
    """Return the times (n,) of the sightings' pictures after their views' own times, s."""
    late_s = state.pictures[seen.view, seen.camera, LATENESS]
    return seen.time_s + late_s + state.clock[seen.camera]


def _inverse_jacobians(paths: np.ndarray) -> np.ndarray:
    """Return J⁻¹ (V, 2, 3, 3) of the turns of paths (V, 2, 6), J being left Jacobians."""
    return np.linalg.inv(left_jacobian(paths[:, :, :3]))


def _turn_by_poses(turn: np.ndarray, J: np.ndarray, by_path: np.ndarray) -> np.ndarray:
    """Return the derivatives (n, 3, 3, 3) of turns by w of the view's own pose, and of its
    neighbours.

    log(Exp(w) X) grows by J⁻¹ w, log(X Exp(-w)) by -J⁻ᵀ w, J being that of log X.
    turn (n, 3, 3). J (n, 3, 3): of its logarithm. by_path (n, 2, 3, 3): the share of the path to
    each neighbour, times J⁻¹ of that path.
    """
    by_own = turn - J @ by_path.sum(axis=1).swapaxes(1, 2)
    return np.concatenate([by_own[:, None], J[:, None] @ by_path], axis=1)
