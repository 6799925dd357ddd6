"""Curvature of an object from successive contacts: Appendix B's own moments, and simulated bars of known diameter."""

import csv

import numpy as np
import pytest

from bench.analyses.curved import curved
from bench.analyses.turning_phi import sure_turns, turn, with_turn
from bench.base.settings import Settings
from bench.base.statuses import reason
from bench.records.trial_result import EstimateRow, FeltAt
from bench.rig.simulation import simulate
from bench.session.whisker import Whisker
from bench.workflows.session_evaluation import evaluate
from estimator import curvature
from tests.scenes.rig_sessions import protocol_file
from vision.truth.value import Value

WHISKER = Whisker(shape="cylinder", length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
D_X, ALPHA, THETAS = 60.0, np.radians(10.0), np.radians([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0])
PROTOCOL = """
name = "thick"
bar_diameter_mm = 30.0
[motor]
before_deg = 3.0
after_deg = 12.6
[gauges]
known = true
[[trials]]
beta_deg = [0, 20, 30]
d_x_mm = 40.0
"""


def felt_on_circle(r_n: float, beta_0: float, sigma: float = 1e-4) -> list[FeltAt]:
    """Moments of Appendix B with the exact φ."""
    scale = WHISKER.C_Nmm2 / D_X
    rows = []
    for theta in THETAS:
        phi, d = curvature.exact(r_n, theta, beta_0, ALPHA)
        m_y = scale * d * np.sin(phi)
        m_z = scale * d * np.cos(phi)
        moments = Value(m_y, sigma), Value(m_z, sigma)
        rows.append(FeltAt(float(theta), *moments, 1e-4, sigma**2 * np.eye(2), np.zeros(2)))
    return rows


@pytest.mark.parametrize("beta_deg", [30.0, -50.0])
@pytest.mark.parametrize("r_n", [2.0, 5.0, 1e6])
def test_lateral_curvature_is_that_of_the_circle(r_n, beta_deg):
    """Third order in θ is left: some (κ_n θ)² of it, 2 % at κ_n = 0.5 and 8°. (24) is off where there is friction."""
    found = curved(felt_on_circle(r_n, np.radians(beta_deg)), WHISKER, ALPHA, 0.0)
    assert found.lateral_per_mm.value == pytest.approx(1 / (r_n * D_X), rel=0.03, abs=1e-6)
    assert np.degrees(abs(found.phi_0_rad.value)) == pytest.approx(abs(beta_deg) - 10.0, abs=0.05)
    if r_n < 1e3:
        assert found.lateral_printed_per_mm < 0.9 * found.lateral_per_mm.value


def test_moments_without_noise_do_not_tell_how_phi_turns():
    """Of channels that are rounded so far that the free stroke shows one value."""
    assert not turn(felt_on_circle(2.0, np.radians(30.0), sigma=0.0)).is_known


def test_the_sigma_of_the_rate_is_its_scatter(rng):
    """200 draws tell a standard deviation to 5 %; three of these."""
    sigma, exact = 0.01, felt_on_circle(4.0, np.radians(40.0), 0.01)
    found = []
    for _ in range(200):
        drawn = [
            FeltAt(
                at.theta_rad,
                Value(at.m_y_Nmm.value + sigma * rng.normal(), sigma),
                Value(at.m_z_Nmm.value + sigma * rng.normal(), sigma),
                1e-4,
                at.covariance_at,
                np.zeros(2),
            )
            for at in exact
        ]
        found.append(curved(drawn, WHISKER, ALPHA, 0.0))
    leaning = (
        0.5
        * np.cos(np.radians(40.0))
        * np.tan(np.radians(5.0))
        * np.cos(ALPHA)
        / np.sin(np.radians(30.0))
        / D_X
    )
    stated = np.sqrt(np.mean([c.lateral_per_mm.sigma**2 for c in found]) - leaning**2)
    assert np.std([c.lateral_per_mm.value for c in found]) == pytest.approx(stated, rel=0.2)


def test_a_short_push_does_not_tell():
    found = curved(felt_on_circle(2.0, 0.5)[:4], WHISKER, ALPHA, 0.0)
    assert (
        found.status.codes == ("angles_few",)
        and np.isnan([found.radius_mm.value, found.lateral_per_mm.value]).all()
    )


def curvatures(folder, text: str) -> list[dict]:
    """The rows of curvature.csv of a protocol, simulated and evaluated."""
    session = simulate(
        folder / "session", protocol=protocol_file(folder, text), signals_only=True, seed=2
    )
    evaluate(session, folder / "out", Settings(), workers=0)
    with (folder / "out" / "curvature.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def felt_on_ball(folder, diameter_mm: str, beta_deg: str) -> list[dict]:
    """The same of a ball, 60 mm away."""
    ball = 'd_x_mm = 60.0\nobject = "sphere"\n'
    text = (
        PROTOCOL.replace("d_x_mm = 40.0\n", ball)
        .replace("30.0", diameter_mm)
        .replace("[0, 20, 30]", beta_deg)
    )
    return curvatures(folder, text)


def test_the_radius_of_a_thick_bar_is_felt(tmp_path):
    rows = curvatures(tmp_path, PROTOCOL)
    for row in rows:
        radius, sigma = float(row["radius_mm"]), float(row["radius_sigma_mm"])
        assert (
            sigma < 12.0 and abs(radius - 15.0) < 2 * sigma
        )  # by a lean of 5° that nobody excludes
        assert float(row["bar_radius_mm"]) == 15.0
    held, *slipping = rows
    assert held["lateral_per_mm"] == "" and held["status"] == reason("no_lateral_slip")
    for row in slipping:
        assert abs(float(row["lateral_per_mm"])) < 2 * float(row["lateral_sigma_per_mm"])


def test_the_radius_of_a_ball_is_within_what_is_said_of_it(tmp_path):
    """There φ turns as the contact slips, and (10) falls short for that, too: at 40° on one of 80 mm by twice as much
    as for the rolling."""
    for row in felt_on_ball(tmp_path, "80.0", "[30, 40, 50]"):
        assert abs(float(row["radius_mm"]) - 40.0) < 2 * float(row["radius_sigma_mm"])
        assert float(row["lateral_per_mm"]) > 2 * float(row["lateral_sigma_per_mm"])


def test_of_a_slip_angle_that_turns_far_the_first_angles_tell(tmp_path):
    """On a ball of 40 mm φ doubles over 12°: by all angles the radius was 7 sigma off, and lateral curvature 8."""
    for row in felt_on_ball(tmp_path, "40.0", "[20, 30, 40]"):
        assert int(row["angles"]) < 9
        assert abs(float(row["radius_mm"]) - 20.0) < 2 * float(row["radius_sigma_mm"])
        assert abs(float(row["lateral_per_mm"]) - 0.049) < 2 * float(row["lateral_sigma_per_mm"])


@pytest.mark.parametrize("r_n, told", [(1.0, True), (1e6, False)])
def test_an_estimate_against_what_turns_the_slip_angle_says_so(r_n, told):
    """At κ_n = 1 φ turns by about sin β_0 a radian, 2° at θ = 3°, of which (10) knows nothing: 2 % of d_x."""
    felt = felt_on_circle(r_n, np.radians(40.0), 0.005)
    (at,) = (one for one in felt if one.theta_rad == THETAS[2])
    ends = {"d_x_est_low_mm": D_X - 1.0, "d_x_est_high_mm": D_X + 1.0}
    row = EstimateRow("with_friction", Value(D_X, 0.5), alpha_est_rad=ALPHA, **ends)
    turns = (
        float(np.arctan2(at.m_y_Nmm.value, at.m_z_Nmm.value)),
        turn(felt),
        at.theta_rad,
        D_X + 1.5,
    )
    (is_sure,) = sure_turns([turns[0]], [turns[1]], ALPHA)
    assert is_sure == told
    said = with_turn(row, *turns, is_sure=is_sure)
    assert ("phi_turns" in said.status.codes) == told
    two_percent = np.hypot(0.5, 0.02 * D_X)
    assert said.d_x_est_mm.sigma == pytest.approx(
        two_percent if told else 0.5, rel=0.25 if told else 0.01
    )
    assert (
        said.d_x_est_low_mm < D_X - 2.0
        if told
        else said.d_x_est_low_mm == pytest.approx(D_X - 1.0, rel=0.001)
    )
    assert said.d_x_est_high_mm == pytest.approx(D_X + (1.5 if told else 1.0), rel=0.001)
    unsure = EstimateRow("with_friction", Value(D_X, 10.0), alpha_est_rad=ALPHA)
    assert with_turn(unsure, *turns, is_sure=is_sure).status == ""
    nearer = EstimateRow(
        "with_friction", Value(np.nan, np.nan), ALPHA, d_x_est_low_mm=0.0, d_x_est_high_mm=20.0
    )
    assert with_turn(nearer, *turns, is_sure=is_sure) is nearer
