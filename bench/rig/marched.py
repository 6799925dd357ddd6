"""One whisk: what the exact mechanics says at every motor angle of its forward and back stroke."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from bench.rig.bar import Bar, Touch, turned, unloaded
from bench.rig.elastic_rod import Rod
from bench.rig.elastica import Elastica
from bench.rig.rod_contact import ContactState, moments_Nmm
from bench.rig.stick_slip import Friction, March


@dataclass(frozen=True, eq=False)
class Instants:
    """States in the order of the motor's way; a jump shows as two rows at one angle. Free ones have NaN contacts."""

    motor_rad: np.ndarray
    point_mm: np.ndarray  # (n, 3)
    arc_mm: np.ndarray
    moment_Nmm: np.ndarray  # (n, 2): m_y, m_z
    force_N: np.ndarray  # (n, 3): of the base on the whisker, hub frame
    states: tuple[ContactState | None, ...]

    @classmethod
    def of(cls, path_rad: np.ndarray, states: Sequence[ContactState | None]) -> "Instants":
        """What a path of motor angles and the states on it (None while free) tell."""
        free = np.full(3, np.nan), np.nan, (0.0, 0.0), np.zeros(3)
        rows = [
            free if s is None else (s.point_mm, s.arc_mm, moments_Nmm(s), -s.force_hub_N)
            for s in states
        ]
        points, arcs, moments, forces = (np.array(column) for column in zip(*rows))
        return cls(np.asarray(path_rad), points, arcs, moments, forces, tuple(states))

    @property
    def _way(self) -> int:
        return -1 if self.motor_rad[-1] < self.motor_rad[0] else 1

    def moments_at(self, motor_rad: np.ndarray) -> np.ndarray:
        """(m_y, m_z) at motor angles, straight lines between instants, zero before touch."""
        return self._between(self.moment_Nmm, motor_rad)

    def forces_at(self, motor_rad: np.ndarray) -> np.ndarray:
        """Force (n, 3) of the base on the whisker, likewise."""
        return self._between(self.force_N, motor_rad)

    def _between(self, columns, motor_rad):
        at, knots = self._way * np.asarray(motor_rad), self._way * self.motor_rad
        return np.stack([np.interp(at, knots, column) for column in columns.T], -1)

    def row_at(self, motor_rad: float) -> int:
        """Row of the last instant on the way to a motor angle, −1 where the way has not begun."""
        at, knots = self._way * motor_rad, self._way * self.motor_rad
        return int(np.searchsorted(knots, at + 1e-9, side="right")) - 1

    def state_at(self, motor_rad: float) -> ContactState | None:
        """The state at one of the stops (after a jump there, if any); None where nothing is pushed."""
        row = self.row_at(motor_rad)
        state = self.states[row] if row >= 0 else None
        return state if state is not None and state.force_hub_N.any() else None

    def state_between(self, motor_rad: float) -> ContactState | None:
        """The state at any angle: force and arc on straight lines between instants."""
        row = self.row_at(motor_rad)
        if row < 0 or self.states[row] is None:
            return None
        row = min(row, len(self.states) - 2)
        (before, after), angles = self.states[row : row + 2], self.motor_rad[row : row + 2]
        if before is None or angles[0] == angles[1]:
            return after
        part = (motor_rad - angles[0]) / (angles[1] - angles[0])
        if after is None:
            return replace(before, motor_rad=motor_rad, force_hub_N=(1 - part) * before.force_hub_N)
        force = (1 - part) * before.force_hub_N + part * after.force_hub_N
        arc = (1 - part) * before.arc_mm + part * after.arc_mm
        return replace(after, motor_rad=motor_rad, force_hub_N=force, arc_mm=arc)


