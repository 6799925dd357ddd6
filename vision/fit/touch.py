"""First touch as the pictures show it: the motor angle at which the unbent whisker reaches the
bar.
"""

from dataclasses import dataclass, replace

import numpy as np

from vision.fit.problem import (
    Problem,
    State,
    bar_axis,
    bends,
    reach_mm,
    resting_curves,
    shift_at_mm,
    wire_of,
)
from vision.fit.solve import Linear, linearise
from vision.geometry.contact import clearance
from vision.geometry.rotation import unit

# [frames] Before touch: one gives the rest shape, two show that it swings with the motor. Derived.
FEWEST_FREE = 2
# [rad] A frame that bends by more surely touches; where no two in a row do, none does.
# 0.12° to 0.5° move nothing on the fixtures. Study: thresholds.py fit.touch _SURE_BEND_RAD ….
_SURE_BEND_RAD = np.radians(0.25)
# [mm, rad] Of differences, of the sigma of touch: far above rounding (1e-10 mm), far below what
# curves. Derived.
_STEP = 1e-5
# [mm] Secant steps below this would divide rounding by rounding. Derived.
_TOUCH_GAP_MM = 1e-10
# [steps] Secants from half a millimetre to `_TOUCH_GAP_MM`, where they end before. Derived.
_SECANT_STEPS = 8
# [rad] Half a millimetre at the contact, when touch is searched for. Stated.
_SCAN_RAD = np.radians(0.5)
# [1] Starts of the hinge that are tried between frames: finer than frames determine. Derived.
_STARTS_PER_FRAME = 10
# [1] Sigmas from touch within which a frame is left undecided. Stated.
_SURE_SIGMAS = 3.0
# [rad] The least distance from touch of a frame that is not left undecided: a motor's step. Stated.
_LEAST_MARGIN_RAD = np.radians(0.02)
# [chi²] By which a fit in which a frame bends is better than one in which it is free, before it is
# taken as bent: five sigma, as of a bend against none (`fit/bend_onset.py`). In nine path-traced
# scenes the last free frame has 6 at most, one of two that touch from the start 220 at least.
# Study: thresholds.py fit.touch _LEAST_BEND ….
_LEAST_BEND = 25.0


@dataclass(frozen=True)
class FirstTouch:
    """Motor angle (…) of first touch, contact point (…, 3) of the centreline and its arc length
    (…).
    """

    motor_rad: np.ndarray
    point_mm: np.ndarray
    arc_mm: np.ndarray


def first_touch(problem: Problem, vector: np.ndarray) -> FirstTouch:
    """Find the motor angle at which axis and resting centreline are reach apart; batches allowed.

    A secant search, from about where the first of a batch touches.
    """
    first, last = _about_touch(problem, vector.reshape(-1, vector.shape[-1])[0])
    before = np.full(vector.shape[:-1], first)
    angle = np.full(vector.shape[:-1], last)
    gap_before, _, _ = _gap(problem, vector, before)
    gap, arc, point = _gap(problem, vector, angle)
    for _ in range(_SECANT_STEPS):
        is_open = np.abs(gap) > _TOUCH_GAP_MM
        if not np.any(is_open):
            break
        change = _secant_change(gap, gap - gap_before, angle - before, is_open)
        before = np.where(is_open, angle, before)
        gap_before = np.where(is_open, gap, gap_before)
        angle = np.where(is_open, angle - change, angle)
        gap, arc, point = _gap(problem, vector, angle)
    return FirstTouch(angle, point, arc)


def _secant_change(
    gap_mm: np.ndarray, rise_mm: np.ndarray, run_rad: np.ndarray, is_open: np.ndarray
) -> np.ndarray:
    """Return how far (…) the motor is, rad, past the angle that closes gaps (…) where they are
    open.

    rise_mm, run_rad (…): the last change of the gap, and that of the motor angle which made it.
    """
    return gap_mm / np.divide(rise_mm, run_rad, out=np.ones_like(gap_mm), where=is_open)


