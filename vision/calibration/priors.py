"""What is known of cameras and board besides the pictures, and what an adjustment holds."""

from dataclasses import replace

import numpy as np

from vision.calibration.board_motion import Trajectory
from vision.calibration.bundle import (
    CAMERA_COLUMNS,
    CLOCK,
    N_BOARD,
    N_CAMERA,
    POSE,
    BundleState,
    Priors,
    SharedLenses,
)
from vision.calibration.views import MeasuredPose
from vision.geometry.board import Board

# One sigma about zero of the distortion terms, for lenses of 3 to 100 mm; wider than any that is not a
# fisheye.
LENS_PRIOR = {"k1": 0.5, "k2": 0.5, "p1": 0.005, "p2": 0.005, "k3": 0.3}
# [frame intervals] A prior: twice 1/√12, that of cameras that start at random within an interval.
# Derived. Study: cameras.py.
_CLOCK_SIGMA = 0.6
# [frame intervals] Where the fit of instants starts; learnt anew from the residuals. Study:
# cameras.py.
_FIRST_LATENESS = 0.2
# [1] Of the board's size, and of a radian: where the fit of the board's departures from its path starts;
# learnt anew. Study: cameras_montecarlo.py.
_FIRST_DEPARTURE = 1e-3


def lens_priors(
    n_cameras: int, n_views: int, board: Board, shared: SharedLenses | None = None
) -> Priors:
    """Return the priors with lenses, poses and the board's shape free, LENS_PRIOR on the lenses, an
    exact print, and cameras that are triggered together.

    shared: which cameras have one lens; None: each has its own.
    """
    camera_sigma = [LENS_PRIOR.get(name, np.inf) for name in CAMERA_COLUMNS]
    camera_free = [not name.endswith("_s") for name in CAMERA_COLUMNS]
    free = np.tile(camera_free, (n_cameras, 1))
    sigma = np.tile(camera_sigma, (n_cameras, 1))
    if shared is not None:
        free[shared.tied()] = False
        sigma[shared.tied()] = np.inf
    shape_sigma = board.shape_sigma
    return Priors(
        np.concatenate([free.ravel(), np.isfinite(shape_sigma), [False] * N_BOARD]),
        np.concatenate([sigma.ravel(), shape_sigma, [np.inf] * N_BOARD]),
        np.ones(n_views, dtype=bool),
        shared=shared,
        point_sigma_mm=board.point_sigma_mm,
    )


def pose_priors(n_cameras: int, n_views: int, board: Board) -> Priors:
    """Return the priors with the board's poses free, and the cameras and the board held."""
    priors = lens_priors(n_cameras, n_views, board)
    return replace(priors, free=np.zeros_like(priors.free), point_sigma_mm=0.0)


def camera_pose_priors(n_cameras: int, board: Board) -> Priors:
    """Return the priors with the cameras' poses free, and lenses, board and its one pose held."""
    priors = lens_priors(n_cameras, 1, board)
    free = np.zeros_like(priors.free)
    for k in range(n_cameras):
        free[N_CAMERA * k :][POSE] = True
    return replace(
        priors,
        free=free,
        sigma=np.full_like(priors.sigma, np.inf),
        view_free=np.zeros(1, dtype=bool),
    )


def with_print(priors: Priors, board: Board) -> Priors:
    """Return the priors with size and stretch of the board's print free where they have a sigma,
    and observed to be as stated within that.
    """
    sigmas = [board.square_sigma_mm / board.square_mm, board.stretch_sigma]
    return priors.observed(slice(-N_BOARD, -2), sigmas)


def joint_priors(
    first: BundleState, board: Board, on_rig: MeasuredPose | None, shared: SharedLenses
) -> Priors:
    """Return the priors with the rig board's measured pose and the print's size and stretch, each
    held where its sigma is 0 and an observation else.

    Without a rig board the first camera is the world's frame.
    """
    priors = lens_priors(len(first.lens), len(first.T_world_board), board, shared)
    priors = with_print(priors, board)
    if on_rig is None:
        priors.free[POSE] = False
        return priors
    priors.view_free[0] = not on_rig.is_exact
    pose_sigma = np.repeat([max(on_rig.sigma_rad, 1e-9), max(on_rig.sigma_mm, 1e-7)], 3)
    return replace(priors, pose_view=0, pose_T=on_rig.T_rig_board, pose_sigma=pose_sigma)


def allow_lateness(priors: Priors, trajectory: Trajectory, board: Board) -> Priors:
    """Return the priors with clocks, pictures' instants and the board's departures from its path free, and
    the board's points held; the clock of the camera that ranks first is held, too.
    """
    free = priors.free.copy()
    sigma = priors.sigma.copy()
    clocks = CLOCK + N_CAMERA * np.arange(len(trajectory.camera_rank))
    clock_of = priors.shared.first
    is_own = clock_of == np.arange(len(clocks))
    is_late = clock_of != clock_of[np.argmin(trajectory.camera_rank)]
    free[clocks[is_own & is_late]] = True
    sigma[clocks[is_own]] = _CLOCK_SIGMA * trajectory.interval_s
    late_s = _FIRST_LATENESS * trajectory.interval_s
    turn_rad = [_FIRST_DEPARTURE] * 3
    shift_mm = [_FIRST_DEPARTURE * np.ptp(board.corners_mm, axis=0).max()] * 3
    own = np.tile([late_s, *turn_rad, *shift_mm], (len(clocks), 1))
    return replace(priors, free=free, sigma=sigma, picture_sigma=own, point_sigma_mm=0.0)
