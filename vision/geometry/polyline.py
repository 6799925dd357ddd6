"""A curve in a picture, given point by point: its length, its normals, points along it."""

import numpy as np

from vision.geometry.rotation import unit


def lengths_px(curve_px: np.ndarray) -> np.ndarray:
    """Return the length (m,) of a curve (m, 2) from its first point to each."""
    steps_px = np.linalg.norm(np.diff(curve_px, axis=0), axis=1)
    return np.append(0.0, np.cumsum(steps_px))


def at_lengths(place_px: np.ndarray, length_px: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Interpolate values (m, k) of a curve's points at lengths (s,) along it: (s, k).

    length_px (m,): of the curve up to each point.
    """
    return np.stack([np.interp(place_px, length_px, column) for column in values.T], axis=1)


def normals(curve_px: np.ndarray) -> np.ndarray:
    """Return the unit normals (..., m, 2) of curves (..., m, 2), to the right of the way along them
    in a picture whose y goes down.

    Of a single point it is (0, 1).
    """
    if curve_px.shape[-2] < 2:
        return np.broadcast_to([0.0, 1.0], curve_px.shape)
    tangent = np.gradient(curve_px, axis=-2)
    return unit(np.stack([-tangent[..., 1], tangent[..., 0]], axis=-1))


def beside_nodes(from_node: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how far points (n, 2), from the nodes of a curve, are across it, to the right, and along it.

    normal (n, 2): of the curve at the nodes.
    """
    across = np.sum(from_node * normal, axis=-1)
    return across, np.sum(from_node * tangents_by(normal), axis=-1)


def tangents_by(normal: np.ndarray) -> np.ndarray:
    """Return the tangents (..., 2) of curves with these normals (..., 2)."""
    return np.stack([normal[..., 1], -normal[..., 0]], axis=-1)
