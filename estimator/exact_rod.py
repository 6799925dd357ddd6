"""The exact model inverted: distance, slope and force of a contact from the moments at the base.

A rod of any unloaded shape and taper, however far it bends, pushes against a straight bar that stands at
right angles to the base's direction at first touch. Sections turn by Q from the unloaded shape, of
tangents t₀: t = Q t₀, Q' = [κ]× Q, κ = (m + ν t (t·m))/EI, m = p × F, with p the way to the contact. From
the contact, where p = 0, the rod is marched to its base.

Unknown are the force at the contact, its arc, and the heading of the contact's motion over the bar. Five
equations hold:

- both moments at the base are those felt;
- along the rod the force is what friction, which is against the motion, and the taper explain;
- the bar is the one that the unloaded rod first touched; its slope follows from force and α_est as in (9);
- the heading is that of the path at its end.

A curved rod is drawn along itself as it begins to slide, a straight one later, so that the path is not known
by its end alone. Force and arc halfway through the push are unknown, too: friction, against the mean motion,
explains the force along the rod there, and the same bar is touched, with its slope and at its place. The path
is the parabola through first touch, halfway and the end.

All is solved in the rod's own units: lengths in the whisker's, forces in EI/L², moments in EI/L.
"""

from dataclasses import dataclass, fields
from functools import lru_cache
from math import nan

import numpy as np
from numpy.polynomial import polynomial

from estimator import first_order
from estimator.beam import Beam
from estimator.distance import with_friction
from estimator.numerics import differences, runge_kutta, steps_each_way
from estimator.reasons import NamedReason
from estimator.vectors import cross, cross_matrices, dot, turned_about_z

UNCONVERGED = NamedReason(
    "rod_unconverged",
    "no bent rod has these moments, at this friction angle, up to 97 % of the whisker",
)
# [1] EI over the torsional rigidity, less one, is Poisson's ratio: of metals and of polymers. Stated.
_POISSON = 0.35
# [steps] Of Runge and Kutta's fourth order from contact to base. Study: exact_rod.py.
_STEPS = 12
# [1] Unknowns: force, arc, and heading of the motion from sideways; force and arc halfway. Derived.
_COUNT = 9
# [places] Of both arcs among them. A layout.
_ARCS = [3, 8]
# [steps] Of Newton's method before it is given up. Stated.
_MOST_ROUNDS = 25
# [1] Shares of the friction angle by which it is let rise. Study: exact_rod_limits.py.
_RISING = (0.0, 0.5, 1.0)
# [1] Last step over the unknowns: the next is smaller by the error of the derivatives. Derived.
_LAST_STEP = 1e-8
# [1] The most that one step changes force or arc, in parts. Stated.
_LONGEST_STEP = 0.3
# [1] Step of central differences in parts: they are off by its square, and by rounding over it and
# over θ. Derived.
_DIFFERENCE = 1e-4
# [1] Part of the whisker up to which a contact is sought: a cone's point bends as if it were nothing.
# Stated.
_FARTHEST = 0.97
# [1] Part of the whisker from which on. Stated.
_NEAREST = 0.01
# [1] Gauss–Legendre on −1…1, of the forward part of an unloaded shape. Derived.
_GAUSS = np.polynomial.legendre.leggauss(12)
# [rounds] Of Newton's method for the arc of first touch, each some tenth as far off. Derived.
_TOUCH_ROUNDS = 10


@dataclass(frozen=True)
class RodContact:
    """The contact of the exact model: distance, mm, and slope, rad; gradients (4,) by θ, m_y, m_z, α_est."""

    d_x_mm: float
    beta_rad: float
    gradient: np.ndarray


@dataclass(frozen=True)
class Reach:
    """What lies between centreline and the bar's axis, mm: radius_mm, and a rod's radius that tapers to the
    contact, of rod_radius_mm at the base.
    """

    radius_mm: float
    rod_radius_mm: float


@lru_cache(maxsize=64)
def contact_by_exact_rod(
    felt: tuple[float, float, float, float], beam: Beam, reach: Reach, held: bool
) -> RodContact | None:
    """Return the contact of θ, m_y, m_z and α_est; None where no bent rod has these.

    held: whether friction holds the contact sideways, and so acts along the rod; the slope is then known
    to α_est only, and returned as that without friction. One that slides by no heading that is found
    hardly slides sideways, and counts as held.
    """
    moment_unit = beam.rigidity_Nmm2 / beam.length_mm
    unit = np.array([1.0, moment_unit, moment_unit, 1.0])
    with np.errstate(all="ignore"):
        solved = _Rod(beam, reach, held).solve(np.array(felt) / unit)
        if solved is None and not held:
            solved = _Rod(beam, reach, True).solve(np.array(felt) / unit)
    if solved is None:
        return None
    d_x, beta, gradient = solved
    return RodContact(d_x * beam.length_mm, beta, gradient * beam.length_mm / unit)


