"""What is left to do after the last frame of a push, where a whisk is evaluated while it is recorded.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/speed/live.py SCENES

SCENES holds path-traced scenes of one whisk each, as of `path_traced.py`, or is a synthetic session of such trials.
The files of each are decoded one by one and fed to `vision.live.whisk.LiveWhisk`, which works between them. Prints for
each scene, in processor seconds: decoding and `standard`, both of all frames; what comes after the last frame (decoding
of that included), and the longest step before; then how late the result comes after the last frame where frames come at
their own times: `own` with nothing before, `standing` with three pictures of the standing whisker three seconds before
(drawn: the first picture with noise), `again` and `standing again` with bar and wire as the whisk before showed them (the
same push at leisure, its bar moved by BAR_MOVED_MM). Beside it errors of d_x and z, of frames at leisure, of `standing
again` and of `standard`. Then medians and worst, and how often 95 % intervals hold.
"""

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.cameras.cameras_toml import write_cameras
from tests.scenes.recorded import exact_cameras
from tests.studies.accuracy.bar_scenes import read_scene
from tests.studies.accuracy.coverage import QUANTITIES, row_of
from tests.studies.accuracy.path_traced import beside_truth, frames_of, see_scene
from tests.studies.accuracy.rows import HALF_WIDTH_95
from vision.live.whisk import LiveBench, LiveWhisk
from vision.pictures.pixel_noise import measure_noise
from vision.truth.records import WhiskTruth

STANDING_FRAMES = 3
STANDING_S = 3.0
# [1] Of a picture's noise, that is added to it for another one of the same scene: both are then as noisy within a fifth.
ADDED_NOISE = 0.7
NEAR_MM = 0.1
# [mm] Along the whisker: a bar that the lab has moved a little.
BAR_MOVED_MM = 1.0
MODES = ("live", "standing again", "standard")
LATE = ("after_s", "own_s", "again_s", "standing_s", "standing_again_s")
HEADER = (
    "scene   frames/s decode standard | after    own  again standing, again | step | d_x error, sigma, z of each: "
    f"{', '.join(MODES)} | status"
)


@dataclass
class Clock:
    """The time of a recording, to which the processor time of each call is added."""

    now_s: float = 0.0
    calls_s: list[float] = field(default_factory=list)

    def charge(self, call: Callable):
        """Call a function and add its processor time. Return its result."""
        begin = time.process_time()
        result = call()
        self.calls_s.append(time.process_time() - begin)
        self.now_s += self.calls_s[-1]
        return result


class Recording:
    """A scene's files in the order in which they were recorded, and what is known before."""

    def __init__(self, folder: Path):
        """Read all but the pictures of the push."""
        self.folder = folder
        views, self.cameras, rods, self.motor_rad, self.axis = read_scene(folder)
        background = {view.camera.name: view.background for view in views}
        stroke_rad = (float(self.motor_rad.min()), float(self.motor_rad.max()))
        self.bench = LiveBench(self.cameras, rods, background, stroke_rad)
        self.time_s = frames_of(folder)["time_s"]
        self.files = {}
        for camera in self.cameras:
            own = folder / "trials" / "w" / camera.name
            self.files[camera.name] = sorted(own.iterdir())

    def read(self, frame: int) -> dict[str, np.ndarray]:
        """Decode the pictures of a frame."""
        pictures = {}
        for name, files in self.files.items():
            pictures[name] = cv2.imread(str(files[frame]), cv2.IMREAD_GRAYSCALE)
        return pictures

    def standing(self, seed: int = 0) -> list[dict[str, np.ndarray]]:
        """Draw pictures of the whisker before it moves, by camera."""
        rng = np.random.default_rng(seed)
        first, second = self.read(0), self.read(1)
        drawn = []
        for _ in range(STANDING_FRAMES):
            pictures = {}
            for name, picture in first.items():
                sigma = measure_noise(picture, second[name]).sigma(picture.astype(float))
                noisy = picture + ADDED_NOISE * sigma * rng.standard_normal(picture.shape)
                pictures[name] = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
            drawn.append(pictures)
        return drawn

    def play(
        self, arrivals_s: np.ndarray, *, stands: bool = False, before: LiveWhisk | None = None
    ) -> "Played":
        """Feed the frames as they arrive (n,), s; work is done while none waits.

        stands: pictures of the standing whisker come before them. before: the whisk before.
        """
        live = LiveWhisk(self.bench)
        if before is not None and before.shown is not None:
            axis = before.shown.axis
            moved_mm = axis.point_mm + np.array([BAR_MOVED_MM, 0.0, 0.0])
            earlier = replace(before.shown, axis=replace(axis, point_mm=moved_mm))
            live = LiveWhisk(replace(self.bench, earlier=earlier))
        clock = Clock()
        resting = self.standing() if stands else []
        for number, pictures in enumerate(resting):
            for name, picture in pictures.items():
                live.add(name, number, -STANDING_S, float(self.motor_rad[0]), picture)
        clock.now_s = arrivals_s[0] - STANDING_S
        for frame, arrival_s in enumerate(arrivals_s.tolist()):
            while clock.now_s < arrival_s and clock.charge(live.work):
                pass
            clock.now_s = max(clock.now_s, arrival_s)
            clock.charge(lambda frame=frame: self.add(live, frame, frame + len(resting)))
        truth = clock.charge(live.finish)
        return Played(live, truth, clock, clock.now_s - arrivals_s[-1], len(resting))

    def add(self, live: LiveWhisk, frame: int, number: int) -> None:
        """Decode the pictures of a frame and feed them as the frame of this number."""
        motor_rad = float(self.motor_rad[frame])
        for name, picture in self.read(frame).items():
            live.add(name, number, self.time_s[frame], motor_rad, picture)


