"""Which way the force on a pushed whisker points, in the frame that turns with the motor, by exact directions.

Through a push the bar turns in that frame by θ, the whisker's tangent at the contact by more: the bar's normal, which
stands across both, grows steeper than β by some θ² tan β, and so does the force. (13) and (14) are the first order.
"""

import numpy as np


def slip_angle(
    theta_rad: np.ndarray, beta_rad: float, across_rad: np.ndarray, left: float | np.ndarray = 1.0
) -> np.ndarray:
    """Return |φ| (n,) at pushing angles (n,) against a bar of slope β > 0.

    across_rad (n,): angle of the force from the bar's normal. Without a push φ is β − across_rad. left: share
    of the base's diameter that the whisker has at the contact, one or (n,).
    """
    bar = _bar_directions(theta_rad, beta_rad)
    phi = beta_rad - across_rad
    turn = _tangent_over_chord(left) * theta_rad * np.cos(beta_rad) / np.cos(across_rad)
    tangent = _vectors(np.cos(turn), -np.sin(turn) * np.cos(phi), np.sin(turn) * np.sin(phi))
    normal = np.cross(bar, tangent)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    force = -normal - np.tan(across_rad)[..., None] * bar
    return np.arctan2(force[:, 2], -force[:, 1])


def _bar_directions(theta_rad: np.ndarray, beta_rad: float) -> np.ndarray:
    """Return the bar's direction (n, 3) at pushing angles (n,), in the frame that turns with the motor."""
    sin = np.sin(theta_rad) * np.sin(beta_rad)
    cos = np.cos(theta_rad) * np.sin(beta_rad)
    return _vectors(sin, cos, np.cos(beta_rad))


def _tangent_over_chord(left: float | np.ndarray) -> float | np.ndarray:
    """Return the angle of a rod's tangent where it is pushed over that of its chord, by small angles.

    With w of the base's diameter left there, the tangent turns by F d²(1 + 2w)/(6 EI w²) and the point moves by
    F d³/(3 EI w).
    """
    return 1.0 + 0.5 / left


def _vectors(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return vectors (n, 3) of components that are arrays (n,) or numbers."""
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)
