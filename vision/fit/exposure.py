"""Slip while the shutter is open: a frame whose wire is blurred along the bar more than that of
others is a mean.

A whisker that sticks and slips jumps within a fraction of a millisecond. A picture that the jump
falls into shows it at both places, each for a share of the exposure: its line is that of their
mean, and fits as well as any. But it is wider. Of two places a distance J apart, the second seen
for a share w, the mean is min(w, 1 - w) J from where the wire was at mid-exposure at most, and the
standard deviation, √(w (1 - w)) J, is never less. So that is its sigma.
"""

from dataclasses import dataclass

import numpy as np

from vision.fit.converged_fit import ConvergedFit
from vision.fit.problem import Problem, point_rows
from vision.fit.solve import Linear
from vision.geometry.robust import robust_sigma

# [sigma] A frame blurred along the bar by more than the median one: one sound frame in 30 000.
# Derived.
_SURE_SIGMAS = 4.0
# [frames] That touch: of fewer the median may be that of a jump. Derived.
_FEWEST = 3


@dataclass(frozen=True, eq=False)
class Exposure:
    """Slip while the shutter was open.

    variance_mm2 (f,): of the slip within each frame's exposure beyond that of the others, 0 where
    none is sure. covariance (size, size): of the fit's parameters by it.
    """

    variance_mm2: np.ndarray
    covariance: np.ndarray


def slip_in_exposure(fit: ConvergedFit) -> Exposure:
    """Return the slip while the shutter was open, by the blur of the lines."""
    problem = fit.problem
    frames = np.flatnonzero(problem.touching)
    moves = _along_bar(problem, fit.linear, fit.by_parameter.frame["slip"][frames])
    found = np.zeros(len(frames))
    if len(frames) >= _FEWEST:
        excess = []
        for frame, move in zip(frames, moves):
            excess.append(_excess(problem, fit.linear, frame, move))
        variance, sigma = np.transpose(excess)
        found = _surely_above(variance, sigma)
    variance_mm2 = np.zeros(len(problem.motor_rad))
    variance_mm2[frames] = found
    return Exposure(variance_mm2, (moves.T * found) @ moves)


def _along_bar(problem: Problem, linear: Linear, slip_by: np.ndarray) -> np.ndarray:
    """Return how the parameters (t, size) of each touching frame's bend change as it slips by 1 mm
    and keeps touching."""
    moves = np.zeros(slip_by.shape)
    contact_by = linear.jacobian[problem.contact_rows]
    for k, frame in enumerate(np.flatnonzero(problem.touching)):
        bend = problem.bend_of(frame)
        rows = np.stack([slip_by[k, bend], contact_by[k, bend]])
        moves[k, bend] = np.linalg.solve(rows, [1.0, 0.0])
    return moves


def _excess(problem: Problem, linear: Linear, frame: int, move: np.ndarray) -> tuple[float, float]:
    """Return the variance of a frame's slip, mm², and its sigma.

    The blur² of the frame's points goes with the square of what they move by as it slips; move
    (size,): that of the parameters.
    """
    power = 0.0
    moment = 0.0
    for seen, rows in point_rows(problem):
        if seen.frame == frame:
            px_per_mm = linear.jacobian[rows] @ move * seen.points.sigma_px
            above, sigma = seen.points.widened_px2.T
            power += np.sum((px_per_mm**2 / sigma) ** 2)
            moment += np.sum(px_per_mm**2 * above / sigma**2)
    if power > 0.0:
        return moment / power, power**-0.5
    return 0.0, np.inf


def _surely_above(variance: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Return the excess of a variance (t,) over the median one, 0 where noise and the others'
    scatter explain it.
    """
    above = variance - np.median(variance)
    scatter = robust_sigma(above)
    return np.where(above > _SURE_SIGMAS * np.hypot(sigma, scatter), above, 0.0)
