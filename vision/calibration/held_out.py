"""How good cameras are on views that they were not made from.

Three figures, each more telling than the one before. A board pose fitted to one camera by itself takes up much of what
is wrong. One pose for all cameras asks whether they agree. Distances between neighbouring corners brought into space
ask for millimetres, against the printed pitch.

Of cameras that are not triggered together, the last two are taken three ways, in the order of what is fitted to the
held-out pictures themselves: nothing but the board's pose, the pictures being as of one instant; the same with each
camera late by its one offset, known from the other views; and with the instant of each picture fitted too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.boards.corners import Corners
from vision.boards.sufficiency import fixes_pose, without_strays
from vision.calibration.adjust import Solution, adjust_bundle
from vision.calibration.bundle import predict
from vision.calibration.calibrate import Calibration
from vision.calibration.first_guess import board_pose, has_pose
from vision.calibration.layout import Alone, Layout, lay_out
from vision.calibration.tied import lens_priors
from vision.geometry.board import Board
from vision.geometry.camera import Camera, Cameras
from vision.geometry.triangulate import triangulate

# [sigma] Board poses and instants are fitted robustly; residuals are then counted whole. Study:
# cameras.py.
_ROBUST_WIDTH = 3.0


@dataclass(frozen=True)
class Agreement:
    """How cameras agree: joint_px with one board pose for all, root mean square; pitch_rms_mm, pitch_mean_mm: distance
    of neighbouring corners in space less the pitch, of so many pitches. NaN where there is nothing to measure."""

    joint_px: float = np.nan
    pitch_rms_mm: float = np.nan
    pitch_mean_mm: float = np.nan
    pitches: int = 0


@dataclass(frozen=True)
class HeldOut:
    """Measured on views (how many) with corners (how many) that more than one camera has.

    alone_px: per camera, a pose for each view of that camera. at_once: all pictures of a view taken as of one instant.
    offsets: each camera late by its one offset, none of it fitted here. instants: each picture's instant fitted along
    with the board's pose. The last two are None where cameras count as triggered together.
    """

    alone_px: Mapping[str, float]
    at_once: Agreement = Agreement()
    offsets: Agreement | None = None
    instants: Agreement | None = None
    views: int = 0
    corners: int = 0

    @property
    def joint(self) -> Agreement:
        """What stands for the calibration: by its own account of when pictures were taken, nothing of it fitted."""
        return self.offsets or self.at_once


def held_out(
    calibration: Calibration,
    views: Mapping[str, Sequence[Corners]],
    is_held: Sequence[bool],
    board: Board,
    *,
    times_s: Mapping[str, Sequence[float]] | None = None,
    together: bool | None = None,
) -> HeldOut:
    """Measures on the views k with is_held[k]; the others only say how the board moved.

    together: the views of one index are of one board; by default as the calibration found it.
    """
    cameras = calibration.cameras
    together = calibration.together if together is None else together
    usable = {c.name: _alone(c, views[c.name], board) for c in cameras}
    alone = {name: _alone_px(cameras[name], usable[name], is_held, board) for name in usable}
    if not together or len(cameras) < 2:
        return HeldOut(alone)
    layout = lay_out(usable, _poses(cameras), together=True, times_s=times_s)
    rows = np.array([is_held[k] for k in layout.index])[layout.seen.view] & _shared(layout)
    if not rows.any():
        return HeldOut(alone)
    views_held, corners = len(np.unique(layout.seen.view[rows])), int(rows.sum())
    at_once = _agreement(cameras, layout, _fit_boards(layout, calibration, board), rows, board)
    if calibration.timing is None:
        return HeldOut(alone, at_once, views=views_held, corners=corners)
    offsets, instants = (
        _agreement(
            cameras,
            layout,
            _fit_moving_board(layout, calibration, board, fit_instants=fitted),
            rows,
            board,
        )
        for fitted in (False, True)
    )
    return HeldOut(alone, at_once, offsets, instants, views_held, corners)


def _agreement(
    cameras: Cameras, layout: Layout, fitted: Solution, rows: np.ndarray, board: Board
) -> Agreement:
    off = _pitch_errors_mm(cameras, layout, _still(layout, fitted, board), rows, board)
    mean = float(off.mean()) if len(off) else np.nan
    return Agreement(_rms(fitted.residual_px[rows]), _rms(off[:, None]), mean, len(off))


def _alone(camera: Camera, views: Sequence[Corners], board: Board) -> Alone:
    seen = {k: without_strays(view, board) for k, view in enumerate(views)}
    usable = {
        k: view
        for k, view in seen.items()
        if fixes_pose(view, board) and has_pose(view, board.corners_mm, camera.lens)
    }
    poses = {k: board_pose(view, board.corners_mm, camera.lens) for k, view in usable.items()}
    return Alone(camera.lens, camera.rms_px, usable, poses)


def _alone_px(camera: Camera, alone: Alone, is_held: Sequence[bool], board: Board) -> float:
    """Each view's pose fitted to this camera; plain least squares, as others count it."""
    held = {k: view for k, view in alone.views.items() if is_held[k]}
    if not held:
        return np.nan
    layout = lay_out({camera.name: replace(alone, views=held)}, np.eye(3, 4)[None], together=False)
    priors = lens_priors(1, len(held))
    even = replace(layout.seen, sigma_px=np.ones(len(layout.seen)))
    return _rms(adjust_bundle(layout.first, even, board.corners_mm, _held(priors)).residual_px)


