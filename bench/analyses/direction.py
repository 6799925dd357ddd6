"""Which way the force on a pushed whisker points, in the frame that turns with the motor, by exact directions.

Through a push the bar turns in that frame by θ, the whisker's tangent at the contact by more: the bar's normal, which
stands across both, grows steeper than β by some θ² tan β, and so does the force. (13) and (14) are the first order.
"""

import numpy as np

_TANGENT = 1.5  # the angle of a uniform rod's tangent where it is pushed, over that of its chord


def slip_angle(theta_rad: np.ndarray, beta_rad: float, across_rad: np.ndarray) -> np.ndarray:
    """Return |φ| (n,) at pushing angles (n,) against a bar of slope β > 0.

    across_rad (n,): angle of the force from the bar's normal. Without a push φ is β − across_rad.
    """
    sin = np.sin(theta_rad) * np.sin(beta_rad)
    cos = np.cos(theta_rad) * np.sin(beta_rad)
    bar = _vectors(sin, cos, np.cos(beta_rad))  # (n, 3)
    phi = beta_rad - across_rad
    turn = _TANGENT * theta_rad * np.cos(beta_rad) / np.cos(across_rad)
    tangent = _vectors(np.cos(turn), -np.sin(turn) * np.cos(phi), np.sin(turn) * np.sin(phi))
    normal = np.cross(bar, tangent)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    force = -normal - np.tan(across_rad)[..., None] * bar
    return np.arctan2(force[:, 2], -force[:, 1])


def _vectors(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return vectors (n, 3) of components that are arrays (n,) or numbers."""
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)