def _about_touch(problem: Problem, vector: np.ndarray) -> tuple[float, float]:
    """Return two motor angles, rad, between which the resting whisker first comes to touch.

    It may pass a small object later. vector (size,). Where the whisker does not touch they are the
    ends of the swing.
    """
    low = float(np.min(problem.motor_rad))
    high = float(np.max(problem.motor_rad))
    angles = np.linspace(low, high, 2 + int((high - low) / _SCAN_RAD))
    vectors = np.broadcast_to(vector, (len(angles), len(vector)))
    gaps, _, _ = _gap(problem, vectors, angles)
    closes = np.flatnonzero((gaps[:-1] > 0.0) & (gaps[1:] <= 0.0))
    if not len(closes):
        return low, high
    return angles[closes[0]], angles[closes[0] + 1]


def touch_and_sigma(
    problem: Problem, vector: np.ndarray, covariance: np.ndarray
) -> tuple[float, float]:
    """Return the motor angle of first touch and its sigma, rad, by noise and priors alone.

    It serves to divide the frames into free and touching ones. covariance (size, size): the second result of `solve`.
    """
    blocks = problem.blocks
    columns = np.append(np.arange(blocks.taper.slice.stop), blocks.placement)
    here = float(first_touch(problem, vector).motor_rad)
    moved = vector + _STEP * np.eye(len(vector))[columns]
    slope = (first_touch(problem, moved).motor_rad - here) / _STEP
    return here, float(np.sqrt(slope @ covariance[np.ix_(columns, columns)] @ slope))


