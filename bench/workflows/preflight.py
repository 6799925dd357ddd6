"""`whisker-bench check`: everything that `evaluate` would refuse or doubt and that a look of some seconds finds."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from tqdm import tqdm

from bench.base.doubts import Doubts
from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.base.threads import in_threads
from bench.gauges.felt import FeltStroke, strokes_of
from bench.gauges.fit import RECORD, in_two_directions
from bench.gauges.gauge_faults import check_alive
from bench.gauges.gauges_file import given_gauges
from bench.session.footage import frame_count, read_frames, rig_picture
from bench.session.frame_times import FrameTimes, dropped, frame_times, read_trial
from bench.session.session import Session
from bench.session.session_check import checked_views, find_damage
from bench.session.signals import Signals, forward_strokes, read_signals
from bench.session.trial import Trial
from bench.trials.still_scene import evenly_exposed, other_scene
from vision.boards.corners import MIN_CORNERS, edge_blur_px, find_corners
from vision.boards.diagnosis import why_not_found
from vision.boards.sufficiency import MIN_VIEWS, fixes_pose
from vision.fit.touch import FEWEST_FREE
from vision.geometry.counted import counted

_BOARD_LOOKS = 2  # pictures of a series: a board that is in none of them is in few
_FRAME_LOOKS = 5  # of a trial: exposure and scene
# px, sigma: lenses in focus have 0.6 to 1.2; from 2 on the small session's boards are not found. Set by eye.
_MOST_BLUR_PX = 1.5
_MOST_SATURATED = 0.1  # of a channel's samples in a stroke


def check(path: Path, progress: bool, *, follow_links: bool = False) -> int:
    """Print refusals and notes. Returns the exit code: 2 where there is a refusal, 1 where a note, else 0."""
    doubts = Doubts(stop_at_first=False)
    with doubts.guard():
        views = checked_views(path, doubts, follow_links=follow_links)
        session = views[0]
        find_damage(
            session, doubts, each=partial(tqdm, desc="pictures", disable=not progress, leave=False)
        )
        for view in views:
            look_ahead(view, doubts)
    for line in dict.fromkeys(doubts.refusals):
        print(f"bad: {line}")
    for line in dict.fromkeys(doubts.notes):
        print(f"doubtful: {line}")
    if not (doubts.refusals or doubts.notes):
        whiskers = f", {counted(len(views), 'whisker')}" if session.base else ""
        print(
            f"{session.whole_name}{whiskers}: {counted(len(session.trials), 'trial')}, nothing wrong or doubtful"
        )
    return 2 if doubts.refusals else 1 if doubts.notes else 0


def look_ahead(session: Session, doubts: Doubts) -> None:
    """Boards, gauges, strokes, frames and scene of a session whose files are sound, each by a quick look."""
    if session.cameras_toml is None and session.board is not None:
        with doubts.guard():  # one board for all cameras: what is wrong with it is looked for once
            for name in session.board_sources:
                for line in _check_boards(session, name):
                    doubts.note(line)
    if session.whisker is not None:
        with doubts.guard():
            given_gauges(session)
    rig: dict[str, np.ndarray | None] = {}
    for name, picture in session.rig_pictures.items():
        with doubts.guard():
            rig[name] = rig_picture(picture)
    pushes: list[np.ndarray] = []
    for trial in (trial for trial in session.trials if trial.purpose != "weight"):
        with doubts.guard():
            signals = read_signals(trial)
            strokes = strokes_of(signals, trial, Settings()) if forward_strokes(signals) else []
            if trial.purpose == "gauge" and signals.kind == "V":
                pushes += _pushes(strokes)
            times = frame_times(trial)
            felt = [*_of_gauges(signals, strokes), *_of_strokes(signals, strokes, times)]
            for line in [*felt, *_of_scene(trial, times, rig)]:
                doubts.note(f"{trial.place}: {line}")
    own = session.gauges_toml is None and session.gauges is None
    if own and pushes and not in_two_directions(np.array(pushes)):
        doubts.note(
            f"trials: the gauge trials push in one direction, which does not fix both channels; {RECORD}"
        )


def _pushes(strokes: Sequence[FeltStroke]) -> Iterator[np.ndarray]:
    """Volts (2,) that each stroke's push gives at the usual angle, where it gets there."""
    for stroke in strokes:
        touch = stroke.touch()
        at = None if touch.status else stroke.at(Settings().theta_rad, touch)
        if at is not None and not at.status:
            yield at.values


