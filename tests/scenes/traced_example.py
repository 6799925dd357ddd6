"""The worked example of traces, fixtures/bring/traces, in memory."""

import csv
import tomllib
from pathlib import Path

import numpy as np

from tests.scenes.model_scenes import WIRE
from vision.calibration.cameras_file import read_cameras
from vision.geometry.camera import Cameras
from vision.geometry.contact import BarAxis
from vision.geometry.rods import Bar, Rods
from vision.geometry.silhouette import edges
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.files import read_picture
from vision.pictures.frames import Frames
from vision.touched.find import axis_from_angles
from vision.truth.observe import observe_trial
from vision.truth.trace_points import Trace
from vision.truth.trial_pictures import TrialPictures

BAR = Bar(6.0)
SCATTER_PX = 0.3
"""Of a tracked point of the bar in each frame."""
BRING = Path(__file__).resolve().parents[2] / "fixtures" / "bring" / "traces"


class Example:
    """Pictures, traces and truth of the worked example."""

    def __init__(self):
        trial = next((BRING / "trials").iterdir())
        self.cameras = read_cameras(BRING / "cameras.toml")
        self.truth = tomllib.loads((trial / "truth.toml").read_text())
        rows = list(csv.DictReader((trial / "truth.csv").open()))
        self.time_s = np.array([float(row["time_s"]) for row in rows])
        self.motor_rad = np.radians([float(row["motor_deg"]) for row in rows])
        self.frames = {c.name: dict(Frames.open(trial / c.name).read()) for c in self.cameras}
        self.background = {
            c.name: read_picture(BRING / "boards" / "rig" / f"{c.name}.jpg").astype(float)
            for c in self.cameras
        }
        high = np.loadtxt(trial / "trace_high.csv", delimiter=",", skiprows=1)
        low = np.loadtxt(trial / "trace_low.csv", delimiter=",", skiprows=3)
        joints = low[:, 1:].reshape(len(low), -1, 3)[:, :, :2]
        frame = np.repeat(low[:, 0], joints.shape[1])
        self.traces = {
            "high": as_trace(high[:, 0], high[:, 1:]),
            "low": as_trace(frame, joints.reshape(-1, 2)),
        }

    def see(self, traces):
        pictures = TrialPictures(
            self.frames, self.time_s, self.motor_rad, self.background, traces=traces
        )
        whole = [slice(0, len(self.motor_rad))]
        rods = Rods(WIRE, BAR)
        settings = VisionSettings(check_beam=False)
        (whisk,) = observe_trial(pictures, whole, self.cameras, rods, settings).whisks
        return whisk


def as_trace(frame, px):
    n = len(frame)
    return Trace(frame.astype(int), px, np.zeros(n, dtype=int), np.full(n, np.nan))


def true_axis(truth: dict) -> BarAxis:
    """The bar's axis by truth.toml, its point opposite the first contact."""
    angles = [np.radians([truth[name]]) for name in ("touch_deg", "beta_deg", "psi_deg")]
    reach_mm = BAR.radius_mm + 0.5 * WIRE.diameter_mm
    axis = axis_from_angles([truth["d_x_mm"]], *angles, [reach_mm])
    return BarAxis(axis.point_mm[0], axis.direction[0])


def tracked_bar(example: Example, places_mm, *, on_edges=False) -> dict[str, Trace]:
    """By camera, points of the bar in all frames at places along it, on its middle or on both edges."""
    axis = true_axis(example.truth)
    frames = len(example.motor_rad)
    rng = np.random.default_rng(2)
    return tracked_points(axis, example.cameras, frames, places_mm, rng, on_edges=on_edges)


def tracked_points(axis: BarAxis, cameras: Cameras, frames: int, places_mm, rng, *, on_edges=False):
    """By camera, points of a bar in so many frames, each SCATTER_PX off."""
    middle_mm = axis.point_mm + np.array(places_mm)[:, None] * axis.direction
    found = {}
    for camera in cameras:
        sides = [camera.project(middle_mm)]
        if on_edges:
            directions = np.broadcast_to(axis.direction, middle_mm.shape)
            sides = edges(camera, middle_mm, directions, BAR.radius_mm)
        px = np.tile(np.concatenate(sides), (frames, 1))
        line = np.repeat(np.arange(len(sides)), len(places_mm))
        found[camera.name] = Trace(
            np.repeat(np.arange(frames), len(line)),
            px + SCATTER_PX * rng.normal(size=px.shape),
            np.tile(line, frames),
            np.full(len(px), np.nan),
        )
    return found


def csv_of_points(points: Trace) -> str:
    """The text of object_<camera>.csv."""
    rows = [f"{k},{u:.2f},{v:.2f}" for k, (u, v) in zip(points.frame.tolist(), points.px)]
    return "\n".join(["frame,u_px,v_px", *rows]) + "\n"
