"""When each frame of a trial was taken, on the signals' clock, and which picture of each camera it is."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.errors import BadInput
from bench.session.daq import DaqFile, frame_edges, read_daq
from bench.session.footage import declared_rate_Hz, decoded_count, frame_count, read_frames
from bench.session.signals import Signals
from bench.session.table import NumberTable, forward_in_time, read_table, require_columns
from bench.session.trial import Trial
from vision.geometry.counted import counted
from vision.geometry.reasons import Reason
from vision.geometry.refusals import Refused
from vision.pictures.frames import Frames

FRAME, TIME = "frame", "time_s"
_DROPPED_STEPS = 1.5  # a gap of so many usual steps inside a whisk is a dropped frame
# of the interval stated, beyond the steps in which times are written. Set by eye
_RATE_TOLERANCE = 1e-3
# A header's rate is nominal: crystals are right to 1e-4, a computer's timers to some 1e-3.
_HEADER_TOLERANCE = 1e-2
_MOST_NAMED = 5  # frames in a line
_CLOCK_STEP_S = 1e-3  # times are written to a millisecond or better


@dataclass(frozen=True)
class FrameTimes:
    """time_s: (n,) middle of the exposure of each frame, s, increasing. source: where the times come from.

    picture: camera to (n,) the index of its picture of each frame, −1 where that camera dropped it. spread_s:
    the largest difference between cameras within one frame. doubts: lines that the user should read. clock_sigma_s: how
    well the times are known on the signals' clock: 0 where they were recorded on it, else half a frame. Forward
    strokes do not tell it: an offset of the clock looks as one of the encoder's zero.
    """

    time_s: np.ndarray
    source: str
    picture: Mapping[str, np.ndarray]
    spread_s: float = 0.0
    doubts: tuple[str, ...] = ()
    clock_sigma_s: float = 0.0

    def __len__(self) -> int:
        return len(self.time_s)

    def frames_in(self, signals: Signals, stroke: slice) -> slice:
        """The frames taken during a stroke (a slice of samples), as a slice of frame indices."""
        half_s = 0.5 / signals.rate_Hz
        first, last = signals.time_s[stroke][[0, -1]]
        return slice(*np.searchsorted(self.time_s, [first - half_s, last + half_s]).tolist())

    def lost_in(self, frames: slice) -> list[tuple[float, int]]:
        """Of a stroke's frames: after which time, s, how many were dropped, by gaps of more than `_DROPPED_STEPS` usual
        steps."""
        time_s = self.time_s[frames]
        steps = np.diff(time_s)
        if len(steps) < 2:
            return []
        usual = float(np.median(steps))
        gaps = np.flatnonzero(steps > _DROPPED_STEPS * usual)
        return [(float(time_s[k]), max(1, round(float(steps[k]) / usual) - 1)) for k in gaps]


def frame_times(trial: Trial) -> FrameTimes:
    """The frame times of a trial, from the first source that there is.

    In this order: frames.csv, frames_<camera>.csv, edges of a DAQ channel, frame_rate_Hz and first_frame_s, the
    container's times. Raises BadInput where there is none, times do not increase, their number is not that of the
    frames, or the stated frame rate is another.
    """
    if (trial.folder / "frames.csv").is_file():
        return _common(trial)
    if trial.camera_sources and all(
        (trial.folder / _own(camera)).is_file() for camera in trial.camera_sources
    ):
        return _merged(trial)
    own = [camera for camera in trial.camera_sources if (trial.folder / _own(camera)).is_file()]
    if own:
        missing = next(camera for camera in trial.camera_sources if camera not in own)
        raise BadInput(
            f"is missing, and camera {own[0]} has its own", file=trial.shown(_own(missing))
        )
    if not trial.camera_sources:
        return FrameTimes(np.array([]), "none", {})
    if trial.daq is not None and "frame_V" in trial.daq.channels:
        return _by_edges(trial, trial.daq)
    return _steady(trial) if trial.frame_rate_Hz else _from_container(trial)


def read_trial(
    trial: Trial, times: FrameTimes, wanted: Iterable[int] | None = None
) -> dict[str, dict[int, np.ndarray]]:
    """Grey pictures by camera and frame index, of the frames wanted (None: all); lost ones are left out."""
    frames, wanted = {}, range(len(times)) if wanted is None else sorted(set(wanted))
    for name, source in trial.camera_sources.items():
        place = {
            frame: int(times.picture[name][frame])
            for frame in wanted
            if times.picture[name][frame] >= 0
        }
        read = read_frames(source, place.values())
        frames[name] = {frame: read[k] for frame, k in place.items() if read[k] is not None}
    return frames


def dropped(times: FrameTimes, places: Iterable[slice]) -> Iterator[str]:
    """A line for each whisk with gaps between its frames' times."""
    for number, place in enumerate(places):
        lost = times.lost_in(place)
        if lost:
            at = ", ".join(f"{time_s:.3f}" for time_s, _ in lost[:_MOST_NAMED])
            frames = counted(sum(count for _, count in lost), "frame")
            yield f"whisk {number}: {frames} dropped by all cameras (after {at} s)"


