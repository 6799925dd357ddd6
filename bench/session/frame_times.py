"""When each frame of a trial was taken, on the signals' clock, and which picture of each camera it is."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.errors import BadInput
from bench.session.daq import DaqFile, frame_edges, read_daq
from bench.session.footage import declared_rate_Hz, decoded_count, frame_count, read_frames
from bench.session.signals import Signals
from bench.session.table import (
    NumberTable,
    forward_in_time,
    read_table,
    require_columns,
    require_rising,
)
from bench.session.trial import Trial
from vision.geometry import Reason, Refused, counted
from vision.pictures import Frames, PicturePart

FRAME = "frame"
TIME = "time_s"
# A gap of so many usual steps inside a whisk is a dropped frame.
_DROPPED_STEPS = 1.5
# [1] Of the interval stated, beyond the steps in which times are written. Study: no time and no
# warning of the sessions of tests/studies/net.py changes at half or at twice of it.
_RATE_TOLERANCE = 1e-3
# A header's rate is nominal: crystals are right to 1e-4, a computer's timers to some 1e-3.
_HEADER_TOLERANCE = 1e-2
# [frames] Most in a line.
_MOST_NAMED = 5
# [s] Times are written to a millisecond or better.
_CLOCK_STEP_S = 1e-3


@dataclass(frozen=True)
class FrameTimes:
    """The frames of a trial in time.

    time_s: (n,) middle of the exposure of each frame, s, increasing. source: where the times come
    from. picture: camera to (n,) the index of its picture of each frame, −1 where that camera
    dropped it. spread_s: the largest difference between cameras within one frame. warnings: lines
    that the user should read. clock_sigma_s: how well the times are known on the signals' clock: 0
    where they were recorded on it, else half a frame. Forward strokes do not determine it: an
    offset of the clock is indistinguishable from one of the encoder's zero.
    """

    time_s: np.ndarray
    source: str
    picture: Mapping[str, np.ndarray]
    spread_s: float = 0.0
    warnings: tuple[str, ...] = ()
    clock_sigma_s: float = 0.0

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.time_s)

    def frames_in(self, signals: Signals, stroke: slice) -> slice:
        """Return the frames taken during a stroke (a slice of samples), as a slice of frame indices."""
        half_s = 0.5 / signals.rate_Hz
        first, last = signals.time_s[stroke][[0, -1]]
        return slice(*np.searchsorted(self.time_s, [first - half_s, last + half_s]).tolist())

    def lost_in(self, frames: slice) -> list[tuple[float, int]]:
        """Return after which times, s, how many of a stroke's frames were dropped.

        They are dropped in gaps of more than `_DROPPED_STEPS` usual steps.
        """
        steps = np.diff(self.time_s[frames])
        if len(steps) < 2:
            return []
        usual = float(np.median(steps))
        lost = []
        for time_s, step in zip(self.time_s[frames].tolist(), steps.tolist()):
            if step > _DROPPED_STEPS * usual:
                lost.append((time_s, max(1, round(step / usual) - 1)))
        return lost


def frame_times(trial: Trial) -> FrameTimes:
    """Return the frame times of a trial, from the first source that there is.

    In this order: frames.csv, frames_<camera>.csv, edges of a DAQ channel, frame_rate_Hz and
    first_frame_s, the container's times. Raises BadInput where there is none, times do not
    increase, their number is not that of the frames, or the stated frame rate is another.
    """
    if (trial.folder / "frames.csv").is_file():
        return _in_common_file(trial)
    cameras = list(trial.camera_sources)
    with_own = [c for c in cameras if (trial.folder / _own_file(trial, c)).is_file()]
    if with_own:
        missing = [camera for camera in cameras if camera not in with_own]
        if missing:
            found = f"is missing, and camera {with_own[0]} has its own"
            raise BadInput(found, file=trial.label(_own_file(trial, missing[0])))
        return _in_own_files(trial)
    if trial.is_traced_alone:
        found = "is missing; traces without pictures need the times of their frames: frame,time_s"
        raise BadInput(found, file=trial.label("frames.csv"))
    if not cameras:
        return FrameTimes(np.array([]), "none", {})
    if trial.daq is not None and "frame_V" in trial.daq.channels:
        return _by_edges(trial, trial.daq)
    return _at_stated_rate(trial) if trial.frame_rate_Hz else _in_container(trial)


def read_trial(
    trial: Trial, times: FrameTimes, wanted: Iterable[int] | None = None
) -> dict[str, dict[int, np.ndarray]]:
    """Read grey pictures by camera and frame index; lost ones are left out.

    wanted: frame indices; None: all.
    """
    indices = np.arange(len(times)) if wanted is None else np.array(sorted(set(wanted)), dtype=int)
    frames = {}
    for name, source in trial.camera_sources.items():
        pictures = times.picture[name][indices]
        read = read_frames(source, pictures[pictures >= 0].tolist())
        taken = zip(indices.tolist(), pictures.tolist())
        frames[name] = {frame: read[k] for frame, k in taken if read.get(k) is not None}
    return frames


def dropped(times: FrameTimes, places: Iterable[slice]) -> Iterator[str]:
    """Yield a line for each whisk with gaps between its frames' times."""
    for number, place in enumerate(places):
        lost = times.lost_in(place)
        if lost:
            at = ", ".join(f"{time_s:.3f}" for time_s, _ in lost[:_MOST_NAMED])
            frames = counted(sum(count for _, count in lost), "frame")
            yield f"whisk {number}: {frames} dropped by all cameras (after {at} s)"


