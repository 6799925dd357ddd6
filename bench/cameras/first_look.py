"""Where the rig is, where session.toml does not say: a first look at some trials' strokes."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from bench.base.errors import BadInput
from bench.base.threads import in_threads
from bench.session.frame_times import frame_times, read_trial
from bench.session.session import Session
from bench.session.signals import forward_strokes, read_signals
from bench.session.trial import Trial
from vision.calibration.hub_turning import FirstRig, first_rig
from vision.calibration.moving_line import MovingLines, moving_lines
from vision.calibration.place import Placement
from vision.geometry.camera import Cameras
from vision.geometry.refusals import Refused

Item = TypeVar("Item")

# Strokes of more trials say little more: what they share (light, lenses) no average makes smaller.
MOST_TRIALS = 6
_MOST_STROKES, _MOST_FRAMES = 3, 60  # of a trial, of a stroke
# How far a first look may be off, wide enough that the strokes alone have the last word.
_SIGMA_RAD, _SIGMA_MM = np.radians(5.0), 5.0


def spread(items: Sequence[Item], most: int = MOST_TRIALS) -> list[Item]:
    """At most so many of the items, spread over all of them."""
    return (
        [items[k] for k in np.unique(np.linspace(0, len(items) - 1, most).astype(int))]
        if len(items)
        else []
    )


def by_first_look() -> Placement:
    """What a first look is worth."""
    return Placement(np.zeros(6), np.diag(np.repeat([_SIGMA_RAD**2, _SIGMA_MM**2], 3)))


def first_look(session: Session, cameras: Cameras) -> FirstRig:
    """The rig in the cameras' frame, by what moves in the pictures. Raises BadInput where nothing turns."""
    trials = spread([trial for trial in session.trials if trial.camera_sources])
    lines = [
        one for many in in_threads(lambda trial: _lines(trial, cameras), trials) for one in many
    ]
    try:
        return first_rig(lines)
    except Refused as reason:
        raise BadInput(str(reason), file="session.toml") from None


def _lines(trial: Trial, cameras: Cameras) -> list[MovingLines]:
    """Of each stroke of a trial."""
    signals, times = read_signals(trial), frame_times(trial)
    motor = signals.motor_at(times.time_s)
    strokes = [
        range(*times.frames_in(signals, s).indices(len(motor))) for s in forward_strokes(signals)
    ]
    strokes = [spread(stroke, _MOST_FRAMES) for stroke in spread(strokes, _MOST_STROKES)]
    frames = read_trial(trial, times, (f for stroke in strokes for f in stroke))
    return [
        moving_lines(frames, {f: float(motor[f]) for f in stroke}, cameras) for stroke in strokes
    ]
