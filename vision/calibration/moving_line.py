"""The line that moves with the motor in the pictures of one free stroke, in space.

Only what moves differs from one frame of a stroke to another, and on a free stroke that is the
whisker: a straight line in each camera, a plane through its centre of projection, and where two
planes meet a line in space.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from vision.geometry.camera import Camera, Cameras
from vision.geometry.grouped import group_means
from vision.geometry.planes import fit_plane, meet_planes, nearest_along_mm
from vision.geometry.rows import Rows
from vision.geometry.sampling import spread
from vision.pictures.change import HALF, change_confidence
from vision.pictures.pixel_noise import Noise, measure_noise

# [share of the stroke] A frame is compared with such as are farther away: there the whisker stands
# elsewhere. By 0.15 or 0.4 a drawn line is found as well. Study:
# tests/vision/calibration/test_turning.py.
_ELSEWHERE = 0.25
# [frames] With which a frame is compared at most. By 2 or 8 a drawn line is found as well. Study:
# tests/vision/calibration/test_turning.py.
_MOST_OTHERS = 4
# [1] Of `change.change_confidence`: 4.8 noise levels after smoothing. Derived.
_SURE = 0.3
# [pixels] Fewer are no line. By 10 or 40 a drawn line is found as well. Study:
# tests/vision/calibration/test_turning.py.
_FEWEST_PIXELS = 20
# [1] Angles of a Hough transform, half a degree apart; refined afterwards. Study:
# tests/bench/trials/test_placing_pictures.py.
_TURNS = 360
# [px] Width of a Hough transform's bins; refined afterwards. Study:
# tests/bench/trials/test_placing_pictures.py.
_BIN_PX = 6.0
# [px] Beside a line: what a lens bends and a whisker sags. Study:
# tests/bench/trials/test_placing_pictures.py.
_NEAR_PX = 8.0
# [px] Beside a line: what noise scatters. Study: tests/bench/trials/test_placing_pictures.py.
_SCATTER_PX = 1.0
# [px] Of a line's pixels; shorter gives no direction. By 20 or 80 a drawn line is found as well.
# Study: tests/vision/calibration/test_turning.py.
_LEAST_LENGTH_PX = 40.0
# [rad] Planes that meet at less give no line: 1/sin 3° multiplies a line's error by 19.
# Derived.
_LEAST_ANGLE_RAD = np.radians(3.0)
# [frames] Of one camera; fewer give no rig frame (`hub_turning.py`). Derived.
_FEWEST_FRAMES = 4


@dataclass(frozen=True, eq=False)
class MovingLines(Rows):
    """The line that moves in one stroke, one row per frame in which it is found, in the cameras'
    frame.

    motor_rad (n,): from the stroke's start on. point_mm (n, 3): middle of the visible line.
    direction (n, 3): unit, either way along it.
    """

    motor_rad: np.ndarray
    point_mm: np.ndarray
    direction: np.ndarray


@dataclass(frozen=True, eq=False)
class _Plane:
    """The plane through a camera's centre of projection in which the moving line lies.

    normal (3,): unit. ray (3,): unit, to the middle of the visible line.
    """

    centre_mm: np.ndarray
    normal: np.ndarray
    ray: np.ndarray


def moving_lines(
    frames: Mapping[str, Mapping[int, np.ndarray]], motor_rad: Mapping[int, float], cameras: Cameras
) -> MovingLines:
    """Find the moving line in each frame of one stroke.

    frames: grey pictures by camera and frame index; motor_rad: by frame index, all of them.
    """
    planes: dict[int, list[_Plane]] = {frame: [] for frame in motor_rad}
    for camera in cameras:
        for frame, plane in _planes(camera, frames.get(camera.name) or {}, motor_rad).items():
            planes[frame].append(plane)
    angles = []
    points = np.zeros((0, 3))
    directions = np.zeros((0, 3))
    for frame, angle in motor_rad.items():
        line = _intersection(planes[frame])
        if line is not None:
            angles.append(angle)
            points = np.vstack([points, line[0]])
            directions = np.vstack([directions, line[1]])
    return MovingLines(np.array(angles), points, directions)


def _planes(
    camera: Camera, pictures: Mapping[int, np.ndarray], motor_rad: Mapping[int, float]
) -> dict[int, _Plane]:
    """Return the plane of the moving line in one camera, by frame."""
    small = {}
    for frame, picture in pictures.items():
        if frame in motor_rad:
            small[frame] = picture[::HALF, ::HALF].astype(float)
    if len(small) < _FEWEST_FRAMES:
        return {}
    noise = measure_noise(*list(small.values())[:2])
    far_rad = _ELSEWHERE * np.ptp([motor_rad[frame] for frame in small])
    planes = {}
    for frame, grey in small.items():
        elsewhere = []
        for other in small:
            if abs(motor_rad[other] - motor_rad[frame]) >= far_rad:
                elsewhere.append(small[other])
        plane = _strongest_plane(camera, _change(grey, elsewhere, noise)) if elsewhere else None
        if plane is not None:
            planes[frame] = plane
    return planes


def _change(grey: np.ndarray, others: Sequence[np.ndarray], noise: Noise) -> np.ndarray:
    """Return by how much a picture (h, w) surely differs from a choice of others, the least of all."""
    chosen = spread(others, _MOST_OTHERS)
    return np.min([change_confidence(grey, other, noise) for other in chosen], axis=0)


def _strongest_plane(camera: Camera, change: np.ndarray) -> _Plane | None:
    """Return the plane of the strongest line in a picture (h, w) of what moves; None where there is
    none.

    The line is fitted in rays, so that the lens's distortion does not bend it.
    """
    mask = (change > _SURE).astype(np.uint8)
    lines = cv2.HoughLines(mask, _BIN_PX / HALF, np.pi / _TURNS, _FEWEST_PIXELS)
    if lines is None:
        return None
    offset, angle_rad = lines[0].ravel().astype(float)  # the strongest comes first
    px = HALF * np.argwhere(mask.T).astype(float)  # (n, 2) x, y
    middle_px = _middles_along(px, angle_rad, HALF * offset)
    rays = camera.rays(middle_px)
    rays = rays[np.isfinite(rays[:, 0])]
    plane = _fit_plane(rays, camera.lens[0])
    return None if plane is None else _Plane(camera.centre_mm, *plane)


def _fit_plane(rays: np.ndarray, focal_px: float) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the unit normal (3,) of the plane of rays (n, 3), with Cauchy's weights, and the ray
    (3,) in their middle; None where too few rays agree.
    """
    if len(rays) * HALF < _LEAST_LENGTH_PX:
        return None
    normal, weight = fit_plane(rays, focal_px, _SCATTER_PX)
    if weight.sum() * HALF < _LEAST_LENGTH_PX:
        return None
    middle = np.searchsorted(np.cumsum(weight), 0.5 * weight.sum())
    return normal, rays[middle]


