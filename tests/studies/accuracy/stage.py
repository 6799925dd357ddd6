"""Truth by the place that a stage states: errors and intervals of drawn whisks, by form of the object.

    python tests/studies/accuracy/stage.py --count 200 --seed 7

Place, origin, direction and thickness of the object are off by their sigmas, the whisker has a set that nobody stated.
First touch is the rig's. Printed: of d_x and slope RMS of error, RMS of z, and how many 95 % intervals hold.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.session.session import load_session
from tests.scenes.stated_places import OBJECTS, drawn_whisk

SESSION = Path(__file__).resolve().parents[3] / "fixtures" / "bring" / "stage"
TRIAL = "steel_b60_v10"
WITHIN = 1.96


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=7)
    arguments = parser.parse_args()
    session = load_session(SESSION)
    for shape in OBJECTS:
        drawn = drawn_whisks(session, shape, arguments.count, arguments.seed)
        d_x = np.array([(w.d_x_error_mm, w.d_x_sigma_mm) for w in drawn])
        beta = np.degrees([(w.beta_error_rad, w.beta_sigma_rad) for w in drawn])
        for name, column in (("d_x_mm", d_x), ("beta_deg", beta)):
            column = column[np.isfinite(column).all(axis=1)]
            z = column[:, 0] / column[:, 1]
            rms = np.sqrt(np.mean(column[:, 0] ** 2))
            held = np.mean(np.abs(z) < WITHIN)
            print(
                f"{shape:7s} {name:9s} n {len(z):4d}  RMS {rms:.4f}  RMS z {np.sqrt(np.mean(z**2)):.2f}  "
                f"held {held:.1%}",
                flush=True,
            )


def drawn_whisks(session, shape, count, seed):
    """So many whisks drawn before an object of a shape."""
    rng = np.random.default_rng(seed)
    return [drawn_whisk(session, TRIAL, rng, shape) for _ in range(count)]


if __name__ == "__main__":
    main()
