"""Checks of a session before any of it is evaluated: `check` lists all, `evaluate` stops."""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems, refused_as_bad_input, require_cameras
from bench.base.numbers import first_names
from bench.base.progress import count_parts
from bench.base.results import hash_of_files
from bench.base.statuses import reason
from bench.session.array_view import load_views
from bench.session.footage import size_px
from bench.session.frame_times import frame_times
from bench.session.object_board import board_on_object
from bench.session.session import Session, load_session
from bench.session.signals import Signals, forward_strokes, read_signals
from bench.session.traces import read_traces, read_traces_alone
from bench.session.trial import PLACE_UNCHECKED, Trial, require_object_placed
from bench.session.whisker import Whisker
from vision.calibration import check_crops, read_cameras
from vision.geometry import Cameras, Reason, Refused, counted
from vision.pictures import STACK_SUFFIXES, Frames, page_count, pictures_in

Size: TypeAlias = tuple[int, int]  # width, height, px
_MOST_NAMED = 5  # frames in one line
# [1/rad²] Of d_x by (10), at most: its error where the whisker turns by so much up to its contact, and is
# taken as straight. Study: curved_whiskers.py.
_D_X_BY_TURN2 = 0.36
# [points] Along a whisker that is looked for in the pictures of cameras.toml. A layout.
_POINTS_IN_SIGHT = 21
# [motor angles] At which it is looked for there. A layout.
_TURNS_IN_SIGHT = 36
# [1] Of d_x: below, straight will do; noise and touch are off by more. Stated.
_STRAIGHT_ENOUGH = 0.002


def checked_session(
    path: Path | str,
    problems: InputProblems | None = None,
    *,
    follow_links: bool = False,
) -> Session:
    """Load a session, and read every trial's signals, frame times and picture sizes once.

    Raises BadInput at the first thing that is wrong; with a collecting `problems` only where
    session.toml is.
    """
    problems = problems or InputProblems()
    session = load_session(path, problems, follow_links=follow_links)
    _check((session,), problems)
    return session


def checked_views(
    path: Path | str,
    problems: InputProblems | None = None,
    trials: Collection[str] | None = None,
    *,
    follow_links: bool = False,
) -> tuple[Session, ...]:
    """Load a session, or a view for each whisker of an array, and check it as `checked_session`."""
    problems = problems or InputProblems()
    views = load_views(path, problems, trials=trials, follow_links=follow_links)
    _check(views, problems)
    return views


def _check(views: Sequence[Session], problems: InputProblems) -> None:
    """Check every recording of each whisker; pictures and files are the same for all."""
    for view in views:
        trials = view.trials
        for trial in count_parts(trials, "recordings read", len(trials)):
            check_recording(trial, problems)
        if view.whisker is not None:
            _warn_of_curvature(view.whisker, problems)
    calibrated = check_sizes(views[0], problems)
    check_traces(views[0], calibrated, problems)
    for names, line in _copies(views[0]):
        problems.warn(line, names)


def _warn_of_curvature(whisker: Whisker, problems: InputProblems) -> None:
    """Warn where estimates by equations, which take the whisker as straight, are off by that."""
    turn2 = whisker.turn_rad**2
    if _D_X_BY_TURN2 * turn2 < _STRAIGHT_ENOUGH:
        return
    problems.warn(
        reason(
            "whisker_curved",
            turn_deg=np.degrees(whisker.turn_rad),
            d_x_percent=100 * _D_X_BY_TURN2 * turn2,
        )
    )


def _copies(session: Session) -> Iterator[tuple[list[str], Reason]]:
    """Yield the names of trials whose signals are those of another, and a line on them.

    Noise is never the same twice.
    """
    sizes = [trial.signals_path.stat().st_size for trial in session.trials]
    count = Counter(sizes)
    alike: dict[str, list[str]] = {}
    for trial, size in zip(session.trials, sizes):
        if count[size] > 1:
            alike.setdefault(hash_of_files([trial.signals_path]), []).append(trial.name)
    for names in alike.values():
        if len(names) > 1:
            file = session.trial(names[0]).signals_path.name
            yield names, reason("signals_copied", names=", ".join(names), file=file)


def check_recording(trial: Trial, problems: InputProblems) -> None:
    """Check signals and frame times of one trial, and that they share a clock."""
    signals = None
    times = None
    with problems.guard():
        signals = read_signals(trial)
        _warn_of_signals(trial, signals, problems)
    with problems.guard():
        times = frame_times(trial)
        for warning in times.warnings:
            problems.warn(warning)
    if times is not None and trial.trace_files and trial.camera_sources:
        with problems.guard():
            read_traces(trial.trace_files, trial.camera_sources, times.picture, trial.place)
    if signals is not None and times is not None and len(times):
        with problems.guard():
            _check_clock(trial, signals.time_s, times.time_s, problems)


