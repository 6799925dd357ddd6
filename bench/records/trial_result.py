"""The result of one trial: what is seen, felt and estimated in each whisk.

A number that is missing is NaN, a record that is missing None; a status says why.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from bench.records.phases import NO_PHASES, Phases
from vision import NAN, UNKNOWN, FrameTruth, KeptFit, SeenWidth, TruthAtAngle, Value, WhiskTruth
from vision.geometry import NO_REASON, Reason, joined

# Where the truth of a whisk comes from.
BY_PICTURES = "pictures"
BY_STAGE = "stage"
# Estimator by equation (10) with α_est as given.
WITH_FRICTION = "with_friction"


@dataclass(frozen=True)
class TrialFacts:
    """Facts of a trial from its manifest.

    beta_nominal_sigma_rad: as stated, else that of a slope set by hand (`nominal_slope`).
    """

    name: str
    purpose: str
    surface: str
    speed_deg_s: float | None
    d_x_nominal_mm: float = NAN
    beta_nominal_deg: float = NAN
    bar_diameter_mm: float = NAN
    beta_nominal_sigma_rad: float = NAN
    angle_from: str = "log"

    @property
    def panel(self) -> tuple[str, float | None]:
        """Return surface and speed: whisks that are alike in both belong together."""
        return self.surface, self.speed_deg_s


@dataclass(frozen=True)
class WhiskerFacts:
    """Facts of the whisker, which must be alike in results that are pooled.

    widths: as `bench.session.profile.Profile` has them; none where no diameters are measured.
    """

    shape: str
    length_mm: float
    diameter_mm: float
    EI_Nmm2: float
    tip_diameter_mm: float | None = None
    widths: tuple[float, ...] = ()

    def thickness(self, x_mm: float) -> float:
        """Return the diameter at a distance from the base as a share of the base's diameter."""
        if self.widths:
            return float(np.polynomial.polynomial.polyval(x_mm / self.length_mm, self.widths))
        tips_mm = {"cylinder": self.diameter_mm, "cone": 0.0}
        tip_mm = tips_mm.get(self.shape, self.tip_diameter_mm)
        return 1.0 - (1.0 - tip_mm / self.diameter_mm) * x_mm / self.length_mm


@dataclass(frozen=True, eq=False)
class Deflection:
    """Place of the contact in the hub's axes while it touches, relative to the unbent whisker.

    It is known by the wire alone, in a whisk without a truth too. Each array is (frames,).
    slip_mm: along the bar. past_mm: how far the whisker's material has moved along itself past the
    bar, from any zero (rolling is no such motion). covariance (3 frames, 3 frames): of along_mm,
    across_z_mm and across_y_mm, frame by frame; by_camera_error_mm (3 frames, k): how these change
    with each unit error of the session's cameras, which is in the covariance. touch_rad, d_x_mm: by
    the fit, which need not be known as well as a truth is.
    """

    theta_rad: np.ndarray
    motor_rad: np.ndarray
    slip_mm: np.ndarray
    slip_sigma_mm: np.ndarray
    along_mm: np.ndarray
    across_y_mm: np.ndarray
    across_z_mm: np.ndarray
    past_mm: np.ndarray
    covariance: np.ndarray
    by_camera_error_mm: np.ndarray
    touch_rad: Value
    d_x_mm: float

    def part(self, which: np.ndarray) -> "Deflection":
        """Return the deflection in some of its frames; which (frames,): True for these."""
        of_frames = {
            name: array[which] for name, array in vars(self).items() if np.ndim(array) == 1
        }
        rows = np.repeat(which, 3)
        return replace(
            self,
            **of_frames,
            covariance=self.covariance[np.ix_(rows, rows)],
            by_camera_error_mm=self.by_camera_error_mm[rows],
        )


@dataclass(frozen=True, eq=False)
class Drawing:
    """Lines (n, 2) px by camera and name, to draw on one frame; the contact is one point (2,)."""

    frame: int
    cameras: dict[str, dict[str, np.ndarray]]


@dataclass(frozen=True)
class ByOneCamera:
    """Contact from the shape that one camera shows, without gauges (`estimator.seen_shape`).

    It uses pictures of its own trial, so it is not compared with estimates from gauges.
    stiffness_low_N_mm: the object is at least as stiff, with 97.5 % probability.
    """

    camera: str
    touch_rad: Value = UNKNOWN
    d_x_mm: Value = UNKNOWN
    force_N: Value = UNKNOWN
    moved_mm: Value = UNKNOWN
    stiffness_N_mm: float = NAN
    stiffness_sigma_N_mm: float = NAN
    stiffness_low_N_mm: float = NAN
    status: str = ""


