"""The cameras as a calibration would give them: from views of the board as a careful person would hold it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.rig import boards, session_files
from bench.rig.other_boards import AnyBoard
from bench.rig.pinhole import PinholeCamera
from bench.rig.protocol_tables import BoardTable
from bench.session.manifest import BoardKeys
from bench.session.stated_board import stated_board
from vision.boards import Corners
from vision.calibration import BoardViews, MeasuredPose, calibrate_cameras
from vision.geometry import Board, Camera, Cameras, apply, compose

# [px] A corner nearer to the picture's edge is not found. Stated.
_RIM_PX = 8.0
_SEED, _VIEWS, _NOISE = 0, 0, 1  # words of the random streams


@dataclass(frozen=True, eq=False)
class PlannedCalibration:
    """What the cameras of a bench would be calibrated from.

    printed: the same board for the rig. on_rig: where it stands on the rig. views: of it held up to
    each camera. corner_px: sigma of a corner along each axis, by camera.
    """

    board: Board
    printed: AnyBoard
    on_rig: MeasuredPose
    views: int
    corner_px: Mapping[str, float]

    def improved(self, views_factor: int, pose_factor: int) -> "PlannedCalibration":
        """Return it with more views of the board, and with smaller sigmas of its pose on the rig, by these factors."""
        on_rig = replace(
            self.on_rig,
            sigma_mm=self.on_rig.sigma_mm / pose_factor,
            sigma_rad=self.on_rig.sigma_rad / pose_factor,
        )
        return replace(self, views=views_factor * self.views, on_rig=on_rig)

    @property
    def largest_corner_px(self) -> float:
        """Return the sigma of a corner in the camera where it is largest."""
        return max(self.corner_px.values())


def expected_cameras(cameras: Sequence[Camera], calibration: PlannedCalibration) -> Cameras:
    """Return the cameras where they are, with the covariance that a calibration states.

    Corners of a camera that is not there yet are as uncertain as the worst. Raises Refused where
    the views would not do, saying what to record.
    """
    board = calibration.board
    on_rig = calibration.on_rig
    held = {}
    standing = {}
    sizes_px = {}
    for number, camera in enumerate(cameras):
        rng = np.random.default_rng([_SEED, _NOISE, number])
        sigma_px = calibration.corner_px.get(camera.name, calibration.largest_corner_px)
        held[camera.name] = []
        for pose in _draw_poses(
            camera, calibration, np.random.default_rng([_SEED, _VIEWS, number])
        ):
            held[camera.name].append(_corners(camera, board, pose, sigma_px, rng))
        standing[camera.name] = _corners(camera, board, on_rig.T_rig_board, sigma_px, rng)
        sizes_px[camera.name] = camera.size_px
    views = BoardViews(held, sizes_px, standing)
    found = calibrate_cameras(views, board, on_rig, triggered=True).cameras
    return Cameras(tuple(cameras), found.covariance, found.placement)


def _draw_poses(
    camera: Camera, calibration: PlannedCalibration, rng: np.random.Generator
) -> list[np.ndarray]:
    """Draw the poses (3, 4) of the board in the views of a camera, rig frame."""
    poses = boards.draw_poses(calibration.printed, as_rig_camera(camera), calibration.views, rng)
    return [compose(pose, calibration.printed.T_print_board) for pose in poses]


def _corners(
    camera: Camera, board: Board, T_rig_board: np.ndarray, sigma_px: float, rng: np.random.Generator
) -> Corners:
    """Draw the corners of a board that are found in a camera's picture."""
    px = camera.project(apply(T_rig_board, board.corners_mm))
    last_px = np.array(camera.size_px) - 1 - _RIM_PX
    is_found = np.all((px > _RIM_PX) & (px < last_px), axis=1)
    count = int(is_found.sum())
    noise_px = sigma_px * rng.standard_normal((count, 2))
    return Corners(np.flatnonzero(is_found), px[is_found] + noise_px, np.full(count, sigma_px))


def as_rig_camera(camera: Camera) -> PinholeCamera:
    """Return a camera for the rig's painter."""
    R = camera.T_camera_rig[:, :3]
    t = camera.T_camera_rig[:, 3]
    return PinholeCamera(camera.name, camera.size_px, camera.matrix, camera.distortion, R, t)


def as_seen_camera(camera: PinholeCamera) -> Camera:
    """Return a camera of the rig for vision."""
    T = np.column_stack([camera.rotation, camera.translation_mm])
    return Camera(camera.name, camera.size_px, camera.matrix, camera.distortion, T)


def as_board(table: BoardTable) -> Board:
    """Return the board of a protocol for vision."""
    return stated_board(BoardKeys(**session_files.board_keys(table)), "[board]")
