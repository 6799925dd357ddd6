"""The seen half of a trial's result: pictures in, truth out. No gauge is read here."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from bench.base.input_problems import in_one_status
from bench.base.numbers import first_names
from bench.base.settings import Seeing, Settings
from bench.base.statuses import reason
from bench.gauges.felt import motor_speed
from bench.records.trial_result import (
    BackStroke,
    BarLine,
    Clock,
    Deflection,
    Drawing,
    SeenTrial,
    SeenWhisk,
)
from bench.session.angle_source import angle_source
from bench.session.frame_times import FrameTimes, dropped
from bench.session.session import Session
from bench.session.signals import forward_strokes
from bench.session.trial import Trial
from bench.trials.consistency import (
    check_bar_width,
    check_camera_delays,
    check_friction_cone,
    check_length,
    check_slope,
    check_turns,
    check_wire_width,
)
from bench.trials.one_camera import by_one_camera
from bench.trials.seeing import presets_for
from bench.trials.seen_friction import with_seen_friction
from bench.trials.trace_frames import traced_frames
from bench.trials.trial_frames import TrialFrames, TrialInputs
from vision import FrameTruth, KeptFit, Smooth, TrialTruth, Value, WhiskTruth
from vision.geometry import Reason, Refused, joined, spread
from vision.pictures import Others

NO_PICTURES = reason("no_pictures")
NO_ZERO = reason("motor_zero_unknown")
# [frames] Of a whisk, kept with their joint covariance. Stated.
_MOST_DEFLECTIONS = 12
# [frames] In a line. A layout.
_MOST_NAMED = 5
# [1] Of the contact's distance along the wire: a place that is known worse gives no moment. At this one
# the second order of a moment is 1 %, its sigma 2 to 10 %. Derived.
_MOST_PLACE_SHARE = 0.05
# [1] Of that distance: farther across no rod is bent by a push. Stated.
_MOST_ACROSS_SHARE = 0.5

# The truth of a whisk, and the name of the preset or file with whose settings it was found.
Evaluated = tuple[str, WhiskTruth]


def see_trial(
    inputs: TrialInputs,
    wires: Mapping[str, Others] | None = None,
    fits: Sequence[KeptFit] = (),
) -> SeenTrial:
    """Return the whisks of a trial as the cameras show them.

    wires: by camera and name, the wires of an array's whiskers. fits: see `TrialFrames.read`. A trial that cannot be evaluated
    has whisks whose status says why.
    """
    trial = inputs.trial
    count = len(forward_strokes(inputs.signals))
    if not trial.is_seen or inputs.calibration.cameras is None:
        return unseen(count, NO_PICTURES)
    if not angle_source(trial).has_zero:
        return unseen(count, NO_ZERO)
    try:
        if trial.is_traced_alone:
            return _see(traced_frames(inputs))
        return _see(TrialFrames.read(inputs, wires or {}, fits))
    except Refused as refusal:
        return unseen(count, refusal.reason)


def unseen(count: int, status: Reason) -> SeenTrial:
    """Return a trial whose whisks have no truth, and why."""
    return SeenTrial(tuple(SeenWhisk(WhiskTruth(number), status) for number in range(count)))


def _see(frames: TrialFrames) -> SeenTrial:
    """Evaluate the pictures of a trial. Raise Refused where they do not suffice."""
    inputs = frames.inputs
    trial = inputs.trial
    clock = _clock(frames.times, inputs.settings)
    truth, whisks = _observe(frames, clock.sigma_s)
    late = check_camera_delays(whisk.delays for whisk in truth.whisks)
    of_trial = [*_contradicted_diameters(truth, inputs.session, trial), late]
    back = dict(zip(frames.back, truth.whisks[len(whisks) :]))
    ways_back = ()
    if trial.both_ways:
        ways_back = _ways_back(back, len(whisks), inputs.settings, late)
    damaged = _damaged_frames(frames.by_camera, frames.times)
    return SeenTrial(
        tuple(_records(frames, whisks, of_trial)),
        notes=_notes(frames),
        damaged=in_one_status(*damaged, *frames.scene.unusable),
        bar=BarLine(truth.bar_point_mm, truth.bar_direction),
        bar_radius_mm=0.5 * trial.bar_diameter_mm,
        wire_radius_mm=0.5 * frames.rods.wire.diameter_mm,
        clock=clock,
        bar_looks=truth.bar_widths,
        one_sided_light=truth.one_sided_light,
        back=_back_stroke(back.get(0)),
        ways_back=ways_back,
        fits=truth.fits,
    )


def _records(
    frames: TrialFrames, whisks: Sequence[Evaluated], of_trial: Sequence[Reason]
) -> Iterator[SeenWhisk]:
    """Yield the records of whisks. of_trial: contradictions of the trial as a whole."""
    ends = next((whisk.ends for _, whisk in whisks if whisk.ends), {})
    too_short = check_length(ends, frames.inputs.session.whisker)
    warnings = [*frames.scene.left_out.values(), too_short]
    for name, whisk in whisks:
        whisk = _with_angles_sigma(whisk, frames.motor_sigma_rad)
        if whisk.status:  # what the missing frames may have cost comes with their cause
            whisk = replace(whisk, status=joined(*frames.scene.unusable, whisk.status))
        record = _whisk_of_trial(frames.inputs, whisk, warnings, of_trial)
        yield replace(record, looked=name)


def _with_angles_sigma(whisk: WhiskTruth, sigma_rad: np.ndarray) -> WhiskTruth:
    """Return a whisk whose turns are as uncertain as pictures and motor angles are, (frames,) rad."""
    if whisk.turns is None:
        return whisk
    of_angles = np.diag(sigma_rad[whisk.turns.index] ** 2)
    turns = replace(whisk.turns, covariance=whisk.turns.covariance + of_angles)
    return replace(whisk, turns=turns)


def _whisk_of_trial(
    inputs: TrialInputs,
    whisk: WhiskTruth,
    warnings: Iterable[Reason],
    of_trial: Iterable[Reason],
) -> SeenWhisk:
    """Return the record of a whisk, with what contradicts it and what one camera alone sees.

    warnings: of the recording. of_trial: contradictions of the trial as a whole.
    """
    trial = inputs.trial
    settings = inputs.settings
    whisker = inputs.session.whisker
    contradictions = [*of_trial, *_whisk_contradictions(whisk, trial, settings)]
    speed_rad_s = None if trial.speed_deg_s is None else math.radians(trial.speed_deg_s)
    record = whisk_record(whisk, settings, warnings, contradictions, speed_rad_s)
    record = replace(record, by_one_camera=by_one_camera(whisk, whisker, settings))
    return with_seen_friction(record, whisker)


def _notes(frames: TrialFrames) -> tuple[str, ...]:
    """Return the notes of a trial: on missing frames, on what was left out, on the scene, and on
    whose lines of the wire its truth rests.
    """
    missing = _missing_frames(frames.by_camera, frames.times)
    lost = dropped(frames.times, frames.places)
    traced = ", ".join(frames.pictures.traces)
    alone = "" if frames.by_camera else ", and no picture was read"
    others = [f"the wire's lines are another program's ({traced}){alone}"] if traced else []
    return (*missing, *lost, *frames.scene.notes, *others, *frames.notes)


def _clock(times: FrameTimes, settings: Settings) -> Clock:
    """Return how well the frames' clock is known: as the settings state it, or by where times come from."""
    sigma_s = settings.clock_sigma_s
    if sigma_s is None:
        sigma_s = times.clock_sigma_s
    return Clock(times.source, sigma_s, times.clock_sigma_s == 0.0)


