"""How honest the interval of (10) is: whisks by the rig's exact mechanics, α drawn from what α_est states of it.

    python tests/studies/accuracy/estimates_montecarlo.py [--count 1200] [--seed 0] [--shape cylinder cone tapered]

Every whisk is drawn anew: β 0 to 80°, d_x 30 to 85 mm, θ 2 to 4°, lean and thickness of the bar (to 6 mm, and to 24 mm
where it is told), α from N(12°, 5°) cut to 0 to 25° with α_est and its sigma as that has them, touch and moments with
noise from a hundredth to three times that of the small session. Printed, with α_est's sigma and without it: how often
the 95 % interval holds the true d_x; of the estimates without a status the largest |z|; how many have a status, and how
many of these intervals hold.
"""

import argparse
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.stats import truncnorm

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.settings import OBJECT_REACH_MM, TILT_SIGMA_RAD
from bench.records.trial_result import EstimateRow
from bench.rig.elastic_rod import Rod
from bench.rig.rod_contact import moments_Nmm
from bench.rig.stick_slip import FrictionCoefficients, March
from bench.trials.estimates import run_estimator
from estimator.beam import Beam
from estimator.builtin import with_friction
from estimator.whisk import Whisk
from tests.scenes.marches import touched_bar

DRAWN_ALPHA_DEG = truncnorm(-12.0 / 5.0, 13.0 / 5.0, loc=12.0, scale=5.0)
ALPHA_EST_DEG, ALPHA_SIGMA_DEG = float(DRAWN_ALPHA_DEG.mean()), float(DRAWN_ALPHA_DEG.std())
LENGTH_MM, DIAMETER_MM, TIP_MM, E_GPA = 100.0, 1.0, 0.4, 60.0
MOMENT_SIGMA_NMM, TOUCH_SIGMA_RAD = 0.01, np.radians(0.01)  # the small session's
STEPS = 6  # of the march from touch, as in bench.theory.model_error


@dataclass(frozen=True)
class Drawn:
    """One whisk's truth, and what a robot has of it."""

    beta_deg: float
    alpha_deg: float
    d_x_mm: float
    whisk: Whisk
    radii_mm: tuple[float, float]


def rod_and_beam(shape: str) -> tuple[Rod, Beam]:
    """The whisker as the rig and as the estimator has it."""
    tip = (TIP_MM,) if shape == "tapered" else ()
    rod = Rod(shape, LENGTH_MM, DIAMETER_MM, E_GPA, **({"tip_diameter_mm": TIP_MM} if tip else {}))
    return rod, Beam.from_modulus(
        E_GPA, DIAMETER_MM, LENGTH_MM, shape, *(t / DIAMETER_MM for t in tip)
    )


def draw(shape: str, rng: np.random.Generator) -> Drawn | None:
    """A whisk drawn anew; None where the whisker finds no hold on the bar."""
    rod, beam = rod_and_beam(shape)
    beta, d_x, theta = (
        rng.uniform(0.0, 80.0),
        rng.uniform(30.0, 85.0),
        np.radians(rng.uniform(2.0, 4.0)),
    )
    alpha, psi = float(DRAWN_ALPHA_DEG.rvs(random_state=rng)), TILT_SIGMA_RAD * rng.normal()
    told = rng.random() < 0.5
    radius = rng.uniform(0.6, 12.0 if told else OBJECT_REACH_MM - DIAMETER_MM / 2)
    noise = 10.0 ** rng.uniform(-2.0, 0.5)
    sigma_m, sigma_touch = MOMENT_SIGMA_NMM * noise, TOUCH_SIGMA_RAD * noise
    true_theta = theta + sigma_touch * rng.normal()
    try:
        touch, moments = push(
            rod, np.radians(beta), psi, d_x, radius, np.radians(alpha), true_theta
        )
    except ArithmeticError:
        return None
    felt = np.array(moments) + sigma_m * rng.normal(size=2)
    whisk = Whisk(*(np.zeros(0),) * 4, theta, *felt, sigma_m**2 * np.eye(2), sigma_touch, beam)
    return Drawn(beta, alpha, touch.d_x_mm, whisk, (radius if told else np.nan, DIAMETER_MM / 2))


def push(
    rod: Rod,
    beta: float,
    psi: float,
    d_x: float,
    radius: float,
    alpha: float,
    theta: float,
    stiffness: float = np.inf,
    per_rad_mm: np.ndarray | None = None,
):
    """First touch, and the exact moments at θ; stiffness: of the bar, N/mm; per_rad_mm (3,): how it moves. Raises
    ArithmeticError without contact."""
    place = {"beta_rad": beta, "psi_rad": psi, "radius_mm": radius}
    bar, touch = touched_bar(rod, d_x, **place, stiffness_N_mm=stiffness)
    if per_rad_mm is not None:
        bar = replace(bar, velocity_mm_rad=per_rad_mm, touch_rad=touch.motor_rad)
    march = March(rod, bar, FrictionCoefficients(np.tan(alpha), np.tan(alpha)), touch)
    *_, state = march.along(touch.motor_rad + theta * np.arange(1, STEPS + 1) / STEPS)[1]
    if state is None:
        raise ArithmeticError("no contact")
    return touch, moments_Nmm(state)


@dataclass(frozen=True)
class Sample:
    """Rows of (10) and the truths (n,), with what each may say: "all" with α_est's sigma, "exact" without."""

    rows: list[EstimateRow]
    truths: np.ndarray

    @property
    def status(self) -> np.ndarray:
        return np.array([bool(row.status) for row in self.rows])

    @property
    def holds(self) -> np.ndarray:
        """Does the 95 % interval hold the truth, with α_est's sigma?"""
        low, high = (
            np.array([getattr(row, f"d_x_est_{end}_mm") for row in self.rows])
            for end in ("low", "high")
        )
        return (low <= self.truths) & (self.truths <= high)

    def z(self, alpha_exact: bool = False) -> np.ndarray:
        """Error over stated sigma, with α_est's or as if it were right; NaN where there is no distance."""
        errors = np.array([row.d_x_est_mm.value for row in self.rows]) - self.truths
        return errors / [
            row.d_x_est_sigma_alpha_exact_mm if alpha_exact else row.d_x_est_mm.sigma
            for row in self.rows
        ]


def sample(shape: str, count: int, seed: int) -> Sample:
    """So many whisks of one whisker."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        if (whisk := draw(shape, rng)) is not None:
            found.append(whisk)
    angles = np.radians(ALPHA_EST_DEG), np.radians(ALPHA_SIGMA_DEG)
    rows = [
        run_estimator("with_friction", with_friction, d.whisk, *angles, d.radii_mm) for d in found
    ]
    return Sample(rows, np.array([d.d_x_mm for d in found]))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=1200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shape", nargs="+", default=["cylinder", "cone", "tapered"])
    options = parser.parse_args()
    for shape in options.shape:
        s = sample(shape, options.count, options.seed)
        z, exact = s.z(), s.z(alpha_exact=True)
        told = s.status
        print(
            f"{shape}: {options.count} whisks, 95 % intervals hold in {100 * s.holds.mean():.1f} % "
            f"(as if α_est were right: {100 * np.mean(np.abs(exact[np.isfinite(exact)]) < 1.96):.1f} %); "
            f"largest |z| without a status {np.nanmax(np.abs(z[~told])):.2f} ({np.nanmax(np.abs(exact)):.0f}); "
            f"{told.sum()} with a status, {100 * s.holds[told].mean():.1f} % of these hold"
        )


if __name__ == "__main__":
    main()
