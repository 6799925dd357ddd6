"""The friction angle α of each whisk: seen (no gauge) and felt (β seen, φ from the moments), in rad."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.polynomial import Polynomial

from bench.analyses.direction import slip_angle
from bench.base.combined import Measurement, Measurements
from bench.records.phases import NO_PHASES, Phases
from bench.records.trial_result import (
    BY_PICTURES,
    Deflection,
    FeltWhisk,
    SeenWhisk,
    TrialFacts,
    TrialResult,
    whisks,
)
from bench.trials.stick_slip_phases import seen_phases, slips
from vision import Value

# [1] Share of what bends the line of d_z against d_y that is left when it is taken out. Study:
# tests/studies/accuracy/combined_numbers.py.
_BEND_LEFT = 1 / 4
# [1] Sigma of α seen over the square of the unloaded whisker's slope at the contact: six whisks of a vibrissa with
# s² = 0.01 to 0.016 are off by up to 0.7 s². Study: tests/studies/accuracy/species.py.
_SET_LEFT = 1 / 2
_ROUNDS = 12  # each leaves less than half of the change up to a heading of 45°
# Terms of θ² are enough up to here: pushed by 8, 16 and 25 degrees against a bar at 40, α seen is off by 0.03, 0.3 and
# 0.7 degrees with them, but for the slope's error, and by 0.5, 1.5 and 3.8 without.
_FARTHEST_RAD = np.radians(10.0)
_FEWEST_NEAR = 5  # frames
# [sigmas] Of the slip angle felt, from which on a contact slips for sure: one at rest has as much in one whisk of
# 400. Derived.
_SURE_SIGMAS = 3.0
UNKNOWN = (np.nan, np.nan)
BY_MANIFEST = "manifest"
BETA_BY_HAND_RAD = np.radians(1.0)  # one sigma of a slope set by hand, where no picture shows it


class Tapering(Protocol):
    """A whisker that says how much of its base's diameter is left at a distance from the base."""

    length_mm: float

    def left(self, x_mm: float) -> float:
        """Return that share."""


@dataclass(frozen=True)
class WhiskAlphas:
    """Friction angles of one whisk, each a pair (value, sigma) in rad; NaN where it shows none.

    shared_seen_rad, shared_felt_rad: sigma that all angles of this whisk share, of β, and felt also of
    the moments. beta_from: where β comes from, a truth's source or BY_MANIFEST. common_seen,
    common_felt: change of the angles at one sigma of each cause that all whisks of a session share.
    """

    trial: str
    whisk: int
    surface: str
    speed_deg_s: float | None
    beta_rad: float
    seen: tuple[float, float]
    felt: tuple[float, float]
    phases_seen: Phases
    phases_felt: Phases
    shared_seen_rad: float
    shared_felt_rad: float
    beta_from: str = BY_PICTURES
    common_seen: tuple[float, ...] = ()
    common_felt: tuple[float, ...] = ()

    @property
    def nominal(self) -> bool:
        """Return whether β is that of the manifest, because no truth has it."""
        return self.beta_from == BY_MANIFEST

    def phases(self, record: str) -> Phases:
        """Return rests and jumps as "seen" or "felt"."""
        return self.phases_seen if record == "seen" else self.phases_felt

    def apart(self, kind: str, record: str) -> tuple[float, float]:
        """Return static or kinetic α by the record "seen" or "felt"; NaN without stick–slip."""
        shared_rad = self.shared_seen_rad if record == "seen" else self.shared_felt_rad
        mean, sigma = self.phases(record).mean(kind)
        return mean, float(np.hypot(sigma, shared_rad))

    def angle(self, name: str) -> tuple[float, float]:
        """Return the angle "seen" or "felt", or of a kind and record, such as "static_felt"."""
        kind, _, record = name.partition("_")
        return self.apart(kind, record) if record else getattr(self, name)

    def measurement(self, name: str) -> Measurement:
        """Return an angle with its sigma in parts: of the whisk, of its trial's bar, of all whisks."""
        value, sigma = self.angle(name)
        common = self.common_seen if name.endswith("seen") else self.common_felt
        of_setting = 0.0 if self.beta_from == BY_PICTURES else self.shared_seen_rad
        own = np.sqrt(max(sigma**2 - of_setting**2 - np.sum(np.square(common)), 0.0))
        if not sigma > 0:
            own = np.nan
        return Measurement(value, float(own), of_setting, common)

    @property
    def panel(self) -> tuple[str, float | None]:
        """Return surface and speed, as `TrialFacts.panel` has them."""
        return self.surface, self.speed_deg_s

    @property
    def key(self) -> tuple[str, int]:
        """Return trial and number of the whisk."""
        return self.trial, self.whisk


def alphas_of(results: Iterable[TrialResult]) -> list[WhiskAlphas]:
    """Return the friction angles of every whisk, in their order."""
    found = []
    for result, seen, felt in whisks(results):
        found.append(
            _alphas(result.trial, seen, felt, np.radians(result.theta_deg), result.whisker)
        )
    return found


