"""Readings of the other sensors of Table I on a stroke: forces of a load cell and the moments' rate."""

from dataclasses import replace

import numpy as np

from bench.gauges.felt import FeltStroke
from bench.trials.readout import Readout
from estimator.readings import force_at, rate_at
from estimator.signal import FeltTouch
from estimator.whisk import OtherSensors, Whisk


def with_others(
    whisk: Whisk,
    stroke: FeltStroke,
    readout: Readout,
    touch: FeltTouch,
    *,
    force_drift_rate: np.ndarray | None,
    scale_sigma: float,
) -> Whisk:
    """Return the whisk with the readings of other sensors at its pushing angle.

    force_drift_rate (3,): of the forces, N/s, from the session's free strokes. scale_sigma: share
    by which the moments' newtons may differ from a load cell's.
    """
    theta = whisk.theta_at_rad
    per_rad, channels_covariance = rate_at(theta, stroke.motor_rad, stroke.channels, touch)
    force = np.full(3, np.nan)
    force_covariance = np.full((3, 3), np.nan)
    if stroke.forces_N is not None:
        drift = None if force_drift_rate is None else force_drift_rate / stroke.speed_rad_s
        reading = force_at(
            theta, stroke.motor_rad, stroke.forces_N, touch, time_s=stroke.time_s, drift=drift
        )
        force = reading.values
        force_covariance = reading.covariance
    others = OtherSensors(
        force,
        force_covariance,
        scale_sigma,
        readout.matrix @ per_rad,
        readout.covariance(per_rad, channels_covariance),
    )
    return replace(whisk, others=others)
