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
from dataclasses import dataclass, replace

import numpy as np

from vision.boards.corners import Corners
from vision.boards.static_board import camera_moved, mean_view
from vision.boards.sufficiency import (
    check_lenses,
    check_rig_view,
    check_views,
    check_work,
    coverage,
    depth_ratio,
    fixes_pose,
    tilt_deg,
    without_strays,
)
from vision.calibration.adjust import solve
from vision.calibration.board_motion import Trajectory
from vision.calibration.bundle import CAMERA_COLUMNS, CLOCK, N_BOARD, N_CAMERA, POSE, Priors, State
from vision.calibration.corner_noise import Settled, settle
from vision.calibration.first_guess import board_pose, first_lens, has_pose
from vision.calibration.layout import Alone, Layout, gather, lay_out, looked_at_once, place_cameras
from vision.calibration.place import by_board
from vision.calibration.views import BoardViews, MeasuredPose
from vision.geometry.board import Board
from vision.geometry.camera import N_PARAMETERS, Camera, Cameras
from vision.geometry.errors import Refused

__all__ = ["Calibration", "CameraReport", "calibrate_cameras", "camera_moved"]

# One sigma about zero of the distortion terms, for lenses of 3 to 100 mm; wider than any that is not a
# fisheye.
LENS_PRIOR = {"k1": 0.5, "k2": 0.5, "p1": 0.005, "p2": 0.005, "k3": 0.3}
# The board's warp enters where it lowers the cost by more than chance does once in 10 000 (two parameters).
_WARP_GAIN = 18.4
_WARP_SIGMA_MM = 2.0
# Cameras that share views were not triggered together where they agree this many times worse than each with itself.
_DISAGREE = 1.5
# Clock offsets and scatter of instants to begin with, in frame intervals.
_CLOCK_SIGMA = 0.6
_FIRST_LATENESS = 0.2
# What cameras may disagree by, px, before instants have been found.
_FIRST_EXCESS_PX = 0.1


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
class Timing:
    """Cameras that are not triggered together: offset_s and scatter_s (C,), how late pictures are on average and how
    much that varies; s, or frame intervals where the pictures' times were not given (in_frames)."""

    offset_s: np.ndarray
    scatter_s: np.ndarray
    in_frames: bool


@dataclass(frozen=True, eq=False)
class Calibration:
    """Cameras in the rig frame with their covariance, a report each, and notes in plain sentences.

    together: cameras looked at the board at once. timing: None where pictures of one view count as of one instant.
    board (3,): the board's relative size less 1, and its warps along x and y, mm.
    """

    cameras: Cameras
    report: tuple[CameraReport, ...]
    notes: tuple[str, ...]
    timing: Timing | None
    board: np.ndarray
    together: bool


def calibrate_cameras(
    views: BoardViews,
    board: Board,
    on_rig: MeasuredPose | None,
    *,
    work_points_mm: np.ndarray | None = None,
    triggered: bool = False,
) -> Calibration:
    """Calibrates all cameras in one adjustment.

    That cameras looked at the held board at once is found out from its views; their times help. on_rig: where the board
    stands on the rig; None for one camera or cameras that looked at once: then the world is the first camera's frame.
    work_points_mm (n, 3): where the whisker will be, which each camera's views must cover. triggered: pictures of one
    view are known to be of one instant, so that no other is looked for.

    Raises Refused, saying what to record, where the views cannot give a calibration.
    """
    alone = {n: _alone(n, views, board, on_rig is not None) for n in views.boards}
    standing = {n: _standing(views.rig[n], views.trials.get(n, ()), board) for n in alone} if on_rig else None
    together, T_rig_board = looked_at_once(alone), on_rig.T_rig_board if on_rig else None
    poses = place_cameras(alone, standing, board, T_rig_board, together=together)
    layout = lay_out(
        alone, poses, standing=standing, T_rig_board=T_rig_board, together=together, times_s=views.times_s
    )
    priors = _priors(layout.first, board, on_rig)
    settled, timing = _settle(layout, board, priors, _errors(alone, triggered), views.times_s is None)
    settled, notes = _settle_with_warp(layout, settled, board)
    if timing is not None:
        notes.append(_timing_note(alone, timing))
    calibration = _calibration(alone, views.sizes_px, settled, board, notes, timing, together)
    if on_rig is not None:
        placement = by_board(T_rig_board, on_rig.sigma_mm, on_rig.sigma_rad).covariance
        calibration = replace(calibration, cameras=replace(calibration.cameras, placement=placement))
    check_lenses(calibration.cameras, calibration.report, {n: a.views.values() for n, a in alone.items()})
    check_work(calibration.cameras, alone, standing, work_points_mm)
    return calibration