@dataclass(frozen=True, eq=False)
class MarchedWhisk:
    """The mechanics of one whisk. `forward` begins at touch, `back` (None without a back stroke) ends there."""

    rod: Rod
    bar: Bar
    touch: Touch
    friction: Friction
    forward: Instants
    back: Instants | None

    @classmethod
    def run(
        cls,
        rod: Rod,
        bar: Bar,
        friction: Friction,
        touch: Touch,
        end_rad: float,
        *,
        step_rad: float,
        stops_rad: Sequence[float] = (),
        back: bool = False,
    ) -> Self:
        """March from touch to `end_rad` (and back) in steps, stopping exactly at `stops_rad` on the way there."""
        march = March(rod, bar, friction, touch)
        up = _stations(touch.motor_rad, end_rad, step_rad, stops_rad)
        start = march.state
        path, states = march.along(up)
        forward = Instants.of(np.append(touch.motor_rad, path), [start, *states])
        if not back:
            return cls(rod, bar, touch, friction, forward, None)
        down, returned = march.along(np.append(up[-2::-1], touch.motor_rad))
        return cls(
            rod,
            bar,
            touch,
            friction,
            forward,
            Instants.of(np.append(path[-1], down), [states[-1], *returned]),
        )

    def slip_mm(self, point_mm: np.ndarray, motor_rad: float | np.ndarray) -> np.ndarray:
        """Along the bar since first touch, in the direction that its axis has there; over it where it moves itself."""
        moved = np.asarray(point_mm) - self.touch.point_mm - self.bar.moved_mm(motor_rad)
        return moved @ self.bar.axis_at(self.touch.point_mm)

    def gave_mm(self, motor_rad: float, back: bool) -> np.ndarray:
        """How far (3,) a soft bar is from where it stands: away from the contact, by the force along its normal."""
        state = self.way(back).state_between(motor_rad)
        if state is None or not state.force_hub_N.any() or math.isinf(self.bar.stiffness_N_mm):
            return np.zeros(3)
        point = self.centreline_mm(state.motor_rad, state, np.array([state.arc_mm]))[0]
        away = self.bar.foot_mm(point) - point
        normal = away / np.linalg.norm(away)
        press = -turned(state.force_hub_N, state.motor_rad) @ normal
        return press / self.bar.stiffness_N_mm * normal

    def way(self, back: bool) -> Instants:
        """The forward or the back stroke. Raises ValueError where there was no back stroke."""
        if back and self.back is None:
            raise ValueError("this whisk has no back stroke")
        return self.back if back else self.forward

    def slip_at(self, theta_rad: float | np.ndarray) -> np.ndarray:
        """Slip (mm) on the forward stroke at pushing angles, NaN where it does not reach them."""
        motor = self.touch.motor_rad + np.asarray(theta_rad)
        way = self.forward
        return np.interp(
            motor, way.motor_rad, self.slip_mm(way.point_mm, way.motor_rad), right=np.nan
        )

    def centreline_mm(
        self, motor_rad: float, state: ContactState | None, arc_mm: np.ndarray
    ) -> np.ndarray:
        """Points (n, 3) of the whisker at arc lengths (n,) in the rig frame, bent by the force of `state` or free."""
        if state is None or not state.force_hub_N.any():
            return unloaded(self.rod, motor_rad, arc_mm)[0]
        force, elastica = state.force_hub_N, Elastica(self.rod)
        across = float(np.hypot(force[1], force[2]))
        plane = elastica.curve_mm(
            elastica.solve(force[0], across, state.arc_mm, state.angle), arc_mm
        )
        points = np.column_stack([plane[:, 0], plane[:, 1:] * force[1:] / across])
        return turned(points + self.rod.rest.offset_mm(arc_mm), motor_rad)


def _stations(start, end, step, stops):
    """Rising angles after `start` up to `end`: an even grid and the stops, none closer than 1e-9 rad."""
    stops = np.asarray(stops, float)
    inner = np.concatenate(
        [np.arange(start + step, end, step), stops[(stops > start + 1e-6) & (stops < end)], [end]]
    )
    inner = np.unique(inner)
    return inner[np.append(np.diff(inner) > 1e-9, True)]
