"""The truth by a stage: distance and slope as stated, with what is each trial's own and what is shared.

d_x is what an estimator estimates: the distance from the base to the contact at first touch, on the
whisker's centreline. Either it is stated as it is (`d_x_mm`), or it follows from the object's place
(`[object]`, `stage.csv`). When the whisker touches by the motor's angle is known no better than how
it is clamped, and no stage sees how the contact slips: touch, slip and deflection stay NaN. Over the
whisks of a session that angle is held against touch felt, and d_x against the moments
(`bench.trials.stage_against_felt`).
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.base.statuses import reason
from bench.records.trial_result import (
    BY_STAGE,
    PicturedContact,
    SeenTrial,
    SeenWhisk,
    StageContact,
)
from bench.session.file_names import TRIAL_TOML
from bench.session.session import Session
from bench.session.signals import Signals, forward_strokes
from bench.session.trial import Trial
from bench.trials.consistency import check_slope, nominal_slope
from bench.trials.differences import agree
from bench.trials.stage_contact import REST_TERMS, SLOPE, Contact, Offsets, StatedPush, X
from bench.trials.stated_length import unit_within
from bench.trials.stated_stroke import StatedStroke
from vision import NAN, UNKNOWN, SharedSigmas, TruthAtAngle, Value, WhiskTruth
from vision.geometry import NO_REASON, Axis, Reason, Refused, joined

NOT_SEEN = reason("slip_not_seen")
# [mm] One sigma of a stated distance without one: a ruler's. Stated.
_RULER_MM = 0.5
# [mm] Least sigma of a place that is stated as exact. Derived.
_EXACT_MM = 1e-3
# [rad] Likewise of a direction. Derived.
_EXACT_RAD = 1e-4
# Steps of derivatives: mm, rad, mm, mm. What is left out is 1e-6 of them. Derived.
_STEPS = Offsets(np.full(3, 1e-3), 1e-4, 1e-4, 1e-3, np.full((2, REST_TERMS), 1e-3)).vector
_HOW = {
    "starts_touching": "touches before the stroke begins",
    "never_touches": "does not come to the object in this stroke",
}


@dataclass(frozen=True, eq=False)
class StatedWhisk:
    """A whisk as a stage states it. contact: None where nothing is stated, or the whisker does not come to the object."""

    truth: WhiskTruth
    contact: StageContact | None = None


def by_stage(
    session: Session, trial: Trial, signals: Signals, settings: Settings, seen: SeenTrial
) -> SeenTrial:
    """Return a trial's whisks with the truth that its stage states, compared with what is seen.

    seen: what the cameras show. Raises BadInput where no such contact can be.
    """
    strokes = forward_strokes(signals)
    whisks = []
    for whisk, stroke in zip(seen.whisks, strokes):
        stated = stated_whisk(session, trial, signals, stroke)
        with_stated = _with_stated(whisk, stated.truth, settings)
        whisks.append(replace(with_stated, stage_contact=stated.contact))
    return replace(seen, whisks=tuple(whisks))


def _with_stated(seen: SeenWhisk, stated: WhiskTruth, settings: Settings) -> SeenWhisk:
    """Return a whisk with the stage's distance and slope; touch, slip and bend are those seen."""
    truth = replace(
        seen.truth,
        d_x_mm=stated.d_x_mm,
        beta_rad=stated.beta_rad,
        psi_rad=stated.psi_rad,
        shared=_shared(seen, stated),
        budget={},
        status=stated.status,
    )
    whisk = replace(seen, truth=truth, source=BY_STAGE)
    if not seen.has_truth:
        at = TruthAtAngle(theta_rad=settings.theta_rad, status=_why_not_seen(seen))
        return replace(whisk, at=at, status=joined(stated.status, at.status))
    pictured = PicturedContact(seen.d_x_mm, seen.beta_rad)
    whisk = replace(whisk, pictured=pictured, status=joined(seen.status, stated.status))
    return whisk.with_contradiction(_unlike_pictures(stated, seen))


def _shared(seen: SeenWhisk, stated: WhiskTruth) -> SharedSigmas | None:
    """Return what all whisks share: of d_x and slopes by the stage, of touch and contact by the cameras."""
    if seen.truth.shared is None or stated.shared is None:
        return stated.shared
    return replace(
        stated.shared,
        touch_rad=seen.truth.shared.touch_rad,
        point_mm=seen.truth.shared.point_mm,
    )