def _alone(name: str, views: BoardViews, board: Board, with_rig: bool) -> Alone:
    """A camera by itself: the start of the joint adjustment, and the error that it has when nobody else is asked."""
    size_px, rig_view = views.sizes_px[name], views.rig.get(name)
    seen = {k: without_strays(view, board) for k, view in enumerate(views.boards[name])}
    usable = {k: view for k, view in seen.items() if fixes_pose(view, board)}
    lens = first_lens(usable.values(), board.corners_mm, size_px)
    usable = {k: view for k, view in usable.items() if has_pose(view, board.corners_mm, lens)}
    check_views(name, usable.values(), board)
    if with_rig:
        check_rig_view(name, None if rig_view is None else without_strays(rig_view, board), board)
    settled = calibrate_alone(list(usable.values()), board, size_px, rough=True)
    state = settled.solution.state
    return Alone(state.lens[0], float(settled.error_px[0]), usable, dict(zip(usable, state.T_world_board)))


def _standing(rig_view: Corners, frames: Sequence[Corners], board: Board) -> Corners:
    """The board on the rig in one camera, over its picture and the trials' frames."""
    return mean_view(without_strays(rig_view, board), frames)


def calibrate_alone(
    views: Sequence[Corners], board: Board, size_px: tuple[int, int], *, rough: bool = False
) -> Settled:
    """One camera by itself, the world being the camera's frame. rough: robustly, as a start for more."""
    lens = first_lens(views, board.corners_mm, size_px)
    poses = np.array([board_pose(view, board.corners_mm, lens) for view in views])
    state = State(lens[None], np.eye(3, 4)[None], poses)
    priors = lens_priors(1, len(views))
    priors.free[POSE] = False
    seen = gather([(0, k, view) for k, view in enumerate(views)])
    return settle(state, seen, board.corners_mm, priors, rough=rough)


def lens_priors(n_cameras: int, n_views: int) -> Priors:
    """Lenses and poses free, the lenses' prior; board exact, cameras triggered together."""
    size = N_CAMERA * n_cameras + N_BOARD
    free, mean, sigma = np.ones(size, dtype=bool), np.zeros(size), np.full(size, np.inf)
    for column, name in enumerate(CAMERA_COLUMNS):
        rows = column + N_CAMERA * np.arange(n_cameras)
        sigma[rows] = LENS_PRIOR.get(name, np.inf)
        free[rows] = not name.endswith("_s")
    free[-N_BOARD:] = False
    return Priors(free, mean, sigma, np.ones(n_views, dtype=bool))


def _priors(first: State, board: Board, on_rig: MeasuredPose | None) -> Priors:
    """The rig board's pose as it was measured: held where its sigma is 0, else an observation. Likewise the square.

    Without a rig board the first camera is the world's frame.
    """
    priors = lens_priors(len(first.lens), len(first.T_world_board))
    if board.square_sigma_mm > 0:
        priors.free[-N_BOARD] = True
        priors.sigma[-N_BOARD] = board.square_sigma_mm / board.square_mm
    if on_rig is None:
        priors.free[POSE] = False
        return priors
    priors.view_free[0] = not on_rig.is_exact
    pose_sigma = np.repeat([max(on_rig.sigma_rad, 1e-9), max(on_rig.sigma_mm, 1e-7)], 3)
    return replace(priors, pose_view=0, pose_T=on_rig.T_rig_board, pose_sigma=pose_sigma)


