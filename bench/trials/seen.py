"""The seen half of a trial's result: pictures in, truth out, as plain values. No gauge is read here."""

from collections.abc import Iterator

import numpy as np

from bench.base.settings import Settings
from bench.cameras.calibration import SessionCalibration, moved_cameras
from bench.session.frame_times import FrameTimes, frame_times, read_trial
from bench.session.session import Session
from bench.session.signals import Signals, forward_strokes
from bench.session.trial import Trial
from vision.geometry.errors import Refused
from vision.geometry.rods import Bar
from vision.geometry.settings import VisionSettings
from vision.truth.observe import observe_trial
from vision.truth.records import WhiskTruth

NO_PICTURES = "no pictures"
_MOST_DEFLECTIONS = 12
_MOST_NAMED = 5  # frames in a line
_NOT_PLAIN = ("smooth", "frames", "overlay")


def see_trial(
    session: Session, trial: Trial, signals: Signals, calibration: SessionCalibration, settings: Settings
) -> dict:
    """Whisks of a trial as the cameras show them: {"whisks": [...], "notes": [...]}.

    What keeps a trial from being seen is the status of its whisks; the others go on.
    """
    strokes = forward_strokes(signals)
    if not trial.camera_sources or calibration.cameras is None:
        return _unseen(len(strokes), NO_PICTURES)
    try:
        return _see(session, trial, signals, strokes, calibration, settings)
    except Refused as reason:
        return _unseen(len(strokes), str(reason))


def _unseen(count: int, status: str) -> dict:
    nothing = {"status": status, "d_x_mm": None, "cameras": 0, "frames_used": 0}
    return {"whisks": [{"whisk": number} | nothing for number in range(count)], "notes": []}


def _see(
    session: Session, trial: Trial, signals: Signals, strokes, calibration: SessionCalibration, settings: Settings
) -> dict:
    times = frame_times(trial)
    frames = read_trial(trial, times)
    moved = moved_cameras(session, calibration, frames)
    wire = session.whisker.wire
    clock_sigma_s = times.clock_sigma_s if settings.clock_sigma_s is None else settings.clock_sigma_s
    truth = observe_trial(
        {name: pictures for name, pictures in frames.items() if name not in moved},
        times.time_s,
        np.interp(times.time_s, signals.time_s, signals.motor_rad),  # frames outside belong to no whisk
        [times.frames_in(signals, stroke) for stroke in strokes],
        calibration.cameras,
        wire,
        Bar(trial.bar_diameter_mm, trial.bar_diameter_sigma_mm),
        calibration.background,
        VisionSettings(clock_sigma_s=clock_sigma_s),
    )
    whisks = [whisk_record(whisk, settings, moved.values()) for whisk in truth.whisks]
    return {
        "whisks": whisks,
        "bar": {"point_mm": truth.bar_point_mm, "direction": truth.bar_direction},
        "bar_radius_mm": 0.5 * trial.bar_diameter_mm,
        "wire_radius_mm": 0.5 * wire.diameter_mm,
        "notes": [*truth.notes, *_lost(frames, times)],
        "clock": {"source": times.source, "sigma_s": clock_sigma_s, "recorded": times.clock_sigma_s == 0.0},
    }


def _lost(frames: dict, times: FrameTimes) -> Iterator[str]:
    """A line for each camera that has no picture of some frames: dropped by it, or damaged."""
    for name, pictures in frames.items():
        dropped = int(np.sum(times.picture[name] < 0))
        damaged = [str(k) for k in range(len(times)) if times.picture[name][k] >= 0 and k not in pictures]
        if dropped:
            yield f"camera {name} dropped {dropped} of {len(times)} frames"
        if damaged:
            yield f"camera {name}: {len(damaged)} of {len(times)} frames damaged ({', '.join(damaged[:_MOST_NAMED])})"


def whisk_record(truth: WhiskTruth, settings: Settings, doubts=()) -> dict:
    """One whisk as plain values: at first touch, at the wanted angle, a row a frame, and lines to draw."""
    at = truth.at(settings.theta_rad)
    record = {name: getattr(truth, name) for name in truth.__dataclass_fields__ if name not in _NOT_PLAIN}
    status = "; ".join(dict.fromkeys(filter(None, [truth.status, at.status, *doubts])))
    return record | {
        "status": status,
        "at": at,
        "frames": truth.frames,
        "deflection": _deflection(truth),
        "overlay": _overlay(truth, at.theta_rad),
    }


def _deflection(truth: WhiskTruth) -> dict | None:
    """Where the contact lies in the hub's axes while touching, seen from the unbent whisker, with joint covariance.

    along_mm, across_y_mm, across_z_mm (f,); covariance (2f, 2f), of across z, y frame by frame.
    """
    smooth = truth.smooth
    if smooth is None or len(smooth.theta_rad) == 0:
        return None
    chosen = np.unique(np.linspace(0, len(smooth.theta_rad) - 1, _MOST_DEFLECTIONS).round().astype(int))
    theta, d_y, d_z = smooth.theta_rad[chosen], smooth.values["d_y"][chosen], smooth.values["d_z"][chosen]
    x, y, _ = truth.frames.point_mm[truth.frames.touching][chosen].T
    towards = np.cos(truth.touch_rad) * x + np.sin(truth.touch_rad) * y - truth.d_x_mm
    by_y = np.cos(theta)[:, None] * smooth.jacobians["d_y"][chosen]
    jacobian = np.stack([smooth.jacobians["d_z"][chosen], by_y], axis=1).reshape(2 * len(chosen), -1)
    return {
        "theta_rad": theta,
        "motor_rad": truth.touch_rad + theta,
        "slip_mm": smooth.values["slip"][chosen],
        "along_mm": truth.d_x_mm / np.cos(theta) - d_y * np.sin(theta) + towards * np.cos(theta),
        "across_y_mm": d_y * np.cos(theta) + towards * np.sin(theta),
        "across_z_mm": d_z,
        "covariance": jacobian @ smooth.covariance @ jacobian.T,
    }


def _overlay(truth: WhiskTruth, theta_rad: float) -> dict:
    """Lines in the frames nearest to touch and to the wanted angle."""
    if truth.frames is None or not truth.overlay:
        return {}
    known = [k for k, index in enumerate(truth.frames.index) if int(index) in truth.overlay]
    chosen = {}
    for name, angle in (("touch", 0.0), ("theta", theta_rad)):
        k = min(known, key=lambda k: abs(truth.frames.theta_rad[k] - angle))
        frame = int(truth.frames.index[k])
        chosen[name] = {"frame": frame, "cameras": truth.overlay[frame]}
    return chosen
