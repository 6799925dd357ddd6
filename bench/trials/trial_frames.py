"""A trial's pictures as vision takes them: frames held to the still scene, on the clock of the signals, by whisks."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bench.base.settings import Settings
from bench.cameras.session_cameras import SessionCalibration
from bench.session.frame_times import FrameTimes, frame_times, read_trial
from bench.session.session import Session
from bench.session.signals import Signals, forward_strokes, ways_back
from bench.session.trial import Trial
from bench.trials.still_scene import StillScene, still_scene
from vision.geometry.forms import touched_object
from vision.geometry.rods import Bar, Rods
from vision.geometry.touched import StatedSizes, Touched
from vision.pictures.others import RodLines
from vision.truth.trial_pictures import TrialPictures

_FEWEST_BACK = 6  # frames of a back stroke: two free ones, two that touch, and two about the touch


@dataclass(frozen=True, eq=False)
class Shown:
    """What a trial shows. frames: as read, by camera; places: frames of each forward stroke; back: of ways back, by
    the number of the whisk, last frame first."""

    times: FrameTimes
    frames: dict[str, dict[int, np.ndarray]]
    scene: StillScene
    places: list[slice]
    back: dict[int, slice]
    pictures: TrialPictures
    rods: Rods

    @classmethod
    def of(
        cls,
        session: Session,
        trial: Trial,
        signals: Signals,
        calibration: SessionCalibration,
        settings: Settings,
        wires: Mapping[str, Mapping[str, RodLines]],
    ) -> "Shown":
        """wires: by camera, where those of an array's whiskers are, its own among them. Raises BadInput where pictures
        and times do not go together."""
        times = frame_times(trial)
        frames = read_trial(trial, times)
        scene = still_scene(session, calibration, frames)
        wanted = ways_back(signals) if trial.both_ways else ways_back(signals)[:1]
        back = {
            k: where
            for k, one in enumerate(wanted)
            if (where := _backwards(signals, times, one)) is not None
        }
        own = session.base.name if session.base else ""
        pictures = TrialPictures(
            {
                name: f
                for name, f in scene.frames.items()
                if name not in scene.left_out and settings.seeing.asks(name)
            },
            times.time_s,
            np.interp(
                times.time_s, signals.time_s, signals.motor_rad
            ),  # frames outside belong to no whisk
            calibration.background,
            trial.object_velocity_mm_s and np.array(trial.object_velocity_mm_s),
            trial.object_velocity_sigma_mm_s,
            trial.object_gives_way,
            {
                camera: {name: one for name, one in some.items() if name != own}
                for camera, some in wires.items()
            },
            {camera: some[own] for camera, some in wires.items() if own in some},
        )
        places = [times.frames_in(signals, stroke) for stroke in forward_strokes(signals)]
        rods = Rods(session.whisker.wire, touched(trial))
        return cls(times, frames, scene, places, back, pictures, rods)


def touched(trial: Trial) -> Touched:
    """Return what is touched, as vision takes it."""
    thickness = StatedSizes(trial.bar_diameter_mm or 0.0, trial.bar_diameter_sigma_mm)
    given = trial.object
    if given is None:
        return Bar.from_sizes(thickness)
    stated = replace(
        thickness,
        ring_diameter_mm=given.ring_diameter_mm or 0.0,
        half_angle_rad=float(np.radians(given.half_angle_deg or 0.0)),
    )
    return touched_object(given.shape, stated)


def _backwards(signals: Signals, times: FrameTimes, where: slice | None) -> slice | None:
    """Frames of a back stroke, last to first, so that the whisker comes to the bar; None where few were taken.

    A clock that is late has the whisker touch late on the way there and early on the way back.
    """
    frames = None if where is None else times.frames_in(signals, where)
    if frames is None or frames.stop - frames.start < _FEWEST_BACK:
        return None
    return slice(frames.stop - 1, frames.start - 1 if frames.start else None, -1)