def _check_boards(session: Session, name: str) -> Iterator[str]:
    """A line where a camera sees the board on the rig out of focus. Raises BadInput where its board is not found as
    entered, or not on the rig."""
    source = session.board_sources[name]
    count = frame_count(source)
    if count < MIN_VIEWS:
        few = f"has {counted(count, 'view')}, {MIN_VIEWS} are the least and 15 are good"
        raise BadInput(few, file=f"boards/{name}")
    chosen = np.unique(np.linspace(0, count - 1, _BOARD_LOOKS).astype(int)).tolist()
    greys = [grey for grey in read_frames(source, chosen).values() if grey is not None]
    found = list(
        in_threads(lambda grey: fixes_pose(find_corners(grey, session.board), session.board), greys)
    )
    if not any(found):
        reason = why_not_found(greys, session.board)
        none = f"the board is found in none of {counted(len(greys), 'picture')}"
        raise BadInput(reason or none, file=f"boards/{name}")
    picture = session.rig_pictures.get(name)
    grey = None if picture is None else rig_picture(picture)
    if grey is not None and len(find_corners(grey, session.board)) < MIN_CORNERS:
        hint = "the board must stand in view of every camera"
        raise BadInput(
            f"the board on the rig is not seen; {hint}", file=f"boards/rig/{picture.name}"
        )
    blur_px = np.nan if grey is None else edge_blur_px(grey, session.board)
    if blur_px > _MOST_BLUR_PX:
        found = f"edges are blurred by {blur_px:.1f} px, {_MOST_BLUR_PX:g} is a lot"
        yield f"boards/rig/{picture.name}: {found}: focus on the whisker, or let the camera rest"


def _of_gauges(signals: Signals, strokes: Sequence[FeltStroke]) -> Iterator[str]:
    """Channels that stand still or are at their rail."""
    try:
        check_alive(strokes)
    except BadInput as bad:
        yield bad.reason
        return
    for name, column in zip("yz", range(2)):
        saturated = [np.isnan(stroke.channels[:, column]).mean() for stroke in strokes]
        if saturated and max(saturated) > _MOST_SATURATED:
            share = f"{100 * max(saturated):.0f} % of a stroke"
            yield f"channel {name} is at its rail for {share}: raise the amplifier's range"


def _of_strokes(
    signals: Signals, strokes: Sequence[FeltStroke], times: FrameTimes
) -> Iterator[str]:
    """Whether each stroke has a free part, a touch that is felt, and reaches the usual pushing angle."""
    yield from dropped(
        times, [times.frames_in(signals, where) for where in forward_strokes(signals)]
    )
    for number, stroke in enumerate(strokes):
        touch = stroke.touch()
        if touch.status:
            yield f"whisk {number}: {touch.status}"
            continue
        theta_deg, usual_deg = (
            float(np.degrees(stroke.motor_rad.max() - touch.motor_rad)),
            Settings().theta_deg,
        )
        if theta_deg < usual_deg:
            yield f"whisk {number} goes {theta_deg:.1f}° past touch, {usual_deg:g}° is the usual --theta-deg"
        motor = signals.motor_at(
            times.time_s[times.frames_in(signals, forward_strokes(signals)[number])]
        )
        free = int(np.sum(motor < touch.motor_rad))
        if len(motor) and free < FEWEST_FREE:
            yield f"whisk {number} has {counted(free, 'frame')} before touch, {FEWEST_FREE} are needed"


def _of_scene(trial: Trial, times: FrameTimes, rig: dict[str, np.ndarray | None]) -> Iterator[str]:
    """Cameras that show another scene than the rig picture, and exposure that changes."""
    if not len(times):
        return
    looks = np.unique(np.linspace(0, len(times) - 1, _FRAME_LOOKS).astype(int)).tolist()
    for name, pictures in read_trial(trial, times, looks).items():
        said = other_scene(name, pictures, rig) if pictures else "none of its frames can be read"
        if said:
            yield f"camera {name}: {said}"
        else:
            yield from evenly_exposed(name, pictures)[1]
