"""Truth and estimate side by side: error = estimate − truth, always; per cent of the true d_x."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from bench.base.results import number


@dataclass(frozen=True)
class Judged:
    """One estimate beside the truth. Truth is NaN where there is none; slope is the seen one, else the nominal one.

    one_factor: made with one gauge factor a channel. status: what the estimator or the bench says of the estimate.
    """

    trial: str
    whisk: int
    purpose: str
    surface: str
    speed_deg_s: float
    estimator: str
    beta_deg: float
    d_x_mm: float
    d_x_sigma_mm: float
    d_x_est_mm: float
    d_x_est_sigma_mm: float
    one_factor: bool = False
    status: str = ""

    @property
    def error_mm(self) -> float:
        return self.d_x_est_mm - self.d_x_mm

    @property
    def error_percent(self) -> float:
        return 100.0 * self.error_mm / self.d_x_mm

    @property
    def error_sigma_percent(self) -> float:
        """Stated standard deviation of the error: of the estimate and of the truth."""
        return 100.0 * float(np.hypot(self.d_x_est_sigma_mm, self.d_x_sigma_mm)) / self.d_x_mm


def whisks(results: Iterable[dict]) -> Iterator[tuple[dict, dict, dict]]:
    """(result, seen, felt) of every whisk."""
    for result in results:
        for seen, felt in zip(result["seen"]["whisks"], result["felt"]["whisks"]):
            yield result, seen, felt


def slope_deg(result: dict, seen: dict) -> float:
    """β as seen; the nominal one where the session has no pictures of it."""
    beta = number(seen.get("beta_rad"))
    return float(np.degrees(beta)) if np.isfinite(beta) else number(result["trial"]["beta_nominal_deg"])


def judge(results: Iterable[dict]) -> list[Judged]:
    """Every estimate of every whisk."""
    return [
        _judged(result, seen, answer, one_factor)
        for result, seen, felt in whisks(results)
        for one_factor, kind in ((False, "estimates"), (True, "one_factor"))
        for answer in felt[kind]
    ]


def _judged(result: dict, seen: dict, answer: dict, one_factor: bool) -> Judged:
    trial = result["trial"]
    return Judged(
        trial["name"],
        seen["whisk"],
        trial["purpose"],
        trial["surface"],
        number(trial["speed_deg_s"]),
        answer["estimator"],
        slope_deg(result, seen),
        number(seen.get("d_x_mm")),
        number(seen.get("d_x_sigma_mm")),
        number(answer["d_x_est_mm"]),
        number(answer["d_x_est_sigma_mm"]),
        one_factor,
        answer["status"],
    )
