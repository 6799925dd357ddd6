"""A trial's frames where another program's traces are all that came: no picture is read."""

from collections.abc import Mapping

import numpy as np

from bench.base.settings import Settings
from bench.session.frame_times import frame_times
from bench.session.session import Session
from bench.session.signals import Signals
from bench.session.traces import Traced, read_traces_alone
from bench.session.trial import PLACE_UNCHECKED, Trial
from bench.trials.placed_by_board import place_by_board
from bench.trials.stated_truth import stated_place
from bench.trials.still_scene import StillScene
from bench.trials.trial_frames import TrialFrames, TrialInputs
from vision import Trace, TrialTraces
from vision.geometry import Axis, Cameras


def traced_frames(inputs: TrialInputs) -> TrialFrames:
    """Return the frames of a trial of traces alone.

    Raises BadInput where traces and times do not match, Refused where nothing places the object.
    """
    trial = inputs.trial
    cameras = inputs.calibration.cameras
    times = frame_times(trial)
    sizes_px = {camera.name: tuple(camera.size_px) for camera in cameras}
    alone = read_traces_alone(trial, len(times), sizes_px, inputs.session.crops)
    wire = _asked(alone.wire, inputs.settings)
    motor_rad = inputs.signals.motor_nearest(times.time_s)
    if alone.object_points:
        points = _asked(alone.object_points, inputs.settings)
        traces = TrialTraces.with_points(wire, times.time_s, motor_rad, points)
        notes = ()
    else:
        axis, sigma = _place(inputs.session, trial, inputs.signals, cameras)
        traces = TrialTraces.with_place(wire, times.time_s, motor_rad, axis, sigma)
        notes = (PLACE_UNCHECKED,)
    return TrialFrames(
        inputs,
        times,
        by_camera={},
        scene=StillScene({}, {}, ()),
        pictures=traces,
        observe=TrialTraces.observe,
        notes=notes,
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
