"""Stick and slip: rests of the contact on the bar, jumps, and the friction angles at both ends of a rest.

The record is the slip over the pushing angle: frame by frame as the cameras show it, and sample by
sample from the moments felt, with the bar's slope as seen. A rest ends when the force leaves the
static cone, so |β| − |φ| just before the jump is the static angle. A jump ends where the force is
back on the kinetic cone; a whisker that swings beyond it would show too large an angle, as nothing
separates the two.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import find_objects, label, maximum_filter1d

from bench.gauges.felt import FeltStroke
from bench.records.phases import KINETIC, NO_PHASES, STATIC, Angle, Phases
from bench.records.trial_result import SeenWhisk
from bench.session.trial import Trial
from bench.trials.readout import RawMoments, Readout
from bench.trials.seen_friction import slips
from estimator.beam import Beam
from estimator.signal import FeltTouch
from estimator.uncertainty import slip_angle_sigma
from vision import FrameTruth

# [frames] Fewer show neither rest nor jump: three have two intervals, of which one may rest. Derived.
_LEAST_FRAMES = 3
# [rad] Least pushing angle: before, the slip angle is mostly noise. Stated.
_FIRST_RAD = np.radians(0.5)
# [1] Of the slope of a slip that never rests, σ/θ: below it the contact rests. Stated.
_REST_SHARE = 0.5
# [intervals] Between frames, that a jump takes at most. Stated.
_LONGEST_JUMP = 2
# [sigma] By which the slope of a rest and that of free slip differ at least. Stated.
_SIGMAS = 3.0
# [sigma] Of a jump: in thousands of samples noise reaches 4. Derived.
_JUMP_SIGMAS = 6.0
# [rad] Half a window in which a slope is taken. Study: tests/bench/trials/test_phases.py, which holds at half and
# at twice of it.
_WINDOW_RAD = np.radians(0.12)
# [s] Half a window, where that is less: what `_WINDOW_RAD` takes at 10°/s. Derived.
_WINDOW_S = 0.012
# [samples] In half a window, at least. Study: tests/bench/trials/test_phases.py, which holds at half and at
# twice of it.
_FEWEST = 4
# [samples] In half a window, at most. Study: tests/bench/trials/test_phases.py, which fails at half
# of it.
_MOST = 40
# [samples] At a jump, which the gauges' own filter smears. Stated.
_GUARD = 3
# [1] Of a stroke's angles, in its middle: there the motor goes at its speed, whatever its ramps. Stated.
_PLATEAU_SHARE = 1 / 3
# [1] How far the motor may be from the line of its speed, over the most that it is from it in the middle of the stroke.
# A ramp of 20 ms leaves it within a few samples. Study: tests/studies/accuracy/felt_phases.py.
_OFF_PLATEAU = 2.0


def seen_phases(frames: FrameTruth, beta_rad: float, d_x_mm: float) -> Phases:
    """Find phases in the slip of each touching frame, with its sigma."""
    touching = _touching(frames)
    theta = frames.theta_rad.value[touching]
    if len(theta) < _LEAST_FRAMES:
        return NO_PHASES
    slip = frames.slip_mm.value[touching]
    rests, moves = _rests_and_moves(theta, slip, frames.slip_mm.sigma[touching])
    jumps = [run for run in _runs(moves) if _is_jump(*run, rests)]
    if not jumps or beta_rad == 0.0:
        return NO_PHASES
    angles = _seen_angles(frames, np.flatnonzero(touching), jumps, d_x_mm)
    return Phases(len(_runs(rests)), len(jumps), tuple(angles))


def _rests_and_moves(
    theta: np.ndarray, slip: np.ndarray, sigma: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return in which intervals between n frames the contact rests, and in which it moves (n − 1,).

    In the others noise hides which.
    """
    free_step = np.abs(slip[:-1]) / theta[:-1] * np.diff(theta)
    step_sigma = np.sqrt(2.0) * np.maximum(sigma[:-1], sigma[1:])
    is_clear = free_step * _REST_SHARE > _SIGMAS * step_sigma
    is_below = np.abs(np.diff(slip)) < _REST_SHARE * free_step
    return is_below & is_clear, ~is_below & is_clear


