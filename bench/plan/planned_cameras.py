"""The cameras as a calibration would give them: from views of the board as a careful person would hold it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.rig import boards
from bench.rig.pinhole import PinholeCamera
from bench.rig.printed_board import PrintedBoard
from vision.boards.corners import Corners
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.views import BoardViews, MeasuredPose
from vision.geometry.board import Board
from vision.geometry.camera import Camera, Cameras
from vision.geometry.rotation import apply

_RIM_PX = 8.0  # a corner nearer to the picture's edge is not found
_VIEWS, _NOISE = range(2)  # words of the random streams


@dataclass(frozen=True, eq=False)
class BoardWork:
    """What the cameras are calibrated from: the board, where it stands on the rig and how well that is known, views of
    it held up for each camera, and sigma (px, an axis) of a corner by camera."""

    board: Board
    on_rig: MeasuredPose
    views: int
    corner_px: Mapping[str, float]

    def times(self, views: int, placed: int = 1) -> "BoardWork":
        """The same with so many times the views, and its place known so many times as well."""
        pose = self.on_rig
        better = replace(pose, sigma_mm=pose.sigma_mm / placed, sigma_rad=pose.sigma_rad / placed)
        return replace(self, views=views * self.views, on_rig=better)

    def corner_of(self, camera: str) -> float:
        """Sigma of a corner; of a camera that is not there yet, the largest."""
        return self.corner_px.get(camera, max(self.corner_px.values()))


def expected_cameras(cameras: Sequence[Camera], work: BoardWork, seed: int = 0) -> Cameras:
    """The cameras where they are, with the covariance that a calibration from such views states. Raises Refused where
    the views would not do, saying what to record."""
    boards_, rig, sizes = {}, {}, {}
    for number, camera in enumerate(cameras):
        rng = np.random.default_rng([seed, _NOISE, number])
        sigma = work.corner_of(camera.name)
        held = _held(camera, work, number, seed)
        boards_[camera.name] = [_corners(camera, work.board, pose, sigma, rng) for pose in held]
        rig[camera.name] = _corners(camera, work.board, work.on_rig.T_rig_board, sigma, rng)
        sizes[camera.name] = camera.size_px
    found = calibrate_cameras(
        BoardViews(boards_, sizes, rig), work.board, work.on_rig, triggered=True
    ).cameras
    return Cameras(tuple(cameras), found.covariance, found.placement)


def _held(camera: Camera, work: BoardWork, number: int, seed: int) -> list[np.ndarray]:
    """T_rig_board (3, 4) of each view."""
    board = work.board
    printed = PrintedBoard(
        board.squares,
        board.square_mm,
        board.marker_mm,
        board.dictionary,
        board.legacy,
        board.inverted,
    )
    return boards.draw_poses(
        printed, rig_camera(camera), work.views, np.random.default_rng([seed, _VIEWS, number])
    )


def _corners(
    camera: Camera, board: Board, T_rig_board: np.ndarray, sigma_px: float, rng
) -> Corners:
    """The corners that are in the picture, as found to sigma."""
    px = camera.project(apply(T_rig_board, board.corners_mm))
    there = np.all((px > _RIM_PX) & (px < np.array(camera.size_px) - 1 - _RIM_PX), axis=1)
    found = px[there] + sigma_px * rng.standard_normal((int(there.sum()), 2))
    return Corners(np.flatnonzero(there), found, np.full(len(found), sigma_px))


def rig_camera(camera: Camera) -> PinholeCamera:
    """The same camera for the rig's painter."""
    R, t = camera.T_camera_rig[:, :3], camera.T_camera_rig[:, 3]
    return PinholeCamera(camera.name, camera.size_px, camera.matrix, camera.distortion, R, t)


def seen_camera(camera: PinholeCamera) -> Camera:
    """The rig's camera for vision."""
    T = np.column_stack([camera.rotation, camera.translation_mm])
    return Camera(camera.name, camera.size_px, camera.matrix, camera.distortion, T)
