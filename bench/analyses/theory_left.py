"""What (10), (13) and (14) leave out of the moments of a whisk, to leading order: one error in all whisks of a session.

A fit of the friction angle to moments scatters by noise and by how bars were set up; what its model leaves out moves
all its points the same way, and no scatter shows it. So the fit is made once more with the moments as the theory would
have them, and the change is part of its sigma.
"""

from collections.abc import Sequence

import numpy as np

from bench.analyses.direction import slip_angle
from bench.analyses.felt_push import FeltPush
from bench.analyses.pooling import column
from bench.base.settings import OBJECT_REACH_MM
from estimator import first_order
from estimator.beam import Beam
from estimator.domain import RIGHT_ANGLE
from estimator.two_tilts import DRAWN

# [rad] Of a slope, at most: at a right angle no push is left. Stated.
_STEEPEST_RAD = 0.999 * RIGHT_ANGLE


def as_theory_has_them(pushes: Sequence[FeltPush], alpha_rad: float, beam: Beam) -> np.ndarray:
    """Return the moments (n, 2), m_y and m_z, of pushes without what small-angle theory leaves out of them.

    Out of |m| go rolling over the object, large angles, and friction along the whisker; out of φ the way
    that the force turns (`bench.analyses.direction`) and the share of friction that acts along the
    whisker. A distance that is not known leaves |m| as it is, a reach that nobody states is that which
    settings allow.
    """
    m_y = column(pushes, "m_y_Nmm")
    m_z = column(pushes, "m_z_Nmm")
    theta = column(pushes, "theta_rad")
    d_x_mm = column(pushes, "d_x_mm")
    reach_mm = column(pushes, "reach_mm")
    phi = np.arctan2(m_y, m_z)
    slope = np.minimum(np.abs(phi) + alpha_rad, _STEEPEST_RAD)
    reach = np.where(np.isfinite(reach_mm), reach_mm, OBJECT_REACH_MM)
    left = beam.thickness(d_x_mm)
    bent = theta * np.cos(slope) / np.cos(alpha_rad)
    along = _share_along(phi, bent, alpha_rad)
    rolling = first_order.rolling_at(theta, reach, slope, d_x_mm, left)
    large_angles = first_order.bending_far(bent, left)
    share = rolling + along * first_order.dragging(theta, alpha_rad) + large_angles
    size = np.hypot(m_y, m_z) * (1.0 + np.nan_to_num(share * left))
    return size[:, None] * _direction(theta, phi, slope, along, alpha_rad, left)


def _direction(
    theta: np.ndarray,
    phi: np.ndarray,
    slope: np.ndarray,
    along: np.ndarray,
    alpha_rad: float,
    left: np.ndarray,
) -> np.ndarray:
    """Return the directions (n, 2), m_y and m_z, that the theory gives forces at φ (n,).

    along, left (n,): shares of friction along the whisker, and of its diameter at the contact.
    """
    known_left = np.where(np.isfinite(left), left, 1.0)
    turned = _turn_of_force(theta, slope, along, alpha_rad, known_left)
    unturned = np.copysign(np.maximum(np.abs(phi) - turned, 0.0), phi)
    return np.stack([np.sin(unturned), np.cos(unturned)], axis=1)


def _share_along(phi: np.ndarray, bent: np.ndarray, alpha_rad: float) -> np.ndarray:
    """Return the share (n,) of friction that acts along the whisker.

    phi, bent (n,): direction of the force and angle of the bend, rad.
    """
    drawn = DRAWN * bent
    return drawn / np.hypot(drawn, np.sin(np.abs(phi)) / np.cos(alpha_rad))


def _turn_of_force(
    theta: np.ndarray,
    slope: np.ndarray,
    along: np.ndarray,
    alpha_rad: float,
    left: np.ndarray,
) -> np.ndarray:
    """Return by how much (n,), rad, the force turns away from slope − α over a push by theta.

    along (n,): share of friction that acts along the whisker, which is missing across it.
    left (n,): share of the diameter at the base that the whisker has at the contact.
    """
    across_rad = np.arctan(np.tan(alpha_rad) * np.sqrt(1.0 - along**2))
    return slip_angle(theta, slope, across_rad, left) - (slope - alpha_rad)