def _warn_of_signals(trial: Trial, signals: Signals, problems: InputProblems) -> None:
    """Warn of what is odd in a trial's signals, and of what was mended in them."""
    label = trial.label(trial.signals_path.name)
    for warning in signals.warnings:
        problems.warn(warning)
    for cause, count in signals.dropped.items():
        problems.warn(reason("signals_mended", label=label, count=count, cause=cause))
    if trial.purpose != "weight" and not signals.warnings and not forward_strokes(signals):
        problems.warn(reason("no_forward_stroke", label=label))


def _check_clock(
    trial: Trial, signals_s: np.ndarray, frames_s: np.ndarray, problems: InputProblems
) -> None:
    """Raise BadInput where most frames were not taken while signals were recorded; note the rest."""
    first = signals_s[0]
    last = signals_s[-1]
    # samples that have no angle by pictures end within a step of the first and last frame
    step_s = float(np.median(np.diff(signals_s)))
    outside = int(((frames_s < first - step_s) | (frames_s > last + step_s)).sum())
    frames = f"frames from {frames_s[0]:.6g} to {frames_s[-1]:.6g} s"
    found = f"{frames}, signals from {first:.6g} to {last:.6g} s"
    if outside > len(frames_s) / 2:
        hint = "They must be times of one clock."
        if first <= frames_s.mean() / 1e3 <= last:
            hint = "Are the frames' times in milliseconds?"
        raise BadInput(f"{found}. {hint}", file=f"trials/{trial.name}")
    if outside:
        taken = f"{counted(outside, 'frame')} taken while no signals were ({found})"
        problems.warn(Reason("frames_without_signals", f"trials/{trial.name}: {taken}"))


def trials_with_whisks(session: Session) -> list[Trial]:
    """Return all trials but those with a weight. Raise BadInput where there is none, or no whisk
    in any.
    """
    trials = [trial for trial in session.trials if trial.purpose != "weight"]
    if not trials:
        raise BadInput("there is no trial to evaluate", file="trials")
    if not any(forward_strokes(read_signals(trial)) for trial in trials):
        found = "the motor goes forward in none of them; motor_deg grows as the whisker goes towards the bar"
        raise BadInput(f"there is no whisk: {found}", file="trials")
    return trials


def check_sizes(session: Session, problems: InputProblems) -> dict[str, Size]:
    """Check that each camera has one picture size: in its boards, on the rig, in every trial.

    Returns the sizes by cameras.toml; none without it, or where it is refused.
    """
    calibrated: dict[str, Size] = {}
    with problems.guard():
        calibrated = _calibrated_sizes(session)
    for camera in session.camera_names:
        with problems.guard():
            _check_camera_sizes(session, camera, calibrated.get(camera))
    return calibrated


def check_traces(session: Session, calibrated: Mapping[str, Size], problems: InputProblems) -> None:
    """Check the traces of each trial that has no pictures; calibrated: picture sizes by cameras.toml."""
    alone = [trial for trial in session.trials if trial.is_traced_alone]
    if not alone:
        return
    sizes_px = calibrated
    if session.cameras_toml is None:
        sizes_px = _sizes_of_pictures(session)
    for trial in alone:
        with problems.guard():
            count = len(frame_times(trial))
            points = read_traces_alone(trial, count, sizes_px, session.crops).object_points
            is_stated = session.truth is not None
            require_object_placed(trial, has_points=bool(points), is_stated=is_stated)
            if not points:
                problems.notes.append(f"{trial.place}: {PLACE_UNCHECKED}")
            if trial.shows_board:
                board_on_object(trial, session.board)


def _sizes_of_pictures(session: Session) -> dict[str, Size]:
    """Return the picture size of each camera of which a picture can be read."""
    found = {}
    for camera in session.camera_names:
        size = next(filter(None, map(_size, _files_of_camera(session, camera))), None)
        if size is not None:
            found[camera] = size
    return found


