"""Do the views suffice? What a calibration needs of them, and what to record where they do not."""

from collections.abc import Collection, Iterable, Mapping, Sequence

import cv2
import numpy as np

from vision.boards.corners import Corners
from vision.geometry.board import Board
from vision.geometry.camera import Camera, Cameras
from vision.geometry.lens import fold_radius
from vision.geometry.refusals import Refused

# [corners] Six over at least two rows and columns give a pose with something left over. Derived.
MIN_VIEW_CORNERS = 6
# [views] Each adds 6 unknowns to the lens's 9; below, the lens rests on three or four independent
# directions. Derived.
MIN_VIEWS = 5
# [1] Weakest over strongest of a homography's directions: 0.4 for a whole board, 0.16 for two
# rows of seven corners, 0 for a line, or a line and one corner beside it. Study:
# tests/vision/calibration/test_calibrate.py.
_LEAST_STRENGTH = 0.05
# [1, px] A lens bends a board out of a plane's picture by less than this share of its size, or
# these px. Study: tests/vision/calibration/test_calibrate.py.
_STRAY_SHARE, _STRAY_PX = 0.04, 3.0
# [deg] Below, the foreshortening that tells focal length from distance, 1 − cos, is under 1.5 %.
# Derived.
_LEAST_TILT_DEG = 10.0
# [1] Farthest over nearest corner. Origin not known; the lab's views have 1.76 and 1.86. Study:
# calibrate cameras, its notes.
_LEAST_DEPTH_RATIO = 1.15
# [1] Share of the focal length. Origin not known; the lab's is 0.0003. Study: calibrate cameras,
# its notes.
_MOST_FOCAL_SIGMA = 0.02
# [focal lengths] From the middle of a picture to its corner: 87°, more than any lens here has.
# Stated.
_MOST_REACH = 20.0
# [1] Fx over fy: real ones differ by less than 1 %; three times that. Stated.
_MOST_ASPECT = 0.03
# [1] Decentring shifts the picture's rim by p r² f, some 1e-3 f at most; fifty times that.
# Stated.
_MOST_DECENTRING = 0.05
# [1] The rim of the picture against its middle. Origin not known.
_MOST_STRETCH = 2.0
# [px] Model error an axis beside the corners' own sigma: webcams that nobody triggered leave 0.18
# once instants are fitted (multi4_b), cameras by themselves 0.0 to 0.06; twice that. Study:
# tests/vision/calibration/test_held_out.py, calibrate cameras, its notes.
MOST_ERROR_PX = 0.4
# [1] Share of the way to the picture's corner: a lens may fold in the very corners, where no
# board is ever seen, but not before. Stated.
_LEAST_REACH = 0.7
# [1] Share of the picture's width beyond all corners from which a lens is extrapolated. Origin
# not known.
_HULL_MARGIN = 0.05
# [1] Share of where whisker and bar will be that may lie outside. Origin not known.
_MOST_UNCOVERED = 0.2


def without_strays(view: Corners, board: Board) -> Corners:
    """The corners that lie as on a plane seen through any lens; none where too few do (a mislabelled board)."""
    if len(view) < MIN_VIEW_CORNERS:
        return Corners.none()
    reach_px = max(_STRAY_PX, _STRAY_SHARE * float(np.ptp(view.px, axis=0).max()))
    H, near = cv2.findHomography(board.corners_mm[view.ids, :2], view.px, cv2.RANSAC, reach_px)
    return Corners.none() if H is None else view.chosen(near.ravel().astype(bool))


def fixes_pose(view: Corners, board: Board) -> bool:
    """Are there enough corners, and so spread that they fix a homography? (Five in a row and one beside do not.)"""
    if len(view) < MIN_VIEW_CORNERS:
        return False
    x, y = _centred(board.corners_mm[view.ids, :2]).T
    one, none = np.ones_like(x), np.zeros_like(x)
    # The direct linear transform of these points onto themselves: eight of its nine directions must be felt.
    rows = np.concatenate(
        [
            np.column_stack([x, y, one, none, none, none, -x * x, -x * y, -x]),
            np.column_stack([none, none, none, x, y, one, -y * x, -y * y, -y]),
        ]
    )
    strength = np.linalg.svd(rows, compute_uv=False)
    return bool(strength[7] > _LEAST_STRENGTH * strength[0])


def _centred(points: np.ndarray) -> np.ndarray:
    """Points (n, 2) about their mean, in units of their larger spread; a line keeps its thinness."""
    spread = points - points.mean(axis=0)
    return spread / max(np.sqrt(np.mean(np.sum(spread**2, axis=1))), 1e-12)


