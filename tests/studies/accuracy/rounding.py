"""What rounding makes of a truth: trials seen again through cameras whose numbers differ by 1e-12 of themselves.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/rounding.py COUNT [SCENES]

Pictures stay as they are. Versions of libraries, and where things lie in memory, change the cameras' last digits: were
there a choice in seeing that these tip over, the same recording would have two truths. A line a trial of
fixtures/small-session (through its true cameras), of fixtures/scenes and of each folder of SCENES: by how much of its
sigma touch, d_x, slope or slip at 3° changes most in COUNT repeats, and which sigma by what share. The exit code is 1
where that is MOST_SIGMAS or more.
"""

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.scenes.recorded import exact_cameras
from tests.studies.accuracy.thresholds import SCENES, SESSION, look_at, seen_values
from vision.calibration.cameras_file import read_cameras
from vision.geometry.camera import Camera, Cameras

ROUNDED = 1e-12
# A hundredth of what versions may differ by. Cameras so rounded move a line by some 1e-9 px, 1e-7 of its sigma.
MOST_SIGMAS = 1e-3


def rounded(cameras: Cameras, rng: np.random.Generator, share: float = ROUNDED) -> Cameras:
    """The cameras with all their numbers changed by such a share of each, one sigma."""

    def changed(values: np.ndarray) -> np.ndarray:
        return values * (1.0 + share * rng.standard_normal(values.shape))

    def one(camera: Camera) -> Camera:
        numbers = {
            name: changed(getattr(camera, name))
            for name in ("matrix", "distortion", "T_camera_rig")
        }
        return replace(camera, **numbers)

    return replace(cameras, cameras=tuple(map(one, cameras)))


def largest_move(look: partial, count: int, rng: np.random.Generator) -> tuple[float, float]:
    """The largest move in sigmas, and the largest change of a sigma as a share of it, over so many repeats; infinite
    where a truth comes or goes."""
    pictures, whisks, cameras, rods = look.args
    usual, moves, wider = seen_values(look), [0.0], [0.0]
    for _ in range(count):
        again = seen_values(partial(look.func, pictures, whisks, rounded(cameras, rng), rods))
        if again.keys() != usual.keys():
            return np.inf, np.inf
        moves += [abs(again[name][0] - value) / sigma for name, (value, sigma) in usual.items()]
        wider += [abs(again[name][1] / sigma - 1.0) for name, (_, sigma) in usual.items()]
    return max(moves), max(wider)


def trials(scenes: list[Path]) -> dict[str, tuple]:
    """By name, folder, trial and cameras of what is seen."""
    small, exact = (
        sorted(path.name for path in (SESSION / "trials").iterdir()),
        exact_cameras(SESSION),
    )
    alone = {folder.name: (folder, "w", read_cameras(folder / "cameras.toml")) for folder in scenes}
    return {name: (SESSION, name, exact) for name in small} | alone


def main() -> int:
    count, others = (
        int(sys.argv[1]),
        [folder for name in sys.argv[2:] for folder in Path(name).glob("*/trials/w")],
    )
    worst, scenes = 0.0, [*SCENES.iterdir(), *(folder.parents[1] for folder in others)]
    for name, what in trials(sorted(scenes)).items():
        move, wider = largest_move(look_at(*what), count, np.random.default_rng(7))
        print(f"{name:>12}: {move:.1e} sigma, a sigma by {wider:.1e}", flush=True)
        worst = max(worst, move)
    return int(worst >= MOST_SIGMAS)


if __name__ == "__main__":
    sys.exit(main())
