"""The exact rod in space: any unloaded shape, any taper, bent and twisted by one point force.

Kirchhoff's inextensible rod of round section, clamped at its base. Where each section has turned by
Q from the unloaded shape, whose tangents are t₀, the tangent is t = Q t₀ and Q' = [S m]× Q, with the
moment m(s) = ∫ₛ t du × F and the compliance S m = (m + ν t (t·m))/EI: bending, and the torsion that
is softer by 1 + ν. Nothing else of the unloaded shape enters, not even its twist. Chebyshev
collocation over 0 ≤ s ≤ the loaded arc, in parts of it and of EI over its square, and Newton's method
with exact derivatives. Antman, Nonlinear Problems of Elasticity, chapter 8.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from scipy.spatial.transform import Rotation

from bench.rig import linear
from bench.rig.elastic_rod import Rod
from bench.rig.elastica import LEAST_WIDTH, Nodes
from bench.rig.loaded_point import BentRod, LoadedPoint

# [1] Steps of Newton's method before it is given up. Stated.
_MOST_STEPS = 40
# [rad] Largest last step, a thousand times the rounding of a derivative at the nodes. Derived.
_LAST_STEP_RAD = 1e-10
# [rad] Largest step of any section: beyond half a turn the linearised rotation points nowhere. Stated.
_LONGEST_STEP_RAD = 0.7
# [1] EI over the torsional rigidity G·2I, less one, is Poisson's ratio: of metals and of polymers.
# Stated.
TORSION_OVER_BENDING = 0.35
# [points] Of Chebyshev along the loaded arc. Study: tests/bench/rig/test_kirchhoff_rod.py.
_NODES_OF_CYLINDER = 16
# [points] Of a rod that tapers. Study: tests/bench/rig/test_kirchhoff_rod.py.
_NODES_OF_TAPER = 32
# [1] Share of the largest Chebyshev coefficient of the curvature that the last two may have. Stated:
# positions, its double integral, are then good to 1e-7 of the arc.
_UNRESOLVED = 1e-3


@dataclass(frozen=True)
class _Load:
    """A force and what does not change while Newton's method runs, on the unit of the loaded arc.

    force (3,): in EI at the base over the square of the arc. rest (n, 3): unloaded tangents at the
    nodes. softness (n,): EI at the base over that there.
    """

    force: np.ndarray
    rest: np.ndarray
    softness: np.ndarray


@dataclass(frozen=True)
class _Balance:
    """Moments and compliances at the nodes of one set of turns.

    tangents, lever, moment, curvature (n, 3): t, ∫ₛ t du, m, and S m. compliance (n, 3, 3): S.
    jacobian (3n, 3n): of the turns that are missing.
    """

    tangents: np.ndarray
    lever: np.ndarray
    moment: np.ndarray
    curvature: np.ndarray
    compliance: np.ndarray
    jacobian: np.ndarray


class KirchhoffRod(BentRod):
    """The exact bending and twisting of a rod of any unloaded shape."""

    def __init__(self, rod: Rod, nodes: int = 0):
        self.rod = rod
        least = _NODES_OF_CYLINDER if rod.diameter_loss == 0 else _NODES_OF_TAPER
        self.nodes = Nodes.make(nodes or least)
        count = len(self.nodes.at)
        derivatives = 2 * chebyshev.chebder(np.eye(count))  # by parts of the arc, (n - 1, n)
        self._slope = np.linalg.solve(
            self.nodes.values.T, (self.nodes.values[:, :-1] @ derivatives).T
        ).T

    def solve(
        self, rotation: np.ndarray, unknowns: np.ndarray, guess: np.ndarray | None
    ) -> LoadedPoint:
        """Find the loaded point; guess (n, 4): quaternions of the sections' turns."""
        arc = float(unknowns[3])
        turns, load, balance = self._equilibrium(unknowns, guess)
        tangents = balance.tangents
        tangents_by = np.zeros((*tangents.shape, 4))
        tangents_by[..., 3] = self._rest_tangents_by(turns, arc)
        turned_by = self._turned_by(load, balance, tangents_by[..., 3], arc)
        tangents_by -= _cross_matrices(tangents) @ turned_by
        weights = self.nodes.weights
        end = weights @ tangents
        end_by = arc * np.tensordot(weights, tangents_by, 1)
        end_by[:, 3] += end
        return LoadedPoint(
            rotation @ (arc * end),
            rotation @ end_by,
            rotation @ tangents[-1],
            rotation @ tangents_by[-1],
            turns.as_quat(),
        )

    def curve_mm(
        self, unknowns: np.ndarray, guess: np.ndarray | None, arc_mm: np.ndarray
    ) -> np.ndarray:
        """Return points (n, 3) at arc lengths (n,); beyond the load of the unloaded shape, turned."""
        loaded_mm = float(unknowns[3])
        turns, _, balance = self._equilibrium(unknowns, guess)
        points = loaded_mm * self.nodes.from_base @ balance.tangents  # (nodes, 3)
        curve = self.nodes.interpolate(points, np.clip(arc_mm / loaded_mm, 0, 1))
        rest = self.rod.rest
        beyond = rest.point_mm(np.maximum(arc_mm, loaded_mm)) - rest.point_mm(loaded_mm)
        return curve + turns[-1].apply(beyond)

    def _equilibrium(self, unknowns, guess) -> tuple[Rotation, _Load, _Balance]:
        """Return the turns of the sections at the nodes, the load, and their balance."""
        force_N = unknowns[:3]
        arc = float(unknowns[3])
        load = self._load(force_N, arc)
        count = len(self.nodes.at)
        turns = Rotation.identity(count) if guess is None else Rotation.from_quat(guess)
        for _ in range(_MOST_STEPS):
            balance = self._balance(load, turns)
            missing = balance.curvature - self._curvature(turns)
            step = linear.solve(balance.jacobian, (self.nodes.from_base @ missing).ravel())
            longest = float(np.abs(step).max())
            if longest < _LAST_STEP_RAD:
                self._check_resolved(balance, arc)
                return turns, load, balance
            step *= min(1.0, _LONGEST_STEP_RAD / longest)
            turns = Rotation.from_rotvec(step.reshape(-1, 3)) * turns
        raise _no_equilibrium(force_N, arc)

    def _load(self, force_N, arc) -> _Load:
        """Return a force, N, at an arc, mm, on the unit of that arc."""
        at_mm = self.nodes.at * arc
        width = np.maximum(self.rod.width(at_mm), LEAST_WIDTH)
        force = np.asarray(force_N, float) * (arc**2 / self.rod.rigidity_Nmm2)
        return _Load(force, self.rod.rest.tangent(at_mm), width**-4.0)

    def _balance(self, load: _Load, turns: Rotation) -> _Balance:
        """Return moments and compliances of turned sections."""
        tangents = turns.apply(load.rest)
        lever = self.nodes.to_load @ tangents
        force_matrix = linear.cross_matrix(load.force)
        moment = lever @ force_matrix  # row by row lever × force
        twisted = TORSION_OVER_BENDING * tangents[:, :, None] * tangents[:, None, :]
        compliance = load.softness[:, None, None] * (np.eye(3) + twisted)
        curvature = np.einsum("nij,nj->ni", compliance, moment)
        count = len(tangents)
        change = compliance[:, None] @ self._moment_by_turns(force_matrix, tangents, moment)
        per_node = change.transpose(0, 2, 1, 3).reshape(count, -1)
        jacobian = np.eye(3 * count) - (self.nodes.from_base @ per_node).reshape(3 * count, -1)
        return _Balance(tangents, lever, moment, curvature, compliance, jacobian)

    def _moment_by_turns(
        self, force_matrix: np.ndarray, tangents: np.ndarray, moment: np.ndarray
    ) -> np.ndarray:
        """Return the derivatives (n, n, 3, 3) of the moments (n, 3) by turns w of the sections.

        m changes by f × (∫ₛ t × w du), and that of a turned section by m × w besides. tangents
        (n, 3): t; force_matrix (3, 3): of f ×.
        """
        by_turns = force_matrix @ _cross_matrices(tangents)  # (n, 3, 3) at each node u
        change = self.nodes.to_load[:, :, None, None] * by_turns
        own = np.arange(len(tangents))
        change[own, own] += _cross_matrices(moment)
        return change

    def _curvature(self, turns: Rotation) -> np.ndarray:
        """Return the rate (n, 3) at which sections turn along the rod: 2 q' q* of quaternions."""
        quaternions = turns.as_quat()
        slopes = self._slope @ quaternions
        vector = quaternions[:, :3]
        scalar = quaternions[:, 3:]
        rate = slopes[:, :3] * scalar - slopes[:, 3:] * vector - np.cross(slopes[:, :3], vector)
        return 2 * rate

    def _rest_tangents_by(self, turns, arc) -> np.ndarray:
        """Return the derivatives (n, 3) of the tangents by the arc where sections do not turn."""
        rest_by = self.rod.rest.tangent_by_arc(self.nodes.at * arc) * self.nodes.at[:, None]
        return turns.apply(rest_by)

    def _turned_by(self, load, balance, tangents_by_arc, arc) -> np.ndarray:
        """Return the turns (n, 3, 4) of the sections for a unit of force, N, and of arc, mm.

        tangents_by_arc (n, 3): of sections that do not turn.
        """
        moment = balance.moment
        curvature_by = balance.compliance @ self._moment_by(load, balance, tangents_by_arc, arc)
        width = load.softness**-0.25
        thinner_by = self.rod.width_by_arc(self.nodes.at * arc) * self.nodes.at
        softer_by = -4 * thinner_by / width  # (n,) by parts
        curvature_by[..., 3] += softer_by[:, None] * balance.curvature
        by_tangent = _twist_by_arc(balance.tangents, tangents_by_arc, moment)
        curvature_by[..., 3] += TORSION_OVER_BENDING * load.softness[:, None] * by_tangent
        count = len(moment)
        missing = (self.nodes.from_base @ curvature_by.reshape(count, -1)).reshape(3 * count, 4)
        return linear.solve(balance.jacobian, missing).reshape(count, 3, 4)

    def _moment_by(self, load, balance, tangents_by_arc, arc) -> np.ndarray:
        """Return the derivatives (n, 3, 4) of the moments by force, N, and arc, mm; sections do not turn."""
        per_newton = arc**2 / self.rod.rigidity_Nmm2
        moment_by = np.empty((*balance.moment.shape, 4))
        moment_by[..., :3] = per_newton * _cross_matrices(balance.lever)
        lever_by_arc = self.nodes.to_load @ tangents_by_arc
        moment_by[..., 3] = 2 / arc * balance.moment + np.cross(lever_by_arc, load.force)
        return moment_by

    def _check_resolved(self, balance, arc):
        """Raise ArithmeticError where the nodes do not resolve the curvature."""
        coefficients = np.abs(self.nodes.coefficients(balance.curvature)).max(1)
        if coefficients[-2:].max() > _UNRESOLVED * coefficients.max():
            raise ArithmeticError(
                f"the whisker is too thin at {arc:.4g} mm for its bend to be resolved"
            )


def _twist_by_arc(
    tangents: np.ndarray, tangents_by_arc: np.ndarray, moment: np.ndarray
) -> np.ndarray:
    """Return the derivative (n, 3) by the arc of t (t · m), the twisting part of moments m (n, 3)."""
    twist = (tangents * moment).sum(1)[:, None]
    twist_by = (tangents_by_arc * moment).sum(1)[:, None]
    return tangents_by_arc * twist + tangents * twist_by


def _cross_matrices(vectors: np.ndarray) -> np.ndarray:
    """Return the matrices (n, 3, 3) that map b to a × b, for vectors a (n, 3)."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.moveaxis(np.array(rows), -1, 0)


def _no_equilibrium(force_N: np.ndarray, arc_mm: float) -> ArithmeticError:
    """Return the error for a force (3,) at an arc under which no equilibrium was found."""
    forces = ", ".join(f"{component:.4g}" for component in force_N)
    return ArithmeticError(f"no equilibrium found for [{forces}] N at {arc_mm:.4g} mm")
