"""Estimates of a felt whisk: from pushing angle since felt touch and the moments, nothing seen."""

import importlib
import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from bench.base.errors import BadInput
from bench.base.settings import OBJECT_REACH_MM, TILT_SIGMA_RAD, Settings
from bench.base.statuses import reason
from bench.gauges.felt import late_by
from bench.records.trial_result import EstimateRow, FeltAt, FeltWhisk
from estimator.beam import Beam
from estimator.builtin import WITHOUT_ALPHA, estimators_of
from estimator.contact_state import Contact, contact_of
from estimator.signal import FeltTouch
from estimator.uncertainty import Z_95, slip_angle_sigma
from estimator.whisk import Estimate, EstimatorSettings, Whisk
from vision import Value
from vision.geometry import NO_REASON, Reason, as_reason, joined

UNKNOWN_RADII_MM = (math.nan, 0.0)  # of bar and whisker

Estimator = Callable[[Whisk, EstimatorSettings], Estimate]


def estimators(names: tuple[str, ...], beam: Beam) -> dict[str, Estimator]:
    """Return the built-in estimators of a whisker and those named "module:function".

    Raises BadInput where one of the latter cannot be imported.
    """
    return {**estimators_of(beam), **own_estimators(names)}


def own_estimators(names: tuple[str, ...]) -> dict[str, Estimator]:
    """Return the estimators named "module:function". Raises BadInput where one cannot be imported."""
    return {name: _imported(name) for name in names}


def _imported(name: str) -> Estimator:
    """Import an estimator by "module:function". Raise BadInput where that is no function."""
    module, _, function = name.partition(":")
    if not function:
        raise BadInput(f"--estimator {name}: names no function; give module:function")
    try:
        found = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError, ValueError) as problem:
        cure = "give module:function, importable from here"
        raise BadInput(f"--estimator {name}: {problem}; {cure}") from None
    if not callable(found):
        raise BadInput(f"--estimator {name}: is a {type(found).__name__}; give a function")
    return found


def as_felt(
    number: int, touch: FeltTouch, whisk: Whisk | None, speed_rad_s: float, delay_s: Value
) -> FeltWhisk:
    """Return the record of a felt whisk; without moments where there is no `whisk`.

    The gauges' own filter delays all that is felt by `delay_s`. The delay is removed from the
    touch, whose sigma includes it; θ is free of it, since touch and moments are late alike.
    """
    late = late_by(delay_s, speed_rad_s)
    sigma_rad = math.hypot(touch.sigma_rad, late.sigma)
    felt = FeltWhisk(
        number,
        Value(touch.motor_rad - late.value, sigma_rad),
        theta_sigma_rad=touch.sigma_rad,
        delay_s=delay_s,
    )
    if whisk is None:
        return felt
    m_y, m_z = _moments(whisk)
    phi_rad = whisk.phi_rad
    return replace(
        felt,
        theta_sigma_rad=whisk.theta_sigma_rad,
        m_y_Nmm=m_y,
        m_z_Nmm=m_z,
        phi_felt_rad=Value(phi_rad, slip_angle_sigma(m_y.value, m_z.value, whisk.covariance_at)),
        covariance_at=whisk.covariance_at,
        theta_moment_covariance_at=whisk.theta_moment_covariance_at,
    )


def _moments(whisk: Whisk) -> tuple[Value, Value]:
    """Return m_y and m_z at the wanted angle, with their sigmas."""
    sigma_y, sigma_z = np.sqrt(np.diag(whisk.covariance_at)).tolist()
    return Value(whisk.m_y_at_Nmm, sigma_y), Value(whisk.m_z_at_Nmm, sigma_z)


def felt_at(whisk: Whisk, estimates: tuple[EstimateRow, ...] = ()) -> FeltAt:
    """Return the record of a whisk at its pushing angle, with the force where that was recorded."""
    m_y, m_z = _moments(whisk)
    felt = FeltAt(
        whisk.theta_at_rad,
        m_y,
        m_z,
        whisk.theta_sigma_rad,
        whisk.covariance_at,
        whisk.theta_moment_covariance_at,
        estimates,
    )
    if whisk.others is None:
        return felt
    force_N = whisk.others.force_N
    by_scale = whisk.others.scale_sigma * force_N
    covariance = whisk.others.force_covariance + np.outer(by_scale, by_scale)
    return replace(felt, force_N=force_N, force_covariance=covariance)


def whisk_of(felt: FeltWhisk | FeltAt, theta_rad: float, beam: Beam) -> Whisk:
    """Return the whisk of a record at its pushing angle, without samples: all that (10) needs."""
    return Whisk.without_samples(
        theta_rad,
        (felt.m_y_Nmm.value, felt.m_z_Nmm.value),
        felt.covariance_at,
        beam,
        theta_sigma_rad=felt.theta_sigma_rad,
        theta_moment_covariance_at=felt.theta_moment_covariance_at,
    )


def run_estimators(
    whisk: Whisk,
    by_name: Mapping[str, Estimator],
    settings: Settings,
    radii_mm: tuple[float, float] = UNKNOWN_RADII_MM,
) -> tuple[EstimateRow, ...]:
    """Run estimators on a whisk; return the row of each, by name."""
    alpha_sigma_rad = math.radians(settings.first_alpha_est_sigma_deg)
    rows = []
    for name, estimator in by_name.items():
        rows.append(
            run_estimator(name, estimator, whisk, settings.alpha_est_rad, alpha_sigma_rad, radii_mm)
        )
    return tuple(rows)


