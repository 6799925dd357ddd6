"""What is known, seen and looked for of one whisk: the fit's observations and parameters, and the curves they mean."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vision.fit.bend_onset import Onset
from vision.fit.motion import Motion, Yielding, between
from vision.geometry.camera import Cameras
from vision.geometry.centreline import REST_POWERS, Curves, centrelines
from vision.geometry.contact import Axis, axis_frame, closest_arc, shifted_axis
from vision.geometry.rods import Rods, Wire
from vision.wire.points import SHARED, Observed

# [parameters] A layout, no threshold.
BAR, REST = 4, 2 * REST_POWERS
REACH = BAR + REST  # index of the reach's error
# [mm, rad] Of the bar from where it was found: nothing is believed of it. Stated.
BAR_PRIOR = np.array([50.0, 50.0, 1.0, 1.0])
# [mm] One sigma of what a lab's whisker may have at its tip: clamped off centre; encoder zero and
# clamp angle; set and sag; change of curvature. Wide: they only keep what no picture shows from
# running away. Stated.
REST_PRIOR_MM = np.array([1.0, 8.0, 5.0, 2.0])
# [rad] One sigma of a frame's bend, 17°: strokes push by less, so that it only keeps what no
# picture shows from running away. Stated.
BEND_PRIOR_RAD = 0.3
# [1] One sigma of friction along the whisker over the force across it: Coulomb's coefficients,
# less where the contact slips along the bar. Study: exactness.py.
PULL_PRIOR = 0.2
# [px] What a wire's line is off by as a whole beyond what light and lens are said to move it by:
# shadows, reflections. With the first the true wires of 65 path-traced views are most probable;
# the second is the RMS of 72 (docs/proof.md). Study: wire_scenes.py.
WIRE_OFFSET_PX, WIRE_TILT_PX = 0.08, 0.09
# [px] As the whisker swings before light and background it is off a little differently, by its
# ends and in the middle: 0.020 to 0.034 px in path-traced views, 0.012 to 0.021 in painted ones
# (docs/proof.md). Besides, what moves a line by so much moves it by as much over a radian of the
# swing. Study: no script.
WIRE_DRIFT_PX = 0.02
# [px] The three above, in the order of the parameters.
WIRE_MODES_PX = np.array([WIRE_OFFSET_PX, WIRE_TILT_PX, *[WIRE_DRIFT_PX] * 4])
# [px, mm] A line also wanders with what is behind it, so far over this length of wire; for the
# check of the beam. Set by eye. Study: broken_beams.py.
WANDER_PX, WANDER_MM = 0.25, 12.0
# [px] What a bar's line is off by as a whole beyond its own sigma where it says nothing of its
# light (points drawn in studies); of the second over `BAR_TILT_ARM_MM`. Study: bar_scenes.py.
BAR_OFFSET_PX, BAR_TILT_PX = 0.05, 0.025
# [mm] As `bar/pieces.py` has it: a layout.
BAR_TILT_ARM_MM = 20.0
# [px] By so much an outline is read too far out, or in, as a whole: by the wrong transfer curve
# 0.5, else 0.05; the object's size tells. Study: rounded_seen.py.
OUTWARD_PX = 0.3
BAR_MODES_PX = np.array([BAR_OFFSET_PX, BAR_TILT_PX])
# Sigmas of all that a camera's lines are off by as a whole.
LIGHT_PX = np.array([*WIRE_MODES_PX, *np.ones(SHARED), *BAR_MODES_PX])
# [mm] How far axis and centreline may be from reach: a tenth of what 0.1 px is on the bench, so
# that touching holds as a condition. Derived.
CONTACT_SIGMA_MM = 0.002


@dataclass(frozen=True, eq=False)
class Problem:
    """What is known and seen of one whisk.

    motor_rad (f,); touching, bent (f,) bool: frames held to the touching distance, frames that may bend;
    axis: where the bar's four parameters are counted from, and a fifth of a rounded object, along its direction. onset:
    when the whisker is seen to begin to bend, where the cameras do not know whisker and bar well enough in space to
    tell when they touch, or when a bar begins to give way: then as late beside it as the motion's first parameter has
    it. alike: by camera, how much of its
    error a point of the wire shares with the next one; nothing where empty (see `vision.fit.scatter`). motion: of a bar
    that does not stand still.
    """

    cameras: Cameras
    rods: Rods
    axis: Axis
    motor_rad: np.ndarray
    touching: np.ndarray
    bent: np.ndarray
    seen: Sequence[Observed]
    onset: Onset | None = None
    alike: Sequence[float] = ()
    motion: Motion | Yielding | None = None

    @property
    def wire(self) -> Wire:
        """The whisker."""
        return self.rods.wire

    @property
    def size(self) -> int:
        """Number of parameters: bar, rest shape, reach, how each camera's lines are off as a whole, the bar's motion,
        friction along the whisker, bends."""
        return self.first_bend + 2 * int(np.sum(self.bent))

    @property
    def first_bend(self) -> int:
        """Index of the first bend."""
        return self.pull + 1

    @property
    def pull(self) -> int:
        """Index of the friction along the whisker over the force across it, the same in all frames."""
        return self.bar_moves.stop

    @property
    def bar_moves(self) -> slice:
        """Parameters of the bar's motion: none where it stands still. Of a rounded object the shift along its
        direction, and by how much each camera's outline is read too far out, px."""
        first = BAR + REST + 1 + len(LIGHT_PX) * len(self.cameras)
        more = 1 + len(self.cameras) if self.is_rounded else 0
        return slice(first, first + (0 if self.motion is None else len(self.motion)) + more)

    @property
    def outline_prior(self) -> np.ndarray:
        """Sigmas of what a rounded object has in the place of a bar's motion; none of a bar."""
        return np.array(
            [BAR_PRIOR[0], *[OUTWARD_PX] * len(self.cameras)] if self.is_rounded else []
        )

    @property
    def is_rounded(self) -> bool:
        """Whether what is touched is no straight bar; it stands still then."""
        return self.rods.bar.form is not None

    @cached_property
    def light_px(self) -> np.ndarray:
        """Sigmas (cameras, modes) of what each camera's lines are off by as a whole: LIGHT_PX, and as the wire turns
        before the light: what moves a line by so much moves it by that over a radian more or less; of a bar what its
        points share, where they say so."""
        half, sigma = 0.5 * float(np.ptp(self.motor_rad)), np.tile(LIGHT_PX, (len(self.cameras), 1))
        for camera, own in enumerate(sigma):
            wire = [one.points for one in self.seen if one.camera == camera and one.frame >= 0]
            shared = [row for points in wire for row in points.shared_px]
            common = np.linalg.norm(np.mean(shared, axis=0)) if shared else 0.0
            still = np.hypot(own[:2], [common, 0.0])
            bar = [
                one.points.shared_px for one in self.seen if one.camera == camera and one.frame < 0
            ]
            if bar and np.any(bar):
                own[-2:] = np.sqrt(np.mean(np.concatenate(bar)[:, :2] ** 2, axis=0))
            own[2:4], own[4:6] = (
                np.hypot(own[2:4], half * still),
                np.hypot(own[4:6], 0.5 * half**2 * still),
            )
        return sigma

    def bend_of(self, frame: int) -> slice:
        """Parameters of a frame's bend; the frame may bend."""
        first = self.first_bend + 2 * int(np.sum(self.bent[:frame]))
        return slice(first, first + 2)

    def wire_off(self, camera: int) -> slice:
        """Parameters by which a camera's lines of the wire are off as a whole: `wire_modes`, then what points share."""
        first = BAR + REST + 1 + len(LIGHT_PX) * camera
        return slice(first, first + len(WIRE_MODES_PX) + SHARED)

    def bar_off(self, camera: int) -> slice:
        """The same of the bar: offset, and tilt over BAR_TILT_ARM_MM."""
        first = self.wire_off(camera).stop
        return slice(first, first + len(BAR_MODES_PX))


