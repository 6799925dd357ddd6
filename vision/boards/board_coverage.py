"""Whether the board views cover the part of the picture where whisker and bar will be."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np

from vision.boards.corners import Corners
from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused

# [1] Share of the picture's width beyond all corners from which a lens is extrapolated. Stated: it
# makes a note, and enters no number. Study: calibrate cameras, its notes.
_HULL_MARGIN = 0.05
# [1] Share of where whisker and bar will be that may lie outside. Stated: it makes a refusal, and
# enters no number. Study: calibrate cameras, its notes.
_MOST_UNCOVERED = 0.2


def check_work(
    cameras: Cameras,
    alone: Mapping,
    standing: Mapping[str, Corners],
    work_points_mm: np.ndarray | None,
) -> None:
    """Raise Refused for a camera whose board views leave out where whisker and bar will be.

    The message names the side of the picture. alone: by camera an `Alone`. standing: the board on
    the rig by camera, or empty. work_points_mm (n, 3): in the rig frame; None asks for no check.
    """
    if work_points_mm is None:
        return
    for camera in cameras:
        views = list(alone[camera.name].views.values())
        if standing:
            views.append(standing[camera.name])
        work_px = camera.project(work_points_mm)
        is_inside = np.all((work_px >= 0) & (work_px < camera.size_px), axis=1)
        _check_coverage(camera, np.concatenate([view.px for view in views]), work_px[is_inside])


def _check_coverage(camera: Camera, corners_px: np.ndarray, work_px: np.ndarray) -> None:
    """Raise Refused where too many pixels (n, 2) of whisker and bar lie beyond all corners."""
    if not len(work_px):
        raise Refused(
            f"camera {camera.name}: neither whisker nor bar will be in its picture, by "
            "T_rig_board: check T_rig_board, or turn the camera"
        )
    hull = cv2.convexHull(corners_px.astype(np.float32))
    inward_px = [cv2.pointPolygonTest(hull, point, True) for point in work_px.tolist()]
    is_missed = np.array(inward_px) < -_HULL_MARGIN * max(camera.size_px)
    if np.mean(is_missed) > _MOST_UNCOVERED:
        missed_px = work_px[is_missed]
        left, top = missed_px.min(axis=0)
        right, bottom = missed_px.max(axis=0)
        raise Refused(
            f"camera {camera.name}: {100 * np.mean(is_missed):.0f} % of where whisker and bar will "
            f"be lies outside all board views, {100 * _MOST_UNCOVERED:.0f} % is allowed: record "
            f"views of the board at the {_name_side(corners_px, missed_px)} of the picture, "
            f"x {left:.0f} to {right:.0f}, y {top:.0f} to {bottom:.0f} px"
        )


def _name_side(corners_px: np.ndarray, missed_px: np.ndarray) -> str:
    """Name the side of the picture where pixels lie, as seen from the middle of all corners."""
    middle = 0.5 * (corners_px.min(axis=0) + corners_px.max(axis=0))
    across, down = missed_px.mean(axis=0) - middle
    names = []
    if abs(down) > 0.5 * abs(across):
        names.append("bottom" if down > 0 else "top")
    if abs(across) > 0.5 * abs(down):
        names.append("right" if across > 0 else "left")
    return " ".join(names)


def coverage(views: Sequence[Corners], size_px: tuple[int, int]) -> float:
    """Return the share of the picture within the hull of all corners."""
    corners_px = np.concatenate([view.px for view in views])
    hull = cv2.convexHull(corners_px.astype(np.float32))
    return float(cv2.contourArea(hull) / (size_px[0] * size_px[1]))