@dataclass(frozen=True)
class PicturedContact:
    """What the cameras show of a whisk whose truth is another source's: distance and slope."""

    d_x_mm: Value
    beta_rad: Value


@dataclass(frozen=True, eq=False)
class StageContact:
    """What a stage states of a whisk's contact, with every error that it may have.

    motor_rad: of the unbent whisker's first touch on the object where it is stated to stand; NaN where the distance
    alone is stated. by_offset (3, p): change of motor angle, d_x and slope with each of `stage_contact.Offsets`. own,
    shared (p,): one sigma of each, the trial's own and alike in all whisks. stands: whether it is a straight bar that
    neither moves nor gives way, so that moments show how far away it is.
    """

    motor_rad: float
    by_offset: np.ndarray
    own: np.ndarray
    shared: np.ndarray
    stands: bool


@dataclass(frozen=True, eq=False)
class SeenWhisk:
    """The truth of one whisk: as the cameras show it, or with distance and slopes of another source.

    truth: without what only a fit's own process needs (`bench.trials.seen.whisk_record`).
    status: the truth's, with warnings of the trial and of the recording. at: truth at the
    wanted pushing angle. overlay: lines by moment, "touch" and "theta". touch_shared_rad: part
    of touch's sigma that comes from felt touches of all whisks (`bench.trials.clocks`). looked:
    preset or settings file of the evaluation. contradicted: two records of the same quantity
    disagree (`bench.trials.consistency`). deflection: also of a whisk whose distance or slope is
    not known; None where no frame is seen to touch. by_one_camera: only where the settings name one.
    source: of d_x, β and ψ, BY_PICTURES or BY_STAGE. pictured: what pictures show of these where they
    are another source's. stage_contact: the contact that a stage states. friction_rad: the angle α
    by pictures alone (`bench.trials.seen_friction`); friction_by_camera_error_rad (k,): how it changes
    with each unit error of the session's cameras.
    """

    truth: WhiskTruth
    status: Reason = NO_REASON
    at: TruthAtAngle | None = None
    deflection: Deflection | None = None
    friction_rad: Value = UNKNOWN
    friction_by_camera_error_rad: np.ndarray = field(default_factory=lambda: np.zeros(0))
    overlay: dict[str, Drawing] = field(default_factory=dict)
    touch_shared_rad: float = 0.0
    looked: str = ""
    contradicted: bool = False
    by_one_camera: ByOneCamera | None = None
    source: str = BY_PICTURES
    pictured: PicturedContact | None = None
    stage_contact: StageContact | None = None

    @property
    def truth_source(self) -> str:
        """Return where the truth comes from; "" where there is none."""
        return self.source if self.has_truth else ""

    @property
    def whisk(self) -> int:
        """Return the number of the whisk in its trial."""
        return self.truth.whisk

    @property
    def touch_rad(self) -> Value:
        """Return the motor angle of first touch."""
        return self.truth.touch_rad

    @property
    def point_mm(self) -> Value:
        """Return the contact (3,) at first touch, in the rig frame."""
        return self.truth.point_mm

    @property
    def d_x_mm(self) -> Value:
        """Return the radial distance; NaN exactly where there is no truth."""
        return self.truth.d_x_mm

    @property
    def d_x_own_sigma_mm(self) -> float:
        """Return the part of d_x's sigma that is this whisk's own; NaN where it is not known."""
        own_variance = self.d_x_mm.sigma**2 - self.d_x_shared_sigma_mm**2
        return math.sqrt(max(own_variance, 0.0)) if math.isfinite(own_variance) else math.nan

    @property
    def d_x_shared_sigma_mm(self) -> float:
        """Return the part of d_x's sigma that all whisks share; NaN where it is not known."""
        shared = self.truth.shared
        return math.nan if shared is None else float(shared.d_x_mm)

    @property
    def beta_rad(self) -> Value:
        """Return the bar's slope across the whisker."""
        return self.truth.beta_rad

    @property
    def beta_by_camera_error_rad(self) -> np.ndarray:
        """Return how the slope changes (k,) with each unit error of the cameras; empty where no picture shows it."""
        shared = self.truth.shared
        return np.zeros(0) if shared is None else shared.beta_by_camera_error_rad

    @property
    def psi_rad(self) -> Value:
        """Return the bar's lean along the whisker."""
        return self.truth.psi_rad

    @property
    def frames(self) -> FrameTruth | None:
        """Return the truth frame by frame."""
        return self.truth.frames

    @property
    def has_truth(self) -> bool:
        """Return whether the whisk's distance is known."""
        return self.d_x_mm.is_known

    def with_contradiction(self, found: Reason) -> "SeenWhisk":
        """Return the whisk with what speaks against its truth in its status; as it is where nothing does."""
        if not found:
            return self
        return replace(self, status=joined(self.status, found), contradicted=True)


