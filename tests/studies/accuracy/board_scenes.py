"""Synthetic calibrations: two cameras that look at a whisker's bench, a board held before each, the board on the rig.

Seeded; nothing here uses the adjustment under test, only the projection, which is tested against OpenCV's.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vision.boards.charuco import CharucoBoard
from vision.boards.corners import Corners
from vision.geometry.camera import Camera, Cameras
from vision.geometry.rotation import apply, compose, exp_rotation, invert_transform

BOARD = CharucoBoard((8, 6), 15.0, 11.0, "DICT_5X5_100")
SIZE_PX = (1280, 720)
T_RIG_BOARD = np.column_stack([exp_rotation(np.array([np.pi, 0.0, 0.0])), [-10.0, 40.0, -45.0]])
# Where the whisker is, and a bar's length to either side.
WORK_MM = np.array([[x, 0.0, z] for x in (0.0, 50.0, 100.0) for z in (-30.0, 0.0, 30.0)])


def looking_at(
    name: str, centre_mm: Sequence[float], target_mm: Sequence[float], lens: Sequence[float]
) -> Camera:
    """A camera at `centre_mm` with its axis through `target_mm`, picture upright along rig z. lens: nine terms."""
    centre_mm, target_mm = np.array(centre_mm, dtype=float), np.array(target_mm, dtype=float)
    forward = (target_mm - centre_mm) / np.linalg.norm(target_mm - centre_mm)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    R = np.array([right, np.cross(forward, right), forward])
    fx, fy, cx, cy, *distortion = lens
    matrix, T = [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], np.column_stack([R, -R @ centre_mm])
    return Camera(name, SIZE_PX, matrix, distortion, T)


def two_cameras() -> Cameras:
    """Much as those of a recorded session: 0.4 m away, 30 degrees apart in elevation."""
    return Cameras(
        (
            looking_at(
                "high",
                [60, -180, 330],
                [50, 0, 0],
                [2010, 2012.4, 644.6, 359.6, -0.11, 0.14, 6e-4, -4e-4, 0.0],
            ),
            looking_at(
                "low",
                [30, -340, 130],
                [50, 0, 0],
                [1932, 1934.3, 646.0, 345.2, -0.09, 0.08, -5e-4, 7e-4, 0.01],
            ),
        )
    )


def board_views(
    camera: Camera,
    count: int,
    rng: np.random.Generator,
    *,
    tilt_rad=0.6,
    spin_rad=0.5,
    depth=(0.75, 1.25),
    printed_mm=BOARD.corners_mm,
) -> list:
    """Exact corners of the board held before a camera: list of (ids, px), at random tilts, places and depths."""
    distance = np.linalg.norm(camera.centre_mm - [50, 0, 0])
    views = []
    while len(views) < count:
        z = distance * rng.uniform(*depth)
        middle = camera.rays(rng.uniform(0.3, 0.7, (1, 2)) * camera.size_px)[0]
        view = _view(camera, middle * z, tilt_rad, spin_rad, printed_mm, rng)
        if len(view[0]) >= 12:
            views.append(view)
    return views


def _view(
    camera: Camera,
    toward_mm: np.ndarray,
    tilt_rad: float,
    spin_rad: float,
    printed_mm: np.ndarray,
    rng: np.random.Generator,
):
    R = camera.T_camera_rig[:, :3]
    spin = [0, 0, rng.uniform(-spin_rad, spin_rad)]
    lean = [*rng.uniform(-tilt_rad, tilt_rad, 2), 0]
    turn = exp_rotation(spin) @ exp_rotation(lean)
    T_camera_board = np.column_stack([turn, R @ toward_mm - turn @ printed_mm.mean(axis=0)])
    rig = apply(compose(invert_transform(camera.T_camera_rig), T_camera_board), printed_mm)
    return _inside(camera, rig)


def _inside(camera: Camera, points_mm: np.ndarray):
    px = camera.project(points_mm)
    seen = np.all((px > 5) & (px < np.array(camera.size_px) - 6), axis=1)
    return np.flatnonzero(seen), px[seen]


def rig_view(
    camera: Camera, T_rig_board: np.ndarray = T_RIG_BOARD, printed_mm: np.ndarray = BOARD.corners_mm
):
    """Exact corners of the board on the rig, (ids, px)."""
    return _inside(camera, apply(T_rig_board, printed_mm))


def noisy(view, sigma_px: float, rng: np.random.Generator) -> Corners:
    """The view (ids, px) with Gaussian noise of sigma_px an axis, and the sigma stated."""
    ids, px = view
    return Corners(
        ids, px + sigma_px * rng.standard_normal(px.shape), np.full(len(ids), max(sigma_px, 1e-9))
    )


def measured_pose(
    T: np.ndarray, sigma_mm: float, sigma_rad: float, rng: np.random.Generator
) -> np.ndarray:
    """The board's pose as someone measured it."""
    turn = np.column_stack([exp_rotation(sigma_rad * rng.standard_normal(3)), np.zeros(3)])
    shift = np.column_stack([np.eye(3), sigma_mm * rng.standard_normal(3)])
    return np.column_stack([compose(turn, T)[:, :3], compose(shift, T)[:, 3]])


