"""A bent whisker on a round object: the equations of one contact, solved by Newton's method.

Unknowns: the object's force on the whisker (hub frame, N), the arc length of the contact (mm), and
where it slides, in which direction. Two equations say where the contact is: where the whisker's
surface is nearest to the object's axis, the centreline at a distance of both radii (for the tip, the
arc is the length instead of nearest). The distance falls along a whisker there as its radius does.
The other equations say what friction does in the plane that touches the object:

- sliding: the force lies on the edge of the friction cone, against the motion of the whisker's
  material there, whatever its direction (along the object or along the whisker);
- held: the material does not move along the object. Along the whisker it slides all the same, since
  an inextensible rod cannot bend between two fixed points; what the cone leaves of the
  friction acts there.
"""

import math
from dataclasses import dataclass

import numpy as np

from bench.rig.bar import UnloadedTouch
from bench.rig.elastic_rod import Rod
from bench.rig.friction_laws import ContactLoad, Held, RegularisedSliding, Sliding
from bench.rig.kirchhoff_rod import KirchhoffRod
from bench.rig.linear import across, cross, cross_matrix, rotation_about_z, solve
from bench.rig.loaded_point import BentRod, LoadedPoint
from bench.rig.planar_rod import PlanarRod
from bench.rig.touched_object import TouchedObject

# [1] Steps of Newton's method before it is given up. Stated.
_MOST_STEPS = 40
_PARTS = 0.5 ** np.arange(8)  # of a Newton step, tried in turn until one helps
_BACKWARDS = -1e-11  # lengths of motion: less is rounding
_MUCH = 0.01  # lengths by which a step's arc counts as much as all of the force
_LAST = 1e-6  # of a Newton step, in parts


@dataclass(frozen=True)
class ContactState:
    """One equilibrium in contact, in the rig frame except `force_hub_N`.

    shear_ratio: size of the force along the object over the normal force. status: held, sliding or
    tip. heading_rad: direction of the material's motion, 0 along the object. motion_round_mm: the
    material's motion round the object in the last step. shape: of the whisker, to start the
    next solution from.
    """

    motor_rad: float
    force_hub_N: np.ndarray
    arc_mm: float
    point_mm: np.ndarray
    tangent: np.ndarray
    shear_ratio: float
    status: str
    heading_rad: float = 0.0
    motion_round_mm: float = 0.0
    shape: np.ndarray | None = None

    @property
    def unknowns(self) -> np.ndarray:
        """Return what the equilibrium is solved for, (4,): the force (3,) in the hub's axes and
        the arc length."""
        return np.append(self.force_hub_N, self.arc_mm)


def bent_rod(rod: Rod) -> BentRod:
    """Return what bends a whisker: in the plane where it is straight, else in space."""
    return PlanarRod(rod) if rod.rest.is_straight else KirchhoffRod(rod)


class RodContact:
    """The contact problem of one whisker and one object."""

    def __init__(self, rod: Rod, bar: TouchedObject):
        self.rod = rod
        self.bar = bar
        self.bent_rod = bent_rod(rod)

    def touch_state(self, touch: UnloadedTouch) -> ContactState:
        """Return the state at first touch, without force."""
        tangent = self.rod.rest.tangent(touch.arc_mm)
        return ContactState(
            touch.motor_rad,
            np.zeros(3),
            touch.arc_mm,
            touch.point_mm,
            rotation_about_z(touch.motor_rad) @ tangent,
            0.0,
            "tip" if touch.arc_mm >= self.rod.length_mm else "held",
        )

    def is_past_foot(self, state: ContactState) -> bool:
        """Return whether the object's nearest point lies behind the contact along the whisker."""
        away = state.point_mm - self.bar.at(state.motor_rad).foot_mm(state.point_mm)
        taper = self.rod.taper_at(state.arc_mm)
        return bool(away @ state.tangent > taper * np.linalg.norm(away))

    def solve(
        self,
        motor_rad: float,
        old: ContactState,
        unknowns: np.ndarray,
        law: Sliding | RegularisedSliding | Held,
        tip: bool,
    ) -> ContactState:
        """Find the equilibrium under a law of friction, the material having moved since `old`.

        unknowns: a guess of the force (3,) in the hub frame, the arc, and the law's own. tip:
        whether the tip touches. Newton's method with Deuflhard's monotonicity test: a step is
        halved until the next one would be smaller. Raises ArithmeticError where no contact is
        found, or one that pulls, or friction along the motion.
        """
        bar = self.bar.at(motor_rad)
        bar_moved_mm = self.bar.moved_mm(motor_rad) - self.bar.moved_mm(old.motor_rad)
        problem = _Problem(self, bar, bar_moved_mm, rotation_about_z(motor_rad), old, law, tip)
        here = problem.at(unknowns, old.shape)
        for _ in range(_MOST_STEPS):
            step = solve(here.jacobian, here.residual)
            if _has_converged(step, unknowns):
                status = "tip" if tip else law.status
                return here.state(motor_rad, unknowns, step, status, self.rod.length_mm)
            unknowns, here = problem.step(unknowns, here, step)
        raise ArithmeticError(f"no contact found at motor angle {math.degrees(motor_rad):.4f} deg")


