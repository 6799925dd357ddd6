"""First touch as the pictures show it: the motor angle at which the unbent whisker reaches the bar."""

from dataclasses import dataclass, replace

import numpy as np

from vision.fit.problem import Problem, bar_axis, rest_shape, shift_at_mm
from vision.geometry.centreline import centrelines
from vision.geometry.contact import Axis, clearance
from vision.geometry.rods import Rods

# [frames] Before touch: one gives the rest shape, two tell that it swings with the motor.
# Derived.
# frames before touch: one gives the rest shape, two tell that it swings with the motor
FEWEST_FREE = 2
# [rad] A frame that bends by more surely touches; where no two in a row do, none does. Set by
# eye. Study: thresholds.py fit.touch _SURE_BEND_RAD ….
_SURE_BEND_RAD = np.radians(0.25)
# [mm, rad] Of differences, of the sigma of touch: far above rounding (1e-10 mm), far below what
# curves. Derived.
_STEP = 1e-5
# [mm] Secant steps below this would divide rounding by rounding. Derived.
_TOUCH_GAP_MM = 1e-10
# [rad] Half a millimetre at the contact, when a rounded object's touch is looked for. Stated.
_SCAN_RAD = np.radians(0.5)
# [1] Starts of the hinge that are tried between frames: finer than frames tell. Derived.
_STARTS_PER_FRAME = 10
# [1, rad] From touch, within which a frame is left undecided: three sigma, and never less than a
# motor's step. Stated.
_SURE_SIGMAS, _LEAST_MARGIN_RAD = (
    3.0,
    np.radians(0.02),
)


@dataclass(frozen=True)
class FirstTouch:
    """Motor angle (…) of first touch, contact point (…, 3) of the centreline and its arc length (…)."""

    motor_rad: np.ndarray
    point_mm: np.ndarray
    arc_mm: np.ndarray


def first_touch(problem: Problem, vector: np.ndarray, rounds: int = 8) -> FirstTouch:
    """Secant search for the motor angle at which axis and resting centreline are reach apart; batches allowed."""
    axis = bar_axis(problem, vector)

    def gap(motor_rad):
        there = replace(axis, point_mm=axis.point_mm + shift_at_mm(problem, vector, motor_rad))
        return _gap(rest, motor_rad, there, vector[..., problem.blocks.reach.start], problem.rods)

    rest = rest_shape(problem, vector)
    ends = np.min(problem.motor_rad), np.max(problem.motor_rad)
    if problem.is_rounded:
        ends = _about_touch(problem, vector)
    low, high = (np.full(vector.shape[:-1], end) for end in ends)
    gap_low, gap_high = (gap(m)[0] for m in (low, high))
    for _ in range(rounds):
        moving = np.abs(gap_high) > _TOUCH_GAP_MM
        slope = (gap_high - gap_low) / np.where(moving, high - low, 1.0)
        new = np.where(moving, high - gap_high / np.where(moving, slope, 1.0), high)
        low, gap_low = np.where(moving, high, low), np.where(moving, gap_high, gap_low)
        high, (gap_high, arc, point) = new, gap(new)
    return FirstTouch(high, point, arc)


def _about_touch(problem: Problem, vector: np.ndarray) -> tuple[float, float]:
    """Two motor angles, rad, between which the resting whisker first comes to touch a rounded object, which it may pass
    beside later: by the first of a batch. The whole swing where it does not touch."""
    first = vector.reshape(-1, vector.shape[-1])[0]
    low, high = float(np.min(problem.motor_rad)), float(np.max(problem.motor_rad))
    angles = np.linspace(low, high, 2 + int((high - low) / _SCAN_RAD))
    gaps, _, _ = _gap(
        rest_shape(problem, first),
        angles,
        bar_axis(problem, first),
        first[problem.blocks.reach.start],
        problem.rods,
    )
    touches = np.flatnonzero((gaps[:-1] > 0.0) & (gaps[1:] <= 0.0))
    return (angles[touches[0]], angles[touches[0] + 1]) if len(touches) else (low, high)


