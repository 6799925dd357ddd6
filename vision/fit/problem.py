"""One whisk as an estimation problem: what is known, what is seen, its parameters, and the curves
that they mean.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from vision.fit.bend_onset import Onset
from vision.fit.blocks import BAR_MODES_PX, BAR_PRIOR, WIRE_MODES_PX, Blocks
from vision.fit.motion import Motion, Yielding, between
from vision.geometry.camera import Cameras
from vision.geometry.centreline import REST_POWERS, Curves, centrelines, unbent_centrelines
from vision.geometry.contact import axis_frame, closest_arc
from vision.geometry.rods import Rods, Wire
from vision.geometry.touched import Axis
from vision.wire.points import SHARED, Observed

# [px] A line also wanders with what is behind it, by so much, over `WANDER_MM` of wire. Set by eye.
# Study: broken_beams.py.
WANDER_PX = 0.25
# [mm] Distance between the knots of such a wandering line. Set by eye. Study: broken_beams.py.
WANDER_MM = 12.0
# [mm] Lever over which the tilt of a bar's line is counted, as in `touched/pieces.py`: a layout.
BAR_TILT_ARM_MM = 20.0
# [mm] How far axis and centreline may be from reach: a tenth of what 0.1 px is on the bench, so
# that touching holds as a condition. Derived.
CONTACT_SIGMA_MM = 0.002


@dataclass(frozen=True, eq=False)
class Problem:
    """What is known and seen of one whisk.

    motor_rad (f,); touching, bent (f,) bool: frames held to the touching distance, frames that may
    bend. axis: where the object's four parameters are counted from, and a fifth of a rounded
    object, along its direction. onset: when the whisker begins to bend; None where the cameras determine
    the distance of whisker and bar in space. Of a bar that gives way it is when that begins, and touch
    is later by the motion's first parameter. neighbour_correlation: by camera, the share of its error that a
    point of the wire has in common with the next one; 0 where empty (see `vision.fit.scatter`).
    motion: of a bar that does not stand still. axis_sigma (4,): by how much the object may be off its axis:
    two shifts, mm, and two tilts, rad, across it.

    Residuals are ordered by line points, touching frames, priors, onset.
    """

    cameras: Cameras
    rods: Rods
    axis: Axis
    motor_rad: np.ndarray
    touching: np.ndarray
    bent: np.ndarray
    seen: Sequence[Observed]
    onset: Onset | None = None
    neighbour_correlation: Sequence[float] = ()
    motion: Motion | Yielding | None = None
    axis_sigma: np.ndarray = field(default_factory=BAR_PRIOR.copy)

    @property
    def wire(self) -> Wire:
        """Return the whisker."""
        return self.rods.wire

    @cached_property
    def blocks(self) -> Blocks:
        """Return the blocks of the parameter vector."""
        return Blocks.laid_out(
            reach_sigma_mm=self.rods.reach_sigma_mm,
            taper_sigma_per_mm=self.wire.taper_sigma_per_mm,
            offset_sigma_px=self._offset_sigma_px(),
            motion_sigma=() if self.motion is None else self.motion.sigma,
            touched=self.rods.bar,
            bent_frames=int(np.sum(self.bent)),
            axis_sigma=self.axis_sigma,
        )

    @property
    def size(self) -> int:
        """Return the number of parameters."""
        return self.blocks.size

    @property
    def first_bend(self) -> int:
        """Return the index of the first bend."""
        return self.blocks.bends.start

    def bend_of(self, frame: int) -> slice:
        """Return the place of a frame's two bends in the vector; the frame may bend."""
        first = self.first_bend + 2 * int(np.sum(self.bent[:frame]))
        return slice(first, first + 2)

    def seen_of_wire(self, camera: int) -> list[Observed]:
        """Return what one camera has seen of the wire, by its number."""
        return [one for one in self.seen if one.camera == camera and one.on_wire]

    @property
    def contact_rows(self) -> slice:
        """Return the place of the touching frames among the residuals: behind the line points."""
        first = sum(len(seen.points) for seen in self.seen)
        return slice(first, first + int(np.sum(self.touching)))

    @property
    def prior_rows(self) -> slice:
        """Return the place of the parameters' priors among the residuals: behind the touching
        frames.
        """
        first = self.contact_rows.stop
        return slice(first, first + self.size)

    def _offset_sigma_px(self) -> np.ndarray:
        """Return sigmas (cameras, 12) in px by which a camera's lines of wire and bar are off as a
        whole.
        """
        rows = []
        for camera in range(len(self.cameras)):
            own = [one for one in self.seen if one.camera == camera]
            wire = [one.points.shared_px for one in own if one.on_wire]
            bar = [one.points.shared_px for one in own if not one.on_wire]
            rows.append([*self._wire_sigma_px(wire), *np.ones(SHARED), *_bar_sigma_px(bar)])
        return np.array(rows)

    def _wire_sigma_px(self, shared_px: Sequence[np.ndarray]) -> np.ndarray:
        """Return sigmas (6,) in px by which one camera's lines of the wire are off as a whole.

        As the wire turns before the light, an offset changes by as much over a radian. shared_px:
        of each line (n, SHARED).
        """
        sigma = WIRE_MODES_PX.copy()
        half_swing_rad = 0.5 * float(np.ptp(self.motor_rad))
        points = [row for line in shared_px for row in line]
        common = np.linalg.norm(np.mean(points, axis=0)) if points else 0.0
        constant = np.hypot(sigma[:2], [common, 0.0])  # of offset and tilt
        sigma[2:4] = np.hypot(sigma[2:4], half_swing_rad * constant)
        sigma[4:6] = np.hypot(sigma[4:6], 0.5 * half_swing_rad**2 * constant)
        return sigma