def _seen_angles(
    frames: FrameTruth, index: np.ndarray, jumps: Sequence[tuple[int, int]], d_x_mm: float
) -> list[Angle]:
    """Return the friction angles at both ends of each jump between two of the frames `index`.

    A jump lies anywhere between its two frames: its angles are carried half the way to it, as a
    contact at rest has them, and the other half goes into their sigma.
    """
    theta = frames.theta_rad.value[index]
    alpha = frames.alpha_rad.value[index]
    sigma = frames.alpha_rad.sigma[index]
    turning = _turning_at_rest(frames, index, d_x_mm)
    angles = []
    for first, last in jumps:
        half_width = 0.5 * (theta[last] - theta[first])
        for kind, k, way in ((STATIC, first, half_width), (KINETIC, last, -half_width)):
            by_way = way * turning[k]
            spread = np.hypot(sigma[k], by_way / np.sqrt(3.0))  # uniform between the frames
            angles.append(
                Angle(kind, float(theta[k] + way), float(alpha[k] + by_way), float(spread))
            )
    return angles


def _turning_at_rest(frames: FrameTruth, index: np.ndarray, d_x_mm: float) -> np.ndarray:
    """Return dα/dθ (n,) of a contact at rest in the frames `index` (n,)."""
    d_y = frames.d_y_mm.value[index]
    d_z = frames.d_z_mm.value[index]
    return np.abs(d_z) * d_x_mm / (d_y**2 + d_z**2)


def _touching(frames: FrameTruth) -> np.ndarray:
    """Return the mask (n,) of frames that touch, well after touch, and whose values are known."""
    values = [frames.theta_rad, frames.slip_mm, frames.d_y_mm, frames.d_z_mm, frames.alpha_rad]
    known = np.isfinite([value.value for value in values]).all(axis=0)
    known &= np.isfinite(frames.slip_mm.sigma) & np.isfinite(frames.alpha_rad.sigma)
    return frames.touching & known & (frames.theta_rad.value > _FIRST_RAD)


def _runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """Return (first, one past the last) of each unbroken run of True."""
    return [(run.start, run.stop) for (run,) in find_objects(label(mask)[0])]


def _is_jump(first: int, last: int, rests: np.ndarray) -> bool:
    """Return whether a run of intervals is short and enclosed by rests."""
    if first == 0 or last == len(rests) or last - first > _LONGEST_JUMP:
        return False
    return bool(rests[first - 1] and rests[last])


def phases_of(
    trial: Trial,
    stroke: FeltStroke,
    touch: FeltTouch,
    readout: Readout,
    seen: SeenWhisk,
    beam: Beam,
) -> Phases:
    """Find felt phases, with slope and distance by the truth, or nominal ones where there is none.

    There are none where the contact is seen not to slip.
    """
    if not seen.has_truth:
        beta_rad = trial.beta_deg and np.radians(trial.beta_deg)
        d_x_mm = trial.d_x_mm
    elif seen.deflection is None or slips(seen):
        beta_rad = seen.beta_rad.value
        d_x_mm = seen.d_x_mm.value
    else:
        return NO_PHASES
    if not beta_rad or not d_x_mm or np.isnan(beta_rad):
        return NO_PHASES
    return felt_phases(readout.raw(stroke, touch), beta_rad, d_x_mm, beam)


def felt_phases(raw: RawMoments, beta_rad: float, d_x_mm: float, beam: Beam) -> Phases:
    """Find phases in the moments of a stroke; NaN samples are left out.

    Between two jumps both moments are lines, whose ends give the friction angles.
    """
    jumps, rests = find_rests(raw, beta_rad, d_x_mm, beam)
    if not jumps:
        return NO_PHASES
    angles: list[Angle] = []
    for rest in rests:
        angles += rest.angles(abs(beta_rad))
    return Phases(len(rests), jumps, tuple(angles))