def _alphas(
    trial: TrialFacts, seen: SeenWhisk, felt: FeltWhisk, theta_rad: float, whisker: Tapering
) -> WhiskAlphas:
    """Return the friction angles of one whisk at a pushing angle."""
    beta, beta_from = _slope(trial, seen)
    phases = NO_PHASES
    alpha_rad, sigma_rad = seen_friction(seen, whisker)
    by_theory_rad = _left_of_bend(seen, alpha_rad)
    by_set_rad = _left_of_set(seen, whisker)
    beta_common_rad = _common_slope(seen)
    if slips(seen):
        phases = seen_phases(seen.frames, beta.value, seen.d_x_mm.value)
    return WhiskAlphas(
        trial.name,
        seen.whisk,
        *trial.panel,
        beta_rad=beta.value,
        seen=(alpha_rad, float(np.linalg.norm([sigma_rad, by_theory_rad, by_set_rad]))),
        felt=felt_friction(seen, felt, theta_rad),
        phases_seen=phases,
        phases_felt=felt.phases,
        shared_seen_rad=beta.sigma,
        shared_felt_rad=float(np.hypot(beta.sigma, felt.phi_felt_rad.sigma)),
        beta_from=beta_from,
        common_seen=(beta_common_rad, _common_seen(seen, sigma_rad), by_theory_rad, by_set_rad),
        common_felt=(beta_common_rad, *_common_felt(felt).tolist()),
    )


def _slope(trial: TrialFacts, seen: SeenWhisk) -> tuple[Value, str]:
    """Return the slope β, rad, as seen or else as the manifest states it, and which of both it is."""
    if np.isfinite(seen.beta_rad.value):
        return seen.beta_rad, seen.source
    stated_rad = float(np.radians(trial.beta_nominal_deg))
    return Value(stated_rad, BETA_BY_HAND_RAD), BY_MANIFEST


def _common_slope(seen: SeenWhisk) -> float:
    """Return the part of β's sigma that all whisks share, rad; of a slope set by hand there is none."""
    if not np.isfinite(seen.beta_rad.value):
        return 0.0
    shared = seen.truth.shared
    return seen.beta_rad.sigma if shared is None else shared.beta_rad


def _common_seen(seen: SeenWhisk, sigma_rad: float) -> float:
    """Return the part of the sigma of α seen that all whisks share but for β's, rad.

    It is the share that the sigma of slip has; where that is not known, all of it.
    """
    by_slope_rad = np.sqrt(max(np.nan_to_num(sigma_rad) ** 2 - seen.beta_rad.sigma**2, 0.0))
    if seen.at is None or not np.isfinite(seen.at.slip_shared_mm):
        return float(by_slope_rad)
    return float(by_slope_rad * min(seen.at.slip_shared_mm / seen.at.slip_mm.sigma, 1.0))


def _common_felt(felt: FeltWhisk) -> np.ndarray:
    """Return the change (k,) of −|φ| by each cause that the moments of all whisks share, rad."""
    m_y = felt.m_y_Nmm.value
    m_z = felt.m_z_Nmm.value
    by_cause = felt.shared_Nmm.reshape(-1, 2) @ [m_z, -m_y] / (m_y**2 + m_z**2)
    return -np.copysign(1.0, felt.phi_felt_rad.value) * by_cause


def seen_friction(seen: SeenWhisk, whisker: Tapering) -> tuple[float, float]:
    """Return α and its sigma by the slope of d_z against d_y over the frames of a slipping whisk, and β.

    NaN where it hardly slips. A line's slope is free of what offsets all deflections alike. What friction
    along the whisker and large angles (`bench.analyses.direction`) bend that line by is taken out of d_z
    first. Along a sphere or a ring the slope turns with the slip, and no line is straight: there α is that
    at θ, by the normal at the contact.
    """
    if not slips(seen):
        return UNKNOWN
    if _turns_with_slip(seen):
        return UNKNOWN if seen.at is None else (seen.at.alpha_rad.value, seen.at.alpha_rad.sigma)
    d = _near_touch(seen.deflection)
    beta = abs(seen.beta_rad.value)
    centred = d.across_y_mm - d.across_y_mm.mean()
    weights = centred / np.sum(centred**2)  # (frames,) of the slope of a line
    alpha, slope = _straight_line(d, beta, weights, whisker.left(d.d_x_mm))
    # To first order an error of d_y acts as one of d_z times the slope; rows of along, z and y take turns.
    gradient = np.stack([np.zeros_like(weights), weights, -slope * weights], axis=1).ravel()
    slope_sigma = float(np.sqrt(gradient @ d.covariance @ gradient))
    return alpha, float(np.hypot(slope_sigma / (1.0 + slope**2), seen.beta_rad.sigma))


def _left_of_bend(seen: SeenWhisk, alpha_rad: float) -> float:
    """Return what α seen may be off by because the line that it rests on is not straight, rad.

    It is a share of what taking the bend out changes α by, the same in all whisks; 0 where no line is
    fitted.
    """
    if not np.isfinite(alpha_rad) or _turns_with_slip(seen):
        return 0.0
    d = _near_touch(seen.deflection)
    centred = d.across_y_mm - d.across_y_mm.mean()
    slope = float(centred @ d.across_z_mm / np.sum(centred**2))
    bent_rad = alpha_rad - (abs(seen.beta_rad.value) - np.arctan(abs(slope)))
    return float(_BEND_LEFT * bent_rad)


