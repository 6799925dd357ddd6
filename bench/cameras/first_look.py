"""The rig's place, where session.toml does not state it, from the strokes of some trials."""

from collections.abc import Sequence
from itertools import chain
from typing import TypeVar

import numpy as np

from bench.base.input_problems import refused_as_bad_input
from bench.base.threads import in_threads
from bench.session.frame_times import frame_times, read_trial
from bench.session.session import Session
from bench.session.signals import forward_strokes, read_signals
from bench.session.trial import Trial
from vision.calibration import FirstRig, MovingLines, Placement, first_rig, moving_lines
from vision.geometry import Cameras

Item = TypeVar("Item")

# [trials] Strokes of more add little: what they share (light, lenses) no average makes smaller.
MOST_TRIALS = 6
# [strokes] Of a trial.
_MOST_STROKES = 3
# [frames] Of a stroke.
_MOST_FRAMES = 60
# [rad] Error of this first place, wide enough that the fit to the strokes decides.
_SIGMA_RAD = np.radians(5.0)
# [mm] Error of this first place, likewise.
_SIGMA_MM = 5.0


def spread(items: Sequence[Item], most: int = MOST_TRIALS) -> list[Item]:
    """Return at most so many of the items, spread over all of them."""
    if not len(items):
        return []
    chosen = np.unique(np.linspace(0, len(items) - 1, most).astype(int))
    return [items[k] for k in chosen]


def by_first_look() -> Placement:
    """Return the placement of a rig that is known by `first_look` alone: no step, and its covariance."""
    return Placement(np.zeros(6), np.diag(np.repeat([_SIGMA_RAD**2, _SIGMA_MM**2], 3)))


def first_look(session: Session, cameras: Cameras) -> FirstRig:
    """Find the rig in the cameras' frame, by what moves in the pictures.

    Raises BadInput where nothing turns.
    """
    trials = spread([trial for trial in session.trials if trial.camera_sources])
    lines: list[MovingLines] = []
    for of_trial in in_threads(lambda trial: _moving_lines(trial, cameras), trials):
        lines += of_trial
    with refused_as_bad_input("session.toml"):
        return first_rig(lines)


def _moving_lines(trial: Trial, cameras: Cameras) -> list[MovingLines]:
    """Return the lines that move in each of some strokes of a trial."""
    signals = read_signals(trial)
    times = frame_times(trial)
    motor_rad = signals.motor_at(times.time_s)
    strokes = []
    for stroke in spread(forward_strokes(signals), _MOST_STROKES):
        taken = range(len(times))[times.frames_in(signals, stroke)]
        strokes.append(spread(taken, _MOST_FRAMES))
    frames = read_trial(trial, times, chain.from_iterable(strokes))
    found = []
    for stroke in strokes:
        angles = {frame: float(motor_rad[frame]) for frame in stroke}
        found.append(moving_lines(frames, angles, cameras))
    return found