def _poses(cameras: Cameras) -> np.ndarray:
    return np.array([camera.T_camera_rig for camera in cameras])


def _shared(layout: Layout) -> np.ndarray:
    """Corners (n,) in views that more than one camera has."""
    starts = layout.seen.shot_starts()
    pictures = np.bincount(layout.seen.view[starts], minlength=len(layout.index))
    return pictures[layout.seen.view] > 1


def _held(priors):
    return replace(priors, free=np.zeros_like(priors.free))


def _fit_boards(layout: Layout, calibration: Calibration, board: Board) -> Solution:
    """One pose a view for all cameras, all corners alike."""
    even = replace(layout.seen, sigma_px=np.ones(len(layout.seen)))
    first = replace(layout.first, board=calibration.board)
    priors = _held(lens_priors(len(layout.first.lens), len(layout.index)))
    return adjust_bundle(first, even, board.corners_mm, priors)


def _fit_moving_board(
    layout: Layout, calibration: Calibration, board: Board, *, fit_instants: bool
) -> Solution:
    """One pose a view for all cameras, on the board's path, each camera late by its offset; with or without each
    picture's own instant."""
    timing = calibration.timing
    priors = _held(lens_priors(len(layout.first.lens), len(layout.index)))
    first = replace(
        layout.first, board=calibration.board, clock=timing.offset_s, trajectory=layout.trajectory
    )
    if not fit_instants:
        even = replace(layout.seen, sigma_px=np.ones(len(layout.seen)))
        return adjust_bundle(first, even, board.corners_mm, priors)
    error = np.array([report.error_px for report in calibration.report])
    seen = replace(layout.seen, sigma_px=np.hypot(layout.seen.sigma_px, error[layout.seen.camera]))
    priors = replace(priors, late_sigma_s=timing.scatter_s)
    return adjust_bundle(first, seen, board.corners_mm, priors, width=_ROBUST_WIDTH, tolerance=1e-5)


def _still(layout: Layout, fitted: Solution, board: Board) -> np.ndarray:
    """Corners (n, 2) px as they would have been seen at their view's own time."""
    then, _ = predict(fitted.state, layout.seen, board.corners_mm)
    now, _ = predict(replace(fitted.state, trajectory=None), layout.seen, board.corners_mm)
    return layout.seen.px + now - then


def _pitch_errors_mm(
    cameras: Cameras, layout: Layout, px: np.ndarray, rows: np.ndarray, board: Board
) -> np.ndarray:
    """Distances of neighbouring corners, each brought into space by all cameras that see it, less the pitch."""
    seen, count = layout.seen, len(board.corners_mm)
    where = {name: np.full((len(layout.index) * count, 2), np.nan) for name in cameras.names}
    for c, name in enumerate(cameras.names):
        own = rows & (seen.camera == c)
        where[name][seen.view[own] * count + seen.corner[own]] = px[own]
    sigma = {name: np.ones(len(where[name])) for name in cameras.names}
    points = triangulate(cameras, where, sigma).mm.reshape(len(layout.index), count, 3)
    off = np.concatenate(
        [
            np.linalg.norm(points[:, a] - points[:, b], axis=1) - board.square_mm
            for a, b in _neighbours(board)
        ]
    )
    return off[np.isfinite(off)]


def _neighbours(board: Board) -> list[tuple[int, int]]:
    columns, rows = board.squares[0] - 1, board.squares[1] - 1
    across = [
        (r * columns + c, r * columns + c + 1) for r in range(rows) for c in range(columns - 1)
    ]
    down = [
        (r * columns + c, (r + 1) * columns + c) for r in range(rows - 1) for c in range(columns)
    ]
    return across + down


def _rms(vectors: np.ndarray) -> float:
    """Root mean square length of vectors (n, m); NaN of none."""
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1)))) if len(vectors) else np.nan
