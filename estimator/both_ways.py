"""Slope and distance from a push and its way back, without any friction angle.

Friction turns round as the motor does, and the object does not: at one pushing angle the moments
there and back differ by friction alone, which acts along the object. So m_there − m_back points
along the surface, in the plane of (m_z, m_y), and its normal is that of the object, β. With it (6)
has the distance,

    d_x = Cθ cos β / (m_z cos β + m_y sin β),

the same on both ways, and friction on the way there is α = |β − φ|. That the contact has not yet
slid back does no harm: whatever friction acts, it acts along the object. Angles in rad, moments in
N·mm, lengths in mm.
"""

from dataclasses import dataclass
from functools import partial
from math import atan2, cos, hypot, nan, sin

import numpy as np

from estimator import first_order
from estimator.beam import Beam
from estimator.numerics import RELATIVE_STEP, central_differences
from estimator.reasons import NamedReason
from estimator.uncertainty import Z_95
from estimator.whisk import EstimatorSettings, Whisk

ALIKE = NamedReason(
    "ways_alike", "friction is not felt to turn round: there and back the moments are alike"
)
NO_PUSH = NamedReason("no_push_one_way", "no push on one of both ways")
NOWHERE = NamedReason("distance_nowhere", "the distance comes out nowhere on the whisker")
# [sigmas] Least difference of the moments: a direction within its noise determines no slope. Stated.
_SURE_SIGMAS = 3.0
# [rad] Largest friction angle considered: beyond those of the paper's surfaces. Stated.
_STEEPEST_FRICTION_RAD = np.radians(30.0)


@dataclass(frozen=True, eq=False)
class ThereAndBack:
    """Distance and slope with their sigmas, and the angle between force and normal on the way
    there.

    NaN where status gives the reason. low_mm, high_mm: the distance's 95 % interval.
    """

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
    """Return the slope β, rad, from the moments (m_y, m_z) there and back.

    >>> round(slope(np.array([1.0, 6.0]), np.array([2.0, 4.0])), 6)
    1.107149
    """
    along = there - back
    normal = np.array([-along[1], along[0]])
    if not normal @ there > 0:
        normal = -normal
    return atan2(*normal)


def there_and_back(
    there: Whisk,
    back: Whisk,
    settings: EstimatorSettings,
    shared: tuple[np.ndarray, np.ndarray] | None = None,
) -> ThereAndBack:
    """Estimate distance and slope from both ways at one pushing angle.

    shared: for each way the change (k, 2) of its moments by one sigma of each cause of error that
    both have in common. Thickness and lean of the object enter the sigma as in (10).
    """
    felt = np.array([*there.felt, *back.felt])
    if not _pushes_both_ways(felt):
        return ThereAndBack(nan, status=NO_PUSH)
    beam = there.beam
    values = _solution(felt, beam)
    d_x, beta, alpha = values.tolist()
    if not 0 < d_x <= beam.length_mm:
        return ThereAndBack(nan, status=NOWHERE)
    covariance = _covariance(there, back, shared)
    covariance += _covariance_of_dragging(felt, abs(alpha), float(beam.thickness(d_x)))
    if not _differs(felt, covariance):
        return ThereAndBack(nan, status=ALIKE)
    sigmas = _sigmas(felt, covariance, beam)
    model_share = _model_share(there, settings, d_x, beta, abs(alpha))
    return _with_sigmas(values, sigmas, model_share, beam.length_mm)


def _with_sigmas(
    values: np.ndarray, sigmas: np.ndarray, model_share: float, length_mm: float
) -> ThereAndBack:
    """Return (d_x, β, α), mm and rad, with one sigma of each by noise and that of d_x by the
    model.
    """
    d_x, beta, alpha = values.tolist()
    sigma = hypot(sigmas[0], d_x * model_share)
    return ThereAndBack(
        d_x_mm=d_x,
        sigma_mm=sigma,
        beta_rad=beta,
        beta_sigma_rad=float(sigmas[1]),
        alpha_rad=abs(alpha),
        alpha_sigma_rad=float(sigmas[2]),
        low_mm=max(d_x - Z_95 * sigma, 0.0),
        high_mm=min(d_x + Z_95 * sigma, length_mm),
    )


