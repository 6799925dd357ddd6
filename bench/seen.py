"""The seen half of a trial's result: pictures in, truth out, as plain values. No gauge is read here."""

from dataclasses import replace

import numpy as np

from bench.calibration import SessionCalibration, moved_cameras
from bench.footage import read_frames
from bench.session import Session
from bench.settings import Settings
from bench.signals import Signals, forward_strokes, frame_times
from bench.trial import Trial
from vision.effort import VisionSettings
from vision.errors import Refused
from vision.observe import observe_trial
from vision.scene import Bar, Wire
from vision.truth import WhiskTruth

NO_PICTURES = "no pictures"
_MOST_DEFLECTIONS = 12


def see_trial(session: Session, trial: Trial, signals: Signals, calibration: SessionCalibration,
              settings: Settings) -> dict:
    """Whisks of a trial as the cameras show them: {"whisks": [...], "bar": ..., "notes": [...]}."""
    strokes = forward_strokes(signals)
    if not trial.camera_sources or calibration.cameras is None:
        return {"whisks": [_unseen(number, NO_PICTURES) for number in range(len(strokes))], "notes": []}
    times = frame_times(trial)
    motor = signals.motor_at(times.time_s)
    frames = _frames(trial, times)
    moved = moved_cameras(session, calibration, frames)
    frames = {name: pictures for name, pictures in frames.items() if name not in moved}
    truth = observe_trial(frames, times.time_s, motor, [times.frames_in(signals, s) for s in strokes],
                          calibration.cameras, _wire(session), Bar(trial.bar_diameter_mm, trial.bar_diameter_sigma_mm),
                          calibration.background, VisionSettings(clock_sigma_s=settings.clock_sigma_s))
    whisks = [_whisk(w, settings, "; ".join(moved.values())) for w in truth.whisks]
    return {"whisks": whisks, "bar": {"point_mm": truth.bar_point_mm, "direction": truth.bar_direction},
            "bar_radius_mm": 0.5 * trial.bar_diameter_mm, "wire_radius_mm": 0.5 * session.whisker.diameter_mm,
            "notes": [*times.doubts, *truth.notes, *moved.values()]}


def _wire(session: Session) -> Wire:
    w = session.whisker
    return Wire(w.shape, w.length_mm, w.diameter_mm, w.length_sigma_mm, w.diameter_sigma_mm)


def _frames(trial: Trial, times) -> dict[str, dict[int, np.ndarray]]:
    """Pictures by camera and frame index; lost ones are left out."""
    frames = {}
    for name, source in trial.camera_sources.items():
        pictures = times.picture[name]
        try:
            read = read_frames(source, (int(k) for k in pictures if k >= 0))
        except Refused as reason:
            raise Refused(f"{trial.shown(name)}: {reason}") from None
        frames[name] = {frame: read[int(k)] for frame, k in enumerate(pictures)
                        if k >= 0 and read.get(int(k)) is not None}
    return frames


def _unseen(number: int, status: str) -> dict:
    return {"whisk": number, "status": status, "d_x_mm": None, "cameras": 0, "frames_used": 0}


def _whisk(truth: WhiskTruth, settings: Settings, moved: str) -> dict:
    """One whisk as plain values: at first touch, at the wanted angle, a row a frame, and lines to draw."""
    at = truth.at(settings.theta_rad)
    status = "; ".join(dict.fromkeys(filter(None, [truth.status, at.status, moved])))
    kept = replace(truth, smooth=None, frames=None, overlay={})
    frames = truth.frames
    return {**{f: getattr(kept, f) for f in kept.__dataclass_fields__ if f not in ("smooth", "frames", "overlay")},
            "status": status, "at": at, "frames": frames, "deflection": _deflection(truth),
            "overlay": _overlay(truth, at.theta_rad)}


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
    jacobian = np.stack([smooth.jacobians["d_z"][chosen], np.cos(theta)[:, None] * smooth.jacobians["d_y"][chosen]], 1)
    jacobian = jacobian.reshape(2 * len(chosen), -1)
    return {"theta_rad": theta, "motor_rad": truth.touch_rad + theta, "slip_mm": smooth.values["slip"][chosen],
            "along_mm": truth.d_x_mm / np.cos(theta) - d_y * np.sin(theta) + towards * np.cos(theta),
            "across_y_mm": d_y * np.cos(theta) + towards * np.sin(theta), "across_z_mm": d_z,
            "covariance": jacobian @ smooth.covariance @ jacobian.T}


def _overlay(truth: WhiskTruth, theta_rad: float) -> dict:
    """Lines in the frames nearest to touch and to the wanted angle."""
    if truth.frames is None or not truth.overlay:
        return {}
    chosen = {}
    for name, angle in (("touch", 0.0), ("theta", theta_rad)):
        known = [k for k, index in enumerate(truth.frames.index) if int(index) in truth.overlay]
        k = min(known, key=lambda k: abs(truth.frames.theta_rad[k] - angle))
        frame = int(truth.frames.index[k])
        chosen[name] = {"frame": frame, "cameras": truth.overlay[frame]}
    return chosen