def _middles_along(px: np.ndarray, angle_rad: float, offset_px: float) -> np.ndarray:
    """Return the means (k, 2) of the points px (n, 2) near a line, at each step along it: a hub is
    many points and few steps.

    angle_rad, offset_px: of the line's normal, and of the line along that.
    """
    normal = np.array([np.cos(angle_rad), np.sin(angle_rad)])
    near = px[np.abs(px @ normal - offset_px) < _NEAR_PX]
    along = near @ np.array([-normal[1], normal[0]])
    _, step = np.unique(np.round(along / HALF), return_inverse=True)
    return group_means(step, near)


def _intersection(planes: Sequence[_Plane]) -> tuple[np.ndarray, np.ndarray] | None:
    """Return a point (3,), mm, and the direction (3,) of the line in which planes meet; None where
    they are fewer than two or nearly parallel.

    The point is the middle of the visible line.
    """
    if len(planes) < 2:
        return None
    normals = np.array([plane.normal for plane in planes])
    strength = np.linalg.svd(normals, compute_uv=False)
    if strength[1] < np.sqrt(2) * np.sin(0.5 * _LEAST_ANGLE_RAD):
        return None
    point, direction = meet_planes(normals, np.array([plane.centre_mm for plane in planes]))
    along_mm = []
    for plane in planes:
        along_mm.append(nearest_along_mm(point, direction, plane.centre_mm, plane.ray))
    return point + np.median(along_mm) * direction, direction
