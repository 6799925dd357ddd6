"""Contact and stiffness from the shape that one camera sees, without gauges: what they are worth, and their intervals.

    python tests/studies/accuracy/one_camera.py [--count 200] [--seed 0] [--table]

Shapes are those of the rig's exact mechanics, 24 frames of a stroke from −3° on, a point each 3 mm but for 6 mm to
either side of the bar. Drawn anew are the whisker (cylinder, cone, tapered to 0.4), d_x 30 to 80 mm, slope −80 to 80°,
α 0 to 25°, θ 2 to 4°, a bar of 1 to 6 mm that leans by N(0, 5°) and in one of three gives way at 0.03 to 1 N/mm, noise
of 5 to 20 µm a point and as much that all points share, and the camera: above, or aside by 45°. Printed: how often 95 %
of a normal distribution hold the true touch, d_x, force and way of the contact, and the largest |z|.

--table: instead, seen from above with 10 µm each, on slopes 0 to 60° at α = 10°, θ = 3°: RMS error and stated sigma.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from estimator.seen_shape import ShapeContact, contact_of_shape
from estimator.uncertainty import Z_95
from tests.scenes.seen_shapes import ABOVE_MM, ASIDE_MM, Shown, shown

NAMES = ("touch_rad", "d_x_mm", "force_N", "moved_mm")
SLOPES_DEG, WHISKS, TILT_SIGMA_DEG = (0.0, 20.0, 40.0, 60.0), 8, 5.0


def drawn(rng: np.random.Generator) -> dict:
    """One of the whisks over which intervals are to hold."""
    soft = rng.uniform() < 1 / 3
    noise = 0.005 * 4.0 ** rng.uniform()
    return {
        "shape": str(rng.choice(["cylinder", "cone", "tapered"])),
        "d_x_mm": rng.uniform(30.0, 80.0),
        "beta_deg": rng.uniform(-80.0, 80.0),
        "alpha_deg": rng.uniform(0.0, 25.0),
        "psi_deg": TILT_SIGMA_DEG * rng.normal(),
        "theta_deg": rng.uniform(2.0, 4.0),
        "bar_mm": rng.uniform(1.0, 6.0),
        "stiffness_N_mm": 0.03 ** rng.uniform() if soft else np.inf,
        "eye_mm": ABOVE_MM if rng.uniform() < 0.5 else ASIDE_MM,
        "sigma_mm": noise,
        "off_mm": noise,
    }


def answered(one: Shown) -> ShapeContact:
    """As the bench asks: an object of unknown thickness that leans by hand's 5°."""
    told = {"reach_mm": 3.5, "tilt_sigma_rad": np.radians(TILT_SIGMA_DEG)}
    return contact_of_shape(one.seen, one.theta_rad, one.beam, **told)


def judged(one: Shown, said: ShapeContact) -> np.ndarray:
    """(4, 2): error and stated sigma of each quantity."""
    sigma_of = {
        "touch_rad": said.touch_sigma_rad,
        "d_x_mm": said.d_x_sigma_mm,
        "force_N": said.force_sigma_N,
        "moved_mm": said.moved_sigma_mm,
    }
    return np.array([[getattr(said, name) - getattr(one, name), sigma_of[name]] for name in NAMES])


def sample(wanted: list[dict], rng: np.random.Generator) -> list[tuple[dict, Shown, ShapeContact]]:
    """Whisks that found hold, with what is said of each."""
    found = []
    for told in wanted:
        try:
            one = shown(rng, **told)
        except ArithmeticError:
            continue
        found.append((told, one, answered(one)))
    return found


def print_coverage(found: list) -> None:
    """A line a quantity."""
    z = np.array(
        [errors[:, 0] / errors[:, 1] for errors in (judged(one, said) for _, one, said in found)]
    )
    for name, column in zip(NAMES, z.T):
        known = column[np.isfinite(column)]
        print(
            f"{name:<10} {len(known)} of {len(z)} told, 95 % intervals hold in "
            f"{100 * np.mean(np.abs(known) < Z_95):.1f} %, RMS z {np.sqrt(np.mean(known**2)):.2f}, largest |z| "
            f"{np.abs(known).max():.1f}"
        )
    for row in np.argsort(-np.nanmax(np.abs(z), axis=1, initial=0.0))[:3]:
        print("  z", np.round(z[row], 1), found[row][0])


def print_table(rng: np.random.Generator) -> None:
    """A row of the document a slope and stiffness."""
    for stiffness in (np.inf, 0.1):
        for beta in SLOPES_DEG:
            wanted = [
                {
                    "beta_deg": beta,
                    "d_x_mm": rng.uniform(30.0, 80.0),
                    "psi_deg": TILT_SIGMA_DEG * rng.normal(),
                    "off_mm": 0.01,
                    "stiffness_N_mm": stiffness,
                }
                for _ in range(WHISKS)
            ]
            found = [(one, said) for _, one, said in sample(wanted, rng) if not said.status]
            rms = np.sqrt(np.mean([judged(one, said) ** 2 for one, said in found], axis=0))
            force = np.sqrt(
                np.mean([(judged(one, said)[2] / one.force_N) ** 2 for one, said in found], axis=0)
            )
            told = np.array([said.stiffness_N_mm for _, said in found])
            told = told[np.isfinite(told)]
            middle = f"{np.median(told):.3f}" if len(told) else "none"
            print(
                f"| {stiffness:g} | {beta:g}° | {np.degrees(rms[0, 0]):.3f} (± {np.degrees(rms[0, 1]):.3f}) | "
                f"{rms[1, 0]:.2f} (± {rms[1, 1]:.2f}) | {100 * force[0]:.1f} (± {100 * force[1]:.1f}) | "
                f"{rms[3, 0]:.3f} (± {rms[3, 1]:.3f}) | {middle} ({len(told)} of "
                f"{len(found)}) |",
                flush=True,
            )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    if options.table:
        print_table(rng)
    else:
        print_coverage(sample([drawn(rng) for _ in range(options.count)], rng))


if __name__ == "__main__":
    main()
