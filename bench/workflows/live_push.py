"""A push that is evaluated while it is recorded: fed by a program, or played from a recorded trial.

Cameras, background and bar are known before, by the session. While the push is recorded, `LivePush`
takes one picture at a time and works between them (`vision.live.whisk`); what comes after the last
picture is the answer. No gauge is read, and no check of the recording as a whole is made: these stay
with `evaluate`, which the folder can still be given to.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bench.base.drawing import save_picture
from bench.base.errors import BadInput
from bench.base.results import hash_of
from bench.cameras.session_cameras import calibrate_session
from bench.report.overlays import last_frame
from bench.session.frame_times import FrameTimes, frame_times, read_trial
from bench.session.session import Session, load_session
from bench.session.signals import forward_strokes, read_signals
from bench.session.trial import Trial
from bench.trials.trial_frames import stated_object
from vision import WhiskTruth
from vision.geometry import Reason, Rods, VisionSettings
from vision.live import LiveBench, LiveWhisk

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
        self.whisk.add(camera, frame, time_s, float(np.radians(motor_deg)), picture)

    def work(self) -> bool:
        """Take the next step that is due; return whether there was one."""
        return self.whisk.work()

    def finish(self) -> WhiskTruth:
        """Return the truth; d_x_mm is NaN where there is none, and the status says why."""
        return self.whisk.finish()

    def following(self) -> "LivePush":
        """Return the push after this one. The bar is looked for where it was; it may have moved."""
        bench = replace(self.whisk.bench, bar=self.whisk.axis)
        return LivePush(LiveWhisk(bench, self.whisk.number + 1))


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
    recorded = load_session(session, trials=[trial], follow_links=follow_links)
    low, high = np.radians(stroke_deg)
    stroke_rad = (float(low), float(high))
    seeing = VisionSettings(clock_sigma_s=clock_sigma_s)
    return LivePush(LiveWhisk(_bench(recorded, recorded.trial(trial), out, stroke_rad, seeing)))


def _bench(
    session: Session,
    trial: Trial,
    out: Path,
    stroke_rad: tuple[float, float],
    settings: VisionSettings,
) -> LiveBench:
    """Return what a session knows before a push. Raises BadInput where that is not enough."""
    if session.whisker is None or not trial.bar_diameter_mm:
        raise BadInput(
            "has no whisker and bar that a push could be evaluated with", file=session.path
        )
    if trial.object_gives_way or trial.object_velocity_mm_s:
        found = (
            "the object moves; while it is recorded, a push is evaluated against one that stands"
        )
        raise BadInput(found, file=trial.label("trial.toml"))
    known = calibrate_session(session, out)
    if known.cameras is None:
        raise BadInput("has no pictures, so no camera could be calibrated", file=session.path)
    cameras = known.cameras.subset(list(trial.camera_sources) or known.cameras.names)
    rods = Rods(session.whisker.wire, stated_object(trial))
    return LiveBench(cameras, rods, known.background, stroke_rad, settings)


def play_trial(
    session: Path, out: Path, name: str, *, follow_links: bool = False
) -> Iterator[tuple[str, Reason]]:
    """Play a recorded trial at its own speed; yield a line on each whisk, and its status.

    Writes OUT/live/<trial>_<whisk>.png, the last frame with its lines, of each that is seen. Raises
    BadInput where the trial has no pictures or no push.
    """
    recorded = load_session(session, trials=[name], follow_links=follow_links)
    trial = recorded.trial(name)
    recording = RecordedPush.read(trial)
    settings = VisionSettings(clock_sigma_s=recording.times.clock_sigma_s)
    bench = _bench(recorded, trial, out, (0.0, 0.0), settings)
    for number, frames in enumerate(recording.strokes):
        first_rad, last_rad = np.radians(recording.motor_deg[frames[[0, -1]]]).tolist()
        push = LivePush(LiveWhisk(replace(bench, stroke_rad=(first_rad, last_rad)), number))
        truth, late_s = recording.play(push, frames)
        if truth.overlay:
            picture = last_frame(push.pictures, truth.overlay[max(truth.overlay)])
            save_picture(picture, out / "live" / f"{name}_{number}.png", hash_of(picture))
        bench = push.following().whisk.bench
        yield (
            f"{name}, whisk {number}: {answer(truth)}; {late_s:.2f} s after the last frame",
            truth.status,
        )


@dataclass(frozen=True, eq=False)
class RecordedPush:
    """A trial's pictures by camera and frame, with times and motor angles, deg, by frame.

    strokes: of each forward stroke its frames (n,).
    """

    times: FrameTimes
    pictures: dict[str, dict[int, np.ndarray]]
    motor_deg: np.ndarray
    strokes: list[np.ndarray]

    @classmethod
    def read(cls, trial: Trial) -> "RecordedPush":
        """Read the pictures of a trial. Raises BadInput where there are none, or no push."""
        signals = read_signals(trial)
        times = frame_times(trial)
        strokes = []
        for stroke in forward_strokes(signals):
            frames = np.arange(len(times))[times.frames_in(signals, stroke)]
            if len(frames):
                strokes.append(frames)
        if not strokes:
            raise BadInput("has no frame of a push", file=trial.label("."))
        motor_deg = np.degrees(np.interp(times.time_s, signals.time_s, signals.motor_rad))
        return cls(times, read_trial(trial, times), motor_deg, strokes)

    def play(self, push: LivePush, frames: np.ndarray) -> tuple[WhiskTruth, float]:
        """Feed the frames of a stroke (n,) at their times; return the truth, and how late it is, s."""
        time_s = self.times.time_s
        begin_s = time.perf_counter() - time_s[frames[0]]
        for frame in frames.tolist():
            while time.perf_counter() < begin_s + time_s[frame]:
                if not push.work():
                    time.sleep(_WAIT_S)
            for camera, pictures in self.pictures.items():
                if frame in pictures:
                    motor_deg = float(self.motor_deg[frame])
                    push.add(camera, frame, float(time_s[frame]), motor_deg, pictures[frame])
        last_s = begin_s + time_s[frames[-1]]
        return push.finish(), time.perf_counter() - last_s


def answer(truth: WhiskTruth) -> str:
    """Return distance, touch and slip of a whisk in words, or why there are none."""
    if not np.isfinite(truth.d_x_mm.value):
        return f"no distance: {truth.status}"
    slip = truth.frames.slip_mm
    theta_deg = np.degrees(truth.frames.theta_rad.value[-1])
    return (
        f"d_x {truth.d_x_mm.value:.3f} ± {truth.d_x_mm.sigma:.3f} mm, touch at "
        f"{np.degrees(truth.touch_rad.value):.3f} ± {np.degrees(truth.touch_rad.sigma):.3f}°, slip "
        f"{slip.value[-1]:.3f} ± {slip.sigma[-1]:.3f} mm at {theta_deg:.2f}° past it"
    )
