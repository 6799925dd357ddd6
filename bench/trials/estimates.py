"""Runs the estimators on what was felt of a whisk: pushing angle since felt touch, and the moments. Nothing seen."""

import importlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.gauges.drift import allow_drift
from bench.gauges.felt import Stroke
from bench.gauges.matrix import GaugeMatrix, to_follicle
from bench.records.trial import EstimateRow, FeltWhisk
from bench.session.trial import Trial
from estimator.beam import Beam
from estimator.builtin import ESTIMATORS
from estimator.distance import estimated_slope, felt_slip_angle
from estimator.signal import Touch
from estimator.whisk import Estimate, EstimatorSettings, Whisk
from vision.truth.value import Value

Estimator = Callable[[Whisk, EstimatorSettings], Estimate]


def estimators(names: tuple[str, ...]) -> dict[str, Estimator]:
    """The built-in ones and those named "module:function". Raises BadInput where one cannot be had."""
    return {**ESTIMATORS, **{name: _own(name) for name in names}}


def _own(name: str) -> Estimator:
    module, _, function = name.partition(":")
    try:
        found = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError, ValueError) as problem:
        raise BadInput(f"--estimator {name}: {problem}; give module:function, importable from here") from None
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
        return cls(gauges, math.radians(trial.follicle_roll_deg), math.radians(trial.follicle_roll_sigma_deg), True)

    @property
    def matrix(self) -> np.ndarray:
        """(2, 2): channels to (m_y, m_z) in the hub's axes."""
        return to_follicle(self.roll_rad).T @ self.gauges.matrix

    def in_follicle(self, whisk: Whisk) -> np.ndarray:
        """The whisk's moments (2,) at the wanted angle, in the axes of the gauges."""
        return to_follicle(self.roll_rad) @ [whisk.m_y_at_Nmm, whisk.m_z_at_Nmm]

    def covariance(self, channels: np.ndarray, of_channels: np.ndarray) -> np.ndarray:
        """Covariance (2, 2) of the moments of `channels` (2,): from the channels', the gauges' and the turn's."""
        back = to_follicle(self.roll_rad).T
        by_roll = to_follicle(self.roll_rad + np.pi / 2).T @ self.gauges.matrix @ channels * self.roll_sigma_rad
        of_gauges = back @ self.gauges.covariance_at(channels) @ back.T
        return self.matrix @ of_channels @ self.matrix.T + of_gauges + np.outer(by_roll, by_roll)


def felt_whisk(
    stroke: Stroke, readout: Readout, drift_rate: np.ndarray, beam: Beam, theta_rad: float
) -> tuple[Touch, Whisk | str]:
    """Felt touch, and all that an estimator may know; the reason instead where the stroke does not hold it."""
    touch = allow_drift(stroke.touch(), drift_rate, stroke.speed_rad_s)
    if touch.status:
        return touch, touch.status
    at = stroke.at(theta_rad, touch)
    if at.status:
        return touch, at.status
    moments = (stroke.filtered - touch.offset) @ readout.matrix.T
    m_y, m_z = readout.matrix @ at.values
    return touch, Whisk(
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


def as_felt(number: int, touch: Touch, whisk: Whisk | None) -> FeltWhisk:
    """Felt touch, moments and slip angle of a whisk, rad and N·mm; without moments where there is no `whisk`."""
    felt = FeltWhisk(number, Value(touch.motor_rad, touch.sigma_rad))
    if whisk is None:
        return felt
    sigma_y, sigma_z = np.sqrt(np.diag(whisk.covariance_at)).tolist()
    return replace(
        felt,
        m_y_Nmm=Value(whisk.m_y_at_Nmm, sigma_y),
        m_z_Nmm=Value(whisk.m_z_at_Nmm, sigma_z),
        phi_felt_rad=_slip_angle(whisk),
        covariance_at=whisk.covariance_at,
        theta_moment_covariance_at=whisk.theta_moment_covariance_at,
    )


def _slip_angle(whisk: Whisk) -> Value:
    """φ, equation (8), and its sigma."""
    m_y, m_z = whisk.m_y_at_Nmm, whisk.m_z_at_Nmm
    gradient = np.array([m_z, -m_y]) / (m_y**2 + m_z**2)
    return Value(felt_slip_angle(m_y, m_z), math.sqrt(max(gradient @ whisk.covariance_at @ gradient, 0.0)))


def answers(whisk: Whisk, asked: Mapping[str, Estimator], settings: Settings) -> tuple[EstimateRow, ...]:
    """What each estimator says, as rows of estimates.csv without truth."""
    return tuple(_answer(name, estimator, whisk, settings) for name, estimator in asked.items())


def _answer(name: str, estimator: Estimator, whisk: Whisk, settings: Settings) -> EstimateRow:
    try:
        estimate = estimator(whisk, EstimatorSettings(settings.alpha_est_rad))
    except Exception as fault:  # someone's own code: a whisk on which it fails has no estimate, the others do
        estimate = Estimate(math.nan, math.nan, f"{name} raised {type(fault).__name__}: {fault}")
    if not isinstance(estimate, Estimate):
        raise BadInput(f"--estimator {name} returned {type(estimate).__name__}; it must return an Estimate")
    alpha_rad = {"no_slip": math.nan, "frictionless": 0.0}.get(name, settings.alpha_est_rad)
    has_slope = math.isfinite(alpha_rad)
    slope = float(estimated_slope(whisk.m_y_at_Nmm, whisk.m_z_at_Nmm, alpha_rad)) if has_slope else math.nan
    return EstimateRow(name, Value(estimate.d_x_mm, estimate.sigma_mm), alpha_rad, slope, estimate.status)
