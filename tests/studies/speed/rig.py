"""What the synthetic rig costs: frames of 1280 × 720, mechanics of a whisk, a session of each built-in protocol.

    python tests/studies/speed/rig.py

Prints CPU seconds of one core, the median of several, and JPEG bytes. Sessions are reckoned from trials spread over the
protocol, not made.
"""

import math
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

import cv2

from bench.rig import build
from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.elastic_rod import RestShape, Rod
from bench.rig.parts import Job, SessionPart, render_frames
from bench.rig.protocol import load
from bench.rig.recording import Recording
from bench.rig.simulation import make_part
from bench.rig.stick_slip import FrictionCoefficients
from bench.rig.whisk_mechanics import WhiskMechanics


def cpu_s(work, repeats: int = 5) -> float:
    """Median CPU seconds of a call."""
    taken = []
    for _ in range(repeats):
        begin = time.process_time()
        work()
        taken.append(time.process_time() - begin)
    return float(np.median(taken))


def whisk_s(beta_deg: float, static: float, kinetic: float, back: bool, set_mm: float) -> float:
    """Mechanics of 60 steps of 0.1°; set_mm: how far the unloaded whisker's tip lies aside."""
    rod = Rod("cylinder", 100.0, 1.0, 60.0, rest=RestShape(100.0, 0.0, set_mm))
    bar = TouchedBar.at_contact(
        d_x_mm=60.0,
        beta_rad=math.radians(beta_deg),
        psi_rad=0.0,
        touch_rad=0.04,
        radius_mm=3.0,
        whisker_radius_mm=0.5,
    )
    touch, step = find_first_touch(rod, bar, 0.04, 60.0), math.radians(0.1)
    end, friction = touch.motor_rad + 60 * step, FrictionCoefficients(static, kinetic)
    return cpu_s(
        lambda: WhiskMechanics.run(rod, bar, friction, touch, end, step_rad=step, back=back)
    )


def frame_s(protocol_name: str, trial: int, camera: int) -> tuple[float, int]:
    """One frame of a trial: drawn, exposed and encoded; its CPU seconds and the file's bytes."""
    with TemporaryDirectory() as folder:
        job = Job(Path(folder), load(protocol_name), 0, False)
        recording = Recording.make(job.protocol.runs()[trial], job.stream(2, trial))
        frames, sizes = render_frames(job, trial, camera, recording), []

        def encode():
            sizes.append(len(cv2.imencode(".jpg", next(frames), [cv2.IMWRITE_JPEG_QUALITY, 95])[1]))

        encode()  # the still scene is drawn once
        return cpu_s(encode, 9), int(np.median(sizes))


def session_cost(protocol_name: str, every: int) -> tuple[float, float]:
    """CPU minutes and GB of a whole session, from every so many-th of its trials and all of its boards."""
    spent, size = 0.0, 0
    with TemporaryDirectory() as folder:
        job = Job(Path(folder), load(protocol_name), 0, False)
        parts = list(job.parts())
        trials = [p for p in parts if p.kind == "trial"]
        chosen = trials[every // 2 :: every]
        for part in [p for p in parts if p.kind != "trial"] + chosen:
            cost, held = _made(job, part)
            weight = len(trials) / len(chosen) if part.kind == "trial" else 1
            spent, size = spent + weight * cost, size + weight * held
    return spent / 60, size / 1e9


def _made(job: Job, part: SessionPart) -> tuple[float, int]:
    begin = time.process_time()
    make_part(job, part)
    cost = time.process_time() - begin
    return cost, sum(f.stat().st_size for f in part.folder.rglob("*") if f.is_file())


def main() -> None:
    cv2.setNumThreads(1)
    for name, *of_whisk in (
        ("one coefficient", 60, 0.185, 0.185, False, 0.0),
        ("stick–slip", 60, 0.25, 0.185, False, 0.0),
        ("stick–slip and the way back", 60, 0.25, 0.185, True, 0.0),
        ("one coefficient, with a set", 60, 0.185, 0.185, False, 0.5),
        ("stick–slip, with a set", 60, 0.25, 0.185, False, 0.5),
    ):
        print(f"a whisk of 60 steps, {name}: {whisk_s(*of_whisk):.3f} s")
    runs = load("paper").runs()
    for trial in (10, 26, 60):
        for camera, table in enumerate(build.cameras(load("paper"))):
            seconds, size = frame_s("paper", trial, camera)
            print(
                f"a frame of {runs[trial].name}, camera {table.name}: {seconds:.3f} s, {size / 1000:.0f} kB"
            )
    for name, every in (("quick", 1), ("paper", 13)):
        minutes, gigabytes = session_cost(name, every)
        print(f"--protocol {name}: {minutes:.1f} CPU minutes, {gigabytes:.2f} GB")


if __name__ == "__main__":
    main()
