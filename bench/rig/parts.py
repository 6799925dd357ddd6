"""The parts of a session: each a folder, made by itself from the protocol and a random stream of its own."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import msgspec
import numpy as np

from bench.rig import boards, build, papers
from bench.rig.album import write_frames, write_picture
from bench.rig.array_rig import ArrayRecording, Mounted, mounted
from bench.rig.moments import moments_of, moments_of_array
from bench.rig.protocol import Protocol
from bench.rig.recording import Recording
from bench.rig.studio import Studio

_BOARDS, _RIG, _TRIAL, _POSE, _ARRAY = range(5)  # first words of the random streams


@dataclass(frozen=True)
class Job:
    """All that is needed to make any part of a session."""

    session: Path
    protocol: Protocol
    seed: int
    signals_only: bool

    def stream(self, *words: int) -> np.random.Generator:
        """A generator of its own for each piece of work, so that the order of the work does not matter."""
        return np.random.default_rng(np.random.SeedSequence([self.seed, *words]))

    def parts(self) -> Iterator["Part"]:
        """Boards first, then trials."""
        if not self.signals_only and self.protocol.cameras:
            yield Part("rig", 0, self.session / "boards" / "rig")
            for i, camera in enumerate(self.protocol.cameras):
                yield Part("board", i, self.session / "boards" / camera.name)
        for i, run in enumerate(self.protocol.runs()):
            yield Part("trial", i, self.session / "trials" / run.name)

    def papers(self) -> dict[str, str]:
        """The session's own text files."""
        stated = build.stated_T_rig_board(self.protocol, self.stream(_POSE))
        return {
            "session.toml": papers.session_toml(self.protocol, stated, self.whiskers),
            "truth.json": papers.truth_json(self.protocol, self.seed, self.whiskers),
        }

    @cached_property
    def whiskers(self) -> list[Mounted]:
        """Of an array; none where there is one whisker at the origin."""
        return mounted(self.protocol, self.stream(_ARRAY)) if self.protocol.columns else []

    @cached_property
    def studios(self) -> list[Studio]:
        """The cameras with their backdrops, kept while a process works on one session."""
        return _studios(msgspec.json.encode(self.protocol))


@dataclass(frozen=True)
class Part:
    """A "rig" picture a camera, the "board" views of one camera, or one "trial"; and the folder it fills."""

    kind: str
    number: int
    folder: Path

    def write(self, job: Job, folder: Path) -> None:
        """Fill a folder. Raises ArithmeticError where a trial's whisker cannot go on."""
        trial = _array_trial if job.whiskers else _trial
        {"rig": _rig_views, "board": _board_views, "trial": trial}[self.kind](
            job, self.number, folder
        )


@lru_cache(maxsize=2)
def _studios(protocol_json):
    protocol = msgspec.json.decode(protocol_json, type=Protocol)
    scene, sensor = build.scene(protocol), build.sensor(protocol)
    return [Studio(camera, scene, sensor) for camera in build.cameras(protocol)]


def _rig_views(job, _, folder):
    for i, studio in enumerate(job.studios):
        picture = studio.sensor.expose(studio.rig_brightness(), job.stream(_RIG, i))
        write_picture(folder / f"{studio.camera.name}.png", picture)


def _board_views(job, number, folder):
    studio, board = job.studios[number], build.board(job.protocol)
    poses = boards.poses(
        board, studio.camera, job.protocol.board.views, job.stream(_BOARDS, number)
    )
    for i, pose in enumerate(poses):
        picture = studio.sensor.expose(
            studio.board_brightness(pose), job.stream(_BOARDS, number, i + 1)
        )
        write_picture(folder / f"{i:02d}.{job.protocol.pictures.still}", picture)


def _trial(job, number, folder):
    run, pictures = job.protocol.runs()[number], job.protocol.pictures
    recording = Recording.make(job.protocol, run, job.stream(_TRIAL, number))
    texts = {
        "trial.toml": papers.trial_toml(recording),
        "signals.csv": papers.signals_csv(recording),
        "frames.csv": papers.frames_csv(recording.frames.time_s, pictures.clock_offset_s),
        "truth.csv": papers.truth_csv(recording),
        "truth.toml": papers.truth_toml(recording),
    }
    for name, text in texts.items():
        papers.write(folder / name, text)
    if job.signals_only or not job.protocol.cameras:
        return
    for i, studio in enumerate(job.studios):
        write_frames(
            folder, studio.camera.name, pictures.moving, frames_of(job, number, i, recording)
        )


def _array_trial(job, number, folder):
    run, streams = job.protocol.runs()[number], [job.stream(_TRIAL, number)]
    streams += [job.stream(_ARRAY, number, whisker) for whisker in range(len(job.whiskers))]
    recording = ArrayRecording.make(job.protocol, run, job.whiskers, streams)
    seen, clock_offset_s = (
        bool(job.protocol.cameras) and not job.signals_only,
        job.protocol.pictures.clock_offset_s,
    )
    texts = {
        "trial.toml": papers.array_trial_toml(recording, says_where=not seen),
        "signals.csv": papers.array_signals_csv(recording),
        "frames.csv": papers.frames_csv(np.concatenate(recording.frame_times_s), clock_offset_s),
    }
    for name, one in recording.recordings.items():
        if one is not None:
            texts |= {
                f"truth@{name}.csv": papers.truth_csv(one),
                f"truth@{name}.toml": papers.truth_toml(one),
            }
    for name, text in texts.items():
        papers.write(folder / name, text)
    for i, studio in enumerate(job.studios if seen else ()):
        frames = array_frames_of(job, number, i, recording)
        write_frames(folder, studio.camera.name, job.protocol.pictures.moving, frames)


def frames_of(job: Job, trial: int, camera: int, recording: Recording) -> Iterator[np.ndarray]:
    """Frames of one camera, over all whisks of a trial, as the sensor gives them."""
    studio, frames, bar = job.studios[camera], recording.frames, recording.bar
    middle = bar.foot_mm(recording.touch.point_mm)
    still = studio.setting(bar, middle) if bar.velocity_mm_rad is None else None
    for number, (_, motor, which, back) in enumerate(frames):
        whisk = recording.whisks[which]
        moments, gave = (
            moments_of(job.protocol, studio, recording, whisk, motor, back),
            whisk.gave_mm(motor, back),
        )
        setting = still
        if still is None or gave.any():
            moved = bar.moved_mm(motor) + gave
            setting = studio.setting(bar.at(motor).given(gave), middle + moved)
        yield studio.sensor.expose(
            setting.brightness(moments), job.stream(_TRIAL, trial, camera + 1, number)
        )


def array_frames_of(
    job: Job, trial: int, camera: int, recording: ArrayRecording
) -> Iterator[np.ndarray]:
    """As `frames_of`, of an array's trial."""
    studio = job.studios[camera]
    setting = studio.setting(recording.bar, recording.bar.point_mm)
    times = (
        (time_s, whisk)
        for whisk, times in enumerate(recording.frame_times_s)
        for time_s in times.tolist()
    )
    for number, (time_s, whisk) in enumerate(times):
        moments = moments_of_array(job.protocol, studio, recording, job.whiskers, time_s, whisk)
        yield studio.sensor.expose(
            setting.brightness(moments), job.stream(_TRIAL, trial, camera + 1, number)
        )
