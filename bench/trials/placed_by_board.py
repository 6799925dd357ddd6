"""Where a bar stands by pictures of a board that is fixed to it, of a trial that has traces and no pictures."""

import numpy as np

from bench.session.object_board import board_on_object
from bench.session.session import Session
from bench.session.trial import Trial
from vision.calibration import place_board
from vision.geometry import BarAxis, Cameras, apply, skew


def place_by_board(session: Session, trial: Trial, cameras: Cameras) -> tuple[BarAxis, np.ndarray]:
    """Return the bar's axis in the rig frame, and sigmas (4,): of two shifts, mm, and two tilts, rad.

    Raises BadInput for a picture that cannot be read or shows no board, Refused where pictures contradict each other.
    """
    stated = trial.object
    views = board_on_object(trial, session.board)
    T_rig_board, covariance = place_board(cameras, views, session.board)
    turn = T_rig_board[:, :3]
    point_mm = apply(T_rig_board, np.array([stated.board_point_mm], dtype=float))[0]
    direction = turn @ np.array(stated.board_axis, dtype=float)
    axis = BarAxis(point_mm, direction / np.linalg.norm(direction)).upward()
    by_pose = np.column_stack([-skew(point_mm - T_rig_board[:, 3]), np.eye(3)])  # (3, 6)
    shift_mm = np.hypot(_largest(by_pose @ covariance @ by_pose.T), stated.board_point_sigma_mm)
    tilt_rad = np.hypot(_largest(covariance[:3, :3]), np.radians(stated.board_axis_sigma_deg))
    return axis, np.repeat([shift_mm, tilt_rad], 2)


def _largest(covariance: np.ndarray) -> float:
    """Return the largest standard deviation of a covariance (n, n) in any direction."""
    return float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
