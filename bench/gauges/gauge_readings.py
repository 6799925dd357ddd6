"""What a whisk of a gauge trial tells: moments known from the deflection seen, and the volts read beside them.

Where a session has no pictures the deflection is that of a nominal bar held still, from the angle of felt touch.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.gauges.clamped_rod import moment_at_clamp
from bench.gauges.drift import allow_drift
from bench.gauges.felt import Stroke, gauge_delay, late_by
from bench.gauges.matrix import to_follicle
from bench.records.trial_result import SeenWhisk
from bench.session.trial import Trial
from bench.session.whisker import Whisker
from estimator.beam import rigidity_at
from estimator.signal import FeltTouch
from vision.truth.value import Value

# A rod that bends is drawn towards its clamp over the bar, and friction pulls it back. How rough the bar is, is not
# known at this stage: from nothing to 0.4, all values alike. At 3° this is 0.2 % of the moment, ± 0.1 %.
_FRICTION, _FRICTION_SIGMA = 0.2, 0.4 / np.sqrt(12.0)
_LEAST_THETA_RAD = np.radians(0.3)  # rad: nearer to touch its error counts too much. Set by eye
NOMINAL_SHARE = 0.01  # a distance set by a ruler
# °: up to here the moments of a nominal distance are those of no slip to half a percent (1 − cos)
_NOMINAL_SLOPE_DEG = 5.0
# rad: a stroke's usual range, where no frame tells the angles
_NOMINAL_THETA_RAD = np.radians(np.linspace(1.0, 4.0, 6))
_MOST_HALF_WINDOW_RAD = np.radians(
    0.5
)  # rad: as the estimators average over (estimator.signal.HALF_WINDOW_RAD)


@dataclass(frozen=True)
class Pairs:
    """n pairs of one whisk. moments, volts (n, 2), in the follicle's axes and above the free stroke; their covariances
    (2n, 2n), of y and z pair by pair, with everything that the pairs share but scale_sigma, their common share of error
    (that of the distance); theta_rad (n,).

    paper_moment, paper_volts (2,): the one pair that the paper takes, (2) at one pushing angle; NaN where not reached.
    """

    trial: str
    whisk: int
    roll_deg: float
    theta_rad: np.ndarray
    moments: np.ndarray
    moments_covariance: np.ndarray
    volts: np.ndarray
    volts_covariance: np.ndarray
    paper_moment: np.ndarray
    paper_volts: np.ndarray
    scale_sigma: float = 0.0

    def __len__(self) -> int:
        return len(self.theta_rad)

    def residuals(self, matrix: np.ndarray) -> np.ndarray:
        """Moments (n, 2) by these coefficients (2, 2) less those known, N·mm."""
        return self.volts @ matrix.T - self.moments

    @property
    def moments_sigma(self) -> np.ndarray:
        """One standard deviation (n, 2) of the known moments, N·mm."""
        return np.hypot(
            np.sqrt(np.diag(self.moments_covariance)).reshape(-1, 2),
            self.scale_sigma * self.moments,
        )


ON_TIME = Value(0.0, 0.0)  # rad


@dataclass(frozen=True)
class ReferenceMoments:
    """Moments (n, 2) in the hub's axes at motor angles motor_rad (n,), with covariance (2n, 2n); touch and distance.

    scale_sigma: share by which all moments may be wrong together; not in the covariance. late_rad: by what the motor is
    ahead of the volts of a moment.
    """

    touch_rad: float
    d_x_mm: float
    motor_rad: np.ndarray
    theta_rad: np.ndarray
    moments: np.ndarray
    covariance: np.ndarray
    scale_sigma: float
    late_rad: Value = ON_TIME


def pairs_of(
    trial: Trial,
    seen: SeenWhisk,
    stroke: Stroke,
    drift_rate: np.ndarray,
    whisker: Whisker,
    theta_rad: float,
) -> Pairs | None:
    """Pairs of one whisk, or None where it has none. theta_rad: the paper's pushing angle."""
    touch = allow_drift(stroke.touch(), drift_rate, stroke.speed_rad_s)
    if touch.status:
        return None
    is_seen = seen.deflection is not None
    reference = (
        reference_from_pictures(seen, whisker)
        if is_seen
        else reference_from_nominal(trial, touch, whisker)
    )
    if reference is None:
        return None
    if is_seen:  # a nominal one counts from felt touch, which is as late as the volts
        late = late_by(gauge_delay(trial.gauge_filter_Hz), stroke.speed_rad_s)
        reference = replace(reference, late_rad=late)
    rigid_Nmm = whisker.beam.moment_Nmm(theta_rad, reference.d_x_mm)
    return _paired(trial, seen.whisk, reference, stroke, touch, rigid_Nmm, theta_rad)


