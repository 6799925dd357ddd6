"""Truth and estimate side by side: error = estimate − truth, always; per cent of the true d_x."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bench.base.statuses import has_only_notes
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenWhisk, TrialResult, whisks


@dataclass(frozen=True)
class Judged:
    """One estimate beside the truth. Truth is NaN where there is none; slope is the seen one, else the nominal one.

    one_factor: made with one gauge factor a channel. status: what the estimator or the bench says of the estimate.
    doubtful: something is, of the whisk itself.
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
    doubtful: bool = False

    @property
    def error_mm(self) -> float:
        """Estimate less truth."""
        return self.d_x_est_mm - self.d_x_mm

    @property
    def error_percent(self) -> float:
        """Estimate less truth, in per cent of the truth."""
        return 100.0 * self.error_mm / self.d_x_mm

    @property
    def error_sigma_percent(self) -> float:
        """Stated standard deviation of the error: of the estimate and of the truth."""
        return 100.0 * float(np.hypot(self.d_x_est_sigma_mm, self.d_x_sigma_mm)) / self.d_x_mm


def is_sound(seen: SeenWhisk, felt: FeltWhisk) -> bool:
    """Return whether nothing is doubtful of distance and moments, seen and felt.

    No verdict takes doubtful ones. Notes make nothing doubtful: a slip that is seen to jump, or not
    up to the wanted angle, leaves the distance what it is.
    """
    return has_only_notes(seen.status) and has_only_notes(felt.status)


def sound_whisks(results: Iterable[TrialResult]) -> set[tuple[str, int]]:
    """(trial, whisk) of those of which nothing is doubtful."""
    return {
        (result.trial.name, seen.whisk)
        for result, seen, felt in whisks(results)
        if is_sound(seen, felt)
    }


def slope_deg(result: TrialResult, seen: SeenWhisk) -> float:
    """β as seen; the nominal one where the session has no pictures of it."""
    beta_rad = seen.beta_rad.value
    return float(np.degrees(beta_rad)) if np.isfinite(beta_rad) else result.trial.beta_nominal_deg


def judge(results: Iterable[TrialResult]) -> list[Judged]:
    """Every estimate of every whisk."""
    return [
        _judged(result, seen, answer, one_factor, not is_sound(seen, felt))
        for result, seen, felt in whisks(results)
        for one_factor, answers in ((False, felt.estimates), (True, felt.one_factor))
        for answer in answers
    ]


def _judged(
    result: TrialResult, seen: SeenWhisk, answer: EstimateRow, one_factor: bool, doubtful: bool
) -> Judged:
    trial = result.trial
    return Judged(
        trial.name,
        seen.whisk,
        trial.purpose,
        trial.surface,
        trial.speed_deg_s,
        answer.estimator,
        slope_deg(result, seen),
        float(seen.d_x_mm.value),
        float(seen.d_x_mm.sigma),
        float(answer.d_x_est_mm.value),
        float(answer.d_x_est_mm.sigma),
        one_factor,
        answer.status,
        doubtful,
    )