@dataclass(frozen=True)
class _Equations:
    """The equations at one set of unknowns: residual (n,), jacobian (n, n)."""

    loaded: LoadedPoint
    residual: np.ndarray
    jacobian: np.ndarray
    load: ContactLoad

    def state(self, motor_rad, unknowns, step, status, length_mm) -> ContactState:
        """Return the solution after Newton's last step.

        The loaded point follows to first order; what is left is of the order of the step squared.
        """
        loaded = self.loaded
        load = self.load
        unknowns = unknowns - step
        slides = len(unknowns) > 4
        heading = float(unknowns[4]) if slides else math.atan2(*load.motion[::-1])
        onward_mm = load.motion @ [math.cos(heading), math.sin(heading)]
        if load.press < 0 or (slides and onward_mm < _BACKWARDS * length_mm):
            raise ArithmeticError("a contact that pulls, or friction along the motion")
        return ContactState(
            motor_rad,
            unknowns[:3],
            float(unknowns[3]),
            loaded.point - loaded.point_by @ step[:4],
            loaded.tangent - loaded.tangent_by @ step[:4],
            abs(load.shear[0]) / load.press,
            status,
            heading,
            float(load.motion[1]),
            loaded.shape,
        )


@dataclass(frozen=True)
class _Problem:
    """What stays the same while Newton's method runs.

    bar: the object where it is now. bar_moved_mm (3,): how far it has moved since `old`. rotation
    (3, 3): of the hub.
    """

    contact: RodContact
    bar: TouchedObject
    bar_moved_mm: np.ndarray
    rotation: np.ndarray
    old: ContactState
    law: Sliding | RegularisedSliding | Held
    tip: bool

    def at(self, unknowns, shape) -> _Equations:
        """Return the equations at unknowns (n,), the whisker starting from `shape`."""
        loaded = self.contact.bent_rod.solve(self.rotation, unknowns, shape)
        local = self.bar.local_bar(loaded.point)
        offset_by = local.offset_by @ loaded.point_by
        distance = math.sqrt(local.offset_mm @ local.offset_mm)
        frame, frame_by = _contact_frame(local, offset_by, distance, loaded.point_by)
        load = self._load(unknowns, loaded, frame, frame_by)
        residual = np.empty_like(unknowns)
        jacobian = np.zeros((len(unknowns), len(unknowns)))
        residual[0], jacobian[0, :4] = self._off_nearest(
            unknowns, loaded, local, offset_by, distance
        )
        residual[1], jacobian[1, :4] = self._gap_mm(unknowns, loaded, frame[0], distance, load)
        residual[2:], jacobian[2:] = self.law.equations(load, unknowns[4:])
        return _Equations(loaded, residual, jacobian, load)

    def _off_nearest(
        self, unknowns, loaded, local, offset_by, distance
    ) -> tuple[float, np.ndarray]:
        """Return how far the contact is along the whisker from where it belongs, and the
        derivatives (4,) of that: where its surface is nearest to the object's axis, or the tip.

        distance: between centreline and the object's axis, mm.
        """
        rod = self.contact.rod
        if self.tip:
            return unknowns[3] - rod.length_mm, np.array([0.0, 0.0, 0.0, 1.0])
        taper = rod.taper_at(unknowns[3])
        off_by = loaded.tangent @ offset_by + local.offset_mm @ loaded.tangent_by
        off_by = off_by - taper / distance * (local.offset_mm @ offset_by)
        off_by[3] -= distance * rod.taper_by_arc(unknowns[3])
        return local.offset_mm @ loaded.tangent - distance * taper, off_by

    def _gap_mm(self, unknowns, loaded, normal, distance, load) -> tuple[float, np.ndarray]:
        """Return the gap between the surfaces, as the force presses them, and its derivatives (4,).

        normal (3,): of the contact. distance: between centreline and the object's axis, mm.
        """
        rod = self.contact.rod
        stiffness = self.bar.stiffness_N_mm
        reach = self.bar.radius_mm + float(rod.radius_mm(unknowns[3]))
        gap_by = normal @ loaded.point_by + load.press_by / stiffness
        gap_by[3] -= rod.taper_at(unknowns[3])
        return distance + load.press / stiffness - reach, gap_by

    def _load(self, unknowns, loaded, frame, frame_by) -> ContactLoad:
        """Return forces and motion in the frame of the contact."""
        force = self.rotation @ unknowns[:3]
        force_by = np.zeros((3, 4))
        force_by[:, :3] = self.rotation
        forces, forces_by = _components(frame, frame_by, force, force_by)
        # How far the material now at the contact has moved over the object; the old rod was
        # straight there.
        old = self.old
        moved = loaded.point - old.point_mm - old.tangent * (unknowns[3] - old.arc_mm)
        moved_by = loaded.point_by.copy()
        moved_by[:, 3] -= old.tangent
        motion, motion_by = _components(
            frame[1:], frame_by[1:], moved - self.bar_moved_mm, moved_by
        )
        return ContactLoad(forces[0], forces_by[0], forces[1:], forces_by[1:], motion, motion_by)

    def step(self, unknowns, here, step):
        """Return the unknowns after as much of a step as brings them nearer, and the equations
        there."""
        force = np.abs(unknowns[:3]).max() + np.abs(step[:3]).max()
        per_mm = 1 / (_MUCH * self.contact.rod.length_mm)
        size = np.array([1 / force, 1 / force, 1 / force, per_mm, 1.0])[: len(step)]
        length = np.linalg.norm(size * step)
        for part in _PARTS:
            tried = unknowns - part * step
            try:
                there = self.at(tried, here.loaded.shape)
                left = np.linalg.norm(size * solve(here.jacobian, there.residual))
            except ArithmeticError:
                continue
            if left <= (1 - part / 4) * length or part == _PARTS[-1]:
                return tried, there
        raise ArithmeticError("no way towards a contact found")


