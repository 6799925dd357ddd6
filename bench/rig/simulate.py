"""Recording a whole session on the synthetic rig: folders that appear whole, the same bytes whoever does the work."""

import shutil
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np

from bench.errors import BadInput
from bench.rig import boards, build, papers
from bench.rig import protocol as protocols
from bench.rig.album import write_frames, write_picture
from bench.rig.protocol import Protocol
from bench.rig.recording import Recording
from bench.rig.scene import HUB_FRONT_MM
from bench.rig.studio import Moment, Studio
from bench.rig.tube import Tube
from bench.rig.whisk import centreline_mm

_BOARDS, _RIG, _TRIAL, _POSE = range(4)  # first words of the random streams


@dataclass(frozen=True)
class Job:
    """All that is needed to make any part of a session."""

    session: Path
    protocol: Protocol
    seed: int
    signals_only: bool

    def stream(self, *words: int) -> np.random.Generator:
        """A generator of its own for each part, so that the order of the work does not matter."""
        return np.random.default_rng(np.random.SeedSequence([self.seed, *words]))


def simulate(session, *, protocol="quick", signals_only=False, seed=0, workers=1, progress=False) -> Path:
    """Write the session folder that a protocol describes; go on where an interrupted one stopped.

    `protocol`: "quick", "paper" or a TOML file. The same seed gives the same bytes for any number of workers.
    Raises BadInput for a bad protocol file, a bad seed, or a folder that holds anything else.
    """
    if seed < 0:
        raise BadInput(f"seed {seed}; a whole number from 0 is allowed")
    job = Job(Path(session), protocols.load(protocol), int(seed), bool(signals_only))
    _check_parts(job, protocol)
    _claim(job)
    parts = [p for p in _parts(job) if not _place(job, p).exists()]
    if progress:
        print(_forecast(job), flush=True)
    _do_all(job, parts, workers, progress)
    return job.session


def _check_parts(job, name):
    """Everything that can be wrong with the parts shows when they are made."""
    try:
        build.rod(job.protocol), build.cameras(job.protocol), build.scene(job.protocol).looks
        job.protocol.board.dictionary and build.board(job.protocol).printed(build.scene(job.protocol).looks.ink, 1.0)
    except (ValueError, cv2.error) as problem:
        raise BadInput(f"protocol: {' '.join(str(problem).split())}", file=name) from None


def _claim(job):
    """Begin a session, or make sure that the one which is there is of the same protocol and seed."""
    session = papers.session_toml(job.protocol, build.stated_T_rig_board(job.protocol, job.stream(_POSE)))
    truth = papers.truth_json(job.protocol, job.seed)
    there = job.session / "truth.json"
    if there.exists():
        if there.read_text() != truth:
            raise BadInput("holds a session of another protocol or seed; name another folder", file=job.session)
        return
    if job.session.exists() and any(job.session.iterdir()):
        raise BadInput("is not empty and holds no simulated session; name another folder", file=job.session)
    (job.session / "trials").mkdir(parents=True)
    papers.write(job.session / "session.toml", session)
    papers.write(there, truth)


def _parts(job):
    """("boards", camera), ("rig",) and ("trial", number)."""
    if not job.signals_only and job.protocol.cameras:
        yield ("rig",)
        yield from (("boards", i) for i in range(len(job.protocol.cameras)))
    yield from (("trial", i) for i in range(len(job.protocol.runs())))


def _place(job, part):
    if part[0] == "trial":
        return job.session / "trials" / job.protocol.runs()[part[1]].name
    return job.session / "boards" / ("rig" if part[0] == "rig" else job.protocol.cameras[part[1]].name)


def _forecast(job):
    """What the session will hold, and how big and long it will be (0.24 MB and 0.1 s a picture, as measured)."""
    runs = job.protocol.runs()
    pictures = job.protocol.pictures
    each = int((pictures.before_deg + pictures.after_deg) / pictures.step_deg + 1e-9) + 1
    frames = 0 if job.signals_only else sum(r.table.whisks for r in runs) * each * len(job.protocol.cameras)
    views = 0 if job.signals_only else (job.protocol.board.views + 1) * len(job.protocol.cameras)
    size = {"jpg": 0.24, "png": 0.45, "mkv": 0.4}[pictures.format] * (frames + views)
    whisks = sum(r.table.whisks for r in runs)
    return (f"{len(runs)} trials, {whisks} whisks, {frames + views} pictures: about {size + 0.1 * whisks:.0f} MB and "
            f"{(0.12 * (frames + views) + 1.0 * len(runs)) / 60:.1f} minutes of one core")


