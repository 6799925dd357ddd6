"""A straight whisker, bent by one force: the clamped tangent and the force span the plane in which
the elastica is solved."""

import math

import numpy as np

from bench.rig.elastic_rod import Rod
from bench.rig.elastica import Elastica
from bench.rig.loaded_point import BentRod, LoadedPoint

_SIDEWAYS = np.array([1.0, 0.0])  # (2,): y and z of the way across where no force defines one


class PlanarRod(BentRod):
    """The exact bending of a rod that is straight without load."""

    def __init__(self, rod: Rod):
        self.elastica = Elastica(rod)

    def solve(
        self, rotation: np.ndarray, unknowns: np.ndarray, guess: np.ndarray | None
    ) -> LoadedPoint:
        """Find the loaded point; guess (n,): the elastica's angles."""
        force_x, force_y, force_z, arc = unknowns[:4].tolist()
        e, force_e = _across(force_y, force_z)
        bent = self.elastica.solve(force_x, force_e, arc, guess)
        point, point_by = _lift(bent.end_mm, bent.end_by, e, force_e)
        tangent, tangent_by = _lift(*_planar_tangent(bent), e, force_e)
        return LoadedPoint(
            rotation @ point,
            rotation @ point_by,
            rotation @ tangent,
            rotation @ tangent_by,
            bent.angle,
        )

    def curve_mm(
        self, unknowns: np.ndarray, guess: np.ndarray | None, arc_mm: np.ndarray
    ) -> np.ndarray:
        """Return points (n, 3) at arc lengths (n,), straight beyond the load."""
        force_x, force_y, force_z, arc = unknowns[:4].tolist()
        e, force_e = _across(force_y, force_z)
        bent = self.elastica.solve(force_x, force_e, arc, guess)
        plane = self.elastica.curve_mm(bent, arc_mm)  # (n, 2)
        return np.column_stack([plane[:, 0], plane[:, 1:] * e])


def _across(force_y, force_z):
    """Return y and z (2,) of the unit vector across along which a force acts, and how strongly."""
    force_e = math.hypot(force_y, force_z)
    return (np.array([force_y, force_z]) / force_e if force_e else _SIDEWAYS), force_e


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