def _why_not_seen(seen: SeenWhisk) -> Reason:
    """Return why slip and deflection are not known."""
    if set(seen.status.codes) <= {"no_pictures"}:
        return NOT_SEEN
    return Reason(NOT_SEEN.codes[0], f"{NOT_SEEN}, nor do the pictures show it: {seen.status}")


def _unlike_pictures(stated: WhiskTruth, seen: SeenWhisk) -> Reason:
    """Return how the stage's distance contradicts the one seen; NO_REASON where chance explains it."""
    if agree(stated.d_x_mm, seen.d_x_mm):
        return NO_REASON
    apart_mm = stated.d_x_mm.value - seen.d_x_mm.value
    sigma_mm = math.hypot(stated.d_x_mm.sigma, seen.d_x_mm.sigma)
    found = f"d_x by the stage is {apart_mm:+.2f} ± {sigma_mm:.2f} mm from the one seen"
    cause = "check the stage's origin, whether the place is the object's middle, and T_rig_board"
    return Reason("stage_unlike_pictures", f"{found}: {cause}")


def _unlike_stated(d_x_mm: Value, trial: Trial) -> Reason:
    """Return how a distance by the object's place contradicts d_x_mm; NO_REASON where it does not."""
    if trial.d_x_mm is None:
        return NO_REASON
    stated = Value(trial.d_x_mm, trial.d_x_sigma_mm or _RULER_MM)
    if agree(d_x_mm, stated):
        return NO_REASON
    found = f"d_x by the object's place is {d_x_mm.value:.2f} mm, d_x_mm says {stated.value:g}"
    sigma = f"one sigma of both is {math.hypot(d_x_mm.sigma, stated.sigma):.2g} mm"
    rule = "d_x_mm goes from the base to the contact, the place to the bar's axis"
    return Reason("distance_unlike_stated", f"{found} ({sigma}): {rule}")


def _check_on_whisker(d_x_mm: float, session: Session, trial: Trial) -> None:
    """Raise BadInput for a stated distance that no contact on the whisker has."""
    length_mm = session.whisker.length_mm
    if d_x_mm > length_mm:
        found = f"d_x_mm is {d_x_mm:g}, beyond the whisker's length of {length_mm:g} mm"
        hint = _in_other_unit(d_x_mm, 1.0, length_mm)
        raise BadInput(f"{found}{hint}", file=trial.label(TRIAL_TOML))


def _check_place(push: StatedPush, trial: Trial) -> None:
    """Raise BadInput for an object that stands where no whisker of this length can touch it."""
    base_mm = push.from_base_mm()
    least_mm = push.object.radius_mm
    most_mm = push.wire.length_mm + least_mm
    if least_mm < base_mm <= most_mm:
        return
    is_near = base_mm <= least_mm
    found = f"the object's middle passes the whisker's base at {base_mm:.4g} mm"
    why = f"beyond the whisker's length of {push.wire.length_mm:g} mm"
    if is_near:
        why = f"nearer than its radius of {least_mm:g} mm"
    hint = _in_other_unit(base_mm, least_mm, most_mm)
    label = trial.label(TRIAL_TOML) if trial.stage is None else trial.stage.label
    raise BadInput(f"{found}, {why}{hint}", file=label)


def _in_other_unit(length: float, least_mm: float, most_mm: float) -> str:
    """Return '. Is it in metres?' where a length would be on the whisker in another unit, or ''."""
    name = unit_within(length, least_mm, most_mm)
    return f". Is it in {name}?" if name else ""


def stated_whisk(session: Session, trial: Trial, signals: Signals, stroke: slice) -> StatedWhisk:
    """Return one stroke as the stage states it; with a status where it states no truth.

    Raises BadInput for a distance beyond the whisker, or a place where no bar can be touched.
    """
    if trial.states_place:
        return _by_place(StatedStroke(session, trial, signals, stroke))
    if trial.d_x_mm is None:
        return StatedWhisk(WhiskTruth(0, status=reason("stage_says_nothing")))
    _check_on_whisker(trial.d_x_mm, session, trial)
    slope = nominal_slope(trial)
    tilt = Value(0.0, slope.sigma) if slope.is_known else UNKNOWN
    shared_mm = session.truth.origin_sigma_mm
    sigma_mm = math.hypot(trial.d_x_sigma_mm, shared_mm)
    truth = _truth(Value(trial.d_x_mm, sigma_mm), slope, tilt, shared_mm)
    return StatedWhisk(truth, _by_distance(trial, slope.sigma, shared_mm))


