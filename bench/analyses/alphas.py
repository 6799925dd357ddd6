"""The friction angle α of each whisk: seen (no gauge) and felt (β seen, φ from the moments), in rad."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bench.analyses.direction import slip_angle
from bench.base.combined import Measurement, Measurements, sigma_without
from bench.records.phases import NO_PHASES, Phases
from bench.records.trial_result import (
    BY_PICTURES,
    FeltWhisk,
    SeenWhisk,
    TrialFacts,
    TrialResult,
    whisks,
)
from bench.trials.seen_friction import heading, slips, turns_with_slip
from bench.trials.stick_slip_phases import seen_phases
from vision import UNKNOWN, Value

# [sigmas] Of the slip angle felt, from which on a contact slips for sure: one at rest has as much in one whisk of
# 400. Derived.
_SURE_SIGMAS = 3.0
BY_MANIFEST = "manifest"


@dataclass(frozen=True)
class WhiskAlphas:
    """Friction angles of one whisk, rad; UNKNOWN where it shows none.

    shared_seen_rad, shared_felt_rad: sigma that all angles of this whisk share, of β, and felt also of
    the moments. beta_from: where β comes from, a truth's source or BY_MANIFEST. common_seen,
    common_felt: change of the angles at one sigma of each cause that all whisks of a session share.
    """

    trial: str
    whisk: int
    surface: str
    speed_deg_s: float | None
    beta_rad: float
    seen: Value
    felt: Value
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

    def apart(self, kind: str, record: str) -> Value:
        """Return static or kinetic α by the record "seen" or "felt"; NaN without stick–slip."""
        shared_rad = self.shared_seen_rad if record == "seen" else self.shared_felt_rad
        mean = self.phases(record).mean(kind)
        return Value(mean.value, math.hypot(mean.sigma, shared_rad))

    def angle(self, name: str) -> Value:
        """Return the angle "seen" or "felt", or of a kind and record, such as "static_felt"."""
        kind, _, record = name.partition("_")
        return self.apart(kind, record) if record else getattr(self, name)

    def measurement(self, name: str) -> Measurement:
        """Return an angle with its sigma in parts: of the whisk, of its trial's bar, of all whisks."""
        angle = self.angle(name)
        common = self.common_seen if name.endswith("seen") else self.common_felt
        of_setting = 0.0 if self.beta_from == BY_PICTURES else self.shared_seen_rad
        own = np.nan
        if angle.sigma > 0:
            own = sigma_without(angle.sigma, np.array([of_setting, *common]))
        return Measurement(angle.value, own, of_setting, common)

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
        left = result.whisker.thickness(seen.d_x_mm.value)
        alpha_felt = felt_friction(seen, felt, result.theta_rad, left)
        found.append(_alphas(result.trial, seen, felt, alpha_felt))
    return found


def _alphas(trial: TrialFacts, seen: SeenWhisk, felt: FeltWhisk, alpha_felt: Value) -> WhiskAlphas:
    """Return the friction angles of one whisk, of which that felt is given."""
    beta, beta_from = _slope(trial, seen)
    phases = NO_PHASES
    if slips(seen):
        phases = seen_phases(seen.frames, beta.value, seen.d_x_mm.value)
    return WhiskAlphas(
        trial.name,
        seen.whisk,
        *trial.panel,
        beta_rad=beta.value,
        seen=seen.friction_rad,
        felt=alpha_felt,
        phases_seen=phases,
        phases_felt=felt.phases,
        shared_seen_rad=beta.sigma,
        shared_felt_rad=math.hypot(beta.sigma, felt.phi_felt_rad.sigma),
        beta_from=beta_from,
        common_seen=_common_seen(seen),
        common_felt=_common_felt(seen, felt),
    )


def _slope(trial: TrialFacts, seen: SeenWhisk) -> tuple[Value, str]:
    """Return the slope β, rad, as seen or else as the manifest states it, and which of both it is."""
    if seen.beta_rad.is_known:
        return seen.beta_rad, seen.source
    stated_rad = math.radians(trial.beta_nominal_deg)
    return Value(stated_rad, trial.beta_nominal_sigma_rad), BY_MANIFEST


def _common_slope(seen: SeenWhisk, by_cameras: np.ndarray) -> float:
    """Return the part of β's sigma that all whisks share beyond that by the cameras (k,), rad; of a slope set by hand
    none.

    How it goes with the sign of the slope is not known, so that it counts as one for all whisks.
    """
    if not seen.beta_rad.is_known:
        return 0.0
    shared = seen.truth.shared
    sigma_rad = seen.beta_rad.sigma if shared is None else shared.beta_rad
    return sigma_without(sigma_rad, by_cameras)


