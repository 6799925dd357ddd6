"""Coulomb friction marched along the motor's path: hold, slide, the teeth between, the way back."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bench.rig.bar import UnloadedTouch
from bench.rig.elastic_rod import Rod
from bench.rig.friction_laws import GIVE, Held, RegularisedSliding, Sliding
from bench.rig.linear import rotate_about_z
from bench.rig.rod_contact import ContactState, RodContact
from bench.rig.touched_object import TouchedObject

# Share of the coefficient at rest, rad: where the search for the cone's edge ends.
_ON_THE_CONE, _CLOSE_RAD = 1e-4, 1e-6
_NO_PUSH_RAD = 1e-7  # below this (5 nm at 50 mm) there is no force to speak of
_HALVINGS = 7  # of a step that comes to no equilibrium
_SOFTEST = 0.01  # lengths by which the softest friction gives way


@dataclass(frozen=True)
class FrictionCoefficients:
    """Coefficients of friction at rest and in motion.

    finest_rad: teeth of stick–slip shorter than this are not resolved; the whisker is then taken as
    sliding. rests: how much of the excess at rest each rest reaches, in parts, one after the other
    and round again.
    Raises ValueError where the coefficient at rest is the smaller, or a rest reaches less than
    nothing.
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
                "friction: rests reach from nothing on, and there is one at least, "
                f"not {self.rests}"
            )

    def at_rest(self, number: int) -> float:
        """Return the static coefficient of one rest, counted from 0."""
        return self.kinetic + (self.static - self.kinetic) * self.rests[number % len(self.rests)]