def _observe(frames: TrialFrames, clock_sigma_s: float) -> tuple[TrialTruth, list[Evaluated]]:
    """Return the truth of the trial by the first preset, and its forward whisks, each by the first
    preset that reaches the accuracy.
    """
    cameras = frames.inputs.calibration.cameras
    settings = frames.inputs.settings
    observe = partial(frames.observe, frames.pictures, cameras=cameras, rods=frames.rods)
    presets = []
    for preset in presets_for(settings):
        presets.append(preset.with_vision(clock_sigma_s=clock_sigma_s))
    first, *finer = presets
    truth = observe(whisks=[*frames.places, *frames.back.values()], settings=first.vision)
    whisks = [(first.name, whisk) for whisk in truth.whisks[: len(frames.places)]]
    for preset in finer:
        whisks = _refine(observe, frames.places, whisks, preset, settings.accuracy_mm)
    return truth, whisks


def _contradicted_diameters(truth: TrialTruth, session: Session, trial: Trial) -> list[Reason]:
    """Return how the pictures contradict the stated diameters of bar and whisker."""
    wire_looks = next((whisk.widths for whisk in truth.whisks if whisk.widths), {})
    return [
        check_bar_width(truth.bar_widths, trial, session.board),
        check_wire_width(wire_looks, session.whisker),
    ]