def reference_from_pictures(seen: SeenWhisk, whisker: Whisker) -> ReferenceMoments | None:
    """Moments of the frames in which the whisker touches, from the exact rod through the contact that was seen.

    The deflection is from the unbent whisker as the free stroke shows it, so a sag or a set of the wire is no moment.
    """
    d = seen.deflection
    good = d.theta_rad > _LEAST_THETA_RAD
    if not good.any():
        return None
    across = np.stack([d.across_z_mm, d.across_y_mm], axis=1)[good]
    along, d_x = d.along_mm[good], seen.d_x_mm
    share = _drawn_share(across, along, d.slip_mm[good])
    moments, by_friction = _with_friction(along, across, share, whisker)
    stiffness = np.repeat(moments_per_mm(moments, across), 2)
    rows = np.repeat(good, 2)
    covariance = d.covariance[np.ix_(rows, rows)] * np.outer(stiffness, stiffness)
    covariance = covariance + _shared(_FRICTION_SIGMA * by_friction)
    by_distance = 2.0 * d_x.sigma / d_x.value
    theta, motor = d.theta_rad[good], d.motor_rad[good]
    return ReferenceMoments(
        seen.touch_rad.value, d_x.value, motor, theta, moments, covariance, by_distance
    )


def _drawn_share(across, along, slip) -> np.ndarray:
    """Share (n,) of the sliding that goes along the rod: the arc's excess over its chord, 0.6 w²/x, beside the slip."""
    drawn = 0.6 * np.sum(across**2, axis=1) / along
    return drawn / np.hypot(drawn, slip)


def _with_friction(along, across, share, whisker: Whisker) -> tuple[np.ndarray, np.ndarray]:
    """Moments (n, 2) in the hub's axes, and their change per unit of the friction coefficient."""
    size = np.linalg.norm(across, axis=1)

    def rigidity(arc):
        return rigidity_at(arc, whisker.EI_Nmm2, whisker.length_mm, whisker.beam.taper)

    def moment(friction: float):
        return moment_at_clamp(along, size, rigidity, -friction * share)

    rough, smooth = moment(_FRICTION), moment(0.0)
    return (rough / size)[:, None] * across, ((rough - smooth) / _FRICTION / size)[:, None] * across


