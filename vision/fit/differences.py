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

    def apply(self, vector: np.ndarray) -> np.ndarray:
        """Return a copy of the vector (size,) that is moved so."""
        moved = vector.copy()
        moved[self.column[self.column >= 0]] += self.step  # once, of a column in several frames
        return moved


@dataclass(frozen=True, eq=False)
class Perturbed:
    """A parameter vector with c moved copies.

    vectors (c + 1, size): the vector itself, then the copies. moves (c,): how each was moved.
    """

    vectors: np.ndarray
    moves: Sequence[Perturbation] = ()

    @property
    def vector(self) -> np.ndarray:
        """Return the vector (size,) itself."""
        return self.vectors[0]

    def jacobian(self, change: np.ndarray, frame: np.ndarray) -> np.ndarray:
        """Return derivatives (n, size) of values that each belong to a frame (n,).

        change (c, n): of the values, from the vector to each copy.
        """
        jacobian = np.zeros((len(frame), len(self.vector)))
        for move, moved in zip(self.moves, change):
            column = move.column[frame]
            row = np.flatnonzero(column >= 0)
            jacobian[row, column[row]] = moved[row] / move.step
        return jacobian

    def shared_gradient(self, change: np.ndarray) -> np.ndarray:
        """Return the derivatives (size,) by the shared parameters of a value of the whole whisk.

        change (c,): of the value, from the vector to each copy.
        """
        gradient = np.zeros(len(self.vector))
        for move, moved in zip(self.moves, change):
            if move.is_shared:
                gradient[move.column[0]] = moved / move.step
        return gradient


def perturb(problem: Problem, vector: np.ndarray, *, reach: bool = False) -> Perturbed:
    """Return the vector with copies, in each of which one shared parameter or one of all bends is
    moved; reach: move the reach's error, too.
    """
    blocks = problem.blocks
    frames = len(problem.motor_rad)
    own = [blocks.bar_axis, blocks.rest_shape, blocks.taper, blocks.friction]
    if reach:
        own.append(blocks.reach)
    moves = []
    for k in np.append(columns_of(*own), blocks.placement):
        moves.append(Perturbation(blocks.steps[k], np.full(frames, k), is_shared=True))
    order = np.cumsum(problem.bent) - 1  # (f,) number of each bent frame
    for first in (blocks.bends.start, blocks.bends.start + 1):
        column = np.where(problem.bent, first + 2 * order, -1)
        moves.append(Perturbation(blocks.bends.step, column, is_shared=False))
    copies = [move.apply(vector) for move in moves]
    return Perturbed(np.stack([vector, *copies]), moves)