@dataclass(frozen=True, eq=False)
class ContactRest:
    """A contact at rest between two jumps.

    from_rad, to_rad: pushing angles of its ends; to_rad is NaN where the record ends before the
    next jump. lines (2, 2): value and slope of |m_y| and m_z about a middle. shape (2, 2),
    variances (2,): the lines' covariance is their product.
    """

    from_rad: float
    to_rad: float
    middle_rad: float
    lines: np.ndarray
    shape: np.ndarray
    variances: np.ndarray

    def moments_at(self, theta_rad: float) -> tuple[np.ndarray, np.ndarray]:
        """Return |m_y| and m_z (2,) at a pushing angle, and their variances (2,)."""
        row = np.array([1.0, theta_rad - self.middle_rad])
        return row @ self.lines, row @ self.shape @ row * self.variances

    def angles(self, slope_rad: float) -> list[Angle]:
        """Return the friction angles |β| − |φ| at both ends, for a slope |β|."""
        found = []
        for kind, theta_rad in ((KINETIC, self.from_rad), (STATIC, self.to_rad)):
            if np.isfinite(theta_rad):
                (m_y, m_z), variances = self.moments_at(theta_rad)
                alpha_rad = slope_rad - float(np.arctan2(m_y, m_z))
                sigma_rad = slip_angle_sigma(m_y, m_z, np.diag(variances))
                found.append(Angle(kind, theta_rad, alpha_rad, sigma_rad))
        return found


def find_rests(
    raw: RawMoments, beta_rad: float, d_x_mm: float, beam: Beam
) -> tuple[int, list[ContactRest]]:
    """Return the number of jumps, and the rests between two of them.

    They are sought where the motor moves steadily. Where it starts, stops or turns round the slip
    per angle changes with its speed, as the moments come late out of the gauges' filter.
    """
    steady = _steady(raw.time_s, raw.theta_rad)
    good = np.zeros(len(raw.theta_rad), dtype=bool)
    good[steady] = np.isfinite(raw.moments_Nmm[steady]).all(axis=1)
    theta = raw.theta_rad[good]
    if len(theta) < 2:
        return 0, []
    moments = raw.moments_Nmm[good] * [np.sign(beta_rad) or 1.0, 1.0]
    slip = _slip_mm(theta, moments, abs(beta_rad), d_x_mm, beam)
    jumps = _jumps(raw.time_s[good], theta, slip)
    return len(jumps), _rests_between(jumps, theta, moments, slip)


def _rests_between(
    jumps: list[int], theta: np.ndarray, moments: np.ndarray, slip: np.ndarray
) -> list[ContactRest]:
    """Return the rests after the samples `jumps`, those that can be fitted."""
    rests = []
    for first, last in pairwise([*jumps, len(theta)]):
        part = slice(first, last)
        rest = _rest(theta[part], moments[part], slip[part], ends_in_jump=last < len(theta))
        if rest is not None:
            rests.append(rest)
    return rests


def _steady(time_s: np.ndarray, motor_rad: np.ndarray) -> slice:
    """Return the samples of a forward stroke at which the motor goes at the speed of its middle.

    It ends where the motor leaves the line of that speed by more than its own noise: encoder steps
    and uneven running, as the middle of the stroke has them.
    """
    middle = _middle(motor_rad)
    if len(middle) < 2:
        return slice(0, 0)
    first = middle[0]
    last = middle[-1] + 1
    line = np.polynomial.Polynomial.fit(time_s[first:last], motor_rad[first:last], 1)
    off = np.abs(motor_rad - line(time_s))
    is_off = off > _OFF_PLATEAU * off[first:last].max()
    before = np.flatnonzero(is_off[:first])
    after = np.flatnonzero(is_off[last:])
    begin = before[-1] + 1 if len(before) else 0
    end = last + after[0] if len(after) else len(motor_rad)
    return slice(int(begin), int(end))


def _middle(motor_rad: np.ndarray) -> np.ndarray:
    """Return the samples in the middle of a stroke, by its angle."""
    low = motor_rad.min()
    high = motor_rad.max()
    edge = 0.5 * (1.0 - _PLATEAU_SHARE) * (high - low)
    return np.flatnonzero((motor_rad >= low + edge) & (motor_rad <= high - edge))


