"""By how much truth, felt touch and estimate of a whisk would differ without one refinement of the model.

Effects on the truth are the fit's own sensitivities (`vision.fit.refinements`); those on the estimate are made from the
moments once more, or are the closed forms of docs/maps.md, with slope, tilt and friction as seen.
"""

from dataclasses import dataclass

import numpy as np

from bench.analyses.alphas import felt_friction
from bench.analyses.estimates_again import KINETIC
from bench.base.statuses import reason
from bench.gauges.felt import motor_speed
from bench.records.trial_result import (
    BY_STAGE,
    WITH_FRICTION,
    EstimateRow,
    FeltWhisk,
    SeenWhisk,
    TrialResult,
)
from bench.session.whisker import Whisker
from bench.trials.clocks import SharedTouch
from estimator import first_order
from vision import ALONG, LENS_TERMS, NAN, LeftOut

NAMES = (
    "large bending",
    "bar radius",
    "psi",
    ALONG,
    "taper",
    "sag and set",
    *LENS_TERMS,
    "gauges' delay",
    "cross-talk",
    "drift",
    "one-sided light",
    "clock",
    "second friction coefficient",
)
# Refinements of the fit to the pictures; the others change no picture's model.
_IN_VISION = (*NAMES[: NAMES.index("gauges' delay")], "one-sided light")


@dataclass(frozen=True)
class EstimateEffect:
    """By how much felt touch and d_x by (10) differ without a refinement; NaN where not known.

    why: the reason of a zero or a NaN.
    """

    touch_rad: float = 0.0
    d_x_est_mm: float = 0.0
    why: str = ""


@dataclass(frozen=True)
class WhiskModel:
    """One whisk, and what the closed forms of its errors need.

    shared: the error of touch that all whisks have in common; None where it is not known.
    """

    result: TrialResult
    seen: SeenWhisk
    felt: FeltWhisk
    whisker: Whisker
    shared: SharedTouch | None

    @property
    def given(self) -> EstimateRow | None:
        """Return the estimate by (10) with α_est as given; None without moments."""
        row = self.felt.estimate(WITH_FRICTION)
        return row if row is not None and row.d_x_est_mm.is_known else None

    @property
    def d_x_est_mm(self) -> float:
        """Return the distance by (10)."""
        return self.given.d_x_est_mm.value

    @property
    def alpha_rad(self) -> float:
        """Return its friction angle, as well as it is known: as seen, as felt, as assumed."""
        left = self.whisker.beam.thickness(self.seen.d_x_mm.value)
        felt = felt_friction(self.seen, self.felt, self.result.theta_rad, left)
        assumed = self.given.alpha_est_rad if self.given else NAN
        for alpha in (self.seen.friction_rad, felt):
            if alpha.is_known:
                return max(alpha.value, 0.0)
        return max(assumed, 0.0)

    @property
    def dragged(self) -> float:
        """Return the share of friction that is left to act along the whisker.

        It is 0 of a contact that slips to the side.
        """
        slope = abs(np.tan(self.seen.beta_rad.value)) / max(np.tan(self.alpha_rad), 1e-12)
        return float(np.sqrt(1.0 - slope**2)) if slope < 1 else 0.0

    @property
    def speed_rad_s(self) -> float:
        """Return the motor's speed by its frames; NaN where they do not show it."""
        frames = self.seen.frames
        return motor_speed(frames) if frames is not None and len(frames.time_s) > 1 else NAN

    @property
    def left(self) -> float:
        """Return the share of the base's diameter that is left at the contact."""
        return self.whisker.beam.thickness(self.d_x_est_mm)

    @property
    def phi_rad(self) -> float:
        """Return the direction of the force as felt; 0 of a contact that is held against slip."""
        return 0.0 if self.dragged else self.felt.phi_felt_rad.value


def effect_on_truth(name: str, model: WhiskModel) -> LeftOut:
    """Return by how much the truth would differ without a refinement."""
    if not model.seen.has_truth:
        return LeftOut(NAN, NAN, NAN, reason("no_truth"))
    if model.seen.source == BY_STAGE:
        return LeftOut(why=reason("stage_fits_nothing"))
    if name == "clock":
        return _effect_of_clock(model)
    if name in model.seen.truth.refinements:
        return model.seen.truth.refinements[name]
    return LeftOut(NAN, NAN, NAN, reason("effect_not_fitted")) if name in _IN_VISION else LeftOut()


