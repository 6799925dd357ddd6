"""A push that is evaluated while it is recorded: fed by a program, or played from a recorded trial.

Cameras, background and bar are known before, by the session. While the push is recorded, `LivePush`
takes one picture at a time and works between them (`vision.live.whisk`); what comes after the last
picture is the answer. No gauge is read, and no check of the recording as a whole is made: these stay
with `evaluate`, which the folder can still be given to.
"""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from bench.base.atomic import lock_output
from bench.base.drawing import save_picture
from bench.base.errors import BadInput
from bench.base.results import hash_of
from bench.base.workers import one_thread
from bench.cameras.session_cameras import SessionCalibration, calibrate_session
from bench.report.overlays import last_frame
from bench.report.video import codec_of, write_pictures
from bench.session.angle_source import angle_source
from bench.session.file_names import TRIAL_TOML
from bench.session.frame_times import FrameTimes, frame_times, read_trial
from bench.session.inside import check_outside
from bench.session.session import Session, load_session
from bench.session.signals import forward_strokes, read_signals
from bench.session.trial import Trial
from bench.trials.trial_frames import stated_object
from bench.workflows.live_film import FILM_HZ, LiveFilm
from vision import WhiskTruth
from vision.geometry import Reason, Rods, VisionSettings
from vision.live import FIRST_FRAMES, LiveBench, LiveWhisk

# [s] Of a wait for the next frame where nothing is to be done: below a camera's shortest exposure.
_WAIT_S = 5e-4


@dataclass(eq=False)
class LivePush:
    """One push, fed a picture at a time: `add` each, `work` while waiting for the next, `finish`.

    whisk: what evaluates it. pictures: by camera the last one.
    """

    whisk: LiveWhisk
    pictures: dict[str, np.ndarray] = field(default_factory=dict)

    def add(
        self, camera: str, frame: int, time_s: float, motor_deg: float, picture: np.ndarray
    ) -> None:
        """Keep a camera's grey picture (h, w) of a frame; it takes no time.

        time_s: middle of the exposure. motor_deg: the motor's angle then. Raises BadInput where
        there is no such camera or its pictures have another size.
        """
        cameras = self.whisk.bench.cameras
        if camera not in cameras.names:
            names = ", ".join(cameras.names)
            raise BadInput(f"there is no camera {camera!r}; there are {names}")
        width, height = cameras[camera].size_px
        if picture.shape != (height, width):
            found = " x ".join(map(str, picture.shape))
            raise BadInput(
                f"camera {camera}, frame {frame}: {found} pixels, {height} x {width} are calibrated"
            )
        self.pictures[camera] = picture
        self.whisk.add(camera, frame, time_s, math.radians(motor_deg), picture)

    @one_thread()
    def work(self) -> bool:
        """Take the next step that is due; return whether there was one."""
        return self.whisk.work()

    @one_thread()
    def finish(self) -> WhiskTruth:
        """Return the truth; d_x_mm is NaN where there is none, and the status says why."""
        return self.whisk.finish()

    def following(self) -> "LivePush":
        """Return the push after this one. Bar and wire are looked for where they were; they may have moved."""
        before = self.whisk
        bench = replace(before.bench, earlier=before.shown)
        return LivePush(LiveWhisk(bench, before.number + 1))


def open_push(
    session: Path,
    out: Path,
    trial: str,
    stroke_deg: tuple[float, float],
    *,
    clock_sigma_s: float = 0.0,
    follow_links: bool = False,
) -> LivePush:
    """Return a push to come against the bar of a trial, with what the session knows before.

    Its cameras are those of the trial, or all where that has no pictures yet. stroke_deg: motor angles
    between which it goes. clock_sigma_s: how well its frames' times are known against the motor's
    angles. Raises BadInput where cameras, whisker or bar are missing.
    """
    recorded, own = _recorded(session, out, trial, follow_links=follow_links)
    low, high = np.radians(stroke_deg)
    stroke_rad = (float(low), float(high))
    seeing = VisionSettings(clock_sigma_s=clock_sigma_s)
    calibration = calibrate_session(recorded, out)
    bench = live_bench(recorded, own, calibration, seeing)
    return LivePush(LiveWhisk(replace(bench, stroke_rad=stroke_rad)))


def _recorded(session: Path, out: Path, name: str, *, follow_links: bool) -> tuple[Session, Trial]:
    """Return a session with a trial, and that trial. Raises BadInput where it has none of that name."""
    check_outside(out, session)
    recorded = load_session(session, trials=[name], follow_links=follow_links)
    if not recorded.trials:
        recorded = load_session(session, follow_links=follow_links)
    return recorded, recorded.trial(name)


