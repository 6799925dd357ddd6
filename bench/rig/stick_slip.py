"""Coulomb friction marched along the motor's way: hold, slide, the saw-tooth between them, the way back, letting go."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bench.rig.bar import Bar, Touch, turned
from bench.rig.elastic_rod import Rod
from bench.rig.rod_contact import Contact, ContactState

# Share of the coefficient at rest, rad: where the search for the cone's edge ends.
_ON_THE_CONE, _CLOSE_RAD = 1e-4, 1e-6
_NO_PUSH_RAD = 1e-7  # below this (5 nm at 50 mm) there is no force to speak of


@dataclass(frozen=True)
class Friction:
    """Coefficients at rest and in motion. `finest_rad`: teeth of stick–slip shorter than this are not resolved; the
    whisker is then taken as sliding. `rests`: how much of the excess at rest each rest reaches, in parts, one after the
    other and round again. Raises ValueError where the one at rest is the smaller, or a rest reaches less than nothing.
    """

    static: float
    kinetic: float
    finest_rad: float = math.radians(0.05)
    rests: tuple[float, ...] = (1.0,)

    def __post_init__(self):
        if not self.static >= self.kinetic >= 0:
            raise ValueError(
                f"friction: static ({self.static}) ≥ kinetic ({self.kinetic}) ≥ 0 is needed"
            )
        if not self.rests or min(self.rests) < 0:
            raise ValueError(
                f"friction: rests reach from nothing on, and there is one at least, not {self.rests}"
            )

    def at_rest(self, number: int) -> float:
        """The static coefficient of one rest, counted from 0."""
        return self.kinetic + (self.static - self.kinetic) * self.rests[number % len(self.rests)]


class March:
    """A whisker's states along the motor's way, from first touch.

    Quasi-static: the whisker holds while the force stays in the static cone; when it leaves it, it jumps to the
    kinetic one.
    """

    def __init__(self, rod: Rod, bar: Bar, friction: Friction, touch: Touch):
        self.contact, self.friction, self.touch = Contact(rod, bar), friction, touch
        self.state, self.before, self.jump_rad = self.contact.touching(touch), None, -math.inf
        self.passed, self.rest = False, 0

    @property
    def static(self) -> float:
        """The coefficient that the present rest reaches."""
        return self.friction.at_rest(self.rest)

    def along(self, path_rad: Iterable[float]) -> tuple[np.ndarray, list[ContactState | None]]:
        """Motor angles and states met on the way through the angles of `path_rad`; a jump yields two states at one
        angle.

        None stands for no contact: the motor before the touch angle, or the tip slid off the bar. Raises
        ArithmeticError where no equilibrium is found.
        """
        met = [(motor, state) for motor in path_rad for state in self._go(float(motor))]
        angles = [motor if state is None else state.motor_rad for motor, state in met]
        return np.array(angles), [state for _, state in met]

    def _go(self, motor_rad) -> list[ContactState | None]:
        """Step to a motor angle; the states met on the way, the last one at that angle."""
        if motor_rad <= self.touch.motor_rad + _NO_PUSH_RAD or self.passed:
            self.state, self.before = self.contact.touching(self.touch), None
            return [None]
        try:
            return self._step(motor_rad, 7)
        except ArithmeticError:
            if self.state.status != "tip":
                raise
            self.passed = True
            return [None]

    def _step(self, motor_rad, depth):
        try:
            return self._advance(motor_rad)
        except (ArithmeticError, np.linalg.LinAlgError):
            if not depth or abs(motor_rad - self.state.motor_rad) < 1e-9:
                raise ArithmeticError(
                    "the march along the motor's path came to no equilibrium"
                ) from None
        half = 0.5 * (self.state.motor_rad + motor_rad)
        return [*self._step(half, depth - 1)[:-1], *self._step(motor_rad, depth - 1)]

    def _advance(self, motor_rad):
        tip = self.state.status == "tip"
        states = self._friction_step(motor_rad, tip)
        if not tip and states[-1].arc_mm > self.contact.rod.length_mm:
            states = self._friction_step(motor_rad, True)
        elif tip and self.contact.foot_side(states[-1]) > 0:
            states = self._friction_step(motor_rad, False)
        for state in states:
            self.before, self.state = self.state, state
        return states

    def _friction_step(self, motor_rad, tip):
        if self.friction.static == self.friction.kinetic:
            return [self._slide_on(motor_rad, tip)]
        held = self._hold(motor_rad, tip)
        if held.share < self.static:
            return [held]
        if not self.state.force_hub_N.any():
            return [self._slide(motor_rad, self.state, held, tip)]
        return self._tooth(motor_rad, held, tip)

    def _slide_on(self, motor_rad, tip):
        """Slide as before if that can be; at first touch look from where the contact would be held, on turning back
        ease in.
        """
        if not self.state.force_hub_N.any():
            return self._slide(motor_rad, self.state, self._hold(motor_rad, tip), tip)
        guess, kinetic = self._guess(motor_rad), self.friction.kinetic
        try:
            return self.contact.slide(
                motor_rad, self.state, guess, self.state.heading_rad, kinetic, tip
            )
        except (ArithmeticError, np.linalg.LinAlgError):
            return self.contact.ease(motor_rad, self.state, guess, kinetic, tip)

    def _tooth(self, motor_rad, held, tip):
        """Hold until the static cone is left, jump to the kinetic one, go on from there."""
        edge = self._edge(held, tip)
        if abs(edge.motor_rad - self.jump_rad) < self.friction.finest_rad:
            self.jump_rad = motor_rad
            return [self._slide(motor_rad, self.state, held, tip)]
        self.jump_rad = edge.motor_rad
        landed = self._slide(edge.motor_rad, edge, edge, tip)
        self.rest += 1
        self.before, self.state = None, landed
        return [edge, landed, *self._friction_step(motor_rad, tip)]

    def _edge(self, held, tip):
        """Where the force leaves the static cone between the present state and `held` (Illinois method).

        On a strongly tilted bar the held branch may fold before it meets the cone: then the nearest that was found.
        """
        low, high = self.state.motor_rad, held.motor_rad
        f_low, f_high = self.state.share - self.static, held.share - self.static
        nearest, f_nearest = held, f_high
        while abs(f_nearest) > _ON_THE_CONE * self.static and abs(high - low) > _CLOSE_RAD:
            at = high - f_high * (high - low) / (f_high - f_low)
            try:
                edge = self.contact.hold(at, self.state, self._between(held, at), self.static, tip)
            except (ArithmeticError, np.linalg.LinAlgError):
                break
            f = edge.share - self.static
            if f * f_high < 0:
                low, f_low = high, f_high
            else:
                f_low *= 0.5
            high, f_high = at, f
            nearest, f_nearest = min((nearest, f_nearest), (edge, f), key=lambda pair: abs(pair[1]))
        return nearest

    def _between(self, held, motor_rad):
        """Unknowns at an angle between the present state and `held`."""
        ahead = (motor_rad - self.state.motor_rad) / (held.motor_rad - self.state.motor_rad)
        return self.state.unknowns + ahead * (held.unknowns - self.state.unknowns)

    def _hold(self, motor_rad, tip):
        return self.contact.hold(motor_rad, self.state, self._guess(motor_rad), self.static, tip)

    def _slide(self, motor_rad, old, held, tip):
        """Slide from `old`, looking first where the contact would be if it were held."""
        press, shear = self._press_and_shear(held)
        along = np.clip(-shear / (self.friction.kinetic * press or 1e-300), -1, 1)
        way = math.copysign(1.0, held.motion_aside_mm)
        heading = math.atan2(way * math.sqrt(1 - along**2), along)
        guess = self._onto_cone(held)
        try:
            return self.contact.slide(motor_rad, old, guess, heading, self.friction.kinetic, tip)
        except (ArithmeticError, np.linalg.LinAlgError):
            return self.contact.ease(motor_rad, old, guess, self.friction.kinetic, tip)

    def _guess(self, motor_rad):
        """What the last two states foretell; at first, the small-angle force of a whisker held where it is."""
        state, before = self.state, self.before
        if before is not None and before.motor_rad != state.motor_rad and before.force_hub_N.any():
            ahead = (motor_rad - state.motor_rad) / (state.motor_rad - before.motor_rad)
            return state.unknowns + ahead * (state.unknowns - before.unknowns)
        rod, pushed = self.contact.rod, motor_rad - state.motor_rad
        softened = float(rod.width(0.9 * state.arc_mm))
        force = -3 * rod.rigidity_Nmm2 * softened * pushed / state.arc_mm**2
        return state.unknowns + np.array([0.0, force, 0, 0])

    def _press_and_shear(self, state):
        """Normal force, and force along the bar."""
        normal, axis = self._hub_axes(state)
        return state.force_hub_N @ normal, state.force_hub_N @ axis

    def _onto_cone(self, held):
        """The held force with its shear drawn in to the kinetic cone, and the arc."""
        press, shear = self._press_and_shear(held)
        _, axis = self._hub_axes(held)
        drawn = math.copysign(min(abs(shear), self.friction.kinetic * press), shear)
        return np.append(held.force_hub_N + (drawn - shear) * axis, held.arc_mm)

    def _hub_axes(self, state):
        """Normal of the contact and axis of the bar in the hub frame."""
        bar = self.contact.bar.at(state.motor_rad)
        apart = state.point_mm - bar.foot_mm(state.point_mm)
        axis = bar.axis_at(state.point_mm)
        return turned(apart / np.linalg.norm(apart), -state.motor_rad), turned(
            axis, -state.motor_rad
        )
