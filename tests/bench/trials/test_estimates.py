"""Channels to moments: turned follicles, covariances, and the answers' columns."""

from dataclasses import replace

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.gauges.drift import allow_drift
from bench.gauges.felt import FeltStroke, gauge_delay
from bench.gauges.matrix import GaugeMatrix
from bench.trials.estimates import as_felt, own_estimators, run_estimator, run_estimators
from bench.trials.readout import Readout, felt_whisk
from estimator import slip
from estimator.beam import Beam
from estimator.builtin import ESTIMATORS, with_friction
from estimator.whisk import Estimate, Whisk
from vision.geometry.reasons import as_reason

MATRIX = np.array([[11.3, 0.32], [-0.25, 10.5]])
BEAM = Beam(8835.7, 100.0)
THETA, BETA, ALPHA = np.radians([3.0, 60.0, 10.0])


def stroke(rng, d_x=60.0, noise=1e-3, roll=0.0) -> FeltStroke:
    """A stroke of the small-angle theory (13), (14) at 10°/s, in volts of a turned follicle."""
    time = np.arange(1240) / 2000.0
    motor = np.radians(10.0) * time + 0.02
    theta = np.maximum(0.0, motor - 0.02 - np.radians(1.6))
    m_y, m_z = slip.moments(d_x, 1.0, BETA, ALPHA, BEAM.C_Nmm2)
    c, s = np.cos(roll), np.sin(roll)
    follicle = np.outer(theta, np.array([[c, s], [-s, c]]) @ [m_y, m_z])
    volts = np.linalg.solve(MATRIX, follicle.T).T + 0.2 + noise * rng.normal(size=follicle.shape)
    return FeltStroke(time, motor, volts, volts)


@pytest.mark.parametrize("roll_deg", [0.0, 90.0, -30.0])
def test_a_turned_follicle_feels_the_same_whisk(rng, roll_deg):
    """Noise of 1 mV is 0.01 N·mm a sample, some 200 of them: 1e-3 N·mm."""
    readout = Readout(GaugeMatrix(MATRIX), np.radians(roll_deg))
    _, whisk = felt_whisk(stroke(rng, roll=np.radians(roll_deg)), readout, np.zeros(2), BEAM, THETA)
    expected = slip.moments(60.0, THETA, BETA, ALPHA, BEAM.C_Nmm2)
    assert (whisk.m_y_at_Nmm, whisk.m_z_at_Nmm) == pytest.approx(expected, abs=0.01)


def test_answers_carry_what_they_assumed(rng):
    touch, whisk = felt_whisk(stroke(rng), Readout(GaugeMatrix(MATRIX)), np.zeros(2), BEAM, THETA)
    rows = {
        row.estimator: row
        for row in run_estimators(whisk, ESTIMATORS, Settings(alpha_est_deg=10.0))
    }
    assert np.isnan([rows["no_slip"].alpha_est_rad, rows["no_slip"].beta_est_rad]).all()
    assert rows["frictionless"].alpha_est_rad == 0.0
    assert rows["with_friction"].d_x_est_mm.value == pytest.approx(60.0, rel=5e-3)
    assert np.degrees(rows["with_friction"].beta_est_rad) == pytest.approx(60.0, abs=0.2)
    felt = as_felt(0, touch, whisk, 0.17, gauge_delay(None))
    assert np.degrees(felt.phi_felt_rad.value) == pytest.approx(50.0, abs=0.2)


def test_sigma_of_10_is_its_scatter(rng):
    """Over 200 strokes the sampled standard deviation scatters by 5 %; the stated one averages over them."""
    stated, found = [], []
    for _ in range(200):
        _, whisk = felt_whisk(
            stroke(rng, noise=0.01), Readout(GaugeMatrix(MATRIX)), np.zeros(2), BEAM, THETA
        )
        row = run_estimators(whisk, {"with_friction": ESTIMATORS["with_friction"]}, Settings())[0]
        stated.append(row.d_x_est_sigma_alpha_exact_mm)
        found.append(row.d_x_est_mm.value)
    assert np.mean(stated) == pytest.approx(np.std(found), rel=0.25)


