"""One trial of a session with its truth, and the session's true cameras."""

import csv
import json
import tomllib

import numpy as np

from vision.geometry.camera import Camera, Cameras
from vision.geometry.rods import Bar, Rods, Wire
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.files import read_picture
from vision.pictures.frames import Frames
from vision.truth.observe import observe_trial
from vision.truth.trial_pictures import TrialPictures

WIRE, BAR = Wire("cylinder", 100.0, 1.0), Bar(6.0)
RODS = Rods(WIRE, BAR)


def exact_cameras(session):
    """The session's true cameras: what is tested here is the wire, the bar and the touch."""
    truth = json.loads((session / "truth.json").read_text())["cameras"].values()
    return Cameras(tuple(_camera(c) for c in truth))


def _camera(c):
    return Camera(
        c["name"], (c["width"], c["height"]), c["K"], c["dist"], np.column_stack([c["R"], c["t"]])
    )


def _number(cell):
    """The number of a cell; NaN where it is a word or empty."""
    try:
        return float(cell)
    except ValueError:
        return np.nan


class Recorded:
    """Pictures, times and truth of one trial."""

    def __init__(self, session, trial):
        folder = session / "trials" / trial
        self.cameras = exact_cameras(session)
        self.truth = tomllib.loads((folder / "truth.toml").read_text())
        rows = list(csv.DictReader((folder / "truth.csv").open()))
        self.rows = {name: np.array([_number(row[name]) for row in rows]) for name in rows[0]}
        self.frames = {c.name: dict(Frames.open(folder / c.name).read()) for c in self.cameras}
        self.background = {
            c.name: read_picture(session / "boards" / "rig" / f"{c.name}.png").astype(float)
            for c in self.cameras
        }

    def see(self, keep=slice(None), **settings):
        """The truth of the frames in `keep`, renumbered from 0."""
        chosen = range(len(self.rows["time_s"]))[keep]
        frames = {
            name: {k: pictures[f] for k, f in enumerate(chosen) if f in pictures}
            for name, pictures in self.frames.items()
        }
        motor, time = np.radians(self.rows["motor_deg"][keep]), self.rows["time_s"][keep]
        return self.see_frames(
            TrialPictures(frames, time, motor, self.background), VisionSettings(**settings)
        )

    def see_frames(self, pictures, settings=VisionSettings()):  # noqa: B008
        """The truth of these pictures, taken as one whisk."""
        whole = [slice(0, len(pictures.motor_rad))]
        (whisk,) = observe_trial(pictures, whole, self.cameras, RODS, settings).whisks
        return whisk
