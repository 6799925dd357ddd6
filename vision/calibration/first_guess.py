"""Where the adjustment starts: focal length, board poses by one camera, cameras by shared views.

Good to a few percent, which suffices: the adjustment (`vision.calibration.adjust`) forgets where it
began.
"""

from collections.abc import Hashable, Mapping, Sequence
from typing import TypeVar

import cv2
import numpy as np

from vision.boards.corners import Corners
from vision.boards.homography import fit_homography
from vision.geometry import lens as lens_model
from vision.geometry.refusals import Refused
from vision.geometry.rotation import angle_between, apply, compose, invert_transform

# [picture widths] 150° to 3° across: where a camera on a bench lies. Derived.
_FOCAL_LIMITS = (0.15, 20.0)
# [1] Thickness over size below which points are in a plane: rounding. Derived.
_FLAT = 1e-9
Name = TypeVar("Name", bound=Hashable)
View = TypeVar("View", bound=Hashable)


def focal_length_px(
    views: Sequence[Corners], corners_mm: np.ndarray, size_px: tuple[int, int]
) -> float:
    """Return the focal length from the homographies of plane views (Zhang 2000).

    The principal point is taken as the middle of the picture. With h1, h2 the first columns of
    K⁻¹H: h1 · h2 = 0 and |h1| = |h2|, both linear in (width/f)²; their weighted median is not
    carried off by a view gone wrong, as OpenCV's least squares is. Returns the picture's width
    where no view is tilted enough.
    """
    width = size_px[0]
    equations = [_focal_equations(view, corners_mm, size_px) for view in views]
    coefficients, constants = np.concatenate([np.zeros((0, 2)), *equations]).T
    is_determined = coefficients != 0.0
    if not np.any(is_determined):
        return float(width)
    coefficients = coefficients[is_determined]
    inverse_squares = constants[is_determined] / coefficients
    inverse_square = _weighted_median(inverse_squares, coefficients**2)
    least, most = _FOCAL_LIMITS
    if not most**-2 < inverse_square < least**-2:
        return float(width)
    return float(width / np.sqrt(inverse_square))


def _weighted_median(values: np.ndarray, weights: np.ndarray) -> float:
    """Return the value with half of the weight on either side."""
    order = np.argsort(values)
    cumulated = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(cumulated, 0.5 * cumulated[-1])])


def _focal_equations(view: Corners, corners_mm: np.ndarray, size_px: tuple[int, int]) -> np.ndarray:
    """Return rows (2, 2): coefficient · (width/f)² = constant, of one view; none without
    homography.
    """
    middle_px = 0.5 * (np.array(size_px) - 1)
    in_widths = (view.px - middle_px) / size_px[0]
    H = fit_homography(corners_mm[view.ids, :2], in_widths)
    if H is None:
        return np.zeros((0, 2))
    # Pictures of the board's x and y: across, in widths, and the part along the optical axis.
    (x_1, y_1, z_1), (x_2, y_2, z_2) = (H[:, :2] / np.linalg.norm(H[:, :2])).T
    at_right_angles = [x_1 * x_2 + y_1 * y_2, -z_1 * z_2]
    of_equal_length = [x_1**2 + y_1**2 - x_2**2 - y_2**2, z_2**2 - z_1**2]
    return np.array([at_right_angles, of_equal_length])


def first_lens(
    views: Sequence[Corners], corners_mm: np.ndarray, size_px: tuple[int, int]
) -> np.ndarray:
    """Return nine lens parameters to begin with: one focal length, the principal point in the
    middle, no distortion.
    """
    width, height = size_px
    focal_px = focal_length_px(views, corners_mm, size_px)
    return np.array([focal_px, focal_px, 0.5 * (width - 1), 0.5 * (height - 1), 0, 0, 0, 0, 0])


