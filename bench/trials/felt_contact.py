"""A contact as touch and moments show it where its slope is stated: by (6) no friction need be known."""

import math
from dataclasses import dataclass

import numpy as np

from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult
from bench.session.whisker import Whisker
from bench.trials.estimates import whisk_of
from estimator import distance, first_order
from estimator.beam import Beam
from estimator.uncertainty import gradient_known_slope, model_share
from estimator.whisk import Whisk
from vision import NAN

# Causes of which `FeltWhisk.shared_Nmm` has a row each.
_GAUGE_CAUSES = 6
# [rad] Friction that pulls along the whisker, which (6) leaves out: the paper's. Stated.
_FRICTION_RAD = math.radians(10.0)


@dataclass(frozen=True, eq=False)
class FeltContact:
    """Touch and distance as they are felt.

    values (2,): touch, rad, and the logarithm of d_x, NaN where unknown. own (2, 2): their covariance by this whisk
    alone. shared (2, k): change by one sigma of each error that all whisks share. by_slope: derivative of the
    logarithm by the stated slope, 1/rad.
    """

    values: np.ndarray
    own: np.ndarray
    shared: np.ndarray
    by_slope: float


def felt_contact(
    result: TrialResult, seen: SeenWhisk, felt: FeltWhisk, whisker: Whisker
) -> FeltContact:
    """Return a whisk's contact as it is felt.

    Without a distance where there are no moments, or nothing is concluded from them, or the object is no bar that stands.
    """
    late_rad = felt.delay_s.sigma * math.radians(result.trial.speed_deg_s or 0.0)
    late = np.array([[late_rad], [0.0]])  # of touch and distance
    is_straight_bar = seen.stage_contact.stands and not whisker.beam.is_curved
    if not is_straight_bar or not felt.has_moments or felt.apart:
        return _touch_alone(felt, late)
    whisk = whisk_of(felt, result.theta_rad, whisker.beam)
    found = _distance(result, whisk, seen.beta_rad.value)
    return _touch_alone(felt, late) if found is None else _contact(felt, whisk, found, late)


def _contact(
    felt: FeltWhisk, whisk: Whisk, found: "_DistanceBySlope", late: np.ndarray
) -> FeltContact:
    """Return a contact with its distance. late (2, 1): its change by one sigma of the gauges' delay."""
    by_input = np.array([[-1.0, 0.0, 0.0], found.by_input])  # of touch and distance
    by_cause = _inputs_by_cause(felt)
    own_inputs = whisk.felt_covariance - by_cause.T @ by_cause
    own = by_input @ own_inputs @ by_input.T
    own[1, 1] += found.model_share**2
    return FeltContact(
        values=np.array([felt.touch_felt_rad.value, math.log(found.d_x_mm)]),
        own=own,
        shared=np.hstack([late, by_input @ by_cause.T]),
        by_slope=found.by_slope,
    )


def _touch_alone(felt: FeltWhisk, late: np.ndarray) -> FeltContact:
    """Return a contact without a distance. late (2, 1): its change by one sigma of the gauges' delay."""
    return FeltContact(
        values=np.array([felt.touch_felt_rad.value, NAN]),
        own=np.diag([felt.theta_sigma_rad**2, 0.0]),
        shared=np.hstack([late, np.zeros((2, _GAUGE_CAUSES))]),
        by_slope=0.0,
    )


def _inputs_by_cause(felt: FeltWhisk) -> np.ndarray:
    """Return the changes (_GAUGE_CAUSES, 3) of θ, m_y and m_z by one sigma of each cause that all whisks share."""
    by_cause = np.zeros((_GAUGE_CAUSES, 3))
    by_cause[: len(felt.shared_Nmm), 1:] = felt.shared_Nmm
    return by_cause


@dataclass(frozen=True, eq=False)
class _DistanceBySlope:
    """A distance by (6), and the derivatives of its logarithm.

    by_input (3,): by θ, m_y and m_z. by_slope: by the slope, 1/rad.
    model_share: sigma of the logarithm by what (6) leaves out.
    """

    d_x_mm: float
    by_input: np.ndarray
    by_slope: float
    model_share: float


def _distance(result: TrialResult, whisk: Whisk, slope_rad: float) -> _DistanceBySlope | None:
    """Return the distance of a whisk by (6), less how far the contact rolls over the bar; None without one."""
    beam = whisk.beam
    as_cylinder_mm = distance.known_slope(*whisk.felt, slope_rad, beam.C_Nmm2)
    d_x_mm = beam.distance_mm(as_cylinder_mm)
    d_x_mm *= 1.0 - _rolled_share(result, d_x_mm, slope_rad, beam)
    if not math.isfinite(d_x_mm):
        return None
    thickness = beam.thickness(d_x_mm)
    of_cylinder = gradient_known_slope(*whisk.felt, slope_rad, beam.C_Nmm2)
    by_input = thickness / as_cylinder_mm * of_cylinder
    share = model_share(result.theta_rad, 0.0, _FRICTION_RAD, d_x_mm, thickness=thickness)
    return _DistanceBySlope(d_x_mm, by_input[:3], float(by_input[3]), share)


def _rolled_share(result: TrialResult, d_x_mm: float, slope_rad: float, beam: Beam) -> float:
    """Return how far the contact rolls over the bar, as a share of d_x; 0 of a bar of unknown radius."""
    reach_mm = result.reach_mm(d_x_mm)
    if not math.isfinite(reach_mm):
        return 0.0
    thickness = beam.thickness(d_x_mm)
    return first_order.rolling_at(result.theta_rad, reach_mm, slope_rad, d_x_mm, thickness)
