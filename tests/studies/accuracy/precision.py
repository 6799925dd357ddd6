"""Are the predicted standard deviations those of repeated trials? One scene, seen and calibrated many times.

    python tests/studies/accuracy/precision.py FOLDER --count 1000 --scenes 3

Every trial draws all that may be wrong: corners of every board view (and calibrates the cameras from them), the
measured pose of the rig board, noise of each line point, offsets of whole lines, and the diameters that are given.
Prints, for each scene, sampled over predicted standard deviation (the root mean square predicted one), and the share of
95 % intervals that hold. A trial is a row of FOLDER/precision-<seed>.csv; one that is there is not made again.
"""

import argparse
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.studies.accuracy.coverage import Seen, see_lines
from tests.studies.accuracy.rows import HALF_WIDTH_95, all_rows
from tests.studies.accuracy.scenes import (
    Scene,
    as_problem,
    begin,
    calibrated,
    draw_scene,
    given,
    line_points,
)
from vision.fit.solve import solve

NAMES = ("d_x", "touch", "beta", "slip")
COLUMNS = ("trial", *(f"{name}_{what}" for name in NAMES for what in ("error", "sigma")))


@dataclass(frozen=True, eq=False)
class Sample:
    """Errors and stated sigmas of one quantity over trials, (count,)."""

    error: np.ndarray
    sigma: np.ndarray

    @property
    def ratio(self) -> float:
        """Sampled over predicted standard deviation, about the sample's own mean."""
        return float(np.std(self.error, ddof=1) / np.sqrt(np.mean(self.sigma**2)))

    @property
    def coverage(self) -> float:
        """Share of 95 % intervals that hold the truth."""
        return float(np.mean(np.abs(self.error) < HALF_WIDTH_95 * self.sigma))


def repeat(scene: Scene, count: int, table: Path) -> dict[str, Sample]:
    """Samples of `count` trials of a scene, kept in `table`; slip is that of its last frame."""
    exact = as_problem(scene, scene.cameras, scene.wire, scene.bar, line_points(scene))
    start, _ = solve(exact, begin(exact), scales=(1e9,) * 8)
    rows = all_rows(
        table, COLUMNS, range(count), lambda trial: _row(scene, trial, _trial(scene, start, trial))
    )
    return {
        name: Sample(
            *(np.array([row[f"{name}_{what}"] for row in rows]) for what in ("error", "sigma"))
        )
        for name in NAMES
    }


def _row(scene: Scene, trial: int, seen: Seen) -> dict:
    last = {
        name: [
            float(np.ravel(v)[-1])
            for v in (seen.value[name], getattr(scene.truth, name), seen.sigma[name])
        ]
        for name in NAMES
    }
    return {
        "trial": trial,
        **{f"{name}_error": value - true for name, (value, true, _) in last.items()},
        **{f"{name}_sigma": sigma for name, (_, _, sigma) in last.items()},
    }


def _trial(scene: Scene, start, number: int) -> Seen:
    rng = np.random.default_rng([scene.seed, 24, number])
    problem = as_problem(scene, calibrated(scene, rng), *given(scene, rng), line_points(scene, rng))
    return see_lines(problem, start, scales=(10.0, 4.0, 4.0))


def lines(samples: dict[str, Sample]) -> Iterable[str]:
    """A line a quantity."""
    for name, sample in samples.items():
        yield (
            f"  {name:6s} sampled / predicted {sample.ratio:.3f}; 95 % intervals hold in "
            f"{100 * sample.coverage:.1f} %"
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="seed of the first scene")
    parser.add_argument("--scenes", type=int, default=3)
    options = parser.parse_args()
    for seed in range(options.first, options.first + options.scenes):
        scene = draw_scene(seed)
        print(
            f"scene {seed}: slope {np.degrees(scene.truth.beta):.0f} deg, d_x {scene.truth.d_x:.0f} mm, "
            f"{len(scene.cameras)} cameras, planes {scene.plane_angle_deg:.0f} deg apart; {options.count} trials"
        )
        samples = repeat(scene, options.count, options.folder / f"precision-{seed}.csv")
        print(*lines(samples), sep="\n", flush=True)


if __name__ == "__main__":
    main()
