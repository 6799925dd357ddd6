"""The rig's place, where session.toml does not state it, from the strokes of some trials."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain

import numpy as np

from bench.base.input_problems import refused_as_bad_input
from bench.base.progress import count_parts
from bench.base.threads import in_threads
from bench.session.angle_source import angle_source
from bench.session.file_names import SESSION_TOML
from bench.session.frame_times import frame_times, read_trial
from bench.session.session import Session
from bench.session.signals import forward_strokes, read_signals
from bench.session.trial import Trial
from vision.boards import find_other_markers
from vision.calibration import (
    FirstRig,
    MarkerSighting,
    MovingLines,
    Placement,
    first_axis,
    first_rig,
    first_rig_about,
    moving_lines,
)
from vision.geometry import Board, Cameras, spread

# [trials] Strokes of more add little: what they share (light, lenses) no average makes smaller.
MOST_TRIALS = 6
# [strokes] Of a trial.
_MOST_STROKES = 3
# [frames] Of a stroke.
_MOST_FRAMES = 60
# [frames] Of a stroke, in which a marker on the hub is searched. Stated.
_MOST_MARKER_FRAMES = 20
# [rad] Error of this first place, wide enough that the fit to the strokes decides.
_SIGMA_RAD = np.radians(5.0)
# [mm] Error of this first place, likewise.
_SIGMA_MM = 5.0


def by_first_look() -> Placement:
    """Return the placement of a rig that is known by `first_look` alone: no step, and its covariance."""
    covariance = np.diag(np.repeat([_SIGMA_RAD**2, _SIGMA_MM**2], 3))
    return Placement(np.zeros(6), covariance, source="first look")


@dataclass(frozen=True)
class Look:
    """What turns with the motor in some trials: lines of each stroke, and markers in pictures."""

    lines: tuple[MovingLines, ...]
    markers: tuple[MarkerSighting, ...]


def first_look(session: Session, cameras: Cameras) -> FirstRig:
    """Find the rig in the cameras' frame, by what moves in the pictures, and by a marker on the hub
    where there is one.

    Raises BadInput where nothing turns.
    """
    look = look_at_strokes(session, cameras)
    with refused_as_bad_input(SESSION_TOML):
        axis = first_axis(look.markers, cameras)
        return first_rig(look.lines) if axis is None else first_rig_about(axis, look.lines)


def look_at_strokes(session: Session, cameras: Cameras) -> Look:
    """Find what moves in some strokes of some trials."""
    trials = spread([trial for trial in session.trials if _shows_motor(trial)], MOST_TRIALS)
    lines: list[MovingLines] = []
    markers: list[MarkerSighting] = []
    looks = in_threads(lambda trial: _look(trial, session.board, cameras), trials)
    for seen in count_parts(looks, "trials searched for what turns with the motor", len(trials)):
        lines += seen.lines
        markers += seen.markers
    return Look(tuple(lines), tuple(markers))


def _shows_motor(trial: Trial) -> bool:
    """Return whether a trial has pictures whose motor angles have the rig frame's zero."""
    return (
        bool(trial.camera_sources)
        and angle_source(trial).has_zero
        and not angle_source(trial).is_seen
    )


def _look(trial: Trial, board: Board | None, cameras: Cameras) -> Look:
    """Return the lines that move in each of some strokes of a trial, and its markers."""
    signals = read_signals(trial)
    times = frame_times(trial)
    motor_rad = signals.motor_at(times.time_s)
    strokes = []
    for stroke in spread(forward_strokes(signals), _MOST_STROKES):
        taken = range(len(times))[times.frames_in(signals, stroke)]
        strokes.append(spread(taken, _MOST_FRAMES))
    frames = read_trial(trial, times, chain.from_iterable(strokes))
    lines = []
    markers: list[MarkerSighting] = []
    for stroke in strokes:
        angles = {frame: float(motor_rad[frame]) for frame in stroke}
        lines.append(moving_lines(frames, angles, cameras))
        if board is not None:
            chosen = {frame: angles[frame] for frame in spread(stroke, _MOST_MARKER_FRAMES)}
            markers += _markers(trial, board, frames, chosen)
    return Look(tuple(lines), tuple(markers))


def _markers(
    trial: Trial,
    board: Board,
    frames: Mapping[str, Mapping[int, np.ndarray]],
    motor_rad: Mapping[int, float],
) -> Iterator[MarkerSighting]:
    """Yield the markers besides the board's in frames of a trial, by camera; motor_rad: by frame."""
    for camera, pictures in frames.items():
        for frame, angle in motor_rad.items():
            if frame not in pictures:
                continue
            for marker in find_other_markers(pictures[frame], board):
                instant = (trial.name, frame)
                yield MarkerSighting(marker.number, camera, instant, angle, marker.px)
