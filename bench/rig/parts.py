"""The parts of a session: folders, each made from the protocol and a random stream of its own."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import msgspec
import numpy as np

from bench.rig import boards, build, session_files, truth_files
from bench.rig.array_rig import ArrayRecording, MountedWhisker, mount_whiskers
from bench.rig.exposure_instants import array_exposure_instants, exposure_instants
from bench.rig.mirror import MirrorStudio
from bench.rig.picture_files import write_frames, write_picture
from bench.rig.protocol import Protocol
from bench.rig.recording import Recording
from bench.rig.reorienting import turned_plane
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
        """Return a generator of its own for each piece of work, so that the order of the work does
        not matter."""
        return np.random.default_rng(np.random.SeedSequence([self.seed, *words]))

    @property
    def has_pictures(self) -> bool:
        """Return whether cameras take pictures."""
        return bool(self.protocol.cameras) and not self.signals_only

    def parts(self) -> Iterator["SessionPart"]:
        """Yield boards first, then trials."""
        if self.has_pictures:
            yield SessionPart("rig", 0, self.session / "boards" / "rig")
            for i, camera in enumerate(self.protocol.cameras):
                yield SessionPart("board", i, self.session / "boards" / camera.name)
        for i, run in enumerate(self.protocol.runs()):
            yield SessionPart("trial", i, self.session / "trials" / run.name)

    def text_files(self) -> dict[str, str]:
        """Return the text of the session's own files, by name."""
        stated = build.stated_T_rig_board(self.protocol, self.stream(_POSE))
        measured = {}
        if self.protocol.whisker.widths:
            measured["profile.csv"] = session_files.profile_csv(build.rod(self.protocol))
        return measured | {
            "session.toml": session_files.session_toml(self.protocol, stated, self.whiskers),
            "truth.json": truth_files.truth_json(self.protocol, self.seed, self.whiskers),
        }

    @cached_property
    def whiskers(self) -> list[MountedWhisker]:
        """Return the whiskers of an array; none where there is one whisker at the origin."""
        return mount_whiskers(self.protocol, self.stream(_ARRAY)) if self.protocol.columns else []

    @cached_property
    def studios(self) -> list[Studio | MirrorStudio]:
        """Return the cameras with their backdrops, kept while a process works on one session."""
        return _studios(msgspec.json.encode(self.protocol))


@dataclass(frozen=True)
class SessionPart:
    """A "rig" picture a camera, the "board" views of one camera, or one "trial"; and the folder it
    fills."""

    kind: str
    number: int
    folder: Path

    def write(self, job: Job, folder: Path) -> None:
        """Fill a folder. Raises ArithmeticError where a trial's whisker cannot go on."""
        if self.kind == "rig":
            _write_rig_views(job, folder)
        elif self.kind == "board":
            _write_board_views(job, self.number, folder)
        elif job.whiskers:
            _write_array_trial(job, self.number, folder)
        else:
            _write_trial(job, self.number, folder)


@lru_cache(maxsize=2)
def _studios(protocol_json):
    """Return the studio of each camera of a protocol."""
    return build.studios(msgspec.json.decode(protocol_json, type=Protocol))


def _write_rig_views(job, folder):
    """Write a picture of the board on the rig a camera."""
    for i, studio in enumerate(job.studios):
        picture = studio.sensor.expose(studio.rig_brightness(), job.stream(_RIG, i))
        write_picture(folder / f"{studio.camera.name}.png", picture)


def board_poses(job: Job, number: int) -> list[np.ndarray]:
    """Return the poses (3, 4) in the views of the board for the lens of one camera."""
    studio = job.studios[number]
    count = job.protocol.board.views
    rng = job.stream(_BOARDS, number)
    board = build.board(job.protocol)
    if isinstance(studio, MirrorStudio):
        return boards.draw_shared_poses(board, [p.camera for p in studio.parts], count, rng)
    return boards.draw_poses(board, studio.camera, count, rng)


def _write_board_views(job, number, folder):
    """Write the views of the board for the lens of one camera."""
    studio = job.studios[number]
    kind = job.protocol.pictures.still
    for i, pose in enumerate(board_poses(job, number)):
        brightness = studio.board_brightness(pose)
        picture = studio.sensor.expose(brightness, job.stream(_BOARDS, number, i + 1))
        write_picture(folder / f"{i:02d}.{kind}", picture)


