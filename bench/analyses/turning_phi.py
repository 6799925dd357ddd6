"""Does the slip angle turn over the push? Then (10) is off by what no moment at one angle tells.

Against a straight object that stands across the whisker φ stays as it is. Along one that leans by ψ the contact moves
along the whisker as it slips: φ turns by ½ cos β tan ψ a radian, and (10) is off by θ sin φ/(cos α cos β) times that
(`estimator.first_order.leaning`). Against one that is curved to the side φ turns as well (Appendix B). Which of the two
it is no moment tells, so (10) is not corrected: what it says gets a status.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import chdtri, stdtrit

from bench.analyses.curved import apart, phi_sigma
from bench.base.settings import TILT_SIGMA_RAD
from bench.records.trial_result import EstimateRow, FeltAt
from estimator.domain import RIGHT_ANGLE
from estimator.uncertainty import Z_95
from vision.geometry.reasons import Reason, joined
from vision.truth.value import UNKNOWN, Value

_FEWEST = 4  # angles, for three numbers and what is left
_CHANCE = 1e-3  # of a turn as large where an object leans by no more than sigma holds, of a scatter as large by noise
_MATTERS = 0.5  # of an estimate's own sigma: less adds no more than an eighth to its error


def turn(felt: Sequence[FeltAt]) -> Value:
    """Change of φ with θ at successive pushing angles; UNKNOWN of too few.

    A part that goes as 1/θ, as an error of the zero does, is fitted beside it. Where the angles scatter by more than
    their sigmas let them, their scatter counts, and by Student's t.
    """
    chosen = apart(felt)
    freedom = len(chosen) - 3
    if len(chosen) < _FEWEST:
        return UNKNOWN
    theta, sigmas = np.array([(at.theta_rad, phi_sigma(at)) for at in chosen]).T
    phi = np.array([np.arctan2(at.m_y_Nmm.value, at.m_z_Nmm.value) for at in chosen])
    design = np.stack([theta, np.ones_like(theta), 1 / theta], axis=1) / sigmas[:, None]
    found, *_ = np.linalg.lstsq(design, phi / sigmas)
    sigma = float(np.sqrt(np.linalg.inv(design.T @ design)[0, 0]))
    left = float(np.sum((phi / sigmas - design @ found) ** 2))
    if left > chdtri(freedom, _CHANCE):
        sigma *= np.sqrt(left / freedom) * _quantile(freedom) / _quantile(np.inf)
    return Value(float(found[0]), sigma)


def _quantile(freedom: float) -> float:
    return float(stdtrit(freedom, 1.0 - _CHANCE / 2))


def with_turn(
    row: EstimateRow, phi: float, rate: Value, theta_rad: float, length_mm: float
) -> EstimateRow:
    """A row of (10), whatever α it assumed, with what φ's turn may do to it in its sigma; with a status where φ turns
    by more than against an object that leans as one set up by hand, and it matters. phi, rate: the slip angle felt, and
    its `turn`; length_mm: the whisker's, at which intervals end.

    Into the sigma goes what the turn's square is beyond its variance (the positive part of the moment estimate, as
    DerSimonian & Laird, Controlled Clinical Trials 7, 1986): of an object across the whisker nothing, in the mean.
    """
    beta = min(abs(phi) + row.alpha_est_rad, 0.999 * RIGHT_ANGLE)
    by_hand = 0.5 * np.cos(beta) * np.tan(TILT_SIGMA_RAD)
    share = (
        theta_rad * np.sin(abs(phi)) / (np.cos(row.alpha_est_rad) * np.cos(beta))
    )  # of d_x, by a rate
    spread = float(np.hypot(rate.sigma, by_hand))
    if not (abs(rate.value) > spread and np.isfinite(row.d_x_est_mm.value)):
        return row
    off = abs(rate.value) * share
    widened = _widened(row, share * float(np.sqrt(rate.value**2 - spread**2)), length_mm)
    sure = abs(rate.value) > _quantile(np.inf) * spread
    if not (sure and off * row.d_x_est_mm.value > _MATTERS * row.d_x_est_mm.sigma):
        return widened
    said = Reason(
        "phi_turns",
        f"phi turns by {np.degrees(rate.value * theta_rad):+.1f} deg over the push: the object leans along the "
        f"whisker or is curved to the side, and (10) may be {100 * off:.0f} % off",
    )
    return replace(widened, status=joined(row.status, said))


def _widened(row: EstimateRow, share: float, length_mm: float) -> EstimateRow:
    """The row with a share of its distance more in both sigmas and either side of its interval, in squares."""
    value, more = row.d_x_est_mm, share * row.d_x_est_mm.value
    low, high = (
        np.hypot(end - value.value, Z_95 * more)
        for end in (row.d_x_est_low_mm, row.d_x_est_high_mm)
    )
    return replace(
        row,
        d_x_est_mm=Value(value.value, float(np.hypot(value.sigma, more))),
        d_x_est_sigma_alpha_exact_mm=float(np.hypot(row.d_x_est_sigma_alpha_exact_mm, more)),
        d_x_est_low_mm=max(value.value - float(low), 0.0),
        d_x_est_high_mm=min(value.value + float(high), length_mm),
    )
