"""Truth and estimate of every whisk: error = estimate − truth, always; per cent of the true d_x.

Gauges that were calibrated by the session's own cameras have the cameras' errors in them, and so has
an estimate. A rig frame that lies ε farther from the bar than it is makes the truth ε too long. It
makes the moments of a gauge trial, 3 EI δ / d_x² of the deflection δ, smaller by 2 ε / d_x, and with
them the gauges; an estimate, which goes as 1 / moment, is then 2 ε too long. Lengths that are all
too long by one share make both too long by it. So truth and estimate err together, and the sigma of
their difference is not that of two independent errors.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from bench.base.statuses import has_only_notes
from bench.records.trial_result import (
    WITH_FRICTION,
    EstimateRow,
    FeltWhisk,
    SeenWhisk,
    TrialResult,
    whisks,
)
from vision.geometry import NO_REASON, Reason, joined


@dataclass(frozen=True)
class Judged:
    """One estimate with its truth, which is NaN where there is none.

    beta_deg: the slope as seen, else the nominal one. covariance_mm2: of estimate and truth, by the
    errors of the cameras. one_factor: made with one gauge factor a channel. status: the estimate's.
    whisk_status: of the whisk, seen and felt. d_x_est_sigma_alpha_exact_mm: the estimate's sigma as
    if the friction angle were exact. inside: whether its 95 % interval holds the truth, None where
    either is not known.
    """

    trial: str
    whisk: int
    purpose: str
    surface: str
    speed_deg_s: float | None
    estimator: str
    beta_deg: float
    d_x_mm: float
    d_x_sigma_mm: float
    d_x_est_mm: float
    d_x_est_sigma_mm: float
    covariance_mm2: float = 0.0
    one_factor: bool = False
    status: str = ""
    whisk_status: Reason = NO_REASON
    d_x_est_sigma_alpha_exact_mm: float = math.nan
    inside: bool | None = None

    @property
    def is_by_ten(self) -> bool:
        """Return whether it is the estimate by equation (10) with α_est as given."""
        return self.estimator == WITH_FRICTION and not self.one_factor

    @property
    def is_shown(self) -> bool:
        """Return whether it stands beside those of other estimators: with one factor a channel, (10) alone does."""
        return not self.one_factor or self.estimator == WITH_FRICTION

    @property
    def way(self) -> tuple[str, bool]:
        """Return estimator and kind of gauges: which estimates of other whisks it stands with."""
        return self.estimator, self.one_factor

    @property
    def has_warning(self) -> bool:
        """Return whether the whisk itself has a warning."""
        return not has_only_notes(self.whisk_status)

    @property
    def error_mm(self) -> float:
        """Return estimate less truth."""
        return self.d_x_est_mm - self.d_x_mm

    @property
    def error_percent(self) -> float:
        """Return estimate less truth, in per cent of the truth."""
        return 100.0 * self.error_mm / self.d_x_mm

    @property
    def error_sigma_mm(self) -> float:
        """Return the error's stated standard deviation, that of estimate and truth together."""
        apart = self.d_x_est_sigma_mm**2 + self.d_x_sigma_mm**2
        variance = apart - 2.0 * self.covariance_mm2
        return float(np.sqrt(np.maximum(variance, 0.0)))  # below 0 by rounding only

    @property
    def error_sigma_percent(self) -> float:
        """Return the error's stated standard deviation, per cent of the truth."""
        return 100.0 * self.error_sigma_mm / self.d_x_mm


def is_sound(seen: SeenWhisk, felt: FeltWhisk) -> bool:
    """Return whether distance and moments have no warning, seen and felt.

    No verdict takes whisks with one. Notes are no warning: a slip that is seen to jump, or not up
    to the wanted angle, leaves the distance what it is.
    """
    return has_only_notes(seen.status) and has_only_notes(felt.status)


def sound_whisks(results: Iterable[TrialResult]) -> set[tuple[str, int]]:
    """Return trial and number of the whisks without a warning."""
    sound = set()
    for result, seen, felt in whisks(results):
        if is_sound(seen, felt):
            sound.add((result.trial.name, seen.whisk))
    return sound


def slope_deg(result: TrialResult, seen: SeenWhisk) -> float:
    """Return β as seen, or the nominal one where no picture shows it."""
    beta_rad = seen.beta_rad.value
    return math.degrees(beta_rad) if np.isfinite(beta_rad) else result.trial.beta_nominal_deg


def judge(results: Iterable[TrialResult]) -> list[Judged]:
    """Return every estimate of every whisk with its truth."""
    found = []
    for result, seen, felt in whisks(results):
        status = joined(seen.status, felt.status)
        for row in felt.estimates:
            judged = _judged(result, seen, row, whisk_status=status)
            found.append(replace(judged, covariance_mm2=_covariance_mm2(result, seen, felt, row)))
        for row in felt.one_factor:
            judged = _judged(result, seen, row, whisk_status=status)
            found.append(replace(judged, one_factor=True))
    return found


def _covariance_mm2(
    result: TrialResult, seen: SeenWhisk, felt: FeltWhisk, row: EstimateRow
) -> float:
    """Return the covariance of estimate and truth, mm², by the errors of the cameras.

    An estimate goes as 1 / moment, and the less where the whisker has tapered. How the moment turns
    is left out: a placement that is off along the whisker, or a scale, changes its size alone. An
    estimate that was set to the whisker's length goes with nothing: both sigmas bound what is left.
    """
    shared = seen.truth.shared
    if shared is None or not len(shared.d_x_by_camera_error_mm):
        return 0.0
    if not len(felt.by_camera_error_Nmm):
        return 0.0
    moment_Nmm = np.array([felt.m_y_Nmm.value, felt.m_z_Nmm.value])
    by_share = felt.by_camera_error_Nmm @ moment_Nmm / (moment_Nmm @ moment_Nmm)
    of_truth_mm = shared.d_x_by_camera_error_mm
    d_x_mm = row.d_x_est_mm.value
    covariance_mm2 = -d_x_mm * result.whisker.thickness(d_x_mm) * float(by_share @ of_truth_mm)
    most_mm2 = row.d_x_est_mm.sigma * seen.d_x_mm.sigma
    return float(np.clip(covariance_mm2, -most_mm2, most_mm2))


def _judged(
    result: TrialResult, seen: SeenWhisk, row: EstimateRow, *, whisk_status: Reason
) -> Judged:
    """Return one estimate with its truth."""
    trial = result.trial
    return Judged(
        trial.name,
        seen.whisk,
        trial.purpose,
        trial.surface,
        trial.speed_deg_s,
        row.estimator,
        slope_deg(result, seen),
        float(seen.d_x_mm.value),
        float(seen.d_x_mm.sigma),
        float(row.d_x_est_mm.value),
        float(row.d_x_est_mm.sigma),
        status=row.status,
        whisk_status=whisk_status,
        d_x_est_sigma_alpha_exact_mm=float(row.d_x_est_sigma_alpha_exact_mm),
        inside=row.holds(seen.d_x_mm.value),
    )
