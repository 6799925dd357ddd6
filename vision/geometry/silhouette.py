"""The outline of a round rod in a picture: where the middle between its two edges is, and how wide it is."""

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.rotation import cross


def outline(
    camera: Camera, points_mm: np.ndarray, directions: np.ndarray, radius_mm: float | np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Middle (n, 2) and half-width (n,) in pixels of a rod's outline at points (n, 3) of its axis.

    directions (n, 3) unit: the rod's local direction.
    """
    one, other = edges(camera, points_mm, directions, radius_mm)
    middle = 0.5 * (one + other)
    return middle, 0.5 * np.abs(np.sum((one - other) * normals(middle), axis=1))


def edges(
    camera: Camera, points_mm: np.ndarray, directions: np.ndarray, radius_mm: float | np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The two edges (n, 2) each of a rod's outline at points (n, 3) of its axis; directions (n, 3), unit."""
    one, other = np.split(
        camera.project(np.concatenate(grazed(camera, points_mm, directions, radius_mm))), 2
    )
    return one, other


def grazed(
    camera: Camera, points_mm: np.ndarray, directions: np.ndarray, radius_mm: float | np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) and (n, 3) of a rod's surface on its two edges, as the camera sees them, see `outline`.

    The two lines of sight that graze a cylinder touch it r²/d before its axis and r √(1 - r²/d²) beside it, d being
    the distance of the camera from the axis.
    """
    points, directions = np.atleast_2d(points_mm), np.atleast_2d(directions)
    radius = np.broadcast_to(radius_mm, len(points))[:, None]
    sight = points - camera.centre_mm
    sight = sight - np.sum(sight * directions, axis=1, keepdims=True) * directions
    distance = np.linalg.norm(sight, axis=1, keepdims=True)
    sideways = cross(directions, sight / distance)
    near = points - radius**2 / distance**2 * sight
    aside = radius * np.sqrt(np.maximum(1.0 - radius**2 / distance**2, 0.0)) * sideways
    return near + aside, near - aside


def normals(curve_px: np.ndarray) -> np.ndarray:
    """Unit normals (…, n, 2) of curves (…, n, 2) given point by point."""
    if curve_px.shape[-2] < 2:
        return np.broadcast_to([0.0, 1.0], curve_px.shape)
    tangent = np.gradient(curve_px, axis=-2)
    normal = np.stack([-tangent[..., 1], tangent[..., 0]], axis=-1)
    return normal / np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