def _settle_with_warp(layout: Layout, flat: Settled, board: Board) -> tuple[Settled, list[str]]:
    """With a warped board where that lowers the cost, at the flat board's noise, by more than chance would."""
    priors = allow_warp(flat.priors)
    warped = solve(flat.solution.state, flat.seen.chosen(flat.kept), board.corners_mm, priors, tolerance=1e-6)
    if flat.solution.cost - warped.cost < _WARP_GAIN:
        return flat, []
    settled = settle(warped.state, layout.seen, board.corners_mm, priors, error_px=flat.error_px, rounds=1)
    x, y = settled.solution.state.board[1:]
    return settled, [f"The board is bent by {x:+.3f} mm along x and {y:+.3f} mm along y; taken into account."]


def _errors(alone: Mapping[str, Alone], triggered: bool) -> np.ndarray | None:
    """Each camera's error by itself, against which to judge how they agree; None where there is no need to."""
    return None if triggered or len(alone) < 2 else np.array([a.error_px for a in alone.values()])


def _settle(layout: Layout, board: Board, priors: Priors, error_alone: np.ndarray | None, in_frames: bool):
    """With pictures of one view at one instant, unless cameras agree far worse with each other than with themselves."""
    if layout.trajectory is None or error_alone is None:
        return settle(layout.first, layout.seen, board.corners_mm, priors), None
    rough = settle(layout.first, layout.seen, board.corners_mm, priors, rough=True)
    if np.median(rough.error_px / np.maximum(error_alone, 1e-3)) < _DISAGREE:
        return settle(rough.solution.state, layout.seen, board.corners_mm, priors), None
    state = replace(rough.solution.state, trajectory=layout.trajectory)
    priors = allow_lateness(priors, layout.trajectory)
    settled = settle(state, layout.seen, board.corners_mm, priors, error_px=error_alone + _FIRST_EXCESS_PX)
    return settled, Timing(settled.solution.state.clock, settled.priors.late_sigma_s, in_frames)


def _timing_note(names, timing: Timing) -> str:
    scale, unit = (1.0, "frames") if timing.in_frames else (1e3, "ms")
    late = (
        f"{name} {scale * offset:+.3g} ± {scale * scatter:.2g} {unit}"
        for name, offset, scatter in zip(names, timing.offset_s, timing.scatter_s)
    )
    said = f"later than the view by {', '.join(late)} (below 0: earlier)"
    return f"Pictures of one view were not taken at one instant: {said}; taken into account."


def allow_lateness(priors: Priors, trajectory: Trajectory) -> Priors:
    """The same with clocks and pictures' instants free. The clock of the camera that ranks first is the clock."""
    free, sigma = priors.free.copy(), priors.sigma.copy()
    clocks = CLOCK + N_CAMERA * np.arange(len(trajectory.camera_rank))
    free[clocks[trajectory.camera_rank > 0]] = True
    sigma[clocks] = _CLOCK_SIGMA * trajectory.interval_s
    late = np.full(len(clocks), _FIRST_LATENESS * trajectory.interval_s)
    return replace(priors, free=free, sigma=sigma, late_sigma_s=late)


def allow_warp(priors: Priors) -> Priors:
    """The same with the board's two warps free."""
    free, sigma = priors.free.copy(), priors.sigma.copy()
    free[-2:], sigma[-2:] = True, _WARP_SIGMA_MM
    return replace(priors, free=free, sigma=sigma)


def as_cameras(names: Sequence[str], sizes_px: Mapping[str, tuple[int, int]], settled: Settled) -> Cameras:
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


def _calibration(alone, sizes_px, settled: Settled, board: Board, notes, timing, together: bool) -> Calibration:
    cameras = as_cameras(alone, sizes_px, settled)
    if not settled.solution.converged:
        raise Refused("the adjustment of the cameras did not come to rest: record more views, well spread and tilted")
    reports = tuple(_report(c, cameras, a, settled, board) for c, a in enumerate(alone.values()))
    return Calibration(cameras, reports, tuple(notes), timing, settled.solution.state.board, together)


def _report(c: int, cameras: Cameras, alone: Alone, settled: Settled, board: Board) -> CameraReport:
    camera, rows = cameras.cameras[c], settled.seen.camera == c
    views, poses = list(alone.views.values()), list(alone.poses.values())
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
        intrinsics_sigma=np.sqrt(np.diag(cameras.covariance)[cameras.parameters_of(camera.name)][:9]),
    )
