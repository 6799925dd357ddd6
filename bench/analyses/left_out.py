"""By how much truth, felt touch and estimate of a whisk would differ without one refinement of the model.

Effects on the truth are the fit's own answers (`vision.fit.refinements`); those on the estimate are made from the
moments once more, or are the closed forms of docs/maps.md, with slope, tilt and friction as seen.
"""

from dataclasses import dataclass, field

import numpy as np

from bench.analyses.alphas import felt_friction, seen_friction
from bench.analyses.runs import GIVEN, KINETIC
from bench.gauges.felt import motor_speed
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenWhisk, TrialResult
from bench.session.whisker import Whisker
from bench.trials.clocks import SharedTouch
from estimator import first_order
from vision.fit.refinements import ALONG, LENS_TERMS, LeftOut
from vision.truth.value import NAN

NAMES = (
    *("large bending", "bar radius", "psi", ALONG, "taper", "sag and set", *LENS_TERMS),
    *(
        "gauges' delay",
        "cross-talk",
        "drift",
        "one-sided light",
        "clock",
        "second friction coefficient",
    ),
)
# What each costs at most, percent of a whisk's processor time; 0 where it is below 0.1 (`tests/studies/speed/refinements.py`,
# two whisks and two gauge trials of fixtures/small-session).
COST_PERCENT = dict.fromkeys(NAMES, 0.0) | {
    **{"large bending": 0.7, "bar radius": 0.2, "psi": 0.6, "taper": 0.8, "sag and set": 2.3},
    **dict.fromkeys(LENS_TERMS, 1.8),
    **{"cross-talk": 0.8, "one-sided light": 0.3},
}
_NO_TRUTH, _NO_MOMENTS = "no truth", "no moments"


@dataclass(frozen=True)
class Felt:
    """By how much felt touch (rad) and d_x by (10) (mm) differ without a refinement; NaN where it is not known. why: of
    a zero or a NaN."""

    touch_rad: float = 0.0
    d_x_est_mm: float = 0.0
    why: str = ""


@dataclass(frozen=True)
class WhiskAtHand:
    """One whisk, and what (10) says of it: None without moments."""

    result: TrialResult
    seen: SeenWhisk
    felt: FeltWhisk
    whisker: Whisker
    shared: SharedTouch | None
    given: EstimateRow | None = field(init=False)

    def __post_init__(self):
        rows = (
            row
            for row in self.felt.estimates
            if row.estimator == GIVEN and np.isfinite(row.d_x_est_mm.value)
        )
        object.__setattr__(self, "given", next(rows, None))

    @property
    def alpha_rad(self) -> float:
        """Its friction angle, as well as it is known: as seen, as felt, as assumed."""
        known = (
            pair[0]
            for pair in (
                seen_friction(self.seen),
                felt_friction(self.seen, self.felt, self.theta_rad),
            )
        )
        assumed = self.given.alpha_est_rad if self.given else NAN
        return max(next((alpha for alpha in known if np.isfinite(alpha)), assumed), 0.0)

    @property
    def dragged(self) -> float:
        """Share of friction that is left to act along the whisker: 0 of a contact that slips to the side."""
        slope = abs(np.tan(self.seen.beta_rad.value)) / max(np.tan(self.alpha_rad), 1e-12)
        return float(np.sqrt(1.0 - slope**2)) if slope < 1 else 0.0

    @property
    def speed_rad_s(self) -> float:
        """Of the motor, by its frames; NaN where they do not say."""
        frames = self.seen.frames
        return motor_speed(frames) if frames is not None and len(frames.time_s) > 1 else NAN

    @property
    def theta_rad(self) -> float:
        """The wanted pushing angle."""
        return float(np.radians(self.result.theta_deg))

    @property
    def left(self) -> float:
        """Share of the base's diameter that is left at the contact."""
        return self.whisker.beam.left(self.given.d_x_est_mm.value)

    @property
    def phi_rad(self) -> float:
        """Direction of the force as felt; 0 of a contact that is held against slip."""
        return 0.0 if self.dragged else self.felt.phi_felt_rad.value


def of_truth(name: str, here: WhiskAtHand) -> LeftOut:
    """What the truth would differ by."""
    if not here.seen.has_truth:
        return LeftOut(NAN, NAN, NAN, _NO_TRUTH)
    if name == "clock":
        return _clock(here)
    if name not in here.seen.truth.refinements:
        in_vision = name in NAMES[: NAMES.index("gauges' delay")] or name == "one-sided light"
        return LeftOut(NAN, NAN, NAN, "the fit does not tell") if in_vision else LeftOut()
    return here.seen.truth.refinements[name]


