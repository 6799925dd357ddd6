"""Truth and estimate of every whisk: error = estimate − truth, always; per cent of the true d_x."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bench.base.statuses import has_only_notes
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenWhisk, TrialResult, whisks


@dataclass(frozen=True)
class Judged:
    """One estimate with its truth, which is NaN where there is none.

    beta_deg: the slope as seen, else the nominal one. one_factor: made with one gauge factor a
    channel. status: the estimate's. has_warning: the whisk itself has a warning.
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
    one_factor: bool = False
    status: str = ""
    has_warning: bool = False

    @property
    def error_mm(self) -> float:
        """Return estimate less truth."""
        return self.d_x_est_mm - self.d_x_mm

    @property
    def error_percent(self) -> float:
        """Return estimate less truth, in per cent of the truth."""
        return 100.0 * self.error_mm / self.d_x_mm

    @property
    def error_sigma_percent(self) -> float:
        """Return the error's stated standard deviation, that of estimate and truth together."""
        return 100.0 * float(np.hypot(self.d_x_est_sigma_mm, self.d_x_sigma_mm)) / self.d_x_mm


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
    return float(np.degrees(beta_rad)) if np.isfinite(beta_rad) else result.trial.beta_nominal_deg


def judge(results: Iterable[TrialResult]) -> list[Judged]:
    """Return every estimate of every whisk with its truth."""
    found = []
    for result, seen, felt in whisks(results):
        has_warning = not is_sound(seen, felt)
        for row in felt.estimates:
            found.append(_judged(result, seen, row, one_factor=False, has_warning=has_warning))
        for row in felt.one_factor:
            found.append(_judged(result, seen, row, one_factor=True, has_warning=has_warning))
    return found


def _judged(
    result: TrialResult, seen: SeenWhisk, row: EstimateRow, *, one_factor: bool, has_warning: bool
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
        one_factor,
        row.status,
        has_warning,
    )
