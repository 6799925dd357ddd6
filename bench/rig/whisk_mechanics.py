"""One whisk: what the exact mechanics gives at every motor angle of its forward and back stroke."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from bench.rig.bar import UnloadedTouch, unloaded_curve
from bench.rig.elastic_rod import Rod
from bench.rig.linear import rotate_about_z
from bench.rig.rod_contact import ContactState, bent_rod, moments_Nmm
from bench.rig.stick_slip import FrictionCoefficients, March
from bench.rig.touched_object import TouchedObject


@dataclass(frozen=True, eq=False)
class ContactPath:
    """States in the order of the motor's path; a jump is two rows at one angle. Contacts of free
    ones are NaN."""

    motor_rad: np.ndarray  # (n,)
    point_mm: np.ndarray  # (n, 3)
    arc_mm: np.ndarray  # (n,)
    moment_Nmm: np.ndarray  # (n, 2): m_y, m_z
    force_N: np.ndarray  # (n, 3): of the base on the whisker, hub frame
    states: tuple[ContactState | None, ...]

    @classmethod
    def from_states(cls, path_rad: np.ndarray, states: Sequence[ContactState | None]) -> Self:
        """Make the path of states (None while free) at the motor angles of a path."""
        count = len(states)
        points = np.full((count, 3), np.nan)
        arcs = np.full(count, np.nan)
        moments = np.zeros((count, 2))
        forces = np.zeros((count, 3))
        for row, state in enumerate(states):
            if state is not None:
                points[row] = state.point_mm
                arcs[row] = state.arc_mm
                moments[row] = moments_Nmm(state)
                forces[row] = -state.force_hub_N
        return cls(np.asarray(path_rad), points, arcs, moments, forces, tuple(states))

    def moments_at(self, motor_rad: np.ndarray) -> np.ndarray:
        """Interpolate (m_y, m_z) (n, 2), N·mm, at motor angles (n,); zero before touch."""
        return self._interpolate(self.moment_Nmm, motor_rad)

    def forces_at(self, motor_rad: np.ndarray) -> np.ndarray:
        """Interpolate the force (n, 3), N, of the base on the whisker at motor angles (n,)."""
        return self._interpolate(self.force_N, motor_rad)

    def row_at(self, motor_rad: float) -> int:
        """Return the row of the last instant on the way to a motor angle, −1 before the first."""
        at = self._direction * motor_rad
        knots = self._direction * self.motor_rad
        return int(np.searchsorted(knots, at + 1e-9, side="right")) - 1

    def state_at(self, motor_rad: float) -> ContactState | None:
        """Return the state at one of the stops (after a jump there, if any); None where nothing is
        pushed."""
        row = self.row_at(motor_rad)
        state = self.states[row] if row >= 0 else None
        return state if state is not None and state.force_hub_N.any() else None

    def state_between(self, motor_rad: float) -> ContactState | None:
        """Return the state at any angle, force and arc interpolated between instants."""
        row = self.row_at(motor_rad)
        if row < 0 or self.states[row] is None:
            return None
        row = min(row, len(self.states) - 2)
        before, after = self.states[row : row + 2]
        low, high = self.motor_rad[row : row + 2]
        if before is None or low == high:
            return after
        part = (motor_rad - low) / (high - low)
        force = (1 - part) * before.force_hub_N
        if after is None:
            return replace(before, motor_rad=motor_rad, force_hub_N=force)
        force = force + part * after.force_hub_N
        arc = (1 - part) * before.arc_mm + part * after.arc_mm
        return replace(after, motor_rad=motor_rad, force_hub_N=force, arc_mm=arc)

    @property
    def _direction(self) -> int:
        """Return the sign of the motor's motion."""
        return -1 if self.motor_rad[-1] < self.motor_rad[0] else 1

    def _interpolate(self, columns, motor_rad):
        """Interpolate columns (instants, k) at motor angles (n,): (n, k)."""
        at = self._direction * np.asarray(motor_rad)
        knots = self._direction * self.motor_rad
        return np.stack([np.interp(at, knots, column) for column in columns.T], -1)