def _contact_frame(local, offset_by, distance, point_by):
    """Return the unit vectors (3, 3) of the contact as rows, normal, along the object and round
    it, and their derivatives (3, 3, 4)."""
    normal = local.offset_mm / distance
    normal_by = across(normal) @ offset_by / distance
    along_by = local.axis_by @ point_by
    around = cross(local.axis, normal)
    around_by = cross_matrix(local.axis) @ normal_by - cross_matrix(normal) @ along_by
    return np.array([normal, local.axis, around]), np.array([normal_by, along_by, around_by])


def _components(frame, frame_by, vector, vector_by):
    """Return the components (k,) of a vector (3,) along the rows of a frame (k, 3), and their
    derivatives (k, 4)."""
    return frame @ vector, frame @ vector_by + vector @ frame_by


def moments_Nmm(state: ContactState) -> tuple[float, float]:
    """Return (m_y, m_z) that the base exerts on the whisker, in the hub frame: −(P × F)."""
    point = rotation_about_z(-state.motor_rad) @ state.point_mm
    moment = -cross(point, state.force_hub_N)
    return moment[1], moment[2]


def _has_converged(step, unknowns):
    """Return whether a step is so small that the solution after it is exact to its square."""
    force = math.sqrt(unknowns[:3] @ unknowns[:3])
    if len(step) > 4 and abs(step[4]) > _LAST:
        return False
    return np.abs(step[:3]).max() <= _LAST * force and abs(step[3]) < _LAST * unknowns[3]