def _whisk_contradictions(truth: WhiskTruth, trial: Trial, settings: Settings) -> list[Reason]:
    """Return how a whisk contradicts the stated slope, or friction."""
    deflected = truth.at(settings.theta_rad).phi_rad
    return [
        check_slope(truth.beta_rad, trial),
        check_friction_cone(deflected, truth.beta_rad, "seen"),
    ]


def _refine(
    observe: Callable[..., TrialTruth],
    places: Sequence[slice],
    whisks: Sequence[Evaluated],
    preset: Seeing,
    accuracy_mm: float,
) -> list[Evaluated]:
    """Evaluate those whisks anew whose distance has a larger sigma than wanted, by a finer preset.

    A whisk that has no truth by that preset keeps the one it has.
    """
    refined = list(whisks)
    coarse = [k for k, (_, whisk) in enumerate(whisks) if not whisk.d_x_mm.sigma <= accuracy_mm]
    if not coarse:
        return refined
    truth = observe(whisks=[places[k] for k in coarse], settings=preset.vision)
    for k, whisk in zip(coarse, truth.whisks):
        if whisk.d_x_mm.is_known:
            refined[k] = preset.name, replace(whisk, whisk=k)
    return refined


def _ways_back(
    truths: Mapping[int, WhiskTruth], count: int, settings: Settings, late: Reason
) -> tuple[SeenWhisk, ...]:
    """Return the record of each whisk's way back, from truths by the number of the whisk.

    late: that a camera's frames are late in the trial.
    """
    seen = list(unseen(count, NO_PICTURES).whisks)
    for k, truth in truths.items():
        seen[k] = whisk_record(replace(truth, whisk=k), settings, contradictions=[late])
    return tuple(seen)


def _back_stroke(truth: WhiskTruth | None) -> BackStroke | None:
    """Return touch and speed of a back stroke; None where there is none or it has no truth."""
    if truth is None or not truth.touch_rad.is_known:
        return None
    return BackStroke(truth.touch_rad, motor_speed(truth.frames))


def _missing_frames(frames: Mapping[str, Mapping], times: FrameTimes) -> Iterator[str]:
    """Yield a line on the dropped frames of each camera that has some."""
    count = len(times)
    for name in frames:
        is_recorded = times.picture[name] >= 0
        lost = int(np.sum(~is_recorded))
        if lost:
            yield f"camera {name} dropped {lost} of {count} frames"


def _damaged_frames(frames: Mapping[str, Mapping], times: FrameTimes) -> Iterator[Reason]:
    """Yield a status of the damaged frames of each camera that has some."""
    count = len(times)
    for name, pictures in frames.items():
        is_recorded = times.picture[name] >= 0
        damaged = [k for k in np.flatnonzero(is_recorded) if k not in pictures]
        if damaged:
            named = first_names(damaged, _MOST_NAMED)
            line = f"camera {name}: {len(damaged)} of {count} frames damaged ({named})"
            yield Reason("frames_damaged", line)


