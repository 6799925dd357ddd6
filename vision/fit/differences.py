"""Perturbed parameter vectors for derivatives by differences: shared parameters alone, all frames'
bends at once.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vision.fit.blocks import columns_of
from vision.fit.problem import Problem


@dataclass(frozen=True, eq=False)
class Perturbation:
    """How one copy of the parameter vector was moved.

    step: by how much. column (f,): which parameter moved in each frame, -1 where none did.
    is_shared: whether it is one parameter of all frames, not each frame's own bend.
    """

    step: float
    column: np.ndarray
    is_shared: bool


def perturbed(
    problem: Problem, vector: np.ndarray, *, reach: bool = False
) -> tuple[np.ndarray, Sequence[Perturbation]]:
    """Return the vector itself with moved copies (c + 1, size), and how each of the c copies was
    moved.

    reach: move the reach's error, too.
    """
    blocks = problem.blocks
    steps = blocks.steps
    frames = len(problem.motor_rad)
    geometry = [blocks.bar_axis, blocks.rest_shape, *([blocks.reach] if reach else [])]
    objects = [blocks.motion, blocks.shift_along, blocks.outline_bias]
    rows = [vector]
    moves = []
    for k in columns_of(*geometry, *objects, blocks.friction).tolist():
        row = vector.copy()
        row[k] += steps[k]
        rows.append(row)
        moves.append(Perturbation(steps[k], np.full(frames, k), is_shared=True))
    order = np.cumsum(problem.bent) - 1  # (f,) number of each bent frame
    step = blocks.bends.step
    for part in range(2):
        row = vector.copy()
        row[blocks.bends.start + part :: 2] += step
        column = np.where(problem.bent, blocks.bends.start + 2 * order + part, -1)
        rows.append(row)
        moves.append(Perturbation(step, column, is_shared=False))
    return np.stack(rows), moves
