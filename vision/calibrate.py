"""Cameras from views of a board: one adjustment over everything, noise as the pictures show it, full
covariance.

In: views of a board held anywhere, and views of the board standing on the rig, whose pose T_rig_board
places the cameras. Out: cameras in the rig frame with the joint covariance of all their parameters, and a
report of what they rest on.

Lens terms each carry a weak prior, as wide as lenses on a bench are (LENS_PRIOR). A term leaves zero only
as far as the views demand it, and one they say nothing about keeps the prior's sigma instead of running
away (a free k3 on 14 views came out at 6).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vision.bundle import CAMERA_COLUMNS, N_BOARD, N_CAMERA, POSE, Knowledge, Sightings, State
from vision.corners import Corners
from vision.errors import Refused
from vision.first_guess import board_pose, first_lens
from vision.noise import Settled, settle
from vision.recording import check_views, coverage, depth_ratio, tilt_deg, usable_views
from vision.rotation import compose, invert_transform
from vision.scene import N_PARAMETERS, Board, Camera, Cameras
from vision.static_board import camera_moved, mean_view

__all__ = ["Calibration", "CameraReport", "calibrate_cameras", "camera_moved"]

# One sigma about zero of the distortion terms, for lenses of 3 to 100 mm; wider than any that is not a
# fisheye.
LENS_PRIOR = {"k1": 0.5, "k2": 0.5, "p1": 0.005, "p2": 0.005, "k3": 0.3}
# The board's warp enters where it lowers the cost by more than chance does once in 10 000 (two parameters).
_WARP_GAIN = 18.4
_WARP_SIGMA_MM = 2.0


@dataclass(frozen=True, eq=False)
class CameraReport:
    """What one camera's calibration rests on.

    views, corners: used; left_out: corners beyond the rejection limit. rms_px: of the kept residuals.
    error_px: model error per axis beside the corners' own sigma. coverage: share of the picture within the
    hull of all corners. depth_ratio: farthest to nearest corner. tilt_deg: largest tilt of the board.
    intrinsics_sigma: (9,), of fx fy cx cy k1 k2 p1 p2 k3.
    """

    name: str
    views: int
    corners: int
    left_out: int
    rms_px: float
    error_px: float
    coverage: float
    depth_ratio: float
    tilt_deg: float
    intrinsics_sigma: np.ndarray


@dataclass(frozen=True, eq=False)
class Calibration:
    """Cameras in the rig frame with their covariance, a report each, and notes in plain sentences."""

    cameras: Cameras
    report: tuple[CameraReport, ...]
    notes: tuple[str, ...]


def calibrate_cameras(
    board_views: Mapping[str, Sequence[Corners]],
    rig_views: Mapping[str, Corners],
    board: Board,
    sizes_px: Mapping[str, tuple[int, int]],
    T_rig_board: np.ndarray,
    *,
    T_rig_board_sigma_mm: float = 0.0,
    T_rig_board_sigma_rad: float = 0.0,
    trial_views: Mapping[str, Sequence[Corners]] | None = None,
    work_points_mm: np.ndarray | None = None,
) -> Calibration:
    """Calibrates all cameras in one adjustment.

    board_views: each camera's views of the board, not synchronous between cameras. rig_views: the board
    standing on the rig. T_rig_board (3, 4), mm; its sigmas are per axis, of the shift and of a turn about
    the board's origin, and are shared by all cameras. trial_views: the rig board in the trials' frames, for
    cameras that did not move. work_points_mm (n, 3): where the whisker will be, which each camera's board
    views must cover.

    Raises Refused, saying what to record, where the views cannot give a calibration.
    """
    names = tuple(board_views)
    usable = {name: usable_views(board_views[name], board) for name in names}
    for name in names:
        check_views(name, usable[name], rig_views.get(name), board, sizes_px[name])
    standing = {n: mean_view(rig_views[n], (trial_views or {}).get(n, ())) for n in names}
    state, seen = _first_state(names, usable, standing, board, sizes_px, np.asarray(T_rig_board, dtype=float))
    known = _knowledge(state, board, np.asarray(T_rig_board), T_rig_board_sigma_mm, T_rig_board_sigma_rad)
    settled, notes = _settle_with_warp(state, seen, board, known)
    return _calibration(names, sizes_px, usable, standing, settled, board, notes)


def _first_state(names, usable, standing, board: Board, sizes_px, T_rig_board) -> tuple[State, Sightings]:
    """View 0 is the board on the rig; then each camera's own views, camera by camera. The world is the rig
    frame.
    """
    lenses, poses, boards = [], [], [T_rig_board]
    shots = [(c, 0, standing[name]) for c, name in enumerate(names)]
    for c, name in enumerate(names):
        alone = calibrate_alone(usable[name], board, sizes_px[name])
        lens = alone.solution.state.lens[0]
        T_camera_rig = compose(
            board_pose(standing[name], board.corners_mm, lens), invert_transform(T_rig_board)
        )
        shots += [(c, len(boards) + k, view) for k, view in enumerate(usable[name])]
        boards += [compose(invert_transform(T_camera_rig), T) for T in alone.solution.state.T_world_board]
        lenses.append(lens)
        poses.append(T_camera_rig)
    return State(np.array(lenses), np.array(poses), np.array(boards)), gather(shots)


def gather(shots: Sequence[tuple], times_s: Sequence[float] | None = None) -> Sightings:
    """Sightings of shots (camera, view, Corners), each with its time after the view's own."""
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