@dataclass(frozen=True)
class Clock:
    """Relation of the frames' times to the signals': source, one sigma, whether an edge was
    recorded.
    """

    source: str
    sigma_s: float
    recorded: bool


@dataclass(frozen=True, eq=False)
class BarLine:
    """Axis of the bar in the rig frame: point (3,) and direction (3,)."""

    point_mm: np.ndarray
    direction: np.ndarray

    def segment(self, near_mm: np.ndarray, half_mm: float, points: int = 2) -> np.ndarray:
        """Return points (n, 3) of the axis, up to half_mm on either side of its place nearest to
        a point (3,).
        """
        along_mm = (near_mm - self.point_mm) @ self.direction
        places_mm = along_mm + np.linspace(-half_mm, half_mm, points)
        return self.point_mm + places_mm[:, None] * self.direction


@dataclass(frozen=True, eq=False)
class BackStroke:
    """Touch as seen where the motor goes back, and the motor's speed, which is negative."""

    touch_rad: Value
    speed_rad_s: float


@dataclass(frozen=True, eq=False)
class SeenTrial:
    """The seen half of a trial; bar, radii and clock are missing where there are no pictures.

    notes: lines on frames that were dropped or corrected. damaged: which frames cannot be read,
    or were left out for their exposure. bar_looks: ratio of the
    bar's apparent to its stated diameter, by camera. one_sided_light: the width of the wire that is
    seen, by camera that sees light from one side. back: the first back stroke, where it was recorded
    and has a truth. ways_back: the way back of each whisk, run backwards, where the trial evaluates
    them. fits: of the whisks, kept where these are seen again by cameras that moved with the rig.
    """

    whisks: tuple[SeenWhisk, ...]
    notes: tuple[str, ...] = ()
    damaged: Reason = NO_REASON
    bar: BarLine | None = None
    bar_radius_mm: float = NAN
    wire_radius_mm: float = NAN
    clock: Clock | None = None
    bar_looks: dict[str, Value] = field(default_factory=dict)
    one_sided_light: dict[str, SeenWidth] = field(default_factory=dict)
    back: BackStroke | None = None
    ways_back: tuple[SeenWhisk, ...] = ()
    fits: tuple[KeptFit, ...] = field(default=(), metadata={"optional": True})


@dataclass(frozen=True)
class EstimateRow:
    """One estimator's result for a whisk; alpha_est_rad, beta_est_rad are NaN where it has none.

    d_x_est_sigma_alpha_exact_mm: the sigma as if alpha_est were exact. d_x_est_low_mm,
    d_x_est_high_mm: the 95 % interval. d_y_est_mm, d_z_est_mm, slip_est_mm: of the contact at the
    pushing angle. touch_covariance_mm_rad: of the distance with the angle of touch.
    """

    estimator: str
    d_x_est_mm: Value
    alpha_est_rad: float = NAN
    beta_est_rad: float = NAN
    status: Reason = NO_REASON
    d_x_est_sigma_alpha_exact_mm: float = NAN
    d_x_est_low_mm: float = NAN
    d_x_est_high_mm: float = NAN
    d_y_est_mm: Value = UNKNOWN
    d_z_est_mm: Value = UNKNOWN
    slip_est_mm: Value = UNKNOWN
    touch_covariance_mm_rad: float = NAN

    def error_mm(self, truth: Value) -> Value:
        """Return the estimate less a true distance, with the sigma of both together."""
        estimate = self.d_x_est_mm
        sigma = math.hypot(estimate.sigma, truth.sigma)
        return Value(estimate.value - float(truth.value), sigma)

    def error_percent(self, truth: Value) -> Value:
        """Return the error in per cent of the true distance."""
        error = self.error_mm(truth)
        true_mm = float(truth.value)
        return Value(100.0 * error.value / true_mm, 100.0 * error.sigma / true_mm)

    def holds(self, d_x_mm: float) -> bool | None:
        """Return whether the 95 % interval contains a distance; None where either is unknown."""
        low, high = self.d_x_est_low_mm, self.d_x_est_high_mm
        if not np.isfinite([low, high, d_x_mm]).all():
            return None
        return bool(low <= d_x_mm <= high)


@dataclass(frozen=True, eq=False)
class FeltAt:
    """Moments at one pushing angle and the estimates from them; for the fields see `FeltWhisk`.

    force_N (3,), force_covariance (3, 3): of the base on the whisker, in the hub's axes, with what its
    scale may differ from that of the moments; None without a load cell.
    """

    theta_rad: float
    m_y_Nmm: Value
    m_z_Nmm: Value
    theta_sigma_rad: float
    covariance_at: np.ndarray
    theta_moment_covariance_at: np.ndarray
    estimates: tuple[EstimateRow, ...] = ()
    force_N: np.ndarray | None = None
    force_covariance: np.ndarray | None = None


