"""The views for a camera's lens: the board tilted all ways, near and far, all over the picture."""

import math

import cv2
import numpy as np

from bench.rig.linear import rotation_about_z
from bench.rig.pinhole import PinholeCamera
from bench.rig.printed_board import PrintedBoard

# rad: the golden angle, by which views lean to all sides evenly
_GOLDEN_RAD = math.pi * (3 - math.sqrt(5))


def draw_poses(
    board: PrintedBoard, camera: PinholeCamera, count: int, rng: np.random.Generator
) -> list[np.ndarray]:
    """Draw T_rig_board (3, 4) of each view."""
    order = rng.permutation(count)
    return [_draw_pose(board, camera, i, count, int(order[i]), rng) for i in range(count)]


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
    middle = rotation @ np.append(0.5 * np.array(board.size_mm), 0.0)
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