def _own_file(trial: Trial, camera: str) -> str:
    """Return the name of the file of a camera's own times, those of the picture that it is a part of."""
    source = trial.camera_sources[camera]
    pictures = source.crop.of if isinstance(source, PicturePart) else camera
    return f"frames_{pictures}.csv"


def _all_pictures(trial: Trial, count: int) -> dict[str, np.ndarray]:
    """Return the pictures (count,) of each camera where none dropped a frame."""
    return {camera: np.arange(count) for camera in trial.camera_sources}


def _in_common_file(trial: Trial) -> FrameTimes:
    """Return the times of frames.csv: all cameras were triggered together."""
    label = trial.label("frames.csv")
    table, repeats = _read(trial.folder / "frames.csv", label)
    warnings: list[str] = []
    for camera in trial.camera_sources:
        warnings += _count_warnings(trial, camera, len(table), label)
    _check_rate(table[TIME], trial, label)
    warnings += _header_warnings(table[TIME], trial, trial.camera_sources, label)
    if repeats:
        line = f"{label}: {counted(repeats, 'repeated row')} dropped"
        warnings.append(Reason("rows_repeated", line))
    picture = _all_pictures(trial, len(table))
    return FrameTimes(table[TIME], "frames.csv", picture, warnings=tuple(warnings))


def _in_own_files(trial: Trial) -> FrameTimes:
    """Return the merged times of frames_<camera>.csv."""
    times_s = {}
    warnings: list[str] = []
    for camera in trial.camera_sources:
        label = trial.label(_own_file(trial, camera))
        table, _ = _read(trial.folder / _own_file(trial, camera), label)
        warnings += _count_warnings(trial, camera, len(table), label)
        warnings += _header_warnings(table[TIME], trial, [camera], label)
        times_s[camera] = table[TIME]
    time_s, picture, spread_s = merge_times(times_s)
    return FrameTimes(time_s, "frames_<camera>.csv", picture, spread_s, tuple(warnings))


def merge_times(
    times_s: Mapping[str, np.ndarray],
) -> tuple[np.ndarray, dict[str, np.ndarray], float]:
    """Merge several cameras' times (n_camera,) to one series of frames.

    Frames of different cameras nearer than half a step are one; its time is the mean of the cameras
    that have it. Returns time_s (n,), camera -> picture index or −1 (n,), and the largest spread
    within a frame, s.
    """
    every = np.sort(np.concatenate(list(times_s.values())))
    gaps = np.diff(every) > _shortest_step_s(times_s) / 2
    firsts = np.append(0, np.flatnonzero(gaps) + 1)  # of each frame, in `every`
    lasts = np.append(firsts[1:], len(every)) - 1
    picture = {name: _picture_numbers(times, every[firsts]) for name, times in times_s.items()}
    mean_s = np.add.reduceat(every, firsts) / (lasts - firsts + 1)
    return mean_s, picture, float(np.max(every[lasts] - every[firsts]))


