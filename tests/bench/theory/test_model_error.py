"""Error of (10) by exact mechanics: cells whose error is known from theory, symmetry, and what is written of them."""

import csv

import numpy as np
import pytest

from bench.base.workers import Workers
from bench.theory import model_error_maps
from bench.theory.model_error import (
    ROD,
    Push,
    errors_percent,
    predicted_percent,
    radius_map,
    tilt_map,
)
from bench.theory.model_error_maps import MAPS, Map, write_map
from estimator.first_order import HELD_SHARE

THIN_MM = 1e-6  # radius of a bar that is nearly a line


def error_percent(push: Push) -> float:
    """Of (10), uncorrected."""
    return errors_percent(push)[0]


@pytest.mark.parametrize(
    "beta_deg, alpha_deg", [(0.0, 0.0), (0.0, 23.3), (30.0, 0.0), (60.0, 10.5), (75.0, 23.3)]
)
def test_error_vanishes_with_the_pushing_angle(beta_deg, alpha_deg):
    """(10) is the first order in θ of the whole problem, whatever the tilt: at 0.05° no coefficient of θ exceeds 5.

    100 · 5 · 8.7e-4 = 0.4 %. The coefficients themselves are those of the next test.
    """
    for psi_deg in (-50.0, 0.0, 50.0):
        assert abs(error_percent(Push(beta_deg, psi_deg, alpha_deg, theta_deg=0.05))) < 0.4


@pytest.mark.parametrize(
    "push",
    [
        Push(60.0, 20.0, 0.0),
        Push(60.0, -20.0, 10.5),
        Push(30.0, 40.0, 15.0),
        Push(75.0, 50.0, 23.3),
        Push(0.0, 40.0, 0.0),
        Push(0.0, 0.0, 0.0, d_x_mm=20.0, bar_radius_mm=20.0),
        Push(45.0, 0.0, 10.5, d_x_mm=30.0, bar_radius_mm=10.0),
        Push(0.0, 0.0, 23.3, bar_radius_mm=THIN_MM),
    ],
)
def test_error_is_the_derived_one_to_first_order(push):
    """What is left is the second order, so half the angle leaves a quarter of it (± 10 % of third order at 0.5°).

    Newton's method solves to 1e-9 of the forces: 1e-7 %, beside remainders of 1e-4 % and more.
    """
    left = []
    for theta_deg in (0.5, 0.25):
        at = Push(**(vars(push) | {"theta_deg": theta_deg}))
        left.append(error_percent(at) - predicted_percent(at))
    assert abs(left[0]) < 5e-3
    assert left[1] == pytest.approx(left[0] / 4, rel=0.1, abs=5e-5)


def test_a_bar_without_radius_and_tilt_leaves_only_the_second_order():
    """At ψ = 0 on a thin bar only the whisker's own radius is left of the first order, and (10) is exact but for it."""
    for beta_deg in (30.0, 60.0, 75.0):
        push = Push(beta_deg, 0.0, 10.5, bar_radius_mm=THIN_MM, theta_deg=0.2)
        own_radius = (
            37.5 * np.radians(0.2) * ROD.diameter_mm / 2 / 60.0 * np.cos(np.radians(beta_deg))
        )
        assert error_percent(push) == pytest.approx(-own_radius, abs=1e-3)


@pytest.mark.parametrize("psi_deg", [-40.0, 25.0])
def test_a_mirrored_bar_gives_the_same_error(psi_deg):
    """The mirror z → −z turns (β, ψ) into (−β, −ψ): the axis keeps pointing up."""
    straight, mirrored = Push(50.0, psi_deg, 10.5), Push(-50.0, -psi_deg, 10.5)
    assert error_percent(straight) == pytest.approx(error_percent(mirrored), abs=1e-6)


def test_error_does_not_depend_on_scale():
    """Distance and radii alike larger by 1.5 are another unit of length (but for the whisker's own radius, 0.25 mm)."""
    small = error_percent(
        Push(40.0, 30.0, 10.5, d_x_mm=40.0, bar_radius_mm=8.0 - ROD.diameter_mm / 2)
    )
    large = error_percent(
        Push(40.0, 30.0, 10.5, d_x_mm=60.0, bar_radius_mm=12.0 - ROD.diameter_mm / 2)
    )
    assert small == pytest.approx(large, abs=1e-4)


def test_a_whisker_that_finds_no_bar_has_no_error():
    assert np.isnan(error_percent(Push(beta_deg=80.0, psi_deg=80.0, d_x_mm=118.0, theta_deg=60.0)))


def test_files_hold_the_cells(tmp_path, monkeypatch):
    def small(pool):
        return tilt_map(pool, beta_deg=np.array([0.0, 40.0]), psi_deg=np.array([-30.0, 30.0]))

    monkeypatch.setitem(MAPS, "tilt", Map(small, "few cells"))
    monkeypatch.setattr(model_error_maps, "Workers", lambda *_: Workers(0))
    paths = write_map("tilt", tmp_path)
    assert [p.name for p in paths] == [
        "error_by_tilt.png",
        "error_by_tilt.svg",
        "error_by_tilt.csv",
    ]
    with paths[2].open(newline="") as file:
        table = list(csv.DictReader(file))
    assert len(table) == 3 * 2 * 2
    row = table[3]
    push = Push(**{name: float(row[name]) for name in Push.__dataclass_fields__})
    assert (push.beta_deg, push.psi_deg, push.alpha_deg) == (40.0, 30.0, 0.0)
    assert float(row["error_percent"]) == pytest.approx(error_percent(push), rel=1e-6)


def test_the_radius_map_grows_towards_thick_bars_near_the_base():
    for panel in radius_map(
        Workers(0), d_x_mm=np.array([20.0, 80.0]), bar_radius_mm=np.array([2.0, 20.0])
    ):
        assert (
            panel.error_percent[1] < 0
        ).all()  # slip towards the base: d_x comes out short, as the paper says
        assert panel.error_percent[1, 0] == panel.error_percent.min()


@pytest.mark.parametrize(
    "push",
    [
        Push(0.0, 0.0, 23.3),
        Push(40.0, 0.0, 0.0, d_x_mm=30.0, bar_radius_mm=10.0),
        Push(50.0, 0.0, 10.5),
        Push(0.0, 0.0, 10.5, d_x_mm=20.0, bar_radius_mm=15.0),
    ],
)
def test_10_corrected_leaves_the_second_order(push):
    """Half the angle leaves a quarter, but for friction of a held contact beyond HELD_SHARE: all of it at β = 0."""
    held = (
        20.0 * (1 - HELD_SHARE) * np.tan(np.radians(push.alpha_deg)) if push.beta_deg == 0 else 0.0
    )
    left = []
    for theta_deg in (0.5, 0.25):
        plain, better = errors_percent(Push(**(vars(push) | {"theta_deg": theta_deg})))
        left.append(better + held * np.radians(theta_deg))
        assert abs(better) < 0.5 * abs(plain)
    assert left[1] == pytest.approx(left[0] / 4, rel=0.15, abs=1e-4)
