"""The whisker's centreline in space: its rest shape, rotated with the motor, and the bend of one
point force.

Hub frame: origin at the base, x along the clamped whisker, z the rotation axis; it rotates with the
motor. A round rod that is pushed at one point bends in the plane of its tangent and the force; its
tangent angle grows as the integral of (contact - s)/EI(s) up to the contact and stays constant
beyond. For a uniform rod that is 2u - u², u = s/contact. The force stands across the whisker at the
contact, so that a bent rod has shorter levers towards its base: the bend's square adds what
`bend_growth` says, and so does friction along it. A whisker that is curved without load leaves that
plane and twists: its sections turn as a straight one's do, and by the difference of the curvatures
that the force makes of the two, bent alike (one step of Picard's from the straight rod).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.rods import Wire

# [terms] A layout: offset, slope, curvature and its change, each across (y) and along the axis (z).
# Study: exactness.py.
REST_POWERS = 4
# [nodes] Of 100 mm: a bend of 0.4 rad is within 0.00002 mm of that with 641 (0.0003 mm with 21,
# 0.004 with 11). Study: exactness.py.
_NODES = 41
# [1] Square of the tangent's part along the base: where it would turn back it goes on at 84°
# instead, so that a fit's wild step stays finite. Stated.
_LEAST_FORWARD2 = 0.01
# [rad] Least bend whose direction is asked for. Derived.
_LEAST_BEND_RAD = 1e-12
# [1] EI over the torsional rigidity of a round rod, less one, is Poisson's ratio: of metals and of
# polymers. Stated.
TORSION_OVER_BENDING = 0.35

# Components x, y, z, each (…, m) or a number.
_Vectors = tuple[np.ndarray | float, np.ndarray | float, np.ndarray | float]


def tangent_growth(
    arc_mm: float | np.ndarray, contact_mm: float | np.ndarray, wire: Wire
) -> np.ndarray:
    """Return the share (…) of the final tangent angle reached at an arc length, for small bends: 0
    at the base, 1 from the contact on.
    """
    turn = wire.turn(np.minimum(arc_mm, contact_mm), contact_mm)
    return turn / wire.turn(contact_mm, contact_mm)


def bend_growth(
    turn_rad: np.ndarray,
    pull: np.ndarray | float,
    arc_mm: np.ndarray,
    contact_mm: np.ndarray,
    wire: Wire,
) -> np.ndarray:
    """Return the share (…, m) of the final tangent angle turn_rad (…, 1) reached at the nodes of a
    curve, arc_mm (m,).

    The force at contact_mm (…, 1) is across the tangent there, and along it pull (…, 1) times as
    strong, towards the tip: EI ψ'' = −F cos(ψ − B) − P sin(ψ − B), B = turn_rad. To the second
    order in bend and pull, with g the share by small bends, the lever ∫ ds from s to the contact is
    shorter by ∫ B² (1 − g)²/2 − P/F B (1 − g) ds. Of a uniform rod the share grows by B² (w⁶ −
    w²)/30 and less so P/F B (w⁴ − w²)/6, w = 1 − u: within 3 µm at B = 0.6 and 60 mm.
    """
    growth = tangent_growth(arc_mm, contact_mm, wire)
    if wire.is_uniform:
        w2 = np.maximum(1.0 - arc_mm / contact_mm, 0.0) ** 2
        by_bend = turn_rad / 30.0 * (w2**2 - 1.0)
        by_pull = pull / 6.0 * (w2 - 1.0)
        return growth + w2 * turn_rad * (by_bend - by_pull)
    return growth + _growth_of_taper(growth, turn_rad, pull, arc_mm, contact_mm, wire)


def _growth_of_taper(
    growth: np.ndarray,
    turn_rad: np.ndarray,
    pull: np.ndarray | float,
    arc_mm: np.ndarray,
    contact_mm: np.ndarray,
    wire: Wire,
) -> np.ndarray:
    """Return what large bends and pull add to the growth (…, m) of a tapering rod by small bends.

    Arguments are as of `bend_growth`.
    """
    integral = simpson().T * arc_mm[1]  # (m, m) mm: from the base to each node
    remaining_rad = turn_rad * (1.0 - growth)
    shortening_mm = (0.5 * remaining_rad - pull) * remaining_rad @ integral
    softness = np.where(arc_mm < contact_mm, wire.width(arc_mm) ** -4.0, 0.0)
    lost_turn = softness * (shortening_mm[..., -1:] - shortening_mm) @ integral
    whole_turn = wire.turn(contact_mm, contact_mm)
    return (growth * lost_turn[..., -1:] - lost_turn) / whole_turn


@dataclass(frozen=True)
class Curves:
    """Centrelines as nodes: arc_mm (m,), points and tangents (…, m, 3), in the frame they were made
    for.
    """

    arc_mm: np.ndarray
    points_mm: np.ndarray
    tangents: np.ndarray

    def at(self, arc_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Interpolate points and (unnormalised) tangents (…, k, 3) at arc lengths (k,) or (…, k),
        by cubic Hermite segments.
        """
        lead = self.points_mm.shape[:-2]
        k, t = self._segment(np.broadcast_to(arc_mm, (*lead, np.shape(arc_mm)[-1])))
        curve = np.arange(np.prod(lead, dtype=int)).reshape(lead)[..., None]
        p0, p1, m0, m1 = self._ends((-1, 3), curve * len(self.arc_mm) + k)
        u = 1.0 - t
        tangents = (
            (6.0 * t * u / self._step_mm) * (p1 - p0)
            + (u * (1.0 - 3.0 * t)) * m0
            - (t * (2.0 - 3.0 * t)) * m1
        )
        return self._point_between(t, p0, p1, m0, m1), tangents

    def one(self, k: int) -> "Curves":
        """Return the k-th of curves (f, m, 3)."""
        return Curves(self.arc_mm, self.points_mm[k], self.tangents[k])

    def at_one_each(self, which: np.ndarray, arc_mm: np.ndarray) -> np.ndarray:
        """Interpolate points (…, n, 3), each on its own curve: which (n,) of the curves (…, f), at
        arc lengths (n,).
        """
        k, t = self._segment(np.asarray(arc_mm))
        one_row = (*self.points_mm.shape[:-3], -1, 3)
        return self._point_between(t, *self._ends(one_row, which * len(self.arc_mm) + k))

    def _ends(self, shape: tuple[int, ...], node: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return points and tangents at both ends of segments: two points, two tangents.

        shape: (…, nodes, 3), all curves in one row. node: of the segments' beginnings in that row.
        """
        points = self.points_mm.reshape(shape)
        tangents = self.tangents.reshape(shape)
        p0 = points.take(node, axis=-2)
        p1 = points.take(node + 1, axis=-2)
        m0 = tangents.take(node, axis=-2)
        m1 = tangents.take(node + 1, axis=-2)
        return p0, p1, m0, m1

    @property
    def _step_mm(self) -> float:
        """Return the distance between two nodes."""
        return self.arc_mm[1] - self.arc_mm[0]

    def _segment(self, arc_mm):
        """Return the number of the segment of each arc length (…), and the place in it (…, 1), from
        0 to 1.
        """
        steps = arc_mm / self._step_mm
        k = np.clip(steps.astype(int), 0, len(self.arc_mm) - 2)
        return k, (steps - k)[..., None]

    def _point_between(self, t, p0, p1, m0, m1):
        """Interpolate points at t (…, 1) within a segment, from points and tangents at its ends."""
        u = 1.0 - t
        return (
            (u * u * (1.0 + 2.0 * t)) * p0
            + (t * t * (3.0 - 2.0 * t)) * p1
            + (self._step_mm * t * u) * (u * m0 - t * m1)
        )


def centrelines(
    rest_mm: np.ndarray,
    bend_rad: np.ndarray,
    contact_mm: np.ndarray,
    motor_rad: np.ndarray,
    wire: Wire,
    pull: np.ndarray | float = 0.0,
) -> Curves:
    """Return the centrelines in the rig frame of batches of shapes.

    rest_mm (…, 2, k): polynomials in s/length, (y, z), beyond the wire's own; bend_rad (…, 2): the tangent angle at the
    contact, (y, z) components, hub frame; contact_mm (…): arc length of the contact; motor_rad (…);
    pull (…): force along the whisker at the contact over that across it, towards the tip.
    """
    rest_mm = np.asarray(rest_mm)
    arc = _nodes_mm(wire)
    rest_tangents = _rest_tangents(rest_mm, arc, wire)
    bend = _Bend.of(np.asarray(bend_rad), np.asarray(pull), arc, np.asarray(contact_mm), wire)
    tangents = np.stack(np.broadcast_arrays(*bend.turned(rest_tangents)), axis=-1)
    return _in_rig(arc, tangents, rest_mm, motor_rad)


def unbent_centrelines(rest_mm: np.ndarray, motor_rad: np.ndarray, wire: Wire) -> Curves:
    """Return the `centrelines` of whiskers that nothing bends, for a third of the work.

    rest_mm (…, 2, k): polynomials in s/length, (y, z), beyond the wire's own; motor_rad (…).
    """
    rest_mm = np.asarray(rest_mm)
    arc = _nodes_mm(wire)
    return _in_rig(arc, _rest_tangents(rest_mm, arc, wire), rest_mm, motor_rad)


def _nodes_mm(wire: Wire) -> np.ndarray:
    """Return the arc lengths (m,) of a curve's nodes, mm."""
    return np.linspace(0.0, wire.length_mm, _NODES)


def _rest_tangents(rest_mm: np.ndarray, arc_mm: np.ndarray, wire: Wire) -> np.ndarray:
    """Return the unit tangents (…, m, 3) of rest shapes (…, 2, k), mm, at arcs (m,)."""
    share = arc_mm / wire.length_mm
    own_slope = rest_slope(np.array(wire.rest_mm), share)
    return _tangents((rest_slope(rest_mm, share) + own_slope) / wire.length_mm)


def _in_rig(
    arc_mm: np.ndarray, tangents: np.ndarray, rest_mm: np.ndarray, motor_rad: np.ndarray
) -> Curves:
    """Return the curves in the rig frame of tangents (…, m, 3) in the hub's.

    rest_mm (…, 2, k): rest shapes, which say where they begin. motor_rad (…).
    """
    points = simpson() @ tangents * arc_mm[1]
    points[..., 1:] += rest_mm[..., None, :, 0]
    rotation = np.swapaxes(rotation_z(motor_rad), -1, -2)
    return Curves(arc_mm, points @ rotation, tangents @ rotation)


def _tangents(lateral: np.ndarray) -> np.ndarray:
    """Return tangents (…, m, 3) with these y and z (…, m, 2): unit, where they do not turn back."""
    forward2 = np.maximum(1.0 - np.sum(lateral**2, axis=-1, keepdims=True), _LEAST_FORWARD2)
    return np.concatenate([np.sqrt(forward2), lateral], axis=-1)


@dataclass(frozen=True, eq=False)
class _Bend:
    """The bend of one point force, at the nodes of a curve.

    axis: y and z of the unit vector about which a straight whisker turns, each (…, 1), and
    straight_rad (…, m), by how much. strength (…, 1): the force in base stiffnesses. pull (…, 1):
    as of `centrelines`. softness (m,): base stiffness over that at a node. before (…, m): 1 before
    the contact, 0 past it. at_contact (…, m): weights of the nodes that give a value there.
    """

    axis: tuple[np.ndarray, np.ndarray]
    straight_rad: np.ndarray
    strength: np.ndarray
    pull: np.ndarray
    softness: np.ndarray
    before: np.ndarray
    at_contact: np.ndarray
    step_mm: float

    @classmethod
    def of(
        cls,
        bend_rad: np.ndarray,
        pull: np.ndarray,
        arc_mm: np.ndarray,
        contact_mm: np.ndarray,
        wire: Wire,
    ) -> "_Bend":
        """Return the bend with arguments as of `centrelines`; arc_mm (m,): of the nodes."""
        turn = np.linalg.norm(bend_rad, axis=-1)[..., None]
        direction = bend_rad / np.maximum(turn, _LEAST_BEND_RAD)
        contact_mm = contact_mm[..., None]
        pull = pull[..., None]
        step_mm = arc_mm[1]
        steps_to_contact = (contact_mm - arc_mm) / step_mm
        return cls(
            axis=(-direction[..., 1:], direction[..., :1]),
            straight_rad=turn * bend_growth(turn, pull, arc_mm, contact_mm, wire),
            strength=turn / wire.turn(contact_mm, contact_mm),
            pull=pull,
            softness=wire.width(arc_mm) ** -4.0,
            before=np.clip(steps_to_contact + 0.5, 0.0, 1.0),
            at_contact=np.maximum(1.0 - np.abs(steps_to_contact), 0.0),
            step_mm=step_mm,
        )

    def turned(self, rest_tangents: np.ndarray) -> _Vectors:
        """Return the tangents of a whisker whose tangents without load are rest_tangents (…, m, 3)."""
        rest = (rest_tangents[..., 0], rest_tangents[..., 1], rest_tangents[..., 2])
        about_y, about_z = self.axis
        straight = self._planar_curvature()
        turn = (0.0, self.straight_rad * about_y, self.straight_rad * about_z)
        x, y, z = self._curvature(_rotated(turn, rest))
        added = (x, y - straight * about_y, z - straight * about_z)
        added_rad = self._integrals(added)
        whole = _sum(turn, added_rad)
        # Turns about different axes do not add up: the second term of Magnus' series.
        half_rad = self._integrals(_cross((x, y, z), whole))
        return _rotated(_sum(whole, tuple(0.5 * one for one in half_rad)), rest)

    def _planar_curvature(self) -> np.ndarray:
        """Return the curvature (…, m), 1/mm, that the force makes of a straight whisker so bent."""
        tangents = (np.cos(self.straight_rad), np.sin(self.straight_rad))
        lever_x, lever_y = self._levers(tangents)
        along_x, along_y = self._at_contact(tangents)
        force_x = self.pull * along_x - along_y
        force_y = self.pull * along_y + along_x
        moment = lever_x * force_y - lever_y * force_x
        return self.strength * self.softness * self.before * moment

    def _curvature(self, tangents: _Vectors) -> _Vectors:
        """Return the curvature, 1/mm, and the twist that the force makes of a whisker so bent."""
        lever = self._levers(tangents)
        along = self._at_contact(tangents)
        across = _cross((0.0, *self.axis), along)
        norm = np.sqrt(_dot(across, across))
        norm = np.maximum(norm, _LEAST_BEND_RAD)
        force = tuple(a / norm + self.pull * t for a, t in zip(across, along))
        moment = _cross(lever, force)
        twist = TORSION_OVER_BENDING * _dot(moment, tangents)
        scale = self.strength * self.softness * self.before
        return tuple(scale * (m + twist * t) for m, t in zip(moment, tangents))

    def _integrals(self, vectors: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
        """Return the integrals of components (…, m) from the base to each node."""
        return tuple(one @ simpson().T * self.step_mm for one in vectors)

    def _levers(self, tangents: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
        """Return components (…, m) of the way from each node to the contact, mm."""
        points = self._integrals(tangents)
        return tuple(at - one for at, one in zip(self._at_contact(points), points))

    def _at_contact(self, vectors: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
        """Return components (…, 1) at the contact."""
        return tuple(np.sum(self.at_contact * one, axis=-1, keepdims=True) for one in vectors)


def _rotated(turn_rad: _Vectors, vectors: _Vectors) -> _Vectors:
    """Return vectors rotated by rotation vectors."""
    angle = np.sqrt(_dot(turn_rad, turn_rad))
    sine = np.sinc(angle / np.pi)
    versine = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    first = _cross(turn_rad, vectors)
    second = _cross(turn_rad, first)
    return tuple(v + sine * a + versine * b for v, a, b in zip(vectors, first, second))


def _cross(a: _Vectors, b: _Vectors) -> _Vectors:
    """Return the vector products."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def _dot(a: _Vectors, b: _Vectors) -> np.ndarray:
    """Return the scalar products."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _sum(a: _Vectors, b: _Vectors) -> _Vectors:
    """Return the sums."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@lru_cache
def simpson() -> np.ndarray:
    """Return the matrix (m, m) that integrates values at the nodes of a curve, one apart, from the
    first node to each: by the parabola through three nodes, over its first and its second half by
    turns; over the last step its second half.

    As `scipy.integrate.cumulative_simpson`, which takes an eighth of a second to load.
    """
    first_half = np.array([5.0, 8.0, -1.0]) / 12.0
    second_half = first_half[::-1]
    steps = np.zeros((_NODES, _NODES))
    for k in range(_NODES - 1):
        if k % 2 == 0 and k + 2 < _NODES:
            steps[k + 1, k : k + 3] = first_half
        else:
            steps[k + 1, k - 1 : k + 2] = second_half
    return np.cumsum(steps, axis=0)


def rest_slope(rest_mm: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return the slopes (…, m, 2) of a rest shape (…, 2, k) by u = s/length (m,)."""
    powers = np.stack([k * u ** max(k - 1, 0) for k in range(rest_mm.shape[-1])], axis=-1)
    return powers @ np.swapaxes(rest_mm, -1, -2)


def whole_rest_mm(rest_mm: np.ndarray, wire: Wire) -> np.ndarray:
    """Return a fit's rest shape (2, k) together with what is stated of the wire, (2, l)."""
    own = np.array(wire.rest_mm)
    whole = np.zeros((2, max(own.shape[1], rest_mm.shape[1])))
    whole[:, : rest_mm.shape[1]] += rest_mm
    whole[:, : own.shape[1]] += own
    return whole


def rotation_z(angle_rad: float | np.ndarray) -> np.ndarray:
    """Return rotation matrices (…, 3, 3) about z."""
    cosine = np.cos(angle_rad)
    sine = np.sin(angle_rad)
    R = np.zeros((*np.shape(angle_rad), 3, 3))
    R[..., 0, 0] = cosine
    R[..., 0, 1] = -sine
    R[..., 1, 0] = sine
    R[..., 1, 1] = cosine
    R[..., 2, 2] = 1.0
    return R


def unbent_curves(
    rest_mm: np.ndarray, motor_rad: Mapping[int, float], wire: Wire
) -> dict[int, Curves]:
    """Return the centrelines of an unbent wire by frame; motor_rad: motor angle by frame."""
    curves = {}
    for frame, angle in motor_rad.items():
        curves[frame] = unbent_centrelines(rest_mm, angle, wire)
    return curves


def resting_lines(camera: Camera, wire: Wire, motor_rad: np.ndarray) -> list[np.ndarray]:
    """Return lines (m, 2) px in one camera of a straight, unbent wire at each of the motor angles
    (n,).
    """
    curves = unbent_curves(np.zeros((2, REST_POWERS)), dict(enumerate(motor_rad)), wire)
    return [camera.project(curve.points_mm) for curve in curves.values()]


def is_before(camera: Camera, wire: Wire, motor_rad: np.ndarray) -> bool:
    """Return whether a straight wire is before the camera over its whole stroke; motor_rad (n,)."""
    ends = resting_lines(camera, wire, [np.min(motor_rad), np.max(motor_rad)])
    return bool(np.all(np.isfinite(ends)))