def live_bench(
    session: Session, trial: Trial, known: SessionCalibration, settings: VisionSettings
) -> LiveBench:
    """Return what a session knows before a push, whose stroke is still to be set.

    Raises BadInput where that is not enough.
    """
    if session.whisker is None or not trial.bar_diameter_mm:
        raise BadInput(
            "has no whisker and bar that a push could be evaluated with", file=session.path
        )
    if trial.object_gives_way or trial.object_velocity_mm_s:
        found = (
            "the object moves; while it is recorded, a push is evaluated against one that stands"
        )
        raise BadInput(found, file=trial.label(TRIAL_TOML))
    if not angle_source(trial).has_zero:
        found = "the motor's angle has no zero that pictures share; evaluate gives estimates alone"
        raise BadInput(found, file=trial.label(TRIAL_TOML))
    if known.cameras is None:
        raise BadInput("has no pictures, so no camera could be calibrated", file=session.path)
    cameras = known.cameras.subset(list(trial.camera_sources) or known.cameras.names)
    rods = Rods(session.whisker.wire, stated_object(trial))
    return LiveBench(cameras, rods, known.background, (0.0, 0.0), settings)


def play_trial(
    session: Path, out: Path, name: str, *, film: Path | None = None, follow_links: bool = False
) -> Iterator[tuple[str, Reason]]:
    """Play a recorded trial at its own speed; yield a line on each whisk, and its status.

    Writes OUT/live/<trial>_<whisk>.png, the last frame with its lines, of each that is seen. film: file
    of a film of it, in which work takes its processor time; without one the clock is that on the wall.
    Raises BadInput where the trial has no pictures or no push.
    """
    if film:
        check_outside(film, session, "--film")
        codec_of(film)
    recorded, trial = _recorded(session, out, name, follow_links=follow_links)
    recording = RecordedPush.read(trial)
    settings = VisionSettings(clock_sigma_s=recording.times.clock_sigma_s)
    shown = LiveFilm()
    with lock_output(out):
        bench = live_bench(recorded, trial, calibrate_session(recorded, out), settings)
        clock = ProcessorClock if film else WallClock
        for played in recording.play_all(bench, clock, watch=shown.watch if film else None):
            truth = played.truth
            _save_last_frame(played, out / f"live/{name}_{truth.whisk}.png")
            if film:
                shown.end(played)
            yield f"{name}, whisk {truth.whisk}: {truth_text(truth)}; {played.late}", truth.status
        if film:
            write_pictures(film, iter(shown.pictures), FILM_HZ)


def _save_last_frame(played: "Played", path: Path) -> None:
    """Save the last frame of a push with its lines, where these are known."""
    overlay = played.truth.overlay
    if overlay:
        picture = last_frame(played.pictures, overlay[max(overlay)])
        save_picture(picture, path, hash_of(picture))


class PushClock(Protocol):
    """The time of a push that is played, s, as `frames.csv` has it."""

    def now_s(self) -> float:
        """Return the time."""
        ...

    def run(self, call: Callable) -> object:
        """Call a function, which takes its time; return its result."""
        ...

    def decode(self, seconds: float) -> None:
        """Let decoding of pictures that were read before take its time."""
        ...

    def wait(self, until_s: float) -> None:
        """Wait, no longer than until a time."""
        ...


class WallClock:
    """The clock on the wall."""

    def __init__(self, begin_s: float):
        """Begin at a time, s."""
        self._ahead_s = time.perf_counter() - begin_s

    def now_s(self) -> float:
        """Return the time."""
        return time.perf_counter() - self._ahead_s

    def run(self, call: Callable) -> object:
        """Call a function; return its result."""
        return call()

    def decode(self, seconds: float) -> None:
        """Do nothing: a camera's pictures come decoded."""

    def wait(self, until_s: float) -> None:
        """Wait for a moment."""
        time.sleep(_WAIT_S)


@dataclass
class ProcessorClock:
    """The clock of a machine that does nothing else: a call takes its processor time, waiting none.

    busy_s: all calls so far.
    """

    time_s: float
    busy_s: float = 0.0

    def now_s(self) -> float:
        """Return the time."""
        return self.time_s

    def run(self, call: Callable) -> object:
        """Call a function, which takes its processor time; return its result."""
        begin_s = time.process_time()
        result = call()
        self.decode(time.process_time() - begin_s)
        return result

    def decode(self, seconds: float) -> None:
        """Let decoding, or other work, take its time."""
        self.time_s += seconds
        self.busy_s += seconds

    def wait(self, until_s: float) -> None:
        """Go on to a time."""
        self.time_s = max(self.time_s, until_s)