def _picture_numbers(times_s: np.ndarray, begins_s: np.ndarray) -> np.ndarray:
    """Return the number (frames,) of a camera's picture in each frame, −1 where it has none.

    times_s (n,): of its pictures. begins_s (frames,): when each frame begins.
    """
    frame = np.searchsorted(begins_s, times_s, side="right") - 1
    picture = np.full(len(begins_s), -1)
    picture[frame] = np.arange(len(times_s))
    return picture


def _shortest_step_s(times_s: Mapping[str, np.ndarray]) -> float:
    """Return the least of the cameras' median steps; infinite where none has two pictures."""
    steps_s = [np.median(np.diff(times)) for times in times_s.values() if len(times) > 1]
    return min(steps_s, default=np.inf)


def _by_edges(trial: Trial, daq: DaqFile) -> FrameTimes:
    """Return the rising edges of a channel of the DAQ, one a frame of every camera."""
    path = trial.signals_path
    label = trial.label(path.name)
    edges_s = frame_edges(path, daq, read_daq(path, daq, label)[TIME], label)
    count = _one_count(_frame_counts(trial), trial)
    if len(edges_s) != count:
        rises = f"channel {daq.channels['frame_V'].channel} rises {len(edges_s)} times"
        found = f"{rises}, the cameras have {count} frames"
        raise BadInput(f"{found}; there must be an edge a frame", file=label)
    warnings = tuple(_header_warnings(edges_s, trial, trial.camera_sources, label))
    picture = _all_pictures(trial, count)
    return FrameTimes(edges_s, "edges of a DAQ channel", picture, warnings=warnings)


def _at_stated_rate(trial: Trial) -> FrameTimes:
    """Return the times by frame_rate_Hz and first_frame_s of trial.toml."""
    count = _one_count(_frame_counts(trial), trial)
    warnings: tuple[str, ...] = ()
    if trial.first_frame_s is None:
        line = f"{_shown(trial)}: first_frame_s is not given; taken as 0"
        warnings = (Reason("first_frame_not_stated", line),)
    time_s = (trial.first_frame_s or 0.0) + np.arange(count) / trial.frame_rate_Hz
    return FrameTimes(
        time_s,
        "frame_rate_Hz",
        _all_pictures(trial, count),
        warnings=warnings,
        clock_sigma_s=_clock_sigma_s(trial, 1.0 / trial.frame_rate_Hz),
    )


def _in_container(trial: Trial) -> FrameTimes:
    """Return the times that the video's container states, which may be any clock's."""
    times_s = {}
    for camera, source in trial.camera_sources.items():
        times_s[camera] = _container_times(source, trial)
    count = _one_count({camera: len(times) for camera, times in times_s.items()}, trial)
    first = next(iter(trial.camera_sources))
    video = trial.camera_sources[first].name
    line = f"{_shown(trial)}: frame times are those of {video}'s container"
    untied = f"{line}; nothing ties them to the signals' clock"
    interval_s = float(np.median(np.diff(times_s[first]))) if count > 1 else 0.0
    return FrameTimes(
        (trial.first_frame_s or 0.0) + times_s[first],
        "container",
        _all_pictures(trial, count),
        warnings=(Reason("clock_of_container", untied),),
        clock_sigma_s=_clock_sigma_s(trial, interval_s),
    )


def _clock_sigma_s(trial: Trial, interval_s: float) -> float:
    """Return the sigma of frame times that no recorded edge ties to the signals.

    It is the first frame's where stated, else half a frame.
    """
    is_stated = trial.first_frame_s is not None and trial.first_frame_sigma_s is not None
    return trial.first_frame_sigma_s if is_stated else 0.5 * interval_s


def _container_times(source: Path, trial: Trial) -> np.ndarray:
    """Return the times (n,) of a video's container, s. Raise BadInput where there are none."""
    fix = "write frames.csv (frame,time_s), or frame_rate_Hz and first_frame_s into trial.toml"
    found = None
    if not source.is_dir():
        try:
            found = Frames.open(source).times_s
        except Refused as problem:
            line = f"there are no frame times, and {problem}; {fix}"
            raise BadInput(line, file=_shown(trial)) from None
    if found is None:
        raise BadInput(f"there are no frame times; {fix}", file=trial.label("frames.csv"))
    return found


