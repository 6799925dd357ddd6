"""Runs the estimators on what was felt of a whisk: pushing angle since felt touch, and the moments. Nothing seen."""

import importlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from bench.base.errors import BadInput
from bench.base.settings import OBJECT_REACH_MM, TILT_SIGMA_RAD, Settings
from bench.base.statuses import reason
from bench.gauges.drift import allow_drift
from bench.gauges.felt import FeltStroke, late_by
from bench.gauges.matrix import GaugeMatrix, to_follicle
from bench.records.trial_result import EstimateRow, FeltAt, FeltWhisk
from bench.session.trial import Trial
from estimator.beam import Beam
from estimator.builtin import ESTIMATORS, WITHOUT_ALPHA
from estimator.contact_state import Contact, contact_of
from estimator.distance import felt_slip_angle
from estimator.signal import FeltTouch
from estimator.uncertainty import Z_95
from estimator.whisk import Estimate, EstimatorSettings, Whisk
from vision.geometry.reasons import Reason, as_reason, joined
from vision.truth.value import Value

UNTOLD = (math.nan, 0.0)  # radii of bar and whisker where nobody says
# Pushing angles at which a run says how error and sigma go with θ: steps of a half and less, where errors bend.
THETAS_DEG = (
    0.2,
    0.3,
    0.5,
    0.7,
    1.0,
    1.5,
    2.0,
    2.5,
    3.0,
    3.5,
    4.0,
    5.0,
    6.0,
    8.0,
    10.0,
    12.0,
    15.0,
    20.0,
)

Estimator = Callable[[Whisk, EstimatorSettings], Estimate]


def estimators(names: tuple[str, ...]) -> dict[str, Estimator]:
    """The built-in ones and those named "module:function". Raises BadInput where one cannot be had."""
    return {**ESTIMATORS, **{name: _own(name) for name in names}}


def _own(name: str) -> Estimator:
    module, _, function = name.partition(":")
    try:
        found = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError, ValueError) as problem:
        raise BadInput(
            f"--estimator {name}: {problem}; give module:function, importable from here"
        ) from None
    if not callable(found):
        raise BadInput(f"--estimator {name}: is a {type(found).__name__}; give a function")
    return found


@dataclass(frozen=True)
class Readout:
    """How a trial's channels become moments in the hub's axes: the follicle's turn with its sigma, and the gauges.

    Moments that were recorded as such need neither (`Readout.bare`).
    """

    gauges: GaugeMatrix
    roll_rad: float = 0.0
    roll_sigma_rad: float = 0.0
    is_gauged: bool = False

    @classmethod
    def bare(cls) -> "Readout":
        """For signals that are moments already."""
        return cls(GaugeMatrix(np.eye(2)))

    @classmethod
    def of(cls, trial: Trial, gauges: GaugeMatrix) -> "Readout":
        """The trial's follicle with these gauges."""
        return cls(
            gauges,
            math.radians(trial.follicle_roll_deg),
            math.radians(trial.follicle_roll_sigma_deg),
            True,
        )

    @property
    def matrix(self) -> np.ndarray:
        """(2, 2): channels to (m_y, m_z) in the hub's axes."""
        return to_follicle(self.roll_rad).T @ self.gauges.matrix

    def in_follicle(self, whisk: Whisk) -> np.ndarray:
        """The whisk's moments (2,) at the wanted angle, in the axes of the gauges."""
        return to_follicle(self.roll_rad) @ [whisk.m_y_at_Nmm, whisk.m_z_at_Nmm]

    def moments_Nmm(self, stroke: FeltStroke, touch: FeltTouch) -> np.ndarray:
        """(n, 2): of the stroke's samples as recorded, unfiltered."""
        return (stroke.channels - touch.offset) @ self.matrix.T

    def covariance(self, channels: np.ndarray, of_channels: np.ndarray) -> np.ndarray:
        """Covariance (2, 2) of the moments of `channels` (2,): from the channels', the gauges' and the turn's."""
        shared = self._shared(channels)
        return self.matrix @ of_channels @ self.matrix.T + shared.T @ shared

    def shared_Nmm(self, whisk: Whisk) -> np.ndarray:
        """(5, 2): what a whisk's moments at the wanted angle change by at one sigma of each cause that all whisks of a
        session have in common: four of the gauges, and the follicle's turn."""
        return self._shared(np.linalg.solve(self.matrix, [whisk.m_y_at_Nmm, whisk.m_z_at_Nmm]))

    def _shared(self, channels: np.ndarray) -> np.ndarray:
        by_roll = (
            to_follicle(self.roll_rad + np.pi / 2).T
            @ self.gauges.matrix
            @ channels
            * self.roll_sigma_rad
        )
        return np.vstack([self.gauges.changes_at(channels) @ to_follicle(self.roll_rad), by_roll])


