"""Whether views suffice for a calibration, and what to record where they do not."""

from collections.abc import Collection, Iterable, Mapping, Sequence

import cv2
import numpy as np

from vision.boards.corners import Corners, by_face
from vision.geometry.board import Board
from vision.geometry.camera import Camera, Cameras
from vision.geometry.lens import fold_radius
from vision.geometry.refusals import Refused
from vision.geometry.rotation import apply

# [corners] Six over at least two rows and columns give a pose with something left over. Derived.
MIN_VIEW_CORNERS = 6
# [views] Each adds 6 unknowns to the lens's 9; below, the lens rests on three or four independent
# directions. Derived.
MIN_VIEWS = 5
# [1] Weakest over strongest of a homography's directions: 0.4 for a whole board, 0.16 for two
# rows of seven corners, 0 for a line, or a line and one corner near it. Study:
# tests/vision/calibration/test_calibrate.py.
_LEAST_STRENGTH = 0.05
# [1] A lens bends a board out of a plane's picture by less than this share of its size. Study:
# tests/vision/calibration/test_calibrate.py.
_STRAY_SHARE = 0.04
# [px] Or by less than this. Study: tests/vision/calibration/test_calibrate.py.
_STRAY_PX = 3.0
# [1] Share of the focal length. Origin not known; the lab's is 0.0003. Study: calibrate cameras,
# its notes.
_MOST_FOCAL_SIGMA = 0.02
# [focal lengths] From the middle of a picture to its corner: 87°, more than any lens here has.
# Stated.
_MOST_REACH = 20.0
# [1] Fx over fy against what it should be: real ones differ by less than 1 %; three times that.
# Stated.
_MOST_ASPECT = 0.03
# [1] Fx over fy of pictures that a camera squashed from 16:9 to 4:3, or from 4:3 to 16:9. Derived.
SQUASHED = (3.0 / 4.0, 4.0 / 3.0)
# [1] Decentring shifts the picture's rim by p r² f, some 1e-3 f at most; fifty times that.
# Stated.
_MOST_DECENTRING = 0.05
# [1] The rim of the picture against its middle. Stated: it makes a refusal, and enters no number.
# Study: calibrate cameras, its notes.
_MOST_MAGNIFICATION = 2.0
# [px] Model error an axis beyond the corners' own sigma: webcams that nobody triggered leave 0.18
# once instants are fitted (multi4_b), cameras by themselves 0.0 to 0.06; twice that. Study:
# tests/vision/calibration/test_held_out.py, calibrate cameras, its notes.
MOST_ERROR_PX = 0.4
# [1] Share of the way to the picture's corner: a lens may fold in the very corners, where no
# board is ever seen, but not before. Stated.
_LEAST_REACH = 0.7


def without_strays(view: Corners, board: Board) -> Corners:
    """Return the corners of each face that lie as on a plane, however a lens bends its picture.

    Of a face where too few do (a mislabelled board) none remain.
    """
    return Corners.join(
        [Corners.none(), *(_on_plane(part, board) for part in by_face(view, board))]
    )


def _on_plane(view: Corners, board: Board) -> Corners:
    """Return the corners of one face that lie as on a plane; none where they are too few."""
    if len(view) < MIN_VIEW_CORNERS:
        return Corners.none()
    limit_px = max(_STRAY_PX, _STRAY_SHARE * float(np.ptp(view.px, axis=0).max()))
    H, is_near = cv2.findHomography(board.flat_mm[view.ids, :2], view.px, cv2.RANSAC, limit_px)
    return Corners.none() if H is None else view.select(is_near.ravel().astype(bool))


def fixes_pose(view: Corners, board: Board) -> bool:
    """Return whether a view's corners on one face are enough, and spread so that they fix a
    homography.

    Five in a row and one beyond it do not. The direct linear transform of the corners onto
    themselves must determine eight of its nine directions.
    """
    return any(_fixes_plane(part, board) for part in by_face(view, board))


def _fixes_plane(view: Corners, board: Board) -> bool:
    """Return whether a view's corners on one face fix a homography."""
    if len(view) < MIN_VIEW_CORNERS:
        return False
    points = _normalise(board.flat_mm[view.ids, :2])
    homogeneous = np.column_stack([points, np.ones(len(points))])
    zero = np.zeros_like(homogeneous)
    x, y = points.T[:, :, None]
    equations = np.block(
        [[homogeneous, zero, -x * homogeneous], [zero, homogeneous, -y * homogeneous]]
    )
    strength = np.linalg.svd(equations, compute_uv=False)
    return bool(strength[7] > _LEAST_STRENGTH * strength[0])