def test_gauges_and_turn_add_to_the_moments_covariance():
    volts = np.array([0.3, 0.7])
    readout = Readout(GaugeMatrix(MATRIX, 1e-2 * np.eye(4)), 0.0, np.radians(1.0))
    added = readout.covariance(volts, np.zeros((2, 2)))
    m_y, m_z = MATRIX @ volts
    turn = np.radians(1.0) * np.array([-m_z, m_y])
    assert added == pytest.approx(1e-2 * (volts @ volts) * np.eye(2) + np.outer(turn, turn))


def test_what_whisks_share_is_the_part_of_gauges_and_turn():
    """Channels that are exact leave nothing but these; a whisk twice as strong has twice the change, cause by cause."""
    spread = np.diag([0.02, 0.01, 0.03, 0.02]) ** 2
    readout = Readout(GaugeMatrix(MATRIX, spread), np.radians(20.0), np.radians(0.5), True)
    channels = np.array([0.3, 0.8])
    weak, strong = (
        Whisk(
            *(np.zeros(0),) * 4,
            THETA,
            *(k * readout.matrix @ channels),
            np.zeros((2, 2)),
            0.0,
            BEAM,
        )
        for k in (1.0, 2.0)
    )
    shared = readout.shared_Nmm(weak)
    assert np.allclose(shared.T @ shared, readout.covariance(channels, np.zeros((2, 2))))
    assert np.allclose(readout.shared_Nmm(strong), 2.0 * shared)


def test_sigma_of_10_holds_how_thick_the_object_is_said_to_be(rng):
    """−θ R/d_x cos β (½ − ⅛) at R = 20.5 mm: 0.34 % of d_x at β = 60°, beyond all else of this whisk."""
    _, whisk = felt_whisk(
        stroke(rng, noise=1e-5), Readout(GaugeMatrix(MATRIX)), np.zeros(2), BEAM, THETA
    )
    untold, thin, thick = (
        run_estimator(
            "with_friction", with_friction, whisk, ALPHA, 0.0, (radius, 0.5)
        ).d_x_est_mm.sigma
        for radius in (np.nan, 3.0, 20.0)
    )
    assert untold == pytest.approx(thin)
    rolling = 60.0 * THETA * 0.375 * np.cos(BETA) / 60.0
    assert np.sqrt(thick**2 - thin**2) == pytest.approx(
        rolling * np.sqrt(20.5**2 - 3.5**2), rel=0.02
    )


def test_no_touch_is_a_reason(rng):
    free = stroke(rng)
    silent = FeltStroke(
        free.time_s, free.motor_rad, *[0.01 * rng.normal(size=free.channels.shape)] * 2
    )
    touch, reason = felt_whisk(silent, Readout.bare(), np.zeros(2), BEAM, THETA)
    assert (
        "no_rise" in as_reason(reason).codes
        and allow_drift(touch, np.zeros(2), 0.17).status == touch.status
    )
    assert np.isnan(as_felt(0, touch, None, 0.17, gauge_delay(None)).touch_felt_rad.value)


@pytest.mark.parametrize("name", ["nowhere:f", "math:no_such", "math:pi", "math"])
def test_estimators_that_cannot_be_had(name):
    with pytest.raises(BadInput, match=name):
        own_estimators((name,))


def test_an_answer_must_be_an_estimate(rng):
    _, whisk = felt_whisk(stroke(rng), Readout(GaugeMatrix(MATRIX)), np.zeros(2), BEAM, THETA)
    with pytest.raises(BadInput, match="must return an Estimate"):
        run_estimators(whisk, {"mine:f": lambda *_: 60.0}, Settings())


def test_an_estimator_that_fails_on_a_whisk_is_a_row_that_says_so(rng):
    def fails(*_):
        raise ZeroDivisionError("no slope")

    _, whisk = felt_whisk(stroke(rng), Readout(GaugeMatrix(MATRIX)), np.zeros(2), BEAM, THETA)
    row = next(
        r for r in run_estimators(whisk, {"mine:f": fails}, Settings()) if r.estimator == "mine:f"
    )
    assert np.isnan(row.d_x_est_mm.value) and row.status.codes == ("estimator_raised",)


