"""The errors of cameras on views that they were not calibrated from.

Three figures, each stricter than the one before. A board pose fitted to one camera by itself takes
up much of what is wrong. One pose for all cameras tests whether they agree. Distances between
neighbouring corners, triangulated, are compared in millimetres with the pitch of the print as
adjusted.

Cameras that are not triggered together take the pictures of a view at different instants. For them
the last two figures are measured three times: with all pictures of a view as of one instant; with
each camera late by its one offset, known from the other views; and with an instant fitted for each
held-out picture. But for these instants, only the board's poses are fitted to held-out pictures.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.boards.corners import Corners
from vision.boards.sufficiency import usable_views
from vision.calibration.adjust import Solution, adjust_bundle
from vision.calibration.bundle import LATENESS, N_PICTURE, BundleState, Priors, predict
from vision.calibration.calibrate import Calibration
from vision.calibration.first_guess import board_pose, with_pose
from vision.calibration.layout import Alone, Layout, lay_out
from vision.calibration.priors import pose_priors
from vision.geometry.board import Board
from vision.geometry.camera import Camera
from vision.geometry.triangulate import triangulate

# [sigma] Board poses and instants are fitted robustly; residuals are then counted whole. Study:
# cameras.py.
_ROBUST_WIDTH = 3.0


@dataclass(frozen=True)
class Agreement:
    """The agreement of cameras with each other; NaN where there is nothing to measure.

    joint_px: root mean square of the residuals with one board pose for all. pitch_rms_mm,
    pitch_mean_mm: distance of neighbouring corners in space less the pitch, of so many pitches.
    """

    joint_px: float = np.nan
    pitch_rms_mm: float = np.nan
    pitch_mean_mm: float = np.nan
    pitches: int = 0


@dataclass(frozen=True)
class HeldOut:
    """Errors on held-out views (how many) with corners (how many) that more than one camera has.

    alone_px: by camera, with a pose for each view of that camera. at_once: with all pictures of a
    view as of one instant. offsets: with each camera late by its one offset, which is not fitted
    here. instants: with each picture's instant fitted along with the board's pose. The last two are
    None where cameras count as triggered together.
    """

    alone_px: Mapping[str, float]
    at_once: Agreement = Agreement()
    offsets: Agreement | None = None
    instants: Agreement | None = None
    views: int = 0
    corners: int = 0

    @property
    def joint(self) -> Agreement:
        """Return the calibration's figure: with its own times of the pictures, none of them fitted."""
        return self.offsets or self.at_once


def check_held_out(
    calibration: Calibration,
    views: Mapping[str, Sequence[Corners]],
    is_held: Sequence[bool],
    *,
    times_s: Mapping[str, Sequence[float]] | None = None,
    together: bool | None = None,
) -> HeldOut:
    """Measure the errors on the views k with is_held[k]; the others only give the board's motion.

    together: the views of one index are of one board; by default as the calibration found it.
    """
    cameras = calibration.cameras
    usable = {}
    alone_px = {}
    for camera in cameras:
        alone = camera_alone(camera, views[camera.name], calibration.placed_board)
        usable[camera.name] = alone
        alone_px[camera.name] = _alone_px(camera, alone, is_held, calibration)
    together = calibration.together if together is None else together
    if not together or len(cameras) < 2:
        return HeldOut(alone_px)
    poses = np.array([camera.T_camera_rig for camera in cameras])
    layout = lay_out(usable, poses, together=True, times_s=times_s)
    rows = _held_rows(layout, is_held)
    if not rows.any():
        return HeldOut(alone_px)
    return _JointFits(calibration, layout, rows).errors(alone_px)


def camera_alone(camera: Camera, views: Sequence[Corners], board: Board) -> Alone:
    """Return the camera by itself, with its usable views and their board poses."""
    usable = with_pose(usable_views(views, board), board.corners_mm, camera.lens)
    poses = {}
    for k, view in usable.items():
        poses[k] = board_pose(view, board.corners_mm, camera.lens)
    return Alone(camera.lens, camera.rms_px, usable, poses)


def _alone_px(
    camera: Camera, alone: Alone, is_held: Sequence[bool], calibration: Calibration
) -> float:
    """Return the RMS of one camera's residuals with a pose fitted to each view, by plain least
    squares, on the board as calibrated.
    """
    held = {k: view for k, view in alone.views.items() if is_held[k]}
    if not held:
        return np.nan
    layout = lay_out({camera.name: replace(alone, views=held)}, np.eye(3, 4)[None], together=False)
    seen = layout.seen.with_equal_sigmas()
    board = calibration.placed_board
    first = calibration.with_board(layout.first)
    solution = adjust_bundle(first, seen, board, pose_priors(1, len(held), board))
    return _rms(solution.residual_px)


def _held_rows(layout: Layout, is_held: Sequence[bool]) -> np.ndarray:
    """Return the mask (n,) of corners in held views that more than one camera has."""
    pictures = layout.seen.pictures_by_view(len(layout.index))
    held_views = np.asarray(is_held)[layout.index] & (pictures > 1)
    return held_views[layout.seen.view]


