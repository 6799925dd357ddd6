"""Recording a whole session on the synthetic rig: folders that appear whole, the same bytes whoever does the work."""

import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path

import cv2

from bench.base.errors import BadInput
from bench.base.workers import Workers
from bench.rig import build, papers
from bench.rig.parts import Job, Part
from bench.rig.protocol import load

_MEGABYTES = {
    "jpg": 0.28,
    "png": 0.46,
    "mkv": 0.45,
}  # a picture of 1280 × 720 (tests/studies/speed/rig.py)
_PICTURE_S, _WHISK_S = 0.08, 0.3  # of one core


def simulate(
    session: Path | str,
    *,
    protocol: Path | str = "quick",
    signals_only: bool = False,
    seed: int = 0,
    workers: int = 0,
    progress: bool = False,
    announce: Callable[[str], object] | None = None,
) -> Path:
    """Write the session folder that a protocol describes; go on where an interrupted one stopped.

    `protocol`: "quick", "paper" or a TOML file. The same seed gives the same bytes for any number of workers; with 0
    the work is done in this process. `announce` is told size and time before the work begins. Raises BadInput for a
    bad protocol file or seed, a whisker that slips off its bar, or a folder that holds anything else.
    """
    if seed < 0:
        raise BadInput(f"seed {seed}; a whole number from 0 is allowed")
    job = Job(Path(session), load(protocol), int(seed), bool(signals_only))
    _check_can_be_built(job, protocol)
    _check_can_be_rendered(job, protocol)
    _claim(job)
    left = [part for part in job.parts() if not part.folder.exists()]
    if announce is not None:
        announce(forecast(job, workers))
    with Workers(workers, progress) as pool:
        pool.run(partial(make, job), left, "parts")
    return job.session


def forecast(job: Job, workers: int) -> str:
    """What a session will hold, how big it will be and how long it will take."""
    runs, pictures, cameras = job.protocol.runs(), job.protocol.pictures, job.protocol.cameras
    whisks = sum(run.table.whisks for run in runs) * max(1, len(job.whiskers))
    frames = sum(run.table.whisks * pictures.frames_a_whisk(run.speed_deg_s) for run in runs)
    seen = 0 if job.signals_only else (frames + job.protocol.board.views + 1) * len(cameras)
    scale = sum(c.size_px[0] * c.size_px[1] for c in cameras) / (1280 * 720 * max(len(cameras), 1))
    size = seen * scale * _MEGABYTES[pictures.format] + sum(
        _signal_megabytes(job, run) for run in runs
    )
    minutes = (seen * scale * _PICTURE_S + whisks * _WHISK_S) / max(workers, 1) / 60
    return f"{len(runs)} trials, {whisks} whisks, {seen} pictures: about {size:.0f} MB and {minutes:.1f} minutes"


def _signal_megabytes(job, run):
    stroke_s = (run.before_deg + run.after_deg) / run.speed_deg_s + job.protocol.motor.pause_s
    seconds = stroke_s * run.table.whisks * (2 if job.protocol.goes_back(run) else 1)
    return seconds * job.protocol.gauges.rate_Hz * 38e-6 * max(1, len(job.whiskers))


def _check_can_be_built(job, name):
    """Boards and cameras say themselves what is wrong with them."""
    try:
        scene = build.scene(job.protocol)
        scene.board.to_print(scene.appearance.ink, scene.appearance.margin_mm)
        build.rod(job.protocol), build.cameras(job.protocol)
    except (ValueError, cv2.error) as problem:
        raise BadInput(" ".join(str(problem).split()), file=name) from None


def _check_can_be_rendered(job, name):
    if job.signals_only or not job.protocol.cameras:
        return
    if job.whiskers and any(trial.stiffness_N_mm for trial in job.protocol.trials):
        found = "an array ([[columns]]) before a soft bar is simulated in signals alone"
        raise BadInput(f"{found}; add --signals-only", file=name)


def _claim(job):
    """Begin a session, or make sure that the one which is there is of the same protocol and seed."""
    texts, truth = job.papers(), job.session / "truth.json"
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
            papers.write(job.session / name, text)


def make(job: Job, part: Part) -> None:
    """One part, written beside its place under another name and moved there when whole.

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