def recording_of(job: Job, number: int) -> Recording:
    """Return what is recorded in a trial of one whisker. Raises ArithmeticError where it cannot go on."""
    run = job.protocol.runs()[number]
    first = number - run.rotation
    run = turned_plane(run, lambda rotation: job.stream(_TRIAL, first + rotation))
    return Recording.make(run, job.stream(_TRIAL, number))


def _write_trial(job, number, folder):
    """Write the files of a trial of one whisker."""
    recording = recording_of(job, number)
    clock_offset_s = job.protocol.pictures.clock_offset_s
    texts = {
        "trial.toml": session_files.trial_toml(recording, by_stage=bool(job.protocol.stage)),
        "signals.csv": session_files.signals_csv(recording),
        "frames.csv": session_files.frames_csv(recording.frames.time_s, clock_offset_s),
        "truth.csv": truth_files.truth_csv(recording),
        "truth.toml": truth_files.truth_toml(recording),
    }
    _write_files(job, folder, texts, lambda i: render_frames(job, number, i, recording))


def _write_array_trial(job, number, folder):
    """Write the files of a trial of an array."""
    streams = [job.stream(_TRIAL, number)]
    streams += [job.stream(_ARRAY, number, whisker) for whisker in range(len(job.whiskers))]
    run = job.protocol.runs()[number]
    recording = ArrayRecording.make(run, job.whiskers, streams)
    clock_offset_s = job.protocol.pictures.clock_offset_s
    times_s = np.concatenate(recording.frame_times_s)
    texts = {
        "trial.toml": session_files.array_trial_toml(recording, says_where=not job.has_pictures),
        "signals.csv": session_files.array_signals_csv(recording),
        "frames.csv": session_files.frames_csv(times_s, clock_offset_s),
    }
    for name, own in recording.recordings.items():
        if own is not None:
            texts[f"truth@{name}.csv"] = truth_files.truth_csv(own)
            texts[f"truth@{name}.toml"] = truth_files.truth_toml(own)
    _write_files(job, folder, texts, lambda i: render_array_frames(job, number, i, recording))


def _write_files(job, folder, texts, render):
    """Write text files, and the frames that `render` yields of each camera."""
    for name, text in texts.items():
        session_files.write(folder / name, text)
    if job.has_pictures:
        for i, studio in enumerate(job.studios):
            write_frames(folder, studio.camera.name, job.protocol.pictures.moving, render(i))


def render_frames(job: Job, trial: int, camera: int, recording: Recording) -> Iterator[np.ndarray]:
    """Yield the frames of one camera, over all whisks of a trial, as the sensor gives them."""
    studio = job.studios[camera]
    bar = recording.bar
    middle = bar.foot_mm(recording.touch.point_mm)
    still = studio.setting(bar, middle) if bar.velocity_mm_rad is None else None
    for number, (_, motor_rad, which, back) in enumerate(recording.frames):
        whisk = recording.whisks[which]
        instants = exposure_instants(studio, recording, whisk, motor_rad, back)
        gave = whisk.gave_mm(motor_rad, back)
        setting = still
        if still is None or gave.any():
            moved = bar.moved_mm(motor_rad) + gave
            setting = studio.setting(bar.shift(moved), middle + moved)
        noise = job.stream(_TRIAL, trial, camera + 1, number)
        yield studio.sensor.expose(setting.brightness(instants), noise)


def render_array_frames(
    job: Job, trial: int, camera: int, recording: ArrayRecording
) -> Iterator[np.ndarray]:
    """Yield the frames of one camera, over all whisks of an array's trial, as the sensor gives
    them."""
    studio = job.studios[camera]
    setting = studio.setting(recording.bar, recording.bar.point_mm)
    number = 0
    for whisk, times_s in enumerate(recording.frame_times_s):
        for time_s in times_s.tolist():
            instants = array_exposure_instants(studio, recording, job.whiskers, time_s, whisk)
            noise = job.stream(_TRIAL, trial, camera + 1, number)
            yield studio.sensor.expose(setting.brightness(instants), noise)
            number += 1