def _clock(here: WhiskAtHand) -> LeftOut:
    if here.shared is None or not here.shared.tells_clock:
        return LeftOut(
            0.0, NAN, 0.0, "at one speed and in one direction a clock is not told from a zero"
        )
    late_s, sigma_s = here.shared.values[1], np.sqrt(here.shared.covariance[1, 1])
    why = f"felt − seen says {1e3 * late_s:+.2f} ± {1e3 * sigma_s:.2f} ms"
    return LeftOut(0.0, float(late_s) * here.speed_rad_s, 0.0, why)


def of_estimate(name: str, here: WhiskAtHand) -> Felt:
    """What felt touch and (10) would differ by."""
    if here.given is None:
        touch = (
            _delay(here).touch_rad if name == "gauges' delay" else NAN if name == "drift" else 0.0
        )
        return Felt(touch, NAN, here.felt.status or _NO_MOMENTS)
    made = {
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
    return made[name](here) if name in made else Felt()


def _large_bending(here: WhiskAtHand) -> Felt:
    size = here.theta_rad**2 / (6 * here.left)
    return Felt(
        0.0, size * here.given.d_x_est_mm.value, "of the estimate its size alone (docs/maps.md)"
    )


def _bar_radius(here: WhiskAtHand) -> Felt:
    reach = 0.5 * here.result.trial.bar_diameter_mm + 0.5 * here.whisker.diameter_mm * here.left
    d_x, known = here.given.d_x_est_mm.value, (here.phi_rad, here.alpha_rad)
    share = first_order.rolling(here.theta_rad, reach, *known, d_x, here.left)
    return _share(here, share, "no bar diameter or friction angle is known")


def _psi(here: WhiskAtHand) -> Felt:
    share = first_order.leaning(
        here.theta_rad, here.seen.psi_rad.value, here.phi_rad, here.alpha_rad
    )
    return _share(here, share, "no tilt is known")


def _along(here: WhiskAtHand) -> Felt:
    dragged = here.dragged if np.isfinite(here.seen.beta_rad.value) else NAN
    return _share(
        here, dragged * first_order.dragging(here.theta_rad, here.alpha_rad), "no slope is known"
    )


def _share(here: WhiskAtHand, share: float, unless: str) -> Felt:
    """An effect that is a share of d_x; why it is not known where it is not."""
    known = bool(np.isfinite(share))
    return Felt(0.0, float(share) * here.given.d_x_est_mm.value + 0.0, "" if known else unless)


def _taper(here: WhiskAtHand) -> Felt:
    d_x, beam = here.given.d_x_est_mm.value, here.whisker.beam
    return Felt(
        0.0,
        float(beam.as_cylinder_mm(d_x)) - d_x,
        "" if beam.taper else "the whisker does not taper",
    )


def _sag_and_set(_: WhiskAtHand) -> Felt:
    return Felt(
        why="of the estimate none to first order: moments above the free stroke's are those of the deflection"
    )


def _delay(here: WhiskAtHand) -> Felt:
    late = here.felt.delay_s.value * here.speed_rad_s
    unless = "" if np.isfinite(late) else "no speed is known"
    return Felt(late, 0.0, unless or "touch and moments are late alike")


def _cross_talk(here: WhiskAtHand) -> Felt:
    row = next((row for row in here.felt.one_factor if row.estimator == GIVEN), None)
    if row is None:
        return Felt(0.0, NAN, "no gauges with one factor a channel are known")
    return Felt(0.0, row.d_x_est_mm.value - here.given.d_x_est_mm.value, row.status)


def _drift(here: WhiskAtHand) -> Felt:
    drifted, touch = here.felt.with_drift, here.felt.touch_felt_rad.value
    if drifted is None:
        return Felt(why="no free stroke before and after the contact: none was taken out")
    return Felt(drifted.touch_felt_rad - touch, drifted.d_x_est_mm - here.given.d_x_est_mm.value)


def _kinetic(here: WhiskAtHand) -> Felt:
    row = next((row for row in here.felt.estimates if row.estimator == KINETIC), None)
    if row is None:
        return Felt(why="the moments show no stick–slip")
    return Felt(0.0, here.given.d_x_est_mm.value - row.d_x_est_mm.value, row.status)