@dataclass(frozen=True)
class Played:
    """A played recording, its truth, the clock, how late the truth came, s, and the frames before the first."""

    live: LiveWhisk
    truth: WhiskTruth
    clock: Clock
    late_s: float
    before: int

    def row(self, recording: Recording) -> dict:
        """Return the truth beside that of the scene."""
        truth = self.truth
        if truth.frames is not None:
            frames = truth.frames
            index = np.maximum(frames.index - self.before, 0)
            truth = replace(truth, frames=replace(frames, index=index))
        return row_of(
            *beside_truth(
                recording.folder, recording.cameras, recording.motor_rad, recording.axis, truth
            )
        )


def scene_row(folder: Path) -> dict:
    """Return what is measured of one scene."""
    recording = Recording(folder)
    count = len(recording.time_s)
    own_s = recording.time_s - recording.time_s[0]
    decoding, standard_clock = Clock(), Clock()
    decoding.charge(lambda: [recording.read(frame) for frame in range(count)])
    standard = standard_clock.charge(lambda: see_scene(folder))
    live = recording.play(100.0 * np.arange(count))
    again = recording.play(own_s, stands=True, before=live.live)
    return {
        "scene": folder.name,
        "rate_Hz": (count - 1) / own_s[-1],
        "decode_s": decoding.now_s,
        "standard_s": standard_clock.now_s - decoding.now_s,
        "after_s": live.late_s,
        "step_s": max(live.clock.calls_s[:-1]),
        "own_s": recording.play(own_s).late_s,
        "again_s": recording.play(own_s, before=live.live).late_s,
        "standing_s": recording.play(own_s, stands=True).late_s,
        "standing_again_s": again.late_s,
        "live": live.row(recording),
        "standing again": again.row(recording),
        "standard": row_of(*standard),
    }


def error_and_sigma(row: dict, quantity: str) -> tuple[float, float]:
    """Return a quantity's error in a row and its sigma, NaN where there is none."""
    return row.get(f"{quantity}_error", np.nan), row.get(f"{quantity}_sigma", np.nan)


def line_of(row: dict) -> str:
    """Return a scene's line of the table."""
    errors = []
    for mode in MODES:
        error, sigma = error_and_sigma(row[mode], "d_x_mm")
        errors.append(f"{error:+.3f} ± {sigma:.3f} {error / sigma:+5.1f}")
    status = row["live"]["status"]
    return (
        f"{row['scene']:<8} {row['rate_Hz']:7.0f} {row['decode_s']:6.2f} {row['standard_s']:8.2f} | "
        f"{' '.join(f'{row[name]:6.2f}' for name in LATE)} | {row['step_s']:4.2f} | "
        f"{', '.join(errors)} | {', '.join(status.codes) if status else ''}"
    )


def summary(rows: Sequence[dict]) -> list[str]:
    """Return what all scenes show, in lines."""
    lines = []
    for name in ("decode_s", "standard_s", "step_s", *LATE):
        values = [row[name] for row in rows]
        lines.append(f"{name}: median {np.median(values):.2f}, worst {max(values):.2f}")
    for name in LATE:
        shares = [row[name] / row["standard_s"] for row in rows]
        lines.append(f"{name} / standard: median {np.median(shares):.2f}, worst {max(shares):.2f}")
    for which in MODES:
        errors = np.array([error_and_sigma(row[which], "d_x_mm")[0] for row in rows])
        known = errors[np.isfinite(errors)]
        near = np.mean(np.abs(known) <= NEAR_MM)
        lines.append(
            f"{which}: {len(known)} of {len(rows)} with d_x, {near:.0%} within {NEAR_MM} mm"
        )
        for name in QUANTITIES:
            z = np.array([np.divide(*error_and_sigma(row[which], name)) for row in rows])
            z = z[np.isfinite(z)]
            holds = np.mean(np.abs(z) < HALF_WIDTH_95)
            rms = np.sqrt(np.mean(z**2))
            lines.append(f"  {name}: intervals hold in {holds:.0%}, RMS of z {rms:.2f}")
    return lines


def link_as_scenes(session: Path, folder: Path) -> None:
    """Make each trial of a synthetic session a scene of its own in a folder, by links."""
    cameras = exact_cameras(session)
    for trial in (session / "trials").iterdir():
        scene = folder / trial.name
        (scene / "trials").mkdir(parents=True)
        (scene / "trials" / "w").symlink_to(trial.resolve())
        for name in ("boards", "session.toml"):
            (scene / name).symlink_to((session / name).resolve())
        write_cameras(scene / "cameras.toml", cameras)


def main() -> None:
    """Measure all scenes of a folder and print what they show."""
    cv2.setNumThreads(1)
    with TemporaryDirectory() as linked:
        folder = Path(sys.argv[1])
        if (folder / "truth.json").is_file():
            link_as_scenes(folder, Path(linked))
            folder = Path(linked)
        print(HEADER)
        rows = []
        for truth in sorted(folder.glob("*/trials/w/truth.toml")):
            rows.append(scene_row(truth.parents[2]))
            print(line_of(rows[-1]), flush=True)
    print(*summary(rows), sep="\n")


if __name__ == "__main__":
    main()
