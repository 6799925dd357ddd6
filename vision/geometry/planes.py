"""Planes of sight: what straight things span with cameras, and the lines in which planes meet."""

import numpy as np

from vision.geometry.newton import cauchy_weights

# [rounds] Of reweighting; it converges in fewer. Stated.
_ROUNDS = 12


def fit_plane(
    rays: np.ndarray, focal_px: float, scatter_px: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the unit normal (3,) of the plane of two rays or more (n, 3), and their Cauchy weights
    (n,).

    scatter_px: scale of the weights, in the picture of a camera of this focal length.
    """
    weight = np.ones(len(rays))
    for _ in range(_ROUNDS):
        triangle = np.linalg.qr(rays * np.sqrt(weight)[:, None], mode="r")
        normal = np.linalg.svd(triangle)[2][2]
        weight = cauchy_weights(rays @ normal * focal_px, scatter_px)
    return normal, weight


def meet_planes(normals: np.ndarray, centres_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a point (3,), mm, and the direction (3,) of the line in which planes meet best.

    normals (c, 3): unit. centres_mm (c, 3): a point of each plane.
    """
    offsets_mm = np.sum(normals * centres_mm, axis=1)
    direction = np.linalg.svd(normals)[2][2]
    return np.linalg.lstsq(normals, offsets_mm, rcond=None)[0], direction


def nearest_along_mm(
    point_mm: np.ndarray, direction: np.ndarray, centre_mm: np.ndarray, ray: np.ndarray
) -> float:
    """Return how far from a point (3,) along a line, mm, a ray (3,) from a centre (3,) comes nearest
    to it.
    """
    across = ray - (ray @ direction) * direction
    depth_mm = (point_mm - centre_mm) @ across / (across @ across)
    return (centre_mm + depth_mm * ray - point_mm) @ direction
