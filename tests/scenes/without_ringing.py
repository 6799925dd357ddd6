"""A whisk as it would be felt if the whisker did not ring."""

from dataclasses import replace
from math import sqrt

import numpy as np

from estimator.signal import FeltTouch, MomentAt, felt_touch, moment_at
from estimator.vibration import Ring, moves_steadily, ring_columns, ring_of
from estimator.whisk import Whisk


def without_ringing(whisk: Whisk) -> Whisk:
    """Return the whisk as felt without its ringing: touch, moments and their covariances anew.

    A free whisker rings at another frequency than one that touches, and stops when it does. As noise
    (`estimator.noise`) its ringing would count in the push, too. So each ring is fitted and taken out
    of its own samples; those of the motor's ramps are left out. What the whisk's covariances hold
    besides the samples' noise is kept. The whisk is returned as it is where no free ring is heard, or
    what is left shows no touch.
    """
    if whisk.unfiltered_Nmm is None:
        return whisk
    steady = moves_steadily(whisk.theta_rad) & np.isfinite(whisk.unfiltered_Nmm).all(axis=1)
    samples = np.where(steady[:, None], whisk.unfiltered_Nmm, np.nan)
    free = steady & (whisk.theta_rad < 0)
    propped = steady & (whisk.theta_rad >= 0)
    ring = ring_of(whisk, free)
    if ring is None or not ring.is_heard:
        return whisk
    samples[free] -= _ring_alone(whisk, free, ring)
    ring = ring_of(whisk, propped, beside=ring)
    if ring is not None and ring.is_heard:
        samples[propped] -= _ring_alone(whisk, propped, ring)
    return _felt_anew(whisk, samples)


def _ring_alone(whisk: Whisk, part: np.ndarray, ring: Ring) -> np.ndarray:
    """Return the moments (n, 2) of a ring in the samples of a part."""
    time_s = whisk.time_s[part] - whisk.time_s[part][0]
    columns = ring_columns(time_s, ring.frequency_Hz, ring.damping, ring.mains_Hz)
    amplitudes, *_ = np.linalg.lstsq(columns, whisk.unfiltered_Nmm[part], rcond=None)
    return columns[:, -2:] @ amplitudes[-2:]


def _felt_anew(whisk: Whisk, samples: np.ndarray) -> Whisk:
    """Return the whisk by other samples (n, 2), N·mm, of its moments, at the same angle of the motor.

    So it is at that at which other sensors were read, whatever the touch.
    """
    before, before_touch = _felt(whisk, whisk.unfiltered_Nmm)
    after, after_touch = _felt(whisk, samples)
    if before.status or after.status:
        return whisk
    besides = whisk.theta_sigma_rad**2 - before_touch.sigma_rad**2
    values, axes = np.linalg.eigh(whisk.covariance_at - before.covariance)
    shared = (axes * np.maximum(values, 0.0)) @ axes.T
    m_y, m_z = after.values.tolist()
    return replace(
        whisk,
        theta_rad=whisk.theta_rad - after_touch.motor_rad,
        theta_at_rad=after.theta_rad,
        m_y_at_Nmm=m_y,
        m_z_at_Nmm=m_z,
        covariance_at=after.covariance + shared,
        theta_sigma_rad=sqrt(after_touch.sigma_rad**2 + max(besides, 0.0)),
        theta_moment_covariance_at=after.theta_covariance,
    )


def _felt(whisk: Whisk, samples: np.ndarray) -> tuple[MomentAt, FeltTouch]:
    """Return moments at the pushing angle, and the touch, of samples (n, 2), N·mm."""
    touch = felt_touch(whisk.theta_rad, samples, whisk.time_s)
    theta_rad = whisk.theta_at_rad if touch.status else whisk.theta_at_rad - touch.motor_rad
    at = moment_at(theta_rad, whisk.theta_rad, samples, touch, time_s=whisk.time_s)
    return at, touch
