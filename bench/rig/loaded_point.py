"""The point of the whisker where a force acts, and what finds it: the interface of a bent rod."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class LoadedPoint:
    """Position and tangent, each (3,), of the loaded point in the rig frame, and their derivatives
    (3, 4) by the force and the arc. shape: of the whole rod, to start the next solution from."""

    point: np.ndarray
    point_by: np.ndarray
    tangent: np.ndarray
    tangent_by: np.ndarray
    shape: np.ndarray


class BentRod(ABC):
    """A whisker that is clamped at its base and bent by one force at a point."""

    @abstractmethod
    def solve(
        self, rotation: np.ndarray, unknowns: np.ndarray, guess: np.ndarray | None
    ) -> LoadedPoint:
        """Find the loaded point in a hub that is rotated (3, 3).

        unknowns (4,): the force, N, in the hub's axes, and the arc, mm. guess: the shape of a
        solution nearby. Raises ArithmeticError where there is no equilibrium.
        """

    @abstractmethod
    def curve_mm(
        self, unknowns: np.ndarray, guess: np.ndarray | None, arc_mm: np.ndarray
    ) -> np.ndarray:
        """Return points (n, 3) of the bent rod at arc lengths (n,) in the hub's axes.

        Arguments and errors are those of `solve`.
        """
