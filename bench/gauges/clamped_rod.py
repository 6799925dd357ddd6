"""The moment at a rod's clamp from where a contact holds it: exact for large deflections, the bench's own.

A straight rod, clamped at the origin along +x, is held at one point by one force. In the plane of clamp and force the
angle of its tangent obeys EI dpsi/ds = F · (lever of the force about the point at s). The force stands at right angles
to the rod's tangent at the contact, turned by friction along the rod. Gauge calibration rests on this line and not on
the small-angle theory of the estimators, which are to be judged: C d_y/d_x² is off by 0.2 % at 3° and by 1 to 13 % at
12 to 16°.

All is solved in the rod's own units, so that neither stiffness nor size changes how it converges: lengths in the chord
c from the clamp to the contact, forces in EI/c² and moments in EI/c, with EI at the clamp.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import chebyshev

# [points] Of Chebyshev along the rod: the series of a smooth bend has converged before. Twice as many where it has
# not, as near the tip of a cone, where the curvature rises like (1 − s/L)⁻³. Derived.
_NODES = (24, 48, 96, 192)
# [steps] Of Newton's method: from the straight rod to a tangent of 90° in steps of `_LONGEST_STEP_RAD`. Stated.
_MOST_STEPS = 60
# [rad] The most that one step turns a tangent; within it the linear rod foretells the bent one. Stated.
_LONGEST_STEP_RAD = 0.4
# [1] Last step over the unknown that it changes: the next one, by quadratic convergence, is below rounding. Derived.
_LAST_STEP = 1e-9
# [1] Of an arc: step of the difference by which the rigidity's change along the rod is known. Derived.
_ARC_STEP = 1e-6
# [1] What the last tenth of Chebyshev's coefficients of the tangent's angle may be of the largest: rounding, many times
# over. Derived.
_SERIES_END = 1e-10
# [1] The same with the most points, where a moment is still good to a thousandth of what pictures know. Stated.
_LAST_SERIES_END = 1e-6
# [1] Deflection over distance up to which a rod is asked: a whisker bent more slides off. Stated.
_MOST_ASIDE = 0.6


@dataclass(frozen=True, eq=False)
class ClampLoad:
    """What holds n rods at their contacts.

    moment_Nmm (n,): size of the moment at the clamp. force_N (2, n): on the contact, along the clamp's axis and
    across it. end_rad (n,): angle of the tangent at the contact.
    """

    moment_Nmm: np.ndarray
    force_N: np.ndarray
    end_rad: np.ndarray


def load_at_clamp(
    along_mm: float | np.ndarray,
    across_mm: float | np.ndarray,
    rigidity_Nmm2: Callable,
    friction: float | np.ndarray = 0.0,
) -> ClampLoad:
    """Return what holds rods at their contacts.

    along_mm, across_mm (n,): where the contacts lie. rigidity_Nmm2: EI as a function of arc lengths
    (n, nodes) in mm. friction: friction over normal force along the rod at the contact, one or
    (n,), positive where it pulls towards the clamp. Raises ArithmeticError where the contact is not
    in front of the clamp, the rod would have to bend by more than about 45°, or no equilibrium is
    found.
    """
    x = np.atleast_1d(np.asarray(along_mm, dtype=float))
    w = np.atleast_1d(np.asarray(across_mm, dtype=float))
    if not (np.all(x > 0) and np.all(np.abs(w) < _MOST_ASIDE * x)):
        raise ArithmeticError(
            "the contact must lie in front of the clamp, less than 0.6 of its distance aside"
        )
    rods = _Rods.at(x, w, rigidity_Nmm2, friction)
    angle, force = _resolved_equilibrium(rods)
    direction = _force_direction(angle[:, -1], rods.friction)
    moment = np.abs(force * _cross(rods.contact, direction))
    per_chord_N_mm = rods.clamp_rigidity_Nmm2 / rods.chord_mm
    force_N = force * direction * per_chord_N_mm / rods.chord_mm
    return ClampLoad(moment * per_chord_N_mm, force_N, angle[:, -1])


def _resolved_equilibrium(rods: "_Rods") -> tuple[np.ndarray, np.ndarray]:
    """Return angles (n, nodes) and forces (n,) of rods, with as many nodes as their bend needs.

    Raises ArithmeticError where the most nodes do not suffice.
    """
    for count in _NODES:
        angle, force = rods.equilibrium(_nodes(count))
        end = _series_end(angle)
        if end <= _SERIES_END:
            break
    if not end <= _LAST_SERIES_END:
        raise ArithmeticError(
            "no equilibrium found: the contact is too near the end of a rod that ends in a point"
        )
    return angle, force


@dataclass(frozen=True)
class _Nodes:
    """Chebyshev–Lobatto points on 0 … 1, as shares of an arc.

    at (nodes,). from_clamp, to_contact (nodes, nodes): matrices that turn values at the points into
    integrals from 0 to each and from each to 1.
    """

    at: np.ndarray
    from_clamp: np.ndarray
    to_contact: np.ndarray


@cache
def _nodes(count: int) -> _Nodes:
    """Make so many points with their matrices."""
    points = -np.cos(np.pi * np.arange(count) / (count - 1))
    coefficients = np.linalg.inv(chebyshev.chebvander(points, count - 1))
    antiderivatives = chebyshev.chebint(coefficients, lbnd=-1)
    from_clamp = 0.5 * chebyshev.chebvander(points, count) @ antiderivatives
    return _Nodes(0.5 * (1.0 + points), from_clamp, from_clamp[-1] - from_clamp)


def _series_end(angle: np.ndarray) -> float:
    """Return how large the last tenth of Chebyshev's coefficients of angles (n, nodes) is, over the largest."""
    count = angle.shape[1]
    points = -np.cos(np.pi * np.arange(count) / (count - 1))
    sizes = np.abs(np.linalg.solve(chebyshev.chebvander(points, count - 1), angle.T))
    largest = sizes.max(axis=0)
    last = sizes[-(count // 10) :].max(axis=0)
    return float(np.max(last / np.where(largest > 0, largest, 1.0)))


@dataclass(frozen=True)
class _Rods:
    """Rods in their own units: contact (2, n) in chords, along and across; friction (n,).

    chord_mm, clamp_rigidity_Nmm2 (n,): the units. rigidity_Nmm2: function of arc lengths (n, nodes).
    """

    contact: np.ndarray
    friction: np.ndarray
    chord_mm: np.ndarray
    clamp_rigidity_Nmm2: np.ndarray
    rigidity_Nmm2: Callable

    @classmethod
    def at(cls, x, w, rigidity_Nmm2, friction) -> "_Rods":
        """Make the rods whose contacts lie at x, w (n,), mm."""
        chord = np.hypot(x, w)
        at_clamp = rigidity_Nmm2(np.zeros((len(x), 1)))[:, 0]
        friction = np.broadcast_to(np.asarray(friction, float), x.shape)
        return cls(np.stack([x, w]) / chord, friction, chord, at_clamp, rigidity_Nmm2)

    def equilibrium(self, nodes: _Nodes) -> tuple[np.ndarray, np.ndarray]:
        """Solve for the tangent's angles (n, nodes), rad, and the forces (n,), EI/c².

        Newton's method, all rods together, from the straight rod: its first step is the small-angle
        answer. Raises ArithmeticError where it does not converge.
        """
        count = len(nodes.at)
        unknowns = np.zeros((len(self.chord_mm), count + 2))  # angles, force, arc
        unknowns[:, -1] = 1.0
        for _ in range(_MOST_STEPS):
            step = self._newton_step(unknowns, nodes)
            turn = np.abs(step[:, :count]).max(axis=1)
            if not np.isfinite(turn).all():
                break
            part = np.minimum(1.0, _LONGEST_STEP_RAD / np.maximum(turn, _LONGEST_STEP_RAD))
            unknowns = unknowns + part[:, None] * step
            if _has_converged(step, unknowns):
                return unknowns[:, :count], unknowns[:, count]
        raise ArithmeticError("no equilibrium found of a rod that is bent so far")

    def _newton_step(self, unknowns: np.ndarray, nodes: _Nodes) -> np.ndarray:
        """Return Newton's step (n, nodes + 2) of angles, force and arc."""
        count = len(nodes.at)
        residual = np.empty_like(unknowns)
        jacobian = np.zeros((*unknowns.shape, count + 2))
        residual[:, :count], jacobian[:, :count] = self._bending(unknowns, nodes)
        residual[:, count:], jacobian[:, count:] = self._closure(unknowns, nodes)
        try:
            return -np.linalg.solve(jacobian, residual[:, :, None])[:, :, 0]
        except np.linalg.LinAlgError:
            raise ArithmeticError("no equilibrium found of a rod that is bent so far") from None

    def _bending(self, unknowns: np.ndarray, nodes: _Nodes) -> tuple[np.ndarray, np.ndarray]:
        """Return by how much the angles (n, nodes) are not those of the force's bend, and the
        derivatives (n, nodes, nodes + 2) by the unknowns.
        """
        count = len(nodes.at)
        angle = unknowns[:, :count]
        force = unknowns[:, count, None]
        arc = unknowns[:, count + 1, None]
        bend, bend_by_angle, bend_by_arc = self._unit_bend(angle, arc, nodes)
        scale = force * arc**2
        derivatives = np.empty((*angle.shape, count + 2))
        derivatives[:, :, :count] = np.eye(count) - scale[:, :, None] * bend_by_angle
        derivatives[:, :, count] = -(arc**2) * bend
        derivatives[:, :, count + 1] = -force * (2.0 * arc * bend + arc**2 * bend_by_arc)
        return angle - scale * bend, derivatives

    def _unit_bend(
        self, angle: np.ndarray, arc: np.ndarray, nodes: _Nodes
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the bend (n, nodes) for each unit of force · arc², and its derivatives by the
        angles (n, nodes, nodes) and by the arc (n, nodes).
        """
        softness, softness_by_arc = self._softness(arc, nodes)
        lever, lever_by_angle = self._lever(np.cos(angle), np.sin(angle), nodes)
        bend = (lever * softness) @ nodes.from_clamp.T
        by_angle = nodes.from_clamp @ (softness[:, :, None] * lever_by_angle)
        by_arc = (lever * softness_by_arc) @ nodes.from_clamp.T
        return bend, by_angle, by_arc

    def _closure(self, unknowns: np.ndarray, nodes: _Nodes) -> tuple[np.ndarray, np.ndarray]:
        """Return how far (n, 2) the rod's end is from the contact, along and across, and the
        derivatives (n, 2, nodes + 2) by the unknowns.
        """
        count = len(nodes.at)
        c = np.cos(unknowns[:, :count])
        s = np.sin(unknowns[:, :count])
        arc = unknowns[:, count + 1, None]
        weights = nodes.from_clamp[-1]
        end = np.stack([c @ weights, s @ weights], axis=1)  # of a rod of unit arc
        derivatives = np.zeros((len(unknowns), 2, count + 2))
        derivatives[:, 0, :count] = -arc * weights * s
        derivatives[:, 1, :count] = arc * weights * c
        derivatives[:, :, count + 1] = end
        return arc * end - self.contact.T, derivatives

    def _softness(self, arc: np.ndarray, nodes: _Nodes) -> tuple[np.ndarray, np.ndarray]:
        """Return EI at the clamp over EI (n, nodes) at the points of arcs (n, 1), and its derivative by these."""
        at_mm = self.chord_mm[:, None] * nodes.at * arc
        shorter = self._softness_at(at_mm * (1.0 - _ARC_STEP))
        longer = self._softness_at(at_mm * (1.0 + _ARC_STEP))
        by_arc = (longer - shorter) / (2.0 * _ARC_STEP * arc)
        return self._softness_at(at_mm), by_arc

    def _softness_at(self, at_mm: np.ndarray) -> np.ndarray:
        """Return EI at the clamp over EI at arc lengths (n, nodes)."""
        return self.clamp_rigidity_Nmm2[:, None] / self.rigidity_Nmm2(at_mm)

    def _lever(self, c: np.ndarray, s: np.ndarray, nodes: _Nodes) -> tuple[np.ndarray, np.ndarray]:
        """Return the force's lever (n, nodes) about each point, in arcs, and its derivatives (n, nodes, nodes).

        c, s (n, nodes): cosine and sine of the tangent's angle.
        """
        mu = self.friction[:, None]
        x = -s[:, -1:] - mu * c[:, -1:]  # the force's direction, (n, 1)
        y = c[:, -1:] - mu * s[:, -1:]
        along = c @ nodes.to_contact.T
        across = s @ nodes.to_contact.T
        lever = along * y - across * x
        lever_by = -nodes.to_contact * (s * y + c * x)[:, None, :]
        lever_by[:, :, -1] += along * x + across * y
        return lever, lever_by


def _has_converged(step: np.ndarray, unknowns: np.ndarray) -> bool:
    """Return whether the last step (n, nodes + 2) is nothing against the unknowns that it led to.

    A straight rod has neither angle nor force.
    """
    turn = np.abs(step[:, :-2]).max(axis=1) <= _LAST_STEP * np.abs(unknowns[:, :-2]).max(axis=1)
    rest = np.abs(step[:, -2:]) <= _LAST_STEP * np.abs(unknowns[:, -2:])
    return bool(turn.all() and rest.all())


def _force_direction(end_angle: np.ndarray, friction: np.ndarray) -> np.ndarray:
    """Return the direction (2, n) of the force: at right angles to the rod's end, and along it."""
    c, s = np.cos(end_angle), np.sin(end_angle)
    return np.stack([-s - friction * c, c - friction * s])


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the cross product of plane vectors (2, ...)."""
    return a[0] * b[1] - a[1] * b[0]
