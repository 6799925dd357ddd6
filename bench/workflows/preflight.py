"""`whisker-bench check`: all that `evaluate` would refuse or warn of.

Files are read whole; of pictures some are evaluated: those of the board that calibrate the cameras, five of each trial.
"""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from bench.base.errors import BadInput
from bench.base.exit_codes import BAD_INPUT, DONE, WITH_WARNINGS
from bench.base.input_problems import InputProblems
from bench.base.progress import count_parts
from bench.base.settings import Settings
from bench.cameras.measured_place import contradiction, place_line
from bench.gauges.felt import FeltStroke, strokes_of
from bench.gauges.fit import RECORD, in_two_directions
from bench.gauges.gauge_faults import check_alive
from bench.gauges.gauges_file import given_gauges
from bench.session.abilities import ability_lines
from bench.session.footage import rig_picture
from bench.session.frame_times import FrameTimes, dropped, frame_times, read_trial
from bench.session.given_lines import assumed_line
from bench.session.session import Session
from bench.session.session_check import checked_views, find_damage, trials_with_whisks
from bench.session.signals import Signals, forward_strokes, read_signals
from bench.session.trial import Trial
from bench.session.whisker import Whisker
from bench.trials.moment_size import check_moment_size
from bench.trials.still_scene import evenly_exposed, other_scene
from vision import FEWEST_FREE
from vision.boards import estimate_optics
from vision.geometry import Board, counted, spread
from vision.pictures import PicturePart

# [1] Frames of a trial whose exposure and scene are compared. Stated.
_SCENE_FRAMES = 5
# [px] Largest blur (sigma) of a board's edges: lenses in focus have 0.6 to 1.2; from 2 on the small
# session's boards are not found. Stated, between the two: it makes a warning, and enters no number.
_LARGEST_BLUR_PX = 1.5
# [1] Largest share of a channel's samples in a stroke that are saturated. Stated.
_LARGEST_SATURATED_SHARE = 0.1


def check(path: Path, *, follow_links: bool = False) -> int:
    """Print refusals and warnings of a session, and what places its rig.

    Return the exit code: 2 where there is a refusal, 1 where there is a warning, else 0.
    """
    problems = InputProblems(stop_at_first=False)
    assumed = ""
    placed = ""
    with problems.guard():
        views = checked_views(path, problems, follow_links=follow_links)
        session = views[0]
        find_damage(session, problems)
        check_cameras(session.whole or session, problems)
        for view in views:
            check_contents(view, problems)
            with problems.guard():
                trials_with_whisks(view)
        assumed = assumed_line(views)
        if session.has_pictures:
            placed = place_line(session)
    _print_problems(problems)
    if assumed:
        print(f"assumed: {assumed}")
    if problems.refusals:
        return BAD_INPUT
    if placed:
        print(f"rig: {placed}")
    for line in ability_lines(session):
        print(line)
    if problems.warnings:
        return WITH_WARNINGS
    _print_sound(session, len(views))
    print(f"then run: whisker-bench evaluate {path} --out OUT")
    return DONE


def _print_sound(session: Session, whiskers: int) -> None:
    """Print that a session of so many whiskers has no error and no warning."""
    of_whiskers = f", {counted(whiskers, 'whisker')}" if session.base else ""
    trials = counted(len(session.trials), "trial")
    print(f"{session.whole_name}{of_whiskers}: {trials}, no error, no warning")


def _print_problems(problems: InputProblems) -> None:
    """Print each refusal, then each warning and note, once."""
    for line in dict.fromkeys(problems.refusals):
        print(f"error: {line}")
    for line in dict.fromkeys(problems.warnings):
        print(f"warning: {line}")
    for line in problems.notes:
        print(f"note: {line}")