def felt_whisk(
    stroke: FeltStroke, readout: Readout, drift_rate: np.ndarray, beam: Beam, theta_rad: float
) -> tuple[FeltTouch, Whisk | Reason]:
    """Felt touch, and all that an estimator may know; the reason instead where the stroke does not hold it."""
    touch = allow_drift(stroke.touch(), drift_rate, stroke.speed_rad_s)
    return touch, as_reason(touch.status) or whisk_at(stroke, readout, touch, beam, theta_rad)


def whisk_at(
    stroke: FeltStroke, readout: Readout, touch: FeltTouch, beam: Beam, theta_rad: float
) -> Whisk | Reason:
    """`felt_whisk` of a touch that is known."""
    at = stroke.at(theta_rad, touch)
    if at.status:
        return as_reason(at.status)
    moments = (stroke.filtered - touch.offset) @ readout.matrix.T
    m_y, m_z = readout.matrix @ at.values
    return Whisk(
        stroke.time_s,
        stroke.motor_rad - touch.motor_rad,
        moments[:, 0],
        moments[:, 1],
        theta_rad,
        float(m_y),
        float(m_z),
        readout.covariance(at.values, at.covariance),
        touch.sigma_rad,
        beam,
        readout.matrix @ at.theta_covariance,
    )


def as_felt(
    number: int, touch: FeltTouch, whisk: Whisk | None, speed_rad_s: float, delay_s: Value
) -> FeltWhisk:
    """Felt touch, moments and slip angle of a whisk, rad and N·mm; without moments where there is no `whisk`.

    The gauges' own filter makes all that is felt late by `delay_s`. That is taken out of the touch, and is in its
    sigma; θ has neither, since touch and moments are late alike.
    """
    late = late_by(delay_s, speed_rad_s)
    on_time = Value(touch.motor_rad - late.value, math.hypot(touch.sigma_rad, late.sigma))
    felt = FeltWhisk(number, on_time, theta_sigma_rad=touch.sigma_rad, delay_s=delay_s)
    if whisk is None:
        return felt
    m_y, m_z = _moments(whisk)
    return replace(
        felt,
        m_y_Nmm=m_y,
        m_z_Nmm=m_z,
        phi_felt_rad=_slip_angle(whisk),
        covariance_at=whisk.covariance_at,
        theta_moment_covariance_at=whisk.theta_moment_covariance_at,
    )


def _moments(whisk: Whisk) -> tuple[Value, Value]:
    """m_y and m_z at the wanted angle, with their sigmas."""
    sigma_y, sigma_z = np.sqrt(np.diag(whisk.covariance_at)).tolist()
    return Value(whisk.m_y_at_Nmm, sigma_y), Value(whisk.m_z_at_Nmm, sigma_z)


def felt_by_theta(
    stroke: FeltStroke,
    readout: Readout,
    touch: FeltTouch,
    beam: Beam,
    answered: Callable[[Whisk], tuple[EstimateRow, ...]],
) -> tuple[FeltAt, ...]:
    """Moments and what estimators answer at THETAS_DEG, as far as the stroke goes."""
    reached = (
        whisk_at(stroke, readout, touch, beam, theta) for theta in np.radians(THETAS_DEG).tolist()
    )
    return tuple(felt_at(whisk, answered(whisk)) for whisk in reached if isinstance(whisk, Whisk))


def felt_at(whisk: Whisk, estimates: tuple[EstimateRow, ...] = ()) -> FeltAt:
    """The record of a whisk at its pushing angle."""
    covariances = whisk.theta_sigma_rad, whisk.covariance_at, whisk.theta_moment_covariance_at
    return FeltAt(whisk.theta_at_rad, *_moments(whisk), *covariances, estimates)


def whisk_of(felt: FeltWhisk | FeltAt, theta_rad: float, beam: Beam) -> Whisk:
    """The whisk at the wanted angle: all that (10) looks at."""
    no_samples = (np.zeros(0),) * 4
    moments = felt.m_y_Nmm.value, felt.m_z_Nmm.value
    covariances = felt.covariance_at, felt.theta_sigma_rad, beam, felt.theta_moment_covariance_at
    return Whisk(*no_samples, theta_rad, *moments, *covariances)


def _slip_angle(whisk: Whisk) -> Value:
    """φ, equation (8), and its sigma."""
    m_y, m_z = whisk.m_y_at_Nmm, whisk.m_z_at_Nmm
    gradient = np.array([m_z, -m_y]) / (m_y**2 + m_z**2)
    return Value(
        felt_slip_angle(m_y, m_z), math.sqrt(max(gradient @ whisk.covariance_at @ gradient, 0.0))
    )


def answers(
    whisk: Whisk,
    asked: Mapping[str, Estimator],
    settings: Settings,
    radii_mm: tuple[float, float] = UNTOLD,
) -> tuple[EstimateRow, ...]:
    """What each estimator says, as rows of estimates.csv without truth. radii_mm: see `answer`."""
    alpha = settings.alpha_est_rad, float(np.radians(settings.first_alpha_est_sigma_deg))
    return tuple(
        answer(name, estimator, whisk, *alpha, radii_mm) for name, estimator in asked.items()
    )