def _read(path: Path, label: str) -> tuple[NumberTable, int]:
    """Read a table of frame times; return it and how many repeated rows it had.

    Raises BadInput where times or frame numbers do not increase.
    """
    table = read_table(path, label)
    require_columns(table, (FRAME, TIME), label)
    table, repeats = forward_in_time(table, TIME, label)
    require_rising(table, FRAME, "frame numbers must increase, a row a picture", label)
    return table, repeats


def _count_warnings(trial: Trial, camera: str, rows: int, label: str) -> tuple[str, ...]:
    """Return warnings on a camera's number of frames.

    Raises BadInput where it is not the number of rows. A video that is cut short is the trial's
    trouble, not the session's: its header still declares the rows, or it does not open at all.
    """
    source = trial.camera_sources[camera]
    place = trial.label(source.name)
    declared = frame_count(source)
    if declared == rows:
        return ()
    if not source.is_dir() and declared == 0:
        line = f"{place}: the video cannot be opened: truncated or damaged"
        return (Reason("frames_damaged", line),)
    found = decoded_count(source)
    if found == rows:
        line = f"{place}: the header declares {counted(declared, 'frame')}, there are {found}"
        return (Reason("frame_count_unlike_header", line),)
    unlike = f"has {counted(rows, 'row')}, camera {camera} has {counted(found, 'frame')}"
    raise BadInput(f"{unlike}; there must be a row a frame", file=label)


def _frame_counts(trial: Trial) -> dict[str, int]:
    """Return how many frames each camera declares."""
    return {camera: frame_count(source) for camera, source in trial.camera_sources.items()}


def _one_count(counts: Mapping[str, int], trial: Trial) -> int:
    """Return the number of frames of all cameras. Raise BadInput where it is not the same."""
    if len(set(counts.values())) > 1:
        listed = ", ".join(f"{camera} {count}" for camera, count in counts.items())
        found = f"the cameras have different numbers of frames ({listed})"
        fix = "record frames.csv or frames_<camera>.csv to say which frames belong together"
        raise BadInput(f"{found}; {fix}", file=_shown(trial))
    return next(iter(counts.values()))


def _check_rate(time_s: np.ndarray, trial: Trial, label: str) -> None:
    """Raise BadInput where a stated frame rate is not that of the times between dropped frames."""
    if trial.frame_rate_Hz is None or len(time_s) < 3:
        return
    usual = _usual_steps(time_s)
    stated_s = 1.0 / trial.frame_rate_Hz
    found_s = float(usual.mean())
    if abs(found_s - stated_s) > _RATE_TOLERANCE * stated_s + _CLOCK_STEP_S / len(usual):
        stated = f"trial.toml says frame_rate_Hz = {trial.frame_rate_Hz:g}"
        found = f"frames come at {1 / found_s:.6g} Hz, {stated}"
        raise BadInput(f"{found}; mend the wrong one (or take frame_rate_Hz out)", file=label)


def _usual_steps(time_s: np.ndarray) -> np.ndarray:
    """Return the steps between frames of which none was dropped, s."""
    steps = np.diff(time_s)
    return steps[steps < _DROPPED_STEPS * np.median(steps)]


def _header_warnings(
    time_s: np.ndarray, trial: Trial, cameras: Iterable[str], label: str
) -> Iterator[str]:
    """Yield a line on each video whose header states another rate than the times.

    A rate in trial.toml decides, and there is no such line.
    """
    if trial.frame_rate_Hz is not None or len(time_s) < 3:
        return
    found_Hz = 1.0 / float(_usual_steps(time_s).mean())
    for source in (trial.camera_sources[camera] for camera in cameras):
        stated_Hz = 0.0 if source.is_dir() else declared_rate_Hz(source)
        if stated_Hz and abs(stated_Hz / found_Hz - 1.0) > _HEADER_TOLERANCE:
            yield Reason(
                "rate_unlike_header",
                f"{label}: frames come at {found_Hz:.4g} Hz, the header of {source.name} says "
                f"{stated_Hz:.4g} Hz; the times are taken: where they are right, say so by "
                "frame_rate_Hz in trial.toml, or in [trial] of session.toml",
            )


def _shown(trial: Trial) -> str:
    """Return how messages name a trial's folder."""
    return f"trials/{trial.name}"