def _normalise(points: np.ndarray) -> np.ndarray:
    """Return points (n, 2) about their mean, in units of their RMS radius, so that a line stays
    thin.
    """
    centred = points - points.mean(axis=0)
    return centred / max(np.sqrt(np.mean(np.sum(centred**2, axis=1))), 1e-12)


def usable_views(series: Sequence[Corners], board: Board) -> dict[int, Corners]:
    """Return by index, without stray corners, the views of a series that fix a pose of the board."""
    usable = {}
    for k, view in enumerate(series):
        view = without_strays(view, board)
        if fixes_pose(view, board):
            usable[k] = view
    return usable


def check_views(name: str, views: Collection[Corners]) -> None:
    """Raise Refused for a camera with too few views."""
    if len(views) < MIN_VIEWS:
        raise Refused(
            f"camera {name}: the board is well seen in {len(views)} views, {MIN_VIEWS} are the "
            "least and 15 are good: record the board tilted to all sides, near and far, in every "
            "part of the picture"
        )


def check_rig_view(name: str, view: Corners | None, board: Board) -> None:
    """Raise Refused for a camera that does not see the board on the rig."""
    if view is None or not fixes_pose(view, board):
        raise Refused(
            f"camera {name}: {0 if view is None else len(view)} corners of the board on the rig "
            f"are seen, {MIN_VIEW_CORNERS} not in a line are needed: record boards/rig/{name} with "
            "the board in full view"
        )


def check_lenses(
    cameras: Cameras,
    reports: Sequence,
    views: Mapping[str, Iterable[Corners]],
    pixel_aspects: Mapping[str, float],
) -> None:
    """Raise Refused for a lens that the views do not determine, or one that cannot be.

    reports: the `CameraReport` of each camera. pixel_aspects: stated fx/fy by camera.
    """
    for camera, report in zip(cameras, reports):
        corners_px = np.concatenate([view.px for view in views[camera.name]])
        check_lens(camera, _reach(camera, corners_px), pixel_aspects.get(camera.name))
        focal_sigma = report.intrinsics_sigma[0] / camera.lens[0]
        if focal_sigma > _MOST_FOCAL_SIGMA:
            raise Refused(
                f"camera {camera.name}: the focal length is known to {100 * focal_sigma:.1f} %, "
                f"{100 * _MOST_FOCAL_SIGMA:.0f} % is allowed; the board was tilted by up to "
                f"{report.tilt_deg:.0f} degrees, its farthest corner is {report.depth_ratio:.2f} "
                "times as far away as its nearest: record more views, tilted by 20 to 45 degrees "
                "each way, near and far"
            )


def check_errors(names: Iterable[str], error_px: Sequence[float]) -> None:
    """Raise Refused for views that no lens and no poses explain.

    error_px (C,): model error of each camera, beyond the corners' own sigma.
    """
    for name, error in zip(names, error_px):
        if error > MOST_ERROR_PX:
            raise Refused(
                f"camera {name}: corners are off by {error:.2f} px an axis beyond their own sigma, "
                f"{MOST_ERROR_PX:g} is allowed: the board is not flat, moved while it was exposed, "
                "or the focus changed between views: record a stiff board held still, with focus "
                "and zoom locked"
            )


def check_lens(
    camera: Camera, covered: float | None = None, pixel_aspect: float | None = None
) -> None:
    """Raise Refused for a lens that cannot be, read from a file or fitted.

    Pixels far from square, a lens tilted beyond belief, a picture magnified or folded onto itself
    where it is used.

    covered: how far from the principal point corners were seen, px over focal length; None for most
    of the picture. pixel_aspect: fx/fy as stated; None for square pixels, or squashed ones.
    """
    _check_pixels(camera, pixel_aspect)
    if np.abs(camera.distortion[2:4]).max() > _MOST_DECENTRING:
        raise _over_fitted(
            camera, f"p1 or p2 is above {_MOST_DECENTRING}, a hundred times what lenses have"
        )
    _check_rim(camera, _reach_of_most(camera) if covered is None else covered)


