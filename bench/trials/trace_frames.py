"""A trial's frames where another program's traces are all that came: no picture is read."""

from collections.abc import Mapping

import numpy as np

from bench.base.settings import Settings
from bench.session.frame_times import frame_times
from bench.session.session import Session
from bench.session.signals import Signals, forward_strokes
from bench.session.traces import Traced, read_traces_alone
from bench.session.trial import PLACE_UNCHECKED, Trial
from bench.trials.placed_by_board import place_by_board
from bench.trials.stated_truth import stated_place
from bench.trials.still_scene import StillScene
from bench.trials.trial_frames import TrialFrames, TrialInputs, back_frames, stated_object
from vision import Trace, TrialTraces
from vision.geometry import Axis, Cameras, Rods


def traced_frames(inputs: TrialInputs) -> TrialFrames:
    """Return the frames of a trial of traces alone.

    Raises BadInput where traces and times do not match, Refused where nothing places the object.
    """
    session = inputs.session
    trial = inputs.trial
    signals = inputs.signals
    cameras = inputs.calibration.cameras
    times = frame_times(trial)
    sizes_px = {camera.name: tuple(camera.size_px) for camera in cameras}
    alone = read_traces_alone(trial, len(times), sizes_px, session.crops)
    traces = _asked(alone.wire, inputs.settings)
    points = alone.object_points
    motor_rad = np.interp(times.time_s, signals.time_s, signals.motor_rad)
    if points:
        asked = _asked(points, inputs.settings)
        recording = TrialTraces.with_points(traces, times.time_s, motor_rad, asked)
    else:
        axis, sigma = _place(session, trial, signals, cameras)
        recording = TrialTraces.with_place(traces, times.time_s, motor_rad, axis, sigma)
    return TrialFrames(
        times=times,
        by_camera={},
        scene=StillScene({}, {}, ()),
        places=[times.frames_in(signals, stroke) for stroke in forward_strokes(signals)],
        back=back_frames(trial, signals, times),
        pictures=recording,
        rods=Rods(session.whisker.wire, stated_object(trial)),
        motor_sigma_rad=signals.motor_sigma_at(times.time_s),
        observe=TrialTraces.observe,
        notes=() if points else (PLACE_UNCHECKED,),
    )


def _place(
    session: Session, trial: Trial, signals: Signals, cameras: Cameras
) -> tuple[Axis, np.ndarray]:
    """Return the bar's axis and sigmas (4,): by a board on it where there is one, or else by the stage."""
    if trial.shows_board:
        return place_by_board(session, trial, cameras)
    return stated_place(session, trial, signals)


def _asked(traces: Mapping[str, Traced], settings: Settings) -> dict[str, Trace]:
    """Return lines or points by camera, of those that the settings name."""
    return {name: one.trace for name, one in traces.items() if settings.seeing.asks(name)}
