"""Does the slip angle turn over the push? Then (10) is off by what no moment at one angle shows.

Against a straight object that stands across the whisker φ stays as it is. Along one that leans by ψ the contact moves
along the whisker as it slips: φ turns by ½ cos β tan ψ a radian, and (10) is off by θ sin φ/(cos α cos β) times that
(`estimator.first_order.leaning`). Against one that is curved to the side φ turns as well (Appendix B). Which of the two
it is no moment shows, so (10) is not corrected: what it says gets a status.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import chdtri, ndtr, stdtrit

from bench.analyses.curved import (
    independent_angles,
    phi_sigma,
    rate_by_hand,
    share_by_turn,
    slip_angles,
    turn_beyond_chance,
    weighted_fit,
)
from bench.analyses.pooling import column
from bench.base.combined import holm
from bench.records.trial_result import EstimateRow, FeltAt
from estimator.uncertainty import Z_95
from vision import UNKNOWN, Value
from vision.geometry import Reason, joined

# [angles] One more than a fit has numbers. Derived.
_FEWEST = 4
# [1] Probability of a scatter as large by noise; and of a session in which any whisk is said to turn though no object
# leans by more than sigma holds. Stated.
_CHANCE = 1e-3
# [sigma] Of an estimate: less adds no more than an eighth to its error. Derived.
_MATTERS = 0.5


def turn(felt: Sequence[FeltAt]) -> Value:
    """Return the change of φ with θ over successive pushing angles; UNKNOWN of too few.

    A part that goes as 1/θ, as an error of the zero does, is fitted with it. Where the angles scatter by
    more than their sigmas let them, their scatter counts, and by Student's t.
    """
    chosen = independent_angles(felt)
    freedom = len(chosen) - 3
    if len(chosen) < _FEWEST:
        return UNKNOWN
    theta = column(chosen, "theta_rad")
    sigmas = np.array([phi_sigma(at) for at in chosen])
    columns = (theta, np.ones_like(theta), 1 / theta)
    coefficients, covariance, chi_square = weighted_fit(columns, slip_angles(chosen), sigmas)
    sigma = float(np.sqrt(covariance[0, 0]))
    if chi_square > chdtri(freedom, _CHANCE):
        sigma *= np.sqrt(chi_square / freedom) * _quantile(freedom) / _quantile(np.inf)
    return Value(float(coefficients[0]), sigma)


def _quantile(freedom: float) -> float:
    """Return Student's t that is exceeded to either side with the chance _CHANCE."""
    return float(stdtrit(freedom, 1.0 - _CHANCE / 2))


def sure_turns(phi_rad: Sequence[float], rates: Sequence[Value], alpha_rad: float) -> np.ndarray:
    """Return of which (n,) whisks of a session φ turns for sure, all of them tested together.

    phi_rad, rates: the slip angle felt of each, and its `turn`. alpha_rad: the assumed friction angle.
    """
    chances = []
    for phi, rate in zip(phi_rad, rates):
        spread = np.hypot(rate.sigma, rate_by_hand(phi, alpha_rad))
        chances.append(2 * ndtr(-abs(rate.value) / spread))
    return holm(chances, _CHANCE)


def with_turn(
    row: EstimateRow,
    phi: float,
    rate: Value,
    theta_rad: float,
    length_mm: float,
    *,
    is_sure: bool,
) -> EstimateRow:
    """Return a row of (10), whatever α it assumed, with the turn of φ in its sigma.

    It gets a status where φ turns by more than against an object that leans as one set up by hand, and
    that matters. phi, rate: the slip angle felt, and its `turn`; is_sure: of `sure_turns`; length_mm: the
    whisker's, at which intervals end.
    """
    d_x_mm = row.d_x_est_mm
    beyond = turn_beyond_chance(phi, rate, row.alpha_est_rad)
    if not (beyond > 0.0 and d_x_mm.is_known):
        return row
    share = theta_rad * share_by_turn(phi, row.alpha_est_rad)  # of d_x, by a rate
    widened = _widened(row, share * beyond, length_mm)
    error_share = abs(rate.value) * share
    if not (is_sure and error_share * d_x_mm.value > _MATTERS * d_x_mm.sigma):
        return widened
    status = _turning_status(rate.value * theta_rad, error_share)
    return replace(widened, status=joined(row.status, status))


def _turning_status(turn_rad: float, error_share: float) -> Reason:
    """Return the status of a distance by (10) that may be off by a share because φ turns."""
    return Reason(
        "phi_turns",
        f"phi turns by {np.degrees(turn_rad):+.1f} deg over the push: the object leans along the "
        f"whisker or is curved to the side, and (10) may be {100 * error_share:.0f} % off",
    )


def _widened(row: EstimateRow, share: float, length_mm: float) -> EstimateRow:
    """Return the row with a share of its distance added in squares to sigmas and interval."""
    value = row.d_x_est_mm.value
    more = share * value
    below = math.hypot(row.d_x_est_low_mm - value, Z_95 * more)
    above = math.hypot(row.d_x_est_high_mm - value, Z_95 * more)
    return replace(
        row,
        d_x_est_mm=Value(value, math.hypot(row.d_x_est_mm.sigma, more)),
        d_x_est_sigma_alpha_exact_mm=math.hypot(row.d_x_est_sigma_alpha_exact_mm, more),
        d_x_est_low_mm=max(value - below, 0.0),
        d_x_est_high_mm=min(value + above, length_mm),
    )