def moments_per_mm(moments: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Stiffness (n,) of each pair: moment over deflection."""
    return np.linalg.norm(moments, axis=1) / np.linalg.norm(across, axis=1)


def _shared(effect) -> np.ndarray:
    """Covariance (2n, 2n) of one cause that moves all moments (n, 2) together by `effect`."""
    return np.outer(effect.ravel(), effect.ravel())


def reference_from_nominal(
    trial: Trial, touch: FeltTouch, whisker: Whisker
) -> ReferenceMoments | None:
    """Moments of a bar at right angles to the push, at the distance that a ruler gave; None where there is none.

    The bent whisker leans by half the pushing angle where it touches, and rolls that far over the bar towards its base.
    """
    if trial.d_x_mm is None or abs(trial.beta_deg or 0.0) > _NOMINAL_SLOPE_DEG:
        return None
    theta = _NOMINAL_THETA_RAD
    radii_mm = 0.5 * trial.bar_diameter_mm + float(whisker.wire.radius_mm(trial.d_x_mm))
    x, y = trial.d_x_mm - radii_mm * np.sin(theta / 2), radii_mm * (1.0 - np.cos(theta / 2))
    along, across = x * np.cos(theta) + y * np.sin(theta), x * np.sin(theta) - y * np.cos(theta)
    deflection = np.stack([np.zeros_like(across), across], axis=1)
    moments, by_friction = _with_friction(along, deflection, np.ones_like(theta), whisker)
    by_distance = trial.d_x_sigma_mm / trial.d_x_mm or NOMINAL_SHARE
    by_touch = touch.sigma_rad * moments / theta[:, None]
    covariance = _shared(by_touch) + _shared(_FRICTION_SIGMA * by_friction)
    motor = touch.motor_rad + theta
    return ReferenceMoments(
        touch.motor_rad, trial.d_x_mm, motor, theta, moments, covariance, by_distance
    )


def _paired(
    trial: Trial,
    whisk: int,
    reference: ReferenceMoments,
    stroke: Stroke,
    touch: FeltTouch,
    rigid_Nmm: float,
    theta_rad: float,
) -> Pairs | None:
    """Volts at the same motor angles, but as late as the gauges' filter has them, each from a short line through the
    samples around it. None where the wanted pushing angle, as seen, is reached before a touch is felt."""
    late = reference.late_rad
    theta = reference.motor_rad + late.value - touch.motor_rad
    half = min(_MOST_HALF_WINDOW_RAD, 0.5 * np.min(np.diff(reference.motor_rad), initial=np.inf))
    after = theta > 0.5 * _LEAST_THETA_RAD
    read = [
        stroke.at(t, touch, half_window_rad=half) if ok else None for t, ok in zip(theta, after)
    ]
    kept = np.array([r is not None and not r.status for r in read], dtype=bool)
    wanted = reference.touch_rad + theta_rad + late.value - touch.motor_rad
    if not kept.any() or wanted <= 0.0:
        return None
    read, rows = [r for r, keep in zip(read, kept) if keep], np.repeat(kept, 2)
    moments, covariance = _seen_from_follicle(
        trial, reference.moments[kept], reference.covariance[np.ix_(rows, rows)]
    )
    at = stroke.at(wanted, touch)
    return Pairs(
        trial.name,
        whisk,
        trial.follicle_roll_deg,
        reference.theta_rad[kept],
        moments,
        covariance,
        volts := np.array([r.values for r in read]),
        _volts_covariance(read, theta[kept], touch)
        + _shared(volts / theta[kept, None] * late.sigma),
        to_follicle(np.radians(trial.follicle_roll_deg)) @ [0.0, rigid_Nmm],
        at.values,
        reference.scale_sigma,
    )


def _seen_from_follicle(trial: Trial, moments, covariance) -> tuple[np.ndarray, np.ndarray]:
    """Moments (n, 2) and covariance in the axes of the turned follicle, with the turn's own sigma."""
    roll = np.radians(trial.follicle_roll_deg)
    turn = np.kron(np.eye(len(moments)), to_follicle(roll))
    by_roll = moments @ to_follicle(roll + np.pi / 2).T * np.radians(trial.follicle_roll_sigma_deg)
    return moments @ to_follicle(roll).T, turn @ covariance @ turn.T + _shared(by_roll)


def _volts_covariance(read: Sequence, theta, touch: FeltTouch) -> np.ndarray:
    """(2n, 2n): each reading's own, and the zero that all share."""
    n = len(read)
    covariance = np.zeros((2 * n, 2 * n))
    for i in range(n):
        for j in range(n):
            both = touch.level.covariance_between(
                touch.motor_rad + theta[i], touch.motor_rad + theta[j]
            )
            covariance[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] = (
                read[i].covariance if i == j else both
            )
    return covariance
