"""The result of one trial: what is seen, felt and estimated in each whisk. Missing is NaN, or None with a status."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from bench.records.phases import NO_PHASES, Phases
from bench.records.plain import WHERE_THERE
from vision.fit.beam_check import BeamCheck
from vision.fit.line_noise import LineNoise
from vision.fit.refinements import LeftOut
from vision.fit.turns import Turns
from vision.geometry.base_lines import BaseLines
from vision.geometry.reasons import NO_REASON, Reason
from vision.truth.at_angle import TruthAtAngle
from vision.truth.records import FrameTruth, GaveWay, SeenObject, WireShape
from vision.truth.value import NAN, UNKNOWN, UNKNOWN_POINT, Value


@dataclass(frozen=True)
class TrialFacts:
    """The trial as the manifest states it."""

    name: str
    purpose: str
    surface: str
    speed_deg_s: float | None
    d_x_nominal_mm: float = NAN
    beta_nominal_deg: float = NAN
    bar_diameter_mm: float = NAN

    @property
    def panel(self) -> tuple[str, float | None]:
        """Return surface and speed: whisks that are alike in both belong together."""
        return self.surface, self.speed_deg_s


@dataclass(frozen=True)
class WhiskerFacts:
    """The whisker, which must be alike in results that are pooled."""

    shape: str
    length_mm: float
    diameter_mm: float
    EI_Nmm2: float
    tip_diameter_mm: float | None = None

    def left(self, x_mm: float) -> float:
        """Return the share of the base's diameter that is left at a distance from the base."""
        tip_mm = {"cylinder": self.diameter_mm, "cone": 0.0}.get(self.shape, self.tip_diameter_mm)
        return 1.0 - (1.0 - tip_mm / self.diameter_mm) * x_mm / self.length_mm


@dataclass(frozen=True, eq=False)
class Deflection:
    """The contact in the hub's axes while touching, from the unbent whisker: (f,) each.

    covariance: joint one (2f, 2f) of across z, y frame by frame. slip_mm: along the bar; past_mm:
    how far the whisker's material has moved along itself past the bar, from any zero (rolling is no
    such motion).
    """

    theta_rad: np.ndarray
    motor_rad: np.ndarray
    slip_mm: np.ndarray
    along_mm: np.ndarray
    across_y_mm: np.ndarray
    across_z_mm: np.ndarray
    past_mm: np.ndarray
    covariance: np.ndarray


@dataclass(frozen=True, eq=False)
class Drawing:
    """Lines (n, 2) by name, px, to draw on one frame of each camera; the contact is one point (2,)."""

    frame: int
    cameras: dict[str, dict[str, np.ndarray]]


@dataclass(frozen=True)
class ByOneCamera:
    """Results from the shape seen by one camera, without gauges (`estimator.seen_shape`).

    They rest on their own trial's pictures: no estimate to be compared beside the gauges'.
    stiffness_low_N_mm: no less than that, by 97.5 %.
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


@dataclass(frozen=True, eq=False)
class SeenWhisk:
    """One whisk as the cameras see it.

    d_x_mm is NaN exactly where there is no truth, and `status` says why. The fields are those of
    `vision.truth.records.WhiskTruth`; at: truth at the wanted pushing angle; overlay: by moment,
    "touch" and "theta". touch_shared_rad: the part of touch's sigma that felt touches of all whisks
    add to it (`bench.trials.clocks`). looked: preset or settings file by which the pictures were
    evaluated. contradicted: two sources of the recording do not agree (`bench.trials.consistency`).
    by_one_camera: where the settings want that.
    """

    whisk: int
    status: Reason = NO_REASON
    cameras: int = 0
    frames_used: int = 0
    touch_rad: Value = UNKNOWN
    point_mm: Value = UNKNOWN_POINT
    d_x_mm: Value = UNKNOWN
    beta_rad: Value = UNKNOWN
    psi_rad: Value = UNKNOWN
    budget: dict[str, float] = field(default_factory=dict)
    base: BaseLines | None = None
    beam: BeamCheck | None = None
    turns: Turns | None = None
    refinements: dict[str, LeftOut] = field(default_factory=dict)
    lines: dict[str, LineNoise] = field(default_factory=dict)
    point_covariance_mm2: np.ndarray | None = None
    shape: WireShape | None = None
    velocity_mm_s: Value | None = None
    gave: GaveWay | None = field(default=None, metadata=WHERE_THERE)
    rounded: SeenObject | None = field(default=None, metadata=WHERE_THERE)
    frames: FrameTruth | None = None
    at: TruthAtAngle | None = None
    deflection: Deflection | None = None
    overlay: dict[str, Drawing] = field(default_factory=dict)
    touch_shared_rad: float = 0.0
    looked: str = ""
    contradicted: bool = False
    by_one_camera: ByOneCamera | None = None

    @property
    def has_truth(self) -> bool:
        """Return whether the whisk's distance is known."""
        return bool(np.isfinite(self.d_x_mm.value))


