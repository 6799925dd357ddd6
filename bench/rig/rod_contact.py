"""A bent whisker on a round bar: the equations of one contact and their exact derivatives, solved by Newton's method.

Unknowns: the bar's force on the whisker (hub frame, N), the arc length of the contact (mm), and where it slides, in
which direction. Two equations say where the contact is: the centreline's point nearest to the axis, at a distance of
both radii (for the tip, the arc is the length instead of nearest). The others say what friction does in the plane
that touches the bar:

- sliding: the force lies on the edge of the friction cone, against the motion of the whisker's material there,
  whatever its direction (along the bar or along the whisker);
- held: the material does not move along the bar. Along the whisker it slides all the same, since a rod that does not
  stretch cannot bend between two fixed points; what the cone leaves of the friction acts there.
"""

import math
from dataclasses import dataclass

import numpy as np

from bench.rig.bar import Bar, Touch, cross, cross_matrix
from bench.rig.elastic_rod import Rod
from bench.rig.elastica import Elastica
from bench.rig.laws import GIVE_MM, Held, Oiled, Sliding
from bench.rig.linear import solved

_PARTS = 0.5 ** np.arange(8)  # of a Newton step, tried in turn until one helps
_ACROSS = np.array([0.0, 1.0, 0.0])  # (3,): way across the whisker where no force tells one
_BACKWARDS_MM = -1e-9  # mm: less is rounding
_LAST = 1e-6  # of a Newton step, in parts


@dataclass(frozen=True)
class ContactState:
    """One equilibrium in contact. Vectors in the rig frame except `force_hub_N`. `share`: force along the bar over
    the normal force (its size). `heading_rad`: direction of the material's motion, 0 along the bar. `status` is
    held, sliding or tip.
    """

    motor_rad: float
    force_hub_N: np.ndarray
    arc_mm: float
    point_mm: np.ndarray
    tangent: np.ndarray
    share: float
    status: str
    heading_rad: float = 0.0
    motion_aside_mm: float = 0.0  # the material's motion round the bar in the last step
    angle: np.ndarray | None = None  # of the elastica, to start the next solution from

    @property
    def unknowns(self) -> np.ndarray:
        """What the equilibrium is solved for, (4,): the force (3,) in the hub's axes and the arc length."""
        return np.append(self.force_hub_N, self.arc_mm)


class Contact:
    """The contact problem of one whisker and one bar at a given motor angle.

    `guess` (4,) is a force in the hub frame and an arc. Everything raises ArithmeticError where no contact is found,
    or one that pulls, or friction along the motion.
    """

    def __init__(self, rod: Rod, bar: Bar):
        self.rod, self.bar, self.elastica = rod, bar, Elastica(rod)

    def touching(self, touch: Touch) -> ContactState:
        """The state at first touch, no force yet."""
        tangent = np.array([1.0, 0, 0]) + self.rod.rest.slope(touch.arc_mm)
        status = "tip" if touch.arc_mm >= self.rod.length_mm else "held"
        return ContactState(
            touch.motor_rad,
            np.zeros(3),
            touch.arc_mm,
            touch.point_mm,
            _turn(touch.motor_rad) @ tangent,
            0.0,
            status,
        )

    def hold(
        self,
        motor_rad: float,
        old: ContactState,
        guess: np.ndarray,
        friction: float,
        tip: bool = False,
    ) -> ContactState:
        """Equilibrium at which the material has not moved along the bar since `old`, friction being what the cone
        leaves.
        """
        return self._solve(motor_rad, old, guess, Held(friction), tip)

    def slide(
        self,
        motor_rad: float,
        old: ContactState,
        guess: np.ndarray,
        heading_rad: float,
        friction: float,
        tip: bool = False,
    ) -> ContactState:
        """Equilibrium on the edge of the cone, the force against the motion since `old`."""
        return self._solve(motor_rad, old, np.append(guess, heading_rad), Sliding(friction), tip)

    def ease(
        self,
        motor_rad: float,
        old: ContactState,
        guess: np.ndarray,
        friction: float,
        tip: bool = False,
    ) -> ContactState:
        """Sliding where no heading is at hand (the motor has just turned back): friction first as soft as oil, then
        ever stiffer, until it gives way by no more than 10 nm."""
        for give_mm in np.geomspace(1.0, GIVE_MM, 16):
            state = self._solve(motor_rad, old, guess, Oiled(friction, give_mm), tip)
            guess = state.unknowns
        return state

    def foot_side(self, state: ContactState) -> float:
        """Positive where the bar's nearest point lies behind the contact along the whisker, negative ahead of it."""
        foot = self.bar.at(state.motor_rad).foot_mm(state.point_mm)
        return float((state.point_mm - foot) @ state.tangent)

    def _solve(self, motor_rad, old, unknowns, law, tip):
        """Newton's method with Deuflhard's monotonicity test: a step is halved until the next one would be smaller."""
        bar = self.bar
        went = bar.moved_mm(motor_rad) - bar.moved_mm(old.motor_rad)
        problem = _Problem(self, bar.at(motor_rad), went, _turn(motor_rad), old, law, tip)
        here = problem.at(unknowns, old.angle)
        for _ in range(40):
            step = solved(here.jacobian, here.residual)
            if _settled(step, unknowns):
                return here.state(motor_rad, unknowns, step, "tip" if tip else law.status)
            unknowns, here = problem.nearer(unknowns, here, step)
        raise ArithmeticError(f"no contact found at motor angle {math.degrees(motor_rad):.4f} deg")


