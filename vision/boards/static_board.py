"""The board on the rig: one view a camera from its picture and all frames of the trials.

In the frames the bar, the hub and the wire hide some corners and lie close to others. A corner near
something dark is pulled by it, always the same way while that thing stays, so averaging does not
help: what disagrees with the unobstructed rig picture is left out.
"""

from collections.abc import Sequence

import numpy as np

from vision.boards.corners import Corners
from vision.geometry.camera import Camera
from vision.geometry.refusals import Refused

# [sigma] Beyond, a frame's corner is another thing than the rig picture's: one Gaussian corner in
# 8000 is, on either axis. Derived.
_DISTURBED_SIGMA = 4.0
# [1] Of the median miss, where that is larger than the sigmas: a corner beyond was hidden or
# disturbed. Of sound corners, whose misses are Rayleigh distributed, 1.3 % are. Derived.
_DISTURBED_MEDIANS = 2.5
# [corners] Twelve coordinates for the six parameters of a motion. Derived.
_FEWEST_CORNERS = 6


def mean_view(rig_view: Corners, frames: Sequence[Corners]) -> Corners:
    """Average each corner over the rig picture and the frames, weighted, in the order of ids.

    Corners that the rig picture lacks are compared with their median over the frames.
    """
    seen = Corners.join([rig_view, *frames])
    ids = np.unique(seen.ids)
    means = []
    sigmas = []
    for corner in ids:
        mean, sigma = _mean_corner(seen.select(seen.ids == corner), corner in rig_view.ids)
        means.append(mean)
        sigmas.append(sigma)
    return Corners(ids, means, sigmas)


def _mean_corner(seen: Corners, first_is_rig: bool) -> tuple[np.ndarray, float]:
    """Return the mean (2,) of one corner over all pictures that show it undisturbed, and its sigma.

    first_is_rig: whether the first place is that of the rig picture.
    """
    px = seen.px
    sigma_px = seen.sigma_px
    reference = px[0] if first_is_rig else np.median(px, axis=0)
    reference_sigma_px = sigma_px[0] if first_is_rig else 0.0
    limit_px = _DISTURBED_SIGMA * np.hypot(sigma_px, reference_sigma_px)
    is_near = np.all(np.abs(px - reference) < limit_px[:, None], axis=1)
    if not is_near.any():
        return px[0], sigma_px[0]
    precision = 1.0 / sigma_px[is_near] ** 2
    return precision @ px[is_near] / precision.sum(), float(precision.sum() ** -0.5)


def camera_moved(camera: Camera, corners: Corners, board_mm: np.ndarray) -> tuple[float, float]:
    """Return how far the rig board has moved in this camera's picture, px, and one sigma of it.

    board_mm (m, 3): the board's corners as printed, in the rig frame. A small motion of the camera
    (turn and shift) is fitted to where the corners are now; the shift is what that motion does to
    them, root mean square. Corners that do not follow the rest (hidden, disturbed) are left out.
    Raises Refused with fewer than six corners.
    """
    if len(corners) < _FEWEST_CORNERS:
        raise Refused(
            f"camera {camera.name}: {len(corners)} corners of the rig board in view, "
            f"{_FEWEST_CORNERS} are needed to tell whether it moved"
        )
    px, _, by_camera = camera.project_with_jacobians(board_mm[corners.ids])
    J = by_camera[:, :, 9:]  # (n, 2, 6) by the camera's pose
    residual = corners.px - px
    sigma_px = np.hypot(corners.sigma_px, np.nan_to_num(camera.rms_px) / np.sqrt(2))
    motion, covariance = _fit_motion(J, residual, sigma_px)
    shift_px = np.linalg.norm(J @ motion, axis=1)
    variance = np.einsum("nij,jk,nik->n", J, covariance, J)
    return float(np.sqrt(np.mean(shift_px**2))), float(np.sqrt(np.mean(variance)))


def _fit_motion(
    J: np.ndarray, residual: np.ndarray, sigma_px: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Fit the camera's motion (6,) without disturbed corners; return it with its covariance (6, 6).

    J (n, 2, 6), residual (n, 2) px, sigma_px (n,).
    """
    scale = np.linalg.norm(J, axis=(0, 1))  # of rad and mm
    design = J / scale / sigma_px[:, None, None]
    target = residual / sigma_px[:, None]
    kept = np.ones(len(J), dtype=bool)
    for _ in range(3):
        rows = design[kept].reshape(-1, J.shape[2])
        covariance = np.linalg.pinv(rows.T @ rows, hermitian=True)
        motion = covariance @ (rows.T @ target[kept].ravel())
        misfit = np.linalg.norm(target - design @ motion, axis=1)
        kept = misfit < max(_DISTURBED_SIGMA, _DISTURBED_MEDIANS * np.median(misfit))
    return motion / scale, covariance / np.outer(scale, scale)