def _common_seen(seen: SeenWhisk) -> tuple[float, ...]:
    """Return the change of α seen by each cause that all whisks share, rad: of β, of all else, of each unit error of
    the cameras.

    Where it is not known how the cameras' errors change α, what they change β by counts as of β. Of all else it is the
    share that the sigma of slip has; where that is not known, all of it.
    """
    by_cameras = seen.friction_by_camera_error_rad
    slope_by_cameras = seen.beta_by_camera_error_rad if len(by_cameras) else np.zeros(0)
    sigma_rad = sigma_without(np.nan_to_num(seen.friction_rad.sigma), by_cameras)
    of_slope_rad = sigma_without(seen.beta_rad.sigma, slope_by_cameras)
    other_rad = sigma_without(sigma_rad, np.array([of_slope_rad]))
    if seen.at is not None and np.isfinite(seen.at.slip_shared_mm):
        other_rad *= min(seen.at.slip_shared_mm / seen.at.slip_mm.sigma, 1.0)
    return (_common_slope(seen, slope_by_cameras), other_rad, *by_cameras.tolist())


def _common_felt(seen: SeenWhisk, felt: FeltWhisk) -> tuple[float, ...]:
    """Return the change of |β| − |φ| by each cause that all whisks share, rad: of β, of the moments, of β by each unit
    error of the cameras.
    """
    m_y = felt.m_y_Nmm.value
    m_z = felt.m_z_Nmm.value
    by_cause = felt.shared_Nmm.reshape(-1, 2) @ [m_z, -m_y] / (m_y**2 + m_z**2)
    by_moments = -np.copysign(1.0, felt.phi_felt_rad.value) * by_cause
    slope_by_cameras = seen.beta_by_camera_error_rad
    by_cameras = np.copysign(1.0, seen.beta_rad.value) * slope_by_cameras
    common_slope_rad = _common_slope(seen, slope_by_cameras)
    return (common_slope_rad, *by_moments.tolist(), *by_cameras.tolist())


def felt_friction(seen: SeenWhisk, felt: FeltWhisk, theta_rad: float, left: float) -> Value:
    """Return α, rad, by |β| − |φ|: the slope as seen, the slip angle by the moments at θ.

    left: share of the base's diameter that the whisker has at the contact. Of a whisk that was seen to
    slip; NaN where the moments are not those of the seen shape, the slope at θ is not that at touch, or
    nothing is left of the whisker. Where the truth is a stage's a slip angle that is not 0 for sure
    shows the slip: the force on a contact at rest points along the push.
    """
    if not left > 0:
        return UNKNOWN
    beta = seen.beta_rad
    phi = felt.phi_felt_rad
    sigma_rad = math.hypot(beta.sigma, phi.sigma)
    across_rad = abs(beta.value) - abs(phi.value) + _turn_of_force(seen, felt, theta_rad, left)
    if seen.deflection is None and seen.has_truth:
        if felt.apart or not abs(phi.value) > _SURE_SIGMAS * phi.sigma:
            return UNKNOWN
        return Value(across_rad, sigma_rad)
    if not (slips(seen) and phi.is_known) or felt.apart or turns_with_slip(seen):
        return UNKNOWN
    alpha = np.arctan(np.tan(across_rad) / np.cos(heading(seen.deflection, theta_rad)))
    return Value(float(alpha), sigma_rad)


def _turn_of_force(seen: SeenWhisk, felt: FeltWhisk, theta_rad: float, left: float) -> float:
    """Return by how much |φ| has grown up to θ, rad: the bent whisker turns the bar's normal, and along a bar that
    leans by ψ the contact moves along the whisker.

    To second order in θ (`bench.analyses.direction`), and in θ ψ (docs/maps.md), each the more the thinner
    the whisker is at the contact.
    """
    slope_rad = abs(seen.beta_rad.value)
    phi_rad = abs(felt.phi_felt_rad.value)
    across_rad = np.array([slope_rad - phi_rad])
    turned_rad = slip_angle(np.array([theta_rad]), slope_rad, across_rad, left)[0] - phi_rad
    lean = np.sign(seen.beta_rad.value) * np.tan(np.nan_to_num(seen.psi_rad.value))
    return float(turned_rad + 0.5 * theta_rad * np.cos(slope_rad) * lean / left)


def mean_alpha(alphas: Iterable[WhiskAlphas], name: str) -> Value:
    """Return the mean of an angle (`WhiskAlphas.angle`) over whisks, rad.

    NaN where no whisk has it.
    """
    mean = Measurements.of((whisk.trial, whisk.measurement(name)) for whisk in alphas).mean()
    return Value(mean.value, mean.sigma)
