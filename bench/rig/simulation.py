"""A whole session of the synthetic rig: folders that appear whole, the same for any workers."""

import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path

import cv2

from bench.base.errors import BadInput
from bench.base.workers import Workers
from bench.rig import build, session_files
from bench.rig.parts import Job, SessionPart
from bench.rig.protocol import load

_PIXELS = 1280 * 720  # of the pictures that the sizes and times below are of
# MB a picture (tests/studies/speed/rig.py)
_MEGABYTES = {"jpg": 0.28, "png": 0.46, "mkv": 0.45}
_SAMPLE_MEGABYTES = 38e-6  # of signals.csv
_PICTURE_S, _WHISK_S = 0.08, 0.3  # of one core


def simulate(
    session: Path | str,
    *,
    protocol: Path | str = "quick",
    signals_only: bool = False,
    seed: int = 0,
    workers: int = 0,
    announce: Callable[[str], object] | None = None,
) -> Path:
    """Write the session folder that a protocol describes; go on where an interrupted one stopped.

    `protocol`: "quick", "paper" or a TOML file. The same seed gives the same bytes for any number
    of workers; with 0 the work is done in this process. `announce` gets size and time before the
    work begins. Raises BadInput for a bad protocol file or seed, a whisker that slips off its bar,
    or a folder that holds anything else.
    """
    if seed < 0:
        raise BadInput(f"seed {seed}; a whole number from 0 is allowed")
    job = Job(Path(session), load(protocol), int(seed), bool(signals_only))
    _require_buildable(job, protocol)
    _require_renderable(job, protocol)
    _claim(job)
    left = [part for part in job.parts() if not part.folder.exists()]
    if announce is not None:
        announce(forecast(job, workers))
    with Workers(workers) as pool:
        pool.run(partial(make_part, job), left, "parts")
    return job.session


def forecast(job: Job, workers: int) -> str:
    """Return a line that says what a session will hold, how big it will be and how long it will
    take."""
    runs = job.protocol.runs()
    whiskers = max(1, len(job.whiskers))
    whisks = whiskers * sum(run.table.whisks for run in runs)
    samples = whiskers * sum(_sample_count(run) for run in runs)
    frames = _frame_count(job)  # of each camera
    sizes_px = [camera.size_px for camera in job.protocol.cameras]
    pictures = frames * len(sizes_px)
    # As many of _PIXELS would take as long.
    scaled_pictures = frames * sum(width * height for width, height in sizes_px) / _PIXELS
    megabytes = scaled_pictures * _MEGABYTES[job.protocol.pictures.format]
    megabytes += samples * _SAMPLE_MEGABYTES
    minutes = (scaled_pictures * _PICTURE_S + whisks * _WHISK_S) / max(workers, 1) / 60
    found = f"{len(runs)} trials, {whisks} whisks, {pictures} pictures"
    return f"{found}: about {megabytes:.0f} MB and {minutes:.1f} minutes"


def _sample_count(run) -> float:
    """Return the number of samples of a trial's signals."""
    protocol = run.protocol
    stroke_s = (run.before_deg + run.after_deg) / run.speed_deg_s + protocol.motor.pause_s
    strokes = run.table.whisks * (2 if run.goes_back else 1)
    return stroke_s * strokes * protocol.gauges.rate_Hz


def _frame_count(job) -> int:
    """Return the number of pictures that each camera takes."""
    if not job.has_pictures:
        return 0
    count = job.protocol.board.views + 1
    for run in job.protocol.runs():
        count += run.table.whisks * job.protocol.pictures.frames_a_whisk(run.speed_deg_s)
    return count


def _require_buildable(job, name):
    """Raise BadInput where a board, a whisker or a camera cannot be built."""
    try:
        scene = build.scene(job.protocol)
        scene.board.to_print(scene.appearance.ink, scene.appearance.margin_mm)
        build.rod(job.protocol)
        build.cameras(job.protocol)
    except (ValueError, cv2.error) as problem:
        raise BadInput(" ".join(str(problem).split()), file=name) from None


def _require_renderable(job, name):
    """Raise BadInput where the pictures of a scene cannot be rendered."""
    is_soft = any(trial.stiffness_N_mm for trial in job.protocol.trials)
    if job.has_pictures and job.whiskers and is_soft:
        found = "an array ([[columns]]) before a soft bar is simulated in signals alone"
        raise BadInput(f"{found}; add --signals-only", file=name)


def _claim(job):
    """Begin a session; raise BadInput where the folder holds another one, or anything else."""
    texts = job.text_files()
    truth = job.session / "truth.json"
    if truth.exists():
        if truth.read_text(encoding="utf-8") != texts["truth.json"]:
            raise BadInput(
                "holds a session of another protocol or seed; name another folder", file=job.session
            )
    elif job.session.exists() and any(job.session.iterdir()):
        raise BadInput(
            "is not empty and holds no simulated session; name another folder", file=job.session
        )
    (job.session / "trials").mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        if not (job.session / name).exists():
            session_files.write(job.session / name, text)


def make_part(job: Job, part: SessionPart) -> None:
    """Make one part, written next to its place under another name and moved there when whole.

    Raises BadInput where the whisker slips off the bar or buckles.
    """
    unfinished = part.folder.with_name(f".{part.folder.name}.unfinished")
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir(parents=True)
    try:
        part.write(job, unfinished)
    except ArithmeticError as problem:
        shutil.rmtree(unfinished, ignore_errors=True)
        advice = "push less far (motor.after_deg) or nearer the base"
        found = f"the whisker slips off or buckles ({problem})"
        raise BadInput(f"{found}; {advice}", file=f"trial {part.folder.name}") from None
    unfinished.rename(part.folder)
