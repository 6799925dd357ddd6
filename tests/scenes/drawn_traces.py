"""Traces of a simulated session: the wire's exact lines in each picture, moved as a tracker errs."""

from pathlib import Path

import numpy as np

from bench.rig import build
from bench.rig.parts import Job
from bench.rig.protocol import load
from bench.rig.recording import Recording
from vision.geometry.camera import Camera, Cameras
from vision.geometry.polyline import normals

STEP_PX = 4.0
"""Between a tracker's points."""
SMOOTH_PX = 60.0
"""Length over which its errors are alike."""
_TRIAL = 2  # first word of a trial's random stream, as bench.rig.parts has it


def exact_lines(session: Path, protocol: Path, seed: int) -> dict[str, dict[str, list]]:
    """By trial and camera, of each frame the wire's line (n, 2) px from the hub to the tip."""
    job = Job(session, load(protocol), seed, False)
    cameras = exact_cameras(job)
    found = {}
    for number, run in enumerate(job.protocol.runs()):
        recording = recorded_run(job, run, number)
        curves = [_curve(recording, *row) for row in recording.frames]
        found[run.name] = {c.name: [c.project(curve) for curve in curves] for c in cameras}
    return found


def exact_cameras(job: Job) -> Cameras:
    """The true cameras of a job's protocol."""
    cameras = []
    for c in build.cameras(job.protocol):
        pose = np.column_stack([c.rotation, c.translation_mm])
        cameras.append(Camera(c.name, c.size_px, c.matrix, c.distortion, pose))
    return Cameras(tuple(cameras))


def recorded_run(job: Job, run, number: int) -> Recording:
    """What the rig records of a job's run, of this number among all."""
    return Recording.make(run, job.stream(_TRIAL, number))


def _curve(recording, _time_s, motor_rad, whisk, back):
    mechanics = recording.whisks[whisk]
    path = mechanics.back if back else mechanics.forward
    arc_mm = np.linspace(8.0, recording.rod.length_mm, 400)
    return mechanics.centreline_mm(motor_rad, path.state_between(motor_rad), arc_mm)


def with_errors(lines, rng, white_px=0.2, smooth_px=0.2, lasting_px=0.1):
    """A camera's lines, a point every STEP_PX: each errs by itself (white), over SMOOTH_PX in each
    frame (smooth), and in all frames alike (lasting); 0.3 px in all."""
    count = 1 + int(max(_length_px(line) for line in lines) / STEP_PX)
    lasting = lasting_px * _smooth_noise(rng, count)
    traced = []
    for line in lines:
        length_px = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))
        at_px = np.arange(0.0, length_px[-1], STEP_PX)
        px = np.stack([np.interp(at_px, length_px, column) for column in line.T], axis=1)
        own = smooth_px * _smooth_noise(rng, len(px)) + white_px * rng.normal(size=len(px))
        traced.append(px + (own + lasting[: len(px)])[:, None] * normals(px))
    return traced


def _length_px(line):
    return np.sum(np.linalg.norm(np.diff(line, axis=0), axis=1))


def _smooth_noise(rng, count):
    """Noise of unit variance whose correlation falls by e over SMOOTH_PX."""
    along = np.arange(count) * STEP_PX
    covariance = np.exp(-0.5 * ((along[:, None] - along) / SMOOTH_PX) ** 2)
    values, vectors = np.linalg.eigh(covariance)
    return vectors @ (np.sqrt(np.maximum(values, 0.0)) * rng.normal(size=count))


def rows_of(traced):
    """The rows (frame, u_px, v_px) of a camera's trace."""
    rows = []
    for frame, px in enumerate(traced):
        rows += [(frame, u, v) for u, v in px]
    return np.array(rows)


def csv_of(traced):
    """The text of trace_<camera>.csv."""
    rows = [f"{frame:.0f},{u:.2f},{v:.2f}" for frame, u, v in rows_of(traced)]
    return "\n".join(["frame,u_px,v_px", *rows]) + "\n"