def check_contents(session: Session, problems: InputProblems) -> None:
    """Check gauges, strokes, frames and scene of a session whose files are sound.

    What is found is added to `problems`.
    """
    disagreement = contradiction(session)
    if disagreement is not None:
        problems.warn(disagreement)
    if session.whisker is not None:
        with problems.guard():
            given_gauges(session)
    rig: dict[str, np.ndarray] = {}
    for name, picture in session.rig_pictures.items():
        with problems.guard():
            rig[name] = rig_picture(picture)
    pushes_V = _check_trials(session, rig, problems)
    has_own_gauges = session.gauges_toml is not None or session.gauges is not None
    if not has_own_gauges and pushes_V and not in_two_directions(np.array(pushes_V)):
        problems.warn(
            f"trials: the gauge trials push in one direction, which does not fix both channels; {RECORD}"
        )


def check_cameras(session: Session, problems: InputProblems) -> None:
    """Calibrate the cameras by pictures of the board, where the session brings no cameras along.

    What is found is added to `problems`.
    """
    has_pictures = session.has_pictures or bool(session.board_sources)
    if session.cameras_toml is not None or not has_pictures:
        return
    from bench.cameras.calibration_check import check_calibration  # it loads solvers

    with problems.guard():
        for warning in check_calibration(session):
            problems.warn(warning)
    for picture in session.rig_pictures.values():
        with problems.guard():
            _check_rig_board(picture, session.board, problems)


def _check_trials(
    session: Session, rig: dict[str, np.ndarray], problems: InputProblems
) -> list[np.ndarray]:
    """Check every trial but the weights'; return the volts (2,) of the pushes of the gauge trials.

    There are none where one of these cannot be read: which way it pushes is not known. rig: pictures of the rig, by
    camera.
    """
    pushes_V: list[np.ndarray] = []
    trials = session.trials
    unread = {trial.name for trial in trials if trial.purpose == "gauge"}
    for trial in count_parts(trials, "strokes, exposure and scene of trials", len(trials)):
        if trial.purpose == "weight":
            continue
        with problems.guard():
            signals = read_signals(trial)
            unread.discard(trial.name)
            strokes = strokes_of(signals, trial, Settings()) if forward_strokes(signals) else []
            if trial.purpose == "gauge" and signals.kind == "V":
                pushes_V += _pushes(strokes)
            if session.whisker is not None and signals.kind == "Nmm":
                _check_moments(trial, strokes, session.whisker, problems)
            _check_trial(trial, signals, strokes, rig, problems)
            if session.truth is not None:
                _check_stage(session, trial, signals, problems)
    return [] if unread else pushes_V


def _check_stage(session: Session, trial: Trial, signals: Signals, problems: InputProblems) -> None:
    """Add a warning for each whisk of which the stage states no truth, or contradicts itself.

    Raise BadInput where no contact can be as stated.
    """
    from bench.trials.stated_truth import stated_whisk  # it loads the solvers of the truth

    for number, stroke in enumerate(forward_strokes(signals)):
        said = stated_whisk(session, trial, signals, stroke).truth.status
        if said:
            problems.warn(said.about(f"{trial.place}, whisk {number}"))


def _check_moments(
    trial: Trial, strokes: Sequence[FeltStroke], whisker: Whisker, problems: InputProblems
) -> None:
    """Add a warning for each whisk with moments that this whisker cannot give."""
    theta_rad = Settings().theta_rad
    for number, moments_Nmm in enumerate(_pushes(strokes)):
        odd = check_moment_size(moments_Nmm, theta_rad, whisker)
        if odd:
            problems.warn(odd.about(f"{trial.place}, whisk {number}"))


