"""Equation (10) at the extremes: exact moments with noise, what it answers, and whether its interval holds.

    python tests/extremes/felt.py --draws 300

One thing at a time departs from a usual push (60 mm, 30°, θ = 3°, a bar of 6 mm, α = 10.5°, a wire of 1 mm × 100 mm),
by the rig's exact mechanics, with noise of half a per cent in the moments and 0.01° in touch, α_est drawn about α with
the 5° that it is said to be known to. Prints, a line a value, the answers, the 95 % intervals that hold, the error and
what is said instead. docs/extremes.md is made from it.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from bench.rig.bar import Bar, first_touch
from bench.rig.contact import moments_Nmm
from bench.rig.friction import Friction, March
from bench.rig.rod import Rod
from bench.trials.estimates import OBJECT_REACH_MM, TILT_SIGMA_RAD
from estimator.beam import Beam
from estimator.builtin import with_friction
from estimator.uncertainty import Z_95
from estimator.whisk import Estimate, EstimatorSettings, Whisk

MOMENT_NOISE, TOUCH_SIGMA_RAD, ALPHA_SIGMA_RAD = 0.005, np.radians(0.01), np.radians(5.0)
_STEPS = 8  # of the march from touch


@dataclass(frozen=True)
class Push:
    """Angles in degrees, lengths in mm."""

    beta_deg: float = 30.0
    psi_deg: float = 0.0
    alpha_deg: float = 10.5
    d_x_mm: float = 60.0
    theta_deg: float = 3.0
    bar_radius_mm: float = 3.0
    shape: str = "cylinder"


USUAL = Push()
EXTREMES: Mapping[str, tuple[Push, Sequence[float]]] = {
    "beta_deg": (USUAL, (-85, 0, 60, 70, 75, 80, 85, 88)),
    "psi_deg": (USUAL, (-75, -60, -30, 30, 60, 75)),
    "alpha_deg": (USUAL, (0, 2.5, 5, 10.5, 23.3, 45, 63.4, 70)),
    "d_x_mm": (USUAL, (2, 5, 10, 20, 80, 95, 99)),
    "theta_deg": (USUAL, (0.2, 0.5, 1, 5, 10, 20)),
    "bar_radius_mm": (USUAL, (0.25, 10, 30)),
    "cone d_x_mm": (replace(USUAL, shape="cone"), (5, 30, 60, 80, 90, 95)),
}


def exact(push: Push) -> tuple[np.ndarray, Beam]:
    """Moments (2,) of the push, N·mm, and the whisker. Raises ArithmeticError where there is no such push."""
    rod = Rod(push.shape, length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
    theta, alpha, beta, psi = np.radians([push.theta_deg, push.alpha_deg, push.beta_deg, push.psi_deg])
    thickness = 0.5 * rod.diameter_mm * (1.0 - (push.d_x_mm / rod.length_mm if push.shape == "cone" else 0.0))
    bar = Bar.placed(d_x_mm=push.d_x_mm, beta_rad=beta, psi_rad=psi, touch_rad=0.0, radius_mm=push.bar_radius_mm,
                     whisker_radius_mm=thickness)  # fmt: skip
    touch = first_touch(rod, bar, 0.0, push.d_x_mm)
    march = March(rod, bar, Friction(np.tan(alpha), np.tan(alpha)), touch)
    *_, state = march.along(touch.motor_rad + theta * np.arange(1, _STEPS + 1) / _STEPS)[1]
    if state is None:
        raise ArithmeticError("the whisker slips off the bar")
    return np.array(moments_Nmm(state)), Beam(3.0 * rod.rigidity_Nmm2, rod.length_mm, push.shape)


def answers(push: Push, draws: int, rng: np.random.Generator) -> list[Estimate]:
    """What (10) says of the push with noise."""
    true, beam = exact(push)
    sigma = MOMENT_NOISE * np.linalg.norm(true)
    found = []
    for _ in range(draws):
        felt = true + sigma * rng.standard_normal(2)
        theta = np.radians(push.theta_deg) + TOUCH_SIGMA_RAD * rng.standard_normal()
        alpha = np.clip(np.radians(push.alpha_deg) + ALPHA_SIGMA_RAD * rng.standard_normal(), 0.0, np.radians(89.0))
        covariance = sigma**2 * np.eye(2)
        whisk = Whisk(*(np.zeros(0),) * 4, theta, *felt.tolist(), covariance, TOUCH_SIGMA_RAD, beam)
        told = EstimatorSettings(float(alpha), ALPHA_SIGMA_RAD, OBJECT_REACH_MM, TILT_SIGMA_RAD)
        found.append(with_friction(whisk, told))
    return found


def holds(estimate: Estimate, d_x_mm: float) -> bool:
    """Whether its 95 % interval has the truth in it."""
    ends = estimate.low_mm, estimate.high_mm
    if np.isnan(ends).all():
        ends = (estimate.d_x_mm - Z_95 * estimate.sigma_mm, estimate.d_x_mm + Z_95 * estimate.sigma_mm)
    return bool(ends[0] <= d_x_mm <= ends[1])


def line(extreme: str, value: float, push: Push, draws: int, rng: np.random.Generator) -> str:
    """What is answered at one value."""
    try:
        found = answers(push, draws, rng)
    except ArithmeticError as problem:
        return f"{extreme} {value:g}: the rig: {problem}"
    known = [one for one in found if np.isfinite(one.d_x_mm)]
    said = sorted({one.status.split(":")[0].split(" (")[0][:60] for one in found if one.status})
    text = f"{extreme} {value:g}: {len(known)} of {draws} answer"
    if known:
        errors = 100.0 * (np.array([one.d_x_mm for one in known]) / push.d_x_mm - 1.0)
        width = float(np.median([100.0 * one.sigma_mm / push.d_x_mm for one in known]))
        inside = 100.0 * np.mean([holds(one, push.d_x_mm) for one in known])
        text += f", {inside:.0f} % of intervals hold, {errors.mean():+.2f} % in the mean, {errors.std():.2f} % scatter,"
        text += f" {width:.2f} % stated"
    return text + (f" [{' | '.join(said[:3])}]" if said else "")


def study(draws: int) -> Iterator[str]:
    """All extremes."""
    for extreme, (usual, values) in EXTREMES.items():
        for k, value in enumerate(values):
            push = replace(usual, **{extreme.split()[-1]: float(value)})
            yield line(extreme, value, push, draws, np.random.default_rng([k, 40]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=300)
    options = parser.parse_args()
    for text in study(options.draws):
        print(text, flush=True)


if __name__ == "__main__":
    main()
