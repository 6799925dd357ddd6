"""The seen half of a trial's result: pictures in, truth out. No gauge is read here."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, replace
from functools import partial

import numpy as np

from bench.base.doubts import in_one_status
from bench.base.settings import Settings
from bench.base.statuses import reason
from bench.cameras.session_cameras import SessionCalibration
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
from bench.session.frame_times import FrameTimes, dropped
from bench.session.session import Session
from bench.session.signals import Signals, forward_strokes
from bench.session.trial import Trial
from bench.trials.consistency import (
    cone_doubt,
    length_doubt,
    slope_doubt,
    turns_doubt,
    width_doubt,
    wire_doubt,
)
from bench.trials.one_camera import by_one_camera
from bench.trials.seeing import rungs
from bench.trials.trial_frames import Shown
from vision.geometry.reasons import NO_REASON, Reason
from vision.geometry.refusals import Refused
from vision.pictures.others import RodLines
from vision.truth.observe import observe_trial
from vision.truth.records import TrialTruth, WhiskTruth

NO_PICTURES = reason("no_pictures")
_MOST_DEFLECTIONS = 12  # frames of a whisk, kept with their joint covariance
_MOST_NAMED = 5  # frames in a line
_SAME = tuple(
    {f.name for f in fields(SeenWhisk)}
    & {f.name for f in fields(WhiskTruth)} - {"status", "overlay"}
)


def see_trial(
    session: Session,
    trial: Trial,
    signals: Signals,
    calibration: SessionCalibration,
    settings: Settings,
    wires: Mapping[str, Mapping[str, RodLines]] | None = None,
) -> SeenTrial:
    """Whisks of a trial as the cameras show them. wires: by camera, those of an array's whiskers by name.

    What keeps a trial from being seen is the status of its whisks; the others go on.
    """
    count = len(forward_strokes(signals))
    if not trial.camera_sources or calibration.cameras is None:
        return unseen(count, NO_PICTURES)
    try:
        shown = Shown.of(session, trial, signals, calibration, settings, wires or {})
        return _see(session, trial, shown, calibration, settings)
    except Refused as refusal:
        return unseen(count, refusal.reason)


def unseen(count: int, status: Reason) -> SeenTrial:
    """So many whisks without a truth, and why."""
    return SeenTrial(tuple(SeenWhisk(number, status) for number in range(count)))


def _see(
    session: Session,
    trial: Trial,
    shown: Shown,
    calibration: SessionCalibration,
    settings: Settings,
) -> SeenTrial:
    times, scene, places, back, rods = (
        shown.times,
        shown.scene,
        shown.places,
        shown.back,
        shown.rods,
    )
    clock_sigma_s = (
        times.clock_sigma_s if settings.clock_sigma_s is None else settings.clock_sigma_s
    )
    observe = partial(observe_trial, shown.pictures, cameras=calibration.cameras, rods=rods)
    first, *harder = [
        (one.name, replace(one.vision, clock_sigma_s=clock_sigma_s)) for one in rungs(settings)
    ]
    truth = observe(whisks=[*places, *back.values()], settings=first[1])
    looked = [(first[0], whisk) for whisk in truth.whisks[: len(places)]]
    for rung in harder:
        looked = _looked_harder(observe, places, looked, rung, settings.accuracy_mm)
    thick, left_out = width_doubt(truth.bar_looks, trial, session.board), scene.left_out.values()
    wide = wire_doubt(next((one.looks for one in truth.whisks if one.looks), {}), session.whisker)
    odd = [
        [
            thick,
            wide,
            length_doubt(one.ends, session.whisker),
            slope_doubt(one.beta_rad, trial),
            _leaning(one, settings),
        ]
        for _, one in looked
    ]
    whisks = (whisk_record(one, settings, left_out, what) for (_, one), what in zip(looked, odd))
    return SeenTrial(
        tuple(
            replace(whisk, looked=name, by_one_camera=by_one_camera(one, session.whisker, settings))
            for whisk, (name, one) in zip(whisks, looked)
        ),
        (*truth.notes, *_lost(shown.frames, times), *dropped(times, places), *scene.notes),
        BarLine(truth.bar_point_mm, truth.bar_direction),
        0.5 * trial.bar_diameter_mm,
        0.5 * rods.wire.diameter_mm,
        Clock(times.source, clock_sigma_s, times.clock_sigma_s == 0.0),
        truth.bar_looks,
        _touch_alone(truth.whisks[len(places)]) if 0 in back else None,
        _seen_back(dict(zip(back, truth.whisks[len(places) :])), len(places), settings)
        if trial.both_ways
        else (),
    )


def _leaning(truth: WhiskTruth, settings: Settings) -> Reason:
    return cone_doubt(truth.at(settings.theta_rad).phi_rad, truth.beta_rad, "seen")


def _looked_harder(
    observe: Callable[..., TrialTruth], places, looked, rung, accuracy_mm: float
) -> list:
    """Whisks with the name of what they were looked at by, those that are not known so well by another rung. What that
    does not see stays."""
    name, vision = rung
    left = [k for k, (_, whisk) in enumerate(looked) if not whisk.d_x_mm.sigma <= accuracy_mm]
    again = observe(whisks=[places[k] for k in left], settings=vision).whisks if left else ()
    better = {
        k: (name, replace(whisk, whisk=k))
        for k, whisk in zip(left, again)
        if np.isfinite(whisk.d_x_mm.value)
    }
    return [better.get(k, one) for k, one in enumerate(looked)]


def _seen_back(
    truths: dict[int, WhiskTruth], count: int, settings: Settings
) -> tuple[SeenWhisk, ...]:
    """The way back of each whisk, by the number of that."""
    seen = {k: whisk_record(replace(truth, whisk=k), settings) for k, truth in truths.items()}
    return tuple(seen.get(k, SeenWhisk(k, NO_PICTURES)) for k in range(count))


def _touch_alone(truth: WhiskTruth) -> BackStroke | None:
    """Of a back stroke what tells the clock; None where it has no truth."""
    known = np.isfinite(truth.touch_rad.value)
    return BackStroke(truth.touch_rad, motor_speed(truth.frames)) if known else None


def _lost(frames: dict, times: FrameTimes) -> Iterator[str]:
    """A line for each camera that has no picture of some frames: dropped by it, or damaged."""
    for name, pictures in frames.items():
        dropped = int(np.sum(times.picture[name] < 0))
        damaged = [
            str(k) for k in range(len(times)) if times.picture[name][k] >= 0 and k not in pictures
        ]
        if dropped:
            yield f"camera {name} dropped {dropped} of {len(times)} frames"
        if damaged:
            yield f"camera {name}: {len(damaged)} of {len(times)} frames damaged ({', '.join(damaged[:_MOST_NAMED])})"


def whisk_record(
    truth: WhiskTruth,
    settings: Settings,
    doubts: Iterable[Reason] = (),
    contradictions: Iterable[Reason] = (),
) -> SeenWhisk:
    """One whisk: at first touch, at the wanted angle, a row a frame, and lines to draw."""
    at = truth.at(settings.theta_rad)
    contradictions = [
        *contradictions,
        turns_doubt(truth.turns, motor_speed(truth.frames)) if truth.frames else NO_REASON,
    ]
    status = in_one_status(truth.status, at.status, *contradictions, *doubts)
    drawn = _overlay(truth, at.theta_rad)
    same = {name: getattr(truth, name) for name in _SAME}
    odd = any(contradictions)
    return SeenWhisk(
        **same, status=status, at=at, deflection=_deflection(truth), overlay=drawn, contradicted=odd
    )


def _deflection(truth: WhiskTruth) -> Deflection | None:
    """Of up to a dozen of the touching frames; None where none touches."""
    smooth = truth.smooth
    if smooth is None or len(smooth.theta_rad) == 0:
        return None
    chosen = np.unique(
        np.linspace(0, len(smooth.theta_rad) - 1, _MOST_DEFLECTIONS).round().astype(int)
    )
    theta, d_y, d_z = (
        smooth.theta_rad[chosen],
        smooth.values["d_y"][chosen],
        smooth.values["d_z"][chosen],
    )
    frames = truth.frames
    x, y, _ = frames.point_mm.value[frames.touching][chosen].T
    touch, d_x = truth.touch_rad.value, truth.d_x_mm.value
    towards = np.cos(touch) * x + np.sin(touch) * y - d_x
    by_y = np.cos(theta)[:, None] * smooth.jacobians["d_y"][chosen]
    jacobian = np.stack([smooth.jacobians["d_z"][chosen], by_y], axis=1).reshape(
        2 * len(chosen), -1
    )
    return Deflection(
        theta_rad=theta,
        motor_rad=touch + theta,
        slip_mm=smooth.values["slip"][chosen],
        along_mm=d_x / np.cos(theta) - d_y * np.sin(theta) + towards * np.cos(theta),
        across_y_mm=d_y * np.cos(theta) + towards * np.sin(theta),
        across_z_mm=d_z,
        past_mm=towards - frames.arc_mm[frames.touching][chosen],
        covariance=jacobian @ smooth.covariance @ jacobian.T,
    )


def _overlay(truth: WhiskTruth, theta_rad: float) -> dict[str, Drawing]:
    """Lines in the frames nearest to touch and to the wanted angle."""
    if truth.frames is None or not truth.overlay:
        return {}
    drawn = [k for k, index in enumerate(truth.frames.index) if int(index) in truth.overlay]
    chosen = {}
    for name, angle in (("touch", 0.0), ("theta", theta_rad)):
        k = min(drawn, key=lambda k: abs(truth.frames.theta_rad.value[k] - angle))
        frame = int(truth.frames.index[k])
        chosen[name] = Drawing(frame, truth.overlay[frame])
    return chosen