def check_views(name: str, views: Collection[Corners], board: Board) -> None:
    """Refuses a camera with too few views."""
    if len(views) < MIN_VIEWS:
        raise Refused(
            f"camera {name}: the board is well seen in {len(views)} views, {MIN_VIEWS} are the least and 15 are good: "
            "record the board tilted to all sides, near and far, in every part of the picture"
        )


def check_rig_view(name: str, view: Corners | None, board: Board) -> None:
    """Refuses a camera that does not see the board on the rig."""
    if view is None or not fixes_pose(view, board):
        raise Refused(
            f"camera {name}: {0 if view is None else len(view)} corners of the board on the rig are seen, "
            f"{MIN_VIEW_CORNERS} not in a line are needed: record boards/rig/{name} with the board in full view"
        )


def check_lenses(
    cameras: Cameras, reports: Sequence, views: Mapping[str, Iterable[Corners]]
) -> None:
    """Refuses what the views could not settle: no tilt, no depth, a lens that diverged."""
    for camera, report in zip(cameras, reports):
        _check_geometry(camera.name, report.tilt_deg, report.depth_ratio)
        check_lens(camera, _reach(camera, np.concatenate([v.px for v in views[camera.name]])))
        spread = report.intrinsics_sigma[0] / camera.lens[0]
        if spread > _MOST_FOCAL_SIGMA:
            raise Refused(
                f"camera {camera.name}: the focal length is known to {100 * spread:.1f} %, "
                f"{100 * _MOST_FOCAL_SIGMA:.0f} % is allowed: record more views, tilted by 20 to 45 degrees each way"
            )


def check_errors(names: Iterable[str], error_px: Sequence[float]) -> None:
    """Refuses views that no lens and no poses explain. error_px (C,): of each camera, beside the corners' own sigma."""
    for name, error in zip(names, error_px):
        if error > MOST_ERROR_PX:
            raise Refused(
                f"camera {name}: corners are off by {error:.2f} px an axis beyond their own sigma, {MOST_ERROR_PX:g} "
                "is allowed: the board is not flat, moved while it was exposed, or the focus changed between views: "
                "record a stiff board held still, with focus and zoom locked"
            )


def _check_geometry(name: str, tilt_deg: float, depth_ratio: float) -> None:
    """Refuses views all square to the camera, or all at one distance."""
    if tilt_deg < _LEAST_TILT_DEG:
        raise Refused(
            f"camera {name}: the board was never tilted by more than {tilt_deg:.0f} degrees, so focal "
            "length and distance cannot be told apart: record views tilted by 20 to 45 degrees to all sides"
        )
    if depth_ratio < _LEAST_DEPTH_RATIO:
        raise Refused(
            f"camera {name}: the farthest corner is only {depth_ratio:.2f} times as far away as the "
            f"nearest ({_LEAST_DEPTH_RATIO} is the least): record views nearer to the camera and farther away"
        )


def check_lens(camera: Camera, covered: float | None = None) -> None:
    """Refuses a lens that cannot be, brought along or fitted: pixels far from square, a lens tilted beyond belief, a
    picture stretched or folded onto itself where it is used.

    covered: how far from the principal point corners were seen, px over focal length; unknown, most of the picture.
    """
    fx, fy = camera.lens[:2]
    if abs(fx / fy - 1) > _MOST_ASPECT:
        found = f"fx = {fx:.0f} and fy = {fy:.0f} differ by {100 * abs(fx / fy - 1):.0f} %, real ones by less than 1 %"
        raise Refused(_over_fitted(camera, found))
    if np.abs(camera.distortion[2:4]).max() > _MOST_DECENTRING:
        raise Refused(
            _over_fitted(
                camera, f"p1 or p2 is above {_MOST_DECENTRING}, a hundred times what lenses have"
            )
        )
    radius = _LEAST_REACH * _picture_radius(camera) if covered is None else covered
    if not radius < _MOST_REACH:
        found = f"the picture's farthest corner is {radius:.3g} focal lengths from its middle"
        raise Refused(f"camera {camera.name}: {found}; check matrix and size_px")
    if fold_radius(camera.distortion) < radius:
        raise Refused(_over_fitted(camera, "the distortion folds the picture onto itself"))
    if _stretch(camera.distortion, radius) > _MOST_STRETCH:
        raise Refused(
            _over_fitted(
                camera, f"the distortion stretches the rim {_MOST_STRETCH:.0f}-fold or more"
            )
        )


