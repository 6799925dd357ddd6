"""A camera as other programs state it, with what all of their files need."""

from collections.abc import Sequence

import numpy as np

from vision.geometry.camera import MOST_NUMBER, Camera
from vision.geometry.refusals import Refused

# [mm/m] A unit. Derived.
MM_PER_M = 1000.0


def foreign_camera(
    name: str,
    size_px: Sequence[float] | np.ndarray,
    matrix: np.ndarray,
    distortion: Sequence[float] | np.ndarray,
    T_camera_world: np.ndarray | None = None,
    rms_px: float = np.nan,
) -> Camera:
    """Return a camera with OpenCV's lens, at T_camera_world (3, 4), mm, or at the world's origin.

    distortion: k1 k2 p1 p2 and perhaps k3 and more. Raises Refused where a term beyond k3 is not 0,
    or numbers are no camera's.
    """
    terms = _terms(name, distortion)
    if np.any(terms[5:]):
        raise Refused(
            f"camera {name} has {len(terms)} distortion terms; up to five (k1 k2 p1 p2 k3) are read"
        )
    T = np.eye(3, 4) if T_camera_world is None else np.asarray(T_camera_world, dtype=float)
    lens = np.append(terms, np.zeros(5))[:5]
    try:
        size = tuple(float(n) for n in size_px)
        return Camera(name, size, np.array(matrix, dtype=float), lens, T, rms_px)
    except (TypeError, ValueError, OverflowError) as error:
        if isinstance(error, Refused):
            raise
        raise Refused(f"camera {name}: {error}") from error


def _terms(name: str, distortion: Sequence[float] | np.ndarray) -> np.ndarray:
    """Return distortion terms as an array (n,). Raise Refused where they are no numbers."""
    try:
        return np.array(distortion, dtype=float).ravel()
    except (TypeError, ValueError, OverflowError):
        raise Refused(f"camera {name}: its distortion is no list of numbers") from None


def numbers(value: object, shape: tuple[int, ...], what: str) -> np.ndarray:
    """Return a value as an array of that shape; raise Refused, naming it, where it is none."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        array = np.empty(0)
    if array.size != np.prod(shape) or not np.all(np.abs(array) < MOST_NUMBER):
        raise Refused(f"{what} must be {' x '.join(map(str, shape))} numbers")
    return array.reshape(shape)


def matrix_of(fx: float, fy: float, cx: float, cy: float) -> np.ndarray:
    """Return the camera matrix (3, 3), px."""
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def in_metres(T: np.ndarray) -> np.ndarray:
    """Return a pose (3, 4) in mm with its shift in metres."""
    return np.column_stack([T[:, :3], T[:, 3] / MM_PER_M])


def in_millimetres(T: np.ndarray) -> np.ndarray:
    """Return a pose (3, 4) in metres with its shift in mm."""
    return np.column_stack([T[:, :3], T[:, 3] * MM_PER_M])
