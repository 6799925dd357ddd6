"""Stick and slip told from the moments alone, and (10) at the kinetic ends of the teeth.

While a contact rests, friction lies anywhere between the kinetic and the static cone, and (10) has no angle to assume.
Right after a jump it lies on the kinetic one. Slope and distance, by which slip shows, are those of (9) and (10): no
picture and no manifest.
"""

from dataclasses import replace

import numpy as np

from bench.gauges.felt import FeltStroke
from bench.records.trial_result import EstimateRow, FeltAt
from bench.trials.estimates import Readout, felt_at
from bench.trials.stick_slip_phases import Rest, rests_of
from estimator.signal import FeltTouch
from estimator.whisk import Whisk

_FEWEST = 2  # teeth: one jump may be a knock
# Teeth of the stroke that serve: from this part of the wanted angle to as much beyond. Near touch they are short.
_FROM_SHARE, _TO_SHARE = 0.5, 1.5


def kinetic_of(
    stroke: FeltStroke, touch: FeltTouch, readout: Readout, whisk: Whisk, given: EstimateRow
) -> FeltAt | None:
    """What a stroke shows of `kinetic_end`."""
    theta, moments = stroke.motor_rad - touch.motor_rad, readout.moments_Nmm(stroke, touch)
    found = kinetic_end(stroke.time_s, theta, moments, whisk, given)
    return None if found is None else felt_at(found)


def kinetic_end(
    time_s: np.ndarray,
    theta_rad: np.ndarray,
    moments_Nmm: np.ndarray,
    whisk: Whisk,
    given: EstimateRow,
) -> Whisk | None:
    """The whisk as it would be felt on the kinetic cone, or None where its moments show no teeth.

    moments_Nmm (n, 2): m_y, m_z as recorded, unfiltered; given: (10) of the whisk. On the cone both moments grow with θ
    (13), (14): the kinetic ends of all teeth near the wanted angle tell them together.
    """
    if not (given.d_x_est_mm.value > 0 and given.beta_est_rad != 0):
        return None
    _, rests = rests_of(
        time_s, theta_rad, moments_Nmm, given.beta_est_rad, given.d_x_est_mm.value, whisk.beam
    )
    low, high = _FROM_SHARE * whisk.theta_at_rad, _TO_SHARE * whisk.theta_at_rad
    ends = [_per_angle(rest) for rest in rests if low < rest.from_rad < high]
    if len(ends) < _FEWEST:
        return None
    mean, spread = np.mean(ends, axis=0), np.cov(np.array(ends).T) / len(ends)
    m_y, m_z = mean * whisk.theta_at_rad
    covariance = whisk.covariance_at + spread * whisk.theta_at_rad**2
    side = float(np.sign(given.beta_est_rad))
    return replace(
        whisk, m_y_at_Nmm=side * float(m_y), m_z_at_Nmm=float(m_z), covariance_at=covariance
    )


def _per_angle(rest: Rest) -> np.ndarray:
    """|m_y| and m_z (2,) for a radian, where the rest begins."""
    return rest.moments_at(rest.from_rad)[0] / rest.from_rad