def answer(
    name: str,
    estimator: Estimator,
    whisk: Whisk,
    alpha_est_rad: float,
    sigma_rad: float,
    radii_mm: tuple[float, float] = UNTOLD,
    exact_sigma_mm: float | None = None,
) -> EstimateRow:
    """What one estimator says under a friction angle with its sigma; its own sigma as if that angle were right, too.

    radii_mm: of the bar, NaN where nobody says, and of the whisker's base. exact_sigma_mm: the latter sigma, where it
    is known from before.
    """
    reach_mm = OBJECT_REACH_MM if math.isnan(radii_mm[0]) else sum(radii_mm)
    told = EstimatorSettings(alpha_est_rad, float(sigma_rad), reach_mm, TILT_SIGMA_RAD, *radii_mm)
    doubted = _asked(name, estimator, whisk, told)
    if estimator in WITHOUT_ALPHA:
        exact_sigma_mm = doubted.sigma_mm
    elif exact_sigma_mm is None:
        exact_sigma_mm = _asked(
            name, estimator, whisk, replace(told, alpha_est_sigma_rad=0.0)
        ).sigma_mm
    ends = (doubted.low_mm, doubted.high_mm)
    if math.isnan(doubted.low_mm) and math.isnan(doubted.high_mm):
        ends = (doubted.d_x_mm - Z_95 * doubted.sigma_mm, doubted.d_x_mm + Z_95 * doubted.sigma_mm)
    d_x = Value(doubted.d_x_mm, doubted.sigma_mm)
    angles = doubted.alpha_est_rad, float(doubted.beta_rad)
    row = EstimateRow(name, d_x, *angles, doubted.status, exact_sigma_mm, *map(float, ends))
    return _with_contact(
        row, contact_of(whisk, doubted, told.alpha_est_sigma_rad if angles[0] else 0.0)
    )


def _with_contact(row: EstimateRow, contact: Contact) -> EstimateRow:
    return replace(
        row,
        d_y_est_mm=Value(contact.d_y_mm, contact.d_y_sigma_mm),
        d_z_est_mm=Value(contact.d_z_mm, contact.d_z_sigma_mm),
        slip_est_mm=Value(contact.slip_mm, contact.slip_sigma_mm),
        touch_covariance_mm_rad=contact.touch_covariance_mm_rad,
    )


def _asked(name: str, estimator: Estimator, whisk: Whisk, told: EstimatorSettings) -> Estimate:
    try:
        estimate = estimator(whisk, told)
    except (
        Exception
    ) as fault:  # someone's own code: a whisk on which it fails has no estimate, the others do
        raised = f"{type(fault).__name__}: {fault}"
        return Estimate(math.nan, math.nan, reason("estimator_raised", name=name, fault=raised))
    if not isinstance(estimate, Estimate):
        raise BadInput(
            f"--estimator {name} returned {type(estimate).__name__}; it must return an Estimate"
        )
    return held_to_its_word(estimate, whisk.beam.length_mm)


def held_to_its_word(estimate: Estimate, length_mm: float) -> Estimate:
    """Return the estimate with NaN for a distance or a sigma that is none, and a status on each."""
    d_x, sigma = _float(estimate.d_x_mm), _float(estimate.sigma_mm)
    status = as_reason(estimate.status)
    if not (np.isfinite(d_x) and d_x > 0):
        if math.isnan(d_x):
            why_none = reason("no_distance_given")
        else:
            why_none = reason("distance_impossible", d_x_mm=d_x)
        return replace(estimate, d_x_mm=math.nan, sigma_mm=math.nan, status=status or why_none)
    warnings = []
    if not (np.isfinite(sigma) and sigma > 0):
        warnings.append(reason("sigma_impossible", sigma_mm=sigma))
        sigma = math.nan
    if d_x > length_mm and not status:
        warnings.append(reason("past_whisker", d_x_mm=d_x, length_mm=length_mm))
    if estimate.deflection_mm is not None and not _is_measured(
        estimate.deflection_mm, estimate.deflection_sigma_mm
    ):
        given = f"{estimate.deflection_mm} ± {estimate.deflection_sigma_mm} mm"
        warnings.append(reason("deflection_impossible", given=given))
        estimate = replace(estimate, deflection_mm=None, deflection_sigma_mm=None)
    return replace(estimate, d_x_mm=d_x, sigma_mm=sigma, status=joined(status, *warnings))


def _is_measured(pair, sigmas) -> bool:
    """Are these two finite numbers with two sigmas above 0?"""
    try:
        values, widths = np.asarray(pair, dtype=float), np.asarray(sigmas, dtype=float)
    except (TypeError, ValueError):
        return False
    return values.shape == widths.shape == (2,) and bool(
        np.isfinite([values, widths]).all() and (widths > 0).all()
    )


def _float(value) -> float:
    """A number as it was given, however it was wrapped; NaN for anything else."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan
