"""Active reorientation: where the plane is turned, when it is not, and whether (2) then holds the distance."""

import numpy as np
import pytest

from estimator import slip
from estimator.beam import Beam
from estimator.builtin import no_slip
from estimator.reorientation import STILL_SLIPS, next_turn_rad, reoriented, slip_angle
from estimator.whisk import EstimatorSettings, Whisk

THETA = np.radians(3.0)
D_X_MM = 60.0
NOISE_NMM = 0.05
BEAM = Beam.from_modulus(60.0, 1.0, 100.0)
SETTINGS = EstimatorSettings(np.radians(10.0), np.radians(2.0))


def push(beta_deg, alpha_deg=10.0, noise_Nmm=(0.0, 0.0)):
    """A push by (13) and (14) against a straight bar, its moments off by `noise_Nmm`."""
    moments = slip.moments(D_X_MM, THETA, np.radians(beta_deg), np.radians(alpha_deg), BEAM.C_Nmm2)
    covariance = NOISE_NMM**2 * np.eye(2)
    return Whisk.without_samples(THETA, np.add(moments, noise_Nmm), covariance, BEAM)


@pytest.mark.parametrize("beta_deg", [-70.0, -30.0, 30.0, 70.0])
@pytest.mark.parametrize("alpha_deg", [3.0, 20.0])
def test_one_turn_takes_any_slope_to_the_edge_of_friction(beta_deg, alpha_deg):
    """The turn is β less α, whatever friction the robot assumes: then nothing slips, and (2) is exact."""
    turn_deg = np.degrees(next_turn_rad(push(beta_deg, alpha_deg), SETTINGS))
    assert beta_deg - turn_deg == pytest.approx(np.copysign(alpha_deg, beta_deg), abs=1e-9)
    after = push(beta_deg - turn_deg, alpha_deg)
    assert next_turn_rad(after, SETTINGS) == 0.0
    assert reoriented(after, SETTINGS).d_x_mm == pytest.approx(D_X_MM, rel=1e-12)
    assert no_slip(after, SETTINGS).d_x_mm == pytest.approx(D_X_MM, rel=1e-12)


def test_a_slope_that_friction_holds_turns_nothing():
    assert next_turn_rad(push(9.0), SETTINGS) == 0.0
    assert reoriented(push(9.0), SETTINGS).status == ""


def test_noise_of_the_slip_angle_is_that_of_draws():
    """Its sigma from 4000 draws is known to 1.1 %; four of these are allowed."""
    whisk = push(40.0)
    rng = np.random.default_rng(1)
    draws = [
        slip_angle(push(40.0, noise_Nmm=NOISE_NMM * rng.standard_normal(2)))[0] for _ in range(4000)
    ]
    assert slip_angle(whisk)[1] == pytest.approx(np.std(draws), rel=0.045)


@pytest.mark.parametrize("beta_deg", [12.0, 25.0, 40.0, 60.0])
def test_a_push_that_slips_says_so_and_its_interval_reaches_the_distance(beta_deg):
    whisk = push(beta_deg)
    estimate = reoriented(whisk, SETTINGS)
    assert no_slip(whisk, SETTINGS).d_x_mm > D_X_MM
    assert estimate.low_mm <= D_X_MM <= estimate.high_mm
    assert estimate.status.code == STILL_SLIPS.code


def test_intervals_hold_after_turns_that_noise_leads():
    """Of 400 contacts, in 95 %: between 92.8 and 97.2 by two binomial sigmas."""
    rng = np.random.default_rng(2)
    held = 0
    for _ in range(400):
        beta_deg = rng.uniform(0.0, 70.0)
        alpha_deg = rng.uniform(8.0, 12.0)
        for _ in range(3):
            whisk = push(beta_deg, alpha_deg, NOISE_NMM * rng.standard_normal(2))
            beta_deg -= np.degrees(next_turn_rad(whisk, SETTINGS))
        estimate = reoriented(whisk, SETTINGS)
        held += estimate.low_mm <= D_X_MM <= estimate.high_mm
    assert 371 <= held <= 389


def test_a_whisker_that_does_not_push_is_not_turned():
    whisk = Whisk.without_samples(THETA, (0.1, -1.0), np.eye(2), BEAM)
    assert next_turn_rad(whisk, SETTINGS) == 0.0
    assert np.isnan(reoriented(whisk, SETTINGS).d_x_mm)
