"""Where the adjustment starts: focal length from homographies, board poses by one camera, cameras by shared
views.

Good to a few percent, which is all that is asked of it: the adjustment (`vision.calibration.bundle`) forgets where it
began.
"""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np

from vision.boards.corners import Corners
from vision.geometry import lens as lens_model
from vision.geometry.refusals import Refused
from vision.geometry.rotation import compose, invert_transform, log_rotation

# [picture widths] 150° to 3° across: where a camera on a bench lies. Derived.
_FOCAL_LIMITS = (0.15, 20.0)


def focal_length_px(
    views: Sequence[Corners], corners_mm: np.ndarray, size_px: tuple[int, int]
) -> float:
    """Focal length from the homographies of plane views (Zhang 2000), the principal point taken as the
    middle.

    With h1, h2 the first columns of K⁻¹H: h1 · h2 = 0 and |h1| = |h2|, both linear in 1/f². The picture's
    width where no view is tilted enough to say.
    """
    equations = [_focal_equations(view, corners_mm, size_px) for view in views]
    left, right = np.concatenate(equations).T if equations else np.zeros((2, 1))
    inverse_square = _weighted_median(right / np.where(left == 0, np.inf, left), left**2)
    focal = size_px[0] / np.sqrt(inverse_square) if inverse_square > 0 else np.inf
    low, high = (limit * size_px[0] for limit in _FOCAL_LIMITS)
    return float(focal) if low < focal < high else float(size_px[0])


def _weighted_median(values: np.ndarray, weights: np.ndarray) -> float:
    """Half of the weight lies on either side; one view gone wrong cannot carry it off."""
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    return (
        float(values[order][np.searchsorted(reached, 0.5 * reached[-1])])
        if reached[-1] > 0
        else 0.0
    )


def _focal_equations(view: Corners, corners_mm: np.ndarray, size_px: tuple[int, int]) -> np.ndarray:
    """Rows (left, right) of left · (width/f)² = right, two a view; the picture in widths from its middle."""
    picture = (view.px - 0.5 * (np.array(size_px) - 1)) / size_px[0]
    H, _ = cv2.findHomography(corners_mm[view.ids, :2], picture, 0)
    if H is None:
        return np.zeros((0, 2))
    H = H / np.sqrt(np.sum(H[:, :2] ** 2))
    (a, b), (c, d), (e, f) = H[0, :2], H[1, :2], H[2, :2]
    return np.array([[a * b + c * d, -e * f], [a * a + c * c - b * b - d * d, f * f - e * e]])


def first_lens(
    views: Sequence[Corners], corners_mm: np.ndarray, size_px: tuple[int, int]
) -> np.ndarray:
    """Nine lens parameters to begin with: one focal length, principal point in the middle, no distortion."""
    focal = focal_length_px(views, corners_mm, size_px)
    return np.array([focal, focal, 0.5 * (size_px[0] - 1), 0.5 * (size_px[1] - 1), 0, 0, 0, 0, 0])


def board_pose(view: Corners, corners_mm: np.ndarray, lens: np.ndarray) -> np.ndarray:
    """T_camera_board (3, 4) of one view, the better of a plane's two mirrored poses (IPPE). Raises Refused where its
    corners give none."""
    ab = lens_model.unproject(view.px, lens)
    seen = np.all(np.isfinite(ab), axis=1)
    points = corners_mm[view.ids[seen]]
    solved, turns, shifts, _ = cv2.solvePnPGeneric(
        points, ab[seen][:, None], np.eye(3), None, flags=cv2.SOLVEPNP_IPPE
    )
    if not solved or np.any(points @ cv2.Rodrigues(turns[0])[0][2] + shifts[0][2] <= 0):
        raise Refused(
            f"a view of {len(view)} corners gives no board pose: corners along one line, or a wrong board"
        )
    return np.column_stack([cv2.Rodrigues(turns[0])[0], shifts[0].ravel()])


def has_pose(view: Corners, corners_mm: np.ndarray, lens: np.ndarray) -> bool:
    """Does `board_pose` find one?"""
    try:
        return bool(np.isfinite(board_pose(view, corners_mm, lens)).all())
    except Refused:
        return False


def chain_cameras(poses: Mapping[str, Sequence[np.ndarray | None]]) -> dict[str, np.ndarray]:
    """T_camera_world of every camera, the world being the first camera's frame, from boards seen at once.

    poses[camera][k]: T_camera_board of view k, None where not seen. Raises Refused where cameras share no
    view.
    """
    names = list(poses)
    placed = {names[0]: np.eye(3, 4)}
    while len(placed) < len(names):
        a, b = max(
            ((a, b) for a in placed for b in names if b not in placed),
            key=lambda pair: len(_shared(poses[pair[0]], poses[pair[1]])),
        )
        relative = _shared(poses[a], poses[b])
        if not relative:
            raise Refused(
                f"camera {b} never sees the board at the same time as another: record such views"
            )
        placed[b] = compose(most_central(relative), placed[a])
    return placed


def _shared(
    poses_a: Sequence[np.ndarray | None], poses_b: Sequence[np.ndarray | None]
) -> list[np.ndarray]:
    """T_b_a from each view that both cameras have."""
    return [
        compose(b, invert_transform(a))
        for a, b in zip(poses_a, poses_b)
        if a is not None and b is not None
    ]


def most_central(transforms: Sequence[np.ndarray]) -> np.ndarray:
    """The transform whose turn is nearest to the others': a mirrored pose is far from all of them."""
    turns, shifts = np.array(transforms)[:, :, :3], np.array(transforms)[:, :, 3]
    apart = np.linalg.norm(log_rotation(turns[:, None] @ np.swapaxes(turns, 1, 2)[None]), axis=2)
    size = np.median(np.linalg.norm(shifts, axis=1))
    apart += np.linalg.norm(shifts[:, None] - shifts[None], axis=2) / max(size, 1e-9)
    return transforms[int(np.argmin(np.median(apart, axis=1)))]
