"""Friction-free sensing: how honest distance and friction angle of two whisks at two tilts are, by exact mechanics.

    python tests/studies/accuracy/two_tilts.py [--count 600] [--seed 0] [--shape cylinder cone tapered]

Drawn anew are the surface (α 3 to 25°, thickness to 6 mm, of which half are told, lean N(0, 5°)), d_x 30 to 85 mm, θ 2
to 4°, the noise (a tenth to three times that of the small session), and the slopes that the two tilts make of it: one
within ± 20°, the other 25 to 70°, of either sign. Printed: how often the 95 % intervals of d_x and α hold, the median
sigmas, and beside them the error of (10) with α_est = 10° on the second whisk.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.settings import OBJECT_REACH_MM, TILT_SIGMA_RAD
from estimator.builtin import with_friction
from estimator.two_tilts import SharedContact, shared_contact
from estimator.uncertainty import Z_95
from estimator.whisk import EstimatorSettings, Whisk
from tests.studies.accuracy.estimates_montecarlo import (
    DIAMETER_MM,
    MOMENT_SIGMA_NMM,
    TOUCH_SIGMA_RAD,
    push,
    rod_and_beam,
)

UNTOLD = EstimatorSettings(np.radians(10.0), 0.0, OBJECT_REACH_MM, TILT_SIGMA_RAD)


def draw(
    shape: str, rng: np.random.Generator
) -> tuple[float, float, list[Whisk], EstimatorSettings] | None:
    """(d_x, α, both whisks, what is told of the object); None where one of them finds no hold."""
    rod, beam = rod_and_beam(shape)
    alpha, psi, d_x = (
        np.radians(rng.uniform(3.0, 25.0)),
        TILT_SIGMA_RAD * rng.normal(),
        rng.uniform(30.0, 85.0),
    )
    radius, theta = (
        rng.uniform(0.05, OBJECT_REACH_MM - DIAMETER_MM / 2),
        np.radians(rng.uniform(2.0, 4.0)),
    )
    told = (
        replace(UNTOLD, object_radius_mm=radius, whisker_radius_mm=DIAMETER_MM / 2)
        if rng.random() < 0.5
        else UNTOLD
    )
    noise = 10.0 ** rng.uniform(-1.0, 0.5)
    slopes = np.radians(
        [rng.uniform(-20.0, 20.0), rng.choice([-1.0, 1.0]) * rng.uniform(25.0, 70.0)]
    )
    sigma_m, sigma_touch, whisks = MOMENT_SIGMA_NMM * noise, TOUCH_SIGMA_RAD * noise, []
    for beta in slopes:
        try:
            touch, moments = push(
                rod, beta, psi, d_x, radius, alpha, theta + sigma_touch * rng.normal()
            )
        except ArithmeticError:
            return None
        felt = np.array(moments) + sigma_m * rng.normal(size=2)
        whisks.append(
            Whisk(*(np.zeros(0),) * 4, theta, *felt, sigma_m**2 * np.eye(2), sigma_touch, beam)
        )
    return touch.d_x_mm, float(alpha), whisks, told


def sample(shape: str, count: int, seed: int) -> list[tuple[float, float, SharedContact, float]]:
    """(d_x, α, what both whisks say together, what (10) says of the second) so many times."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        if (drawn := draw(shape, rng)) is not None:
            d_x, alpha, whisks, told = drawn
            found.append(
                (d_x, alpha, shared_contact(whisks, told), with_friction(whisks[1], told).d_x_mm)
            )
    return found


def line(shape: str, found: list[tuple]) -> str:
    """What is printed of a shape."""
    d_x, alpha = np.array([row[:2] for row in found]).T
    told, ten = [row[2] for row in found], np.array([row[3] for row in found])
    known = np.array([np.isfinite(one.d_x_mm) for one in told])
    holds = np.array([one.low_mm <= true <= one.high_mm for one, true in zip(told, d_x)])[known]
    sigmas = np.sqrt([np.diag(one.covariance) for one in told])
    apart = np.abs(np.array([one.alpha_rad for one in told]) - alpha)
    inside = (apart <= Z_95 * sigmas[:, 1])[known]
    error = np.array([one.d_x_mm for one in told]) / d_x - 1
    return (
        f"{shape}: {len(found)} pairs, {np.count_nonzero(~known)} without a distance; 95 % intervals hold in "
        f"{100 * holds.mean():.1f} % (d_x), {100 * inside.mean():.1f} % (α); median sigma "
        f"{100 * np.nanmedian(sigmas[:, 0] / d_x):.2f} % of d_x, {np.degrees(np.nanmedian(sigmas[:, 1])):.2f}°; error "
        f"{100 * np.sqrt(np.nanmean(error**2)):.2f} % RMS, median {100 * np.nanmedian(np.abs(error)):.2f} % "
        f"((10) of the second whisk, α_est = 10°: {100 * np.sqrt(np.nanmean((ten / d_x - 1) ** 2)):.1f} %)"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=600)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shape", nargs="+", default=["cylinder", "cone", "tapered"])
    options = parser.parse_args()
    for shape in options.shape:
        print(line(shape, sample(shape, options.count, options.seed)), flush=True)


if __name__ == "__main__":
    main()
