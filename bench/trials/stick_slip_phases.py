"""Stick and slip: where the contact rests on the bar, where it jumps, and the friction angles at both ends of a rest.

The record is the slip over the pushing angle: frame by frame as the cameras show it, and sample by sample from the
moments felt, with the bar's slope as seen. A rest ends when the force leaves the static cone, so |β| − |φ| just before
the jump is the static angle. A jump ends where the force is back on the kinetic cone; a whisker that swings beyond it
would show too large an angle, as nothing tells the two apart.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import find_objects, label

from bench.gauges.felt import FeltStroke
from bench.records.phases import KINETIC, NO_PHASES, STATIC, Angle, Phases
from bench.records.trial_result import SeenWhisk
from bench.session.trial import Trial
from bench.trials.estimates import Readout
from estimator.beam import Beam
from estimator.signal import FeltTouch
from vision.truth.records import FrameTruth

_LEAST_SLIP_MM, _LEAST_FRAMES = (
    0.1,
    3,
)  # mm, frames: less slip, or fewer frames, show neither rest nor jump. Set by eye
_FIRST_RAD = np.radians(0.5)  # before, the slip angle is mostly noise
_REST_SHARE = 0.5  # of the slope of a slip that never rests, σ/θ: below it the contact rests
_LONGEST_JUMP = 2  # intervals between frames
_SIGMAS = 3.0  # a rest is told from free slip where they differ by so many
_JUMP_SIGMAS = 6.0  # in thousands of samples noise reaches 4
# rad, s, samples: half a window in which a slope is taken, the lesser of both, between the counts. Set by eye
_WINDOW_RAD, _WINDOW_S, _FEWEST, _MOST = np.radians(0.12), 0.012, 4, 40
_GUARD = 3  # samples at a jump that the gauges' own filter smears


def seen_phases(frames: FrameTruth, beta_rad: float, d_x_mm: float) -> Phases:
    """Phases from the slip of each touching frame, with its sigma.

    A jump lies anywhere between its two frames: its angles are carried half the way to it, as a contact at rest has
    them, and the other half goes into their sigma.
    """
    theta, slip, sigma, d_y, d_z, alpha, alpha_sigma = _touching(frames)
    if len(theta) < _LEAST_FRAMES:
        return NO_PHASES
    step, freely = (
        np.diff(slip) * np.sign(beta_rad),
        np.abs(slip[:-1]) / theta[:-1] * np.diff(theta),
    )
    rests = np.abs(step) < _REST_SHARE * freely
    known = freely * _REST_SHARE > _SIGMAS * np.sqrt(2.0) * np.maximum(sigma[:-1], sigma[1:])
    turning = np.abs(d_z) * d_x_mm / (d_y**2 + d_z**2)  # dα/dθ of a contact at rest
    angles = []
    jumps = [run for run in _runs(~rests & known) if _is_jump(*run, rests & known)]
    for first, last in jumps:
        way, middle = theta[last] - theta[first], 0.5 * (theta[first] + theta[last])
        for kind, k, half in ((STATIC, first, 0.5), (KINETIC, last, -0.5)):
            spread = float(np.hypot(alpha_sigma[k], turning[k] * way / np.sqrt(12.0)))
            angles.append(
                Angle(kind, float(middle), float(alpha[k] + half * way * turning[k]), spread)
            )
    return Phases(len(_runs(rests & known)), len(jumps), tuple(angles)) if jumps else NO_PHASES


def _is_jump(first: int, last: int, rests) -> bool:
    """Is this short stretch of intervals enclosed by rests?"""
    return (
        first > 0
        and last < len(rests)
        and last - first <= _LONGEST_JUMP
        and bool(rests[first - 1] and rests[last])
    )


def _touching(frames: FrameTruth) -> np.ndarray:
    """Rows (7, n): θ, slip, its sigma, d_y, d_z, α, its sigma, of the frames that touch and are known."""
    slip, alpha = frames.slip_mm, frames.alpha_rad
    rows = np.array(
        [
            frames.theta_rad.value,
            slip.value,
            slip.sigma,
            frames.d_y_mm.value,
            frames.d_z_mm.value,
            alpha.value,
            alpha.sigma,
        ]
    )
    return rows[:, frames.touching & np.isfinite(rows).all(axis=0) & (rows[0] > _FIRST_RAD)]


def _runs(mask) -> list[tuple[int, int]]:
    """(first, one past the last) of each unbroken stretch of True."""
    return [(run.start, run.stop) for (run,) in find_objects(label(mask)[0])]


def phases_of(
    trial: Trial,
    stroke: FeltStroke,
    touch: FeltTouch,
    readout: Readout,
    seen: SeenWhisk,
    beam: Beam,
) -> Phases:
    """Phases felt, with the slope and distance as seen, or the nominal ones where no picture tells of them."""
    if seen.deflection is not None:
        beta_rad, d_x_mm = (seen.beta_rad.value, seen.d_x_mm.value) if slips(seen) else (None, None)
    else:
        beta_rad, d_x_mm = trial.beta_deg and np.radians(trial.beta_deg), trial.d_x_mm
    if not beta_rad or not d_x_mm:
        return NO_PHASES
    theta, moments = stroke.motor_rad - touch.motor_rad, readout.moments_Nmm(stroke, touch)
    return felt_phases(stroke.time_s, theta, moments, beta_rad, d_x_mm, beam)


def felt_phases(
    time_s: np.ndarray,
    theta_rad: np.ndarray,
    moments_Nmm: np.ndarray,
    beta_rad: float,
    d_x_mm: float,
    beam: Beam,
) -> Phases:
    """Phases from the moments (n, 2), m_y and m_z as recorded, unfiltered; NaN samples are left out.

    Between two jumps both moments are lines, whose ends give the friction angles.
    """
    jumps, found = rests_of(time_s, theta_rad, moments_Nmm, beta_rad, d_x_mm, beam)
    angles = tuple(angle for rest in found for angle in rest.angles(abs(beta_rad)))
    return Phases(len(found), jumps, angles) if jumps else NO_PHASES


@dataclass(frozen=True, eq=False)
class Rest:
    """A contact at rest between two jumps: from and to which θ (to: NaN where the record ends before the next jump).

    lines (2, 2): |m_y| and m_z, value and slope about a middle; shape (2, 2) and variances (2,) of their covariance.
    """

    from_rad: float
    to_rad: float
    middle_rad: float
    lines: np.ndarray
    shape: np.ndarray
    variances: np.ndarray

    def moments_at(self, theta_rad: float) -> tuple[np.ndarray, np.ndarray]:
        """|m_y| and m_z (2,) there, and their variances (2,)."""
        row = np.array([1.0, theta_rad - self.middle_rad])
        return row @ self.lines, row @ self.shape @ row * self.variances

    def angles(self, slope: float) -> list[Angle]:
        """|β| − |φ| at both ends."""
        ends = ((KINETIC, self.from_rad), (STATIC, self.to_rad))
        return [
            _angle(kind, at, *self.moments_at(at), slope) for kind, at in ends if np.isfinite(at)
        ]


def rests_of(
    time_s: np.ndarray,
    theta_rad: np.ndarray,
    moments_Nmm: np.ndarray,
    beta_rad: float,
    d_x_mm: float,
    beam: Beam,
) -> tuple[int, list[Rest]]:
    """How many jumps there are, and what lies between two of them where the contact rests there; as `felt_phases`."""
    good = np.isfinite(moments_Nmm).all(axis=1)
    time, theta, moments = (
        time_s[good],
        theta_rad[good],
        moments_Nmm[good] * [np.sign(beta_rad) or 1.0, 1.0],
    )
    slope = abs(beta_rad)
    mm_per_Nmm = d_x_mm / beam.moment_Nmm(1.0, d_x_mm)
    slip = mm_per_Nmm * (moments @ [np.cos(slope), -np.sin(slope)]) + d_x_mm * np.sin(slope) * theta
    jumps = _jumps(time, theta, slip)
    ends = [(a, b, b < len(theta)) for a, b in zip(jumps, [*jumps[1:], len(theta)])]
    found = [_rest(theta[a:b], moments[a:b], slip[a:b], jumps_off) for a, b, jumps_off in ends]
    return len(jumps), [rest for rest in found if rest is not None]


def _jumps(time, theta, slip) -> list[int]:
    """Samples at which the slip steps up, against a line before and after it."""
    rate = (len(time) - 1) / (time[-1] - time[0])
    speed = np.ptp(theta) / np.ptp(time)
    half = int(np.clip(min(_WINDOW_RAD / speed, _WINDOW_S) * rate, _FEWEST, _MOST))
    at = np.arange(-half, half) + 0.5
    kernel = np.linalg.pinv(np.stack([np.ones_like(at), at, at > 0], axis=1))[2]
    step = np.convolve(slip, kernel[::-1], mode="same")
    free = step[theta < -_FIRST_RAD / 2][half:-half]
    if len(free) < 4 * half:
        return []
    candidates = np.flatnonzero((step > _JUMP_SIGMAS * free.std()) & (theta > _FIRST_RAD))
    candidates = candidates[(candidates >= half) & (candidates < len(step) - half)]
    return _without_ringing(
        [int(k) for k in candidates if step[k] == step[k - half : k + half + 1].max()], theta, slip
    )


def _without_ringing(jumps: list[int], theta, slip) -> list[int]:
    """The jumps that carry the contact on: those between whose sides the mean slip grows. A whisker that rings after a
    jump steps to and fro about one place."""
    while jumps:
        edges = [0, *jumps, len(theta)]
        edges[0] = max(0, 2 * jumps[0] - (jumps[1] if len(jumps) > 1 else len(theta)))
        middle, mean = np.array(
            [(theta[a:b].mean(), slip[a:b].mean()) for a, b in pairwise(edges)]
        ).T
        share = (
            np.diff(mean) / np.diff(middle) * middle[1:] / mean[1:]
        )  # 1: as a slip that never rests
        if share.min() >= _REST_SHARE:
            break
        jumps = [k for i, k in enumerate(jumps) if i != int(np.argmin(share))]
    return jumps


def _rest(theta, moments, slip, jumps_off: bool) -> Rest | None:
    """What lies between two jumps; None where the contact does not rest there."""
    inner = slice(_GUARD, len(theta) - _GUARD)
    if len(theta[inner]) < 2 * _FEWEST:
        return None
    middle = theta.mean()
    design = np.stack([np.ones_like(theta[inner]), theta[inner] - middle], axis=1)
    columns = np.column_stack([moments[inner], slip[inner]])
    lines, _, _, _ = np.linalg.lstsq(design, columns, rcond=None)
    if lines[1, 2] > _REST_SHARE * lines[0, 2] / middle:
        return None
    variances = np.sum((columns - design @ lines) ** 2, axis=0)[:2] / (len(design) - 2)
    ends = float(theta[0]), float(theta[-1]) if jumps_off else np.nan
    return Rest(*ends, float(middle), lines[:, :2], np.linalg.inv(design.T @ design), variances)


def _angle(kind: str, at: float, moments, variances, slope: float) -> Angle:
    """|β| − |φ| of the moments |m_y|, m_z with their variances."""
    m_y, m_z = moments
    gradient = np.array([m_z, -m_y]) / (m_y**2 + m_z**2)
    return Angle(
        kind, at, slope - float(np.arctan2(m_y, m_z)), float(np.sqrt(gradient**2 @ variances))
    )


def slips(seen: SeenWhisk) -> bool:
    """Does the contact move along the bar? Else the force may lie anywhere within the friction cone."""
    d = seen.deflection
    return (
        d is not None
        and len(d.theta_rad) >= _LEAST_FRAMES
        and bool(np.ptp(d.slip_mm) >= _LEAST_SLIP_MM)
    )
