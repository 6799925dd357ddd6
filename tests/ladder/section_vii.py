"""Do the intervals of section VII's ways hold? Sessions by exact mechanics, slopes and distances as set by hand.

    python tests/ladder/section_vii.py [--count 200] [--seed 0]

Each session is drawn anew: α, slopes of both signs in recordings of three whisks, each bar 0.4° and 0.4 mm (one sigma)
off what was wanted, gauges with an error that all whisks share, noise. Printed for each way: bias, RMS, how often 95 %
holds, the largest |z|, and how many sessions have no α and why.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from bench.friction.section_vii import Contact, by_consistency, by_tilting
from bench.report.score import Score
from bench.session.whisker import Whisker
from tests.ladder.estimates_montecarlo import E_GPA, push, rod_and_beam

SLOPES_DEG, D_X_MM, THETA_RAD = (-60, -45, -30, 0, 30, 45, 60), 60.0, np.radians(3.0)
SCATTER_DEG, SCATTER_MM, GAUGE_SHARE, NOISE_NMM, WHISKS = 0.4, 0.4, 0.004, 0.02, 3
WHISKER = Whisker("cylinder", 100.0, 1.0, youngs_modulus_GPa=E_GPA)


def session(alpha_deg: float, rng: np.random.Generator) -> Iterator[Contact]:
    """The contacts of a session."""
    rod, _ = rod_and_beam("cylinder")
    gauges = np.eye(2) + GAUGE_SHARE * rng.normal(size=(2, 2))
    for beta_deg in SLOPES_DEG:
        beta, d_x = np.radians(beta_deg + SCATTER_DEG * rng.normal()), D_X_MM + SCATTER_MM * rng.normal()
        _, exact = push(rod, beta, 0.0, d_x, 3.0, np.radians(alpha_deg), THETA_RAD)
        for _ in range(WHISKS):
            m_y, m_z = gauges @ exact + NOISE_NMM * rng.normal(size=2)
            sigma = np.hypot(GAUGE_SHARE, NOISE_NMM / np.hypot(m_y, m_z))
            phi = float(np.arctan2(m_y, m_z))
            yield Contact(np.radians(beta_deg), D_X_MM, THETA_RAD, m_y, m_z, phi, sigma, f"b{beta_deg}")


def study(count: int, seed: int) -> dict[str, tuple[Score, Counter]]:
    """Scores by way, and the statuses."""
    rng, found = np.random.default_rng(seed), {}
    for _ in range(count):
        alpha_deg = rng.uniform(5.0, 24.0)
        felt = list(session(alpha_deg, rng))
        for way in (by_tilting(felt), by_consistency([c for c in felt if c.beta_rad >= 0], WHISKER)):
            found.setdefault(way.name, []).append((np.degrees(way.alpha_rad) - alpha_deg, way))
    return {name: (_score(name, rows), Counter(w.status for _, w in rows if w.status)) for name, rows in found.items()}


def _score(name: str, rows) -> Score:
    known = [(error, np.degrees(way.sigma_rad)) for error, way in rows if np.isfinite(error)]
    return Score(name, "deg", *np.array(known).T)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    print(f"{'':<28}{'n':>5}  {'bias':>9}  {'RMS':>8}     in 95 %  most |z|")
    for score, statuses in study(options.count, options.seed).values():
        print(score.line(), *(f"; {n} × {status}" for status, n in statuses.items()))


if __name__ == "__main__":
    main()
