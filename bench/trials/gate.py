"""Stick and slip detected from the moments alone, and (10) at the kinetic ends of the teeth.

While a contact rests, friction lies anywhere between the kinetic and the static cone, and (10) has
no angle to assume. Right after a jump it lies on the kinetic one. Slope and distance, by which slip
shows, are those of (9) and (10): no picture and no manifest.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bench.gauges.felt import FeltStroke
from bench.records.trial_result import EstimateRow, FeltAt
from bench.trials.estimates import felt_at
from bench.trials.readout import RawMoments, Readout
from bench.trials.stick_slip_phases import ContactRest, find_rests
from estimator.signal import FeltTouch
from estimator.whisk import Whisk

# [teeth] One jump may be a knock. Stated.
_FEWEST = 2
# [1] Of the wanted angle: teeth before it, near touch, are short. Stated.
_FROM_SHARE = 0.5
# [1] Of the wanted angle: as much beyond it. Stated.
_TO_SHARE = 1.5


def kinetic_of(
    stroke: FeltStroke, touch: FeltTouch, readout: Readout, whisk: Whisk, ten: EstimateRow
) -> FeltAt | None:
    """Return the record of a stroke's `kinetic_end`; ten: (10) of the whisk."""
    found = kinetic_end(readout.raw(stroke, touch), whisk, ten)
    return None if found is None else felt_at(found)


def kinetic_end(raw: RawMoments, whisk: Whisk, ten: EstimateRow) -> Whisk | None:
    """Return the whisk with the moments that it would have on the kinetic cone.

    ten: (10) of the whisk. None where the moments show no teeth. On the cone both moments grow with θ
    (13), (14), so the kinetic ends of all teeth near the wanted angle are averaged per radian.
    """
    d_x_mm = ten.d_x_est_mm.value
    beta_rad = ten.beta_est_rad
    if not (d_x_mm > 0 and beta_rad != 0):
        return None
    _, rests = find_rests(raw, beta_rad, d_x_mm, whisk.beam)
    theta = whisk.theta_at_rad
    per_rad = _moments_per_rad(rests, theta)
    if len(per_rad) < _FEWEST:
        return None
    m_y, m_z = np.mean(per_rad, axis=0) * theta
    scatter = np.cov(per_rad.T) / len(per_rad)
    return replace(
        whisk,
        m_y_at_Nmm=float(np.sign(beta_rad)) * float(m_y),
        m_z_at_Nmm=float(m_z),
        covariance_at=whisk.covariance_at + scatter * theta**2,
    )


def _moments_per_rad(rests: Sequence[ContactRest], theta_rad: float) -> np.ndarray:
    """Return (|m_y|, m_z) per radian (n, 2) where n rests near the wanted angle begin."""
    found = []
    for rest in rests:
        if _FROM_SHARE * theta_rad < rest.from_rad < _TO_SHARE * theta_rad:
            moments, _ = rest.moments_at(rest.from_rad)
            found.append(moments / rest.from_rad)
    return np.array(found)
