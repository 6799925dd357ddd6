"""How far the whisker is seen turned in each frame beyond what the motor says: the encoder against the pictures.

A fit takes motor angles for exact. Here each frame may turn by itself about the motor's axis: one more step of the same
fit, with a column for each frame. What all frames have in common is the whisker's clamp and is not told.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.fit.problem import Problem, State, point_rows
from vision.fit.solve import LAST_SCALE, linear_at, linearise, robust_weights

# [rad] Of differences: the tip moves by 0.01 mm. Derived.
_STEP_RAD = 1e-4
# [rad] Keeps a frame without points from running away. Stated.
_PRIOR_RAD = 0.3


@dataclass(frozen=True, eq=False)
class Turns:
    """By frame index (f,) the motor angle it was taken at, rad, and how far the whisker is turned beyond it, rad, with
    the covariance (f, f)."""

    index: np.ndarray
    motor_rad: np.ndarray
    turn_rad: np.ndarray
    covariance: np.ndarray


def frame_turns(problem: Problem, state: State, index: Sequence[int]) -> Turns:
    """Turns of the frames (f,) of a fit that is done."""
    linear = linear_at(problem, state)
    turned = linearise(
        replace(problem, motor_rad=problem.motor_rad + _STEP_RAD), state, linear.jacobian
    )[0]
    by_turn, of_row = (
        (turned.residual - linear.residual) / _STEP_RAD,
        _frame_of_row(problem, len(linear.residual)),
    )
    count = len(problem.motor_rad)
    columns = np.where(of_row[:, None] == np.arange(count), by_turn[:, None], 0.0)
    rows = (
        np.hstack([linear.jacobian, columns]) * np.sqrt(robust_weights(linear, LAST_SCALE))[:, None]
    )
    residual = linear.residual * np.sqrt(robust_weights(linear, LAST_SCALE))
    prior = np.append(np.zeros(problem.size), np.full(count, _PRIOR_RAD**-2.0))
    covariance = np.linalg.inv(rows.T @ rows + np.diag(prior))
    step = -covariance @ (rows.T @ residual)
    own = slice(problem.size, None)
    return Turns(np.asarray(index, dtype=int), problem.motor_rad, step[own], covariance[own, own])


def _frame_of_row(problem: Problem, count: int) -> np.ndarray:
    """Frame of each row of residuals (n,), -1 of bar and priors: points come first, then the frames that touch."""
    frames, last = np.full(count, -1), 0
    for seen, rows in point_rows(problem):
        frames[rows], last = max(seen.frame, -1), rows.stop
    touching = np.flatnonzero(problem.touching)
    frames[last : last + len(touching)] = touching
    return frames