def _pushes_both_ways(felt: np.ndarray) -> bool:
    """Check that all felt values (6,) are known, and that m_z is positive on both ways."""
    return np.isfinite(felt).all() and min(felt[2], felt[5]) > 0


def _solution(felt: np.ndarray, beam: Beam) -> np.ndarray:
    """Solve for (d_x, β, α) from (θ, m_y, m_z) there and (θ, m_y, m_z) back.

    The distance is the mean over both ways. The slope takes the moments' difference at one and the
    same angle, so that an error of θ on one way alone turns β as well.
    """
    there = felt[1:3] / felt[0]
    back = felt[4:6] / felt[3]
    beta = slope(there, back)
    normal = np.array([sin(beta), cos(beta)])
    compliances = 1 / (there @ normal) + 1 / (back @ normal)
    as_cylinder = 0.5 * beam.C_Nmm2 * cos(beta) * compliances
    return np.array([float(beam.distance_mm(as_cylinder)), beta, beta - atan2(*there)])


def _sigmas(felt: np.ndarray, covariance: np.ndarray, beam: Beam) -> np.ndarray:
    """Return one sigma (3,) of `_solution` where the felt values have a covariance (6, 6)."""
    moment = hypot(felt[1], felt[2])
    sizes = np.array([felt[0], moment, moment, felt[3], moment, moment])
    steps = RELATIVE_STEP * sizes
    jacobian = central_differences(partial(_solution, beam=beam), felt, steps)  # (3, 6)
    return np.sqrt(np.diag(jacobian @ covariance @ jacobian.T))


def _covariance(there: Whisk, back: Whisk, shared) -> np.ndarray:
    """Assemble the covariance (6, 6) of (θ, m_y, m_z) there and back."""
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = there.felt_covariance
    covariance[3:, 3:] = back.felt_covariance
    if shared is not None:
        covariance[1:3, 4:6] = shared[0].T @ shared[1]
        covariance[4:6, 1:3] = covariance[1:3, 4:6].T
    return covariance


def _covariance_of_dragging(felt: np.ndarray, alpha: float, thickness: float) -> np.ndarray:
    """Return the covariance (6, 6) that friction along the whisker adds to the moments back.

    It is not in the difference of which the slope is made. On the way there the contact slips
    sideways, and friction along with it; on the way back the contact is held until friction has
    turned round, and no moment determines the share of it that then acts along the whisker.
    thickness: the diameter at the contact over the base's.
    """
    change = np.zeros(6)
    relative = first_order.dragging(felt[3], min(alpha, _STEEPEST_FRICTION_RAD)) / thickness
    change[4:6] = relative * felt[4:6]
    return np.outer(change, change)


def _differs(felt: np.ndarray, covariance: np.ndarray) -> bool:
    """Check that the moments' difference is more than its noise, that of both angles included."""
    theta_there, theta_back = felt[[0, 3]]
    there = felt[1:3]
    back = felt[4:6]
    along = there - back
    size = hypot(*along)
    by_there = [there @ along / theta_there, *along]
    by_back = [-back @ along / theta_back, *-along]
    gradient = np.array([*by_there, *by_back]) / (size or 1.0)
    variance = float(gradient @ covariance @ gradient)
    return size > _SURE_SIGMAS * variance**0.5


def _model_share(
    whisk: Whisk, settings: EstimatorSettings, d_x: float, beta: float, alpha: float
) -> float:
    """Return the model's own relative sigma of d_x: thickness and lean of the object, large
    angles, and the taper.
    """
    theta = whisk.theta_at_rad
    thickness = whisk.beam.thickness(d_x)
    rolling = first_order.rolling_at(theta, settings.object_reach_mm, beta, d_x, thickness)
    alpha = min(alpha, _STEEPEST_FRICTION_RAD)
    leaning = first_order.leaning(theta, settings.tilt_sigma_rad, whisk.phi_rad, alpha)
    large = first_order.bending_far(theta, thickness)
    return hypot(rolling, leaning, large, whisk.beam.share_by_taper(d_x))