@dataclass(frozen=True)
class _Pose:
    """Where the loaded point is and how it answers to the force and the arc: (3, 4) derivatives, rig frame."""

    point: np.ndarray
    point_by: np.ndarray
    tangent: np.ndarray
    tangent_by: np.ndarray
    angle: np.ndarray

    @classmethod
    def of(cls, contact: Contact, turn, unknowns, guess) -> "_Pose":
        force, arc = unknowns[:3], unknowns[3]
        across = math.hypot(force[1], force[2])
        e = np.array([0.0, force[1] / across, force[2] / across]) if across else _ACROSS
        bent = contact.elastica.solve(force[0], across, arc, guess)
        point, point_by = _lift(bent.end_mm, bent.end_by, e, across)
        ahead = np.array([math.cos(bent.slope), math.sin(bent.slope)])
        tangent, tangent_by = _lift(
            ahead, np.outer([-ahead[1], ahead[0]], bent.slope_by), e, across
        )
        rest = contact.rod.rest
        slope = rest.slope(arc)
        point_by[:, 3] += slope
        tangent_by[:, 3] += rest.curvature(arc)
        return cls(
            turn @ (point + rest.offset_mm(arc)),
            turn @ point_by,
            turn @ (tangent + slope),
            turn @ tangent_by,
            bent.angle,
        )


def _lift(planar, planar_by, e, across):
    """A vector of the plane of bending in three dimensions, and its derivatives by (F_x, F_y, F_z, arc)."""
    vector = np.array([planar[0], 0, 0]) + planar[1] * e
    by_force = np.array([[1.0, 0, 0, 0], [0, e[1], e[2], 0], [0, 0, 0, 1.0]])
    by = np.outer([1.0, 0, 0], planar_by[0] @ by_force) + np.outer(e, planar_by[1] @ by_force)
    sideways = planar[1] / across if across else planar_by[1, 1]
    by[1:, 1:3] += sideways * (np.eye(2) - np.outer(e[1:], e[1:]))
    return vector, by


@dataclass(frozen=True)
class _Here:
    """The equations at one set of unknowns. `press`, `shear`, `motion` as the laws of friction see them."""

    pose: _Pose
    residual: np.ndarray
    jacobian: np.ndarray
    press: float
    shear: np.ndarray
    motion: np.ndarray

    def state(self, motor_rad, unknowns, step, status) -> ContactState:
        """The solution after Newton's last step: the pose follows to first order, what is left is the step squared."""
        point, tangent = (
            v - by @ step[:4]
            for v, by in (
                (self.pose.point, self.pose.point_by),
                (self.pose.tangent, self.pose.tangent_by),
            )
        )
        unknowns = unknowns - step
        sliding = len(unknowns) > 4
        heading = float(unknowns[4]) if sliding else math.atan2(self.motion[1], self.motion[0])
        onward = self.motion[0] * math.cos(heading) + self.motion[1] * math.sin(heading)
        if self.press < 0 or (sliding and onward < _BACKWARDS_MM):
            raise ArithmeticError("a contact that pulls, or friction along the motion")
        share = abs(self.shear[0]) / self.press
        return ContactState(
            motor_rad,
            unknowns[:3],
            float(unknowns[3]),
            point,
            tangent,
            share,
            status,
            heading,
            float(self.motion[1]),
            self.pose.angle,
        )