@dataclass(frozen=True, eq=False)
class Recording:
    """Exact views of a session: cameras, views by camera, the board on the rig by camera."""

    cameras: Cameras
    boards: dict
    rig: dict

    def seen(self, sigma_px: float, rng: np.random.Generator) -> tuple[dict, dict]:
        """board_views and rig_views as a calibration wants them, with noise."""
        boards = {
            name: [noisy(v, sigma_px, rng) for v in views] for name, views in self.boards.items()
        }
        return boards, {name: noisy(v, sigma_px, rng) for name, v in self.rig.items()}


def a_recording(
    views: int = 10, seed: int = 1, printed_mm: np.ndarray = BOARD.corners_mm, **how
) -> Recording:
    """A session of `views` board views a camera, printed_mm (m, 3) being the board's corners."""
    rng, cameras = np.random.default_rng(seed), two_cameras()
    boards = {}
    rig = {}
    for camera in cameras:
        boards[camera.name] = board_views(camera, views, rng, printed_mm=printed_mm, **how)
        rig[camera.name] = rig_view(camera, printed_mm=printed_mm)
    return Recording(cameras, boards, rig)


def moving_board(time_s: float) -> np.ndarray:
    """T_rig_board of a board waved about above the rig, up to 0.2 m/s and 50 degrees a second."""
    sway = np.sin(2 * np.pi * np.array([0.31, 0.43, 0.27]) * time_s + [0.3, 1.0, 2.0])
    lean = exp_rotation(
        0.35 * np.sin(2 * np.pi * np.array([0.37, 0.29, 0.21]) * time_s + [1.2, 0.1, 0.7])
    )
    R = lean @ T_RIG_BOARD[:, :3]
    middle = np.array([50.0, 0.0, -20.0]) + np.array([50.0, 35.0, 30.0]) * sway
    return np.column_stack([R, middle - R @ BOARD.corners_mm.mean(axis=0)])


def shaken_board(time_s: float, shake_mm: float, phases: np.ndarray) -> np.ndarray:
    """T_rig_board of `moving_board` that is shaken besides, at about 4 Hz: by shake_mm, and by a radian every 60 mm
    of that. phases (6,): of the shaking along and about each axis."""
    T = moving_board(time_s)
    angles = 2 * np.pi * 4.0 * np.array([1.0, 1.13, 0.9, 1.07, 0.95, 1.2]) * time_s + phases
    shake = shake_mm * np.sin(angles)
    R = exp_rotation(shake[3:] / 60.0) @ T[:, :3]
    middle = T[:, :3] @ BOARD.corners_mm.mean(axis=0) + T[:, 3] + shake[:3]
    return np.column_stack([R, middle - R @ BOARD.corners_mm.mean(axis=0)])


@dataclass(frozen=True)
class Film:
    """A film of a shaken board by two cameras that are not triggered together.

    period_s: of its frames. late: of the second camera, in periods; jitter: scatter of each picture's instant, too.
    """

    shake_mm: float
    period_s: float = 1 / 30
    frames: int = 40
    late: float = 0.25
    jitter: float = 0.02

    def views(self, cameras: Cameras, sigma_px: float, rng: np.random.Generator) -> dict:
        """Corners of each camera's frames, by its name."""
        phases = rng.uniform(0, 2 * np.pi, 6)
        first_s = rng.uniform(0, 100)
        boards = {camera.name: [] for camera in cameras}
        for frame in range(self.frames):
            for camera, late in zip(cameras, (0.0, self.late)):
                when = frame + late + self.jitter * rng.standard_normal()
                T = shaken_board(first_s + self.period_s * when, self.shake_mm, phases)
                boards[camera.name].append(noisy_view_at(camera, T, sigma_px, rng))
        return boards


def noisy_view_at(
    camera: Camera, T_rig_board: np.ndarray, sigma_px: float, rng: np.random.Generator
) -> Corners:
    """What a camera sees of the board at that pose, with noise."""
    return noisy(rig_view(camera, T_rig_board), sigma_px, rng)