def _do_all(job, parts, workers, progress):
    from tqdm import tqdm

    with tqdm(total=len(parts), disable=None if progress else True, unit="part") as bar:
        if workers <= 1 or len(parts) <= 1:
            for part in parts:
                make(job, part)
                bar.update()
            return
        with ProcessPoolExecutor(workers, initializer=cv2.setNumThreads, initargs=(1,)) as pool:
            for _ in pool.map(make, [job] * len(parts), parts):
                bar.update()


def make(job: Job, part: tuple) -> None:
    """One part, written beside its place under another name and moved there when whole."""
    place = _place(job, part)
    unfinished = place.with_name(f".{place.name}.unfinished")
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir(parents=True)
    {"trial": _trial, "boards": _board_views, "rig": _rig_views}[part[0]](job, part, unfinished)
    unfinished.rename(place)


@lru_cache(maxsize=4)
def _studios(fingerprint, protocol_json):
    import msgspec

    found = msgspec.json.decode(protocol_json, type=Protocol)
    scene, sensor = build.scene(found), build.sensor(found)
    return [Studio(camera, scene, sensor) for camera in build.cameras(found)]


def _studios_of(job):
    """The cameras with their backdrops, kept while a process works on one session."""
    import msgspec

    return _studios(job.protocol.fingerprint(), msgspec.json.encode(job.protocol))


def _suffix(job):
    return ".png" if job.protocol.pictures.format == "mkv" or job.protocol.pictures.bits > 8 else "." + job.protocol.pictures.format


def _board_views(job, part, folder):
    studio = _studios_of(job)[part[1]]
    held = boards.poses(build.board(job.protocol), studio.camera, job.protocol.board.views, job.stream(_BOARDS, part[1]))
    for i, pose in enumerate(held):
        picture = studio.board_picture(pose, job.stream(_BOARDS, part[1], i + 1))
        write_picture(folder / f"{i:02d}{_suffix(job)}", picture)


def _rig_views(job, part, folder):
    for i, studio in enumerate(_studios_of(job)):
        write_picture(folder / f"{studio.camera.name}.png", studio.rig_picture(job.stream(_RIG, i)))


def _trial(job, part, folder):
    recording = Recording.make(job.protocol, job.protocol.runs()[part[1]], job.stream(_TRIAL, part[1]))
    pictures = job.protocol.pictures
    papers.write(folder / "trial.toml", papers.trial_toml(recording))
    papers.write(folder / "signals.csv", papers.signals_csv(recording))
    papers.write(folder / "frames.csv", papers.frames_csv(recording, pictures.clock_offset_s))
    papers.write(folder / "truth.csv", papers.truth_csv(recording))
    papers.write(folder / "truth.toml", papers.truth_toml(recording))
    if job.signals_only:
        return
    kind = "png" if pictures.bits > 8 else pictures.format
    for i, studio in enumerate(_studios_of(job)):
        frames = _frames(job, part[1], i, studio, recording)
        write_frames(folder, studio.camera.name, kind, frames)


def _frames(job, trial, camera, studio, recording):
    setting = studio.setting(recording.bar, recording.touch.point_mm)
    speed = np.radians(recording.run.speed_deg_s)
    for f, (motor, state, whisk) in enumerate(zip(recording.frames.motor_rad, recording.states, recording.frames.whisk)):
        moments = _moments(job.protocol, studio, recording, recording.whisks[whisk], motor, speed)
        yield setting.frame(moments, job.stream(_TRIAL, trial, camera + 1, f))


def _moments(protocol, studio, recording, whisk, motor, speed):
    """Instants of one exposure: as many as keep the whisker's tip within half a pixel from one to the next."""
    swept = speed * protocol.pictures.exposure_s if protocol.pictures.motion_blur else 0.0
    near = np.linalg.norm(studio.camera.centre_mm - recording.touch.point_mm)
    count = 1 + int(2 * swept * recording.rod.length_mm * studio.camera.matrix[0, 0] / near)
    at = motor + swept * ((np.arange(count) + 0.5) / count - 0.5)
    return [Moment(m, _whisker(studio, recording, whisk, float(m))) for m in at]


def _whisker(studio, recording, whisk, motor):
    rod = recording.rod
    arc = np.linspace(HUB_FRONT_MM, rod.length_mm, 257)
    state = whisk.state_between(motor)
    points = centreline_mm(rod, recording.bar, motor, state, arc)
    return Tube(points, np.maximum(rod.radius_mm(arc), 0.01), studio.scene.looks.wire)
