"""A bent whisker on a round bar: the equations of one contact and their exact derivatives.

Unknowns: the bar's force on the whisker (hub frame, N), the arc length of the contact (mm), and where it slides, in which direction. Two equations say where the contact
is: the centreline's point nearest to the axis, at a distance of both radii (for the tip, the arc is the length instead of nearest).
Two more say what friction does in the plane that touches the bar:

- sliding: the force lies on the edge of the friction cone, against the motion of the whisker's material there, whatever its
  direction (along the bar or along the whisker);
- held: the material does not move along the bar. Along the whisker it slides all the same, since a rod that does not stretch cannot
  bend between two fixed points; what the cone leaves of the friction acts there.
"""

import math
from dataclasses import dataclass

import numpy as np

from bench.rig.bar import Bar, Touch, cross
from bench.rig.elastica import Elastica
from bench.rig.rod import Rod

_ACROSS = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class State:
    """One equilibrium in contact. Vectors in the rig frame except `force_hub_N`. `share`: force along the bar over the
    normal force (its size). `status` is held, sliding or tip."""

    motor_rad: float
    force_hub_N: np.ndarray
    arc_mm: float
    point_mm: np.ndarray
    tangent: np.ndarray
    share: float
    status: str
    heading_rad: float = 0.0  # direction of the material's motion: 0 along the bar, towards its other side at 90°
    motion_aside_mm: float = 0.0  # the material's motion round the bar in the last step
    angle: np.ndarray | None = None  # of the elastica, to start the next solution from

    @property
    def unknowns(self) -> np.ndarray:
        return np.append(self.force_hub_N, self.arc_mm)


@dataclass(frozen=True)
class _Pose:
    """Where the loaded point is and how it answers to the four unknowns: (3, 4) derivatives."""

    point: np.ndarray
    point_by: np.ndarray
    tangent: np.ndarray
    tangent_by: np.ndarray
    angle: np.ndarray


class Contact:
    """The contact problem of one whisker and one bar, solved by Newton's method at a given motor angle."""

    def __init__(self, rod: Rod, bar: Bar):
        self.rod, self.bar, self.elastica = rod, bar, Elastica(rod)
        self._flat = np.eye(3) - np.outer(bar.axis, bar.axis)

    def touching(self, touch: Touch) -> State:
        """The state at first touch, no force yet."""
        tangent = np.array([1.0, 0, 0]) + self.rod.rest.slope(touch.arc_mm)
        status = "tip" if touch.arc_mm >= self.rod.length_mm else "held"
        return State(touch.motor_rad, np.zeros(3), touch.arc_mm, touch.point_mm,
                     _turn(touch.motor_rad) @ tangent, 0.0, status)

    def hold(self, motor_rad: float, old: State, guess: np.ndarray, friction: float, tip=False) -> State:
        """Equilibrium at which the material has not moved along the bar since `old`, friction being what the cone leaves.

        `guess` (4,): force in the hub frame and arc. Raises ArithmeticError where Newton's method does not settle.
        """
        return self._solve(motor_rad, old, guess, _Held(friction), tip)

    def slide(self, motor_rad, old: State, guess: np.ndarray, heading_rad: float, friction: float, tip=False) -> State:
        """Equilibrium on the edge of the cone, the force against the motion since `old`.

        Raises ArithmeticError where Newton's method does not settle, or settles on a motion along the force.
        """
        return self._solve(motor_rad, old, np.append(guess, heading_rad), _Sliding(friction), tip)

    def _solve(self, motor_rad, old, unknowns, law, tip):
        turn, angle = _turn(motor_rad), old.angle
        for _ in range(30):
            pose = self._pose(turn, unknowns, angle)
            angle = pose.angle
            residual, jacobian, forces = self._equations(turn, unknowns, pose, old, law, tip)
            step = np.linalg.solve(jacobian, residual)
            unknowns = unknowns - step
            if _settled(step, unknowns):
                return self._state(motor_rad, unknowns, self._pose(turn, unknowns, angle), law, forces, tip)
        raise ArithmeticError(f"no contact found at motor angle {math.degrees(motor_rad):.4f} deg")

    def _state(self, motor_rad, unknowns, pose, law, forces, tip):
        press, shear, motion = forces
        heading = float(unknowns[4]) if len(unknowns) > 4 else 0.0
        onward = motion[0] * math.cos(heading) + motion[1] * math.sin(heading)
        if press < 0 or (len(unknowns) > 4 and onward < -1e-9):
            raise ArithmeticError("a contact that pulls, or friction along the motion")
        return State(motor_rad, unknowns[:3], unknowns[3], pose.point, pose.tangent, abs(shear[0]) / press,
                     "tip" if tip else law.status, heading, motion[1], pose.angle)

    def _pose(self, turn, unknowns, guess):
        force, arc = unknowns[:3], unknowns[3]
        across = math.hypot(force[1], force[2])
        e = np.array([0.0, force[1] / across, force[2] / across]) if across else _ACROSS
        bent = self.elastica.solve(force[0], across, arc, guess)
        planar = _planar_derivatives(e)
        point, point_by = _lift(bent.end_mm, bent.end_by, e, across, planar)
        ahead = np.array([math.cos(bent.slope), math.sin(bent.slope)])
        ahead_by = np.outer([-ahead[1], ahead[0]], bent.slope_by)
        tangent, tangent_by = _lift(ahead, ahead_by, e, across, planar)
        rest = self.rod.rest
        point, tangent = point + rest.offset_mm(arc), tangent + rest.slope(arc)
        point_by[:, 3] += rest.slope(arc)
        tangent_by[:, 3] += rest.curvature(arc)
        return _Pose(turn @ point, turn @ point_by, turn @ tangent, turn @ tangent_by, bent.angle)

    def _equations(self, turn, unknowns, pose, old, law, tip):
        bar, arc = self.bar, unknowns[3]
        apart = self._flat @ (pose.point - bar.point_mm)
        distance = math.sqrt(apart @ apart)
        normal = apart / distance
        normal_by = (self._flat - np.outer(normal, normal)) @ pose.point_by / distance
        side, side_by = cross(bar.axis, normal), _cross_matrix(bar.axis) @ normal_by
        reach = bar.radius_mm + float(self.rod.radius_mm(arc))
        taper = np.array([0, 0, 0, self.rod.taper])
        if tip:
            nearest, nearest_by = arc - self.rod.length_mm, np.array([0, 0, 0, 1.0])
        else:
            nearest = apart @ pose.tangent
            nearest_by = pose.tangent @ (self._flat @ pose.point_by) + apart @ pose.tangent_by
        touching, touching_by = distance - reach, normal @ pose.point_by - taper

        # How far has the material that is now at the contact moved since `old`?  The old rod was straight there.
        moved = pose.point - old.point_mm - old.tangent * (arc - old.arc_mm)
        moved_by = pose.point_by.copy()
        moved_by[:, 3] -= old.tangent
        motion = np.array([moved @ bar.axis, moved @ side])
        motion_by = np.stack([bar.axis @ moved_by, side @ moved_by + moved @ side_by])

        force, force_by = turn @ unknowns[:3], np.concatenate([turn, np.zeros((3, 1))], 1)
        press, press_by = force @ normal, normal @ force_by + force @ normal_by
        shear = np.array([force @ bar.axis, force @ side])
        shear_by = np.stack([bar.axis @ force_by, side @ force_by + force @ side_by])
        laws, laws_by = law(press, press_by, shear, shear_by, motion, motion_by, unknowns[4:])
        jacobian = np.zeros((len(unknowns), len(unknowns)))
        jacobian[0, :4], jacobian[1, :4], jacobian[2:] = nearest_by, touching_by, laws_by
        return np.array([nearest, touching, *laws]), jacobian, (press, shear, motion)

    def foot_side(self, state: State) -> float:
        """Positive where the bar's nearest point lies behind the contact along the whisker, negative ahead of it, mm."""
        return float((state.point_mm - self.bar.foot_mm(state.point_mm)) @ state.tangent)


