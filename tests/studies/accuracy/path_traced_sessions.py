"""Path trace a simulated session, boards and trials, so that its truth is tried in light that the rig does not paint.

    python tests/studies/accuracy/path_traced_sessions.py geometry FOLDER PROTOCOL [--seed N]
    python tests/studies/accuracy/path_traced_sessions.py render FOLDER PROTOCOL RENDERER [--look room] …
    python tests/studies/accuracy/species.py FOLDER PROTOCOL

The first simulates a session of a protocol into FOLDER/PROTOCOL and writes FOLDER/PROTOCOL.pkl: cameras, poses of the
board, whisker and bar in each frame. The second replaces the session's pictures by path-traced ones, and goes on where it
was interrupted; it runs in an environment that has Mitsuba 3, and RENDERER is the folder of `render.py`, the path tracer
of the scenes. The third evaluates the session and prints how far its truth is off. Some ten minutes of one core a session.
"""

import argparse
import pickle
import sys
import tomllib
from functools import partial
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

# Points of a whisker's axis.
STATIONS = 500
# Sides of a whisker's mesh: its outline is 0.1 % of the radius off at most.
SIDES = 64
# [mm] Of a mesh: a tip of no thickness has no surface.
LEAST_RADIUS_MM = 0.01
# [mm] Half the length of a bar.
HALF_BAR_MM = 80.0
# [mm] Height of the bench.
TABLE_MM = -95.0
# [mm] Radius of the lens, focused on a point of the rig.
APERTURE_MM = 1.0
FOCUS_MM = np.array([55.0, 5.0, 0.0])
# Samples a pixel, of the board's views, of a trial's frames, and more near the whisker.
BOARD_SAMPLES = 8
FRAME_SAMPLES = 4
WHISKER_SAMPLES = 16
NEAR_WHISKER_PX = 14
# [1] Share of the pixels that are darker than the white of the exposure, and that white over theirs.
WHITE_PERCENT = 99.0
HEADROOM = 1.05
SENSOR = {"psf_sigma": 0.8, "full_well": 9e3, "read_e": 7.0}
JPEG = [cv2.IMWRITE_JPEG_QUALITY, 95]
# Name, place, target, size and radiance of the lamp of each look, and the light from all around.
LOOKS = {
    "lamp": (("key", (-2.0, -325.0, 180.0), (50, 0, 0), (60, 60), 60.0), 0.06),
    "overhead": (("key", (20.0, 60.0, 520.0), (50, 0, -50), (50, 50), 110.0), 0.12),
    "window": (("window", (60.0, 700.0, 250.0), (50, 0, 0), (700, 500), 4.0), 0.15),
    "room": (("key", (-140.0, -220.0, 420.0), (50, 0, -20), (220, 160), 5.5), 0.45),
}


def save_geometry(folder: Path, protocol: str, seed: int) -> None:
    """Simulate a session, and save what its pictures show: cameras, board views, rig_board, trials.

    Ends the program for what is not drawn here: arrays, mirrors, and objects that are no bars that stand.
    """
    from bench.rig import build, parts
    from bench.rig.linear import compose
    from bench.rig.protocol import load
    from bench.rig.simulation import simulate

    job = parts.Job(folder / protocol, load(protocol), seed, False)
    if job.whiskers or any(table.mirror for table in job.protocol.cameras):
        sys.exit(f"{protocol}: arrays and mirrors are not path traced here")
    board = build.board(job.protocol)
    cameras = build.cameras(job.protocol)
    views = {}
    for number, camera in enumerate(cameras):
        poses = parts.board_poses(job, number)
        views[camera.name] = [compose(pose, board.T_print_board) for pose in poses]
    trials = {}
    for number, run in enumerate(job.protocol.runs()):
        recording = parts.recording_of(job, number)
        bar = recording.bar
        stands = bar.velocity_mm_rad is None and np.isinf(bar.stiffness_N_mm)
        if not (bar.is_straight and stands):
            sys.exit(f"{protocol}, {run.name}: only rigid bars that stand are path traced here")
        trials[run.name] = trial_geometry(recording)
    simulate(folder / protocol, protocol=protocol, seed=seed)
    geometry = {
        "cameras": [vars(camera) for camera in cameras],
        "board_views": views,
        "rig_board": build.T_rig_board(job.protocol),
        "trials": trials,
    }
    (folder / f"{protocol}.pkl").write_bytes(pickle.dumps(geometry))


