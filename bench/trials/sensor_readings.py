"""The other sensors of Table I on a stroke: forces of a load cell and the moments' rate, read for the estimators."""

from dataclasses import replace

import numpy as np

from bench.gauges.felt import FeltStroke
from bench.trials.estimates import Readout
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
    """The whisk with what other sensors tell at its pushing angle. force_drift_rate (3,): of the forces, N/s, as the
    session's free strokes show it; scale_sigma: share by which the moments' newtons may differ from a load cell's."""
    theta = whisk.theta_at_rad
    per_rad, of_channels = rate_at(theta, stroke.motor_rad, stroke.channels, touch)
    rate = readout.matrix @ per_rad, readout.covariance(per_rad, of_channels)
    force, covariance = np.full(3, np.nan), np.full((3, 3), np.nan)
    if stroke.forces_N is not None:
        per_rad = None if force_drift_rate is None else force_drift_rate / stroke.speed_rad_s
        read = force_at(
            theta, stroke.motor_rad, stroke.forces_N, touch, time_s=stroke.time_s, drift=per_rad
        )
        force, covariance = read.values, read.covariance
    return replace(whisk, others=OtherSensors(force, covariance, scale_sigma, *rate))