def touch_and_sigma(
    problem: Problem, vector: np.ndarray, answer: np.ndarray
) -> tuple[float, float]:
    """Motor angle of first touch and its sigma, rad, by noise and priors alone: what it takes to part the frames.

    answer (size, size): covariance that the fit gives.
    """
    geometry = np.append(np.arange(problem.blocks.reach.start + 1), problem.blocks.placement)
    here = float(first_touch(problem, vector).motor_rad)
    moved = first_touch(problem, vector + _STEP * np.eye(len(vector))[geometry]).motor_rad
    slope = (moved - here) / _STEP
    return here, float(np.sqrt(slope @ answer[np.ix_(geometry, geometry)] @ slope))


def _gap(rest_mm, motor_rad, axis: Axis, wider_mm, rods: Rods):
    """How far the resting whisker still is from touching, mm; contact arc and point. wider_mm: the reach's error."""
    none = np.zeros((*motor_rad.shape, 2))
    curves = centrelines(
        rest_mm, none, np.full(motor_rad.shape, rods.wire.length_mm / 2), motor_rad, rods.wire
    )
    distance, arc, point = clearance(curves, axis)
    return distance - rods.reach_mm(arc) - wider_mm, arc, point


def frames_that_touch(motor_rad: np.ndarray, bend_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """From coarse bends (f, 2): which frames surely touch, and which surely do not; (f,) bool each.

    The bend is nothing up to touch and then grows with the motor's angle, towards where it ends: the touch that
    explains all bends best parts the frames. One frame to either side of it is left undecided, but the first two
    are taken as free: whether they are, the fit will show. None touches where no two frames in a row are surely bent.
    """
    sure = np.linalg.norm(bend_rad, axis=1) > _SURE_BEND_RAD
    if not np.any(sure & np.append(sure[1:], sure[-1])):
        return np.zeros(len(sure), dtype=bool), np.ones(len(sure), dtype=bool)
    touch, step = _hinge(motor_rad, bend_rad), np.median(np.abs(np.diff(motor_rad)))
    first = np.arange(len(sure)) < 2
    return (motor_rad > touch + step) & sure & ~first, (motor_rad < touch - step) | first


def begins_free(motor_rad: np.ndarray, bend_rad: np.ndarray) -> bool:
    """Whether coarse bends (f, 2) show that the first frames come before touch: by more than the motor turns until a
    bend is sure. Where none is, there is no touch."""
    touching, _ = frames_that_touch(motor_rad, bend_rad)
    return (
        not np.any(touching)
        or motor_rad[FEWEST_FREE - 1] < _hinge(motor_rad, bend_rad) - _SURE_BEND_RAD
    )


def _hinge(motor_rad, bend_rad) -> float:
    """The motor angle up to which there is no bend and from which on it grows in proportion; least absolute misfit."""
    towards = np.median(bend_rad[-max(2, len(bend_rad) // 3) :], axis=0)
    bend = bend_rad @ (towards / max(np.linalg.norm(towards), 1e-12))
    starts = np.linspace(motor_rad[0], motor_rad[-2], _STARTS_PER_FRAME * len(motor_rad))
    rises = np.maximum(motor_rad - starts[:, None], 0.0)
    slopes = np.sum(rises * bend, axis=1) / np.sum(rises**2, axis=1)
    return float(starts[np.argmin(np.sum(np.abs(bend - slopes[:, None] * rises), axis=1))])


def frames_by_touch(
    motor_rad: np.ndarray, touch_rad: float, sigma_rad: float
) -> tuple[np.ndarray, np.ndarray]:
    """The same once touch is known to sigma: frames within three sigma of it are left undecided, but for the first two:
    they are free if touch comes after them."""
    margin = max(_SURE_SIGMAS * sigma_rad, _LEAST_MARGIN_RAD)
    free = motor_rad < touch_rad - margin
    free[:FEWEST_FREE] |= motor_rad[:FEWEST_FREE] < touch_rad
    return motor_rad > touch_rad + margin, free


def bends_tell_more(motor_rad: np.ndarray, sigma_rad: float) -> bool:
    """Whether bends part the frames better than a touch known to sigma, as where sights hardly cross: they do to a
    frame, or to what the motor turns by until a bend is sure."""
    to_a_frame = np.median(np.abs(np.diff(motor_rad)))
    return bool(_SURE_SIGMAS * sigma_rad > max(to_a_frame, _SURE_BEND_RAD))