@dataclass(frozen=True)
class WithDrift:
    """Felt touch and d_x by (10) of signals whose drift over the whisk was not removed."""

    touch_felt_rad: float
    d_x_est_mm: float


@dataclass(frozen=True, eq=False)
class FeltWhisk:
    """One whisk as the gauges show it: touch, moments and slip angle at the wanted pushing angle.

    theta_sigma_rad: of the pushing angle, which the gauges' delay does not move as it does the
    touch. covariance_at (2, 2): of the moments. theta_moment_covariance_at (2,): of the pushing
    angle with the moments. shared_Nmm (k, 2): change of the moments at one sigma of each cause
    that all whisks have in common; by_camera_error_Nmm (k, 2): of it, with each unit error of the
    cameras that calibrated the gauges. agreement_chi2: of the moments less those of the seen shape,
    2 degrees of freedom. apart: they disagree, or the recording contradicts itself elsewhere, and
    nothing is concluded from the whisk. one_factor: estimates with one gauge factor a channel.
    by_theta: moments and estimates at other pushing angles, up to the stroke's end. delay_s: of
    the gauges' filter, removed from the touch. sensors: estimates by the other sensors of Table I,
    where a load cell was recorded. kinetic: the whisk on the kinetic cone, where the moments
    show that the contact sticks and slips. with_drift: None where no drift was removed.
    """

    whisk: int = 0
    touch_felt_rad: Value = UNKNOWN
    m_y_Nmm: Value = UNKNOWN
    m_z_Nmm: Value = UNKNOWN
    phi_felt_rad: Value = UNKNOWN
    theta_sigma_rad: float = NAN
    covariance_at: np.ndarray | None = None
    theta_moment_covariance_at: np.ndarray | None = None
    shared_Nmm: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    by_camera_error_Nmm: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    status: Reason = NO_REASON
    saturated: int = 0
    agreement_chi2: float = NAN
    apart: bool = False
    phases: Phases = NO_PHASES
    estimates: tuple[EstimateRow, ...] = ()
    one_factor: tuple[EstimateRow, ...] = ()
    by_theta: tuple[FeltAt, ...] = ()
    sensors: tuple[EstimateRow, ...] = ()
    kinetic: FeltAt | None = None
    with_drift: WithDrift | None = None
    delay_s: Value = UNKNOWN

    def estimate(self, estimator: str) -> EstimateRow | None:
        """Return the estimate by the estimator of this name; None where there is none."""
        return next((row for row in self.estimates if row.estimator == estimator), None)

    @property
    def has_moments(self) -> bool:
        """Return whether the moments are known."""
        return self.m_y_Nmm.is_known


@dataclass(frozen=True, eq=False)
class FeltTrial:
    """The felt half of a trial.

    back_touch_rad: felt touch of the first back stroke. ways_back: see `SeenTrial`.
    """

    whisks: tuple[FeltWhisk, ...]
    back_touch_rad: Value = UNKNOWN
    ways_back: tuple[FeltWhisk, ...] = ()


@dataclass(frozen=True, eq=False)
class TrialResult:
    """All of one trial.

    theta_deg: the wanted pushing angle. hash, seen_hash: of all inputs of the result, and of its
    seen half.
    """

    trial: TrialFacts
    whisker: WhiskerFacts
    theta_deg: float
    seen: SeenTrial
    felt: FeltTrial
    hash: str = ""
    seen_hash: str = ""

    @property
    def theta_rad(self) -> float:
        """Return the wanted pushing angle."""
        return math.radians(self.theta_deg)

    @property
    def radii_mm(self) -> tuple[float, float]:
        """Return the radii of the bar, NaN where it is not stated, and of the whisker's base."""
        return 0.5 * self.trial.bar_diameter_mm, 0.5 * self.whisker.diameter_mm

    def reach_mm(self, d_x_mm: float) -> float:
        """Return the radii of bar and whisker together at a distance; NaN where the bar's is not stated."""
        bar_mm, base_mm = self.radii_mm
        return bar_mm + base_mm * self.whisker.thickness(d_x_mm)


def whisks(results: Iterable[TrialResult]) -> Iterator[tuple[TrialResult, SeenWhisk, FeltWhisk]]:
    """Yield the trial's result and the seen and the felt half of every whisk."""
    for result in results:
        for seen, felt in zip(result.seen.whisks, result.felt.whisks):
            yield result, seen, felt