def _gap(
    problem: Problem, vector: np.ndarray, motor_rad: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return how far the resting whisker still is from touching, mm; contact arc and point.

    motor_rad (…): one for each vector (…, size).
    """
    axis = bar_axis(problem, vector)
    shift_mm = shift_at_mm(problem, vector, motor_rad)
    there = replace(axis, point_mm=axis.point_mm + shift_mm)
    curves = resting_curves(problem, vector, motor_rad)
    distance, arc, point = clearance(curves, there, wire_of(problem, vector, 1))
    wider_mm = vector[..., problem.blocks.reach.start]
    return distance - reach_mm(problem, vector, arc) - wider_mm, arc, point


def frames_that_touch(motor_rad: np.ndarray, bend_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which frames surely touch and which surely do not, (f,) bool each, by coarse bends (f,
    2).

    Up to touch there is no bend, from there on it grows in proportion to the motor's angle: the
    frames are divided at the touch that explains all bends best. One frame to either side of it is
    left undecided, but the first two are taken as free; the fit shows whether they are
    (`unbent_frames`). None touches where no two frames in a row are surely bent.
    """
    sure = np.linalg.norm(bend_rad, axis=1) > _SURE_BEND_RAD
    next_sure = np.append(sure[1:], sure[-1])
    if not np.any(sure & next_sure):
        return np.zeros(len(sure), dtype=bool), np.ones(len(sure), dtype=bool)
    touch = _hinge(motor_rad, bend_rad)
    step = np.median(np.abs(np.diff(motor_rad)))
    first = np.arange(len(sure)) < FEWEST_FREE
    touching = (motor_rad > touch + step) & sure & ~first
    return touching, (motor_rad < touch - step) | first


def _hinge(motor_rad: np.ndarray, bend_rad: np.ndarray) -> float:
    """Find the motor angle up to which there is no bend and from which on it grows in proportion:
    that of the least absolute misfit."""
    bend = bend_rad @ _last_direction(bend_rad)  # (f,)
    starts = np.linspace(motor_rad[0], motor_rad[-2], _STARTS_PER_FRAME * len(motor_rad))
    past_start = np.maximum(motor_rad - starts[:, None], 0.0)  # (starts, f) rad
    slopes = np.sum(past_start * bend, axis=1) / np.sum(past_start**2, axis=1)
    expected = slopes[:, None] * past_start
    misfit = np.sum(np.abs(bend - expected), axis=1)
    return float(starts[np.argmin(misfit)])


def _last_direction(bend_rad: np.ndarray) -> np.ndarray:
    """Return the unit direction (2,) of the bends (f, 2) in the last third of the frames.

    Where few of these surely bend, the median over all of them would be no bend: it is over those.
    """
    last = bend_rad[-max(2, len(bend_rad) // 3) :]
    is_sure = np.linalg.norm(last, axis=1) > _SURE_BEND_RAD
    return unit(np.median(last[is_sure] if np.any(is_sure) else last, axis=0))


def frames_by_touch(
    motor_rad: np.ndarray, touch_rad: float, sigma_rad: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return which frames surely touch and which surely do not, (f,) bool each, by a touch known to
    sigma.

    Frames within three sigma of it are left undecided, but for the first two: they are free if
    touch comes after them.
    """
    margin = max(_SURE_SIGMAS * sigma_rad, _LEAST_MARGIN_RAD)
    free = motor_rad < touch_rad - margin
    free[:FEWEST_FREE] |= motor_rad[:FEWEST_FREE] < touch_rad
    return motor_rad > touch_rad + margin, free


def unbent_frames(problem: Problem, state: State, free: np.ndarray) -> np.ndarray:
    """Return which of the free frames (f,) bool are free by a fit: from the last on, those that
    bend are dropped.

    free (f,) bool: frames taken as free, the first of the stroke. Without this, frames that touch
    from the start would be taken for the rest shape, and touch for later than it is.
    """
    free = free.copy()
    loose = replace(problem, bent=np.ones(len(free), dtype=bool))
    vector = np.zeros(loose.size)
    vector[: problem.first_bend] = state.vector[: problem.first_bend]
    bend_rad = np.where(free[:, None], 0.0, bends(problem, state.vector))
    vector[problem.first_bend :] = bend_rad.ravel()
    linear, _ = linearise(loose, replace(state, vector=vector))
    weighted = linear.weighted()
    while np.sum(free) >= FEWEST_FREE:
        last = int(np.flatnonzero(free)[-1])
        if _bend_chi2(loose, weighted, free, last) < _LEAST_BEND:
            break
        free[last] = False
    return free


def _bend_chi2(loose: Problem, weighted: Linear, free: np.ndarray, frame: int) -> float:
    """Return by how much chi² falls if one of the free frames (f,) bool is let bend.

    loose: the problem in which all frames may bend.
    """
    varies = np.ones(loose.size, dtype=bool)
    for one in np.flatnonzero(free).tolist():
        varies[loose.bend_of(one)] = one == frame
    rows = weighted.jacobian[:, varies]
    covariance = np.linalg.inv(rows.T @ rows)
    step = -covariance @ (rows.T @ weighted.residual)
    first = int(np.sum(varies[: loose.bend_of(frame).start]))
    own = slice(first, first + 2)
    return float(step[own] @ np.linalg.solve(covariance[own, own], step[own]))


def bent_frames(problem: Problem, state: State, covariance: np.ndarray) -> np.ndarray:
    """Return which frames (f,) bool surely bend by a fit; covariance (size, size): of its
    parameters.
    """
    is_bent = np.zeros(len(problem.bent), dtype=bool)
    for frame in np.flatnonzero(problem.bent).tolist():
        own = problem.bend_of(frame)
        bend = state.vector[own]
        is_bent[frame] = bend @ np.linalg.solve(covariance[own, own], bend) > _LEAST_BEND
    return is_bent


def bends_divide_better(motor_rad: np.ndarray, sigma_rad: float) -> bool:
    """Return whether bends divide the frames better than a touch known to sigma, as where sights
    hardly cross.

    They do so to a frame, or to the angle by which the motor turns until a bend is sure.
    """
    frame_rad = np.median(np.abs(np.diff(motor_rad)))
    return bool(_SURE_SIGMAS * sigma_rad > max(frame_rad, _SURE_BEND_RAD))
