"""`whisker-bench calibrate angles`: the motor's angle at each frame by the trials' own pictures, for sessions
without a motor log.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.interpolate import make_smoothing_spline

from bench.base.errors import BadInput
from bench.base.exit_codes import DONE
from bench.base.numbers import first_names
from bench.base.progress import begin_step
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.cameras.session_cameras import SessionCalibration, calibrate_session
from bench.session.angle_source import angle_source
from bench.session.angles_file import FrameAngles, angles_file, write_angles
from bench.session.file_names import SESSION_TOML, TRIAL_TOML
from bench.session.frame_times import FrameTimes, frame_times, read_trial
from bench.session.session import Session, load_session
from bench.session.signals import Signals, read_signals
from bench.session.strokes import forward_strokes
from bench.session.trial import Trial
from bench.trials.trial_frames import TrialFrames, TrialInputs
from vision import whisker_angles
from vision.boards import find_other_markers
from vision.calibration import MarkerSighting, first_rig_about, marker_turns, moving_lines
from vision.geometry import Board, Cameras, Refused, counted, spread

# [frames] Of a stroke, in which the free whisker is searched for the angle's zero. Stated.
_MOST_FRAMES = 60
# [1] Penalties of the square of bend over the recording's length, strongest first: from a straight line to
# every turn as seen. Stated.
_SMOOTHINGS = 10.0 ** np.arange(4.0, -12.5, -0.5)
# [markers] Named in a line. Stated.
_MOST_NAMED = 8

Pictures = Mapping[str, Mapping[int, np.ndarray]]  # by camera and frame


@dataclass(frozen=True, eq=False)
class _Task:
    """One trial whose angles are sought, with the session's cameras in the rig frame."""

    session: Session
    trial: Trial
    calibration: SessionCalibration


@dataclass(frozen=True, eq=False)
class SeenTurns:
    """The angles of a trial by its pictures.

    time_s, motor_rad (n,): of each frame that shows the angle. covariance (n, n), rad². reference_rad:
    the whisker's azimuth beyond what the zero of all trials is counted from.
    """

    time_s: np.ndarray
    motor_rad: np.ndarray
    covariance: np.ndarray
    reference_rad: float


def calibrate_angles_command(session: Path, *, workers: int = 1, follow_links: bool = False) -> int:
    """Write the angles file of each trial that asks for one and has none, and print what was found.

    Return 0. Raise BadInput; nothing is overwritten.
    """
    loaded = load_session(session, follow_links=follow_links)
    asked = [t for t in loaded.trials if angle_source(t).is_seen and t.purpose != "weight"]
    if not asked:
        found = 'no trial has angle_from = "marker" or "whisker" in [trial]'
        raise BadInput(found, file=SESSION_TOML)
    wanted = [trial for trial in asked if angle_source(trial).lacks(trial)]
    for trial in wanted:
        _check(loaded, trial)
    if wanted:
        for trial, angles in zip(wanted, see_angles(loaded, wanted, workers)):
            write_angles(trial, angles)
            print(_line(trial, angles))
    kept = len(asked) - len(wanted)
    if kept:
        print(
            f"{counted(kept, 'trial')} with angles already: kept; remove the file to measure anew"
        )
    return DONE


def _line(trial: Trial, angles: FrameAngles) -> str:
    """Return what is said of a trial's angles."""
    sigma_deg = float(np.median(angles.sigma_deg))
    span_deg = float(np.ptp(angles.motor_deg))
    frames = counted(len(angles.time_s), "frame")
    name = trial.label(angles_file(trial).name)
    return f"{name}: {frames}, {span_deg:.2f} degrees, ± {sigma_deg:.3f} each and ± {100 * angles.share_sigma:.2g} %"


def _check(session: Session, trial: Trial) -> None:
    """Raise BadInput where a trial's pictures cannot give its angles."""
    label = trial.label(TRIAL_TOML)
    if len(trial.camera_sources) < 2:
        found = f'angle_from = "{trial.angle_from}" needs pictures by two cameras'
        raise BadInput(f"{found}; there are {len(trial.camera_sources)}", file=label)
    if session.cameras_toml is None and not session.is_rig_placed:
        found = "where the motor's axis is must be known: state T_rig_board, or bring rig.toml or cameras.toml"
        raise BadInput(found, file=SESSION_TOML)
    angle_source(trial).check_keys(trial)
    if trial.angle_from == "marker" and session.board is None:
        raise BadInput("[board] is missing; its dictionary is the marker's", file=SESSION_TOML)


def _nominal_signals(trial: Trial) -> Signals:
    """Return the signals with the angle by the nominal speed, which a first pass begins from."""
    # The sigma that a stated speed requires enters no coarse angle.
    sigma_deg_s = trial.speed_sigma_deg_s or trial.speed_deg_s
    return read_signals(replace(trial, angle_from="speed", speed_sigma_deg_s=sigma_deg_s))


def see_angles(session: Session, trials: Sequence[Trial], workers: int = 1) -> list[FrameAngles]:
    """Return the angles of trials by their pictures. Raises BadInput where they are not seen."""
    begin_step("cameras from pictures of the board")
    with TemporaryDirectory() as folder, Workers(workers) as pool:
        calibration = calibrate_session(session, Path(folder))
        tasks = [_Task(session, trial, calibration) for trial in trials]
        begin_step("the motor's angle in each frame")
        found = pool.run(_see, tasks, "angles")
    return [_at_zero(one, offset) for one, offset in zip(found, _offsets(trials, found))]