def _left_of_set(seen: SeenWhisk, whisker: Tapering) -> float:
    """Return what α seen may be off by because the whisker is curved without load, rad.

    Where it slopes by s at the contact, as much as s² of a push goes aside and into twist.
    """
    if seen.truth.shape is None:
        return 0.0
    share = seen.deflection.d_x_mm / whisker.length_mm
    slopes = [Polynomial(own).deriv()(share) for own in seen.truth.shape.rest_mm]
    return float(_SET_LEFT * np.sum(np.square(slopes)) / whisker.length_mm**2)


def _straight_line(
    d: Deflection, beta: float, weights: np.ndarray, left: float
) -> tuple[float, float]:
    """Return α, rad, and the slope of d_z against d_y, without what bends that line.

    weights (frames,): of the slope of a line. left: share of the base's diameter that the whisker has at
    the contact. α is needed for that bend, and found in a few rounds.
    """
    slope = float(weights @ d.across_z_mm)
    side = np.copysign(1.0, slope)
    heading_rad = _heading(d, d.theta_rad)
    alpha = np.nan
    for _ in range(_ROUNDS):
        alpha = beta - np.arctan(side * slope)
        across_rad = np.arctan(np.tan(alpha) * np.cos(heading_rad))
        phi = slip_angle(d.theta_rad, beta, across_rad, left)
        bent_mm = d.across_y_mm * (np.tan(phi) - np.tan(beta - alpha))
        slope = float(weights @ (d.across_z_mm - side * bent_mm))
    return float(alpha), slope


def felt_friction(seen: SeenWhisk, felt: FeltWhisk, theta_rad: float) -> tuple[float, float]:
    """Return α and its sigma by |β| − |φ|: the slope as seen, the slip angle by the moments at θ.

    Of a whisk that was seen to slip; NaN where the moments are not those of the seen shape, or the slope
    at θ is not that at touch. Where the truth is a stage's a slip angle that is not 0 for sure shows the
    slip: the force on a contact at rest points along the push.
    """
    beta = seen.beta_rad
    phi = felt.phi_felt_rad
    if seen.deflection is None and seen.has_truth:
        if felt.apart or not abs(phi.value) > _SURE_SIGMAS * phi.sigma:
            return UNKNOWN
        return abs(beta.value) - abs(phi.value), float(np.hypot(beta.sigma, phi.sigma))
    if not (slips(seen) and np.isfinite(phi.value)) or felt.apart or _turns_with_slip(seen):
        return UNKNOWN
    across_rad = abs(beta.value) - abs(phi.value)
    alpha = np.arctan(np.tan(across_rad) / np.cos(_heading(seen.deflection, theta_rad)))
    return float(alpha), float(np.hypot(beta.sigma, phi.sigma))


def _turns_with_slip(seen: SeenWhisk) -> bool:
    """Return whether the object is curved along itself: a cone is straight there."""
    return seen.truth.rounded is not None and seen.truth.rounded.shape != "cone"


def _near_touch(d: Deflection) -> Deflection:
    """Return the frames up to _FARTHEST_RAD, or all where these are few."""
    near = d.theta_rad <= _FARTHEST_RAD
    if np.all(near) or np.sum(near) < _FEWEST_NEAR:
        return d
    rows = np.repeat(near, 3)
    of_frames = {name: values[near] for name, values in vars(d).items() if np.ndim(values) == 1}
    return replace(d, **of_frames, covariance=d.covariance[np.ix_(rows, rows)])


def _heading(d: Deflection, theta_rad: float | np.ndarray) -> float | np.ndarray:
    """Return the angle h between the slip at θ and the bar, as seen.

    The whisker's material moves along itself, too. Friction acts against the whole motion, so that
    |β| − |φ|, the angle of the force across the whisker, is less than α: tan(|β| − |φ|) = tan α cos h.
    The slip grows in proportion to θ, the motion along the whisker to θ².
    """
    square = d.theta_rad**2 - np.mean(d.theta_rad**2)
    past_per_rad = 2.0 * (square @ d.past_mm) / (square @ square) * theta_rad
    slip_per_rad = (d.theta_rad @ d.slip_mm) / (d.theta_rad @ d.theta_rad)
    return np.arctan(past_per_rad / slip_per_rad)


def mean_alpha(alphas: Iterable[WhiskAlphas], name: str) -> tuple[float, float]:
    """Return the mean of an angle (`WhiskAlphas.angle`) over whisks and its sigma, rad.

    NaN where no whisk has it. How the shared error of β goes with the sign of the slope is not known, so
    that it counts as one for all.
    """
    mean = Measurements.of((whisk.trial, whisk.measurement(name)) for whisk in alphas).mean()
    return mean.value, mean.sigma