def moments_Nmm(state: State) -> tuple[float, float]:
    """(m_y, m_z) that the base exerts on the whisker, in the hub frame: −(P × F)."""
    point = _turn(-state.motor_rad) @ state.point_mm
    moment = -cross(point, state.force_hub_N)
    return moment[1], moment[2]


@dataclass(frozen=True)
class _Sliding:
    """Shear force = −μ · normal force · unit vector at the heading; the motion has that heading too."""

    friction: float
    status = "sliding"

    def __call__(self, press, press_by, shear, shear_by, motion, motion_by, heading):
        ahead = np.array([math.cos(heading[0]), math.sin(heading[0])])
        aside = np.array([-ahead[1], ahead[0]])
        law_by = np.zeros((3, 5))
        law_by[:2, :4] = shear_by + self.friction * np.outer(ahead, press_by)
        law_by[:2, 4] = self.friction * press * aside
        law_by[2, :4], law_by[2, 4] = aside @ motion_by, -ahead @ motion
        return [*(shear + self.friction * press * ahead), aside @ motion], law_by


@dataclass(frozen=True)
class _Held:
    """No motion along the bar; along the whisker a friction μN(1 − x²), x = force along the bar / μN, against the motion.

    That is inside the cone, the whole of μN where nothing acts along the bar, and (unlike the cone's own circle) smooth at its end.
    """

    friction: float
    status = "held"

    def __call__(self, press, press_by, shear, shear_by, motion, motion_by, _):
        cone = self.friction * press
        x = shear[0] / cone if cone else 1.0
        if abs(x) >= 1:
            return [motion[0], shear[1]], np.stack([motion_by[0], shear_by[1]])
        way = math.copysign(1.0, motion[1])
        left_by = (1 + x**2) * self.friction * press_by - 2 * x * shear_by[0]
        law = [motion[0], shear[1] + way * cone * (1 - x**2)]
        return law, np.stack([motion_by[0], shear_by[1] + way * left_by])


def _lift(planar, planar_by, e, across, by_force):
    """A vector of the plane of bending in three dimensions, and its derivatives by (F_x, F_y, F_z, arc)."""
    vector = np.array([planar[0], 0, 0]) + planar[1] * e
    by = np.outer([1.0, 0, 0], planar_by[0] @ by_force) + np.outer(e, planar_by[1] @ by_force)
    sideways = planar[1] / across if across else planar_by[1, 1]
    by[1:, 1:3] += sideways * (np.eye(2) - np.outer(e[1:], e[1:]))
    return vector, by


def _planar_derivatives(e):
    """(F_x, F across, arc) by (F_x, F_y, F_z, arc)."""
    return np.array([[1.0, 0, 0, 0], [0, e[1], e[2], 0], [0, 0, 0, 1.0]])


def _turn(angle_rad):
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1.0]])


def _cross_matrix(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def _settled(step, unknowns):
    force = math.sqrt(unknowns[:3] @ unknowns[:3])
    if len(step) > 4 and abs(step[4]) > 1e-7:
        return False
    return np.abs(step[:3]).max() <= 1e-9 * force and abs(step[3]) < 1e-9 * unknowns[3]
