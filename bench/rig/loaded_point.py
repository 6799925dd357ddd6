"""The point of the whisker where a force acts: its place and tangent, with exact derivatives.

The force and the clamped tangent span the plane of bending, in which the elastica is solved; the
rest shape is added to first order.
"""

import math
from dataclasses import dataclass

import numpy as np

from bench.rig.elastica import Elastica

_SIDEWAYS = np.array([1.0, 0.0])  # (2,): y and z of the way across where no force defines one


@dataclass(frozen=True)
class LoadedPoint:
    """Position and tangent, each (3,), of the loaded point in the rig frame, and their derivatives
    (3, 4) by the force and the arc. angle (n,): of the elastica."""

    point: np.ndarray
    point_by: np.ndarray
    tangent: np.ndarray
    tangent_by: np.ndarray
    angle: np.ndarray

    @classmethod
    def solve(
        cls,
        elastica: Elastica,
        rotation: np.ndarray,
        unknowns: np.ndarray,
        guess: np.ndarray | None,
    ) -> "LoadedPoint":
        """Solve for the whisker bent by a force at an arc, unknowns (4,), in a hub that is rotated (3, 3).

        guess (n,): angles to start from. Raises ArithmeticError where there is no equilibrium.
        """
        force_x, force_y, force_z, arc = unknowns[:4].tolist()
        force_e = math.hypot(force_y, force_z)
        e = np.array([force_y, force_z]) / force_e if force_e else _SIDEWAYS
        bent = elastica.solve(force_x, force_e, arc, guess)
        point, point_by = _lift(bent.end_mm, bent.end_by, e, force_e)
        tangent, tangent_by = _lift(*_planar_tangent(bent), e, force_e)
        rest = elastica.rod.rest
        rest_slope = rest.slope(arc)
        point_by[:, 3] += rest_slope
        tangent_by[:, 3] += rest.curvature(arc)
        return cls(
            rotation @ (point + rest.offset_mm(arc)),
            rotation @ point_by,
            rotation @ (tangent + rest_slope),
            rotation @ tangent_by,
            bent.angle,
        )


def _planar_tangent(bent):
    """Return the tangent (2,) of the loaded point in the plane of bending, and its derivatives."""
    tangent = np.array([math.cos(bent.slope), math.sin(bent.slope)])
    return tangent, np.outer([-tangent[1], tangent[0]], bent.slope_by)


def _lift(planar, planar_by, e, force_e):
    """Return a vector (3,) of the plane of bending in three dimensions, and its derivatives (3, 4)
    by F_x, F_y, F_z and arc.

    planar (2,), planar_by (2, 3): along x and e, by force x, force e and arc. e (2,): y and z of
    the unit vector across.
    """
    axes = np.zeros((3, 2))  # of the plane, as columns
    axes[0, 0] = 1.0
    axes[1:, 1] = e
    chain = np.zeros((3, 4))  # derivatives of force x, force e and arc
    chain[0, 0] = 1.0
    chain[1, 1:3] = e
    chain[2, 3] = 1.0
    vector_by = axes @ planar_by @ chain
    per_sideways_force = planar[1] / force_e if force_e else planar_by[1, 1]
    vector_by[1:, 1:3] += per_sideways_force * (np.eye(2) - np.outer(e, e))
    return axes @ planar, vector_by