def _check_pixels(camera: Camera, pixel_aspect: float | None) -> None:
    """Raise Refused for pixels far from what is stated, or from square ones and squashed ones."""
    fx, fy = camera.lens[:2]
    if pixel_aspect is not None:
        if not _is_near(fx / fy, pixel_aspect):
            raise Refused(
                f"camera {camera.name}: fx/fy = {fx / fy:.3f}, but pixel_aspect is {pixel_aspect:g}: enter what is seen"
            )
    elif not any(_is_near(fx / fy, aspect) for aspect in (1.0, *SQUASHED)):
        raise _over_fitted(
            camera,
            f"fx = {fx:.0f} and fy = {fy:.0f} differ by {100 * abs(fx / fy - 1):.0f} %, "
            "those of square pixels by less than 1 % (others are stated by pixel_aspect)",
        )


def squash_of(camera: Camera) -> float | None:
    """Return fx/fy where it is that of a squashed picture; None of any other."""
    fx, fy = camera.lens[:2]
    return fx / fy if any(_is_near(fx / fy, aspect) for aspect in SQUASHED) else None


def _is_near(aspect: float, expected: float) -> bool:
    """Return whether fx/fy is as expected, to within what real cameras have."""
    return abs(aspect / expected - 1.0) <= _MOST_ASPECT


def _reach_of_most(camera: Camera) -> float:
    """Return how far most of the picture lies from the principal point, px over focal length."""
    rim = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
    return _LEAST_REACH * _reach(camera, rim * camera.size_px)


def _check_rim(camera: Camera, radius: float) -> None:
    """Raise Refused for a picture magnified or folded onto itself within a radius.

    radius: px over focal length, where the lens is used.
    """
    if not radius < _MOST_REACH:
        raise Refused(
            f"camera {camera.name}: the picture's farthest corner is {radius:.3g} focal lengths "
            "from its middle; check matrix and size_px"
        )
    if fold_radius(camera.distortion) < radius:
        raise _over_fitted(camera, "the distortion folds the picture onto itself")
    if _largest_magnification(camera.distortion, radius) > _MOST_MAGNIFICATION:
        found = f"the distortion stretches the rim {_MOST_MAGNIFICATION:.0f}-fold or more"
        raise _over_fitted(camera, found)


def _over_fitted(camera: Camera, found: str) -> Refused:
    """Return the refusal of a lens, with its distortion terms and what to record."""
    names = ("k1", "k2", "p1", "p2", "k3")
    terms = ", ".join(f"{name} {value:.3g}" for name, value in zip(names, camera.distortion))
    return Refused(
        f"camera {camera.name}: {found} ({terms}): the lens diverged or was over-fitted; calibrate "
        "again with 15 views or more that fill the picture, tilted to all sides"
    )


def _largest_magnification(distortion: np.ndarray, radius: float) -> float:
    """Return the largest radial magnification, over the middle's, up to a distorted radius."""
    k1, k2, _, _, k3 = distortion
    r = np.linspace(0.0, 2.0 * radius, 400)
    distorted = r * np.polyval([k3, k2, k1, 1.0], r**2)
    magnification = np.polyval([7 * k3, 5 * k2, 3 * k1, 1.0], r**2)  # d distorted / d r
    return float(magnification[distorted <= radius].max())


def _reach(camera: Camera, px: np.ndarray) -> float:
    """Return how far pixels (n, 2) lie from the principal point at most, px over focal length."""
    normalised = (px - camera.lens[2:4]) / camera.lens[:2]
    return float(np.linalg.norm(normalised, axis=1).max())


def depth_ratio(poses: Sequence[np.ndarray], views: Sequence[Corners], board: Board) -> float:
    """Return the depth of the farthest corner over that of the nearest, on the optical axis."""
    depths = []
    for T_camera_board, view in zip(poses, views):
        depths.append(apply(T_camera_board, board.corners_mm[view.ids])[:, 2])
    depths = np.concatenate(depths)
    return float(depths.max() / depths.min())


def tilt_deg(poses: Sequence[np.ndarray]) -> float:
    """Return the largest angle between the board's normal and the optical axis."""
    least_cosine = np.abs(np.array(poses)[:, 2, 2]).min()
    return float(np.degrees(np.arccos(min(least_cosine, 1.0))))