@dataclass(frozen=True, eq=False)
class _JointFits:
    """Fits of one board pose a view for all cameras, with three accounts of when the pictures were
    taken.

    rows (n,) bool: the corners in which their agreement is measured.
    """

    calibration: Calibration
    layout: Layout
    rows: np.ndarray

    @property
    def board(self) -> Board:
        """Return the board as placed."""
        return self.calibration.placed_board

    def errors(self, alone_px: Mapping[str, float]) -> HeldOut:
        """Return the errors of each camera alone with those by every account."""
        is_timed = self.calibration.timing is not None
        return HeldOut(
            alone_px,
            at_once=self.at_once(),
            offsets=self.offsets() if is_timed else None,
            instants=self.instants() if is_timed else None,
            views=len(np.unique(self.layout.seen.view[self.rows])),
            corners=int(self.rows.sum()),
        )

    def at_once(self) -> Agreement:
        """Return the agreement with all pictures of a view as of one instant."""
        return self._with_equal_sigmas(self.calibration.with_board(self.layout.first))

    def offsets(self) -> Agreement:
        """Return the agreement on the board's path, with each camera late by its offset."""
        return self._with_equal_sigmas(self._moving)

    def instants(self) -> Agreement:
        """Return the agreement with each picture's own instant fitted, robustly."""
        error_px = np.array([report.error_px for report in self.calibration.report])
        seen = self.layout.seen.with_error(error_px)
        own_sigma = np.zeros((len(error_px), N_PICTURE))
        own_sigma[:, LATENESS] = self.calibration.timing.scatter_s
        priors = replace(self._priors, picture_sigma=own_sigma)
        fitted = adjust_bundle(
            self._moving, seen, self.board, priors, width=_ROBUST_WIDTH, tolerance=1e-5
        )
        return self._agreement(fitted)

    def _with_equal_sigmas(self, first: BundleState) -> Agreement:
        """Return the agreement with all corners alike, from a first state."""
        seen = self.layout.seen.with_equal_sigmas()
        return self._agreement(adjust_bundle(first, seen, self.board, self._priors))

    @property
    def _priors(self) -> Priors:
        """Return the priors of all cameras and views."""
        return pose_priors(len(self.layout.first.lens), len(self.layout.index), self.board)

    @property
    def _moving(self) -> BundleState:
        """Return the first state with the calibration's board, clocks and the board's path."""
        return replace(
            self.calibration.with_board(self.layout.first),
            clock=self.calibration.timing.offset_s,
            trajectory=self.layout.trajectory,
        )

    def _agreement(self, fitted: Solution) -> Agreement:
        """Return how the cameras agree, by a fit of the board's poses."""
        seen = self.layout.seen
        # Corners as they would have been seen at their view's own time.
        when_taken_px, _ = predict(fitted.state, seen, self.board)
        at_view_px, _ = predict(replace(fitted.state, trajectory=None), seen, self.board)
        px = seen.px + at_view_px - when_taken_px
        errors_mm = self._pitch_errors_mm(px)
        mean_mm = float(errors_mm.mean()) if len(errors_mm) else np.nan
        joint_px = _rms(fitted.residual_px[self.rows])
        return Agreement(joint_px, _rms(errors_mm[:, None]), mean_mm, len(errors_mm))

    def _pitch_errors_mm(self, px: np.ndarray) -> np.ndarray:
        """Return the distances of neighbouring corners, triangulated by all cameras that see them,
        less those of the print.

        px (n, 2): of the sightings, at their view's own time.
        """
        neighbours = self.board.neighbours
        points_mm = self._triangulated_mm(px).reshape(-1, len(self.board.corners_mm), 3)
        printed_mm = self.calibration.board_mm
        errors_mm = _pitches(points_mm, neighbours) - _pitches(printed_mm, neighbours)
        return errors_mm[np.isfinite(errors_mm)]

    def _triangulated_mm(self, px: np.ndarray) -> np.ndarray:
        """Return the corners (views · corners, 3) by all cameras that see them; NaN where too few do.

        px (n, 2): of the sightings, at their view's own time.
        """
        cameras = self.calibration.cameras
        seen = self.layout.seen
        corners = len(self.board.corners_mm)
        count = len(self.layout.index) * corners
        place = seen.view * corners + seen.corner  # (n,) among all corners
        by_camera = {}
        sigma = {}
        for c, name in enumerate(cameras.names):
            own = self.rows & (seen.camera == c)
            by_camera[name] = np.full((count, 2), np.nan)
            by_camera[name][place[own]] = px[own]
            sigma[name] = np.ones(count)
        return triangulate(cameras, by_camera, sigma).mm


def _pitches(points_mm: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Return the distances (…, p) between the points (…, m, 3) of each pair of ids (p, 2)."""
    first, second = neighbours.T
    return np.linalg.norm(points_mm[..., second, :] - points_mm[..., first, :], axis=-1)


def _rms(vectors: np.ndarray) -> float:
    """Return the root mean square length of vectors (n, m); NaN of none."""
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1)))) if len(vectors) else np.nan