@dataclass(frozen=True)
class Clock:
    """The tie of the frames to the signals: source, one sigma, and whether by a recorded edge."""

    source: str
    sigma_s: float
    recorded: bool


@dataclass(frozen=True, eq=False)
class BarLine:
    """The bar's axis in the rig frame: point (3,) and direction (3,)."""

    point_mm: np.ndarray
    direction: np.ndarray


@dataclass(frozen=True, eq=False)
class BackStroke:
    """Seen touch where the motor goes back, and the motor's speed, which is negative."""

    touch_rad: Value
    speed_rad_s: float


@dataclass(frozen=True, eq=False)
class SeenTrial:
    """The seen half of a trial; bar, radii and clock are missing where there are no pictures.

    bar_looks: the bar's apparent over its stated diameter, by camera. back: the first back stroke,
    where it was recorded and has a truth. ways_back: the way back of each whisk, run backwards,
    where the settings want them.
    """

    whisks: tuple[SeenWhisk, ...]
    notes: tuple[str, ...] = ()
    bar: BarLine | None = None
    bar_radius_mm: float = NAN
    wire_radius_mm: float = NAN
    clock: Clock | None = None
    bar_looks: dict[str, Value] = field(default_factory=dict)
    back: BackStroke | None = None
    ways_back: tuple[SeenWhisk, ...] = ()


@dataclass(frozen=True)
class EstimateRow:
    """One estimator's result on a whisk; alpha_est_rad, beta_est_rad are NaN where it has none.

    d_x_est_sigma_alpha_exact_mm: the sigma as if alpha_est were right; d_x_est_low_mm,
    d_x_est_high_mm: the 95 % interval. d_y_est_mm, d_z_est_mm, slip_est_mm: of the contact at the
    pushing angle; touch_covariance_mm_rad: of the distance with the angle of touch, NaN where
    unknown.
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

    def holds(self, d_x_mm: float) -> bool | None:
        """Return whether the 95 % interval holds a distance; None where either is not known."""
        if not np.isfinite([self.d_x_est_low_mm, self.d_x_est_high_mm, d_x_mm]).all():
            return None
        return bool(self.d_x_est_low_mm <= d_x_mm <= self.d_x_est_high_mm)


@dataclass(frozen=True, eq=False)
class FeltAt:
    """Felt moments at one pushing angle, and estimates from them; the fields are `FeltWhisk`'s."""

    theta_rad: float
    m_y_Nmm: Value
    m_z_Nmm: Value
    theta_sigma_rad: float
    covariance_at: np.ndarray
    theta_moment_covariance_at: np.ndarray
    estimates: tuple[EstimateRow, ...] = ()


@dataclass(frozen=True)
class WithDrift:
    """Felt touch and d_x by (10) without correction for drift from before touch to after the way back."""

    touch_felt_rad: float
    d_x_est_mm: float


@dataclass(frozen=True, eq=False)
class FeltWhisk:
    """One whisk as the gauges feel it: touch, moments and slip angle at the wanted pushing angle.

    theta_sigma_rad: of the pushing angle, which the gauges' delay does not move as it does the
    touch; covariance_at (2, 2): of the moments; theta_moment_covariance_at (2,): with the pushing
    angle; shared_Nmm (k, 2): changes of the moments at one sigma of each cause that all whisks have
    in common. agreement_chi2: of the moments with those of the seen shape, 2 degrees of freedom;
    apart: they are not those, or the recording contradicts itself elsewhere, and nothing is
    concluded from the whisk. one_factor: estimates with one factor a channel. by_theta: moments and
    estimates at other pushing angles, up to the stroke's end. delay_s: of the gauges' filter, taken
    out of the touch. sensors: estimates of the other sensors of Table I, where a load cell was
    recorded. kinetic: as on the kinetic cone, where by the moments alone the contact sticks and
    slips. with_drift: None where no drift was taken out.
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

    @property
    def has_moments(self) -> bool:
        """Return whether the moments are known."""
        return bool(np.isfinite(self.m_y_Nmm.value))


@dataclass(frozen=True, eq=False)
class FeltTrial:
    """The felt half of a trial. back_touch_rad: felt touch of the first back stroke. ways_back: see `SeenTrial`."""

    whisks: tuple[FeltWhisk, ...]
    back_touch_rad: Value = UNKNOWN
    ways_back: tuple[FeltWhisk, ...] = ()


@dataclass(frozen=True, eq=False)
class TrialResult:
    """The whole result of one trial.

    theta_deg: the wanted pushing angle. hash, seen_hash: of what the result, and its seen half,
    were made from.
    """

    trial: TrialFacts
    whisker: WhiskerFacts
    theta_deg: float
    seen: SeenTrial
    felt: FeltTrial
    hash: str = ""
    seen_hash: str = ""


def whisks(results: Iterable[TrialResult]) -> Iterator[tuple[TrialResult, SeenWhisk, FeltWhisk]]:
    """Yield (result, seen, felt) of every whisk."""
    for result in results:
        for seen, felt in zip(result.seen.whisks, result.felt.whisks):
            yield result, seen, felt