def trial_geometry(recording) -> dict:
    """Return motor_rad (n,), axes_mm (n, m, 3) and radius_mm (m,) of the whisker, and the bar of a trial."""
    rod = recording.rod
    arc_mm = np.linspace(0.0, rod.length_mm, STATIONS)
    axes_mm = []
    for _, motor_rad, number, back in recording.frames:
        whisk = recording.whisks[number]
        state = whisk.path(back).state_between(motor_rad)
        axes_mm.append(whisk.centreline_mm(motor_rad, state, arc_mm))
    bar = recording.bar
    return {
        "motor_rad": recording.frames.motor_rad,
        "axes_mm": np.array(axes_mm),
        "radius_mm": np.maximum(rod.radius_mm(arc_mm), LEAST_RADIUS_MM),
        "bar": (bar.foot_mm(recording.touch.point_mm), np.array(bar.axis), bar.radius_mm),
    }


class Renderer:
    """Path traces a session's pictures. tracer: the module `render`."""

    def __init__(self, tracer, session: Path, look: str, wire: str, bar: str):
        self.tracer = tracer
        self.session = session
        self.look = look
        self.wire = wire
        self.bar = bar
        self.board = tomllib.loads((session / "session.toml").read_text())["board"]
        self.geometry = pickle.loads(session.with_suffix(".pkl").read_bytes())
        self.cameras = [self._camera(camera) for camera in self.geometry["cameras"]]
        first = next(iter(self.geometry["trials"].values()))
        self.white = {}
        for camera in self.cameras:
            radiance = self.trial(first, 0).radiance(camera, FRAME_SAMPLES, 0, seed=1)
            self.white[camera.name] = HEADROOM * np.percentile(radiance, WHITE_PERCENT)

    def _camera(self, camera: dict):
        """Return the tracer's camera."""
        matrix = camera["matrix"]
        return self.tracer.Camera(
            *(matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *camera["size_px"]),
            camera["rotation"],
            camera["translation_mm"],
            list(camera["distortion"]),
            camera["name"],
        )

    def bench(self, T_rig_board: np.ndarray):
        """Return a bench with its light and the board at a pose (3, 4)."""
        bench = self.tracer.Bench()
        bench.table(TABLE_MM, 0.2, "matte")
        bench.charuco(
            np.vstack([T_rig_board, [0.0, 0.0, 0.0, 1.0]]),
            tuple(self.board["squares"]),
            self.board["square_mm"],
            self.board["marker_mm"],
            self.board["dictionary"],
            border=0.5 * self.board["square_mm"],
        )
        lamp, around = LOOKS[self.look]
        if self.look == "room":
            bench.light_room(around)
        else:
            bench.light_env(around)
        bench.light_area(*lamp)
        return bench

    def trial(self, trial: dict, frame: int):
        """Return the bench with whisker, hub and bar in a frame of a trial."""
        bench = self.bench(self.geometry["rig_board"])
        axis_mm = trial["axes_mm"][frame]
        mesh = tapered_tube(self.tracer, axis_mm, trial["radius_mm"])
        material = {"type": "twosided", "b": self.tracer.material(self.wire)}
        bench.items["whisker"] = self.tracer.make_mesh("whisker", *mesh, material)
        bench.whisker_P = axis_mm
        bench.hub(np.degrees(trial["motor_rad"][frame]))
        middle_mm, axis, radius_mm = trial["bar"]
        half = HALF_BAR_MM * axis
        bench.rod("bar", middle_mm - half, middle_mm + half, radius_mm, self.bar)
        bench.bar_clamps(middle_mm, axis)
        return bench

    def shoot(self, bench, camera, path: Path, seed: int, samples: int = FRAME_SAMPLES) -> None:
        """Write a picture in place of the painted one."""
        focus_mm = float((camera.R @ FOCUS_MM + camera.t)[2])
        radiance = bench.radiance(
            camera,
            samples,
            WHISKER_SAMPLES,
            roi_px=NEAR_WHISKER_PX,
            seed=seed,
            aperture=APERTURE_MM,
            focus=focus_mm,
        )
        exposed = self.tracer.expose(radiance, self.white[camera.name])
        grey = self.tracer.sensor(exposed, seed=seed + 7, **SENSOR)
        cv2.imwrite(str(path), grey, JPEG if path.suffix == ".jpg" else [])

    def shoot_all(self) -> None:
        """Replace all pictures; those that are named in FOLDER/PROTOCOL.done are there already."""
        log = self.session.with_suffix(".done")
        done = set(log.read_text().split("\n")) if log.exists() else set()
        with log.open("a") as file:
            for seed, (path, camera, make, samples) in enumerate(self._pictures()):
                name = path.relative_to(self.session).as_posix()
                if name in done:
                    continue
                self.shoot(make(), camera, path, 1000 + seed, samples)
                print(name, file=file, flush=True)
                print(name, flush=True)

    def _pictures(self):
        """Yield each picture's path, camera, a function that returns its bench, and samples a pixel."""
        boards = self.session / "boards"
        for camera in self.cameras:
            on_rig = self.geometry["rig_board"]
            path = boards / "rig" / f"{camera.name}.png"
            yield path, camera, partial(self.bench, on_rig), FRAME_SAMPLES
            files = sorted((boards / camera.name).iterdir())
            for path, pose in zip(files, self.geometry["board_views"][camera.name], strict=True):
                yield path, camera, partial(self.bench, pose), BOARD_SAMPLES
        for name, trial in self.geometry["trials"].items():
            for camera in self.cameras:
                files = sorted((self.session / "trials" / name / camera.name).iterdir())
                assert len(files) == len(trial["motor_rad"]), f"{name} is a film, or not whole"
                for frame, path in enumerate(files):
                    yield path, camera, partial(self.trial, trial, frame), FRAME_SAMPLES


