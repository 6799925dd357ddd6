"""An object that moves while it is touched: what every estimator is off by over its speed, by exact mechanics.

    python tests/studies/accuracy/moving.py [--count 400] [--seed 0] [--shape cylinder cone tapered] [--figure PICTURE.png]

First a table of errors without noise (d_x 60 mm, θ 3°, α 10° as assumed, a bar of 6 mm), by slope and by how fast the
object moves along the push, in parts of the whisker's own speed at the contact; then, of whisks drawn as in
estimates_montecarlo.py against objects that move in any direction at up to 40 % of that speed, told to 2 % of it each
way: how often the 95 % interval of `known_motion` holds d_x, and the largest |z| of those without a status.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.drawing import blank, colour_of, label_of, save, style
from bench.base.settings import TILT_SIGMA_RAD
from bench.trials.estimates import run_estimator
from estimator.builtin import ESTIMATORS
from estimator.moving import known_motion
from estimator.whisk import EstimatorSettings, ObjectMotion, Whisk
from tests.studies.accuracy.estimates_montecarlo import (
    ALPHA_EST_DEG,
    ALPHA_SIGMA_DEG,
    DIAMETER_MM,
    DRAWN_ALPHA_DEG,
    MOMENT_SIGMA_NMM,
    TOUCH_SIGMA_RAD,
    push,
    rod_and_beam,
)

SHARES, SLOPES_DEG = (-0.4, -0.2, -0.1, 0.0, 0.1, 0.2, 0.4), (0.0, 30.0, 60.0)
ALPHA_DEG, THETA_DEG, D_X_MM = 10.0, 3.0, 60.0
NAMED = {**ESTIMATORS, "known_motion": known_motion}
TOLD_SHARE, FASTEST_SHARE = 0.02, 0.4


def errors_percent(beta_deg: float, share: float) -> dict[str, float]:
    """Of each estimator, without noise."""
    rod, beam = rod_and_beam("cylinder")
    per_rad, alpha, theta = (
        np.array([0.0, share * D_X_MM, 0.0]),
        np.radians(ALPHA_DEG),
        np.radians(THETA_DEG),
    )
    touch, moments = push(
        rod, np.radians(beta_deg), 0.0, D_X_MM, 3.0, alpha, theta, per_rad_mm=per_rad
    )
    whisk = Whisk(
        *(np.zeros(0),) * 4,
        theta,
        *moments,
        1e-12 * np.eye(2),
        0.0,
        beam,
        object_motion=ObjectMotion(per_rad, np.zeros((3, 3))),
    )
    told = EstimatorSettings(
        alpha, object_reach_mm=3.5, object_radius_mm=3.0, whisker_radius_mm=0.5
    )
    return {name: 100 * (one(whisk, told).d_x_mm / touch.d_x_mm - 1) for name, one in NAMED.items()}


def table() -> dict[tuple[float, float], dict[str, float]]:
    """By slope and share."""
    return {(beta, share): errors_percent(beta, share) for beta in SLOPES_DEG for share in SHARES}


def lines(cells: dict) -> list[str]:
    """A row of the document a cell."""
    head = [
        "| β | object's speed | " + " | ".join(map(label_of, NAMED)) + " |",
        "|---" * (2 + len(NAMED)) + "|",
    ]
    return head + [
        f"| {beta:g}° | {100 * share:+.0f} % | "
        + " | ".join(f"{e:+.1f}" for e in errors.values())
        + " |"
        for (beta, share), errors in cells.items()
    ]


def draw(cells: dict, path: Path) -> None:
    """Error over the object's speed, a panel a slope."""
    with style():
        figure = blank(9.0, 3.2)
        for panel, beta in zip(figure.subplots(1, len(SLOPES_DEG)), SLOPES_DEG):
            for number, name in enumerate(NAMED):
                mine = [cells[beta, share][name] for share in SHARES]
                look = {"ms": 3, "color": colour_of(name, number), "label": label_of(name)}
                panel.plot(100 * np.array(SHARES), mine, "o-", **look)
            panel.set(
                xlabel="object's speed, % of the whisker's", title=f"β = {beta:g}°", ylim=(-60, 120)
            )
        figure.axes[0].set_ylabel("error of d$_x$, %")
        figure.legend(
            *figure.axes[0].get_legend_handles_labels(),
            loc="outside lower center",
            ncols=len(NAMED),
        )
        save(figure, path, "tests/studies/accuracy/moving.py")