def calibrate_alone(views: Sequence[Corners], board: Board, size_px: tuple[int, int]) -> Settled:
    """One camera by itself, the world being the camera's frame: the start of the joint adjustment."""
    lens = first_lens(views, board.corners_mm, size_px)
    poses = np.array([board_pose(view, board.corners_mm, lens) for view in views])
    state = State(lens[None], np.eye(3, 4)[None], poses)
    known = lens_knowledge(1, len(views))
    known.free[POSE] = False
    return settle(state, gather([(0, k, view) for k, view in enumerate(views)]), board.corners_mm, known)


def lens_knowledge(n_cameras: int, n_views: int) -> Knowledge:
    """Lenses and poses free, the lenses' prior; board exact, cameras triggered together."""
    size = N_CAMERA * n_cameras + N_BOARD
    free, mean, sigma = np.ones(size, dtype=bool), np.zeros(size), np.full(size, np.inf)
    for column, name in enumerate(CAMERA_COLUMNS):
        rows = column + N_CAMERA * np.arange(n_cameras)
        sigma[rows] = LENS_PRIOR.get(name, np.inf)
        free[rows] = not name.endswith("_s")
    free[-N_BOARD:] = False
    return Knowledge(free, mean, sigma, np.ones(n_views, dtype=bool))


def _knowledge(state: State, board: Board, T_rig_board, sigma_mm: float, sigma_rad: float) -> Knowledge:
    """The rig board's pose as it was measured: held where its sigma is 0, else an observation. Likewise the
    square.
    """
    known = lens_knowledge(len(state.lens), len(state.T_world_board))
    known.view_free[0] = sigma_mm > 0 or sigma_rad > 0
    pose_sigma = np.repeat([max(sigma_rad, 1e-9), max(sigma_mm, 1e-7)], 3)
    if board.square_sigma_mm > 0:
        known.free[-N_BOARD] = True
        known.sigma[-N_BOARD] = board.square_sigma_mm / board.square_mm
    return Knowledge(known.free, known.mean, known.sigma, known.view_free, 0, T_rig_board, pose_sigma)


def _settle_with_warp(state, seen, board: Board, known: Knowledge) -> tuple[Settled, list[str]]:
    """With a flat board, then with a warped one where the pictures ask for it."""
    flat = settle(state, seen, board.corners_mm, known)
    warped_knowledge = allow_warp(known)
    warped = settle(flat.solution.state, seen, board.corners_mm, warped_knowledge)
    if flat.solution.cost - warped.solution.cost < _WARP_GAIN:
        return flat, []
    x, y = warped.solution.state.board[1:]
    return warped, [f"The board is bent by {x:+.3f} mm along x and {y:+.3f} mm along y; taken into account."]


def allow_warp(known: Knowledge) -> Knowledge:
    """The same with the board's two warps free."""
    free, sigma = known.free.copy(), known.sigma.copy()
    free[-2:], sigma[-2:] = True, _WARP_SIGMA_MM
    return Knowledge(
        free, known.mean, sigma, known.view_free, known.pose_view, known.pose_T, known.pose_sigma
    )


def as_cameras(names, sizes_px, settled: Settled) -> Cameras:
    """The cameras of a settled adjustment with the covariance of their 15 parameters each."""
    state = settled.solution.state
    cameras = tuple(
        Camera(name, sizes_px[name], _matrix(lens), lens[4:], T, settled.rms_px(c))
        for c, (name, lens, T) in enumerate(zip(names, state.lens, state.T_camera_world))
    )
    rows = np.concatenate([N_CAMERA * c + np.arange(N_PARAMETERS) for c in range(len(names))])
    return Cameras(cameras, settled.solution.covariance[np.ix_(rows, rows)])


def _matrix(lens: np.ndarray) -> np.ndarray:
    return np.array([[lens[0], 0, lens[2]], [0, lens[1], lens[3]], [0, 0, 1]])


def _calibration(names, sizes_px, usable, standing, settled: Settled, board: Board, notes) -> Calibration:
    cameras = as_cameras(names, sizes_px, settled)
    if not settled.solution.converged:
        raise Refused(
            "the adjustment of the cameras did not come to rest: record more views, well spread and tilted"
        )
    reports = tuple(_report(c, cameras, usable[name], settled, board) for c, name in enumerate(names))
    return Calibration(cameras, reports, tuple(notes))


def _report(c: int, cameras: Cameras, views, settled: Settled, board: Board) -> CameraReport:
    camera, rows = cameras.cameras[c], settled.seen.camera == c
    sigma = np.sqrt(np.diag(cameras.covariance)[cameras.parameters_of(camera.name)][:9])
    poses = [board_pose(view, board.corners_mm, camera.lens) for view in views]
    return CameraReport(
        name=camera.name,
        views=len(views),
        corners=int((rows & settled.kept).sum()),
        left_out=int((rows & ~settled.kept).sum()),
        rms_px=camera.rms_px,
        error_px=float(settled.error_px[c]),
        coverage=coverage(views, camera.size_px),
        depth_ratio=depth_ratio(poses, views, board),
        tilt_deg=tilt_deg(poses),
        intrinsics_sigma=sigma,
    )