class March:
    """A whisker's states along the motor's path, from first touch.

    Quasi-static: the whisker holds while the force stays in the static cone; when it leaves it, it
    jumps to the kinetic one.
    contact: its problem. state, before: the present state and the one before. slid_off: whether
    the tip has left the object.
    """

    def __init__(
        self, rod: Rod, bar: TouchedObject, friction: FrictionCoefficients, touch: UnloadedTouch
    ):
        self.contact = RodContact(rod, bar)
        self.friction = friction
        self.touch = touch
        self.state = self.contact.touch_state(touch)
        self.before = None
        self.slid_off = False
        self._rest = 0  # number of the present rest
        self._jump_rad = -math.inf  # where the last jump was
        self._give_mm = GIVE * rod.length_mm

    def along(self, path_rad: Iterable[float]) -> tuple[np.ndarray, list[ContactState | None]]:
        """Return motor angles and states met on the way through the angles of `path_rad`; a jump
        yields two states at one angle.

        None stands for no contact: the motor before the touch angle, or the tip slid off the
        object. Raises ArithmeticError where no equilibrium is found.
        """
        angles = []
        states = []
        for motor_rad in path_rad:
            for state in self._go(float(motor_rad)):
                angles.append(motor_rad if state is None else state.motor_rad)
                states.append(state)
        return np.array(angles), states

    @property
    def _static(self) -> float:
        """Return the coefficient that the present rest reaches."""
        return self.friction.at_rest(self._rest)

    def _go(self, motor_rad) -> list[ContactState | None]:
        """Return the states met up to a motor angle, the last one at that angle."""
        if motor_rad <= self.touch.motor_rad + _NO_PUSH_RAD or self.slid_off:
            self.state = self.contact.touch_state(self.touch)
            self.before = None
            return [None]
        try:
            return self._step(motor_rad, _HALVINGS)
        except ArithmeticError:
            if self.state.status != "tip":
                raise
            self.slid_off = True
            return [None]

    def _step(self, motor_rad, halvings):
        """Find the states up to a motor angle in one step, or in halves where that fails."""
        try:
            return self._advance(motor_rad)
        except ArithmeticError:
            if not halvings or abs(motor_rad - self.state.motor_rad) < 1e-9:
                raise ArithmeticError(
                    "the march along the motor's path came to no equilibrium"
                ) from None
        half = 0.5 * (self.state.motor_rad + motor_rad)
        return [*self._step(half, halvings - 1)[:-1], *self._step(motor_rad, halvings - 1)]

    def _advance(self, motor_rad):
        """Find the states up to a motor angle, changing between side and tip of the whisker."""
        tip = self.state.status == "tip"
        states = self._friction_step(motor_rad, tip)
        if not tip and states[-1].arc_mm > self.contact.rod.length_mm:
            states = self._friction_step(motor_rad, True)
        elif tip and self.contact.is_past_foot(states[-1]):
            states = self._friction_step(motor_rad, False)
        for state in states:
            self.before = self.state
            self.state = state
        return states

    def _friction_step(self, motor_rad, tip):
        """Find the states up to a motor angle: held, sliding, or the teeth between them."""
        if self.friction.static == self.friction.kinetic:
            return [self._slide_on(motor_rad, tip)]
        held = self._hold(motor_rad, tip)
        if held.shear_ratio < self._static:
            return [held]
        if not self.state.force_hub_N.any():
            return [self._slide_from(motor_rad, self.state, held, tip)]
        return self._tooth(motor_rad, held, tip)

    def _tooth(self, motor_rad, held, tip):
        """Find the states of a tooth: held until the static cone is left, after the jump to the kinetic
        one, and on from there."""
        edge = self._find_edge(held, tip)
        if abs(edge.motor_rad - self._jump_rad) < self.friction.finest_rad:
            self._jump_rad = motor_rad
            return [self._slide_from(motor_rad, self.state, held, tip)]
        self._jump_rad = edge.motor_rad
        landed = self._slide_from(edge.motor_rad, edge, edge, tip)
        self._rest += 1
        self.before = None
        self.state = landed
        return [edge, landed, *self._friction_step(motor_rad, tip)]

    def _find_edge(self, held, tip):
        """Find where the force leaves the static cone between the present state and `held`.

        This is the Illinois method, which keeps the nearest state found: on a strongly tilted bar
        the held branch may fold before it meets the cone, and SciPy's methods return nothing then.
        """
        state = self.state
        low = state.motor_rad
        high = held.motor_rad
        excess_low = state.shear_ratio - self._static
        excess_high = held.shear_ratio - self._static
        nearest = held
        least = excess_high
        while abs(least) > _ON_THE_CONE * self._static and abs(high - low) > _CLOSE_RAD:
            at = high - excess_high * (high - low) / (excess_high - excess_low)
            guess = _extrapolate(state, held, at)
            try:
                edge = self.contact.solve(at, state, guess, Held(self._static, self._give_mm), tip)
            except ArithmeticError:
                break
            excess = edge.shear_ratio - self._static
            if excess * excess_high < 0:
                low = high
                excess_low = excess_high
            else:
                excess_low *= 0.5
            high = at
            excess_high = excess
            if abs(excess) < abs(least):
                nearest = edge
                least = excess
        return nearest

    def _hold(self, motor_rad, tip):
        """Find the state that is held at a motor angle."""
        law = Held(self._static, self._give_mm)
        return self.contact.solve(motor_rad, self.state, self._guess(motor_rad), law, tip)

    def _slide_on(self, motor_rad, tip):
        """Find the state that slides in the direction of the step before; at first touch from where the contact would
        be held."""
        if not self.state.force_hub_N.any():
            return self._slide_from(motor_rad, self.state, self._hold(motor_rad, tip), tip)
        guess = self._guess(motor_rad)
        return self._slide(motor_rad, self.state, guess, self.state.heading_rad, tip)

    def _slide_from(self, motor_rad, old, held, tip):
        """Find the state that slides from `old`, starting the search where the contact would be if it were held, its
        shear reduced to the kinetic cone."""
        bar = self.contact.bar.at(held.motor_rad)
        local = bar.local_bar(held.point_mm)
        normal = rotate_about_z(local.offset_mm, -held.motor_rad) / np.linalg.norm(local.offset_mm)
        axis = rotate_about_z(local.axis, -held.motor_rad)
        shear = held.force_hub_N @ axis
        limit = self.friction.kinetic * (held.force_hub_N @ normal)
        reduced = math.copysign(min(abs(shear), limit), shear)
        guess = np.append(held.force_hub_N + (reduced - shear) * axis, held.arc_mm)
        along = np.clip(-shear / (limit or 1e-300), -1, 1)
        across = math.copysign(math.sqrt(1 - along**2), held.motion_round_mm)
        return self._slide(motor_rad, old, guess, math.atan2(across, along), tip)

    def _slide(self, motor_rad, old, guess, heading_rad, tip):
        """Find the sliding state near a guess.

        Where the heading is another (the motor has just turned back), friction is first regularised
        over a long motion, then over ever less, down to that by which a held contact gives way.
        """
        kinetic = self.friction.kinetic
        unknowns = np.append(guess, heading_rad)
        try:
            return self.contact.solve(motor_rad, old, unknowns, Sliding(kinetic), tip)
        except ArithmeticError:
            softest_mm = _SOFTEST * self.contact.rod.length_mm
            for give_mm in np.geomspace(softest_mm, self._give_mm, 16):
                state = self.contact.solve(
                    motor_rad, old, guess, RegularisedSliding(kinetic, give_mm), tip
                )
                guess = state.unknowns
            return state

    def _guess(self, motor_rad):
        """Predict the unknowns (4,) from the last two states; at first, by the small-angle force of a whisker held
        where it is."""
        state = self.state
        before = self.before
        if before is not None and before.motor_rad != state.motor_rad and before.force_hub_N.any():
            return _extrapolate(before, state, motor_rad)
        rod = self.contact.rod
        pushed_rad = motor_rad - state.motor_rad
        rigidity = rod.rigidity_Nmm2 * float(rod.width(0.9 * state.arc_mm))
        force = -3 * rigidity * pushed_rad / state.arc_mm**2
        return state.unknowns + np.array([0.0, force, 0, 0])


def _extrapolate(first, second, motor_rad):
    """Return the unknowns (4,) at a motor angle on the straight line through two states."""
    share = (motor_rad - second.motor_rad) / (second.motor_rad - first.motor_rad)
    return second.unknowns + share * (second.unknowns - first.unknowns)