def _calibrated_sizes(session: Session) -> dict[str, Size]:
    """Return the picture sizes of cameras.toml; none without it.

    Raises BadInput where one is missing, or none of its cameras sees the whisker.
    """
    if session.cameras_toml is None:
        return {}
    with refused_as_bad_input("cameras.toml"):
        cameras = read_cameras(session.cameras_toml, session.pixel_aspects)
        check_crops(session.cameras_toml, session.crops)
    require_cameras(cameras, session.camera_names, "cameras.toml")
    if session.whisker is not None and session.base is None:
        _require_whisker_in_sight(cameras, session.whisker.length_mm)
    return {name: tuple(cameras[name].size_px) for name in cameras.names}


def _require_whisker_in_sight(cameras: Cameras, length_mm: float) -> None:
    """Raise BadInput where no camera has any of the whisker in its picture, at whatever motor angle."""
    turn_rad = np.linspace(0.0, 2.0 * np.pi, _TURNS_IN_SIGHT, endpoint=False)
    along_mm = np.linspace(0.0, length_mm, _POINTS_IN_SIGHT)[:, None]
    across = np.zeros((_POINTS_IN_SIGHT, _TURNS_IN_SIGHT))
    wires_mm = np.stack([along_mm * np.cos(turn_rad), along_mm * np.sin(turn_rad), across], axis=2)
    for camera in cameras:
        px = camera.project(wires_mm)
        if camera.has_in_picture(px).any():
            return
    found = "no camera would see a whisker that turns about the rig frame's z"
    cure = "`whisker-bench calibrate cameras` places them in the rig frame"
    raise BadInput(f"{found}: are its cameras in another frame? {cure}", file="cameras.toml")


def _check_camera_sizes(session: Session, camera: str, calibrated_size: Size | None) -> None:
    """Raise BadInput where a picture of a camera has another size than the first.

    calibrated_size: by cameras.toml, of a part of a picture that part's.
    """
    first_file = "cameras.toml"
    first_size = calibrated_size
    crop = session.crops.get(camera)
    if crop is not None:
        if calibrated_size not in (None, crop.size_px):
            found = f"has {camera} as {_px(calibrated_size)}, but its part of {crop.of}'s picture is {_px(crop.size_px)}"
            raise BadInput(f"{found}; is it of another crop?", file=first_file)
        first_size = None
    for file in _files_of_camera(session, camera):
        label = file.relative_to(session.path).as_posix()
        _check_stack(file, camera, label)
        size = _size(file)
        if size is None:
            continue
        if first_size is None:
            first_file = label
            first_size = size
        if size != first_size:
            found = f"is {_px(size)}, but {first_file} is {_px(first_size)}"
            rule = "a camera has one size, and pictures are never rescaled"
            raise BadInput(f"{found}; {rule}", file=label)


def _files_of_camera(session: Session, camera: str) -> Iterator[Path]:
    """Yield every picture and video of a camera."""
    for sources in (session.board_sources, *(trial.camera_sources for trial in session.trials)):
        source = sources.get(camera)
        if source is not None:
            yield from pictures_in(source) if source.is_dir() else [Path(source)]
    if camera in session.rig_pictures:
        yield Path(session.rig_pictures[camera])


def _check_stack(file: Path, camera: str, label: str) -> None:
    """Raise BadInput for a stack of pictures within the camera's folder."""
    if file.suffix.lower() not in STACK_SUFFIXES or file.parent.name != camera:
        return
    count = page_count(file)
    if count > 1:
        rule = "a stack stands beside the camera's folder, in place of it"
        raise BadInput(f"holds {count} pictures; {rule}, as {camera}{file.suffix}", file=label)


def _size(file: Path) -> Size | None:
    """Return the size of a picture or video; None where it cannot be read."""
    try:
        return size_px(file)
    except Refused:
        return None


def _px(size: Size) -> str:
    """Return a size as messages have it."""
    return f"{size[0]} x {size[1]} px"


def find_damage(session: Session, problems: InputProblems) -> None:
    """Decode every picture of every trial and note those that cannot be read."""
    sources = []
    for trial in session.trials:
        sources += dict.fromkeys(map(Path, trial.camera_sources.values()))
    for source in count_parts(sources, "pictures of trials", len(sources)):
        found = _damage(source)
        if found:
            label = source.relative_to(session.path).as_posix()
            problems.warn(Reason("frames_damaged", f"{label}: {found}"))


def _damage(source: Path) -> str:
    """Decode all frames of a source; return which cannot be read, '' where all can."""
    try:
        damaged = [index for index, grey in Frames.open(source).read() if grey is None]
    except Refused as problem:
        return str(problem)
    if not damaged:
        return ""
    return f"frame {first_names(damaged, _MOST_NAMED)} cannot be read (damaged or cut short)"