def _slip_mm(
    theta: np.ndarray, moments: np.ndarray, slope_rad: float, d_x_mm: float, beam: Beam
) -> np.ndarray:
    """Return the slip (n,) along a bar of slope |β| by |m_y| and m_z (n, 2) at pushing angles (n,)."""
    mm_per_Nmm = d_x_mm / beam.moment_Nmm(1.0, d_x_mm)
    along = moments @ [np.cos(slope_rad), -np.sin(slope_rad)]
    return mm_per_Nmm * along + d_x_mm * np.sin(slope_rad) * theta


def _jumps(time: np.ndarray, theta: np.ndarray, slip: np.ndarray) -> list[int]:
    """Return the samples at which the slip steps up, relative to one line before and after it."""
    rate = (len(time) - 1) / (time[-1] - time[0])
    speed = np.ptp(theta) / np.ptp(time)
    half = int(np.clip(min(_WINDOW_RAD / speed, _WINDOW_S) * rate, _FEWEST, _MOST))
    step = _steps(slip, half)
    free = step[theta < -_FIRST_RAD / 2][half:-half]
    if len(free) < 4 * half:
        return []
    is_jump = (step > _JUMP_SIGMAS * free.std()) & (theta > _FIRST_RAD)
    is_jump &= step == maximum_filter1d(step, 2 * half + 1)
    is_jump[:half] = False
    is_jump[-half:] = False
    return _without_ringing(np.flatnonzero(is_jump).tolist(), theta, slip)


def _steps(slip: np.ndarray, half: int) -> np.ndarray:
    """Return by how much the slip steps up at each sample, fitted to a line over `half` on each side."""
    at = np.arange(-half, half) + 0.5
    design = np.stack([np.ones_like(at), at, at > 0], axis=1)
    kernel = np.linalg.pinv(design)[2]
    return np.convolve(slip, kernel[::-1], mode="same")


def _without_ringing(jumps: list[int], theta: np.ndarray, slip: np.ndarray) -> list[int]:
    """Return the jumps between whose sides the mean slip grows: those that carry the contact on.

    A whisker that rings after a jump steps to and fro about one place.
    """
    jumps = list(jumps)
    while jumps:
        after_first = jumps[1] if len(jumps) > 1 else len(theta)
        start = max(0, 2 * jumps[0] - after_first)
        sides = [slice(*ends) for ends in pairwise([start, *jumps, len(theta)])]
        middle = np.array([theta[side].mean() for side in sides])
        mean = np.array([slip[side].mean() for side in sides])
        slope = np.diff(mean) / np.diff(middle)
        share = slope * middle[1:] / mean[1:]  # 1: as a slip that never rests
        if share.min() >= _REST_SHARE:
            break
        del jumps[int(np.argmin(share))]
    return jumps


def _rest(
    theta: np.ndarray, moments: np.ndarray, slip: np.ndarray, *, ends_in_jump: bool
) -> ContactRest | None:
    """Fit lines to the moments (n, 2) between two jumps; None where the contact does not rest."""
    inner = slice(_GUARD, len(theta) - _GUARD)
    if len(theta[inner]) < 2 * _FEWEST:
        return None
    middle = theta.mean()
    columns = np.column_stack([moments[inner], slip[inner]])  # |m_y|, m_z, slip
    lines, shape, variances = _fit_lines(theta[inner] - middle, columns)
    slip_mm, slip_per_rad = lines[:, 2]
    if slip_per_rad > _REST_SHARE * slip_mm / middle:
        return None
    return ContactRest(
        from_rad=float(theta[0]),
        to_rad=float(theta[-1]) if ends_in_jump else np.nan,
        middle_rad=float(middle),
        lines=lines[:, :2],
        shape=shape,
        variances=variances[:2],
    )


def _fit_lines(x: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fit lines over x (n,) to k columns (n, k).

    Returns value and slope (2, k), the shape (2, 2) of their covariance, and the variances (k,)
    that it is multiplied by.
    """
    design = np.vander(x, 2, increasing=True)
    lines, _, _, _ = np.linalg.lstsq(design, columns, rcond=None)
    residuals = columns - design @ lines
    variances = np.sum(residuals**2, axis=0) / (len(design) - 2)
    return lines, np.linalg.inv(design.T @ design), variances
