"""What can be checked of a session before any of it is evaluated: `check` lists all, `evaluate` stops."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from pathlib import Path

from bench.base.doubts import Doubts
from bench.base.errors import BadInput
from bench.base.results import hash_of_files
from bench.base.statuses import reason
from bench.session.array_view import load_views
from bench.session.frame_times import frame_times
from bench.session.session import Session, load_session
from bench.session.signals import forward_strokes, read_signals
from bench.session.trial import Trial
from vision.calibration.cameras_file import read_cameras
from vision.geometry.counted import counted
from vision.geometry.reasons import Reason
from vision.geometry.refusals import Refused
from vision.pictures.files import (
    STACK_SUFFIXES,
    VIDEO_SUFFIXES,
    page_count,
    picture_size,
    pictures_in,
)
from vision.pictures.frames import Frames

Size = tuple[int, int]


def checked_session(
    path: Path | str,
    doubts: Doubts | None = None,
    trials: Collection[str] | None = None,
    *,
    follow_links: bool = False,
) -> Session:
    """`load_session`, and every trial's signals, frame times and picture sizes read once.

    Raises BadInput at the first thing that is wrong; with a collecting `doubts` only where session.toml is.
    """
    doubts = doubts or Doubts()
    session = load_session(path, doubts, trials=trials, follow_links=follow_links)
    _check((session,), doubts)
    return session


def checked_views(
    path: Path | str,
    doubts: Doubts | None = None,
    trials: Collection[str] | None = None,
    *,
    follow_links: bool = False,
) -> tuple[Session, ...]:
    """The same with `load_views`: one session, or a view for each whisker of an array."""
    doubts = doubts or Doubts()
    views = load_views(path, doubts, trials=trials, follow_links=follow_links)
    _check(views, doubts)
    return views


def _check(views: Sequence[Session], doubts: Doubts) -> None:
    """Every recording of each whisker; pictures and files are the same for all."""
    for trial in (trial for view in views for trial in view.trials):
        check_recording(trial, doubts)
    check_sizes(views[0], doubts)
    for line in _copies(views[0]):
        doubts.note(line)


def _copies(session: Session) -> Iterator[Reason]:
    """A line on trials whose signals are those of another: noise is never the same twice."""
    alike: dict[str, list[Trial]] = {}
    sizes = Counter(trial.signals_path.stat().st_size for trial in session.trials)
    for trial in session.trials:
        if sizes[trial.signals_path.stat().st_size] > 1:
            alike.setdefault(hash_of_files([trial.signals_path]), []).append(trial)
    for trials in alike.values():
        if len(trials) > 1:
            names = ", ".join(trial.name for trial in trials)
            yield reason("signals_copied", names=names, file=trials[0].signals_path.name)


def check_recording(trial: Trial, doubts: Doubts) -> None:
    """Signals and frame times of one trial, and that they share a clock."""
    signals = times = None
    with doubts.guard():
        signals = read_signals(trial)
        _note_signals(trial, signals, doubts)
    with doubts.guard():
        times = frame_times(trial)
        for doubt in times.doubts:
            doubts.note(doubt)
    if signals is not None and times is not None and len(times):
        with doubts.guard():
            _check_clock(trial, signals.time_s, times.time_s, doubts)


def _note_signals(trial: Trial, signals, doubts: Doubts) -> None:
    shown = trial.shown(trial.signals_path.name)
    for doubt in signals.doubts:
        doubts.note(doubt)
    for cause, count in signals.dropped.items():
        doubts.note(reason("signals_mended", shown=shown, count=count, cause=cause))
    if trial.purpose != "weight" and not signals.doubts and not forward_strokes(signals):
        doubts.note(reason("no_forward_stroke", shown=shown))


def _check_clock(trial: Trial, signals_s, frames_s, doubts: Doubts) -> None:
    """Frames are taken while signals are recorded. Raises BadInput where most are not."""
    first, last = signals_s[0], signals_s[-1]
    outside = int(((frames_s < first) | (frames_s > last)).sum())
    found = f"frames from {frames_s[0]:.6g} to {frames_s[-1]:.6g} s, signals from {first:.6g} to {last:.6g} s"
    if outside > len(frames_s) / 2:
        in_ms = first <= frames_s.mean() / 1e3 <= last
        hint = (
            "Are the frames' times in milliseconds?"
            if in_ms
            else "They must be times of one clock."
        )
        raise BadInput(f"{found}. {hint}", file=f"trials/{trial.name}")
    if outside:
        taken = f"{counted(outside, 'frame')} taken while no signals were ({found})"
        doubts.note(Reason("frames_without_signals", f"trials/{trial.name}: {taken}"))


def check_sizes(session: Session, doubts: Doubts) -> None:
    """One camera, one picture size, in its boards, on the rig and in every trial."""
    calibrated: dict[str, Size] = {}
    with doubts.guard():
        calibrated = _calibrated_sizes(session)
    for camera in session.camera_names:
        with doubts.guard():
            _check_camera_sizes(session, camera, calibrated)


def _calibrated_sizes(session: Session) -> dict[str, Size]:
    if session.cameras_toml is None:
        return {}
    try:
        cameras = read_cameras(session.cameras_toml)
    except Refused as problem:
        raise BadInput(str(problem), file="cameras.toml") from None
    missing = [name for name in session.camera_names if name not in cameras.names]
    if missing:
        raise BadInput(
            f"has no camera {missing[0]}; it has {', '.join(cameras.names)}", file="cameras.toml"
        )
    return {name: tuple(cameras[name].size_px) for name in cameras.names}


def _check_camera_sizes(session: Session, camera: str, calibrated: dict[str, Size]) -> None:
    first = ("cameras.toml", calibrated[camera]) if camera in calibrated else None
    for shown, size in _picture_sizes(session, camera):
        first = first or (shown, size)
        if size != first[1]:
            allowed = f"{first[0]} is {_px(first[1])}; a camera has one size, and pictures are never rescaled"
            raise BadInput(f"is {_px(size)}, but {allowed}", file=shown)


def _picture_sizes(session: Session, camera: str) -> Iterator[tuple[str, Size]]:
    """(how messages name it, its size) of every picture and video of a camera that has a readable header."""
    sources = [session.board_sources, *(trial.camera_sources for trial in session.trials)]
    files = [
        file for by_camera in sources if camera in by_camera for file in _files(by_camera[camera])
    ]
    if camera in session.rig_pictures:
        files.append(session.rig_pictures[camera])
    for file in files:
        if (
            file.suffix.lower() in STACK_SUFFIXES
            and file.parent.name == camera
            and page_count(file) > 1
        ):
            found = f"holds {page_count(file)} pictures; a stack stands beside the camera's folder, in place of it"
            raise BadInput(
                f"{found}, as {camera}{file.suffix}", file=file.relative_to(session.path).as_posix()
            )
        size = _size(file)
        if size:
            yield file.relative_to(session.path).as_posix(), size


def _files(source: Path) -> list[Path]:
    return pictures_in(source) if source.is_dir() else [source]


def _size(file: Path) -> Size | None:
    """(width, height) from the header alone; None where it cannot be read (a damaged picture is no size)."""
    if file.suffix.lower() not in VIDEO_SUFFIXES:
        return picture_size(file)
    try:
        return Frames.open(file).size_px
    except Refused:
        return None


def _px(size: Size) -> str:
    return f"{size[0]} x {size[1]} px"


def find_damage(
    session: Session, doubts: Doubts, each: Callable[[Iterable], Iterable] = iter
) -> None:
    """Decode every picture of every trial and note those that cannot be read. `each` may show progress."""
    sources = [source for trial in session.trials for source in trial.camera_sources.values()]
    for source in each(sources):
        shown = source.relative_to(session.path).as_posix()
        try:
            damaged = [index for index, grey in Frames.open(source).read() if grey is None]
        except Refused as problem:
            doubts.note(Reason("frames_damaged", f"{shown}: {problem}"))
            continue
        if damaged:
            line = f"{shown}: frame {_few(damaged)} cannot be read (damaged or cut short)"
            doubts.note(Reason("frames_damaged", line))


def _few(indices: list[int], most: int = 5) -> str:
    shown = ", ".join(str(index) for index in indices[:most])
    return shown if len(indices) <= most else f"{shown} and {len(indices) - most} more"
