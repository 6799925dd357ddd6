"""The views for a camera's lens: the board tilted all ways, near and far, all over the picture."""

import math
from collections.abc import Sequence

import cv2
import numpy as np

from bench.rig.linear import rotation_about_z
from bench.rig.other_boards import AnyBoard
from bench.rig.pinhole import PinholeCamera

# rad: the golden angle, by which views lean to all sides evenly
_GOLDEN_RAD = math.pi * (3 - math.sqrt(5))
_STEP_BACK = np.array([0.9, 0.9, 1.05])  # of a board that is not seen whole, in the camera's axes
_RIM_PX = 12.0  # of white round a board that is seen whole
# mm along the board's x, y and away from the cameras: how far a board that several see is held from the middle
_SHARED_REACH_MM = np.array([25.0, 15.0, 45.0])


def draw_poses(
    board: AnyBoard, camera: PinholeCamera, count: int, rng: np.random.Generator
) -> list[np.ndarray]:
    """Draw the pose (3, 4) of the print in each view, in the rig frame."""
    order = rng.permutation(count)
    poses = [_draw_pose(board, camera, i, count, int(order[i]), rng) for i in range(count)]
    if board.is_found_in_parts:
        return poses
    return [_in_view(board, camera, pose) for pose in poses]


def draw_shared_poses(
    board: AnyBoard, cameras: Sequence[PinholeCamera], count: int, rng: np.random.Generator
) -> list[np.ndarray]:
    """Draw the pose (3, 4) of the print in each view that several cameras see at once.

    The board is held about the point nearest to all optical axes, tilted about the mean of the
    directions from there to the cameras.
    """
    towards = np.array([-_middle_ray(camera) for camera in cameras])  # (n, 3), unit
    centres = np.array([camera.centre_mm for camera in cameras])
    across = np.eye(3) - towards[:, :, None] * towards[:, None]  # onto the planes across the axes
    middle_mm = np.linalg.solve(across.sum(0), np.einsum("nij,nj->i", across, centres))
    facing = _facing(towards.sum(0))
    half_mm = _middle_mm(board)
    poses = []
    for index in range(count):
        turn = facing @ _draw_rotation(index, rng)
        place = middle_mm + facing @ rng.uniform(-_SHARED_REACH_MM, _SHARED_REACH_MM)
        poses.append(np.column_stack([turn, place - turn @ half_mm]))
    return poses


def _middle_mm(board: AnyBoard) -> np.ndarray:
    """Return the middle (3,) of a print."""
    return np.append(0.5 * np.array(board.size_mm), 0.0)


def _in_view(board: AnyBoard, camera: PinholeCamera, pose: np.ndarray) -> np.ndarray:
    """Return a pose (3, 4) moved to the camera's axis and away from it until the whole print is seen."""
    width, height = board.size_mm
    outline_mm = np.array([[0, 0, 0], [width, 0, 0], [width, height, 0], [0, height, 0]])
    middle_mm = _middle_mm(board)
    place = camera.in_camera(pose[:, :3] @ middle_mm + pose[:, 3])
    while True:
        in_rig = camera.rotation.T @ (place - camera.translation_mm)
        moved = np.column_stack([pose[:, :3], in_rig - pose[:, :3] @ middle_mm])
        px = camera.project(outline_mm @ moved[:, :3].T + moved[:, 3])
        last_px = np.array(camera.size_px) - 1 - _RIM_PX
        if np.all((px > _RIM_PX) & (px < last_px)):
            return moved
        place = place * _STEP_BACK


def _middle_ray(camera: PinholeCamera) -> np.ndarray:
    """Return the direction (3,) in the rig frame of the middle of a camera's picture."""
    middle_px = 0.5 * (np.array(camera.size_px) - 1)
    x, y = camera.rays(middle_px[:1], middle_px[1:])
    ray = camera.rotation.T @ [x.item(), y.item(), 1.0]
    return ray / np.linalg.norm(ray)


def _facing(towards: np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) of a board that faces along a direction (3,); its x axis is level."""
    back = -towards / np.linalg.norm(towards)  # the board's z goes into it
    right = np.cross(back, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(back, right), back])


def _draw_pose(board, camera, index, count, depth_rank, rng):
    """Draw T_rig_board (3, 4) of one view; depth_rank 0 is the nearest."""
    nearness = (depth_rank + 0.5) / count
    board_px = (0.85 - 0.45 * nearness) * camera.size_px[0]
    depth_mm = camera.matrix[0, 0] * board.size_mm[0] / board_px
    rotation = _draw_rotation(index, rng)
    place = math.sqrt(index / count)  # from the picture's middle outwards
    offset_px = 0.28 * _direction(2.4 * (index * _GOLDEN_RAD)) * place * camera.size_px
    offset_px += rng.uniform(-20, 20, 2)
    ray = np.append(offset_px / np.diag(camera.matrix)[:2], 1.0)
    middle = rotation @ _middle_mm(board)
    to_rig = camera.rotation.T
    shift = to_rig @ (depth_mm * ray - middle - camera.translation_mm)
    return np.column_stack([to_rig @ rotation, shift])


def _draw_rotation(index, rng):
    """Draw the rotation (3, 3) of one view's board; the first one faces the camera."""
    tilt_rad = math.radians(rng.uniform(15, 42)) if index else 0.0
    axis = np.append(_direction(index * _GOLDEN_RAD), 0.0)
    tilt = cv2.Rodrigues(tilt_rad * axis)[0]
    return tilt @ rotation_about_z(math.radians(rng.uniform(-50, 50)))


def _direction(angle_rad):
    """Return the unit vector (2,) at an angle."""
    return np.array([math.cos(angle_rad), math.sin(angle_rad)])