def _check_trial(
    trial: Trial,
    signals: Signals,
    strokes: Sequence[FeltStroke],
    rig: dict[str, np.ndarray],
    problems: InputProblems,
) -> None:
    """Add warnings and notes of a trial to `problems`. rig: pictures of the rig, by camera. Raise
    BadInput."""
    times = frame_times(trial)
    frames = [times.frames_in(signals, where) for where in forward_strokes(signals)]
    problems.notes += [f"{trial.place}: {line}" for line in dropped(times, frames)]
    lines = [
        *_gauge_warnings(strokes),
        *_stroke_warnings(signals, strokes, times, frames),
        *_scene_warnings(trial, times, rig),
    ]
    for line in lines:
        problems.warn(f"{trial.place}: {line}")


def _pushes(strokes: Sequence[FeltStroke]) -> Iterator[np.ndarray]:
    """Yield the channels (2,) of each stroke at the usual pushing angle, where it gets there."""
    for stroke in strokes:
        touch = stroke.touch
        if touch.status:
            continue
        at = stroke.at(Settings().theta_rad, touch)
        if not at.status:
            yield at.values


def _check_rig_board(picture: Path | PicturePart, board: Board, problems: InputProblems) -> None:
    """Add a warning where a camera's picture of the board on the rig is blurred. Raise BadInput."""
    blur_px = estimate_optics(rig_picture(picture), board).blur_px
    if blur_px > _LARGEST_BLUR_PX:
        blurred = f"edges are blurred by {blur_px:.1f} px, {_LARGEST_BLUR_PX:g} is a lot"
        cure = "focus on the whisker, or let the camera rest"
        problems.warn(f"boards/rig/{picture.name}: {blurred}: {cure}")


def _gauge_warnings(strokes: Sequence[FeltStroke]) -> Iterator[str]:
    """Yield a line for each channel that does not change or is at its rail."""
    try:
        check_alive(strokes)
    except BadInput as bad:
        yield bad.reason
        return
    for column, name in enumerate("yz"):
        shares = [np.isnan(stroke.channels[:, column]).mean() for stroke in strokes]
        saturated = max(shares, default=0.0)
        if saturated > _LARGEST_SATURATED_SHARE:
            share = f"{100 * saturated:.0f} % of a stroke"
            yield f"channel {name} is at its rail for {share}: raise the amplifier's range"


def _stroke_warnings(
    signals: Signals,
    strokes: Sequence[FeltStroke],
    times: FrameTimes,
    frames: Sequence[slice],
) -> Iterator[str]:
    """Yield a line for each stroke that cannot be evaluated. frames: those of each stroke.

    A stroke needs a free part, a felt touch, and the usual pushing angle.
    """
    usual_deg = Settings().theta_deg
    for number, stroke in enumerate(strokes):
        touch = stroke.touch
        if touch.status:
            yield f"whisk {number}: {touch.status}"
            continue
        theta_deg = math.degrees(stroke.motor_rad.max() - touch.motor_rad)
        if theta_deg < usual_deg:
            yield f"whisk {number} goes {theta_deg:.1f}° past touch, {usual_deg:g}° is the usual --theta-deg"
        motor_rad = signals.motor_at(times.time_s[frames[number]])
        free = int(np.sum(motor_rad < touch.motor_rad))
        if len(motor_rad) and free < FEWEST_FREE:
            yield f"whisk {number} has {counted(free, 'frame')} before touch, {FEWEST_FREE} are needed"


def _scene_warnings(trial: Trial, times: FrameTimes, rig: dict[str, np.ndarray]) -> Iterator[str]:
    """Yield a line for each camera whose scene is not the rig picture's, or whose exposure
    changes."""
    if not len(times):
        return
    chosen = spread(range(len(times)), _SCENE_FRAMES)
    for name, pictures in read_trial(trial, times, chosen).items():
        if not pictures:  # `find_damage` names them
            continue
        fault = other_scene(name, pictures, rig)
        if fault:
            yield f"camera {name}: {fault}"
        else:
            _, _, lost = evenly_exposed(name, pictures)
            if lost:  # some of the frames have shown it; all of them tell which
                every = read_trial(trial, times)[name]
                _, _, lost = evenly_exposed(name, every)
            yield from lost