@dataclass(frozen=True, eq=False)
class WhiskMechanics:
    """The mechanics of one whisk. `forward` begins at touch, `back` (None without a back stroke)
    ends there."""

    rod: Rod
    bar: TouchedObject
    touch: UnloadedTouch
    friction: FrictionCoefficients
    forward: ContactPath
    back: ContactPath | None

    @classmethod
    def run(
        cls,
        rod: Rod,
        bar: TouchedObject,
        friction: FrictionCoefficients,
        touch: UnloadedTouch,
        end_rad: float,
        *,
        step_rad: float,
        stops_rad: Sequence[float] = (),
        back: bool = False,
    ) -> Self:
        """Compute a whisk from touch to `end_rad` (and back) in steps, stopping exactly at `stops_rad`
        on the forward stroke."""
        march = March(rod, bar, friction, touch)
        start = march.state
        stations = _stations(touch.motor_rad, end_rad, step_rad, stops_rad)
        path, states = march.along(stations)
        forward = ContactPath.from_states(np.append(touch.motor_rad, path), [start, *states])
        backward = None
        if back:
            way_back, returned = march.along(np.append(stations[-2::-1], touch.motor_rad))
            backward = ContactPath.from_states(
                np.append(path[-1], way_back), [states[-1], *returned]
            )
        return cls(rod, bar, touch, friction, forward, backward)

    @property
    def slope(self) -> tuple[float, float]:
        """Return (β, ψ), rad, of the object at first touch."""
        return self.bar.slope(self.touch.motor_rad, self.touch.point_mm)

    def path(self, back: bool) -> ContactPath:
        """Return the forward or the back stroke. Raises ValueError where there is no back
        stroke."""
        if back and self.back is None:
            raise ValueError("this whisk has no back stroke")
        return self.back if back else self.forward

    def slip_mm(self, point_mm: np.ndarray, motor_rad: float | np.ndarray) -> np.ndarray:
        """Return how far contacts (..., 3) have slipped over the object since first touch, along
        its axis there."""
        moved = np.asarray(point_mm) - self.touch.point_mm - self.bar.moved_mm(motor_rad)
        return moved @ self.bar.axis_at(self.touch.point_mm)

    def slip_at(self, theta_rad: float | np.ndarray) -> np.ndarray:
        """Interpolate the slip, mm, of the forward stroke at pushing angles, NaN beyond its
        end."""
        path = self.forward
        slip = self.slip_mm(path.point_mm, path.motor_rad)
        motor = self.touch.motor_rad + np.asarray(theta_rad)
        return np.interp(motor, path.motor_rad, slip, right=np.nan)

    def gave_mm(self, motor_rad: float, back: bool) -> np.ndarray:
        """Return the displacement (3,) of a soft object: away from the contact, by the force along
        its normal over its stiffness."""
        state = self.path(back).state_between(motor_rad)
        stiffness = self.bar.stiffness_N_mm
        if state is None or not state.force_hub_N.any() or math.isinf(stiffness):
            return np.zeros(3)
        point = self.centreline_mm(state.motor_rad, state, np.array([state.arc_mm]))[0]
        inward = self.bar.foot_mm(point) - point
        inward /= np.linalg.norm(inward)
        press = -rotate_about_z(state.force_hub_N, state.motor_rad) @ inward
        return press / stiffness * inward

    def centreline_mm(
        self, motor_rad: float, state: ContactState | None, arc_mm: np.ndarray
    ) -> np.ndarray:
        """Return points (n, 3) of the whisker at arc lengths (n,) in the rig frame, bent by the
        force of `state` or free."""
        if state is None or not state.force_hub_N.any():
            return unloaded_curve(self.rod, motor_rad, arc_mm)[0]
        points = bent_rod(self.rod).curve_mm(state.unknowns, state.shape, arc_mm)
        return rotate_about_z(points, motor_rad)


def _stations(start, end, step, stops):
    """Return rising angles after `start` up to `end`: an even grid and the stops, none closer than
    1e-9 rad."""
    stops = np.asarray(stops, float)
    inner = stops[(stops > start + 1e-6) & (stops < end)]
    stations = np.unique(np.concatenate([np.arange(start + step, end, step), inner, [end]]))
    return stations[np.append(np.diff(stations) > 1e-9, True)]
