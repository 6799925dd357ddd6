"""The board that stands on the rig: one view a camera from its picture and all frames of the trials.

In the frames the bar, the hub and the wire hide some corners and lie close to others. A corner beside
something dark is pulled by it, always the same way while that thing stays, so averaging does not help: what
disagrees with the unobstructed rig picture is left out.
"""

from collections.abc import Sequence

import numpy as np

from vision.boards.corners import Corners
from vision.geometry.board import Board
from vision.geometry.camera import Camera
from vision.geometry.refusals import Refused

# [sigma] Beyond, a frame's corner is another thing than the rig picture's: one Gaussian corner in
# 8000 is, on either axis. Derived.
_DISTURBED_SIGMA = 4.0
# [1] Of the median miss, where that is larger than the sigmas: a corner beyond was hidden or
# disturbed. Set by eye.
_DISTURBED_MEDIANS = 2.5
# [corners] Twelve coordinates for the six parameters of a motion. Derived.
_FEWEST_CORNERS = 6


def mean_view(rig_view: Corners, frames: Sequence[Corners]) -> Corners:
    """Weighted mean of each corner over the rig picture and the frames, in the order of ids.

    Corners that the rig picture lacks are compared with their median over the frames.
    """
    views = [rig_view, *frames]
    ids = np.concatenate([v.ids for v in views])
    px = np.concatenate([v.px for v in views])
    sigma = np.concatenate([v.sigma_px for v in views])
    means = [_mean_corner(px[ids == i], sigma[ids == i], i in rig_view.ids) for i in np.unique(ids)]
    return Corners(np.unique(ids), [m[0] for m in means], [m[1] for m in means])


def _mean_corner(px: np.ndarray, sigma: np.ndarray, first_is_rig: bool) -> tuple[np.ndarray, float]:
    reference, its_sigma = (px[0], sigma[0]) if first_is_rig else (np.median(px, axis=0), 0.0)
    near = np.all(
        np.abs(px - reference) < _DISTURBED_SIGMA * np.hypot(sigma, its_sigma)[:, None], axis=1
    )
    if not near.any():
        return px[0], sigma[0]
    weight = 1.0 / sigma[near] ** 2
    return weight @ px[near] / weight.sum(), float(weight.sum() ** -0.5)


def camera_moved(
    camera: Camera, corners: Corners, board: Board, T_rig_board: np.ndarray
) -> tuple[float, float]:
    """How far the rig board has moved in this camera's picture, px, and one sigma: (shift_px, sigma_px).

    A small motion of the camera (turn and shift) is fitted to where the corners are now; the shift is what
    that motion does to them, root mean square. Corners that do not follow the rest (hidden, disturbed) are
    left out. Raises Refused with fewer than six corners.
    """
    if len(corners) < _FEWEST_CORNERS:
        raise Refused(
            f"camera {camera.name}: {len(corners)} corners of the rig board in view, {_FEWEST_CORNERS} are needed to "
            "tell whether it moved"
        )
    points = board.corners_mm[corners.ids] @ T_rig_board[:, :3].T + T_rig_board[:, 3]
    px, _, by_camera = camera.project_with_jacobians(points)
    J, off = by_camera[:, :, 9:], corners.px - px
    sigma = np.hypot(corners.sigma_px, np.nan_to_num(camera.rms_px) / np.sqrt(2))
    kept = np.ones(len(off), dtype=bool)
    for _ in range(3):
        motion, covariance = _least_squares(J[kept], off[kept], sigma[kept])
        miss = np.linalg.norm(off - J @ motion, axis=1) / sigma
        kept = miss < max(_DISTURBED_SIGMA, _DISTURBED_MEDIANS * np.median(miss))
    return _rms_and_sigma(J, motion, covariance)


def _least_squares(
    J: np.ndarray, off: np.ndarray, sigma: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    J, off = (J / sigma[:, None, None]).reshape(-1, J.shape[2]), (off / sigma[:, None]).ravel()
    scale = np.linalg.norm(J, axis=0)
    covariance = np.linalg.pinv((J / scale).T @ (J / scale), hermitian=True) / np.outer(
        scale, scale
    )
    return covariance @ (J.T @ off), covariance


def _rms_and_sigma(
    J: np.ndarray, motion: np.ndarray, covariance: np.ndarray
) -> tuple[float, float]:
    """Of the displacements J motion: RMS length, and its sigma (the RMS that noise alone would give)."""
    displacement = J @ motion
    spread = np.einsum("nij,jk,nik->n", J, covariance, J)
    return float(np.sqrt(np.mean(np.sum(displacement**2, axis=1)))), float(np.sqrt(np.mean(spread)))
