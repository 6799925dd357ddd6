"""Truth by traces of another program against the exact one, in simulated sessions.

    python tests/studies/accuracy/given_traces.py FOLDER [--seeds 3] [--lasting-px 0.1] [--too alone pictures]

FOLDER keeps the sessions. In each, four whisks before the cameras of `quick` are seen by their
pictures, and by exact lines of the wire moved by 0.3 px in all: 0.2 px a point, 0.2 px over 60 px of
the wire, and --lasting-px in all frames alike; the bar is found in the pictures in both, and without pictures placed by two
tracked points. Printed: of d_x, touch and slope the errors, their RMS, and the errors over their sigmas.
"""

import argparse
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.rig.simulation import simulate
from tests.scenes.drawn_traces import exact_lines, rows_of, with_errors
from tests.scenes.model_scenes import RODS
from tests.scenes.recorded import Recorded
from tests.scenes.rig_sessions import CAMERAS_OF_QUICK
from tests.scenes.traced_example import tracked_points, true_axis
from vision import Trace, TrialPictures, TrialTraces
from vision.geometry import VisionSettings

PROTOCOL = f"""
name = "traces"
{CAMERAS_OF_QUICK}[board]
views = 1
[[trials]]
beta_deg = [0, 25, 45, 65]
d_x_mm = 58.0
"""
TOO = ("alone", "pictures")
PLACES_MM = (-15.0, 20.0)
QUANTITIES = {"d_x_mm": 1.0, "touch_rad": np.degrees(1.0), "beta_rad": np.degrees(1.0)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--lasting-px", type=float, default=0.1)
    parser.add_argument("--too", nargs="*", default=[], choices=TOO, help="ways besides traces")
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    errors = {}
    for seed in range(arguments.seeds):
        for name, *row in whisks(arguments.folder, seed, arguments.lasting_px, arguments.too):
            errors.setdefault(name, []).append(row)
            print(seed, name, " ".join(f"{e:+.4f} ± {s:.4f}" for e, s in row), flush=True)
    for name, rows in errors.items():
        table = np.array(rows)
        for (quantity, _), column in zip(QUANTITIES.items(), np.moveaxis(table, 1, 0)):
            z = column[:, 0] / column[:, 1]
            print(
                f"{name:9s} {quantity:10s} n {len(z):3d}  RMS {np.sqrt(np.mean(column[:, 0] ** 2)):.4f}  "
                f"largest {np.abs(column[:, 0]).max():.4f}  RMS z {np.sqrt(np.mean(z**2)):.2f}  "
                f"within 1.96 sigma {np.mean(np.abs(z) < 1.96):.0%}"
            )


def whisks(folder, seed, lasting_px, too):
    """Yield by what a whisk was seen, and error and sigma of each quantity. too: ways besides traces, of TOO."""
    protocol = folder / "protocol.toml"
    protocol.write_text(PROTOCOL)
    session = simulate(folder / f"s{seed}", protocol=protocol, seed=seed)
    rng = np.random.default_rng([seed, 1])
    for trial, lines in exact_lines(session, protocol, seed).items():
        recorded = Recorded(session, trial)
        traces = {}
        for name, of_camera in lines.items():
            rows = rows_of(with_errors(of_camera, rng, lasting_px=lasting_px))
            n = len(rows)
            frame = rows[:, 0].astype(int)
            traces[name] = Trace(frame, rows[:, 1:], np.zeros(n, dtype=int), np.full(n, np.nan))
        pictures = TrialPictures(
            recorded.frames,
            recorded.rows["time_s"],
            np.radians(recorded.rows["motor_deg"]),
            recorded.background,
        )
        truth = tomllib.loads((session / "trials" / trial / "truth.toml").read_text())
        settings = VisionSettings(check_beam=False)
        given = recorded.see_frames(replace(pictures, traces=traces), settings)
        yield "traces", *errors_of(given, truth)
        if "alone" in too:
            yield "alone", *errors_of(alone(recorded, traces, settings, rng), truth)
        if "pictures" in too:
            yield "pictures", *errors_of(recorded.see_frames(pictures, settings), truth)


def alone(recorded, traces, settings, rng):
    """The truth of traces without pictures, the bar by two points of its middle, 35 mm apart, 0.3 px off."""
    motor_rad = np.radians(recorded.rows["motor_deg"])
    axis = true_axis(recorded.truth)
    points = tracked_points(axis, recorded.cameras, len(motor_rad), PLACES_MM, rng)
    recording = TrialTraces.with_points(traces, recorded.rows["time_s"], motor_rad, points)
    whole = [slice(0, len(motor_rad))]
    (whisk,) = recording.observe(whole, recorded.cameras, RODS, settings).whisks
    return whisk


def errors_of(whisk, truth):
    """Error and sigma of each quantity of a whisk."""
    if whisk.status:
        print(whisk.status)
    for quantity, scale in QUANTITIES.items():
        value = getattr(whisk, quantity)
        true = truth[quantity.replace("_rad", "_deg")]
        yield scale * value.value - true, scale * value.sigma


if __name__ == "__main__":
    main()
