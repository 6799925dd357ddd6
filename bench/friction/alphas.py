"""The friction angle α of each whisk: seen (no gauge) and felt (β seen, φ from the moments), rad with one sigma."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bench.base.results import number
from bench.trials.compare import whisks
from bench.trials.phases import NO_PHASES, Phases, from_plain, seen_phases, slips

UNKNOWN = (float("nan"), float("nan"))
BETA_BY_HAND_RAD = np.radians(1.0)  # one sigma of a slope set by hand, where no picture tells it


@dataclass(frozen=True)
class WhiskAlphas:
    """α of one whisk, each a pair (value, sigma) in rad; NaN where the whisk does not show it."""

    trial: str
    whisk: int
    purpose: str
    surface: str
    speed_deg_s: float
    beta_rad: float
    seen: tuple[float, float]
    felt: tuple[float, float]
    phases_seen: Phases
    phases_felt: Phases
    shared_seen_rad: float  # sigma that all angles of this whisk share: of β, and felt also of the moments
    shared_felt_rad: float
    nominal: bool = False  # β is that of the manifest: no picture shows it

    def apart(self, kind: str, record: str) -> tuple[float, float]:
        """Static or kinetic α from the record "seen" or "felt"; NaN where it shows no stick–slip."""
        phases, shared = (
            (self.phases_seen, self.shared_seen_rad) if record == "seen" else (self.phases_felt, self.shared_felt_rad)
        )
        mean, sigma = phases.mean(kind)
        return mean, float(np.hypot(sigma, shared))

    @property
    def key(self) -> tuple[str, int]:
        """Which whisk."""
        return self.trial, self.whisk


def alphas_of(results: Iterable[dict]) -> list[WhiskAlphas]:
    """α of every whisk, in their order."""
    return [_alphas(result["trial"], seen, felt) for result, seen, felt in whisks(results)]


def _alphas(trial: dict, seen: dict, felt: dict) -> WhiskAlphas:
    beta, by_beta = number(seen.get("beta_rad")), number(seen.get("beta_sigma_rad"))
    nominal = not np.isfinite(beta)
    if nominal:
        beta, by_beta = np.radians(number(trial["beta_nominal_deg"])), BETA_BY_HAND_RAD
    kind = (trial["purpose"], trial["surface"], number(trial["speed_deg_s"]), beta)
    of_seen = seen_phases(seen["frames"], beta, number(seen["d_x_mm"])) if slips(seen) else NO_PHASES
    of_felt = from_plain(felt.get("phases"))
    shared = by_beta, float(np.hypot(by_beta, number(felt.get("phi_felt_sigma_rad"))))
    angles = seen_friction(seen), felt_friction(seen, felt)
    return WhiskAlphas(trial["name"], seen["whisk"], *kind, *angles, of_seen, of_felt, *shared, nominal)


def seen_friction(seen: dict) -> tuple[float, float]:
    """α from the slope of d_z against d_y over the frames of a slipping whisk, and β. NaN where it hardly slips.

    A line's slope is free of what offsets all deflections alike.
    """
    if not slips(seen):
        return UNKNOWN
    d = seen["deflection"]
    y, z = np.array(d["across_y_mm"]), np.array(d["across_z_mm"])
    weights = (y - y.mean()) / np.sum((y - y.mean()) ** 2)
    slope = float(weights @ z)
    n = len(y)
    by_z, by_y = np.eye(2 * n)[0::2], np.eye(2 * n)[1::2]
    through = weights @ (by_z - slope * by_y)  # to first order an error of d_y acts as one of d_z times the slope
    slope_sigma = float(np.sqrt(through @ np.array(d["covariance"]) @ through))
    alpha = abs(seen["beta_rad"]) - abs(np.arctan(slope))
    return float(alpha), float(np.hypot(slope_sigma / (1.0 + slope**2), seen["beta_sigma_rad"]))


def felt_friction(seen: dict, felt: dict) -> tuple[float, float]:
    """α = |β| − |φ|, the slope as seen and the slip angle from the moments, of a whisk that was seen to slip; unknown
    where the moments are not those of the seen shape."""
    phi = number(felt.get("phi_felt_rad"))
    if not (slips(seen) and np.isfinite(phi)) or felt.get("apart"):
        return UNKNOWN
    alpha = abs(number(seen["beta_rad"])) - abs(phi)
    return alpha, float(np.hypot(number(seen["beta_sigma_rad"]), number(felt["phi_felt_sigma_rad"])))


def mean_alpha(alphas: Iterable[tuple[float, float]]) -> tuple[float, float]:
    """Weighted mean and its sigma, rad.

    Cameras and gauges are common to all whisks, and how much of each sigma is theirs is not told apart: so it is not
    divided by the number of whisks; where the whisks scatter more than that, the scatter of the mean counts.
    """
    known = np.array([pair for pair in alphas if np.isfinite(pair).all() and pair[1] > 0])
    if not len(known):
        return UNKNOWN
    values, sigmas = known.T
    weights = sigmas**-2.0 / np.sum(sigmas**-2.0)
    mean = float(weights @ values)
    scatter = np.sqrt(np.sum(weights**2 * (values - mean) ** 2)) if len(known) > 1 else 0.0
    return mean, float(max(weights @ sigmas, scatter))
