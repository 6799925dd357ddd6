"""The outline of a round rod in a picture: the middle between its two edges, and its half-width.

The two lines of sight that graze a cylinder of radius r touch it r²/d before its axis and r √(1 -
r²/d²) to its side, with d the camera's distance from the axis. Both points are projected exactly,
so that perspective and lens count.
"""

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.polyline import normals
from vision.geometry.rotation import across, cross


def outline(
    camera: Camera, points_mm: np.ndarray, directions: np.ndarray, radius_mm: float | np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the middle (..., n, 2) and half-width (..., n) px of a rod's outline at points of its
    axis.

    Arguments are as of `grazed`.
    """
    one, other = edges(camera, points_mm, directions, radius_mm)
    middle = 0.5 * (one + other)
    width = np.abs(np.sum((one - other) * normals(middle), axis=-1))
    return middle, 0.5 * width


def edges(
    camera: Camera, points_mm: np.ndarray, directions: np.ndarray, radius_mm: float | np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the two edges, each (..., n, 2) px, of a rod's outline at points of its axis.

    Arguments are as of `grazed`.
    """
    one, other = camera.project(np.stack(grazed(camera, points_mm, directions, radius_mm)))
    return one, other


def grazed(
    camera: Camera, points_mm: np.ndarray, directions: np.ndarray, radius_mm: float | np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the points (..., n, 3) of a rod's surface where sights graze it, on either side.

    points_mm (..., n, 3): of its axis. directions (..., n, 3): unit vectors along the rod.
    radius_mm: one, or (..., n).
    """
    points = np.atleast_2d(points_mm)
    directions = np.atleast_2d(directions)
    radius = np.asarray(radius_mm)[..., None]
    sight = across(points - camera.centre_mm, directions)
    distance = np.linalg.norm(sight, axis=-1, keepdims=True)
    sideways = cross(directions, sight / distance)
    near = points - radius**2 / distance**2 * sight
    cosine = np.sqrt(np.maximum(1.0 - radius**2 / distance**2, 0.0))
    offset = radius * cosine * sideways
    return near + offset, near - offset