def board_pose(view: Corners, corners_mm: np.ndarray, lens: np.ndarray) -> np.ndarray:
    """Return T_camera_board (3, 4) of one view: of points in a plane the better of its two mirrored
    poses (IPPE), of others the pose of least squares (SQPnP).

    Raises Refused where its corners give none.
    """
    ab = lens_model.unproject(view.px, lens)
    is_known = np.all(np.isfinite(ab), axis=1)
    points_mm = corners_mm[view.ids[is_known]]
    solved, turns, shifts, _ = cv2.solvePnPGeneric(
        points_mm, ab[is_known][:, None], np.eye(3), None, flags=_pose_method(points_mm)
    )
    if solved:
        T = np.column_stack([cv2.Rodrigues(turns[0])[0], shifts[0]])
        if not np.any(apply(T, points_mm)[:, 2] <= 0):
            return T
    raise Refused(
        f"a view of {len(view)} corners gives no board pose: corners along one line, or a wrong "
        "board"
    )


def _pose_method(points_mm: np.ndarray) -> int:
    """Return OpenCV's method for the pose of points (n, 3) in a plane, or not in one."""
    spread = np.linalg.svd(points_mm - points_mm.mean(axis=0), compute_uv=False)
    is_plane = spread[-1] <= _FLAT * spread[0]
    return cv2.SOLVEPNP_IPPE if is_plane else cv2.SOLVEPNP_SQPNP


def has_pose(view: Corners, corners_mm: np.ndarray, lens: np.ndarray) -> bool:
    """Return whether a view has a board pose."""
    try:
        return bool(np.isfinite(board_pose(view, corners_mm, lens)).all())
    except Refused:
        return False


def with_pose(
    views: Mapping[int, Corners], corners_mm: np.ndarray, lens: np.ndarray
) -> dict[int, Corners]:
    """Return by index the views in which a lens gives the board a pose."""
    return {k: view for k, view in views.items() if has_pose(view, corners_mm, lens)}


def chain_cameras(poses: Mapping[str, Mapping[int, np.ndarray]]) -> dict[str, np.ndarray]:
    """Return T_camera_world of every camera, the world being the first camera's frame.

    poses[camera][k]: T_camera_board of view k. Raises Refused where cameras share no view.
    """
    T_camera_world = chain_poses(poses)
    for name in poses:
        if name not in T_camera_world:
            raise Refused(
                f"camera {name} never sees the board at the same time as another: record such views"
            )
    return T_camera_world


def chain_poses(poses: Mapping[Name, Mapping[View, np.ndarray]]) -> dict[Name, np.ndarray]:
    """Return T_thing_first of each thing that is tied to the first one, by what both have seen.

    Things are added one by one, each by what it saw together with one of those before.
    poses[thing][k]: of view k before that thing.
    """
    first = next(iter(poses))
    T_thing_first = {first: np.eye(3, 4)}
    while len(T_thing_first) < len(poses):
        relative: list[np.ndarray] = []
        for a in T_thing_first:
            for b in poses:
                shared = [] if b in T_thing_first else relative_poses(poses[a], poses[b])
                if len(shared) > len(relative):
                    relative = shared
                    known = a
                    added = b
        if not relative:
            break
        T_thing_first[added] = compose(most_central(relative), T_thing_first[known])
    return T_thing_first


def relative_poses(
    poses_a: Mapping[View, np.ndarray], poses_b: Mapping[View, np.ndarray]
) -> list[np.ndarray]:
    """Return T_b_a (3, 4) by each view that both cameras have, from their T_camera_board."""
    shared = sorted(poses_a.keys() & poses_b.keys())
    return [compose(poses_b[k], invert_transform(poses_a[k])) for k in shared]


def most_central(transforms: Sequence[np.ndarray]) -> np.ndarray:
    """Return the transform that is nearest to the others: a mirrored pose is far from all of them.

    transforms: (3, 4) each.
    """
    stacked = np.array(transforms)
    distance = transform_distances(stacked, stacked)
    return transforms[int(np.argmin(np.median(distance, axis=1)))]


def transform_distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return how far transforms a (n, 3, 4) are from transforms b (m, 3, 4), (n, m).

    It is the sum of the angle between them, rad, and the difference of their shifts over the median
    shift of b.
    """
    a = a[:, None]  # (n, 1, 3, 4), against each of b
    angle = angle_between(a[..., :3], b[..., :3])
    shift_mm = np.linalg.norm(a[..., 3] - b[..., 3], axis=-1)
    usual_mm = float(np.median(np.linalg.norm(b[..., 3], axis=-1)))
    return angle + shift_mm / max(usual_mm, 1e-9)