def _bar_sigma_px(shared_px: Sequence[np.ndarray]) -> np.ndarray:
    """Return sigmas (2,) in px by which one camera's lines of the bar are off as a whole.

    They are what points share, where these say so. shared_px: of each line (n, SHARED).
    """
    if not shared_px or not np.any(np.concatenate(shared_px)):
        return BAR_MODES_PX
    return np.sqrt(np.mean(np.concatenate(shared_px)[:, :2] ** 2, axis=0))


@dataclass(frozen=True, eq=False)
class State:
    """Parameters in one vector, with the contact arcs (f,) from which the next evaluation
    starts.
    """

    vector: np.ndarray
    arcs_mm: np.ndarray


def at_rest(problem: Problem, rest_mm: np.ndarray) -> np.ndarray:
    """Return the parameters (size,) of an unbent wire of this rest shape (2, 4), mm, and an object where
    it is counted from.
    """
    vector = np.zeros(problem.size)
    vector[problem.blocks.rest_shape.slice] = np.ravel(rest_mm)
    return vector


def bar_axis(problem: Problem, vector: np.ndarray) -> Axis:
    """Return the object's axis by parameters (…, size): shifted and tilted, and shifted along
    itself where the object has a parameter for that.
    """
    own = vector[..., problem.blocks.shift_along.slice]  # (…, 1), or (…, 0) of a bar
    along_mm = np.sum(own, axis=-1, keepdims=True)
    return problem.axis.shifted(axis_frame(problem.axis.direction), vector, along_mm)


def shifts_mm(problem: Problem, vector: np.ndarray) -> np.ndarray:
    """Return how far (…, f, 3) the bar is in each frame from `bar_axis`; (…, 1, 3) of 0 where it
    stands.
    """
    if problem.motion is None:
        return np.zeros((*vector.shape[:-1], 1, 3))
    return problem.motion.shift_mm(vector[..., problem.blocks.motion.slice])


def bar_axes(problem: Problem, vector: np.ndarray) -> Axis:
    """Return the bar's axis (…, f, 3) in each frame; (…, 1, 3) where it stands."""
    axis = bar_axis(problem, vector)
    point = axis.point_mm[..., None, :]
    direction = axis.direction[..., None, :]
    if problem.motion is not None:
        point = point + shifts_mm(problem, vector)
        direction = np.broadcast_to(direction, point.shape)
    return replace(axis, point_mm=point, direction=direction)


def shift_at_mm(problem: Problem, vector: np.ndarray, motor_rad: np.ndarray) -> np.ndarray:
    """Return how far (…, 3) the bar is from `bar_axis` as the motor passes angles (…) up to
    touch.
    """
    if problem.motion is None or problem.motion.from_touch:
        return np.zeros(3)
    return between(problem.motor_rad, shifts_mm(problem, vector), motor_rad)


def rest_shape(problem: Problem, vector: np.ndarray) -> np.ndarray:
    """Return the rest polynomials (…, 2, 4) in mm."""
    own = vector[..., problem.blocks.rest_shape.slice]
    return own.reshape(*vector.shape[:-1], 2, REST_POWERS)


def wire_of(problem: Problem, vector: np.ndarray, axes: int) -> Wire:
    """Return the whisker by parameters (…, size), to be asked at arc lengths of so many axes more."""
    taper = vector[..., problem.blocks.taper.slice]  # (…, 1), or (…, 0) of one that does not taper
    if not taper.shape[-1]:
        return problem.wire
    shape = (*vector.shape[:-1], *[1] * axes)
    return replace(problem.wire, taper_error_per_mm=taper.reshape(shape))