@dataclass(frozen=True, eq=False)
class State:
    """Parameters in one vector, with the contact arcs (f,) from which the next evaluation starts."""

    vector: np.ndarray
    arcs_mm: np.ndarray


def bar_axis(problem: Problem, vector: np.ndarray) -> Axis:
    """The bar's axis (batch of vectors (…, size) allowed): two shifts in mm and two tilts across the start; of a
    rounded object a shift along it, too."""
    axis = shifted_axis(problem.axis, axis_frame(problem.axis.direction), vector)
    if not problem.is_rounded:
        return axis
    return replace(
        axis,
        point_mm=axis.point_mm
        + vector[..., problem.bar_moves.start, None] * problem.axis.direction,
    )


def shifts_mm(problem: Problem, vector: np.ndarray) -> np.ndarray:
    """How far (…, f, 3) the bar is in each frame from where `bar_axis` has it; (…, 1, 3) of 0 where it stands."""
    if problem.motion is None:
        return np.zeros((*vector.shape[:-1], 1, 3))
    return problem.motion.shift_mm(vector[..., problem.bar_moves])


def bar_axes(problem: Problem, vector: np.ndarray) -> Axis:
    """The bar's axis (…, f, 3) in each frame; (…, 1, 3) where it stands."""
    axis = bar_axis(problem, vector)
    point, direction = axis.point_mm[..., None, :], axis.direction[..., None, :]
    if problem.motion is None:
        return replace(axis, point_mm=point, direction=direction)
    point = point + shifts_mm(problem, vector)
    return replace(axis, point_mm=point, direction=np.broadcast_to(direction, point.shape))


