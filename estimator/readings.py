"""What sensors other than an angle and a moment read of a stroke: forces at an angle, the moment's rate (Table I).

Plain arrays over one forward stroke, as in `estimator.signal`. Angles in rad, times in s.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from estimator import noise
from estimator.onset import GUARD_RAD, MIN_FREE_SAMPLES, Rise, Touch, columns, free_level, usable
from estimator.reasons import NamedReason
from estimator.signal import MIN_SAMPLES, MomentAt, moment_at

NO_FREE_FORCE = NamedReason("no_free_force", "no free stroke to read the force's zero from")


def force_at(
    theta_rad: float,
    motor_rad: ArrayLike,
    forces: ArrayLike,
    touch: Touch,
    *,
    time_s: ArrayLike | None = None,
    drift: np.ndarray | None = None,
) -> MomentAt:
    """Forces (k,) above the free stroke's level at the pushing angle past `touch`, which other channels told: read
    as moments are (`estimator.signal.moment_at`). Their own noise is in the covariance, and the drift (k,) of their
    zero, per rad; where it is not given, as the one free stroke shows it."""
    motor, samples = columns(motor_rad, forces)
    free = usable(motor, samples) & (motor < touch.motor_rad - GUARD_RAD)
    if not touch.status and np.count_nonzero(free) < MIN_FREE_SAMPLES:
        touch = replace(touch, status=NO_FREE_FORCE)
    if not touch.status:
        nothing = np.zeros(samples.shape[1])
        untold = Rise(nothing, nothing, np.zeros(len(motor)), noise.Memory.of(motor, samples, free))
        level = free_level(motor, samples, free)
        touch = replace(
            touch, level=level if drift is None else replace(level, drift=drift), rise=untold
        )
    return moment_at(theta_rad, motor, samples, touch, time_s=time_s)


def rate_at(
    theta_rad: float, motor_rad: ArrayLike, moments: ArrayLike, touch: Touch
) -> tuple[np.ndarray, np.ndarray]:
    """(slope (k,) per rad, covariance (k, k)) of moments over the motor angle, from touch to theta_rad past it.

    It is what a sensor of the moment's rate has, divided by the motor's speed; no zero enters, and the touch only as
    the angle from which samples count. The zero's drift is in the covariance. NaN where fewer than three samples are.
    """
    motor, samples = columns(motor_rad, moments)
    width = samples.shape[1]
    if touch.status:
        return np.full(width, np.nan), np.full((width, width), np.nan)
    used = (
        usable(motor, samples)
        & (motor > touch.motor_rad + GUARD_RAD)
        & (motor <= touch.motor_rad + theta_rad)
    )
    if np.count_nonzero(used) < MIN_SAMPLES:
        return np.full(width, np.nan), np.full((width, width), np.nan)
    weights = noise.line_weights(motor, used, motor[used].mean() + 1.0) - noise.mean_weights(used)
    own = noise.Memory.of(motor, samples, used).of_sum(weights)
    scatter = noise.wider(touch.rise.memory.of_sum(weights), own)
    return noise.weighted_sum(weights, samples, used), scatter + np.diag(touch.level.drift**2)
