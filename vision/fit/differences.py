"""How a fit's geometry is moved for derivatives by differences: shared parameters alone, all frames' bends at once."""

from collections.abc import Sequence

import numpy as np

from vision.fit.problem import BAR, REACH, REST, Problem

# [mm, rad, 1] Steps of differences: about 1e-5 of what they move. Study: gradients.py.
_SHIFT_MM, _TILT_RAD, _BEND_RAD, _PULL = 1e-4, 1e-6, 1e-5, 1e-3


def steps(problem: Problem) -> np.ndarray:
    """Step (size,) of each parameter."""
    step = np.full(problem.size, _BEND_RAD)
    step[0:2], step[2:4], step[BAR : BAR + REST], step[REACH] = (
        _SHIFT_MM,
        _TILT_RAD,
        _SHIFT_MM,
        _SHIFT_MM,
    )
    step[problem.bar_moves], step[problem.pull] = _SHIFT_MM, _PULL
    return step


def perturbed(
    problem: Problem, vector: np.ndarray, *, reach: bool = False
) -> tuple[np.ndarray, Sequence]:
    """The vector itself and moved copies (c + 1, size), and of each copy its step and, by frame, which parameter moved
    (f,), -1 where none did. reach: move the reach's error, too."""
    step, frames = steps(problem), len(problem.motor_rad)
    rows, columns = [vector], []
    for k in [*range(REACH + reach), *range(problem.size)[problem.bar_moves], problem.pull]:
        rows.append(vector + step[k] * (np.arange(problem.size) == k))
        columns.append((step[k], np.full(frames, k)))
    order = np.cumsum(problem.bent) - 1
    for part in range(2):
        row = vector.copy()
        row[problem.first_bend + part :: 2] += _BEND_RAD
        rows.append(row)
        columns.append(
            (_BEND_RAD, np.where(problem.bent, problem.first_bend + 2 * order + part, -1))
        )
    return np.stack(rows), columns