def assumed_settings(
    alpha_est_rad: float, sigma_rad: float, radii_mm: tuple[float, float] = UNKNOWN_RADII_MM
) -> EstimatorSettings:
    """Return what estimators assume of friction and object. radii_mm: as `run_estimator` has them."""
    reach_mm = OBJECT_REACH_MM if math.isnan(radii_mm[0]) else sum(radii_mm)
    return EstimatorSettings(alpha_est_rad, float(sigma_rad), reach_mm, TILT_SIGMA_RAD, *radii_mm)


def run_estimator(
    name: str,
    estimator: Estimator,
    whisk: Whisk,
    alpha_est_rad: float,
    sigma_rad: float,
    radii_mm: tuple[float, float] = UNKNOWN_RADII_MM,
    exact_sigma_mm: float | None = None,
) -> EstimateRow:
    """Run one estimator under a friction angle and its sigma; return its row.

    radii_mm: of the bar, NaN where it is unknown, and of the whisker's base. exact_sigma_mm: the
    estimate's sigma as if the friction angle were exact; computed where it is None. Raises BadInput
    where the estimator returns no Estimate.
    """
    assumed = assumed_settings(alpha_est_rad, sigma_rad, radii_mm)
    estimate = _estimate(name, estimator, whisk, assumed)
    if estimator in WITHOUT_ALPHA:
        exact_sigma_mm = estimate.sigma_mm
    elif exact_sigma_mm is None:
        exact = replace(assumed, alpha_est_sigma_rad=0.0)
        exact_sigma_mm = _estimate(name, estimator, whisk, exact).sigma_mm
    low_mm, high_mm = _interval(estimate)
    alpha_sigma_rad = assumed.alpha_est_sigma_rad if estimate.alpha_est_rad else 0.0
    contact = contact_of(whisk, estimate, alpha_sigma_rad)
    row = EstimateRow(
        name,
        Value(estimate.d_x_mm, estimate.sigma_mm),
        alpha_est_rad=estimate.alpha_est_rad,
        beta_est_rad=float(estimate.beta_rad),
        status=estimate.status,
        d_x_est_sigma_alpha_exact_mm=exact_sigma_mm,
        d_x_est_low_mm=low_mm,
        d_x_est_high_mm=high_mm,
    )
    return _with_contact(row, contact)


def _interval(estimate: Estimate) -> tuple[float, float]:
    """Return the 95 % interval of a distance, mm; d_x ± 1.96 sigma where the estimator has none."""
    if math.isnan(estimate.low_mm) and math.isnan(estimate.high_mm):
        half_mm = Z_95 * estimate.sigma_mm
        return float(estimate.d_x_mm - half_mm), float(estimate.d_x_mm + half_mm)
    return float(estimate.low_mm), float(estimate.high_mm)


def _with_contact(row: EstimateRow, contact: Contact) -> EstimateRow:
    """Return the row with the contact at the pushing angle."""
    return replace(
        row,
        d_y_est_mm=Value(contact.d_y_mm, contact.d_y_sigma_mm),
        d_z_est_mm=Value(contact.d_z_mm, contact.d_z_sigma_mm),
        slip_est_mm=Value(contact.slip_mm, contact.slip_sigma_mm),
        touch_covariance_mm_rad=contact.touch_covariance_mm_rad,
    )


def _estimate(
    name: str, estimator: Estimator, whisk: Whisk, assumed: EstimatorSettings
) -> Estimate:
    """Run an estimator; where it raises, the whisk has no estimate, and a status says why.

    Raises BadInput where it returns no Estimate.
    """
    try:
        estimate = estimator(whisk, assumed)
    except Exception as fault:  # a user's own code: the other whisks are evaluated all the same
        raised = f"{type(fault).__name__}: {fault}"
        return Estimate(math.nan, math.nan, reason("estimator_raised", name=name, fault=raised))
    if not isinstance(estimate, Estimate):
        found = f"returned {type(estimate).__name__}; it must return an Estimate"
        raise BadInput(f"--estimator {name} {found}")
    return _checked(estimate, whisk.beam.length_mm)


def _checked(estimate: Estimate, length_mm: float) -> Estimate:
    """Return the estimate with NaN for an impossible distance or sigma, and a status on each."""
    d_x = _float(estimate.d_x_mm)
    sigma = _float(estimate.sigma_mm)
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
    estimate, without_deflection = _checked_deflection(estimate)
    warnings.append(without_deflection)
    return replace(estimate, d_x_mm=d_x, sigma_mm=sigma, status=joined(status, *warnings))


def _checked_deflection(estimate: Estimate) -> tuple[Estimate, Reason]:
    """Return the estimate without a deflection that is none, and the reason where it had one."""
    deflection = estimate.deflection_mm
    sigma = estimate.deflection_sigma_mm
    if deflection is None or _is_measured(deflection, sigma):
        return estimate, NO_REASON
    why_none = reason("deflection_impossible", given=f"{deflection} ± {sigma} mm")
    return replace(estimate, deflection_mm=None, deflection_sigma_mm=None), why_none


def _is_measured(pair: ArrayLike, sigmas: ArrayLike) -> bool:
    """Return whether these are two finite numbers with two sigmas above 0."""
    try:
        numbers = np.asarray([pair, sigmas], dtype=float)
    except (TypeError, ValueError):
        return False
    return numbers.shape == (2, 2) and bool(np.isfinite(numbers).all() and (numbers[1] > 0).all())


def _float(value: object) -> float:
    """Return a number as a float, however it is wrapped; NaN for anything else."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan
