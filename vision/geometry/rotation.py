"""Rotations as small vectors: exponential, logarithm, the nearest proper rotation. Angles in rad.

SciPy's Rotation is used for the exponential. Its logarithm takes 3 to 15 times as long as the one
here and raises where a pose is NaN; the Jacobian is not in it.
"""

import numpy as np
from scipy.spatial.transform import Rotation

# [1] Sine of the angle below which a rotation matrix gives its axis by its symmetric part. Derived.
_SMALL_SINE = 1e-6
# [1] Least length that a vector is divided by. Stated.
_TINY = 1e-12
# [rad] Below it (θ − sin θ)/θ³ loses its digits; its limit is 1/6. Derived.
_SMALL_ANGLE_RAD = 1e-4


def skew(v: np.ndarray) -> np.ndarray:
    """Return cross-product matrices (..., 3, 3) of vectors (..., 3): skew(v) @ x = v × x."""
    v = np.asarray(v, dtype=float)
    matrix = np.zeros((*v.shape[:-1], 3, 3))
    matrix[..., 2, 1] = v[..., 0]
    matrix[..., 0, 2] = v[..., 1]
    matrix[..., 1, 0] = v[..., 2]
    return matrix - np.swapaxes(matrix, -1, -2)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the cross products (..., 3) of vectors (..., 3), in half of NumPy's time for few
    vectors.
    """
    next_axis = [1, 2, 0]
    last_axis = [2, 0, 1]
    forward = a.take(next_axis, -1) * b.take(last_axis, -1)
    return forward - a.take(last_axis, -1) * b.take(next_axis, -1)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (..., k) at unit length; one of no length stays so."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), _TINY)


def across(vectors: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return vectors (..., 3) without their part along unit directions (..., 3)."""
    return vectors - np.sum(vectors * directions, axis=-1, keepdims=True) * directions


def turned_about(axis: np.ndarray, begin: np.ndarray, turn_rad: np.ndarray) -> np.ndarray:
    """Return vectors (..., 3) turned about axes (..., 3) at right angles to them."""
    return np.cos(turn_rad) * begin + np.sin(turn_rad) * np.cross(axis, begin)


def exp_rotation(w: np.ndarray) -> np.ndarray:
    """Return the rotation matrices (..., 3, 3) by the angles |w| about the axes w (..., 3)."""
    w = np.asarray(w, dtype=float)
    matrices = Rotation.from_rotvec(w.reshape(-1, 3)).as_matrix()
    return matrices.reshape(*w.shape, 3)


def log_rotation(R: np.ndarray) -> np.ndarray:
    """Return the shortest vectors w (..., 3) with exp_rotation(w) = R (..., 3, 3)."""
    R = np.asarray(R, dtype=float)
    antisymmetric = R - np.swapaxes(R, -1, -2)
    axis_sine = 0.5 * antisymmetric[..., [2, 0, 1], [1, 2, 0]]
    sine = np.linalg.norm(axis_sine, axis=-1)
    cosine = 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1.0)
    angle = np.arctan2(sine, cosine)
    is_small = sine <= _SMALL_SINE
    factor = np.where(is_small, 1.0, angle / np.maximum(sine, _SMALL_SINE))
    w = axis_sine * factor[..., None]
    for index in map(tuple, np.argwhere(is_small & (cosine < 0))):
        w[index] = angle[index] * _axis_of_half_turn(R[index])
    return w


def angle_between(R: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the angles (...), rad, by which rotations (..., 3, 3) differ."""
    return np.linalg.norm(log_rotation(R @ np.swapaxes(other, -1, -2)), axis=-1)


def left_jacobian(w: np.ndarray) -> np.ndarray:
    """Return J (..., 3, 3) with Exp(w + d) = Exp(J d) Exp(w) to first order in d, at w (..., 3)."""
    angle = np.linalg.norm(w, axis=-1)[..., None, None]
    is_small = angle < _SMALL_ANGLE_RAD
    divisor = np.where(is_small, 1.0, angle)
    # J = 1 + (1 − cos a) / a² W + (a − sin a) / a³ W², with limits of 1/2 and 1/6.
    first = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    second = np.where(is_small, 1.0 / 6.0, (divisor - np.sin(divisor)) / divisor**3)
    W = skew(w)
    return np.eye(3) + first * W + second * (W @ W)


def _axis_of_half_turn(R: np.ndarray) -> np.ndarray:
    """Return the unit axis (3,) of a rotation by half a turn, R = 2 a aᵀ − 1: the direction of the
    longest column of R + 1.
    """
    columns = R + np.eye(3)
    axis = columns[:, np.argmax(np.diag(columns))]
    return axis / np.linalg.norm(axis)


def nearest_rotation(M: np.ndarray) -> np.ndarray:
    """Return the proper rotation (3, 3) closest to M (3, 3) in the Frobenius norm, by SVD."""
    U, _, Vt = np.linalg.svd(M)
    return U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt


def invert_transform(T: np.ndarray) -> np.ndarray:
    """Return T_b_a of T_a_b, both (3, 4)."""
    R = T[:, :3].T
    return np.column_stack([R, -R @ T[:, 3]])


def compose(T_a_b: np.ndarray, T_b_c: np.ndarray) -> np.ndarray:
    """Return T_a_c of two transforms (3, 4)."""
    return np.column_stack([T_a_b[:, :3] @ T_b_c[:, :3], T_a_b[:, :3] @ T_b_c[:, 3] + T_a_b[:, 3]])


def apply(T_a_b: np.ndarray, points_b: np.ndarray) -> np.ndarray:
    """Transform points (n, 3) of frame b to frame a by T_a_b (3, 4)."""
    return points_b @ T_a_b[:, :3].T + T_a_b[:, 3]


def moved_pose(T: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Return poses (..., 3, 4) moved by steps (..., 6), w rad and v mm: (Exp(w) R, t + v)."""
    R = exp_rotation(step[..., :3]) @ T[..., :3]
    t = T[..., 3] + step[..., 3:]
    return np.concatenate([R, t[..., None]], axis=-1)


def pose_difference(T_from: np.ndarray, T_to: np.ndarray) -> np.ndarray:
    """Return (w, v) (6,), rad and mm, by which `moved_pose` makes T_to (3, 4) of T_from (3, 4)."""
    w = log_rotation(T_to[:, :3] @ T_from[:, :3].T)
    return np.concatenate([w, T_to[:, 3] - T_from[:, 3]])
