"""Where the brightness of the wire lies beside its true centreline: a recorded session and its twin, frame by frame.

    python tests/studies/accuracy/twin_light.py RECORDED

The twin repeats each measured trial of RECORDED (the steel sample) exactly: its slope, distance and touch. In the lower
camera the wire stands before the even floor, so that the centroid above the ground tells how its shading shifts what
is seen. Prints, for pieces of the wire and for the first and the last frames of a stroke, its place in pixels across
the wire, and its amount against the first frames'.
"""

import sys
import tomllib
from pathlib import Path

import cv2
import msgspec
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.rig.parts import Job, render_frames
from bench.rig.protocol import load
from bench.rig.protocol_tables import TrialTable
from bench.rig.recording import Recording

TWIN, CAMERA, NAME = Path(__file__).with_name("twin.toml"), 1, "low"
PIECES_MM = {
    "15 to 35 mm": (15, 35),
    "35 to 52 mm": (35, 52),
    "68 to 82 mm": (68, 82),
    "82 to 96 mm": (82, 96),
}
ACROSS_PX = np.arange(-10, 10.01, 0.25)


def exact_trial(folder: Path) -> TrialTable:
    """The recorded trial, without scatter."""
    truth = tomllib.loads((folder / "truth.toml").read_text())
    return TrialTable(
        name=folder.name,
        beta_deg=truth["beta_deg"],
        d_x_mm=truth["d_x_mm"],
        touch_deg=truth["touch_deg"],
        friction=truth["mu_kinetic"],
        beta_scatter_deg=0.0,
        d_x_scatter_mm=0.0,
        touch_scatter_deg=0.0,
    )


def centroid(picture, line_px) -> tuple[float, float]:
    """(place, amount): of the brightness above the ground beside it, over the length of a line of points (n, 2)."""
    ahead = np.gradient(line_px, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    aside = np.stack([-ahead[:, 1], ahead[:, 0]], 1)
    at = (line_px[:, None] + ACROSS_PX[None, :, None] * aside[:, None]).astype(np.float32)
    profile = cv2.remap(picture.astype(np.float32), at[..., 0], at[..., 1], cv2.INTER_CUBIC).mean(0)
    ground = np.abs(ACROSS_PX) > 7.5
    above = profile - np.polyval(np.polyfit(ACROSS_PX[ground], profile[ground], 1), ACROSS_PX)
    above = above[~ground]
    return float(above @ ACROSS_PX[~ground] / above.sum()), float(above.sum())


def places(recording: Recording, camera, pictures) -> np.ndarray:
    """(frames, pieces, 2) of place and amount."""
    whisk, found = recording.whisks[0], []
    for picture, motor in zip(pictures, recording.frames.motor_rad):
        state = whisk.forward.state_between(motor)
        lines = [
            whisk.centreline_mm(motor, state, np.linspace(*piece, 160))
            for piece in PIECES_MM.values()
        ]
        found.append([centroid(picture, camera.project(line)) for line in lines])
    return np.array(found)


def main() -> None:
    recorded, twin = Path(sys.argv[1]), load(TWIN)
    folders = [f for f in sorted((recorded / "trials").iterdir()) if not f.name.startswith("gauge")]
    job = Job(
        recorded, msgspec.structs.replace(twin, trials=[exact_trial(f) for f in folders]), 0, False
    )
    for number, (folder, run) in enumerate(zip(folders, job.protocol.runs())):
        recording = Recording.make(run, job.stream(2, number))
        pictures = [
            cv2.imread(str(p), cv2.IMREAD_GRAYSCALE) for p in sorted((folder / NAME).iterdir())
        ]
        for name, seen in (
            ("recorded", pictures),
            ("twin", list(render_frames(job, number, CAMERA, recording))),
        ):
            place, amount = np.moveaxis(places(recording, job.studios[CAMERA].camera, seen), -1, 0)
            print(folder.name, name)
            for i, piece in enumerate(PIECES_MM):
                first, last = place[:4, i].mean(), place[-4:, i].mean()
                print(
                    f"  {piece}: {first:+.2f} px, then {last:+.2f} px; "
                    f"amount {100 * (amount[-4:, i].mean() / amount[:4, i].mean() - 1):+.0f} %"
                )


if __name__ == "__main__":
    main()