def _effect_of_clock(model: WhiskModel) -> LeftOut:
    """Return the effect of the error of the frames' clock, as felt − seen shows it."""
    shared = model.shared
    if shared is None or not shared.separates_clock:
        return LeftOut(0.0, NAN, 0.0, reason("clock_like_zero"))
    late_s = shared.values[1]
    sigma_s = np.sqrt(shared.covariance[1, 1])
    why = f"felt − seen says {1e3 * late_s:+.2f} ± {1e3 * sigma_s:.2f} ms"
    return LeftOut(0.0, float(late_s) * model.speed_rad_s, 0.0, why)


def effect_on_estimate(name: str, model: WhiskModel) -> EstimateEffect:
    """Return by how much felt touch and (10) would differ without a refinement."""
    if model.given is None:
        touch_rad = 0.0
        if name == "gauges' delay":
            touch_rad = _delay(model).touch_rad
        elif name == "drift":
            touch_rad = NAN
        return EstimateEffect(touch_rad, NAN, model.felt.status or "no moments")
    effect = _EFFECTS.get(name)
    return EstimateEffect() if effect is None else effect(model)


def _large_bending(model: WhiskModel) -> EstimateEffect:
    size = model.result.theta_rad**2 / (6 * model.left)
    why = "of the estimate its size alone (docs/maps.md)"
    return EstimateEffect(0.0, size * model.d_x_est_mm, why)


def _bar_radius(model: WhiskModel) -> EstimateEffect:
    reach_mm = model.result.reach_mm(model.d_x_est_mm)
    share = first_order.rolling(
        model.result.theta_rad,
        reach_mm,
        model.phi_rad,
        model.alpha_rad,
        model.d_x_est_mm,
        model.left,
    )
    return _share_of_distance(model, share, reason("bar_radius_unknown"))


def _psi(model: WhiskModel) -> EstimateEffect:
    psi_rad = model.seen.psi_rad.value
    share = first_order.leaning(model.result.theta_rad, psi_rad, model.phi_rad, model.alpha_rad)
    return _share_of_distance(model, share, reason("tilt_unknown"))


def _along(model: WhiskModel) -> EstimateEffect:
    dragged = model.dragged if model.seen.beta_rad.is_known else NAN
    share = dragged * first_order.dragging(model.result.theta_rad, model.alpha_rad)
    return _share_of_distance(model, share, reason("slope_unknown"))


def _share_of_distance(model: WhiskModel, share: float, unless: str) -> EstimateEffect:
    """Return an effect that is a share of d_x; `unless` is the reason where it is not known."""
    why = "" if np.isfinite(share) else unless
    return EstimateEffect(0.0, float(share) * model.d_x_est_mm + 0.0, why)


def _taper(model: WhiskModel) -> EstimateEffect:
    beam = model.whisker.beam
    change_mm = float(beam.as_cylinder_mm(model.d_x_est_mm)) - model.d_x_est_mm
    return EstimateEffect(0.0, change_mm, "" if beam.taper else "the whisker does not taper")


def _sag_and_set(_: WhiskModel) -> EstimateEffect:
    why = "of the estimate none to first order: "
    why += "moments above the free stroke's are those of the deflection"
    return EstimateEffect(why=why)


def _delay(model: WhiskModel) -> EstimateEffect:
    late_rad = model.felt.delay_s.value * model.speed_rad_s
    known = "touch and moments are late alike"
    return EstimateEffect(late_rad, 0.0, known if np.isfinite(late_rad) else "no speed is known")


def _cross_talk(model: WhiskModel) -> EstimateEffect:
    for row in model.felt.one_factor:
        if row.estimator == WITH_FRICTION:
            return EstimateEffect(0.0, row.d_x_est_mm.value - model.d_x_est_mm, row.status)
    return EstimateEffect(0.0, NAN, reason("factors_unknown"))


def _drift(model: WhiskModel) -> EstimateEffect:
    drifted = model.felt.with_drift
    if drifted is None:
        return EstimateEffect(why=reason("drift_not_removed"))
    touch_rad = drifted.touch_felt_rad - model.felt.touch_felt_rad.value
    return EstimateEffect(touch_rad, drifted.d_x_est_mm - model.d_x_est_mm)


def _kinetic(model: WhiskModel) -> EstimateEffect:
    row = model.felt.estimate(KINETIC)
    if row is None:
        return EstimateEffect(why=reason("no_stick_slip"))
    return EstimateEffect(0.0, model.d_x_est_mm - row.d_x_est_mm.value, row.status)


# Refinements that change the estimate: how they do. All others leave it as it is.
_EFFECTS = {
    "large bending": _large_bending,
    "bar radius": _bar_radius,
    "psi": _psi,
    ALONG: _along,
    "taper": _taper,
    "sag and set": _sag_and_set,
    "gauges' delay": _delay,
    "cross-talk": _cross_talk,
    "drift": _drift,
    "second friction coefficient": _kinetic,
}
