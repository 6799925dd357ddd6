"""How well the rig's mechanics agree with theory and with other solvers.

    python tests/studies/accuracy/mechanics.py

Prints the three-solver numbers, the largest departures from the small-angle theory to θ = 5° on a 3 mm bar and in the
limit of small angles on a bar of no thickness, and those from elliptic integrals. The tests hold the same to bounds.
"""

import itertools
import math
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.rig.elastic_rod import Rod
from bench.rig.elastica import Elastica
from tests.scenes.elliptic import CYLINDER, elliptic_end
from tests.scenes.marches import polar, slip_mm, small_angle, whisk

THETAS_DEG = np.arange(0.25, 5.01, 0.25)


def departures(beta: float, d_x: float, alpha_deg: float) -> tuple[float, float]:
    """Largest departure of |m| (in parts, with its sign) and of φ (degrees) from (13), (14) to θ = 5°."""
    _, _, states = whisk(THETAS_DEG, d_x=d_x, beta=beta, mu=math.tan(math.radians(alpha_deg)))
    exact = np.array([polar(s) for s in states])
    simple = np.array([small_angle(t, d_x, beta, alpha_deg) for t in THETAS_DEG])
    return max(exact[:, 0] / simple[:, 0] - 1, key=abs), np.abs(exact[:, 1] - simple[:, 1]).max()


def limit(beta: float, alpha_deg: float) -> float:
    """|m| against small-angle theory at θ = 0.5° on a bar of no thickness, in parts."""
    steps = np.arange(0.05, 0.51, 0.05)
    _, _, states = whisk(
        steps,
        beta=beta,
        mu=math.tan(math.radians(alpha_deg)),
        radius=1e-4,
        rod=Rod("cylinder", 100.0, 1.0, 60.0),
    )
    return polar(states[-1])[0] / small_angle(0.5, 65.0, beta, alpha_deg)[0] - 1


def elliptic(load: float, direction_deg: float) -> float:
    """Largest departure of end and slope from elliptic integrals, in parts of the length and radians."""
    arc, direction = 70.0, math.radians(direction_deg)
    force = load * CYLINDER.rigidity_Nmm2 / arc**2
    bent = Elastica(CYLINDER, nodes=30).solve(
        force * math.cos(direction), force * math.sin(direction), arc
    )
    end, slope = elliptic_end(load, direction)
    return max(np.abs(bent.end_mm / arc - end).max(), abs(bent.slope - slope))


def main() -> None:
    march, touch, states = whisk(np.arange(0.1, 5.01, 0.1), mu=0.1763)
    for theta in (1, 3, 5):
        state = states[round(theta / 0.1) - 1]
        moment, phi = polar(state)
        print(
            f"θ = {theta}°: |m| {moment:.4f} N·mm, φ {phi:.3f}°, slip {slip_mm(march, touch, state):.4f} mm"
        )
    for alpha_deg, betas in itertools.product(
        (0.0, 10.5, 23.0), ((0.0, 15.0), (30.0, 45.0, 60.0, 75.0))
    ):
        found = [departures(b, d, alpha_deg) for b in betas for d in (50.0, 80.0)]
        moment, phi = max((m for m, _ in found), key=abs), max(p for _, p in found)
        print(
            f"α = {alpha_deg:4}°, β {betas[0]:.0f}…{betas[-1]:.0f}°: |m| {100 * moment:+.2f} %, φ {phi:.2f}°"
        )
    cases = [(60.0, 0.0), (60.0, 10.5), (60.0, 20.0), (0.0, 0.0), (30.0, 0.0), (75.0, 0.0)]
    print(f"θ = 0.5°, no thickness: |m| {100 * max((limit(*c) for c in cases), key=abs):+.4f} %")
    loads = itertools.product((0.05, 1.0, 3.0), (60, 90, 120))
    print(f"elliptic integrals: {max(elliptic(*c) for c in loads):.1e}")


if __name__ == "__main__":
    main()