@dataclass(frozen=True)
class _Problem:
    """What stays the same while Newton's method runs. bar: where it is now; went: how far it has come since `old`."""

    contact: Contact
    bar: Bar
    went: np.ndarray
    turn: np.ndarray
    old: ContactState
    law: Sliding | Oiled | Held
    tip: bool

    def at(self, unknowns, angle) -> _Here:
        """The equations at unknowns, the elastica starting from `angle`."""
        pose = _Pose.of(self.contact, self.turn, unknowns, angle)
        bar = self.bar
        apart, flat, axis, turning = bar.around(pose.point)
        axis_by = turning @ pose.point_by
        distance = math.sqrt(apart @ apart)
        normal = apart / distance
        normal_by = (flat - np.outer(normal, normal)) @ pose.point_by / distance
        side, side_by = (
            cross(axis, normal),
            cross_matrix(axis) @ normal_by - cross_matrix(normal) @ axis_by,
        )
        ways = (axis, axis_by), (side, side_by)
        press, press_by, shear, shear_by = self._forces(unknowns, normal, normal_by, *ways)
        motion, motion_by = self._motion(unknowns[3], pose, *ways)
        laws, laws_by = self.law(press, press_by, shear, shear_by, motion, motion_by, unknowns[4:])
        jacobian = np.zeros((len(unknowns), len(unknowns)))
        nearest, jacobian[0, :4] = self._nearest(unknowns[3], pose, flat, apart)
        jacobian[1, :4] = normal @ pose.point_by + press_by / bar.stiffness_N_mm
        jacobian[1, 3] -= self.contact.rod.taper
        jacobian[2:] = laws_by
        reach = bar.radius_mm + float(self.contact.rod.radius_mm(unknowns[3]))
        apart_mm = distance + press / bar.stiffness_N_mm - reach
        return _Here(pose, np.array([nearest, apart_mm, *laws]), jacobian, press, shear, motion)

    def _nearest(self, arc, pose, flat, apart):
        """Zero where the contact is the nearest point (or the tip)."""
        if self.tip:
            return arc - self.contact.rod.length_mm, np.array([0, 0, 0, 1.0])
        return apart @ pose.tangent, pose.tangent @ (flat @ pose.point_by) + apart @ pose.tangent_by

    def _forces(self, unknowns, normal, normal_by, along, around):
        """Normal and shear force, the latter along the bar and round it."""
        force = self.turn @ unknowns[:3]
        force_by = np.concatenate([self.turn, np.zeros((3, 1))], 1)
        press, press_by = force @ normal, normal @ force_by + force @ normal_by
        shear = np.array([force @ way for way, _ in (along, around)])
        return (
            press,
            press_by,
            shear,
            np.stack([way @ force_by + force @ by for way, by in (along, around)]),
        )

    def _motion(self, arc, pose, along, around):
        """How far the material that is now at the contact has moved over the bar since `old`. The old rod was straight
        there."""
        old = self.old
        moved = pose.point - old.point_mm - old.tangent * (arc - old.arc_mm) - self.went
        moved_by = pose.point_by.copy()
        moved_by[:, 3] -= old.tangent
        motion = np.array([moved @ way for way, _ in (along, around)])
        return motion, np.stack([way @ moved_by + moved @ by for way, by in (along, around)])

    def nearer(self, unknowns, here, step):
        """The unknowns after as much of a step as is good, and the equations there."""
        force = np.abs(unknowns[:3]).max() + np.abs(step[:3]).max()
        size = np.array([1 / force] * 3 + [1.0, 1.0])[: len(step)]
        length = np.linalg.norm(size * step)
        for part in _PARTS:
            try:
                there = self.at(unknowns - part * step, here.pose.angle)
                left = np.linalg.norm(size * solved(here.jacobian, there.residual))
            except ArithmeticError:
                continue
            if left <= (1 - part / 4) * length or part == _PARTS[-1]:
                return unknowns - part * step, there
        raise ArithmeticError("no way towards a contact found")


def moments_Nmm(state: ContactState) -> tuple[float, float]:
    """(m_y, m_z) that the base exerts on the whisker, in the hub frame: −(P × F)."""
    point = _turn(-state.motor_rad) @ state.point_mm
    moment = -cross(point, state.force_hub_N)
    return moment[1], moment[2]


def _turn(angle_rad):
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1.0]])


def _settled(step, unknowns):
    """After one more step, which is taken, the solution is exact to the square of this."""
    force = math.sqrt(unknowns[:3] @ unknowns[:3])
    if len(step) > 4 and abs(step[4]) > _LAST:
        return False
    return np.abs(step[:3]).max() <= _LAST * force and abs(step[3]) < _LAST * unknowns[3]
