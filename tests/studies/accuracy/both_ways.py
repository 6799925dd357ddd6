"""A push and its way back: how honest slope and distance without α_est are, by exact mechanics.

    python tests/studies/accuracy/both_ways.py [--count 300] [--seed 0] [--shape cylinder cone tapered]

Drawn anew are the surface (α 3 to 25°, thickness to 6 mm, lean N(0, 5°)), its slope 0 to 75°, d_x 30 to 85 mm, the
push (to 3 to 5°) and the angle looked at (0.4 to 0.8 of it), and the noise, a tenth to three times that of the small
session.
Printed: whisks that tell, how often the 95 % intervals of d_x, β and α hold, and beside the error of d_x those of (10)
with α_est = 10° there and back.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.settings import OBJECT_REACH_MM, TILT_SIGMA_RAD
from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.stick_slip import FrictionCoefficients
from bench.rig.whisk_mechanics import WhiskMechanics
from estimator.both_ways import there_and_back
from estimator.builtin import with_friction
from estimator.uncertainty import Z_95
from estimator.whisk import EstimatorSettings, Whisk
from tests.studies.accuracy.estimates_montecarlo import (
    MOMENT_SIGMA_NMM,
    TOUCH_SIGMA_RAD,
    rod_and_beam,
)

UNTOLD = EstimatorSettings(np.radians(10.0), 0.0, OBJECT_REACH_MM, TILT_SIGMA_RAD)
STEP_RAD = np.radians(0.2)


def drawn(shape: str, rng: np.random.Generator):
    """((d_x, β, α), both ways' whisks) drawn anew; None where the whisker finds no hold."""
    rod, beam = rod_and_beam(shape)
    alpha, beta, d_x = (
        np.radians(rng.uniform(3.0, 25.0)),
        np.radians(rng.uniform(0.0, 75.0)),
        rng.uniform(30.0, 85.0),
    )
    end, share, noise = (
        np.radians(rng.uniform(3.0, 5.0)),
        rng.uniform(0.4, 0.8),
        10.0 ** rng.uniform(-1.0, 0.5),
    )
    bar = TouchedBar.at_contact(
        d_x_mm=d_x,
        beta_rad=beta,
        psi_rad=TILT_SIGMA_RAD * rng.normal(),
        touch_rad=0.0,
        radius_mm=rng.uniform(0.05, 3.0),
        whisker_radius_mm=float(rod.radius_mm(d_x)),
    )
    touch, theta = find_first_touch(rod, bar, 0.0, d_x), share * end
    sigma_m, sigma_touch = MOMENT_SIGMA_NMM * noise, TOUCH_SIGMA_RAD * noise
    try:
        march = WhiskMechanics.run(
            rod,
            bar,
            FrictionCoefficients(*[np.tan(alpha)] * 2),
            touch,
            touch.motor_rad + end,
            step_rad=STEP_RAD,
            back=True,
        )
    except (ArithmeticError, np.linalg.LinAlgError):
        return None
    whisks = []
    for way in (march.forward, march.back):
        at = np.array([touch.motor_rad + theta + sigma_touch * rng.normal()])
        felt = way.moments_at(at)[0] + sigma_m * rng.normal(size=2)
        whisks.append(
            Whisk(*(np.zeros(0),) * 4, theta, *felt, sigma_m**2 * np.eye(2), sigma_touch, beam)
        )
    return (touch.d_x_mm, beta, alpha), whisks


def line(shape: str, count: int, seed: int) -> str:
    """What is printed of a shape."""
    rng, rows, told, tens = np.random.default_rng(seed), [], [], []
    while len(rows) < count:
        if (one := drawn(shape, rng)) is not None:
            rows.append(one[0])
            told.append(there_and_back(*one[1], UNTOLD))
            tens.append([with_friction(whisk, UNTOLD).d_x_mm for whisk in one[1]])
    d_x, beta, alpha = np.array(rows).T
    known = np.array([not one.status for one in told])
    slides = known & (beta > alpha)  # a held contact's friction is anything up to α
    low, high, found = (
        np.array([getattr(one, key) for one in told]) for key in ("low_mm", "high_mm", "d_x_mm")
    )
    holds = [100 * np.mean(((low <= d_x) & (d_x <= high))[known])]
    for true, name in ((beta, "beta"), (alpha, "alpha")):
        value, sigma = (
            np.array([getattr(one, f"{name}{key}_rad") for one in told]) for key in ("", "_sigma")
        )
        holds.append(
            100
            * np.mean((np.abs(value - true) <= Z_95 * sigma)[known if name == "beta" else slides])
        )
    rms = [
        100 * np.sqrt(np.nanmean((one / d_x - 1)[known] ** 2)) for one in (found, *np.array(tens).T)
    ]
    return (
        f"{shape}: {count} pushes, {np.count_nonzero(known)} tell; 95 % intervals hold in {holds[0]:.1f} % (d_x), "
        f"{holds[1]:.1f} % (β), {holds[2]:.1f} % (α of {np.count_nonzero(slides)} that slide); error of d_x "
        f"{rms[0]:.2f} % RMS, median {100 * np.median(np.abs(found / d_x - 1)[known]):.2f} % ((10) with α_est = 10°: "
        f"{rms[1]:.1f} % there, {rms[2]:.1f} % back)"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shape", nargs="+", default=["cylinder", "cone", "tapered"])
    options = parser.parse_args()
    for shape in options.shape:
        print(line(shape, options.count, options.seed), flush=True)


if __name__ == "__main__":
    main()