def whisk_record(
    truth: WhiskTruth,
    settings: Settings,
    warnings: Iterable[Reason] = (),
    contradictions: Iterable[Reason] = (),
    stated_speed_rad_s: float | None = None,
) -> SeenWhisk:
    """Return the record of a whisk, from the truth that vision found.

    stated_speed_rad_s: the motor's by trial.toml.
    contradictions: in what ways the recording disagrees with itself or with what is stated; such
    a whisk is marked. The record leaves out the fit itself, what the checks alone need, and
    the lines of all frames but two.
    """
    at = truth.at(settings.theta_rad)
    contradictions = list(contradictions)
    if truth.frames:
        contradictions.append(
            check_turns(truth.turns, motor_speed(truth.frames), stated_speed_rad_s)
        )
    return SeenWhisk(
        truth=replace(truth, overlay={}, ends={}, widths={}, delays={}, smooth=None, problem=None),
        status=in_one_status(truth.status, at.status, *contradictions, *warnings),
        at=at,
        deflection=_known_deflection(truth),
        overlay=_overlay(truth, at.theta_rad),
        contradicted=any(contradictions),
    )


def _known_deflection(truth: WhiskTruth) -> Deflection | None:
    """Return the deflection of a whisk with a truth, or of one whose wire alone shows it.

    How well slope, touch and slip are known does not matter to a moment; the contact's place along
    the wire and across it does.
    """
    d = _deflection(truth)
    if d is None or truth.d_x_mm.is_known:
        return d
    sigmas_mm = np.sqrt(np.diag(d.covariance)).reshape(-1, 3)
    across_mm = np.hypot(d.across_y_mm, d.across_z_mm)
    is_known = np.all(sigmas_mm < _MOST_PLACE_SHARE * d.along_mm[:, None])
    return d if is_known and np.all(across_mm < _MOST_ACROSS_SHARE * d.along_mm) else None


def _deflection(truth: WhiskTruth) -> Deflection | None:
    """Return the deflection in up to a dozen of the touching frames; None where none touches."""
    smooth = truth.smooth
    if smooth is None or len(smooth.theta_rad) == 0:
        return None
    chosen = np.array(spread(range(len(smooth.theta_rad)), _MOST_DEFLECTIONS))
    frames = truth.frames
    shown = np.flatnonzero(frames.touching)[chosen]
    motor = frames.motor_rad[shown]
    theta = smooth.theta_rad[chosen]
    touch = float(motor[0] - theta[0])
    rows = _by_parameter(smooth, chosen)
    return Deflection(
        theta_rad=theta,
        motor_rad=motor,
        slip_mm=smooth.values["slip"][chosen],
        slip_sigma_mm=frames.slip_mm.sigma[shown],
        along_mm=smooth.values["along"][chosen],
        across_y_mm=smooth.values["across_y"][chosen],
        across_z_mm=smooth.values["d_z"][chosen],
        past_mm=_along_unbent(frames, shown, touch) - smooth.d_x_mm - frames.arc_mm[shown],
        covariance=rows @ smooth.covariance @ rows.T,
        by_camera_error_mm=rows @ smooth.by_camera_error,
        touch_rad=Value(touch, float(frames.theta_rad.sigma[shown[0]])),
        d_x_mm=smooth.d_x_mm,
    )


def _along_unbent(frames: FrameTruth, shown: np.ndarray, touch_rad: float) -> np.ndarray:
    """Return how far along the whisker at first touch the contacts of the frames `shown` (n,) are, mm."""
    x, y, _ = frames.point_mm.value[shown].T
    return np.cos(touch_rad) * x + np.sin(touch_rad) * y


def _by_parameter(smooth: Smooth, chosen: np.ndarray) -> np.ndarray:
    """Return the derivatives (3n, p) of along_mm, across_z_mm and across_y_mm of n chosen frames."""
    names = ("along", "d_z", "across_y")
    jacobian = np.stack([smooth.jacobians[name][chosen] for name in names], axis=1)
    return jacobian.reshape(3 * len(chosen), -1)


def _overlay(truth: WhiskTruth, theta_rad: float) -> dict[str, Drawing]:
    """Return the lines of the frames nearest to touch and to the wanted angle."""
    if truth.frames is None or not truth.overlay:
        return {}
    index = truth.frames.index
    drawn = np.flatnonzero(np.isin(index, list(truth.overlay)))
    angles = truth.frames.theta_rad.value[drawn]
    overlay = {}
    for name, angle in (("touch", 0.0), ("theta", theta_rad)):
        frame = int(index[drawn[np.argmin(np.abs(angles - angle))]])
        overlay[name] = Drawing(frame, truth.overlay[frame])
    return overlay
