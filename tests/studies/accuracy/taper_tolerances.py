"""By how much is a whisk's truth off where the length or diameter of a whisker that tapers is a little off?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/taper_tolerances.py [TRIAL ...]

Trials of the protocol `polymer-cone` (steel_b00_v10_1 and steel_b60_v10_1, or those named) are drawn and seen by exact
cameras, with the whisker as it is, half a millimetre longer (the ± of a length that nobody states), the same where that ±
is stated, and 0.02 mm thicker. Printed: by how many of its sigmas without that ± each quantity moves, and how many its
own sigma is.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.rig.parts import Job, render_frames
from bench.rig.protocol import FOLDER, load
from tests.scenes.drawn_traces import exact_cameras, recorded_run
from vision import TrialPictures, observe_trial
from vision.geometry import Bar, Cameras, Rods, VisionSettings, Wire

TRIALS = ("steel_b00_v10_1", "steel_b60_v10_1")
SEED = 77
WIRE = Wire("cone", 100.0, 1.5)
BAR = Bar(6.0)
THETA_RAD = np.radians(3.0)
OFF = {
    "0.5 mm longer": replace(WIRE, length_mm=100.5),
    "0.5 mm longer, ± 0.5 mm": replace(WIRE, length_mm=100.5, length_sigma_mm=0.5),
    "0.02 mm thicker": replace(WIRE, diameter_mm=1.52),
}


def drawn(trial: str) -> tuple[TrialPictures, Cameras]:
    """Return the pictures of a trial of the protocol, and its exact cameras."""
    job = Job(Path(), load(FOLDER / "polymer-cone.toml"), SEED, False)
    runs = list(job.protocol.runs())
    number = [run.name for run in runs].index(trial)
    recording = recorded_run(job, runs[number], number)
    rng = np.random.default_rng(SEED)
    frames = {}
    empty = {}
    for k, studio in enumerate(job.studios):
        frames[studio.camera.name] = dict(enumerate(render_frames(job, number, k, recording)))
        empty[studio.camera.name] = studio.sensor.expose(studio.rig_brightness(), rng).astype(float)
    time_s = np.array([row[0] for row in recording.frames])
    motor_rad = np.array([row[1] for row in recording.frames])
    return TrialPictures(frames, time_s, motor_rad, empty), exact_cameras(job)


def seen(pictures: TrialPictures, cameras: Cameras, wire: Wire) -> dict:
    """Return the truth's values by name, with a whisker as stated."""
    whole = [slice(0, len(pictures.motor_rad))]
    settings = VisionSettings(check_beam=False)
    (whisk,) = observe_trial(pictures, whole, cameras, Rods(wire, BAR), settings).whisks
    at = whisk.at(THETA_RAD)
    return {
        "d_x": whisk.d_x_mm,
        "touch": whisk.touch_rad,
        "slope": whisk.beta_rad,
        "slip": at.slip_mm,
        "phi": at.phi_rad,
        "z": whisk.point_mm.at(2),
    }


def main() -> None:
    for trial in sys.argv[1:] or TRIALS:
        pictures, cameras = drawn(trial)
        right = seen(pictures, cameras, WIRE)
        for name, wire in OFF.items():
            moved = []
            for quantity, value in seen(pictures, cameras, wire).items():
                sigma = right[quantity].sigma
                by = (value.value - right[quantity].value) / sigma
                moved.append(f"{quantity} {by:+.2f} ± {value.sigma / sigma:.2f}")
            print(f"{trial}, {name}: {', '.join(moved)}", flush=True)


if __name__ == "__main__":
    main()
