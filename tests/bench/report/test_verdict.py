"""The verdict is for somebody who has not read the paper: what is assumed, how wrong, where, and what to use."""

import pytest

from bench.analyses.estimates_again import FITTED
from bench.analyses.estimator_accuracy import Accuracy, RunAccuracy, TruthUncertainty
from bench.base.settings import Settings
from bench.report.summary.verdict import verdict
from bench.trials.estimate_errors import Judged

D_X_MM = 50.0
TRUTH = TruthUncertainty(8, 8, 0.01, 0.01, 0.1, 0.01)
SLOPES_DEG = (0.0, 20.0, 40.0, 70.0)


def judged(
    beta_deg: float, percent: float, surface: str = "steel", estimator="with_friction"
) -> Judged:
    """Return a whisk whose estimate is off by so many per cent, ± 1 %."""
    sigma_mm = 0.01 * D_X_MM
    distance_mm = D_X_MM * (1 + 0.01 * percent)
    return Judged(
        f"{surface}_{beta_deg:.0f}",
        0,
        "measure",
        surface,
        10.0,
        estimator,
        beta_deg,
        D_X_MM,
        0.0,
        distance_mm,
        sigma_mm,
        d_x_est_sigma_alpha_exact_mm=0.6 * sigma_mm,
    )


def accuracy(whisks: list[Judged], settings: int, holding: int | None = None) -> Accuracy:
    """Return the accuracy of one estimator over these whisks."""
    count = len(whisks)
    held = count if holding is None else holding
    return Accuracy(whisks[0].estimator, count, tuple(whisks), (), (), (), count, held, settings)


def lines_of(*estimators: Accuracy) -> list[str]:
    """Return the verdict on these estimators."""
    return list(verdict("s", True, RunAccuracy(TRUTH, estimators), Settings(), 0))


def test_one_whisk_has_no_line_by_slope():
    _, of_estimator, sample, use = lines_of(accuracy([judged(30.0, 2.0)], 1))
    assert "at θ = 3° off by +2.0 ± 1.0 % (+1.00 mm)" in of_estimator
    assert sample.startswith("By 1 whisk at 1 setting ") and "errs by 0.89 to 64 % RMS" in sample
    assert use.startswith("Use (10) with friction here")


def test_an_error_is_told_by_surface_and_slope():
    """Sandpaper at 70° makes the RMS of all; no other surface and slope has any of it."""
    whisks = [judged(beta, 0.5) for beta in SLOPES_DEG]
    whisks += [judged(beta, 40.0 if beta == 70.0 else -0.5, "sandpaper") for beta in SLOPES_DEG]
    by_slope = [line for line in lines_of(accuracy(whisks, 8)) if "by slope" in line]
    steel, sandpaper = by_slope
    assert steel.endswith("0 to 20° 0.5 % RMS (worst +0.5 %); 40° +0.5 %; 70° +0.5 %.")
    assert sandpaper.startswith("(10) with friction on sandpaper, 10°/s, by slope: ")
    assert sandpaper.endswith("0 to 20° 0.5 % RMS (worst -0.5 %); 40° -0.5 %; 70° +40.0 %.")


def test_of_many_surfaces_the_worst_are_shown():
    whisks = [judged(30.0, float(number), f"s{number}") for number in range(7)]
    lines = lines_of(accuracy(whisks, 7))
    (head,) = [line for line in lines if line.startswith("The 4 of 7 ")]
    shown = [line.split()[4].rstrip(",") for line in lines if "by slope" in line]
    assert shown == ["s3", "s4", "s5", "s6"] and lines.index(head) == 2


def test_what_is_stated_for_friction_is_told_apart():
    """0.6 of ± 1 % is left without it, so that 0.8 is its own."""
    of_estimator = lines_of(accuracy([judged(30.0, 1.0)], 1))[1]
    assert (
        "It states ± 1.0 % (± 0.8 % for the friction angle, ± 0.6 % for all else): its"
        in of_estimator
    )


@pytest.mark.parametrize(("percent", "is_told"), [(0.2, True), (20.0, False)])
def test_a_fitted_friction_angle_is_advised_where_it_is_better(percent, is_told):
    given = accuracy([judged(beta, 20.0) for beta in SLOPES_DEG], 4)
    fitted = accuracy([judged(beta, percent, estimator=FITTED) for beta in SLOPES_DEG], 4)
    *_, of_fitted, _, _, use = lines_of(given, fitted)
    assert of_fitted.startswith("Equation (10), α fitted assumes")
    assert ("where α can be fitted to the surface first, 0.2 % RMS are left" in use) == is_told


def test_a_verdict_is_short():
    """Four estimators and four panels of the paper, each on three groups of slopes."""
    whisks = {
        name: [] for name in ("no_slip", "with_friction", "frictionless", "corrected", FITTED)
    }
    for name, mine in whisks.items():
        for surface in "abcd":
            mine += [judged(beta, 5.0, surface, name) for beta in SLOPES_DEG]
    assert len(lines_of(*(accuracy(mine, 16) for mine in whisks.values()))) <= 12