def shift_at_mm(problem: Problem, vector: np.ndarray, motor_rad: np.ndarray) -> np.ndarray:
    """How far (…, 3) the bar is from where `bar_axis` has it as the motor passes angles (…) up to touch."""
    if problem.motion is None or problem.motion.from_touch:
        return np.zeros(3)
    return between(problem.motor_rad, shifts_mm(problem, vector), motor_rad)


def rest_shape(vector: np.ndarray) -> np.ndarray:
    """Rest polynomials (…, 2, 4) in mm."""
    return vector[..., BAR : BAR + REST].reshape(*vector.shape[:-1], 2, REST_POWERS)


def bends(problem: Problem, vector: np.ndarray) -> np.ndarray:
    """Tangent angles at the contact (…, f, 2); zero in frames that may not bend."""
    angles = np.zeros((*vector.shape[:-1], len(problem.motor_rad), 2))
    angles[..., problem.bent, :] = vector[..., problem.first_bend :].reshape(
        *vector.shape[:-1], -1, 2
    )
    return angles


def curves_of(
    problem: Problem, vector: np.ndarray, arcs_mm: np.ndarray, rounds: int = 1
) -> tuple[Curves, np.ndarray]:
    """Centrelines (…, f) of all frames, and their contact arcs (…, f), found from each other by turns."""
    rest = rest_shape(vector)[..., None, :, :]
    axis = bar_axes(problem, vector)
    angles = bends(problem, vector)
    shape = angles.shape[:-1]
    arcs = np.broadcast_to(arcs_mm, shape)
    motor = np.broadcast_to(problem.motor_rad, shape)
    rest = np.broadcast_to(rest, (*shape, 2, REST_POWERS))
    pull = np.broadcast_to(vector[..., problem.pull, None], shape)
    for _ in range(rounds):
        curves = centrelines(rest, angles, arcs, motor, problem.wire, pull)
        arcs = np.clip(closest_arc(curves, axis, arcs), 1.0, problem.wire.length_mm)
    return centrelines(rest, angles, arcs, motor, problem.wire, pull), arcs


def start(problem: Problem, contact_arc_mm: float) -> State:
    """No bend, straight whisker, the bar where the problem counts it from."""
    return State(np.zeros(problem.size), np.full(len(problem.motor_rad), float(contact_arc_mm)))


def point_rows(problem: Problem) -> list[tuple[Observed, slice]]:
    """Each of what is seen, with the rows of its points among all residuals."""
    ends = np.cumsum([len(seen.points) for seen in problem.seen]).tolist()
    return [(seen, slice(end - len(seen.points), end)) for seen, end in zip(problem.seen, ends)]


def wire_lever(length_mm: float, place_mm: np.ndarray) -> np.ndarray:
    """From -1 at the base to 1 at the tip, by which a line of the wire is tilted."""
    return 2.0 * place_mm / length_mm - 1.0


def wire_modes(
    length_mm: float, place_mm: np.ndarray, motor_rad: np.ndarray, swing_rad: np.ndarray
) -> np.ndarray:
    """Shapes (n, 6) by which lines of the wire are off: all alike, from end to end, and both of these changing with the
    motor angle, steadily and by its square.

    place_mm, motor_rad (n,): of each point; swing_rad: the whisk's motor angles.
    """
    lever = wire_lever(length_mm, place_mm)
    turned = (motor_rad - np.min(swing_rad)) / max(np.ptp(swing_rad), 1e-9) * 2.0 - 1.0
    by_turn = np.stack([np.ones(len(lever)), turned, turned**2 - 1.0 / 3.0], axis=1)
    return (by_turn[:, :, None] * np.stack([np.ones(len(lever)), lever], axis=1)[:, None]).reshape(
        len(lever), 6
    )


def wandering(problem: Problem, seen: Observed) -> np.ndarray:
    """Hats (n, knots) along the wire by which a traced line may wander, at its points."""
    knots = np.arange(0.0, problem.wire.length_mm + WANDER_MM, WANDER_MM)
    return np.maximum(1.0 - np.abs(seen.points.place[:, None] - knots) / WANDER_MM, 0.0)
