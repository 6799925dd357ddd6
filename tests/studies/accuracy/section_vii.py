"""Do the intervals of section VII's ways hold? Sessions by exact mechanics, slopes and distances as set by hand.

    python tests/studies/accuracy/section_vii.py [--count 200] [--seed 0]

Each session is drawn anew: α, slopes of both signs in recordings of three whisks, each bar 0.4° and 0.4 mm (one sigma)
off what was wanted, gauges with an error that all whisks share, noise. For smoothness bars stand at two distances in
turn. A soft object is pushed at two distances, known to 0.1 mm from each other. Printed for each way: bias, RMS, how
often 95 % holds, the largest |z|, and how many sessions have no α and why.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.analyses.felt_push import FeltPush
from bench.analyses.section_vii import by_consistency, by_smoothness, by_tilting
from bench.analyses.soft import Place, Soft, softness
from bench.records.trial_result import TrialFacts
from bench.report.score import Score
from bench.session.whisker import Whisker
from tests.studies.accuracy.estimates_montecarlo import (
    DIAMETER_MM,
    E_GPA,
    LENGTH_MM,
    TIP_MM,
    push,
    rod_and_beam,
)
from vision.truth.value import Value

SLOPES_DEG, D_X_MM, THETA_RAD = (-60, -45, -30, 0, 30, 45, 60), 60.0, np.radians(3.0)
SCATTER_DEG, SCATTER_MM, GAUGE_SHARE, NOISE_NMM, WHISKS = 0.4, 0.4, 0.004, 0.02, 3
SHIFT_MM, SHIFT_SIGMA_MM = 20.0, 0.1  # of the base, along the whisker
DRAWS = 10  # of noise and gauges, of a soft object at its two distances
ALPHA_EST_DEG, ALPHA_EST_SIGMA_DEG = 12.0, 5.0  # as assumed
WHISKER = Whisker(shape="cylinder", length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=E_GPA)


def session(alpha_deg: float, rng: np.random.Generator, places_mm=(D_X_MM,)) -> Iterator[FeltPush]:
    """The contacts of a session, at nominal distances that take turns."""
    rod, _ = rod_and_beam("cylinder")
    gauges = np.eye(2) + GAUGE_SHARE * rng.normal(size=(2, 2))
    for k, beta_deg in enumerate(SLOPES_DEG):
        nominal = places_mm[k % len(places_mm)]
        beta, d_x = (
            np.radians(beta_deg + SCATTER_DEG * rng.normal()),
            nominal + SCATTER_MM * rng.normal(),
        )
        _, exact = push(rod, beta, 0.0, d_x, 3.0, np.radians(alpha_deg), THETA_RAD)
        for _ in range(WHISKS):
            m_y, m_z = gauges @ exact + NOISE_NMM * rng.normal(size=2)
            shared = GAUGE_SHARE * np.kron(np.eye(2), [[m_y], [m_z]])
            yield FeltPush(
                np.radians(beta_deg), nominal, THETA_RAD, m_y, m_z, shared, f"b{beta_deg}"
            )


def two_places(
    shape: str, stiffness: float, alpha_deg: float, rng: np.random.Generator
) -> Iterator[Soft]:
    """What whisks against an object of that stiffness [N/mm] tell of it, at a distance and SHIFT_MM farther: DRAWS of
    noise and gauges."""
    rod, _ = rod_and_beam(shape)
    tip = TIP_MM if shape == "tapered" else None
    whisker = Whisker(
        shape=shape,
        length_mm=LENGTH_MM,
        diameter_mm=DIAMETER_MM,
        youngs_modulus_GPa=E_GPA,
        tip_diameter_mm=tip,
    )
    near, exact = rng.uniform(35.0, 55.0), []
    for nominal in (near, near + SHIFT_MM):
        d_x = nominal + SHIFT_SIGMA_MM / np.sqrt(2.0) * rng.normal()
        exact.append(
            (
                nominal,
                push(rod, 0.0, 0.0, d_x, 3.0, np.radians(alpha_deg), THETA_RAD, stiffness)[1][1],
            )
        )
    facts = TrialFacts("soft", "measure", "soft", 10.0, bar_diameter_mm=6.0)
    for _ in range(DRAWS):
        gauge = 1.0 + GAUGE_SHARE * rng.normal()
        places = [_place(nominal, gauge * m_z + NOISE_NMM * rng.normal()) for nominal, m_z in exact]
        yield softness(
            whisker,
            facts,
            *places,
            THETA_RAD,
            Value(*np.radians([ALPHA_EST_DEG, ALPHA_EST_SIGMA_DEG])),
        )


def _place(nominal_mm: float, m_z: float) -> Place:
    k = THETA_RAD / m_z
    return Place(
        nominal_mm,
        SHIFT_SIGMA_MM / np.sqrt(2.0),
        k,
        k / m_z * NOISE_NMM,
        1,
        k * np.array([GAUGE_SHARE]),
    )


def soft_study(shape: str, count: int, seed: int) -> Score:
    """Of 1/k, mm/N, over objects from 0.1 N/mm to rigid."""
    rng, rows = np.random.default_rng(seed), []
    for k in range(count):
        stiffness = np.inf if k % 4 == 0 else 10.0 ** rng.uniform(-1.0, 1.0)
        found = two_places(shape, stiffness, rng.uniform(5.0, 24.0), rng)
        gives = [one.give_mm_N for one in found]
        rows += [(give.value - 1.0 / stiffness, give.sigma) for give in gives]
    return Score(f"softness, {shape}", "mm/N", *np.array(rows).T)


def study(count: int, seed: int) -> dict[str, tuple[Score, Counter]]:
    """Scores by way, and the statuses."""
    rng, found = np.random.default_rng(seed), {}
    for _ in range(count):
        alpha_deg = rng.uniform(5.0, 24.0)
        felt, along = (
            list(session(alpha_deg, rng, places)) for places in ((D_X_MM,), (45.0, 60.0))
        )
        upward = [c for c in felt if c.beta_rad >= 0]
        for way in (
            by_tilting(felt, WHISKER),
            by_consistency(upward, WHISKER),
            by_smoothness(along, WHISKER),
        ):
            found.setdefault(way.name, []).append((np.degrees(way.alpha.value) - alpha_deg, way))
    return {
        name: (_score(name, rows), Counter(w.status for _, w in rows if w.status))
        for name, rows in found.items()
    }


def _score(name: str, rows) -> Score:
    known = [(error, np.degrees(way.alpha.sigma)) for error, way in rows if np.isfinite(error)]
    return Score(name, "deg", *np.array(known).T)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    print(f"{'':<28}{'n':>5}  {'bias':>9}  {'RMS':>8}     in 95 %  most |z|")
    for score, statuses in study(options.count, options.seed).values():
        print(score.line(), *(f"; {n} × {status}" for status, n in statuses.items()))
    for shape in ("cylinder", "cone", "tapered"):
        print(soft_study(shape, options.count, options.seed).line())


if __name__ == "__main__":
    main()
