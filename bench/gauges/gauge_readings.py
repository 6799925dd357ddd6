"""Readings of a gauge trial's whisk: moments known from the deflection seen, and the volts read with them.

Where a session has no pictures the deflection is that of a nominal bar held still, from the angle of felt touch.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.base.statuses import reason
from bench.gauges.drift import allow_drift
from bench.gauges.felt import FeltStroke, gauge_delay, late_by
from bench.gauges.matrix import to_follicle
from bench.gauges.whisker_rods import SeenContacts, WhiskerRod, rod_of
from bench.records.trial_result import Deflection, SeenWhisk
from bench.session.trial import Trial
from bench.session.whisker import Whisker
from estimator.signal import FeltTouch, MomentAt
from vision import Value
from vision.geometry import Reason, as_reason

# [1] A rod that bends is drawn towards its clamp over the bar, and friction pulls it back. How rough the bar is, is not
# known at this stage: from nothing to 0.4, all values alike. At 3° this is 0.2 % of the moment, ± 0.1 %. Stated.
_FRICTION = 0.2
# [1] Standard deviation of that uniform distribution. Derived.
_FRICTION_SIGMA = 0.4 / np.sqrt(12.0)
# [rad] Least pushing angle of a frame that gives a moment: touch, known to some 0.006°, makes 2 % of it there and
# less farther on. Derived.
_LEAST_THETA_RAD = np.radians(0.3)
# [1] A distance set by a ruler: one sigma over the distance. Stated.
NOMINAL_SHARE = 0.01
# [°] Up to here the moments of a nominal distance are those of no slip to half a percent (1 − cos).
_NOMINAL_SLOPE_DEG = 5.0
# [rad] A stroke's usual range, where no frame has the angles.
_NOMINAL_THETA_RAD = np.radians(np.linspace(1.0, 4.0, 6))
# [rad] As the estimators average over (estimator.signal.HALF_WINDOW_RAD).
_MOST_HALF_WINDOW_RAD = np.radians(0.5)
# Where moments come from.
SEEN = "seen in pictures"
WIRE_ALONE = "seen in pictures, by the wire alone"
NOMINAL = "set: nominal distance"
# Of contacts and the friction along the rod: moments (n, 2), or moments and forces (n, 5).
Loads = Callable[[SeenContacts, float | np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Pairs:
    """n pairs of moments and volts of one whisk.

    moments, volts (n, 2), in the follicle's axes and above the free stroke; their covariances (2n,
    2n), of y and z pair by pair, with everything that the pairs share but two: scale_sigma, their
    common share of error (that of the contact's place along the wire), and by_camera_error (2n, k),
    how the moments change with each unit error of the cameras, which other whisks share as well (k
    is 0 where no camera saw them). theta_rad (n,). paper_moment, paper_volts (2,): the one pair
    that the paper takes, (2) at one pushing angle; NaN where not reached. source: where the moments
    come from.
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
    by_camera_error: np.ndarray | None = None
    source: str = SEEN

    def __post_init__(self):
        """Set no camera's error where none is given."""
        if self.by_camera_error is None:
            object.__setattr__(self, "by_camera_error", np.zeros((2 * len(self), 0)))

    def __len__(self) -> int:
        """Return the number of pairs."""
        return len(self.theta_rad)

    def residuals(self, matrix: np.ndarray) -> np.ndarray:
        """Return the moments (n, 2) by these coefficients (2, 2) less those known, N·mm."""
        return self.volts @ matrix.T - self.moments

    @property
    def moments_sigma(self) -> np.ndarray:
        """Return one standard deviation (n, 2) of the known moments, N·mm."""
        return _sigmas(
            self.moments, self.moments_covariance, self.by_camera_error, self.scale_sigma
        )


ON_TIME = Value(0.0, 0.0)  # rad


@dataclass(frozen=True)
class ReferenceMoments:
    """Known moments (n, 2) in the hub's axes, with covariance (2n, 2n); touch and distance.

    motor_rad (n,): motor angles of the moments. scale_sigma: share by which all moments may be
    wrong together, by_camera_error (2n, k): how they change with each unit error of the cameras;
    neither is in the covariance. late_rad: by what the motor is ahead of the volts of a moment.
    """

    touch_rad: float
    d_x_mm: float
    motor_rad: np.ndarray
    theta_rad: np.ndarray
    moments: np.ndarray
    covariance: np.ndarray
    scale_sigma: float
    by_camera_error: np.ndarray
    late_rad: Value = ON_TIME

    @property
    def moments_sigma(self) -> np.ndarray:
        """Return one standard deviation (n, 2) of the moments, N·mm."""
        return _sigmas(self.moments, self.covariance, self.by_camera_error, self.scale_sigma)


def _sigmas(
    moments: np.ndarray, covariance: np.ndarray, by_camera_error: np.ndarray, scale_sigma: float
) -> np.ndarray:
    """Return one standard deviation (n, 2) of moments (n, 2) by all three parts of their error.

    covariance (2n, 2n); by_camera_error (2n, k); scale_sigma: share of all moments together.
    """
    variances = np.diag(covariance) + np.sum(by_camera_error**2, axis=1)
    apart = np.sqrt(np.maximum(variances, 0.0)).reshape(-1, 2)  # below 0 by rounding only
    return np.hypot(apart, scale_sigma * moments)


def pairs_of(
    trial: Trial,
    seen: SeenWhisk,
    stroke: FeltStroke,
    drift_rate: np.ndarray,
    whisker: Whisker,
    theta_rad: float,
) -> Pairs | Reason:
    """Return the pairs of one whisk, or the reason why it has none. theta_rad: the paper's pushing angle."""
    touch = allow_drift(stroke.touch, drift_rate, stroke.speed_rad_s)
    if touch.status:
        return as_reason(touch.status)
    try:
        if seen.deflection is None:
            # it counts from felt touch, which is as late as the volts
            reference = reference_from_nominal(_with_stated(trial, seen), touch, whisker)
        else:
            reference = reference_from_pictures(seen, whisker)
            if reference is not None:
                late = late_by(gauge_delay(trial.gauge_filter_Hz), stroke.speed_rad_s)
                reference = replace(reference, late_rad=late)
    except ArithmeticError as problem:
        return reason("gauge_rod_unconverged", problem=problem)
    if reference is None:
        return reason("gauge_moments_unknown")
    rigid_Nmm = whisker.beam.moment_Nmm(theta_rad, reference.d_x_mm)
    pairs = _paired(trial, seen.whisk, reference, stroke, touch, rigid_Nmm, theta_rad)
    if pairs is None:
        return reason("gauge_push_short", degrees=np.degrees(theta_rad))
    return replace(pairs, source=source_of(seen))


def _with_stated(trial: Trial, seen: SeenWhisk) -> Trial:
    """Return the trial with the distance and slope that a stage states of it, where one does."""
    if not seen.has_truth:
        return trial
    d_x_mm = seen.d_x_mm
    beta_deg = float(np.degrees(seen.beta_rad.value))
    return replace(
        trial,
        d_x_mm=float(d_x_mm.value),
        d_x_sigma_mm=float(d_x_mm.sigma),
        beta_deg=beta_deg if np.isfinite(beta_deg) else None,
    )


def reference_from_pictures(seen: SeenWhisk, whisker: Whisker) -> ReferenceMoments | None:
    """Return the moments of the frames in which the whisker touches; None where there are none.

    Raises ArithmeticError where no rod of its rigidity is bent so.

    They are those of the exact rod through the contact that was seen, whose place and deflection
    are the wire's: neither the slope of the bar nor the slip is needed, and a whisk without a truth
    serves too. The deflection is from the unbent whisker as the free stroke has it, so a sag or a
    set of the wire is no moment. The force lies in the plane in which the wire is bent.
    """
    good = frames_with_moments(seen.deflection)
    if not good.any():
        return None
    d = seen.deflection.part(good)
    moments = _seen_loads(d, whisker, lambda rod: rod.moments_Nmm)
    by_arc = moments.by_arc
    scale_sigma = float(np.sum(by_arc * moments.values) / np.sum(moments.values**2))
    return ReferenceMoments(
        d.touch_rad.value,
        d.d_x_mm,
        d.motor_rad,
        d.theta_rad,
        moments.values,
        moments.own_covariance + _common_cause(by_arc - scale_sigma * moments.values),
        scale_sigma=abs(scale_sigma),
        by_camera_error=moments.by_camera_error,
    )


def loads_from_pictures(deflection: Deflection, whisker: Whisker) -> tuple[np.ndarray, np.ndarray]:
    """Return the loads (n, 5) of `WhiskerRod.loads` in the n frames of `frames_with_moments`, and
    their covariance (5n, 5n), without that of the whisker's stiffness.

    Raises ArithmeticError where no rod of its rigidity is bent so.
    """
    d = deflection.part(frames_with_moments(deflection))
    loads = _seen_loads(d, whisker, lambda rod: rod.loads)
    covariance = loads.own_covariance + _common_cause(loads.by_arc)
    return loads.values, covariance + loads.by_camera_error @ loads.by_camera_error.T


def frames_with_moments(deflection: Deflection) -> np.ndarray:
    """Return which frames (f,) of a deflection are far enough from touch to show a moment."""
    return deflection.theta_rad > _LEAST_THETA_RAD


@dataclass(frozen=True, eq=False)
class _SeenLoads:
    """Moments, or moments and forces, values (n, k), of the contacts seen, with the parts of their error.

    by_arc (n, k): by one sigma of the contact's mean place along the wire. own_covariance (nk, nk):
    of all else but the cameras. by_camera_error (nk, c).
    """

    values: np.ndarray
    by_arc: np.ndarray
    own_covariance: np.ndarray
    by_camera_error: np.ndarray


def _seen_loads(
    d: Deflection, whisker: Whisker, loads_of: Callable[[WhiskerRod], Loads]
) -> _SeenLoads:
    """Return the loads in the frames of a deflection, one frame at least.

    loads_of: which loads of a rod. Raises ArithmeticError where no rod is bent so.
    """
    contacts = SeenContacts.of(d)
    share = _share_along_rod(contacts, d.slip_mm, d.slip_sigma_mm)
    friction = -_FRICTION * share.value
    loads = loads_of(rod_of(whisker))
    values = loads(contacts, friction)
    by_place = _by_places(contacts.derivatives(lambda moved: loads(moved, friction), values))
    by_cameras_mm = d.by_camera_error_mm
    by_arc, own_covariance = _common_and_own(
        by_place, d.covariance - by_cameras_mm @ by_cameras_mm.T
    )
    own_covariance += _covariance_by_friction(contacts, share, loads, values)
    for rest_mm in whisker.beam.other_rests_mm():
        other = loads_of(rod_of(whisker.with_rest(rest_mm)))
        own_covariance += _common_cause(other(contacts, friction) - values)
    return _SeenLoads(values, by_arc, own_covariance, by_place @ by_cameras_mm)


def _by_places(of_own: np.ndarray) -> np.ndarray:
    """Return the derivatives (nk, 3n) of the loads of n frames by the places of all contacts.

    of_own (n, k, 3): of the k loads of each frame by the place of its own contact. Further along the
    wire the deflection grows too; what is left of both is in the covariance of the places.
    """
    n, loads, _ = of_own.shape
    rows = np.zeros((n, loads, n, 3))
    frames = np.arange(n)
    rows[frames, :, frames] = of_own
    return rows.reshape(-1, 3 * n)


def _covariance_by_friction(
    contacts: SeenContacts, share: Value, loads: Loads, here: np.ndarray
) -> np.ndarray:
    """Return the covariance (nk, nk) of k loads by friction: its size, and its share along the rod.

    share (n,): that share. here (n, k): the loads of the contacts where they are.
    """
    by_friction = (here - loads(contacts, 0.0)) / _FRICTION
    by_share = _FRICTION * by_friction * (share.sigma / share.value)[:, None]
    return _common_cause(_FRICTION_SIGMA * by_friction) + _common_cause(by_share)


def source_of(seen: SeenWhisk) -> str:
    """Return where the moments of a whisk come from, for people."""
    if seen.deflection is None:
        return NOMINAL
    return SEEN if seen.has_truth else WIRE_ALONE


def _common_and_own(by_place: np.ndarray, of_places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return by how much (n, k) one sigma of the contact's mean place moves all k loads, and the
    covariance (kn, kn) of what else they are off by.

    of_places (3n, 3n): covariance of the places by which the loads have derivatives (kn, 3n).
    """
    covariance = by_place @ of_places @ by_place.T
    mean_place = np.zeros(len(of_places))
    mean_place[::3] = 3.0 / len(of_places)
    # Below 0 by rounding only, where cameras' errors were nearly all of the places'.
    sigma = np.sqrt(max(mean_place @ of_places @ mean_place, 0.0))
    common = by_place @ (of_places @ mean_place) / (sigma or 1.0)  # exact places have no error
    frames = len(of_places) // 3
    return common.reshape(frames, -1), covariance - np.outer(common, common)


def _share_along_rod(contacts: SeenContacts, slip: np.ndarray, slip_sigma: np.ndarray) -> Value:
    """Return the share (n,) of the sliding that goes along the rod, with its sigma.

    It is the arc's excess over its chord, 0.6 w²/x; the slip across is the rest. It is the mean of
    three slips that have the mean and the variance of the one seen: where the slope of the bar is
    hardly known, nor is the slip along it.
    """
    drawn = 0.6 * np.sum(contacts.across_mm**2, axis=1) / contacts.along_mm
    slips = slip + np.sqrt(3.0) * np.outer([-1.0, 0.0, 1.0], slip_sigma)  # (3, n)
    shares = drawn / np.hypot(drawn, slips)
    weights = np.array([1.0, 4.0, 1.0]) / 6.0
    mean = weights @ shares
    return Value(mean, np.sqrt(weights @ (shares - mean) ** 2))


def _common_cause(effect: np.ndarray) -> np.ndarray:
    """Return the covariance (kn, kn) of one cause that moves all loads (n, k) by `effect`."""
    return np.outer(effect.ravel(), effect.ravel())


def reference_from_nominal(
    trial: Trial, touch: FeltTouch, whisker: Whisker
) -> ReferenceMoments | None:
    """Return the moments of a bar at right angles to the push, at the distance that a ruler gave.

    The bent whisker leans by half the pushing angle where it touches, and rolls that far over the
    bar towards its base. None where there is no such distance. Raises ArithmeticError where no rod is
    bent so there.
    """
    if trial.d_x_mm is None or abs(trial.beta_deg or 0.0) > _NOMINAL_SLOPE_DEG:
        return None
    theta = _NOMINAL_THETA_RAD
    radii_mm = 0.5 * trial.bar_diameter_mm + float(whisker.wire.radius_mm(trial.d_x_mm))
    along, across = _nominal_contacts(theta, trial.d_x_mm, radii_mm)
    contacts = SeenContacts(along, across, theta, trial.d_x_mm)
    rod = rod_of(whisker)
    moments = rod.moments_Nmm(contacts, -_FRICTION)
    by_friction = (moments - rod.moments_Nmm(contacts, 0.0)) / _FRICTION
    by_touch = touch.sigma_rad * moments / theta[:, None]
    return ReferenceMoments(
        touch.motor_rad,
        trial.d_x_mm,
        touch.motor_rad + theta,
        theta,
        moments,
        _common_cause(by_touch) + _common_cause(_FRICTION_SIGMA * by_friction),
        scale_sigma=trial.d_x_sigma_mm / trial.d_x_mm or NOMINAL_SHARE,
        by_camera_error=np.zeros((moments.size, 0)),
    )


def _nominal_contacts(
    theta: np.ndarray, d_x_mm: float, radii_mm: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return where contacts lie along (n,) and across (n, 2) the hub's axis at pushing angles (n,).

    The whisker's middle is the sum of the radii away from that of the bar.
    """
    x = d_x_mm - radii_mm * np.sin(theta / 2)
    y = radii_mm * (1.0 - np.cos(theta / 2))
    across = np.zeros((len(theta), 2))
    across[:, 1] = x * np.sin(theta) - y * np.cos(theta)
    return x * np.cos(theta) + y * np.sin(theta), across


def _paired(
    trial: Trial,
    whisk: int,
    reference: ReferenceMoments,
    stroke: FeltStroke,
    touch: FeltTouch,
    rigid_Nmm: float,
    theta_rad: float,
) -> Pairs | None:
    """Return the moments with the volts at their motor angles, as late as the gauges' filter has them.

    Each is from a short line through the samples around it. None where the wanted pushing angle, as
    seen, is reached before a touch is felt. rigid_Nmm: the paper's moment at that angle.
    """
    late = reference.late_rad
    roll_rad = np.radians(trial.follicle_roll_deg)
    felt_theta = reference.motor_rad + late.value - touch.motor_rad  # (n,)
    wanted = reference.touch_rad + theta_rad + late.value - touch.motor_rad
    kept, readings = _readings(stroke, touch, felt_theta, reference.motor_rad)
    if not readings or wanted <= 0.0:
        return None
    theta = felt_theta[kept]
    moments, covariance, by_camera_error = _in_follicle(trial, reference, kept)
    volts = np.array([reading.values for reading in readings])
    by_delay = volts / theta[:, None] * late.sigma
    return Pairs(
        trial=trial.name,
        whisk=whisk,
        roll_deg=trial.follicle_roll_deg,
        theta_rad=reference.theta_rad[kept],
        moments=moments,
        moments_covariance=covariance,
        volts=volts,
        volts_covariance=_volts_covariance(readings, theta, touch) + _common_cause(by_delay),
        paper_moment=to_follicle(roll_rad) @ [0.0, rigid_Nmm],
        paper_volts=stroke.at(wanted, touch).values,
        scale_sigma=reference.scale_sigma,
        by_camera_error=by_camera_error,
    )


def _readings(
    stroke: FeltStroke, touch: FeltTouch, theta: np.ndarray, motor_rad: np.ndarray
) -> tuple[np.ndarray, list[MomentAt]]:
    """Return the indices (k,) of pushing angles (n,) that can be read, and the readings there.

    The lines of neighbouring angles do not overlap.
    """
    half_rad = min(_MOST_HALF_WINDOW_RAD, 0.5 * np.min(np.diff(motor_rad), initial=np.inf))
    kept = []
    readings = []
    for k in np.flatnonzero(theta > 0.5 * _LEAST_THETA_RAD):
        reading = stroke.at(theta[k], touch, half_window_rad=half_rad)
        if not reading.status:
            kept.append(k)
            readings.append(reading)
    return np.array(kept, dtype=int), readings


def _in_follicle(
    trial: Trial, reference: ReferenceMoments, kept: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return moments (n, 2), their covariance (2n, 2n) and their change with the cameras' errors (2n, k).

    They are in the axes of the turned follicle, at the indices `kept` (n,); the covariance has the
    turn's own sigma.
    """
    moments = reference.moments[kept]
    rows = (2 * kept[:, None] + np.arange(2)).ravel()
    covariance = reference.covariance[np.ix_(rows, rows)]
    roll = np.radians(trial.follicle_roll_deg)
    turn = np.kron(np.eye(len(moments)), to_follicle(roll))
    per_radian = moments @ to_follicle(roll + np.pi / 2).T
    by_roll = per_radian * np.radians(trial.follicle_roll_sigma_deg)
    return (
        moments @ to_follicle(roll).T,
        turn @ covariance @ turn.T + _common_cause(by_roll),
        turn @ reference.by_camera_error[rows],
    )


def _volts_covariance(
    readings: Sequence[MomentAt], theta: np.ndarray, touch: FeltTouch
) -> np.ndarray:
    """Return the covariance (2n, 2n) of readings: each one's own, and the zero that all share."""
    n = len(readings)
    angles = touch.motor_rad + theta
    blocks = np.empty((n, 2, n, 2))
    for i in range(n):
        for j in range(n):
            blocks[i, :, j] = touch.level.covariance_between(angles[i], angles[j])
        blocks[i, :, i] = readings[i].covariance
    return blocks.reshape(2 * n, 2 * n)
