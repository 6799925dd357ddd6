"""Where a board stands before calibrated cameras, by one picture of each that sees it."""

from collections.abc import Mapping

import numpy as np
from scipy.optimize import least_squares

from vision.boards.corners import Corners
from vision.calibration.first_guess import board_pose
from vision.geometry.board import Board
from vision.geometry.camera import Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import apply, compose, invert_transform, moved_pose

# [sigmas] RMS of corners about the board: more is no board that stands still before these cameras. Stated.
_MOST_SIGMAS = 8.0


def place_board(
    cameras: Cameras, views: Mapping[str, Corners], board: Board
) -> tuple[np.ndarray, np.ndarray]:
    """Return T_rig_board (3, 4) and its covariance (6, 6), of turns and shifts in the rig frame.

    views: by camera. The cameras count as exact. Raises Refused where none shows a pose, or the
    corners are not those of one board.
    """
    seen = {name: view for name, view in views.items() if name in cameras and len(view)}
    if not seen:
        raise Refused("no camera sees the board", code="object_points_elsewhere")
    T_first = _first_pose(cameras, seen, board)

    def residuals(step: np.ndarray) -> np.ndarray:
        """Return how far (n,) corners are off, over their sigma, after a step (6,)."""
        return _corners_off(cameras, seen, board, moved_pose(T_first, step))

    found = least_squares(residuals, np.zeros(6), x_scale=[1e-3] * 3 + [0.1] * 3)
    rms = float(np.sqrt(np.mean(found.fun**2)))
    if rms > _MOST_SIGMAS:
        raise Refused(
            f"corners of the board on the object are {rms:.0f} sigmas off those of one board: "
            "does it stand still, and are the cameras where they were calibrated?",
            code="object_points_elsewhere",
        )
    covariance = max(rms, 1.0) ** 2 * np.linalg.inv(found.jac.T @ found.jac)
    return moved_pose(T_first, found.x), covariance


def _corners_off(
    cameras: Cameras, seen: Mapping[str, Corners], board: Board, T_rig_board: np.ndarray
) -> np.ndarray:
    """Return how far (n,) the corners of a board in a pose (3, 4) are off, over their sigma."""
    off = []
    for name, view in seen.items():
        px = cameras[name].project(apply(T_rig_board, board.corners_mm[view.ids]))
        off.append(((px - view.px) / view.sigma_px[:, None]).ravel())
    return np.concatenate(off)


def _first_pose(cameras: Cameras, seen: Mapping[str, Corners], board: Board) -> np.ndarray:
    """Return T_rig_board (3, 4) by the camera that sees most corners. Raises Refused where these give
    none.
    """
    name = max(seen, key=lambda name: len(seen[name]))
    camera = cameras[name]
    T_camera_board = board_pose(seen[name], board.corners_mm, camera.lens)
    return compose(invert_transform(camera.T_camera_rig), T_camera_board)