def _over_fitted(camera: Camera, found: str) -> str:
    terms = ", ".join(
        f"{n} {v:.3g}" for n, v in zip(("k1", "k2", "p1", "p2", "k3"), camera.distortion)
    )
    return (
        f"camera {camera.name}: {found} ({terms}): the lens diverged or was over-fitted; calibrate again with 15 views "
        "or more that fill the picture, tilted to all sides"
    )


def _stretch(distortion: np.ndarray, reach: float) -> float:
    """Largest radial magnification, against the middle's, up to the distorted radius `reach`."""
    k1, k2, _, _, k3 = distortion
    r2 = np.linspace(0.0, 2.0 * reach, 400) ** 2
    inside = np.sqrt(r2) * (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) <= reach
    return float((1 + r2 * (3 * k1 + r2 * (5 * k2 + 7 * r2 * k3)))[inside].max())


def _picture_radius(camera: Camera) -> float:
    """Distance of the picture's farthest corner from the principal point, px over focal length."""
    width, height = camera.size_px
    return _reach(camera, np.array([[0, 0], [width, 0], [0, height], [width, height]], dtype=float))


def _reach(camera: Camera, px: np.ndarray) -> float:
    return float(np.linalg.norm((px - camera.lens[2:4]) / camera.lens[:2], axis=1).max())


def check_work(
    cameras: Cameras,
    alone: Mapping,
    standing: Mapping[str, Corners],
    work_points_mm: np.ndarray | None,
) -> None:
    """Refuses a camera whose board views leave out where whisker and bar will be, saying on which side."""
    if work_points_mm is None:
        return
    for camera in cameras:
        corners = [v.px for v in alone[camera.name].views.values()] + [
            standing[camera.name].px
        ] * bool(standing)
        work_px = camera.project(work_points_mm)
        in_picture = work_px[np.all((work_px >= 0) & (work_px < camera.size_px), axis=1)]
        if not len(in_picture):
            raise Refused(
                f"camera {camera.name}: neither whisker nor bar will be in its picture, by T_rig_board: check "
                "T_rig_board, or turn the camera"
            )
        missed = _outside(np.concatenate(corners), in_picture, camera.size_px)
        if np.mean(missed) > _MOST_UNCOVERED:
            raise Refused(
                f"camera {camera.name}: {100 * np.mean(missed):.0f} % of where whisker and bar will be lies outside "
                f"all board views, {100 * _MOST_UNCOVERED:.0f} % is allowed: record views of the board at the "
                f"{_side(np.concatenate(corners), in_picture[missed])} of the picture, {_span(in_picture[missed])}"
            )


def _outside(corners_px: np.ndarray, work_px: np.ndarray, size_px: tuple[int, int]) -> np.ndarray:
    """Which points lie farther outside the corners' hull than a margin, (n,) bool."""
    hull = cv2.convexHull(corners_px.astype(np.float32))
    margin = -_HULL_MARGIN * max(size_px)
    return (
        np.array([cv2.pointPolygonTest(hull, tuple(map(float, p)), True) for p in work_px]) < margin
    )


def _side(corners_px: np.ndarray, missed_px: np.ndarray) -> str:
    """Where the points lie as seen from the middle of all corners: the side that a person would name."""
    across, down = missed_px.mean(axis=0) - 0.5 * (corners_px.min(axis=0) + corners_px.max(axis=0))
    far = 0.5 * max(abs(across), abs(down))
    down_name = ("bottom" if down > 0 else "top") if abs(down) > far else ""
    across_name = ("right" if across > 0 else "left") if abs(across) > far else ""
    return f"{down_name} {across_name}".strip()


def _span(px: np.ndarray) -> str:
    (left, top), (right, bottom) = px.min(axis=0), px.max(axis=0)
    return f"x {left:.0f} to {right:.0f}, y {top:.0f} to {bottom:.0f} px"


def coverage(views: Sequence[Corners], size_px: tuple[int, int]) -> float:
    """Share of the picture within the hull of all corners."""
    hull = cv2.convexHull(np.concatenate([v.px for v in views]).astype(np.float32))
    return float(cv2.contourArea(hull) / (size_px[0] * size_px[1]))


def depth_ratio(poses: Sequence[np.ndarray], views: Sequence[Corners], board: Board) -> float:
    """Distance of the farthest corner over that of the nearest, along the optical axis."""
    depths = np.concatenate(
        [board.corners_mm[v.ids] @ T[2, :3] + T[2, 3] for T, v in zip(poses, views)]
    )
    return float(depths.max() / depths.min())


def tilt_deg(poses: Sequence[np.ndarray]) -> float:
    """Largest angle between the board's normal and the optical axis."""
    return float(np.degrees(np.arccos(np.clip(min(abs(T[2, 2]) for T in poses), 0, 1))))