def asked(rng, function) -> dict:
    """The row of one's own estimator on a whisk at 60 mm."""
    _, whisk = felt_whisk(stroke(rng), Readout(GaugeMatrix(MATRIX)), np.zeros(2), BEAM, THETA)
    return run_estimators(whisk, {"mine:f": function}, Settings())[0]


@pytest.mark.parametrize(
    "d_x, sigma, code",
    [
        (np.inf, 1.0, "distance_impossible"),
        (-5.0, 1.0, "distance_impossible"),
        (np.nan, 1.0, "no_distance_given"),
        ("far", 1.0, "no_distance_given"),
    ],
)
def test_what_is_no_distance_is_a_missing_one_with_a_status(rng, d_x, sigma, code):
    row = asked(rng, lambda *_: Estimate(d_x, sigma))
    assert np.isnan([row.d_x_est_mm.value, row.d_x_est_mm.sigma]).all() and row.status.codes == (
        code,
    )


@pytest.mark.parametrize("sigma", [0.0, -1.0, np.nan, np.inf])
def test_a_distance_without_a_sigma_is_told(rng, sigma):
    row = asked(rng, lambda *_: Estimate(60.0, sigma))
    assert row.d_x_est_mm.value == 60.0 and np.isnan(row.d_x_est_mm.sigma)
    assert row.status.codes == ("sigma_impossible",)


def test_past_a_cones_point_there_is_no_contact(rng):
    """And no warning: what bends there is infinitely thin."""
    whisk = replace(
        felt_whisk(stroke(rng), Readout(GaugeMatrix(MATRIX)), np.zeros(2), BEAM, THETA)[1],
        beam=Beam(8835.7, 100.0, "cone"),
    )
    row = run_estimators(whisk, {"mine:f": lambda *_: Estimate(130.0, 1.0)}, Settings())[0]
    assert "past_whisker" in row.status.codes and np.isnan(row.d_y_est_mm.value)


def test_past_the_length_is_told_and_left(rng):
    row = asked(rng, lambda *_: Estimate(130.0, 1.0))
    assert row.d_x_est_mm.value == 130.0 and row.status.codes == ("past_whisker",)


def test_what_an_estimator_never_used_does_not_stand_beside_it(rng):
    row = asked(rng, lambda *_: Estimate(60.0, 1.0))
    assert np.isnan(row.alpha_est_rad) and np.isnan(row.beta_est_rad) and row.status == ""
    row = asked(rng, lambda *_: Estimate(60.0, 1.0, beta_rad=0.5))
    assert row.beta_est_rad == 0.5


def test_an_estimator_cannot_spoil_the_whisk_of_the_next(rng):
    def vandal(whisk, _):
        whisk.m_z_Nmm[:] = 0.0
        return Estimate(60.0, 1.0)

    row = asked(rng, vandal)
    assert row.status.codes == ("estimator_raised",) and np.isnan(row.d_x_est_mm.value)


def test_a_deflection_of_ones_own_stands_and_is_held_to_its_word(rng):
    given = {"deflection_mm": (2.0, 1.0), "deflection_sigma_mm": (0.1, 0.2)}
    row = asked(rng, lambda *_: Estimate(60.0, 1.0, **given))
    stands = [number for of in (row.d_y_est_mm, row.d_z_est_mm) for number in (of.value, of.sigma)]
    assert stands == [2.0, 0.1, 1.0, 0.2] and row.status == ""
    for name, wrong in (("sigma_", None), ("", (2.0, np.nan)), ("sigma_", (0.1, 0.0))):
        spoilt = given | {f"deflection_{name}mm": wrong}
        row = asked(rng, lambda *_, spoilt=spoilt: Estimate(60.0, 1.0, **spoilt))
        assert row.status.codes == ("deflection_impossible",) and row.d_y_est_mm.value != 2.0