def _own(camera: str) -> str:
    return f"frames_{camera}.csv"


def _common(trial: Trial) -> FrameTimes:
    """frames.csv: all cameras triggered together."""
    shown = trial.shown("frames.csv")
    table, repeats = _read(trial.folder / "frames.csv", shown)
    doubts = tuple(
        d for camera in trial.camera_sources for d in _check_count(trial, camera, len(table), shown)
    )
    _check_rate(table[TIME], trial, shown)
    doubts += tuple(_header_rates(table[TIME], trial, trial.camera_sources, shown))
    if repeats:
        line = f"{shown}: {counted(repeats, 'repeated row')} dropped"
        doubts = (*doubts, Reason("rows_repeated", line))
    pictures = {camera: np.arange(len(table)) for camera in trial.camera_sources}
    return FrameTimes(table[TIME], "frames.csv", pictures, doubts=doubts)


def _merged(trial: Trial) -> FrameTimes:
    """frames_<camera>.csv: own times; frames of different cameras nearer than half a step are one."""
    times, doubts = {}, []
    for camera in trial.camera_sources:
        shown = trial.shown(_own(camera))
        table, _ = _read(trial.folder / _own(camera), shown)
        doubts += _check_count(trial, camera, len(table), shown)
        doubts += _header_rates(table[TIME], trial, (camera,), shown)
        times[camera] = table[TIME]
    time_s, picture, spread_s = merge_times(times)
    return FrameTimes(time_s, "frames_<camera>.csv", picture, spread_s, tuple(doubts))


def merge_times(
    times_s: Mapping[str, np.ndarray],
) -> tuple[np.ndarray, dict[str, np.ndarray], float]:
    """One series of frames from several cameras' times.

    Returns time_s (n,), camera -> picture index or −1 (n,), and the largest spread within a frame, s.
    A frame's time is the mean of the cameras that have it.
    """
    names = list(times_s)
    every = np.concatenate([times_s[name] for name in names])
    camera = np.concatenate([np.full(len(times_s[name]), k) for k, name in enumerate(names)])
    index = np.concatenate([np.arange(len(times_s[name])) for name in names])
    order = np.argsort(every, kind="stable")
    step = min((np.median(np.diff(t)) for t in times_s.values() if len(t) > 1), default=np.inf)
    frame = np.cumsum(np.concatenate([[0], np.diff(every[order]) > step / 2]))
    picture = {name: np.full(frame[-1] + 1, -1) for name in names}
    for k, name in enumerate(names):
        mine = camera[order] == k
        picture[name][frame[mine]] = index[order][mine]
    total = np.bincount(frame, weights=every[order])
    first, last = (
        np.unique(frame, return_index=True)[1],
        np.searchsorted(frame, np.arange(frame[-1] + 1), "right"),
    )
    spread = every[order][last - 1] - every[order][first]
    return total / np.bincount(frame), picture, float(spread.max())


