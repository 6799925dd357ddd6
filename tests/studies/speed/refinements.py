"""What each refinement of the ledger costs: at most so much of a whisk's processor time could be saved without it.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/speed/refinements.py [SESSION] [--trials PATTERN]

Evaluates trials (fixtures/small-session by default) at `standard` under a profiler, without figures, and adds up the
time of the functions that carry each refinement, with all that they call; of parameters of the fit, their share of its
derivatives' columns. Of large bending it is what centrelines take longer than those of a beam of small angles, timed
beside each other; of the others what a plainer model would do in their place is not taken off, so that the numbers are
bounds from above. The time of a whisk is all of seeing and feeling, apart from calibration and tables.
"""

import cProfile
import os
import pstats
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

os.environ |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402

from bench.analyses.left_out import NAMES  # noqa: E402
from bench.base.settings import Settings  # noqa: E402
from bench.workflows.session_evaluation import evaluate  # noqa: E402
from vision.fit.blocks import BAR_PRIOR, REST_PRIOR_MM  # noqa: E402
from vision.geometry.centreline import REST_POWERS, centrelines, rotation_z, simpson, tangent_growth  # noqa: E402
from vision.geometry.rods import Wire  # noqa: E402

WHISK = ("vision/truth/observe.py:_see_whisk", "bench/trials/felt_trial.py:feel_trial")
FIT = "vision/fit/solve.py:linearise"
LENS = ("vision/geometry/lens.py:distort", "vision/geometry/lens.py:distort_jacobian")
# Functions by refinement; and how many of the columns by which the fit is differentiated are its own.
CARRIED_BY: Mapping[str, tuple[str, ...]] = {
    "large bending": ("vision/geometry/centreline.py:centrelines",),
    "bar radius": ("vision/geometry/rods.py:reach_mm",),
    "taper": ("vision/geometry/centreline.py:tangent_growth",),
    "lens k1 k2": LENS,
    "lens k3": LENS,
    "lens p1 p2": LENS,
    "gauges' delay": ("bench/gauges/felt.py:gauge_delay",),
    "cross-talk": ("bench/trials/unit.py:_one_factor",),
    "drift": ("bench/trials/unit.py:_with_drift",),
    "one-sided light": ("vision/wire/one_sided.py:seen_width",),
    "clock": ("bench/trials/clocks.py:shared_touch",),
    "second friction coefficient": ("bench/trials/gate.py:kinetic_of",),
}
COLUMNS_OF = {"psi": 1, "sag and set": 4}
COLUMNS = (
    len(BAR_PRIOR) + 2 * len(REST_PRIOR_MM) + 2
)  # all frames' bends are moved at once, each of their two parts
LEDGER = ("vision/fit/refinements.py:left_out", "bench/analyses/ledger.py:ledger")


def profiled(session: Path, trials: str) -> dict[str, float]:
    """Seconds within each function of ours, all that it calls included, by its file and name."""
    profile = cProfile.Profile(time.process_time)  # other programs do not count
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(figures=False, trials=trials)
        profile.runcall(
            evaluate, session, Path(folder) / "out", settings, workers=1, announce=lambda _: None
        )
    seconds: dict[str, float] = {}
    for (file, _, function), (_, _, _, whole, _) in pstats.Stats(profile).stats.items():
        if file.startswith(str(ROOT)):
            name = f"{Path(file).relative_to(ROOT).as_posix()}:{function}"
            seconds[name] = seconds.get(name, 0.0) + whole
    return seconds


def shares(seconds: Mapping[str, float]) -> dict[str, float]:
    """Percent of the whisks' time by refinement; nothing of those that are in no fit and no estimate."""
    whole = _sum(seconds, WHISK)
    found = {name: 100 * _sum(seconds, CARRIED_BY.get(name, ())) / whole for name in NAMES}
    found["large bending"] *= saved_by_small_angles()
    by_column = 100 * seconds[FIT] / whole / (1 + COLUMNS)
    return found | {name: count * by_column for name, count in COLUMNS_OF.items()}


def saved_by_small_angles() -> float:
    """Share of their time that centrelines of a whisk's derivatives (its frames, moved once a column) would save."""
    shape, wire = (1 + COLUMNS, 13), Wire("cylinder", 100.0, 1.0)
    rng = np.random.default_rng(0)
    given = (
        rng.standard_normal((*shape, 2, REST_POWERS)),
        0.1 * rng.standard_normal((*shape, 2)),
        np.full(shape, 60.0),
        np.full(shape, 0.1),
    )
    exact, plain = (
        min(_timed(make, *given, wire) for _ in range(200))
        for make in (centrelines, _of_small_angles)
    )
    return max(1.0 - plain / exact, 0.0)


def _timed(call: Callable, *given) -> float:
    begin = time.process_time()
    call(*given)
    return time.process_time() - begin


def _of_small_angles(rest_mm, bend_rad, contact_mm, motor_rad, wire: Wire) -> np.ndarray:
    """`centrelines` with slopes for sines, and distance for arc."""
    arc = np.linspace(0.0, wire.length_mm, len(simpson()))
    powers = np.stack(
        [k * (arc / wire.length_mm) ** max(k - 1, 0) for k in range(REST_POWERS)], axis=-1
    )
    aside = powers @ np.swapaxes(rest_mm, -1, -2) / wire.length_mm
    aside = (
        aside + tangent_growth(arc, contact_mm[..., None], wire)[..., None] * bend_rad[..., None, :]
    )
    tangents = np.ones((*aside.shape[:-1], 3))
    tangents[..., 1:] = aside
    points = simpson() @ tangents * arc[1]
    points[..., 1:] += rest_mm[..., None, :, 0]
    turned = np.swapaxes(rotation_z(motor_rad), -1, -2)
    return np.stack([points @ turned, tangents @ turned])


def _sum(seconds: Mapping[str, float], names: tuple[str, ...]) -> float:
    return sum(seconds.get(name, 0.0) for name in names)


def main() -> None:
    given = sys.argv[1:]
    trials = given.pop(given.index("--trials") + 1) if "--trials" in given else "*"
    paths = [Path(text) for text in given if not text.startswith("--")]
    seconds = profiled(paths[0] if paths else ROOT / "fixtures" / "small-session", trials)
    for name, percent in shares(seconds).items():
        print(f"{name:<28}{percent:6.2f} % at most")
    print(f"{'the ledger itself':<28}{100 * _sum(seconds, LEDGER) / _sum(seconds, WHISK):6.2f} %")


if __name__ == "__main__":
    main()