def drawn(shape: str, rng: np.random.Generator):
    """(d_x, the row of `known_motion`) of a whisk drawn anew; None where the whisker finds no hold."""
    rod, beam = rod_and_beam(shape)
    beta, d_x, theta = (
        np.radians(rng.uniform(0.0, 75.0)),
        rng.uniform(30.0, 85.0),
        np.radians(rng.uniform(2.0, 4.0)),
    )
    alpha, psi = np.radians(DRAWN_ALPHA_DEG.rvs(random_state=rng)), TILT_SIGMA_RAD * rng.normal()
    way, noise = rng.normal(size=3), 10.0 ** rng.uniform(-2.0, 0.5)
    per_rad = rng.uniform(0.0, FASTEST_SHARE) * d_x * way / np.linalg.norm(way)
    sigma_m, sigma_touch, told_mm = (
        MOMENT_SIGMA_NMM * noise,
        TOUCH_SIGMA_RAD * noise,
        TOLD_SHARE * d_x,
    )
    true_theta = theta + sigma_touch * rng.normal()
    try:
        touch, moments = push(
            rod, beta, psi, d_x, rng.uniform(0.6, 3.0), alpha, true_theta, per_rad_mm=per_rad
        )
    except (ArithmeticError, np.linalg.LinAlgError):
        return None
    felt = np.array(moments) + sigma_m * rng.normal(size=2)
    motion = ObjectMotion(per_rad + told_mm * rng.normal(size=3), told_mm**2 * np.eye(3))
    whisk = Whisk(*(np.zeros(0),) * 4, theta, *felt, sigma_m**2 * np.eye(2), sigma_touch, beam)
    told = np.radians(ALPHA_EST_DEG), np.radians(ALPHA_SIGMA_DEG), (np.nan, DIAMETER_MM / 2)
    return touch.d_x_mm, run_estimator(
        "", known_motion, replace(whisk, object_motion=motion), *told
    )


def coverage(shape: str, count: int, seed: int) -> str:
    """What is printed of a shape."""
    rng = np.random.default_rng(seed)
    found = [one for one in (drawn(shape, rng) for _ in range(count)) if one is not None]
    truths, rows = np.array([truth for truth, _ in found]), [row for _, row in found]
    ends = [
        np.array([getattr(row, f"d_x_est_{end}_mm") for row in rows]) for end in ("low", "high")
    ]
    errors = np.array([row.d_x_est_mm.value for row in rows]) - truths
    z = errors / [row.d_x_est_mm.sigma for row in rows]
    known, plain = np.isfinite(z), np.array([not row.status for row in rows])
    holds = (ends[0] <= truths) & (truths <= ends[1])
    return (
        f"{shape}: {len(rows)} whisks, {np.count_nonzero(~known)} without a distance; 95 % intervals hold in "
        f"{100 * holds[known].mean():.1f} %; of {np.count_nonzero(plain)} without a status in "
        f"{100 * holds[plain].mean():.1f} %, largest |z| {np.max(np.abs(z[plain])):.1f}; median error "
        f"{100 * np.median(np.abs(errors / truths)[plain]):.1f} %"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=400)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shape", nargs="+", default=["cylinder", "cone", "tapered"])
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    cells = table()
    print(*lines(cells), sep="\n")
    if options.figure:
        draw(cells, options.figure)
    for shape in options.shape:
        print(coverage(shape, options.count, options.seed), flush=True)


if __name__ == "__main__":
    main()
