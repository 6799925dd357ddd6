"""How far the whisker is turned in each frame beyond the motor's angle: the encoder against the
pictures.

A fit takes motor angles for exact. Here each frame may turn by itself about the motor's axis: one
more step of the same fit, with a column for each frame. What all frames have in common is the
whisker's clamp and is not determined.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vision.fit.converged_fit import ConvergedFit
from vision.fit.problem import Problem, point_rows

# [rad] Keeps a frame without points from running away. Stated.
_PRIOR_RAD = 0.3


@dataclass(frozen=True, eq=False)
class Turns:
    """Turns of frames beyond the motor's angle.

    index (f,): of the frames. motor_rad (f,): angle at which each was taken. turn_rad (f,): by how
    much the whisker is turned beyond it, with covariance (f, f).
    """

    index: np.ndarray
    motor_rad: np.ndarray
    turn_rad: np.ndarray
    covariance: np.ndarray


def frame_turns(fit: ConvergedFit, index: Sequence[int]) -> Turns:
    """Return the turns of a fit's frames (f,)."""
    linear = fit.linear
    problem = fit.problem
    count = len(problem.motor_rad)
    jacobian = np.hstack([linear.jacobian, _by_turns(fit)])
    weighted = jacobian.T * linear.weights()
    no_prior = np.zeros(problem.size)  # of the fit's parameters, whose priors are rows
    prior = np.append(no_prior, np.full(count, _PRIOR_RAD**-2.0))
    covariance = np.linalg.inv(weighted @ jacobian + np.diag(prior))
    step = -covariance @ (weighted @ linear.residual)
    turn_rad = step[-count:]
    return Turns(np.asarray(index), problem.motor_rad, turn_rad, covariance[-count:, -count:])


def _by_turns(fit: ConvergedFit) -> np.ndarray:
    """Return derivatives (n, f) of all residuals by the turn of each frame."""
    frames = np.arange(len(fit.problem.motor_rad))
    is_of_frame = _frame_of_row(fit.problem, len(fit.by_turn))[:, None] == frames
    return is_of_frame * fit.by_turn[:, None]


def _frame_of_row(problem: Problem, count: int) -> np.ndarray:
    """Return the frame of each row of residuals (count,), -1 of bar and priors."""
    frames = np.full(count, -1)
    for seen, rows in point_rows(problem):
        frames[rows] = max(seen.frame, -1)
    frames[problem.contact_rows] = np.flatnonzero(problem.touching)
    return frames