def _by_edges(trial: Trial, daq: DaqFile) -> FrameTimes:
    """Rising edges of a channel of the DAQ, one a frame of every camera."""
    shown = trial.shown(trial.signals_path.name)
    edges_s = frame_edges(
        trial.signals_path, daq, read_daq(trial.signals_path, daq, shown)[TIME], shown
    )
    count = _one_count(
        {camera: frame_count(source) for camera, source in trial.camera_sources.items()}, trial
    )
    if len(edges_s) != count:
        found = f"channel {daq.channels['frame_V'].channel} rises {len(edges_s)} times, the cameras have {count} frames"
        raise BadInput(f"{found}; there must be an edge a frame", file=shown)
    picture = {camera: np.arange(count) for camera in trial.camera_sources}
    doubts = tuple(_header_rates(edges_s, trial, trial.camera_sources, shown))
    return FrameTimes(edges_s, "edges of a DAQ channel", picture, doubts=doubts)


def _steady(trial: Trial) -> FrameTimes:
    """frame_rate_Hz and first_frame_s of trial.toml."""
    counts = {camera: frame_count(source) for camera, source in trial.camera_sources.items()}
    count = _one_count(counts, trial)
    first_s = 0.0 if trial.first_frame_s is None else trial.first_frame_s
    doubts = (
        ()
        if trial.first_frame_s is not None
        else (
            Reason(
                "first_frame_not_stated", f"{_shown(trial)}: first_frame_s is not given; taken as 0"
            ),
        )
    )
    picture = {camera: np.arange(count) for camera in counts}
    time_s = first_s + np.arange(count) / trial.frame_rate_Hz
    sigma_s = _clock_sigma_s(trial, 1.0 / trial.frame_rate_Hz)
    return FrameTimes(time_s, "frame_rate_Hz", picture, doubts=doubts, clock_sigma_s=sigma_s)


def _clock_sigma_s(trial: Trial, interval_s: float) -> float:
    """Of frame times that no recorded edge ties to the signals: the first frame's where stated, or half a frame."""
    stated = trial.first_frame_s is not None and trial.first_frame_sigma_s > 0
    return trial.first_frame_sigma_s if stated else 0.5 * interval_s


def _from_container(trial: Trial) -> FrameTimes:
    """The times that the video's container states, which may be any clock's."""
    times = {
        camera: _container_times(source, trial) for camera, source in trial.camera_sources.items()
    }
    count = _one_count({camera: len(t) for camera, t in times.items()}, trial)
    first_s = trial.first_frame_s or 0.0
    camera = next(iter(times))
    doubt = f"{_shown(trial)}: frame times are those of {trial.camera_sources[camera].name}'s container; "
    picture = {name: np.arange(count) for name in times}
    line = doubt + "nothing ties them to the signals' clock"
    doubts = (Reason("clock_of_container", line),)
    sigma_s = _clock_sigma_s(trial, float(np.median(np.diff(times[camera]))) if count > 1 else 0.0)
    return FrameTimes(
        first_s + times[camera], "container", picture, doubts=doubts, clock_sigma_s=sigma_s
    )


def _container_times(source: Path, trial: Trial) -> np.ndarray:
    fix = "write frames.csv (frame,time_s), or frame_rate_Hz and first_frame_s into trial.toml"
    try:
        found = None if source.is_dir() else Frames.open(source).times_s
        if found is None:
            raise BadInput(f"there are no frame times; {fix}", file=trial.shown("frames.csv"))
        return found
    except Refused as problem:
        raise BadInput(
            f"there are no frame times, and {problem}; {fix}", file=_shown(trial)
        ) from None


