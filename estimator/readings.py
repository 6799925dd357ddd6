"""Readings of sensors other than angle and moment over a stroke: forces at an angle, the moment's
rate (Table I).

Plain arrays over one forward stroke, as in `estimator.signal`. Angles in rad, times in s.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from estimator import noise
from estimator.onset import (
    GUARD_RAD,
    MIN_FREE_SAMPLES,
    FeltTouch,
    Rise,
    columns,
    converter_steps,
    free_level,
    usable,
)
from estimator.reasons import NamedReason
from estimator.signal import MIN_SAMPLES, MomentAt, moment_at

NO_ZERO = NamedReason("no_free_force", "no free stroke to read the force's zero from")


def force_at(
    theta_rad: float,
    motor_rad: ArrayLike,
    forces: ArrayLike,
    touch: FeltTouch,
    *,
    time_s: ArrayLike | None = None,
    drift: np.ndarray | None = None,
) -> MomentAt:
    """Return the forces (k,) above the free stroke's level at the pushing angle theta_rad past
    `touch`.

    They are read as moments are (`estimator.signal.moment_at`); the touch was found in other
    channels. The covariance holds the forces' own noise and the drift (k,) per rad of their zero;
    where `drift` is not given, the one that the free stroke shows. Raises ValueError for theta_rad
    ≤ 0, and where angles and forces do not have the same samples.
    """
    motor, samples = columns(motor_rad, forces)
    if not touch.status:
        free = usable(motor, samples) & (motor < touch.motor_rad - GUARD_RAD)
        touch = _with_zero_of_forces(touch, motor, samples, free, drift)
    return moment_at(theta_rad, motor, samples, touch, time_s=time_s)


def _with_zero_of_forces(touch, motor, samples, free, drift):
    """Return the touch with level and noise of the forces (n, k) over their free stroke, a mask
    (n,).
    """
    if np.count_nonzero(free) < MIN_FREE_SAMPLES:
        return replace(touch, status=NO_ZERO)
    level = free_level(motor, samples, free, converter_steps(samples))
    if drift is not None:
        level = replace(level, drift=drift)
    no_gain = np.zeros(samples.shape[1])  # the forces have no part in the touch
    memory = noise.Memory.of(motor, samples, free)
    return replace(touch, level=level, rise=Rise(no_gain, np.zeros(len(motor)), memory))


def rate_at(
    theta_rad: float, motor_rad: ArrayLike, moments: ArrayLike, touch: FeltTouch
) -> tuple[np.ndarray, np.ndarray]:
    """Fit the slope (k,) per rad of moments over the motor angle, from touch to theta_rad past it.

    Returns it with its covariance (k, k). It is what a sensor of the moment's rate reads, divided
    by the motor's speed; no zero enters, and the touch only as the angle from which samples count.
    The zero's drift is in the covariance. NaN where there is no touch or fewer than three samples.
    Raises ValueError where angles and moments do not have the same samples.
    """
    motor, samples = columns(motor_rad, moments)
    used = usable(motor, samples) & _is_pushed(motor, touch, theta_rad)
    if touch.status or np.count_nonzero(used) < MIN_SAMPLES:
        unknown = np.full((samples.shape[1], samples.shape[1]), np.nan)
        return unknown[0], unknown
    weights = _slope_weights(motor, used)
    own = noise.Memory.of(motor, samples, used).of_sum(weights)
    scatter = noise.wider(touch.rise.memory.of_sum(weights), own)
    slope = noise.weighted_sum(weights, samples, used)
    return slope, scatter + np.diag(touch.level.drift**2)


def _is_pushed(motor: np.ndarray, touch: FeltTouch, theta_rad: float) -> np.ndarray:
    """Mark the samples (n,) from a little past the touch to theta_rad past it."""
    begin = touch.motor_rad + GUARD_RAD
    end = touch.motor_rad + theta_rad
    return (motor > begin) & (motor <= end)


def _slope_weights(motor: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Return the weights (n,), 1/rad, of the samples in the slope of a line through those used.

    The line is read 1 rad past the mean angle, and the mean is subtracted.
    """
    at = motor[used].mean() + 1.0
    return noise.line_weights(motor, used, at) - noise.mean_weights(used)
