"""An object that gives way while it is touched: what estimators and both compliances are off by, over its stiffness.

    python tests/studies/accuracy/soft.py [--figure PICTURE.png]

Exact mechanics without noise: d_x 60 mm, θ 3°, α 10° as assumed, a bar of 6 mm on springs along its normal, by slope
and by the ratio of its stiffness to that of the whisker where it touches, 3EI/d³. "two distances": the compliance by
`bench.analyses.soft` from whisks at 60 and 80 mm, for whisks that do not slip sideways. "seen": the exact way over the
force of `bench.analyses.gave`.
"""

import argparse
import sys
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.analyses.gave import normal_force_N
from bench.analyses.soft import Place, softness
from bench.base.drawing import blank, colour_of, label_of, save, style
from bench.records.trial_result import FeltWhisk, TrialFacts
from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.stick_slip import FrictionCoefficients
from bench.rig.whisk_mechanics import WhiskMechanics
from bench.session.whisker import Whisker
from estimator.builtin import ESTIMATORS
from estimator.whisk import EstimatorSettings, Whisk
from tests.scenes.results import seen_whisk
from tests.studies.accuracy.estimates_montecarlo import DIAMETER_MM, E_GPA, LENGTH_MM, rod_and_beam
from vision.truth.value import Value

RATIOS, SLOPES_DEG = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0, np.inf), (0.0, 30.0, 60.0)
ALPHA_RAD, THETA_RAD, NEAR_MM, FAR_MM, RADIUS_MM = (
    np.radians(10.0),
    np.radians(3.0),
    60.0,
    80.0,
    3.0,
)
NEXT_TO_NOTHING = 1e-9
TWO, SEEN = "1/k, two distances", "1/k, seen"


def pushed(beta_rad: float, d_x_mm: float, stiffness_N_mm: float) -> tuple[np.ndarray, float]:
    """Moments (m_y, m_z) at θ, and how far the bar came, mm."""
    rod, _ = rod_and_beam("cylinder")
    bar = TouchedBar.at_contact(
        d_x_mm=d_x_mm,
        beta_rad=beta_rad,
        psi_rad=0.0,
        touch_rad=0.0,
        radius_mm=RADIUS_MM,
        whisker_radius_mm=DIAMETER_MM / 2,
        stiffness_N_mm=stiffness_N_mm,
    )
    touch, mu = find_first_touch(rod, bar, 0.0, d_x_mm), np.tan(ALPHA_RAD)
    end = touch.motor_rad + THETA_RAD
    whisk = WhiskMechanics.run(
        rod, bar, FrictionCoefficients(mu, mu), touch, end, step_rad=THETA_RAD / 6
    )
    return whisk.forward.moment_Nmm[-1], float(np.linalg.norm(whisk.gave_mm(end, False)))


def errors_percent(beta_deg: float, ratio: float) -> dict[str, float]:
    """Of each estimator's d_x, and of both compliances where they are told."""
    _, beam = rod_and_beam("cylinder")
    stiffness, beta = ratio * beam.C_Nmm2 / NEAR_MM**3, np.radians(beta_deg)
    moments, gave_mm = pushed(beta, NEAR_MM, stiffness)
    whisk = Whisk(
        *(np.zeros(0),) * 4, THETA_RAD, *moments, NEXT_TO_NOTHING**2 * np.eye(2), 0.0, beam
    )
    told = EstimatorSettings(
        ALPHA_RAD, object_reach_mm=3.5, object_radius_mm=RADIUS_MM, whisker_radius_mm=0.5
    )
    found = {
        name: 100 * (one(whisk, told).d_x_mm / NEAR_MM - 1) for name, one in ESTIMATORS.items()
    }
    if np.isinf(stiffness):
        return found
    if beta_deg == 0.0:
        found[TWO] = 100 * (two_distances(stiffness, moments[1]) * stiffness - 1)
    m_y, m_z = (Value(float(m), 0.0) for m in moments)
    seen = seen_whisk(d_x_mm=Value(NEAR_MM, 0.0), beta_rad=Value(beta, 0.0))
    force = normal_force_N(seen, FeltWhisk(m_y_Nmm=m_y, m_z_Nmm=m_z)).value
    return found | {SEEN: 100 * (gave_mm / force * stiffness - 1)}


def two_distances(stiffness_N_mm: float, near_m_z: float) -> float:
    """Compliance, mm/N, by whisks at both distances."""
    far_m_z = pushed(0.0, FAR_MM, stiffness_N_mm)[0][1]
    place = partial(
        Place, nominal_sigma_mm=NEXT_TO_NOTHING, sigma=NEXT_TO_NOTHING, whisks=1, shared=np.zeros(1)
    )
    places = (
        place(d, compliance=THETA_RAD / m_z) for d, m_z in ((NEAR_MM, near_m_z), (FAR_MM, far_m_z))
    )
    whisker = Whisker(
        shape="cylinder", length_mm=LENGTH_MM, diameter_mm=DIAMETER_MM, youngs_modulus_GPa=E_GPA
    )
    facts = TrialFacts("soft", "measure", "soft", 10.0, bar_diameter_mm=2 * RADIUS_MM)
    return softness(whisker, facts, *places, THETA_RAD, Value(ALPHA_RAD, 0.0)).give_mm_N.value


def lines(cells: dict) -> list[str]:
    """A row of the document a cell."""
    names = [*ESTIMATORS, TWO, SEEN]
    head = [
        "| β | stiffness ratio | " + " | ".join(map(label_of, names)) + " |",
        "|---" * (2 + len(names)) + "|",
    ]
    return head + [
        f"| {beta:g}° | {'rigid' if np.isinf(ratio) else f'{ratio:g}'} | "
        + " | ".join(f"{errors[name]:+.1f}" if name in errors else "" for name in names)
        + " |"
        for (beta, ratio), errors in cells.items()
    ]


def draw(cells: dict, path: Path) -> None:
    """Error over the ratio, a panel a slope."""
    ratios = [ratio for ratio in RATIOS if np.isfinite(ratio)]
    with style():
        figure = blank(9.0, 3.2)
        for panel, beta in zip(figure.subplots(1, len(SLOPES_DEG)), SLOPES_DEG):
            for number, name in enumerate(ESTIMATORS):
                mine = [cells[beta, ratio][name] for ratio in ratios]
                panel.semilogx(
                    ratios, mine, "o-", ms=3, color=colour_of(name, number), label=label_of(name)
                )
            panel.set(
                xlabel="stiffness, object over whisker", title=f"β = {beta:g}°", ylim=(-10, 120)
            )
        figure.axes[0].set_ylabel("error of d$_x$, %")
        figure.legend(
            *figure.axes[0].get_legend_handles_labels(),
            loc="outside lower center",
            ncols=len(ESTIMATORS),
        )
        save(figure, path, "tests/studies/accuracy/soft.py")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    cells = {(beta, ratio): errors_percent(beta, ratio) for beta in SLOPES_DEG for ratio in RATIOS}
    print(*lines(cells), sep="\n")
    if options.figure:
        draw(cells, options.figure)


if __name__ == "__main__":
    main()