def _offsets(trials: Sequence[Trial], found: Sequence[SeenTurns]) -> Iterator[float]:
    """Yield the angle that each trial's reference has, rad: the median, as one hub holds one whisker."""
    for trial in trials:
        alike = [one.reference_rad for own, one in zip(trials, found) if _is_alike(own, trial)]
        turned = np.angle(np.exp(1j * (np.array(alike) - alike[0])))
        yield alike[0] + float(np.median(turned))


def _is_alike(one: Trial, other: Trial) -> bool:
    """Return whether the angles of two trials count from the same thing."""
    return (one.angle_from, one.hub_marker) == (other.angle_from, other.hub_marker)


def _at_zero(seen: SeenTurns, offset_rad: float) -> FrameAngles:
    """Return angles of which 0 is where the whisker lies along the rig's x."""
    motor_rad = seen.motor_rad - seen.reference_rad + offset_rad
    return FrameAngles.of_turns(seen.time_s, motor_rad, seen.covariance)


def _see(task: _Task) -> SeenTurns:
    """Return the angles of one trial. Raises BadInput where pictures do not show them."""
    trial = task.trial
    times = frame_times(trial)
    try:
        if trial.angle_from == "marker":
            return _by_marker(task, times.time_s, read_trial(trial, times))
        return _by_whisker(task, times)
    except Refused as refusal:
        raise BadInput(f'angle_from = "{trial.angle_from}": {refusal}', file=trial.place) from None


def _by_marker(task: _Task, time_s: np.ndarray, pictures: Pictures) -> SeenTurns:
    """Return the angles by the marker on the hub. Raises Refused."""
    trial = task.trial
    sightings = list(_sightings(pictures, task.session.board))
    seen = sorted({one.number for one in sightings})
    named = first_names(seen, _MOST_NAMED)
    own = [one for one in sightings if one.number == trial.hub_marker]
    if not own:
        raise Refused(
            f"marker {trial.hub_marker} (hub_marker) is in no picture; seen besides the board's: {named}",
            code="marker_not_seen",
        )
    cameras = task.calibration.cameras
    turns = marker_turns(own, cameras)
    free_rad = _azimuth_of_free(turns.frame, turns.turn_rad, pictures, cameras)
    own_s = time_s[turns.frame]
    return SeenTurns(
        own_s,
        free_rad + _smoothest(own_s, turns.turn_rad, turns.covariance),
        turns.covariance,
        float(np.angle(np.exp(1j * (free_rad - turns.azimuth_rad)))),
    )


def _by_whisker(task: _Task, times: FrameTimes) -> SeenTurns:
    """Return the angles by the whisker's base. Raises Refused, and BadInput of several strokes.

    Passes begin at the nominal speed, of one forward stroke.
    """
    trial = task.trial
    nominal = _nominal_signals(trial)
    inputs = TrialInputs(task.session, trial, nominal, task.calibration, Settings())
    frames = TrialFrames.read(inputs, {})
    if len(frames.places) != 1:
        found = f"{counted(len(frames.places), 'forward stroke')} in the recording, 1 is allowed"
        raise BadInput(found, file=trial.place)
    stroke = frames.places[0]
    turns = frames.pictures.motor_rad
    free_rad = _azimuth_of_free(
        np.arange(len(times))[stroke], turns[stroke], frames.by_camera, task.calibration.cameras
    )
    pictures = replace(frames.pictures, motor_rad=turns + free_rad)
    seen = whisker_angles(pictures, stroke, task.calibration.cameras, frames.rods)
    # One wire in one clamp: it lies along x at angle 0 in all trials.
    return SeenTurns(times.time_s[seen.frame], seen.angle_rad, seen.covariance, 0.0)


def _smoothest(time_s: np.ndarray, turn_rad: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Return the smoothest turns (n,) over time that agree with those seen: motors have inertia.

    The smoothing is the strongest at which the mean square of residuals over their sigmas is 1. A free
    wire is seen better than a marker, and would look bent by the marker's scatter.
    """
    own_rad = np.radians(FrameAngles.of_turns(time_s, turn_rad, covariance).sigma_deg)
    span_s = np.ptp(time_s)
    weight = (np.median(own_rad) / own_rad) ** 2
    for smoothing in _SMOOTHINGS:
        spline = make_smoothing_spline(time_s / span_s, turn_rad, weight, lam=smoothing)
        smooth = spline(time_s / span_s)
        if np.mean(((smooth - turn_rad) / own_rad) ** 2) <= 1.0:
            return smooth
    return turn_rad


def _sightings(pictures: Pictures, board: Board) -> Iterator[MarkerSighting]:
    """Yield the markers besides the board's in a trial's pictures, of which no motor angle is known."""
    for camera, frames in pictures.items():
        for frame, grey in frames.items():
            for marker in find_other_markers(grey, board):
                yield MarkerSighting(marker.number, camera, ("", frame), np.nan, marker.px)


def _azimuth_of_free(
    frames: np.ndarray, turn_rad: np.ndarray, pictures: Pictures, cameras: Cameras
) -> float:
    """Return the azimuth in the rig frame, rad, that the free whisker has at turn 0.

    frames, turn_rad (n,): in which it turned by so much. Raises Refused where no line turns so.
    """
    strokes = []
    for stroke in forward_strokes(turn_rad):
        chosen = spread(range(len(frames))[stroke], _MOST_FRAMES)
        angles = {int(frames[k]): float(turn_rad[k]) for k in chosen}
        strokes.append(moving_lines(pictures, angles, cameras))
    if not strokes:
        raise Refused("the hub does not turn forward in any stroke", code="no_forward_stroke")
    R = first_rig_about(np.eye(3, 4), strokes).T_rig_world[:, :3]
    return float(np.arctan2(R[0, 1], R[0, 0]))
