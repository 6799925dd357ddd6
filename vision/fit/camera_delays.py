"""By how many frames each camera shows the whisker later than the others do: cameras compared.

Cameras that are parts of one picture, by a mirror or in a split view, were exposed at once.

A camera that lost a frame, or whose pictures are numbered from another one, has every picture in the
place of the next. It shows the whisker where it was, which the other cameras contradict whatever
clock or encoder say. One more step of the fit, with a column for the delay of one camera, gives it.
"""

from collections.abc import Mapping

import numpy as np

from vision.fit.converged_fit import ConvergedFit, times_residual_covariance
from vision.fit.problem import Problem, point_rows

# [frames⁻²] Information on the delay of a camera that hardly shows the wire turn, which would run away. Stated.
_PRIOR = 1e-4


def camera_delays(
    fit: ConvergedFit, picture_of: Mapping[str, str] | None = None
) -> dict[str, tuple[float, float]]:
    """Return the delay of each camera in frames, the others having none, and its sigma.

    picture_of: by camera that is a part of a picture, the camera whose picture it is; the delay is that
    of all its parts, under its name. There is none of a single picture, nor of a camera that shows no wire.
    """
    parts = picture_of or {}
    problem = fit.problem
    pictures = [parts.get(name, name) for name in problem.cameras.names]
    if len(set(pictures)) < 2:
        return {}
    linear = fit.linear
    weight = linear.weights()
    columns = _by_delay(problem, fit.by_turn)
    found = {}
    for picture in dict.fromkeys(pictures):
        column = columns[:, [other == picture for other in pictures]].sum(axis=1)
        if not column.any():  # it shows no wire
            continue
        gain = _gain_of_last(np.column_stack([linear.jacobian, column]), weight)
        sigma = _sigma(problem, gain, gain[:, linear.is_point] @ fit.by_camera)
        found[picture] = (float(gain[0] @ linear.residual), sigma)
    return found


def _sigma(problem: Problem, gain: np.ndarray, by_camera: np.ndarray) -> float:
    """Return the sigma of a delay, by noise and by the cameras.

    gain (1, n): how it depends on the residuals. by_camera (1, 15 c): on the cameras' parameters.
    """
    variance = times_residual_covariance(problem, gain) @ gain.T
    variance += by_camera @ problem.cameras.covariance @ by_camera.T
    return float(np.sqrt(variance[0, 0]))


def _gain_of_last(jacobian: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return how the step of the last parameter depends on the residuals, (1, n).

    jacobian (n, p), of which the last column is a camera's delay; weight (n,): of the residuals.
    """
    weighted = jacobian.T * weight
    prior = np.append(np.zeros(jacobian.shape[1] - 1), _PRIOR)
    return -np.linalg.solve(weighted @ jacobian + np.diag(prior), weighted)[-1:]


def _by_delay(problem: Problem, by_turn_rad: np.ndarray) -> np.ndarray:
    """Return derivatives (n, cameras) of all residuals by the delay of each camera in frames.

    by_turn_rad (n,): by the whisker's turn in the frame of each residual.
    """
    motor = problem.motor_rad
    behind = -np.diff(motor, prepend=2.0 * motor[0] - motor[1])  # (f,) rad, of one frame
    columns = np.zeros((len(by_turn_rad), len(problem.cameras)))
    for seen, rows in point_rows(problem):
        if seen.on_wire:
            columns[rows, seen.camera] = by_turn_rad[rows] * behind[seen.frame]
    return columns
