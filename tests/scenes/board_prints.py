"""Prints of every kind of board, as their reflectance, and pictures of them by known cameras."""

from functools import cache

import cv2
import numpy as np
from scipy.interpolate import RectBivariateSpline

from vision.boards import AprilGrid, AsymmetricCircles, CharucoBoard, Checkerboard, CircleGrid
from vision.geometry import Board, Camera
from vision.geometry.lens import unproject
from vision.geometry.rotation import invert_transform

KINDS = (
    CharucoBoard((8, 6), 15.0, 11.0, "DICT_5X5_100"),
    Checkerboard((8, 7), 13.0),
    Checkerboard((9, 7), 12.0),  # looks the same after half a turn
    CircleGrid((8, 6), 14.0, 8.0),
    AsymmetricCircles((4, 9), 12.0, 8.0),
    AprilGrid((5, 4), 22.0, 17.0),
)
NAMES = [f"{board.kind}-{board.squares[0]}x{board.squares[1]}" for board in KINDS]
_PX_PER_MM = 12
_MARGIN_MM = 14.0
_STEP_PX = 8
_WHITE, _BLACK = 210.0, 45.0


@cache
def printed(board: Board) -> tuple[np.ndarray, np.ndarray]:
    """Return the print, uint8 at _PX_PER_MM, and the board's coordinates (2,) mm of its first pixel's
    outer corner."""
    low = board.corners_mm[:, :2].min(axis=0) - _MARGIN_MM - 20.0
    high = board.corners_mm[:, :2].max(axis=0) + _MARGIN_MM + 20.0
    size = np.ceil((high - low) * _PX_PER_MM).astype(int)
    x = low[0] + (np.arange(size[0]) + 0.5) / _PX_PER_MM
    y = low[1] + (np.arange(size[1]) + 0.5) / _PX_PER_MM
    return np.where(_is_dark(board, x[None, :], y[:, None]), 0, 255).astype(np.uint8), low


def _is_dark(board: Board, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    side = board.square_mm
    if isinstance(board, Checkerboard):
        nx, ny = board.squares
        on = (x > 0) & (x < nx * side) & (y > 0) & (y < ny * side)
        return on & ((np.floor(x / side) + np.floor(y / side)) % 2 == 0)
    if isinstance(board, CharucoBoard):
        nx, ny = board.squares
        px = 120
        picture = board.opencv().generateImage((nx * px, ny * px), marginSize=0)
        column = np.clip((x / side * px).astype(int), 0, nx * px - 1)
        row = np.clip((y / side * px).astype(int), 0, ny * px - 1)
        on = (x > 0) & (x < nx * side) & (y > 0) & (y < ny * side)
        return on & (picture[row, column] < 128)
    if isinstance(board, AprilGrid):
        return _dark_tags(board, x, y)
    dark = np.zeros(np.broadcast_shapes(x.shape, y.shape), dtype=bool)
    for cx, cy, _ in board.corners_mm:
        dark |= (x - cx) ** 2 + (y - cy) ** 2 < (0.5 * board.marker_mm) ** 2
    return dark


def _dark_tags(board: AprilGrid, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """As Kalibr prints them: rim of two modules, upside down, a dark square at each tag's corner."""
    gap = board.square_mm - board.marker_mm
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    dark = np.zeros(np.broadcast_shapes(x.shape, y.shape), dtype=bool)
    for row in range(board.squares[1]):
        for column in range(board.squares[0]):
            left, low = column * board.square_mm, row * board.square_mm
            number = row * board.squares[0] + column
            tag = cv2.aruco.generateImageMarker(dictionary, number, 10, borderBits=2)
            tag = tag[:, ::-1]  # upside down is mirrored left to right, and rows counted upward
            u = np.floor((x - left) / board.marker_mm * 10).astype(int)
            v = np.floor((y - low) / board.marker_mm * 10).astype(int)
            on = (u >= 0) & (u < 10) & (v >= 0) & (v < 10)
            dark |= on & (tag[np.clip(v, 0, 9), np.clip(u, 0, 9)] == 0)
    for row in range(board.squares[1] + 1):
        for column in range(board.squares[0] + 1):
            left, low = column * board.square_mm - gap, row * board.square_mm - gap
            dark |= (x > left) & (x < left + gap) & (y > low) & (y < low + gap)
    return dark


def picture_of(
    board: Board,
    camera: Camera,
    T_camera_board: np.ndarray,
    rng: np.random.Generator,
    *,
    blur_px: float = 0.8,
    noise: float = 2.0,
    fine: int = 3,
) -> np.ndarray:
    """Return the picture (h, w), uint8, of a board at T_camera_board (3, 4) by a camera's lens.

    Each pixel is the mean of fine² places; a place is a ray's crossing of the print's plane.
    """
    print_, low = printed(board)
    width, height = camera.size_px
    u = (np.arange(fine * width) - 0.5 * (fine - 1)) / fine
    v = (np.arange(fine * height) - 0.5 * (fine - 1)) / fine
    ab = [spline(v, u) for spline in _directions(camera.size_px, tuple(camera.lens))]
    T = invert_transform(T_camera_board)
    rays = np.stack([ab[0], ab[1], np.ones_like(ab[0])], axis=-1) @ T[:, :3].T
    along = -T[2, 3] / rays[..., 2]
    place = (T[:2, 3] + along[..., None] * rays[..., :2] - low) * _PX_PER_MM - 0.5
    place = place.astype(np.float32)
    seen = cv2.remap(print_, place[..., 0], place[..., 1], cv2.INTER_LINEAR, borderValue=255)
    grey = seen.reshape(height, fine, width, fine).mean(axis=(1, 3)) / 255.0
    grey = cv2.GaussianBlur(_BLACK + (_WHITE - _BLACK) * grey, (0, 0), blur_px)
    grey = grey + noise * rng.standard_normal(grey.shape)
    return np.clip(np.round(grey), 0, 255).astype(np.uint8)


@cache
def _directions(size_px: tuple[int, int], lens: tuple[float, ...]) -> list[RectBivariateSpline]:
    """Return splines over (row, column) px of a camera's normalised coordinates, good to 1e-6 px."""
    columns = np.arange(-_STEP_PX, size_px[0] + 2 * _STEP_PX, _STEP_PX)
    rows = np.arange(-_STEP_PX, size_px[1] + 2 * _STEP_PX, _STEP_PX)
    grid = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2).astype(float)
    ab = unproject(grid, np.array(lens)).reshape(len(rows), len(columns), 2)
    return [RectBivariateSpline(rows, columns, ab[..., k]) for k in range(2)]


def pose_before(board: Board, camera: Camera, middle_mm, turn) -> np.ndarray:
    """Return T_camera_board with the board's middle at a place of the camera's frame, turned."""
    middle = 0.5 * (board.corners_mm.min(axis=0) + board.corners_mm.max(axis=0))
    return np.column_stack([turn, np.asarray(middle_mm) - turn @ middle])
