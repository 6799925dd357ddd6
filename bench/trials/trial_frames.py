"""A trial's pictures as vision takes them: frames of an unmoved scene, on the clock of the signals,
by whisks.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from bench.base.settings import Settings
from bench.cameras.session_cameras import SessionCalibration
from bench.session.frame_times import FrameTimes, frame_times, read_trial
from bench.session.session import Session
from bench.session.signals import Signals, forward_strokes, ways_back
from bench.session.traces import read_traces
from bench.session.trial import Trial
from bench.trials.still_scene import StillScene, still_scene
from vision import KeptFit, Trace, TrialPictures, TrialTraces, TrialTruth, observe_trial
from vision.geometry import Bar, Rods, StatedSizes, Touched, touched_object
from vision.pictures import Others, RodLines

# [frames] Of a back stroke: two free ones, two that touch, and two about the touch. Derived.
_FEWEST_BACK = 6


@dataclass(frozen=True, eq=False)
class TrialInputs:
    """All that a trial is seen with: itself and its signals, its session with the cameras, and the run's settings."""

    session: Session
    trial: Trial
    signals: Signals
    calibration: SessionCalibration
    settings: Settings


@dataclass(frozen=True, eq=False)
class TrialFrames:
    """The frames of a trial.

    by_camera: pictures by frame, as read. pictures: what vision evaluates, or traces alone; observe: evaluates it.
    notes: on what places the object.
    """

    inputs: TrialInputs
    times: FrameTimes
    by_camera: dict[str, dict[int, np.ndarray]]
    scene: StillScene
    pictures: TrialPictures | TrialTraces
    observe: Callable[..., TrialTruth] = observe_trial
    notes: tuple[str, ...] = ()

    @classmethod
    def read(
        cls, inputs: TrialInputs, wires: Mapping[str, Others], fits: Sequence[KeptFit] = ()
    ) -> "TrialFrames":
        """Read the frames of a trial.

        wires: by camera and name, the wires of an array's whiskers, its own among them. fits: of its whisks, by
        cameras that stood a little elsewhere. Raises
        BadInput where pictures and times do not match.
        """
        times = frame_times(inputs.trial)
        by_camera = read_trial(inputs.trial, times)
        unmoved = fits[0].cameras if fits else ()  # those that had moved are in no fit
        scene = still_scene(inputs.session, inputs.calibration, by_camera, unmoved)
        pictures = _trial_pictures(inputs, times, scene, wires)
        return cls(inputs, times, by_camera, scene, pictures, partial(observe_trial, fits=fits))

    @cached_property
    def places(self) -> list[slice]:
        """Return the frames of each forward stroke."""
        signals = self.inputs.signals
        return [self.times.frames_in(signals, stroke) for stroke in forward_strokes(signals)]

    @cached_property
    def back(self) -> dict[int, slice]:
        """Return the frames of ways back by the number of the whisk, last frame first."""
        return _back_frames(self.inputs.trial, self.inputs.signals, self.times)

    @cached_property
    def rods(self) -> Rods:
        """Return the wire and the object."""
        return Rods(self.inputs.session.whisker.wire, stated_object(self.inputs.trial))

    @cached_property
    def motor_sigma_rad(self) -> np.ndarray:
        """Return the sigma of each frame's own motor angle, (n,)."""
        return self.inputs.signals.motor_sigma_at(self.times.time_s)


def _trial_pictures(
    inputs: TrialInputs, times: FrameTimes, scene: StillScene, wires: Mapping[str, Others]
) -> TrialPictures:
    """Return the pictures of a trial, those of unmoved cameras alone. wires: see `TrialFrames.read`."""
    session = inputs.session
    trial = inputs.trial
    velocity = trial.object_velocity_mm_s
    others, itself = _own_apart(wires, session.base.name if session.base else "")
    return TrialPictures(
        _chosen_frames(scene, inputs.settings),
        times.time_s,
        inputs.signals.motor_nearest(times.time_s),
        inputs.calibration.background,
        object_velocity_mm_s=np.array(velocity) if velocity else None,
        object_velocity_sigma_mm_s=trial.object_velocity_sigma_mm_s,
        object_gives_way=trial.object_gives_way,
        others=others,
        itself=itself,
        traces=_traces(trial, times),
        picture_of={name: crop.of for name, crop in session.crops.items()},
    )


def _traces(trial: Trial, times: FrameTimes) -> dict[str, Trace]:
    """Return by camera the wire's lines that another program has traced. Raise BadInput."""
    if not trial.trace_files:
        return {}
    traced = read_traces(trial.trace_files, trial.camera_sources, times.picture, trial.place)
    return {name: one.trace for name, one in traced.items()}


def _chosen_frames(scene: StillScene, settings: Settings) -> dict[str, Mapping[int, np.ndarray]]:
    """Return the frames of the cameras that did not move and that the settings name."""
    chosen = {}
    for name, frames in scene.frames.items():
        if name not in scene.left_out and settings.seeing.asks(name):
            chosen[name] = frames
    return chosen


def _own_apart(
    wires: Mapping[str, Others], own: str
) -> tuple[dict[str, Others], dict[str, RodLines]]:
    """Return by camera the wires of the other whiskers, and the whisker's own where it is there."""
    others = {}
    itself = {}
    for camera, lines in wires.items():
        others[camera] = {name: rods for name, rods in lines.items() if name != own}
        if own in lines:
            itself[camera] = lines[own]
    return others, itself


def stated_object(trial: Trial) -> Touched:
    """Return the object of a trial as vision takes it."""
    thickness = StatedSizes(trial.bar_diameter_mm or 0.0, trial.bar_diameter_sigma_mm)
    given = trial.object
    if given is None:
        return Bar.from_sizes(thickness)
    return touched_object(given.shape, replace(thickness, **given.sizes))


def _back_frames(trial: Trial, signals: Signals, times: FrameTimes) -> dict[int, slice]:
    """Return the frames of ways back by whisk, last to first, so that the whisker comes to the bar.

    The first way back alone is taken unless the trial asks for all. A way back of few frames is
    left out. A clock that is late makes the touch late on the way there and early on the way back.
    """
    strokes = ways_back(signals)
    back = {}
    for k, stroke in enumerate(strokes if trial.both_ways else strokes[:1]):
        if stroke is None:
            continue
        frames = times.frames_in(signals, stroke)
        if frames.stop - frames.start >= _FEWEST_BACK:
            stop = frames.start - 1 if frames.start else None
            back[k] = slice(frames.stop - 1, stop, -1)
    return back