class _Rod:
    """The equations of one whisker in its own units."""

    def __init__(self, beam: Beam, reach: Reach, held: bool):
        """Take the whisker and what lies between it and the bar's axis."""
        self.taper = beam.taper
        self.width = beam.width
        self.width_by_share = beam.width_by_share
        self.held = held
        self.radius = reach.radius_mm / beam.length_mm
        self.rod_radius = reach.rod_radius_mm / beam.length_mm
        self.rest = [np.array(own) / beam.length_mm for own in beam.rest_mm]
        self.slopes = [polynomial.polyder(own) for own in self.rest]

    def tangent(self, arc: np.ndarray) -> np.ndarray:
        """Return unloaded tangents (..., 3) at arcs (...)."""
        y, z = (polynomial.polyval(arc, slope, tensor=False) for slope in self.slopes)
        return np.stack(np.broadcast_arrays(np.sqrt(1.0 - y**2 - z**2), y, z), axis=-1)

    def point(self, arc: np.ndarray) -> np.ndarray:
        """Return unloaded points (..., 3) at arcs (...)."""
        at, weights = _GAUSS
        x = 0.5 * arc * (self.tangent(0.5 * arc[..., None] * (1.0 + at))[..., 0] @ weights)
        y, z = (polynomial.polyval(arc, own, tensor=False) - own[0] for own in self.rest)
        return np.stack(np.broadcast_arrays(x, y, z), axis=-1)

    def solve(self, inputs: np.ndarray) -> tuple[float, float, np.ndarray] | None:
        """Return distance, slope and the distance's gradient (4,) by the inputs θ, m_y, m_z, α_est (4,).

        Where Newton's method ends nowhere, friction is let rise from none; None where it still does not.
        """
        for rising in ((1.0,), _RISING):
            unknowns = self._start(inputs)
            for share in rising:
                unknowns = self._refined(unknowns, inputs * [1.0, 1.0, 1.0, share])
                if unknowns is None:
                    break
            if unknowns is not None:
                return self._solution(unknowns, inputs)
        return None

    def _refined(self, unknowns: np.ndarray, inputs: np.ndarray) -> np.ndarray | None:
        """Return unknowns (9,) that satisfy the equations, by Newton's method; None where it ends nowhere."""
        for _ in range(_MOST_ROUNDS):
            sizes = _sizes(unknowns)
            values, by_unknowns = self._by_unknowns(unknowns, inputs)
            step = _solved(by_unknowns[:_COUNT], -values[:_COUNT])
            part = np.abs(step / sizes).max()
            if not np.isfinite(part):
                return None
            unknowns = unknowns + step * min(1.0, _LONGEST_STEP / max(part, _LONGEST_STEP))
            unknowns[_ARCS] = np.clip(unknowns[_ARCS], _NEAREST, _FARTHEST)
            if part < _LAST_STEP:
                return unknowns
        return None

    def _solution(
        self, unknowns: np.ndarray, inputs: np.ndarray
    ) -> tuple[float, float, np.ndarray]:
        """Return distance, slope and the distance's gradient where the equations hold."""
        values, by_unknowns = self._by_unknowns(unknowns, inputs)
        moment = np.hypot(inputs[1], inputs[2])
        steps = _DIFFERENCE * np.array([inputs[0], moment, moment, 1.0])
        moved = inputs + steps_each_way(steps)
        tried = np.broadcast_to(unknowns, (len(moved), _COUNT))
        by_inputs = differences(self._values(tried, moved), steps)
        change = _solved(by_unknowns[:_COUNT], -by_inputs[:_COUNT])
        gradient = by_inputs[_COUNT] + by_unknowns[_COUNT] @ change
        return float(values[_COUNT]), float(values[_COUNT + 1]), gradient

    def _by_unknowns(
        self, unknowns: np.ndarray, inputs: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return residuals, distance and slope (11,), and their derivatives by the unknowns (11, 9)."""
        steps = _DIFFERENCE * _sizes(unknowns)
        moved = unknowns + steps_each_way(steps)
        values = self._values(moved, np.broadcast_to(inputs, (len(moved), 4)))
        return values[:, 0], differences(values, steps)

    def _start(self, inputs: np.ndarray) -> np.ndarray:
        """Return a guess (9,) of force, arc and heading by (10), or by its tip or middle where it has none; half of
        the force halfway.
        """
        theta, m_y, m_z, alpha = inputs.tolist()
        as_cylinder = with_friction(theta, m_y, m_z, alpha, 3.0)
        arc = 1.0 / (1.0 / as_cylinder + self.taper) if as_cylinder > 0 else 0.5
        arc = min(arc, 0.9)
        turn = 1.5 * np.hypot(m_y, m_z) * arc / 3.0  # of the rod's end
        force = np.array([-turn * np.hypot(m_y, m_z), -m_z, m_y]) / arc
        halfway = force * [0.25, 0.5, 0.5]
        return np.array([*force, arc, 0.0, *halfway, arc])

    def _values(self, unknowns: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """Return the residuals of the nine equations, the distance and the slope (11, n) of n sets of unknowns
        and inputs. Places over θ, so that they count alike however far the push goes.
        """
        theta, m_y, m_z, alpha = inputs.T
        heading = unknowns[:, 4]
        now, halfway = self._bent(unknowns, theta)
        friction = self._friction(alpha, heading)
        beta = _slope(now.force, friction.sideways)
        bar, across = _bar_directions(beta)
        axis = self._axis(now, bar)
        first = self._first_touch(axis[:, 0], bar, now.arc)
        push = _Push(theta, alpha, beta, first)
        heading_halfway, latest = _headings(halfway, now, first, bar, np.copysign(1.0, m_y))
        # The bar has its slope, and its place along the whisker, by the rod as it is now.
        off = (axis - first.axis) / theta[:, None]
        moment = np.hypot(m_y, m_z)
        residuals = [
            (now.moment[:, 1] - m_y) / moment,
            (now.moment[:, 2] - m_z) / moment,
            self._force_along(now, bar, alpha, friction),
            dot(off, across),
            heading if self.held else _wrapped(heading - latest),
            *self._residuals_at(halfway, heading_halfway, push),
        ]
        return np.stack([*residuals, np.linalg.norm(first.point, axis=1), beta])

    def _residuals_at(
        self, bent: "_Bent", heading: np.ndarray, push: "_Push"
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the residuals (n,) of rods halfway, against the bar that is pushed: of its slope, of the
        force along the rod, and of the place of its axis across the bar and along the whisker.
        """
        bar, across = _bar_directions(push.beta)
        friction = self._friction(push.alpha, heading)
        slope = _slope(bent.force, friction.sideways) - push.beta
        force_along = self._force_along(bent, bar, push.alpha, friction)
        off = (self._axis(bent, bar) - push.first.axis) / push.theta[:, None]
        return slope, force_along, dot(off, across), off[:, 0]

    def _force_along(
        self, bent: "_Bent", bar: np.ndarray, alpha: np.ndarray, friction: "_Friction"
    ) -> np.ndarray:
        """Return the residuals (n,) of the force along rods, less what friction and taper give."""
        by_taper = np.cos(alpha) * self._growth(bent.arc)
        return _along(bent, bar) - friction.lengthways - by_taper

    def _bent(self, unknowns: np.ndarray, theta: np.ndarray) -> tuple["_Bent", "_Bent"]:
        """Return the rods of n sets of unknowns at the end of the push, and halfway."""
        count = len(theta)
        forces = np.concatenate([unknowns[:, :3], unknowns[:, 5:8]])
        arcs = np.concatenate([unknowns[:, 3], unknowns[:, 8]])
        point, force, tangent = self._march(forces, arcs)
        turns = np.concatenate([theta, 0.5 * theta])  # from the hub's axes to the contact frame's
        both = _Bent(
            point=turned_about_z(point, turns),
            force=turned_about_z(force, turns),
            tangent=turned_about_z(tangent, turns),
            moment=cross(force, point),
            arc=arcs,
        )
        return both.select(slice(count)), both.select(slice(count, None))

    def _axis(self, bent: "_Bent", bar: np.ndarray) -> np.ndarray:
        """Return the points (n, 3) of the bars' axes that contacts lie before."""
        return bent.point - self._normal(bent.tangent, bar, bent.arc) * self._reach(bent.arc)

    def _friction(self, alpha: np.ndarray, heading: np.ndarray) -> "_Friction":
        """Return the friction of contacts that move with these headings (n,) from sideways, rad.

        A contact that slides has it against its motion, of so large a heading from sideways; one that
        is held sideways has along the rod what holding it leaves, in the mean of slopes.
        """
        if self.held:
            return _Friction(0.0 * alpha, first_order.HELD_SHARE * np.sin(alpha))
        return _Friction(np.sin(alpha) * np.cos(heading), np.sin(alpha) * np.sin(heading))

    def _first_touch(self, x: np.ndarray, bar: np.ndarray, arc: np.ndarray) -> "_FirstTouch":
        """Return where the unloaded rod touches bars (n, 3) whose axes are at x (n,), from arcs (n,)
        nearby.
        """
        for _ in range(_TOUCH_ROUNDS):
            point = self.point(arc)
            tangent = self.tangent(arc)
            axis = point - self._normal(tangent, bar, arc) * self._reach(arc)
            arc = arc + (x - axis[:, 0]) / tangent[:, 0]
        return _FirstTouch(point, axis, arc)

    def _reach(self, arc: np.ndarray) -> np.ndarray:
        """Return the distance (n, 1) between centreline and the bar's axis."""
        return (self.radius + self.rod_radius * self.width(arc))[:, None]

    def _growth(self, arc: np.ndarray) -> np.ndarray:
        """Return the change (n,) of the rod's radius per arc, which its surface's normals have along it."""
        return self.rod_radius * self.width_by_share(arc)

    def _normal(self, tangent: np.ndarray, bar: np.ndarray, arc: np.ndarray) -> np.ndarray:
        """Return the unit normals (n, 3) of rods where they touch bars, towards the base's side of the push."""
        across_both = cross(tangent, bar)
        sine = np.linalg.norm(across_both, axis=1, keepdims=True)  # of the angle between both
        square = across_both / sine
        along = cross(bar, square)
        lean = self._growth(arc)[:, None] / sine  # of a tapered rod's surface
        return np.sqrt(1.0 - lean**2) * square + lean * along

    def _march(
        self, force: np.ndarray, arc: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """March rods from their contacts at arcs (n,) to the base; return contacts, forces, and tangents
        there (n, 3), in the hub's axes. force (n, 3): in the axes in which the rod's end has not turned.

        Steps are even in the logarithm of the closest cone's width, so that a cone's thin end has its share of them.
        """
        at, per_march = self._nodes(arc)
        rest = self.tangent(at)[..., None]
        way = per_march[..., None] / _STEPS
        march = _March(force, rest, way, softness=way / self.width(at[..., None]) ** 4)
        # At the contact: not turned, and no way from there.
        at_contact = np.broadcast_to(np.eye(3, 4), (len(arc), 3, 4))
        at_base = runge_kutta(march.gain, at_contact, _STEPS)
        to_hub = np.swapaxes(at_base[..., :3], 1, 2)
        in_march = np.stack([at_base[..., 3], force, rest[0, :, :, 0]], axis=2)
        contact, turned_force, tangent = np.moveaxis(to_hub @ in_march, 2, 0)
        return contact, turned_force, tangent

    def _nodes(self, arc: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the arcs (2 steps + 1, n) of the march's nodes from contacts at arcs (n,) to the base, and
        the way there by a unit of the march.
        """
        parts = np.linspace(1.0, 0.0, 2 * _STEPS + 1)[:, None]
        if self.taper > 0:
            log_width = np.log1p(-self.taper * arc)
            at = -np.expm1(log_width * parts) / self.taper
            return at, -log_width / self.taper * (1.0 - self.taper * at)
        at = arc * parts
        return at, np.broadcast_to(arc, at.shape)


@dataclass(frozen=True, eq=False)
class _March:
    """n rods on the march from their contacts to the base, over nodes at the ends and middles of its steps.

    force (n, 3): at the contacts. rest (nodes, n, 3, 1): unloaded tangents. way (nodes, n, 1): of the arc, in
    a step. softness (nodes, n, 1): turn by a step per moment.
    """

    force: np.ndarray
    rest: np.ndarray
    way: np.ndarray
    softness: np.ndarray

    def gain(self, place: float, pose: np.ndarray) -> np.ndarray:
        """Return what turns and ways (n, 3, 4) gain in a step towards the base; place: in steps from the contact."""
        node = int(2 * place)
        turn = pose[..., :3]
        tangent = (turn @ self.rest[node])[..., 0]
        moment = cross(pose[..., 3], self.force)
        twist = _POISSON * dot(tangent, moment)[:, None] * tangent
        curvature = self.softness[node] * (moment + twist)
        gained_turn = -cross_matrices(curvature) @ turn
        gained_way = self.way[node] * tangent
        return np.concatenate([gained_turn, gained_way[..., None]], axis=2)


@dataclass(frozen=True, eq=False)
class _Bent:
    """Contacts, forces and tangents (n, 3) of bent rods in the contact frame's axes; moments (n, 3) at the base in the
    hub's; arcs (n,).
    """

    point: np.ndarray
    force: np.ndarray
    tangent: np.ndarray
    moment: np.ndarray
    arc: np.ndarray

    def select(self, which: slice) -> "_Bent":
        """Return some of the rods."""
        return _Bent(*(getattr(self, field.name)[which] for field in fields(self)))


@dataclass(frozen=True, eq=False)
class _FirstTouch:
    """Where n unloaded rods touch: points of the rods and of the bars' axes (n, 3), arcs (n,)."""

    point: np.ndarray
    axis: np.ndarray
    arc: np.ndarray


@dataclass(frozen=True, eq=False)
class _Push:
    """Pushing and friction angles, rad, slopes of the bars, rad (n,), and where these are first touched."""

    theta: np.ndarray
    alpha: np.ndarray
    beta: np.ndarray
    first: _FirstTouch


@dataclass(frozen=True, eq=False)
class _Friction:
    """Friction over the force (n,): sideways, and along the rod away from its base."""

    sideways: np.ndarray
    lengthways: np.ndarray


def _bar_directions(beta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the directions (n, 3) of bars at slopes beta (n,), and of what is across them and the whisker."""
    along = np.stack([0.0 * beta, np.sin(beta), np.cos(beta)], axis=1)
    across = np.stack([0.0 * beta, -np.cos(beta), np.sin(beta)], axis=1)
    return along, across


def _way(bent: _Bent, first: _FirstTouch, bar: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Return how far rods have moved along bars since first touch, and have been drawn along themselves (2, n).

    side (n,): the sign of the motion along bars (n, 3) that counts as forward.
    """
    way = bent.point - first.point
    moved = dot(way, bar)
    past = dot(way, bent.tangent) - dot(bent.tangent, bar) * moved
    return np.stack([side * moved, bent.arc - first.arc - past])


def _headings(
    halfway: _Bent, now: _Bent, first: _FirstTouch, bar: np.ndarray, side: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the headings (n,) of the motion halfway, and now: of the parabola through both ways and none.

    bar, side: as of `_way`.
    """
    way_halfway = _way(halfway, first, bar, side)
    way = _way(now, first, bar, side)
    latest = 3 * way - 4 * way_halfway
    return np.arctan2(way[1], way[0]), np.arctan2(latest[1], latest[0])


def _along(bent: _Bent, bar: np.ndarray) -> np.ndarray:
    """Return the part (n,) of forces that acts along rods, across bars (n, 3)."""
    lean = dot(bent.tangent, bar)
    part = dot(bent.force, bent.tangent) - lean * dot(bent.force, bar)
    return part / np.linalg.norm(bent.force, axis=1)


def _sizes(unknowns: np.ndarray) -> np.ndarray:
    """Return the sizes (9,) of the unknowns: of the forces, of the arcs, and a radian."""
    force = np.repeat(np.linalg.norm(unknowns[:3]), 3)
    halfway = np.repeat(np.linalg.norm(unknowns[5:8]), 3)
    return np.concatenate([force, [unknowns[3], 1.0], halfway, [unknowns[8]]])


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the solution of linear equations; NaN where there is none."""
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return np.full_like(right, nan)


def _wrapped(angle: np.ndarray) -> np.ndarray:
    """Return angles within half a turn of none."""
    return np.arctan2(np.sin(angle), np.cos(angle))


def _slope(force: np.ndarray, sideways: np.ndarray) -> np.ndarray:
    """Return the slope (n,) of bars along which friction has this part (n,) of forces (n, 3): (9)."""
    _, y, z = force.T
    phi = np.arctan2(z, -y)
    sine = sideways * np.linalg.norm(force, axis=1) / np.hypot(y, z)
    cone = np.arcsin(np.clip(sine, -1.0, 1.0))
    return phi + np.copysign(cone, phi)