@dataclass(frozen=True, eq=False)
class Played:
    """A push that was played.

    late_s: from its last frame to its truth. pictures: by camera the last one. clock: as it was then.
    """

    truth: WhiskTruth
    late_s: float
    pictures: dict[str, np.ndarray]
    clock: PushClock

    @property
    def late(self) -> str:
        """Return how late its truth came, for people."""
        return f"{self.late_s:.2f} s after the last frame"


@dataclass(frozen=True, eq=False)
class RecordedPush:
    """A trial's pictures by camera and frame, with times and motor angles, deg, by frame.

    strokes: by number of the forward stroke its frames (n,), where it has any. decode_s: processor
    seconds of reading the pictures of one frame.
    """

    times: FrameTimes
    pictures: dict[str, dict[int, np.ndarray]]
    motor_deg: np.ndarray
    strokes: dict[int, np.ndarray]
    decode_s: float

    @classmethod
    def read(cls, trial: Trial) -> "RecordedPush":
        """Read the pictures of a trial. Raises BadInput where there are none, or no push."""
        if not trial.camera_sources:
            raise BadInput("has no pictures that could be played", file=f"trials/{trial.name}")
        signals = read_signals(trial)
        times = frame_times(trial)
        strokes = {}
        for number, stroke in enumerate(forward_strokes(signals)):
            frames = np.arange(len(times))[times.frames_in(signals, stroke)]
            if len(frames):
                strokes[number] = frames
        if not strokes:
            raise BadInput("has no frame of a push", file=f"trials/{trial.name}")
        motor_deg = np.degrees(signals.motor_nearest(times.time_s))
        begin_s = time.process_time()
        pictures = read_trial(trial, times)
        decode_s = (time.process_time() - begin_s) / len(times)
        return cls(times, pictures, motor_deg, strokes, decode_s)

    def play_all(
        self,
        bench: LiveBench,
        clock_from: Callable[[float], PushClock],
        lead_s: float = 0.0,
        watch: Callable[[float, LivePush], None] | None = None,
    ) -> Iterator[Played]:
        """Play each push, the bar looked for where it was before; yield it as soon as it is over.

        clock_from: makes a clock that begins at a time, s. lead_s: by so much the first pictures come
        before their times, as of a camera that runs before the motor does. watch: is given the time and
        the push whenever something has changed.
        """
        for number, frames in self.strokes.items():
            first_rad, last_rad = np.radians(self.motor_deg[frames[[0, -1]]]).tolist()
            push = LivePush(LiveWhisk(replace(bench, stroke_rad=(first_rad, last_rad)), number))
            arrivals_s = self.times.time_s[frames].copy()
            arrivals_s[:FIRST_FRAMES] -= lead_s
            clock = clock_from(float(arrivals_s[0]))
            truth = self._play(push, frames, arrivals_s, clock, watch or _look_away)
            yield Played(truth, clock.now_s() - float(arrivals_s[-1]), push.pictures, clock)
            bench = push.following().whisk.bench

    def _play(
        self,
        push: LivePush,
        frames: np.ndarray,
        arrivals_s: np.ndarray,
        clock: PushClock,
        watch: Callable[[float, LivePush], None],
    ) -> WhiskTruth:
        """Feed the frames of a stroke (n,) as they arrive (n,), s; return the truth."""
        for frame, arrival_s in zip(frames.tolist(), arrivals_s.tolist()):
            while clock.now_s() < arrival_s:
                if clock.run(push.work):
                    watch(clock.now_s(), push)
                else:
                    clock.wait(arrival_s)
            clock.decode(self.decode_s)
            for camera, pictures in self.pictures.items():
                if frame in pictures:
                    motor_deg = float(self.motor_deg[frame])
                    time_s = float(self.times.time_s[frame])
                    push.add(camera, frame, time_s, motor_deg, pictures[frame])
            watch(clock.now_s(), push)
        while clock.run(push.work):
            watch(clock.now_s(), push)
        return clock.run(push.finish)


def _look_away(now_s: float, push: LivePush) -> None:
    """Watch nothing."""


def truth_text(truth: WhiskTruth) -> str:
    """Return distance, touch and slip of a whisk in words, or why there are none."""
    if not truth.d_x_mm.is_known:
        return f"no distance: {truth.status}"
    slip = truth.frames.slip_mm
    theta_deg = np.degrees(truth.frames.theta_rad.value[-1])
    return (
        f"d_x {truth.d_x_mm.value:.3f} ± {truth.d_x_mm.sigma:.3f} mm, touch at "
        f"{np.degrees(truth.touch_rad.value):.3f} ± {np.degrees(truth.touch_rad.sigma):.3f}°, slip "
        f"{slip.value[-1]:.3f} ± {slip.sigma[-1]:.3f} mm at {theta_deg:.2f}° past it"
    )
