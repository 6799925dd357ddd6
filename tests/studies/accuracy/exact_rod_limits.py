"""How far the exact rod is rightly from (10), and how far wrong roots are; and what is left of its own error.

    python tests/studies/accuracy/exact_rod_limits.py --count 240 --seed 1

Random pushes of whiskers of four kinds by exact mechanics, with exact moments and the true friction angle. First
|d_x of the exact rod over that of (10) - 1| of answers that are right (within 2 % of d_x) and of those that are not,
asked without a limit: `estimator.builtin._MOST_FROM_10` lies between. Then the error over its stated model sigma.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.rig.elastic_rod import RestShape, Rod
from estimator import builtin
from estimator.builtin import exact_rod, with_friction
from estimator.whisk import EstimatorSettings, Whisk
from tests.scenes.curved_pushes import NITINOL, PROFILED, VIBRISSA, CurvedPush, feel, whisker_of

RIGHT = 0.02  # of d_x
MOST_TURN = np.radians(40.0)  # of the unloaded whisker up to its tip
POLYMER = Rod("cone", 100.0, 1.5, 2.3)


def pushes(count: int, rng: np.random.Generator) -> Iterator[CurvedPush]:
    for _ in range(count):
        rod = (NITINOL, POLYMER, VIBRISSA, PROFILED)[rng.integers(4)]
        side = rng.uniform(0.0, 2 * np.pi)
        set_mm = 0.5 * rod.length_mm * np.sin(MOST_TURN) * rng.uniform()
        rest = RestShape(rod.length_mm, 0.0, set_mm * np.cos(side), set_mm * np.sin(side))
        yield CurvedPush(
            replace(rod, rest=rest),
            rng.uniform(0.25, 0.8) * rod.length_mm,
            rng.uniform(-70.0, 70.0),
            rng.uniform(0.0, 0.4),
            rng.uniform(1.0, 15.0),
            rng.uniform(0.005, 0.06) * rod.length_mm,
        )


def asked(push: CurvedPush) -> tuple[np.ndarray, float]:
    """Distances (2,) of (10) and of the exact rod over the true one, and the latter's relative model sigma."""
    felt = feel(push)
    noise = (1e-5 * np.linalg.norm(felt.moments_Nmm)) ** 2 * np.eye(2)
    beam = whisker_of(push.rod).beam
    whisk = Whisk.without_samples(np.radians(push.theta_deg), felt.moments_Nmm, noise, beam)
    settings = EstimatorSettings(
        np.arctan(push.friction),
        object_reach_mm=push.bar_radius_mm,
        object_radius_mm=push.bar_radius_mm,
        whisker_radius_mm=0.5 * push.rod.diameter_mm,
    )
    found = np.array([one(whisk, settings).d_x_mm for one in (with_friction, exact_rod)])
    model = builtin._share_of_rod(whisk, settings, found[1], beam.thickness(found[1]))
    return found / felt.d_x_mm, model


def lines(count: int, seed: int) -> Iterator[str]:
    builtin._MOST_FROM_10 = np.inf
    found = []
    models = []
    slipped = 0
    for push in pushes(count, np.random.default_rng(seed)):
        try:
            shares, model = asked(push)
        except ArithmeticError:  # it slips off the bar
            slipped += 1
            continue
        found.append(shares)
        models.append(model)
    ten, rod = np.array(found).T
    has_both = np.isfinite(ten) & np.isfinite(rod)
    has_rod = has_both & (rod != ten)  # where no rod is found and (10) is at the tip, both are
    yield f"{slipped} slip off; of {len(rod)}: (10) has none {np.sum(~np.isfinite(ten))}, the rod {np.sum(~has_rod)}"
    from_10 = np.abs(rod / ten - 1)
    is_right = np.abs(rod - 1) < RIGHT
    for label, chosen in (("right", has_rod & is_right), ("wrong", has_rod & ~is_right)):
        apart = from_10[chosen]
        text = "none"
        if len(apart):
            at = np.quantile(apart, [0.0, 0.01, 0.5, 0.9, 0.99, 1.0])
            text = ", ".join(f"{one:.3f}" for one in at)
        yield f"{label}: {len(apart)}; from (10), least, 1, 50, 90, 99 %, most: {text}"
    chosen = has_rod & is_right
    errors = (rod - 1)[chosen]
    yield f"error of right ones: bias {100 * errors.mean():+.3f} %, RMS {100 * np.sqrt(np.mean(errors**2)):.3f} %"
    z = errors / np.array(models)[chosen]
    within = np.mean(np.abs(z) < 1.96)
    yield f"over the model sigma: RMS {np.sqrt(np.mean(z**2)):.2f}, {100 * within:.1f} % within 1.96, most {np.abs(z).max():.1f}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=240)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    for line in lines(options.count, options.seed):
        print(line)
