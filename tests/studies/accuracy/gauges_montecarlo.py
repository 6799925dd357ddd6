"""How honest the gauges' uncertainty is: simulated calibrations, each with noise of every kind that is stated.

    python tests/studies/accuracy/gauges_montecarlo.py [--count 1000] [--seed 0]

Volts with white noise and a zero that a whisk's pairs share; moments with a distance that a whisk's pairs share and
noise of their own; the follicle's turn of each whisk. Printed: how often the 95 % intervals of the four coefficients
hold the truth, and the sampled over the stated sigma.
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.gauges.fit import fit_matrix
from bench.gauges.gauge_readings import Pairs
from bench.gauges.matrix import to_follicle

TRUE = np.array([[11.3, 0.32], [-0.25, 10.5]])
THETA = np.radians([0.5, 1.5, 2.5, 3.5, 4.5])
RIGID_NMM = 9.3  # at 3°
NOISE_V, ZERO_V, DISTANCE, POINT_NMM = 0.0005, 0.002, 0.002, 0.01
ROLL_SIGMA_RAD = np.radians(0.2)
WHISKS = (("a", 0.0), ("b", 90.0), ("c", 0.0), ("d", 90.0))
_Z95 = 1.959964


@dataclass(frozen=True)
class Sample:
    """Of many calibrations: fitted less true coefficients (n, 4), and the stated sigmas (n, 4)."""

    errors: np.ndarray
    sigmas: np.ndarray

    @property
    def coverage(self) -> np.ndarray:
        """Share (4,) of calibrations whose 95 % interval holds the coefficient."""
        return np.mean(np.abs(self.errors) < _Z95 * self.sigmas, axis=0)

    @property
    def ratio(self) -> np.ndarray:
        """Sampled over stated sigma (4,)."""
        return np.sqrt(np.mean(self.errors**2, axis=0) / np.mean(self.sigmas**2, axis=0))


def simulated(trial: str, roll_deg: float, rng: np.random.Generator) -> Pairs:
    """A push at β = 0 on a follicle turned by roll_deg, the pairs with what is stated of them and errors to match."""
    exact = np.stack([np.zeros_like(THETA), RIGID_NMM * THETA / np.radians(3.0)], axis=1)
    roll, n = np.radians(roll_deg), 2 * len(THETA)
    moments = exact @ to_follicle(roll).T
    by_roll = (exact @ to_follicle(roll + np.pi / 2).T).ravel() * ROLL_SIGMA_RAD
    by_distance = DISTANCE * moments.ravel()
    of_moments = (
        np.outer(by_distance, by_distance) + np.outer(by_roll, by_roll) + POINT_NMM**2 * np.eye(n)
    )
    of_volts = np.kron(np.ones((len(THETA),) * 2), ZERO_V**2 * np.eye(2)) + NOISE_V**2 * np.eye(n)
    volts = np.linalg.solve(TRUE, moments.T).T
    paper = to_follicle(roll) @ [0.0, RIGID_NMM]
    return Pairs(
        trial,
        0,
        roll_deg,
        THETA,
        moments + rng.multivariate_normal(np.zeros(n), of_moments).reshape(-1, 2),
        of_moments,
        volts + rng.multivariate_normal(np.zeros(n), of_volts).reshape(-1, 2),
        of_volts,
        paper,
        np.linalg.solve(TRUE, paper),
    )


def sample_calibrations(count: int, seed: int, whisks=WHISKS) -> Sample:
    """Calibrations from the same whisks with new noise each."""
    rng = np.random.default_rng(seed)
    made = [fit_matrix([simulated(*whisk, rng) for whisk in whisks]) for _ in range(count)]
    errors = np.array([(m.matrix - TRUE).ravel() for m in made])
    return Sample(errors, np.array([m.sigma.ravel() for m in made]))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for name, whisks in (("two whisks", WHISKS[:2]), ("four whisks", WHISKS)):
        sample = sample_calibrations(options.count, options.seed, whisks)
        held = "  ".join(f"{100 * share:.1f} %" for share in sample.coverage)
        ratio = "  ".join(f"{r:.3f}" for r in sample.ratio)
        print(
            f"{options.count} calibrations, {name}: 95 % intervals hold in {held}; sampled / stated sigma {ratio}"
        )


if __name__ == "__main__":
    main()
