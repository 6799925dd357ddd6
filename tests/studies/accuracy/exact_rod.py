"""What the exact rod gains over (10), by exact mechanics, exact moments and the true friction angle.

    python tests/studies/accuracy/exact_rod.py

RMS and largest error over slopes from -70 to 70 degrees, % of d_x, of (10), (10) corrected and the exact rod; milliseconds
of the last one; by how much its distance moves with twice the steps of its march (docs/equations.md).
"""

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from estimator import exact_rod as module
from estimator.builtin import corrected, exact_rod, with_friction
from estimator.whisk import EstimatorSettings, Whisk
from tests.scenes.curved_pushes import NITINOL, VIBRISSA, CurvedPush, feel, whisker_of

BETAS_DEG = np.arange(-70.0, 71.0, 20.0)
WHISKERS = {"vibrissa": (VIBRISSA, (20.0, 30.0), 1.0), "nitinol": (NITINOL, (60.0,), 3.0)}


def pushes() -> Iterator[tuple[str, list[CurvedPush]]]:
    for name, (rod, distances_mm, radius_mm) in WHISKERS.items():
        for d_x_mm in distances_mm:
            for theta in (3.0, 8.0, 15.0):
                for mu in (0.0, 0.3):
                    yield (
                        f"{name:8s} {d_x_mm:g} mm {theta:4g} deg, mu {mu:g}",
                        [
                            CurvedPush(rod, d_x_mm, float(b), mu, theta, radius_mm)
                            for b in BETAS_DEG
                        ],
                    )


def asked(push: CurvedPush) -> tuple[Whisk, EstimatorSettings, float]:
    """What an estimator gets of a push, and the true d_x."""
    felt = feel(push)
    noise = (1e-4 * np.linalg.norm(felt.moments_Nmm)) ** 2 * np.eye(2)
    beam = whisker_of(push.rod).beam
    whisk = Whisk.without_samples(np.radians(push.theta_deg), felt.moments_Nmm, noise, beam)
    settings = EstimatorSettings(
        np.arctan(push.friction),
        object_radius_mm=push.bar_radius_mm,
        whisker_radius_mm=0.5 * push.rod.diameter_mm,
    )
    return whisk, settings, felt.d_x_mm


def lines() -> Iterator[str]:
    milliseconds = []
    moved = []
    for label, slopes in pushes():
        errors = []
        for push in slopes:
            try:
                whisk, settings, d_x_mm = asked(push)
            except ArithmeticError:  # it slips off the bar
                continue
            found = [one(whisk, settings).d_x_mm for one in (with_friction, corrected)]
            begin = time.process_time()
            found.append(exact_rod(whisk, settings).d_x_mm)
            milliseconds.append(1e3 * (time.process_time() - begin))
            moved.append(_with_twice_the_steps(whisk, settings) / found[-1] - 1)
            errors.append(100 * (np.array(found) / d_x_mm - 1))
        rms = np.sqrt(np.mean(np.square(errors), axis=0))
        most = np.abs(errors).max(axis=0)
        texts = ", ".join(f"{one:.2f} ({largest:.2f})" for one, largest in zip(rms, most))
        yield f"{label}: {texts} % of {len(errors)}"
    yield f"{np.median(milliseconds):.0f} ms a whisk of processor, {np.max(milliseconds):.0f} at most"
    yield f"twice the steps move d_x by {np.nanmax(np.abs(moved)):.1e} of it at most"


def _with_twice_the_steps(whisk: Whisk, settings: EstimatorSettings) -> float:
    steps = module._STEPS
    module._STEPS = 2 * steps
    module.contact_by_exact_rod.cache_clear()
    found = exact_rod(whisk, settings).d_x_mm
    module._STEPS = steps
    module.contact_by_exact_rod.cache_clear()
    return found


if __name__ == "__main__":
    print(*lines(), sep="\n")
