"""The design of least worst error: its formulas against the rig and the estimators, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.commands import cli
from bench.theory.best_design import (
    Design,
    DesignJob,
    Equipment,
    Region,
    best_design,
    expected_error,
    faults,
    worst_percent,
)
from bench.theory.design_map import exact_percent, find_design, write_design
from bench.theory.sample_noise import stroke_noise
from estimator.beam import Beam

REGION, EQUIPMENT, PAPER = Region((20.0, 60.0), (5.0, 15.0), (30.0, 80.0)), Equipment(), Design()
JOB = DesignJob(REGION, EQUIPMENT)
HELD = {
    "theta_deg": (3.0, 3.0),
    "alpha_est_deg": (10.0, 10.0),
    "diameter_mm": (1.0, 1.0),
    "length_mm": (100.0, 100.0),
    "taper": (0.0, 0.0),
    "tilt_deg": (0.0, 0.0),
}


@pytest.mark.parametrize(
    "design", [PAPER, Design(2.0, 5.0, 1.5, 110.0, 0.8, 40.0), Design(4.0, 12.0, 0.6, 85.0, 1.0)]
)
def test_the_bias_is_that_of_exact_mechanics(design):
    """At the region's corners to 0.5 % of d_x: what (10) leaves out is known to first order, and where β is little
    above α friction acts along the whisker, too (docs/rig.md)."""
    corners = REGION.corners()
    predicted = expected_error(design, JOB, corners).bias_percent
    exact = [exact_percent(design, JOB, corner) for corner in corners.T]
    assert predicted == pytest.approx(exact, abs=0.5)
    assert np.ptp(exact) > 1.0


def test_the_tilt_of_least_error_is_the_middle_of_the_slopes():
    found, worst = best_design({**HELD, "tilt_deg": (-60.0, 60.0)}, JOB)
    assert found.tilt_deg == pytest.approx(40.0, abs=0.5)
    assert worst < 0.5 * best_design(HELD, JOB)[1]


def test_the_best_is_no_worse_than_any_on_a_grid():
    _, worst = best_design({**HELD, "alpha_est_deg": (0.0, 30.0)}, JOB)
    others = [replace(PAPER, alpha_est_deg=alpha) for alpha in np.linspace(0.0, 30.0, 61)]
    assert worst <= min(worst_percent(other, JOB) for other in others) + 1e-6


def test_noise_of_a_stroke_goes_with_one_sample_and_the_root_of_their_number():
    plain, loud, slow = (
        stroke_noise(0.05, one, rate, 10.0) for one, rate in ((0.1, 2e3), (0.2, 2e3), (0.1, 8e3))
    )
    assert (loud.touch_Nmm, loud.moment_Nmm) == pytest.approx(
        (2 * plain.touch_Nmm, 2 * plain.moment_Nmm)
    )
    assert (slow.touch_Nmm, slow.moment_Nmm) == pytest.approx(
        (plain.touch_Nmm / 2, plain.moment_Nmm / 2)
    )
    # a mean over 1° of 200 samples a degree, above a level of 1.4°
    assert plain.moment_Nmm == pytest.approx(0.1 * np.hypot(200**-0.5, 280**-0.5), rel=0.01)


@pytest.mark.parametrize("length_mm, tip_mm, base_mm", [(0.5, 0, 0), (0, 0.02, 0), (0, 0, 0.02)])
def test_sizes_entered_wrong_by_a_sigma_move_the_distance_by_its_sigma(length_mm, tip_mm, base_mm):
    """To first order: an error of a hundredth is off by as much of itself."""
    design = Design(taper=0.7, length_mm=110.0, diameter_mm=2.0)
    length, base, tip = 110.0, 2.0, 0.6
    true = Beam.from_rigidity(1.0, length, "tapered", tip / base)
    entered = Beam.from_rigidity(
        1.0, length + length_mm, "tapered", (tip + tip_mm) / (base + base_mm)
    )
    moved = entered.distance_mm(true.as_cylinder_mm(80.0)) / 80.0 - 1.0
    exact = {"length_sigma_mm": 0.0, "diameter_sigma_mm": 0.0}
    point = np.array([[0.0], [0.0], [80.0]])

    def variance(**sigmas):
        equipment = Equipment(**exact | sigmas)
        return expected_error(design, DesignJob(REGION, equipment), point).sigma_percent[0] ** 2

    if length_mm:
        expected = variance(length_sigma_mm=length_mm) - variance()
    else:
        ends = variance(diameter_sigma_mm=0.02) - variance()
        expected = ends * np.array([tip_mm, base_mm * tip / base]).max() ** 2
        expected /= 0.02**2 * (1 + (tip / base) ** 2)
    assert 1e-4 * expected == pytest.approx(moved**2, rel=0.03)


def test_a_drawn_wire_has_no_tolerance_of_its_making():
    rough = replace(EQUIPMENT, length_sigma_mm=5.0, diameter_sigma_mm=1.0)
    errors = []
    for one in (EQUIPMENT, rough):
        errors.append(expected_error(PAPER, DesignJob(REGION, one), REGION.corners()))
    np.testing.assert_array_equal(errors[0].sigma_percent, errors[1].sigma_percent)


def test_what_a_wire_cannot_bear_is_no_design():
    assert faults(PAPER, JOB) == {}
    assert set(faults(replace(PAPER, diameter_mm=3.0), JOB)) == {
        "strain",
        "gauges' range",
    }
    assert set(faults(replace(PAPER, length_mm=80.0), JOB)) == {"length"}
    with pytest.raises(BadInput, match=r"no design .* gauges' range by"):
        best_design({**HELD, "diameter_mm": (3.0, 3.0)}, JOB)


def test_where_10_has_no_distance_there_is_no_design():
    with pytest.raises(BadInput, match="no distance"):
        best_design(
            {**HELD, "alpha_est_deg": (50.0, 50.0)},
            DesignJob(replace(REGION, beta_deg=(70.0, 80.0)), EQUIPMENT),
        )


def test_what_is_written(tmp_path):
    made = find_design({**HELD, "tilt_deg": (0.0, 60.0)}, JOB)
    paths = write_design(tmp_path, made)
    assert [path.name for path in paths] == ["design.txt", "design.csv", "design.png", "design.svg"]
    text = (tmp_path / "design.txt").read_text()
    assert (
        "the paper's whisker" in text
        and "base tilted by 0.0°" in text
        and "exact mechanics" in text
    )
    table = np.genfromtxt(tmp_path / "design.csv", delimiter=",", names=True)
    assert (
        np.isfinite(table["exact_percent"][:8]).all() and np.isnan(table["exact_percent"][8:]).all()
    )
    assert table["bound_percent"].max() == pytest.approx(made.worst_percent, abs=1e-4)


@pytest.mark.parametrize(
    "given, said",
    [
        (["--beta-deg", "60", "20"], "--beta-deg 60 20: give a low and a high end"),
        (["--alpha-deg", "-5", "20"], "--alpha-deg -5 20"),
        (["--d-x-mm", "nan", "80"], "--d-x-mm nan 80"),
        (["--theta-deg", "1", "2", "3"], "--theta-deg 1 2 3"),
        (["--noise-Nmm", "0"], "--noise-Nmm 0: must be positive"),
        (["--length-mm", "50"], "length by"),
    ],
)
def test_bad_input_is_one_line(given, said, tmp_path, capsys):
    usual = [
        "design",
        "--beta-deg",
        "0",
        "30",
        "--alpha-deg",
        "5",
        "15",
        "--d-x-mm",
        "30",
        "80",
        "--theta-deg",
        "3",
    ]
    usual += [
        "--alpha-est-deg",
        "10",
        "--diameter-mm",
        "1",
        "--taper",
        "0",
        "--tilt-deg",
        "0",
        "--out",
        str(tmp_path),
    ]
    assert cli.main([*usual, *given]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1 and not list(tmp_path.iterdir())
