"""The moments at the clamp of a curved, tapering rod from where a contact holds it: exact, the bench's own.

Kirchhoff's inextensible rod of round section. A section has turned by Q from the unloaded shape, whose
tangents are t₀: the tangent is t = Q t₀, and Q' = [κ]× Q with κ = (m + ν t (t·m))/EI and m = p × F, p
being the way from the section to the contact. At the contact p and m are nothing, so all is known there
but the force, and the rod is marched from the contact to its clamp. Newton's method finds the force
and the arc that lead to the contact that is seen. Antman, Nonlinear Problems of Elasticity, chapter 8.

All is solved in the rod's own units: lengths in the chord c from the clamp to the contact, forces in
EI/c², with EI at the clamp.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bench.gauges.held_rod import HeldRod
from bench.session.rest_shape import UnloadedRod

# [1] EI over the torsional rigidity, less one, is Poisson's ratio: of metals and of polymers. Stated.
_POISSON = 0.35
# [steps] Of Newton's method: from the unloaded rod, in steps of `_LONGEST_STEP`. Stated.
_MOST_STEPS = 40
# [1] The most that one step moves the contact, in chords; within it the linear rod foretells the
# bent one. Stated.
_LONGEST_STEP = 0.2
# [1] Last step in the rod's units: the next is smaller by the error of the derivatives, 1e-5. Derived.
_LAST_STEP = 1e-9
# [1] Step of differences in the rod's units: the root of the march's error. Derived.
_DIFFERENCE = 1e-5
# [1] Error of the march over the size of what is marched, a millionth of what pictures know. Stated.
_MARCH_ERROR = 1e-10
# [1] Width of a rod over that at its clamp: a contact nearer to a point than this bends nothing. Stated.
_LEAST_WIDTH = 0.01
# [EI/chord²] Of the force across a rod's end over its width there, at most: 2 turn the end by 100°. Beyond it Newton's
# method leads to rods that are coiled. Study: tests/bench/gauges/test_curved_rod.py.
_MOST_FORCE = 10.0
_TOO_FAR = "no equilibrium found of a curved rod that is bent so far"


@dataclass(frozen=True, eq=False)
class _Marched:
    """Contacts, forces and tangents (..., n, 3) at the ends of rods, in the hub's axes and the rods' own units."""

    contact: np.ndarray
    force: np.ndarray
    tangent: np.ndarray


def _newton_step(by_unknowns: np.ndarray, missing: np.ndarray) -> np.ndarray | None:
    """Solve for the changes (n, 3) of the unknowns that give what is missing (n, 3); None where they do not exist.

    by_unknowns (n, 3, 3): derivatives.
    """
    try:
        step = np.linalg.solve(by_unknowns, missing[..., None])[..., 0]
    except np.linalg.LinAlgError:
        return None
    return step if np.isfinite(step).all() else None


@dataclass(frozen=True, eq=False)
class KirchhoffRods:
    """Rods of one whisker, held at contacts (n, 3), mm, in the hub's axes.

    rest: of the whisker. width: the diameter over the clamp's as a function of shares of the length.
    clamp_rigidity_Nmm2: EI at the clamp.
    """

    rest: UnloadedRod
    width: Callable
    clamp_rigidity_Nmm2: float
    contacts_mm: np.ndarray

    def held(self, friction: np.ndarray, deflection_mm: np.ndarray) -> HeldRod:
        """Return what holds the rods at their contacts.

        friction (n,): friction over the force across the rod at the contact, positive where it pulls
        towards the clamp. deflection_mm (n, 3): about how far the contact is from the unloaded rod.
        Raises ArithmeticError where no equilibrium is found.
        """
        chord = np.linalg.norm(self.contacts_mm, axis=1)
        wanted = self.contacts_mm / chord[:, None]
        unknowns = self._start(deflection_mm, chord)
        for _ in range(_MOST_STEPS):
            tried = self._with_differences(unknowns)  # (4, n, 3)
            marched = self._march(tried, friction, chord)
            points = marched.contact
            missing = wanted - points[0]
            by_unknowns = np.moveaxis(points[1:] - points[0], 0, -1) / _DIFFERENCE
            step = _newton_step(by_unknowns, missing)
            if step is None:
                break
            if np.abs(step).max() < _LAST_STEP:
                return self._in_units(marched, chord)
            size = np.linalg.norm(missing, axis=1, keepdims=True)
            unknowns = unknowns + step * np.minimum(1.0, _LONGEST_STEP / np.maximum(size, 1e-300))
        raise ArithmeticError(_TOO_FAR)

    def _start(self, deflection_mm: np.ndarray, chord: np.ndarray) -> np.ndarray:
        """Return a guess (n, 3) of the force's two components across the rod's end, and of the arc.

        By a force F a straight rod that tapers to w of its clamp's diameter at d moves by F d³/(3 EI w) there.
        """
        direction = self.contacts_mm / chord[:, None]
        arc = self.rest.arc_along_mm(direction, chord)
        _, first, second = self._end_axes(arc)
        width = self.width(arc / self.rest.length_mm)
        force = (3.0 * width / chord)[:, None] * deflection_mm
        across = [np.sum(force * axis, axis=1) for axis in (first, second)]
        return np.column_stack([*across, arc / chord])

    def _in_units(self, marched: "_Marched", chord: np.ndarray) -> HeldRod:
        """Return the first of the marched rods, in N and mm. chord (n,): their unit of length, mm."""
        force = marched.force[0]
        moments = -np.cross(marched.contact[0], force)
        per_chord = (self.clamp_rigidity_Nmm2 / chord)[:, None]
        forces_N = force * per_chord / chord[:, None]
        return HeldRod(moments[:, 1:] * per_chord, forces_N, marched.tangent[0])

    def _end_axes(self, arc_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the unloaded tangents (..., 3) at arcs (...), and two directions across each."""
        tangent = self.rest.tangent(arc_mm)
        first = np.array([0.0, 1.0, 0.0]) - tangent[..., 1:2] * tangent
        first = first / np.linalg.norm(first, axis=-1, keepdims=True)
        return tangent, first, np.cross(tangent, first)

    @staticmethod
    def _with_differences(unknowns: np.ndarray) -> np.ndarray:
        """Return unknowns (4, n, 3): as they are, and each moved by a small step."""
        tried = np.repeat(unknowns[None], 4, axis=0)
        for k in range(3):
            tried[k + 1, :, k] += _DIFFERENCE
        return tried

    def _march(self, unknowns: np.ndarray, friction: np.ndarray, chord: np.ndarray) -> "_Marched":
        """Return rods that are marched from contact to clamp.

        unknowns (..., n, 3): two components of the force across the rod's end, and the arc; friction,
        chord (n,). While marching, the axes are those in which the rod's end has not turned.
        """
        arc = unknowns[..., 2]
        width = self.width(arc * chord / self.rest.length_mm)
        if np.any(width < _LEAST_WIDTH):
            raise ArithmeticError("the contact is too near the end of a rod that ends in a point")
        if np.any(np.hypot(unknowns[..., 0], unknowns[..., 1]) > _MOST_FORCE * width):
            raise ArithmeticError(_TOO_FAR)
        force = self._force_on_end(unknowns, friction, chord)
        turn, way = self._turn_and_way(arc, chord, force)
        to_hub = np.swapaxes(turn, -1, -2)
        tangent = self.rest.tangent(arc * chord)
        return _Marched(_product(to_hub, way), _product(to_hub, force), _product(to_hub, tangent))

    def _force_on_end(
        self, unknowns: np.ndarray, friction: np.ndarray, chord: np.ndarray
    ) -> np.ndarray:
        """Return the forces (..., n, 3) on the rods' ends, in the axes in which these have not turned."""
        tangent, first, second = self._end_axes(unknowns[..., 2] * chord)
        pull = -friction * np.hypot(unknowns[..., 0], unknowns[..., 1])
        force = pull[..., None] * tangent
        return force + unknowns[..., :1] * first + unknowns[..., 1:2] * second

    def _turn_and_way(
        self, arc: np.ndarray, chord: np.ndarray, force: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Integrate from contact to clamp; return the turn (..., n, 3, 3) and the way (..., n, 3) of each rod.

        arc (..., n): in units of the chord (n,). force (..., n, 3). Raises ArithmeticError.
        """
        from scipy.integrate import solve_ivp  # it takes longer than reading a session

        rods = arc.shape

        def rate(share, state):
            """Return the derivatives of turns and ways by the share of the arc that lies behind, 0 to 1."""
            turn, way = _turns_and_ways(state, rods)
            at_mm = (1.0 - share) * arc * chord
            tangent = _product(turn, self.rest.tangent(at_mm))
            moment = np.cross(way, force)
            bend = self._bend(arc, at_mm, tangent, moment)
            return _state(-_cross_matrices(bend) @ turn, arc[..., None] * tangent)

        not_turned = np.broadcast_to(np.eye(3), (*rods, 3, 3))
        marched = solve_ivp(
            rate,
            (0.0, 1.0),
            _state(not_turned, np.zeros_like(force)),
            t_eval=[1.0],
            method="DOP853",
            rtol=_MARCH_ERROR,
            atol=_MARCH_ERROR,
        )
        if not marched.success:
            raise ArithmeticError(_TOO_FAR)
        return _turns_and_ways(marched.y[:, -1], rods)

    def _bend(
        self, arc: np.ndarray, at_mm: np.ndarray, tangent: np.ndarray, moment: np.ndarray
    ) -> np.ndarray:
        """Return how far sections at at_mm (..., n) turn along an arc (..., n), for moments (..., n, 3) on them."""
        twist = np.sum(tangent * moment, axis=-1, keepdims=True)
        width2 = self.width(at_mm / self.rest.length_mm) ** 2
        return (arc / width2**2)[..., None] * (moment + _POISSON * twist * tangent)


def _cross_matrices(vectors: np.ndarray) -> np.ndarray:
    """Return the matrices (..., 3, 3) that map b to a × b, for vectors a (..., 3)."""
    matrices = np.zeros((*vectors.shape, 3))
    matrices[..., 0, 1] = -vectors[..., 2]
    matrices[..., 0, 2] = vectors[..., 1]
    matrices[..., 1, 0] = vectors[..., 2]
    matrices[..., 1, 2] = -vectors[..., 0]
    matrices[..., 2, 0] = -vectors[..., 1]
    matrices[..., 2, 1] = vectors[..., 0]
    return matrices


def _product(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return the products (..., 3) of matrices (..., 3, 3) and vectors (..., 3)."""
    return (matrices @ vectors[..., None])[..., 0]


def _state(turns: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """Return turns (..., 3, 3) and ways (..., 3) as one vector, for the integration."""
    return np.concatenate([turns.ravel(), ways.ravel()])


def _turns_and_ways(state: np.ndarray, rods: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return turns (*rods, 3, 3) and ways to the contact (*rods, 3) of a state."""
    count = 9 * math.prod(rods)
    return state[:count].reshape(*rods, 3, 3), state[count:].reshape(*rods, 3)
