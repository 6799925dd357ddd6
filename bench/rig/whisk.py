"""One whisk: what the exact mechanics says at every motor angle of its forward and back stroke."""

from dataclasses import dataclass, replace

import numpy as np

from bench.rig.bar import Bar, Touch, turned, unloaded
from bench.rig.contact import Contact, State, moments_Nmm
from bench.rig.friction import Friction, March
from bench.rig.rod import Rod


@dataclass(frozen=True, eq=False)
class Instants:
    """States in the order of the motor's way; a jump shows as two rows at one angle. Free instants have NaN contacts."""

    motor_rad: np.ndarray
    touching: np.ndarray
    point_mm: np.ndarray
    arc_mm: np.ndarray
    moment_Nmm: np.ndarray  # (n, 2): m_y, m_z
    states: tuple[State | None, ...]

    @classmethod
    def of(cls, path_rad, states) -> "Instants":
        nothing = np.full(3, np.nan)
        return cls(np.asarray(path_rad), np.array([s is not None for s in states]),
                   np.array([nothing if s is None else s.point_mm for s in states]).reshape(-1, 3),
                   np.array([np.nan if s is None else s.arc_mm for s in states]),
                   np.array([(0.0, 0.0) if s is None else moments_Nmm(s) for s in states]).reshape(-1, 2), tuple(states))

    def moments_at(self, motor_rad) -> np.ndarray:
        """(m_y, m_z) at motor angles, straight lines between instants. Angles of a back stroke fall."""
        way = -1 if self.motor_rad[-1] < self.motor_rad[0] else 1
        return np.stack([np.interp(way * np.asarray(motor_rad), way * self.motor_rad, m, left=0.0, right=0.0)
                         for m in self.moment_Nmm.T], -1)


@dataclass(frozen=True, eq=False)
class Whisk:
    """The mechanics of one whisk. `forward` begins at touch, `back` (None without a back stroke) ends there."""

    rod: Rod
    bar: Bar
    touch: Touch
    friction: Friction
    forward: Instants
    back: Instants | None

    @classmethod
    def run(cls, rod: Rod, bar: Bar, friction: Friction, touch: Touch, end_rad, *, stops_rad=(), back=False, step_rad):
        """March from touch to `end_rad` (and back) in steps, stopping exactly at `stops_rad`."""
        grid = np.arange(touch.motor_rad + step_rad, end_rad, step_rad)
        stops = np.asarray(stops_rad, float)
        up = np.unique(np.concatenate([grid, stops[(stops > touch.motor_rad) & (stops < end_rad)], [end_rad]]))
        up = up[np.append(np.diff(up) > 1e-9, True)]
        march = March(rod, bar, friction, touch)
        start = march.state
        path, states = march.along(up)
        forward = Instants.of(np.append(touch.motor_rad, path), [start, *states])
        if not back:
            return cls(rod, bar, touch, friction, forward, None)
        turn = (path[-1], states[-1])
        path, states = march.along(np.append(up[-2::-1], touch.motor_rad))
        return cls(rod, bar, touch, friction, forward, Instants.of(np.append(turn[0], path), [turn[1], *states]))

    def slip_mm(self, point_mm) -> np.ndarray:
        """Along the bar since first touch."""
        return (np.asarray(point_mm) - self.touch.point_mm) @ self.bar.axis

    def state_at(self, motor_rad: float) -> State | None:
        """The state of the forward stroke at one of its stops (after a jump there, if any); None before touch."""
        if motor_rad <= self.touch.motor_rad:
            return None
        at = np.searchsorted(self.forward.motor_rad, motor_rad + 1e-9, side="right") - 1
        return self.forward.states[at]

    def state_between(self, motor_rad: float) -> State | None:
        """The state of the forward stroke at any angle: force and arc on straight lines between instants; None before touch."""
        if motor_rad <= self.touch.motor_rad:
            return None
        angles, states = self.forward.motor_rad, self.forward.states
        at = int(np.clip(np.searchsorted(angles, motor_rad), 1, len(angles) - 1))
        before, after = states[at - 1], states[at]
        if before is None or after is None:
            return after
        part = (motor_rad - angles[at - 1]) / (angles[at] - angles[at - 1])
        force, arc = ((1 - part) * a + part * b for a, b in ((before.force_hub_N, after.force_hub_N), (before.arc_mm, after.arc_mm)))
        return replace(after, motor_rad=motor_rad, force_hub_N=force, arc_mm=float(arc))

    def slip_at(self, theta_rad: float) -> float:
        """Slip at a pushing angle, NaN where the stroke does not reach it."""
        motor = self.touch.motor_rad + theta_rad
        if motor > self.forward.motor_rad[-1]:
            return float("nan")
        return float(np.interp(motor, self.forward.motor_rad, self.slip_mm(self.forward.point_mm)))


def centreline_mm(rod: Rod, bar: Bar, motor_rad: float, state: State | None, arc_mm) -> np.ndarray:
    """Points (n, 3) of the whisker's centreline in the rig frame, bent by `state` or free."""
    if state is None:
        return unloaded(rod, motor_rad, arc_mm)[0]
    contact = Contact(rod, bar)
    force = state.force_hub_N
    across = float(np.hypot(force[1], force[2]))
    bent = contact.elastica.solve(force[0], across, state.arc_mm, state.angle)
    plane = contact.elastica.curve_mm(bent, arc_mm)
    e = np.array([0.0, force[1], force[2]]) / across
    points = plane[:, :1] * np.array([1.0, 0, 0]) + plane[:, 1:] * e
    return turned(points + rod.rest.offset_mm(arc_mm), motor_rad)