def _read(path: Path, shown: str) -> tuple[NumberTable, int]:
    table = read_table(path, shown)
    require_columns(table, (FRAME, TIME), shown)
    table, repeats = forward_in_time(table, TIME, shown)
    wrong = np.flatnonzero(np.diff(table[FRAME]) <= 0)
    if len(wrong):
        row = int(table.row[wrong[0] + 1])
        raise BadInput(
            "frame numbers must increase, a row a picture", file=shown, row=row, column=FRAME
        )
    return table, repeats


def _check_count(trial: Trial, camera: str, rows: int, shown: str) -> tuple[str, ...]:
    """Doubts about a camera's number of frames. Raises BadInput where it is not the number of rows.

    A video that is cut short is the trial's trouble, not the session's: its header still declares the rows,
    or it does not open at all.
    """
    source = trial.camera_sources[camera]
    declared = frame_count(source)
    if declared == rows:
        return ()
    if not source.is_dir() and declared == 0:
        line = f"{trial.shown(source.name)}: the video cannot be opened: truncated or damaged"
        return (Reason("frames_damaged", line),)
    found = decoded_count(source)
    if found == rows:
        counts = f"the header declares {counted(declared, 'frame')}, there are {found}"
        return (Reason("frame_count_unlike_header", f"{trial.shown(source.name)}: {counts}"),)
    unlike = f"has {counted(rows, 'row')}, camera {camera} has {counted(found, 'frame')}"
    raise BadInput(f"{unlike}; there must be a row a frame", file=shown)


def _one_count(counts: Mapping[str, int], trial: Trial) -> int:
    if len(set(counts.values())) > 1:
        found = ", ".join(f"{camera} {count}" for camera, count in counts.items())
        fix = "record frames.csv or frames_<camera>.csv to say which frames belong together"
        raise BadInput(
            f"the cameras have different numbers of frames ({found}); {fix}", file=_shown(trial)
        )
    return next(iter(counts.values()))


def _check_rate(time_s: np.ndarray, trial: Trial, shown: str) -> None:
    """A stated frame rate must be that of the times, over their longest run without a gap."""
    if trial.frame_rate_Hz is None or len(time_s) < 3:
        return
    usual = _usual_steps(time_s)
    stated_s, found_s = 1.0 / trial.frame_rate_Hz, float(usual.mean())
    if abs(found_s - stated_s) > _RATE_TOLERANCE * stated_s + _CLOCK_STEP_S / len(usual):
        found = f"frames come at {1 / found_s:.6g} Hz, trial.toml says frame_rate_Hz = {trial.frame_rate_Hz:g}"
        raise BadInput(f"{found}; mend the wrong one (or take frame_rate_Hz out)", file=shown)


def _usual_steps(time_s: np.ndarray) -> np.ndarray:
    """Steps between frames of which none was dropped, s."""
    steps = np.diff(time_s)
    return steps[steps < _DROPPED_STEPS * np.median(steps)]


def _header_rates(
    time_s: np.ndarray, trial: Trial, cameras: Iterable[str], shown: str
) -> Iterator[str]:
    """A line on each video whose header states another rate than the times, where trial.toml does not settle it."""
    videos = {
        source.name: source
        for source in map(trial.camera_sources.get, cameras)
        if not source.is_dir()
    }
    if trial.frame_rate_Hz is not None or len(time_s) < 3:
        return
    found_Hz = 1.0 / float(_usual_steps(time_s).mean())
    for name, source in videos.items():
        stated_Hz = declared_rate_Hz(source)
        if stated_Hz and abs(stated_Hz / found_Hz - 1.0) > _HEADER_TOLERANCE:
            yield Reason(
                "rate_unlike_header",
                f"{shown}: frames come at {found_Hz:.4g} Hz, the header of {name} says {stated_Hz:.4g} Hz; the times "
                "are taken: where they are right, say so by frame_rate_Hz in trial.toml, or in [trial] of session.toml",
            )


def _shown(trial: Trial) -> str:
    return f"trials/{trial.name}"