def _by_distance(trial: Trial, slope_sigma_rad: float, shared_mm: float) -> StageContact:
    """Return the contact of a stated distance and slope. shared_mm: the origin's sigma."""
    by_offset = np.zeros((3, len(_STEPS)))  # of motor angle, d_x and slope
    by_offset[1, X] = 1.0
    by_offset[2, SLOPE] = 1.0
    own = trial.d_x_sigma_mm * by_offset[1] + slope_sigma_rad * by_offset[2]
    stands = trial.is_bar and trial.object_stands
    return StageContact(NAN, by_offset, own, shared_mm * by_offset[1], stands)


def _truth(d_x_mm: Value, beta_rad: Value, psi_rad: Value, shared_mm: float) -> WhiskTruth:
    """Return a truth by its numbers; shared_mm: the part of d_x's sigma that all whisks share."""
    shared = SharedSigmas(NAN, shared_mm, 0.0, 0.0, np.full(3, NAN))
    return WhiskTruth(0, d_x_mm=d_x_mm, beta_rad=beta_rad, psi_rad=psi_rad, shared=shared)


def _by_place(stroke: StatedStroke) -> StatedWhisk:
    """Return the truth of a stroke against an object that stands where the stage has it."""
    trial = stroke.trial
    push = stroke.push()
    touch = push.touch(Offsets.none())
    if touch is None:
        return StatedWhisk(_without_touch(push, trial))
    by_offset = _derivatives(push, touch)  # (4, p)
    own = stroke.own_sigmas(touch)
    shared = stroke.shared_sigmas(touch)
    own_sigma = np.linalg.norm(by_offset * own, axis=1)  # (4,)
    shared_sigma = np.linalg.norm(by_offset * shared, axis=1)
    _, *sigmas = np.hypot(own_sigma, shared_sigma).tolist()
    numbers = (touch.d_x_mm, touch.beta_rad, touch.psi_rad)
    d_x_mm, beta_rad, psi_rad = map(Value, numbers, sigmas)
    truth = _truth(d_x_mm, beta_rad, psi_rad, float(shared_sigma[1]))
    slope = check_slope(beta_rad, trial, "by the object's place is", "check both")
    status = joined(_unlike_stated(d_x_mm, trial), slope)
    stands = trial.is_bar and trial.object_stands
    contact = StageContact(touch.motor_rad, by_offset[:3], own, shared, stands)
    return StatedWhisk(replace(truth, status=status), contact)


def stated_place(session: Session, trial: Trial, signals: Signals) -> tuple[Axis, np.ndarray]:
    """Return where the stage has the bar, in the base's frame, and sigmas (4,): of two shifts, mm, and two tilts, rad.

    Raises BadInput where no such place can be, Refused where no stroke comes to touch it there.
    """
    for rows in forward_strokes(signals):
        stroke = StatedStroke(session, trial, signals, rows)
        push = stroke.push()
        touch = push.touch(Offsets.none())
        if touch is None:
            _check_place(push, trial)
            continue
        own = Offsets.from_vector(stroke.own_sigmas(touch))
        shared = Offsets.from_vector(stroke.shared_sigmas(touch))
        shift_mm = np.hypot(own.place_mm, shared.place_mm).max()
        turn_rad = np.hypot(own.slope_rad, shared.slope_rad)
        sigma = np.repeat([max(shift_mm, _EXACT_MM), max(turn_rad, _EXACT_RAD)], 2)
        return push.standing_in_rig(touch.motor_rad).upward(), sigma
    raise Refused("by the stage no stroke comes to touch the object", code="never_touches")


def _without_touch(push: StatedPush, trial: Trial) -> WhiskTruth:
    """Return the truth of a stroke that does not come to touch the object. Raise BadInput where none could."""
    _check_place(push, trial)
    code = "starts_touching" if push.starts_touching(Offsets.none()) else "never_touches"
    return WhiskTruth(0, status=Reason(code, f"by the stage the whisker {_HOW[code]}"))


def _derivatives(push: StatedPush, touch: Contact) -> np.ndarray:
    """Return the derivatives (4, p) of motor angle, d_x, β and ψ by all offsets; NaN where no touch is left."""
    rows = []
    for k, step in enumerate(_STEPS):
        ends = []
        for sign in (1.0, -1.0):
            moved = np.zeros(len(_STEPS))
            moved[k] = sign * step
            at = push.moved_touch(touch, Offsets.from_vector(moved))
            numbers = None if at is None else [at.motor_rad, at.d_x_mm, at.beta_rad, at.psi_rad]
            ends.append(numbers or [NAN] * 4)
        rows.append((np.array(ends[0]) - np.array(ends[1])) / (2.0 * step))
    return np.stack(rows, axis=-1)
