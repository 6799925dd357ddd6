"""What a session costs against picture size, frames, cameras, board views, whisks and workers, and the exponents that fit.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/speed/slopes.py [--preset standard]

The rig paints a scene; one thing at a time is doubled. Pictures grow by a larger sensor behind the same lens, as more
bench is in view, and by a longer lens, as the wire is thicker; whisks are the same one, again and again. Seconds of
processor, pictures in memory, after a first look that fills tables. The exponent is of a straight line through the
logarithms; what does not grow with the number flattens it. Of board views it is the adjustment of two cameras
(`cameras.py`), of whisks together what `whisks.py` prints step by step; of workers what all of them together take of
processor and memory (GB, the most that each had) for eight scenes, their imports apart.
"""

import argparse
import math
import os
import resource
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import msgspec
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.workers import Workers
from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import PicturesTable
from bench.trials.seeing import PRESETS, STANDARD
from tests.studies.accuracy.coverage import drawn
from tests.studies.accuracy.scenes import Sigmas, make_scene
from tests.studies.extremes.chain import cameras, protocol, thick, wide
from tests.studies.speed import cameras as adjustment
from tests.studies.speed import whisks as together
from vision.geometry.vision_settings import VisionSettings
from vision.truth.observe import observe_trial
from vision.truth.trial_pictures import TrialPictures

USUAL_WIRE_PX = 5.0


def filmed_by(count: float) -> Protocol:
    """So many cameras: pairs, the second pair turned aside."""
    both = [*cameras(), *cameras(20.0, azimuths=(-135.0, -45.0))]
    return protocol(
        cameras=[
            msgspec.structs.replace(c, name="abcd"[k]) for k, c in enumerate(both[: int(count)])
        ]
    )


def in_frames(count: float) -> Protocol:
    """So many frames of the same stroke."""
    return protocol(pictures=PicturesTable(step_deg=6.2 / (count - 1.0)))


SCENES: Mapping[str, tuple[Callable[[float], Protocol], Sequence[float]]] = {
    "megapixels, more in view": (wide, (0.3, 0.6, 1.2, 2.4)),
    "megapixels, nearer by": (
        lambda size: thick(USUAL_WIRE_PX * math.sqrt(size / 0.576)),
        (0.3, 0.6, 1.2, 2.4),
    ),
    "frames": (in_frames, (8, 16, 32)),
    "cameras": (filmed_by, (2, 3, 4)),
}
WHISKS = 1, 2, 4
VIEWS = (20, 40, 80)
WORKERS = (1, 2, 4)
SCENES_FOR_WORKERS = 8


def repeated(pictures: TrialPictures, count: int) -> tuple[TrialPictures, list[slice]]:
    """The same stroke so often, one after the other, and where each is."""
    each = len(pictures.time_s)
    frames = {
        name: {
            k + again * each: picture for again in range(count) for k, picture in of_camera.items()
        }
        for name, of_camera in pictures.frames.items()
    }
    later = np.repeat(np.arange(count), each) * (pictures.time_s[-1] - pictures.time_s[0] + 1.0)
    whole = TrialPictures(
        frames,
        np.tile(pictures.time_s, count) + later,
        np.tile(pictures.motor_rad, count),
        pictures.background,
    )
    return whole, [slice(again * each, (again + 1) * each) for again in range(count)]


def seconds(made: Protocol, settings: VisionSettings, whisks: int = 1) -> float:
    """Of processor in which a scene is seen. Raises ValueError where it has no truth: that costs less."""
    pictures, calibrated, rods = drawn(make_scene(made, Sigmas(), 0), None)
    pictures, strokes = repeated(pictures, whisks)
    begin = time.process_time()
    seen = observe_trial(pictures, strokes, calibrated, rods, settings).whisks
    spent = time.process_time() - begin
    if any(np.isnan(whisk.d_x_mm.value) for whisk in seen):
        raise ValueError(seen[0].status)
    return spent


def table(settings: VisionSettings) -> Iterator[str]:
    """A line a number that grows."""
    seconds(protocol(), settings)
    for name, (made, sizes) in SCENES.items():
        yield together.line(name, sizes, [seconds(made(size), settings) for size in sizes])
    costs_s = [seconds(protocol(), settings, count) for count in WHISKS]
    yield together.line("whisks of a trial", WHISKS, costs_s)
    yield together.line("board views", VIEWS, [adjustment.seconds(2, count) for count in VIEWS])
    counts, spent_s = together.measured(together.results_of_fixture())
    yield together.line("whisks together", counts, np.sum(list(spent_s.values()), axis=0))
    spent = [with_workers(count, settings) for count in WORKERS]
    yield together.line("workers: processor", WORKERS, [spent_s for spent_s, _ in spent])
    yield together.line("workers: memory", WORKERS, [memory_GB for _, memory_GB in spent], "GB")


def with_workers(count: int, settings: VisionSettings) -> tuple[float, float]:
    """Seconds of processor in which so many processes see scenes, and GB of memory that they have at most, all together."""
    with Workers(count) as pool:
        seen = pool.run(_see, [settings] * SCENES_FOR_WORKERS, "scenes")
    # of each process after its last scene
    most = {number: memory_GB for number, _, memory_GB in seen}
    return sum(spent_s for _, spent_s, _ in seen), sum(most.values())


def _see(settings: VisionSettings) -> tuple[int, float, float]:
    """Number of this process, seconds of processor in which it sees a scene, and GB that it has had at most."""
    spent_s = seconds(protocol(), settings)
    return os.getpid(), spent_s, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0**2


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--preset", choices=PRESETS, default=STANDARD)
    for line in table(PRESETS[parser.parse_args().preset]):
        print(line, flush=True)


if __name__ == "__main__":
    main()
