"""The friction angle α of each whisk: seen (no gauge) and felt (β seen, φ from the moments), rad with one sigma."""

from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np

from bench.analyses.direction import slip_angle
from bench.records.phases import NO_PHASES, Phases
from bench.records.trial_result import (
    Deflection,
    FeltWhisk,
    SeenWhisk,
    TrialFacts,
    TrialResult,
    whisks,
)
from bench.trials.stick_slip_phases import seen_phases, slips
from vision.truth.value import Value

_ROUNDS = 12  # each leaves less than half of the change up to a heading of 45°
# Terms of θ² are enough up to here: pushed by 8, 16 and 25 degrees against a bar at 40, α seen is off by 0.03, 0.3 and
# 0.7 degrees with them, but for the slope's error, and by 0.5, 1.5 and 3.8 without.
_FARTHEST_RAD, _FEWEST_NEAR = np.radians(10.0), 5
UNKNOWN = (float("nan"), float("nan"))
BETA_BY_HAND_RAD = np.radians(1.0)  # one sigma of a slope set by hand, where no picture tells it


@dataclass(frozen=True)
class WhiskAlphas:
    """α of one whisk, each a pair (value, sigma) in rad; NaN where the whisk does not show it."""

    trial: str
    whisk: int
    purpose: str
    surface: str
    speed_deg_s: float | None
    beta_rad: float
    seen: tuple[float, float]
    felt: tuple[float, float]
    phases_seen: Phases
    phases_felt: Phases
    shared_seen_rad: (
        float  # sigma that all angles of this whisk share: of β, and felt also of the moments
    )
    shared_felt_rad: float
    nominal: bool = False  # β is that of the manifest: no picture shows it

    def apart(self, kind: str, record: str) -> tuple[float, float]:
        """Static or kinetic α from the record "seen" or "felt"; NaN where it shows no stick–slip."""
        phases, shared = (
            (self.phases_seen, self.shared_seen_rad)
            if record == "seen"
            else (self.phases_felt, self.shared_felt_rad)
        )
        mean, sigma = phases.mean(kind)
        return mean, float(np.hypot(sigma, shared))

    @property
    def panel(self) -> tuple[str, float | None]:
        """Surface and speed, as `TrialFacts.panel` has them."""
        return self.surface, self.speed_deg_s

    @property
    def key(self) -> tuple[str, int]:
        """Which whisk."""
        return self.trial, self.whisk


def alphas_of(results: Iterable[TrialResult]) -> list[WhiskAlphas]:
    """α of every whisk, in their order."""
    return [
        _alphas(result.trial, seen, felt, np.radians(result.theta_deg))
        for result, seen, felt in whisks(results)
    ]


def _alphas(trial: TrialFacts, seen: SeenWhisk, felt: FeltWhisk, theta_rad: float) -> WhiskAlphas:
    beta, nominal = seen.beta_rad, not np.isfinite(seen.beta_rad.value)
    if nominal:
        beta = Value(float(np.radians(trial.beta_nominal_deg)), BETA_BY_HAND_RAD)
    of_seen = seen_phases(seen.frames, beta.value, seen.d_x_mm.value) if slips(seen) else NO_PHASES
    shared = beta.sigma, float(np.hypot(beta.sigma, felt.phi_felt_rad.sigma))
    return WhiskAlphas(
        trial.name,
        seen.whisk,
        trial.purpose,
        *trial.panel,
        beta.value,
        seen_friction(seen),
        felt_friction(seen, felt, theta_rad),
        of_seen,
        felt.phases,
        *shared,
        nominal,
    )


def seen_friction(seen: SeenWhisk) -> tuple[float, float]:
    """α from the slope of d_z against d_y over the frames of a slipping whisk, and β. NaN where it hardly slips.

    A line's slope is free of what offsets all deflections alike. What friction along the whisker and large angles
    (`bench.analyses.direction`) bend that line by is taken out of d_z first. Along a sphere or a ring the slope turns
    with the slip, and no line is straight: there α is that at θ, by the normal at the contact.
    """
    if not slips(seen):
        return UNKNOWN
    if _turns_with_slip(seen):
        return UNKNOWN if seen.at is None else (seen.at.alpha_rad.value, seen.at.alpha_rad.sigma)
    d, beta = _near_touch(seen.deflection), abs(seen.beta_rad.value)
    weights = (d.across_y_mm - d.across_y_mm.mean()) / np.sum(
        (d.across_y_mm - d.across_y_mm.mean()) ** 2
    )
    slope, alpha = float(weights @ d.across_z_mm), np.nan
    side = np.copysign(1.0, slope)
    for _ in range(_ROUNDS):
        alpha = beta - np.arctan(side * slope)
        across = np.arctan(np.tan(alpha) * np.cos(_heading(d, d.theta_rad)))
        phi = slip_angle(d.theta_rad, beta, across)
        bent = d.across_y_mm * (np.tan(phi) - np.tan(beta - alpha))
        slope = float(weights @ (d.across_z_mm - side * bent))
    n = len(weights)
    by_z, by_y = np.eye(2 * n)[0::2], np.eye(2 * n)[1::2]
    through = weights @ (
        by_z - slope * by_y
    )  # to first order an error of d_y acts as one of d_z times the slope
    slope_sigma = float(np.sqrt(through @ d.covariance @ through))
    return float(alpha), float(np.hypot(slope_sigma / (1.0 + slope**2), seen.beta_rad.sigma))


def felt_friction(seen: SeenWhisk, felt: FeltWhisk, theta_rad: float) -> tuple[float, float]:
    """α by |β| − |φ|, the slope as seen and the slip angle from the moments at θ, of a whisk that was seen to slip;
    unknown where the moments are not those of the seen shape, or the slope at θ is not that at touch."""
    beta, phi = seen.beta_rad, felt.phi_felt_rad
    if not (slips(seen) and np.isfinite(phi.value)) or felt.apart or _turns_with_slip(seen):
        return UNKNOWN
    across = abs(beta.value) - abs(phi.value)
    alpha = np.arctan(np.tan(across) / np.cos(_heading(seen.deflection, theta_rad)))
    return float(alpha), float(np.hypot(beta.sigma, phi.sigma))


def _turns_with_slip(seen: SeenWhisk) -> bool:
    """Whether the object is curved along itself: a cone is straight there."""
    return seen.truth.rounded is not None and seen.truth.rounded.shape != "cone"


def _near_touch(d: Deflection) -> Deflection:
    """The frames up to _FARTHEST_RAD, or all where these are few."""
    near = d.theta_rad <= _FARTHEST_RAD
    if np.all(near) or np.sum(near) < _FEWEST_NEAR:
        return d
    both = np.repeat(near, 2)
    parts = {f.name: getattr(d, f.name)[near] for f in fields(d) if f.name != "covariance"}
    return Deflection(**parts, covariance=d.covariance[np.ix_(both, both)])


def _heading(d: Deflection, theta_rad: float | np.ndarray) -> float | np.ndarray:
    """The angle h between the slip at θ and the bar, as seen: the whisker's material moves along itself, too.

    Friction acts against the whole motion, so that |β| − |φ|, the angle of the force across the whisker, is less than
    α: tan(|β| − |φ|) = tan α cos h. The slip grows in proportion to θ, the motion along the whisker to θ².
    """
    square = d.theta_rad**2 - np.mean(d.theta_rad**2)
    past = 2.0 * (square @ d.past_mm) / (square @ square) * theta_rad
    return np.arctan(past / ((d.theta_rad @ d.slip_mm) / (d.theta_rad @ d.theta_rad)))


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
