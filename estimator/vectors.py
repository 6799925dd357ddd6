"""Vectors in space by rows: products, and turns about the axis of rotation."""

import numpy as np


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the scalar products (...) of vectors (..., 3)."""
    return np.sum(a * b, axis=-1)


def cross_matrices(vectors: np.ndarray) -> np.ndarray:
    """Return the matrices (n, 3, 3) that map b to a × b, for vectors a (n, 3)."""
    matrices = np.zeros((len(vectors), 3, 3))
    x, y, z = vectors.T
    matrices[:, 0, 1] = -z
    matrices[:, 0, 2] = y
    matrices[:, 1, 0] = z
    matrices[:, 1, 2] = -x
    matrices[:, 2, 0] = -y
    matrices[:, 2, 1] = x
    return matrices


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the vector products a × b (n, 3) of vectors (n, 3)."""
    return (cross_matrices(a) @ b[..., None])[..., 0]


def turned_about_z(vectors: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return vectors (n, 3) or (3,), each turned about z by its angle (n,), rad."""
    x, y, z = np.moveaxis(np.asarray(vectors), -1, 0)
    c = np.cos(angle)
    s = np.sin(angle)
    return np.stack([c * x - s * y, s * x + c * y, z + 0 * angle], axis=-1)
