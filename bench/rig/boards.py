"""How a careful person holds the board up for a camera's calibration: tilted all ways, near and far, all over the
picture.
"""

import math

import cv2
import numpy as np

from bench.rig.pinhole import Camera
from bench.rig.printed_board import Board

_GOLDEN_RAD = math.pi * (
    3 - math.sqrt(5)
)  # rad: the golden angle, by which views lean to all sides evenly


def poses(board: Board, camera: Camera, count: int, rng: np.random.Generator) -> list[np.ndarray]:
    """T_rig_board (3, 4) of each view."""
    order = rng.permutation(count)
    return [_pose(board, camera, i, int(order[i]), count, rng) for i in range(count)]


def _pose(board, camera, index, depth_rank, count, rng):
    share = (depth_rank + 0.5) / count
    width = (0.85 - 0.45 * share) * camera.size_px[0]  # of the board in the picture
    depth = camera.matrix[0, 0] * board.size_mm[0] / width
    tilt = math.radians(rng.uniform(15, 42)) if index else 0.0
    way = index * _GOLDEN_RAD
    axis = np.array([math.cos(way), math.sin(way), 0.0])
    turn = (
        cv2.Rodrigues(tilt * axis)[0]
        @ cv2.Rodrigues(np.array([0, 0, math.radians(rng.uniform(-50, 50))]))[0]
    )
    spread = 0.28 * np.array([math.cos(2.4 * way), math.sin(2.4 * way)]) * math.sqrt(index / count)
    off_px = spread * camera.size_px + rng.uniform(-20, 20, 2)
    ray = np.append(off_px / np.diag(camera.matrix)[:2], 1.0)
    middle = turn @ [0.5 * board.size_mm[0], 0.5 * board.size_mm[1], 0]
    to_rig = camera.rotation.T
    return np.column_stack([to_rig @ turn, to_rig @ (depth * ray - middle - camera.translation_mm)])
