"""Do the views suffice? What a calibration needs of them, and what to record where they do not."""

from collections.abc import Sequence

import cv2
import numpy as np

from vision.corners import Corners
from vision.errors import Refused
from vision.scene import Board

# Six corners over at least two rows and columns give a pose with something left over.
MIN_VIEW_CORNERS = 6
# Each view adds 6 unknowns to the lens's 9; below this the lens rests on three or four independent
# directions.
MIN_VIEWS = 5
# A corner set thinner than this (ratio of its two extents) is as good as a line.
_MIN_THICKNESS = 0.1


def usable_views(views: Sequence[Corners], board: Board) -> list[Corners]:
    """The views that fix a board pose."""
    return [view for view in views if _fixes_pose(view, board)]


def _fixes_pose(view: Corners, board: Board) -> bool:
    if len(view) < MIN_VIEW_CORNERS:
        return False
    spread = board.corners_mm[view.ids, :2]
    extents = np.linalg.svd(spread - spread.mean(axis=0), compute_uv=False)
    return bool(extents[1] > _MIN_THICKNESS * extents[0])


def check_views(name: str, views, rig_view: Corners | None, board: Board, size_px: tuple[int, int]) -> None:
    """Refuses a camera that was not given enough to begin with."""
    if len(views) < MIN_VIEWS:
        raise Refused(
            f"camera {name}: the board is well seen in {len(views)} views, {MIN_VIEWS} are the least and 15 are good: "
            "record the board tilted to all sides, near and far, in every part of the picture"
        )
    if rig_view is None or not _fixes_pose(rig_view, board):
        found = 0 if rig_view is None else len(rig_view)
        raise Refused(
            f"camera {name}: {found} corners of the board on the rig are seen, {MIN_VIEW_CORNERS} not in a line are "
            "needed: record the rig board in full view"
        )


def coverage(views: Sequence[Corners], size_px: tuple[int, int]) -> float:
    """Share of the picture within the hull of all corners."""
    hull = cv2.convexHull(np.concatenate([v.px for v in views]).astype(np.float32))
    return float(cv2.contourArea(hull) / (size_px[0] * size_px[1]))


def depth_ratio(poses: Sequence[np.ndarray], views: Sequence[Corners], board: Board) -> float:
    """Distance of the farthest corner over that of the nearest, along the optical axis."""
    depths = np.concatenate([board.corners_mm[v.ids] @ T[2, :3] + T[2, 3] for T, v in zip(poses, views)])
    return float(depths.max() / depths.min())


def tilt_deg(poses: Sequence[np.ndarray]) -> float:
    """Largest angle between the board's normal and the optical axis."""
    return float(np.degrees(np.arccos(np.clip(min(abs(T[2, 2]) for T in poses), 0, 1))))