def tapered_tube(tracer, axis_mm: np.ndarray, radius_mm: np.ndarray) -> tuple:
    """Return vertices, faces, normals and texture coordinates of a tube of a radius (n,) at each point (n, 3).

    It is the tracer's tube of radius 1, open at its ends, with each ring scaled and normals by the taper.
    """
    _, faces, normals, texture = tracer.tube_mesh(axis_mm, 1.0, SIDES)
    count = len(axis_mm) * (SIDES + 1)
    around = normals[:count].reshape(len(axis_mm), SIDES + 1, 3)
    arc_mm = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(axis_mm, axis=0), axis=1)))
    tangent = np.gradient(axis_mm, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    taper = np.gradient(radius_mm, arc_mm)
    vertices = axis_mm[:, None] + radius_mm[:, None, None] * around
    leaning = around - taper[:, None, None] * tangent[:, None]
    leaning /= np.linalg.norm(leaning, axis=2, keepdims=True)
    side_faces = faces[np.all(faces < count, axis=1)]
    return vertices.reshape(-1, 3), side_faces, leaning.reshape(-1, 3), texture[:count]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    steps = parser.add_subparsers(dest="step", required=True)
    geometry = steps.add_parser("geometry")
    render = steps.add_parser("render")
    for step in (geometry, render):
        step.add_argument("folder", type=Path)
        step.add_argument("protocol")
    geometry.add_argument("--seed", type=int, default=1)
    render.add_argument("renderer", type=Path)
    render.add_argument("--look", choices=LOOKS, default="room")
    render.add_argument("--wire", default="brushed")
    render.add_argument("--bar", default="steel")
    options = parser.parse_args()
    if options.step == "geometry":
        save_geometry(options.folder, options.protocol, options.seed)
        return
    sys.path.insert(0, str(options.renderer))
    import render as tracer

    session = options.folder / options.protocol
    Renderer(tracer, session, options.look, options.wire, options.bar).shoot_all()


if __name__ == "__main__":
    main()
