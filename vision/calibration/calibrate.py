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
from vision.boards.coverage import check_work, coverage
from vision.boards.static_board import camera_moved, mean_view
from vision.boards.sufficiency import (
    check_errors,
    check_lenses,
    check_rig_view,
    check_views,
    depth_ratio,
    fixes_pose,
    tilt_deg,
    without_strays,
)
from vision.calibration.adjust import adjust_bundle
from vision.calibration.bundle import N_CAMERA, POSE, BundleState, Priors
from vision.calibration.corner_noise import Settled, settle
from vision.calibration.first_guess import board_pose, first_lens, has_pose
from vision.calibration.layout import Alone, Layout, gather
from vision.calibration.place import by_board
from vision.calibration.tied import Tied, Timing, lens_priors, timing_note
from vision.calibration.views import BoardViews, MeasuredPose
from vision.geometry.board import Board
from vision.geometry.camera import N_PARAMETERS, Camera, Cameras
from vision.geometry.refusals import Refused

__all__ = ["Calibration", "CameraReport", "calibrate_cameras", "camera_moved"]

# [chi²] Two parameters gain more once in 10 000: −2 ln 1e-4. Derived.
_WARP_GAIN = 18.4
# [mm] A prior, wider than any print bows. moves nothing on the fixtures between 0.5 and 10 (they
# do not call for a warp). Study: thresholds.py calibration.calibrate _WARP_SIGMA_MM ….
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
    standing = (
        {n: _standing(views.rig[n], views.trials.get(n, ()), board) for n in alone}
        if on_rig
        else None
    )
    layout, settled, timing, notes = Tied(
        alone, standing, board, on_rig, views.times_s, triggered
    ).adjusted()
    together = layout.trajectory is not None
    settled, warp = _settle_with_warp(layout, settled, board)
    notes = [*notes, *warp]
    if not triggered:
        check_errors(alone, settled.error_px)
    if timing is not None:
        notes.append(timing_note(alone, timing))
    calibration = _calibration(alone, views.sizes_px, settled, board, notes, timing, together)
    if on_rig is not None:
        placement = by_board(on_rig.T_rig_board, on_rig.sigma_mm, on_rig.sigma_rad).covariance
        calibration = replace(
            calibration, cameras=replace(calibration.cameras, placement=placement)
        )
    check_lenses(
        calibration.cameras, calibration.report, {n: a.views.values() for n, a in alone.items()}
    )
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
    return Alone(
        state.lens[0], float(settled.error_px[0]), usable, dict(zip(usable, state.T_world_board))
    )


def _standing(rig_view: Corners, frames: Sequence[Corners], board: Board) -> Corners:
    """The board on the rig in one camera, over its picture and the trials' frames."""
    return mean_view(without_strays(rig_view, board), frames)


def calibrate_alone(
    views: Sequence[Corners], board: Board, size_px: tuple[int, int], *, rough: bool = False
) -> Settled:
    """One camera by itself, the world being the camera's frame. rough: robustly, as a start for more."""
    lens = first_lens(views, board.corners_mm, size_px)
    poses = np.array([board_pose(view, board.corners_mm, lens) for view in views])
    state = BundleState(lens[None], np.eye(3, 4)[None], poses)
    priors = lens_priors(1, len(views))
    priors.free[POSE] = False
    seen = gather([(0, k, view) for k, view in enumerate(views)])
    return settle(state, seen, board.corners_mm, priors, rough=rough)


def _settle_with_warp(layout: Layout, flat: Settled, board: Board) -> tuple[Settled, list[str]]:
    """With a warped board where that lowers the cost, at the flat board's noise, by more than chance would."""
    priors = allow_warp(flat.priors)
    warped = adjust_bundle(
        flat.solution.state, flat.seen.chosen(flat.kept), board.corners_mm, priors, tolerance=1e-6
    )
    if flat.solution.cost - warped.cost < _WARP_GAIN:
        return flat, []
    settled = settle(
        warped.state, layout.seen, board.corners_mm, priors, error_px=flat.error_px, rounds=1
    )
    x, y = settled.solution.state.board[1:]
    return settled, [
        f"The board is bent by {x:+.3f} mm along x and {y:+.3f} mm along y; taken into account."
    ]


def allow_warp(priors: Priors) -> Priors:
    """The same with the board's two warps free."""
    free, sigma = priors.free.copy(), priors.sigma.copy()
    free[-2:], sigma[-2:] = True, _WARP_SIGMA_MM
    return replace(priors, free=free, sigma=sigma)


def as_cameras(
    names: Sequence[str], sizes_px: Mapping[str, tuple[int, int]], settled: Settled
) -> Cameras:
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


def _calibration(
    alone, sizes_px, settled: Settled, board: Board, notes, timing, together: bool
) -> Calibration:
    cameras = as_cameras(alone, sizes_px, settled)
    if not settled.solution.converged:
        raise Refused(
            "the adjustment of the cameras did not come to rest: record more views, well spread and tilted"
        )
    reports = tuple(_report(c, cameras, a, settled, board) for c, a in enumerate(alone.values()))
    return Calibration(
        cameras, reports, tuple(notes), timing, settled.solution.state.board, together
    )


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
        intrinsics_sigma=np.sqrt(
            np.diag(cameras.covariance)[cameras.parameters_of(camera.name)][:9]
        ),
    )