def reach_mm(problem: Problem, vector: np.ndarray, arc_mm: np.ndarray) -> np.ndarray:
    """Return the distance (…) of the two axes where they touch at arc lengths (…), by parameters."""
    wire = wire_of(problem, vector, arc_mm.ndim - vector.ndim + 1)
    return replace(problem.rods, wire=wire).reach_mm(arc_mm)


def bends(problem: Problem, vector: np.ndarray) -> np.ndarray:
    """Return tangent angles at the contact (…, f, 2), rad; zero in frames that may not bend."""
    batch = vector.shape[:-1]
    angles = np.zeros((*batch, len(problem.motor_rad), 2))
    own = vector[..., problem.blocks.bends.slice]
    angles[..., problem.bent, :] = own.reshape(*batch, -1, 2)
    return angles


def curves_of(
    problem: Problem, vector: np.ndarray, arcs_mm: np.ndarray
) -> tuple[Curves, np.ndarray]:
    """Return centrelines (…, f) of all frames and their contact arcs (…, f), from arcs_mm nearby."""
    axis = bar_axes(problem, vector)
    angles = bends(problem, vector)
    shape = angles.shape[:-1]
    arcs = np.broadcast_to(arcs_mm, shape)
    motor = np.broadcast_to(problem.motor_rad, shape)
    rest = rest_shape(problem, vector)[..., None, :, :]  # one for all frames
    friction = np.broadcast_to(vector[..., problem.blocks.friction.slice], shape)
    wire = wire_of(problem, vector, 2)
    nearby = centrelines(rest, angles, arcs, motor, wire, friction)
    arcs = np.clip(closest_arc(nearby, axis, wire, arcs), 1.0, wire.length_mm)
    return centrelines(rest, angles, arcs, motor, wire, friction), arcs


def resting_curves(problem: Problem, vector: np.ndarray, motor_rad: np.ndarray) -> Curves:
    """Return the unbent centrelines (…) at motor angles (…), by parameters (…, size)."""
    shape = np.shape(motor_rad)
    rest = np.broadcast_to(rest_shape(problem, vector), (*shape, 2, REST_POWERS))
    return unbent_centrelines(rest, motor_rad, problem.wire)


def start(problem: Problem, contact_arc_mm: float) -> State:
    """Return the state of a straight whisker without a bend, the bar where the problem counts it
    from.
    """
    return State(np.zeros(problem.size), np.full(len(problem.motor_rad), float(contact_arc_mm)))


def point_rows(problem: Problem) -> list[tuple[Observed, slice]]:
    """Return each observation with the place of its points among all residuals."""
    found = []
    first = 0
    for seen in problem.seen:
        last = first + len(seen.points)
        found.append((seen, slice(first, last)))
        first = last
    return found


def wire_lever(length_mm: float, place_mm: np.ndarray) -> np.ndarray:
    """Return the lever (n,) by which a line of the wire is tilted: from -1 at the base to 1 at the
    tip.
    """
    return 2.0 * place_mm / length_mm - 1.0


def wire_modes(
    length_mm: float, place_mm: np.ndarray, motor_rad: np.ndarray, swing_rad: np.ndarray
) -> np.ndarray:
    """Return the shapes (n, 6) by which lines of the wire are off: offset and tilt, constant,
    linear and square in the motor angle.

    place_mm, motor_rad (n,): of each point; swing_rad: the whisk's motor angles.
    """
    lever = wire_lever(length_mm, place_mm)
    turned = (motor_rad - np.min(swing_rad)) / max(np.ptp(swing_rad), 1e-9) * 2.0 - 1.0
    ones = np.ones(len(lever))
    by_turn = np.stack([ones, turned, turned**2 - 1.0 / 3.0], axis=1)
    by_place = np.stack([ones, lever], axis=1)
    return (by_turn[:, :, None] * by_place[:, None]).reshape(len(lever), 6)


def columns_of_camera(problem: Problem, camera: int, own: np.ndarray) -> np.ndarray:
    """Return columns (n, cameras · k), zero but for those (n, k) of one camera."""
    return np.kron(np.arange(len(problem.cameras)) == camera, own)


def wandering(problem: Problem, seen: Observed) -> np.ndarray:
    """Return the linear interpolation weights (n, knots) along the wire by which a traced line may
    wander.
    """
    knots = np.arange(0.0, problem.wire.length_mm + WANDER_MM, WANDER_MM)
    away = np.abs(seen.points.place[:, None] - knots)
    return np.maximum(1.0 - away / WANDER_MM, 0.0)
