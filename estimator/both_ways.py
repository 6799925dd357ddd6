"""Slope and distance from a push and its way back, without any friction angle.

Friction turns round as the motor does, and the object does not: at one pushing angle the moments there and back differ
by friction alone, which acts along the object. So m_there − m_back points along the surface, in the plane of
(m_z, m_y), and its normal is that of the object, β. With it (6) has the distance,

    d_x = Cθ cos β / (m_z cos β + m_y sin β),

the same on both ways, and friction on the way there is α = |β − φ|. That the contact has not yet slid back does no
harm: whatever friction acts, it acts along the object. Angles in rad, moments in N·mm, lengths in mm.
"""

from dataclasses import dataclass
from math import atan2, cos, hypot, nan, sin

import numpy as np

from estimator import distance, first_order
from estimator.uncertainty import Z_95
from estimator.whisk import EstimatorSettings, Whisk

ALIKE = "friction is not felt to turn round: there and back the moments are alike"
NO_PUSH = "no push on one of both ways"
NOWHERE = "the distance comes out nowhere on the whisker"
_SURE_SIGMAS = 3.0  # of the moments' difference: a direction within its noise tells no slope
_ROUGHEST_RAD = np.radians(30.0)  # friction angle: beyond those of the paper's surfaces
_STEP = 1e-6  # of differences, in parts


@dataclass(frozen=True, eq=False)
class ThereAndBack:
    """Distance and slope with their sigmas, and the angle between force and normal on the way there; NaN where status
    says why. low_mm, high_mm: the distance's 95 % interval."""

    d_x_mm: float
    sigma_mm: float = nan
    beta_rad: float = nan
    beta_sigma_rad: float = nan
    alpha_rad: float = nan
    alpha_sigma_rad: float = nan
    low_mm: float = nan
    high_mm: float = nan
    status: str = ""


def slope(there: np.ndarray, back: np.ndarray) -> float:
    """β by moments (m_y, m_z) there and back.

    >>> round(slope(np.array([1.0, 6.0]), np.array([2.0, 4.0])), 6)
    1.107149
    """
    along = there - back
    normal = np.array([-along[1], along[0]])
    normal = normal if normal @ there > 0 else -normal
    return atan2(*normal)


def there_and_back(
    there: Whisk,
    back: Whisk,
    settings: EstimatorSettings,
    shared: tuple[np.ndarray, np.ndarray] | None = None,
) -> ThereAndBack:
    """Both ways at one pushing angle. shared: of each way, what its moments change by at one sigma of each cause that
    both have in common, (k, 2). Thickness and lean of the object enter as in (10)."""
    felt = np.array([*_felt(there), *_felt(back)])
    if not np.isfinite(felt).all() or not min(felt[2], felt[5]) > 0:
        return ThereAndBack(nan, status=NO_PUSH)
    covariance = _covariance(there, back, shared)
    beam = there.beam
    values = _solved(felt, beam)
    if not 0 < values[0] <= beam.length_mm:
        return ThereAndBack(nan, status=NOWHERE)
    covariance += _dragged(felt, abs(float(values[2])), float(beam.left(values[0])))
    if not _differs(felt, covariance):
        return ThereAndBack(nan, status=ALIKE)
    gradient = np.array(
        [(_solved(felt + h, beam) - _solved(felt - h, beam)) / (2 * h.max()) for h in _steps(felt)]
    )
    sigmas = np.sqrt(np.einsum("ik,ij,jk->k", gradient, covariance, gradient))
    d_x, beta, alpha = values.tolist()
    sigma = hypot(sigmas[0], d_x * _model_share(there, settings, d_x, beta, abs(alpha)))
    ends = max(d_x - Z_95 * sigma, 0.0), min(d_x + Z_95 * sigma, beam.length_mm)
    return ThereAndBack(d_x, sigma, beta, float(sigmas[1]), abs(alpha), float(sigmas[2]), *ends)


def _felt(whisk: Whisk) -> tuple[float, float, float]:
    return whisk.theta_at_rad, whisk.m_y_at_Nmm, whisk.m_z_at_Nmm


def _solved(felt: np.ndarray, beam) -> np.ndarray:
    """(d_x, β, α) of (θ, m_y, m_z) there and (θ, m_y, m_z) back: the mean of what both ways say of the distance. The
    moments' difference is that of both at one angle, so what θ is off by on one way turns β as well."""
    there, back = felt[1:3] / felt[0], felt[4:6] / felt[3]
    beta = slope(there, back)
    normal = np.array([sin(beta), cos(beta)])
    d = 0.5 * beam.C_Nmm2 * cos(beta) * (1 / (there @ normal) + 1 / (back @ normal))
    return np.array([float(beam.distance_mm(d)), beta, beta - atan2(*there)])


def _steps(felt: np.ndarray) -> np.ndarray:
    """Of differences, one a row."""
    moment = hypot(felt[1], felt[2])
    return _STEP * np.diag([felt[0], moment, moment, felt[3], moment, moment])


def _covariance(there: Whisk, back: Whisk, shared) -> np.ndarray:
    """Of what is felt on both ways (6, 6)."""
    whole = np.zeros((6, 6))
    for first, whisk in ((0, there), (3, back)):
        whole[first, first] = whisk.theta_sigma_rad**2
        whole[first + 1 : first + 3, first + 1 : first + 3] = whisk.covariance_at
        whole[first, first + 1 : first + 3] = whole[first + 1 : first + 3, first] = (
            whisk.theta_moment_covariance_at
        )
    if shared is not None:
        whole[1:3, 4:6] = shared[0].T @ shared[1]
        whole[4:6, 1:3] = whole[1:3, 4:6].T
    return whole


def _dragged(felt: np.ndarray, alpha: float, left: float) -> np.ndarray:
    """What friction along the whisker takes from the moments back (6, 6): it is not in the difference of which the
    slope is made. There the contact slips sideways, and friction along with it; back it is held until it has turned
    round, and what share of it acts along the whisker then no moment tells. left: share of the base's diameter there.
    """
    moved = np.zeros(6)
    moved[4:6] = first_order.dragging(felt[3], min(alpha, _ROUGHEST_RAD)) / left * felt[4:6]
    return np.outer(moved, moved)


def _differs(felt: np.ndarray, covariance: np.ndarray) -> bool:
    """Is the moments' difference more than noise, also that of both angles?"""
    along = felt[1:3] - felt[4:6]
    size = hypot(*along)
    by = np.array(
        [felt[1:3] @ along / felt[0], *along, -felt[4:6] @ along / felt[3], *-along]
    ) / max(size, 1e-12)
    return size > _SURE_SIGMAS * float(by @ covariance @ by) ** 0.5


def _model_share(
    whisk: Whisk, settings: EstimatorSettings, d_x: float, beta: float, alpha: float
) -> float:
    """As of (10), the slope being known: thickness and lean of the object, large angles."""
    theta, left = whisk.theta_at_rad, whisk.beam.left(d_x)
    phi = distance.felt_slip_angle(whisk.m_y_at_Nmm, whisk.m_z_at_Nmm)
    rolled = first_order.rolling_at(theta, settings.object_reach_mm, beta, d_x, left)
    leant = first_order.leaning(theta, settings.tilt_sigma_rad, phi, min(alpha, _ROUGHEST_RAD))
    return float(np.sqrt(rolled**2 + leant**2 + (theta**2 / (6 * left)) ** 2))
