"""Equation (10) at the extremes: exact moments with noise, what it answers, and whether its interval holds.

    python tests/studies/extremes/felt.py --draws 300

One thing at a time departs from a usual push (60 mm, 30°, θ = 3°, a bar of 6 mm, α = 10.5°, a wire of 1 mm × 100 mm),
by the rig's exact mechanics, with noise of half a per cent in the moments and 0.01° in touch, α_est drawn about α with
the 5° that it is said to be known to; the stroke goes on to 5°. Prints, a line a value, the answers, the 95 % intervals
that hold, the error, and how often what is said. docs/extremes.md is made from it.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.analyses.turning_phi import sure_turns, turn, with_turn
from bench.records.trial_result import EstimateRow, FeltAt
from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.elastic_rod import Rod
from bench.rig.rod_contact import moments_Nmm
from bench.rig.stick_slip import FrictionCoefficients, March
from bench.trials.estimates import run_estimator
from estimator.beam import Beam
from estimator.builtin import with_friction
from estimator.distance import felt_slip_angle
from estimator.whisk import Whisk
from vision.truth.value import Value

MOMENT_NOISE, TOUCH_SIGMA_RAD, ALPHA_SIGMA_RAD = 0.005, np.radians(0.01), np.radians(5.0)
_STEPS = 8  # of the march from touch
STROKE_RAD = np.radians([1.0, 2.0, 3.0, 4.0, 5.0])  # at which moments tell whether φ turns


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


@dataclass(frozen=True)
class Exact:
    """Moments (2,) of a push at its angle and at those of STROKE_RAD that it reaches (n, 2), N·mm; and the whisker."""

    moments_Nmm: np.ndarray
    stroke_rad: np.ndarray
    stroke_Nmm: np.ndarray
    beam: Beam


def exact(push: Push) -> Exact:
    """Raises ArithmeticError where there is no such push."""
    rod = Rod(push.shape, length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
    theta, alpha, beta, psi = np.radians(
        [push.theta_deg, push.alpha_deg, push.beta_deg, push.psi_deg]
    )
    thickness = (
        0.5
        * rod.diameter_mm
        * (1.0 - (push.d_x_mm / rod.length_mm if push.shape == "cone" else 0.0))
    )
    bar = TouchedBar.at_contact(
        d_x_mm=push.d_x_mm,
        beta_rad=beta,
        psi_rad=psi,
        touch_rad=0.0,
        radius_mm=push.bar_radius_mm,
        whisker_radius_mm=thickness,
    )
    touch = find_first_touch(rod, bar, 0.0, push.d_x_mm)
    angles = np.unique(np.concatenate([theta * np.arange(1, _STEPS + 1) / _STEPS, STROKE_RAD]))
    states = March(rod, bar, FrictionCoefficients(np.tan(alpha), np.tan(alpha)), touch).along(
        touch.motor_rad + angles
    )[1]
    felt = {
        a: np.array(moments_Nmm(state)) for a, state in zip(angles, states) if state is not None
    }
    if theta not in felt:
        raise ArithmeticError("the whisker slips off the bar")
    stroke = np.array([a for a in STROKE_RAD if a in felt])
    beam = Beam(3.0 * rod.rigidity_Nmm2, rod.length_mm, push.shape)
    return Exact(felt[theta], stroke, np.array([felt[a] for a in stroke]).reshape(-1, 2), beam)


def answers(push: Push, draws: int, rng: np.random.Generator) -> list[EstimateRow]:
    """What (10) says of the push with noise, and of the stroke that it is part of."""
    true = exact(push)
    sigma = MOMENT_NOISE * np.linalg.norm(true.moments_Nmm)
    covariance, found = sigma**2 * np.eye(2), []
    for _ in range(draws):
        felt = true.moments_Nmm + sigma * rng.standard_normal(2)
        theta = np.radians(push.theta_deg) + TOUCH_SIGMA_RAD * rng.standard_normal()
        alpha = np.clip(
            np.radians(push.alpha_deg) + ALPHA_SIGMA_RAD * rng.standard_normal(),
            0.0,
            np.radians(89.0),
        )
        whisk = Whisk(
            *(np.zeros(0),) * 4, theta, *felt.tolist(), covariance, TOUCH_SIGMA_RAD, true.beam
        )
        row = run_estimator("with_friction", with_friction, whisk, float(alpha), ALPHA_SIGMA_RAD)
        stroke = true.stroke_Nmm + sigma * rng.standard_normal(true.stroke_Nmm.shape)
        rate = turn(
            [
                FeltAt(
                    a, *(Value(m, sigma) for m in pair), TOUCH_SIGMA_RAD, covariance, np.zeros(2)
                )
                for a, pair in zip(true.stroke_rad, stroke)
            ]
        )
        phi = felt_slip_angle(*felt)
        (is_sure,) = sure_turns([phi], [rate], float(alpha))
        length_mm = true.beam.length_mm
        found.append(with_turn(row, phi, rate, theta, length_mm, is_sure=is_sure))
    return found


def holds(row: EstimateRow, d_x_mm: float) -> bool:
    """Whether its 95 % interval has the truth in it."""
    return bool(row.d_x_est_low_mm <= d_x_mm <= row.d_x_est_high_mm)


def line(extreme: str, value: float, push: Push, draws: int, rng: np.random.Generator) -> str:
    """What is answered at one value."""
    try:
        found = answers(push, draws, rng)
    except ArithmeticError as problem:
        return f"{extreme} {value:g}: the rig: {problem}"
    known = [one for one in found if np.isfinite(one.d_x_est_mm.value)]
    text = f"{extreme} {value:g}: {len(known)} of {draws} answer"
    if known:
        d_x, sigma = np.array([(one.d_x_est_mm.value, one.d_x_est_mm.sigma) for one in known]).T
        errors, inside = (
            100.0 * (d_x / push.d_x_mm - 1.0),
            np.array([holds(one, push.d_x_mm) for one in known]),
        )
        text += f", {100.0 * inside.mean():.0f} % of intervals hold, {errors.mean():+.2f} % in the mean, "
        text += (
            f"{errors.std():.2f} % scatter, {100.0 * np.median(sigma) / push.d_x_mm:.2f} % stated"
        )
    return text + "".join(f" [{share:.0f} %: {said}]" for said, share in _said(found))


def _said(found: Sequence[EstimateRow]) -> list[tuple[str, float]]:
    """The three statuses said most, and in how many per cent."""
    short = (
        "".join(c for c in row.status.split(":")[0] if c not in "+-.0123456789")[:60]
        for row in found
    )
    counts = Counter(filter(None, short)).most_common(3)
    return [(said, 100.0 * n / len(found)) for said, n in counts]


def study(draws: int) -> Iterator[str]:
    """All extremes."""
    for extreme, (usual, values) in EXTREMES.items():
        for k, value in enumerate(values):
            push = replace(usual, **{extreme.split()[-1]: float(value)})
            yield line(extreme, value, push, draws, np.random.default_rng([k, 40]))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draws", type=int, default=300)
    options = parser.parse_args()
    for text in study(options.draws):
        print(text, flush=True)


if __name__ == "__main__":
    main()
