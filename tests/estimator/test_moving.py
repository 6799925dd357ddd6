"""An object that moves as told: exact mechanics give the distance back, and what nobody can tell is said."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.beam import Beam
from estimator.builtin import with_friction
from estimator.moving import MOTION_UNKNOWN, RUNS_AWAY, held, known_motion
from estimator.whisk import EstimatorSettings, ObjectMotion, Whisk
from tests.studies.accuracy.moving import errors_percent

BEAM = Beam.from_modulus(60.0, 1.0, 100.0)
TOLD = EstimatorSettings(np.radians(10.0), np.radians(4.0), 3.5, np.radians(5.0))


def whisk(per_rad_mm=(0.0, 0.0, 0.0), m_y=2.4, m_z=6.0, told_sigma_mm=0.0):
    motion = ObjectMotion(np.array(per_rad_mm), told_sigma_mm**2 * np.eye(3))
    felt = (np.radians(3.0), m_y, m_z, 1e-6 * np.eye(2), 1e-4, BEAM)
    return Whisk(*(np.zeros(0),) * 4, *felt, object_motion=motion)


@pytest.mark.parametrize("beta_deg, share", [(0.0, -0.3), (30.0, 0.3), (60.0, 0.2)])
def test_exact_mechanics_give_the_distance_back(beta_deg, share):
    """To what (10) leaves out of a standing object, 0.4 % at 3°; (10) is wrong by share/(1 − share)."""
    errors = errors_percent(beta_deg, share)
    assert abs(errors["known_motion"]) < 0.4
    assert errors["with_friction"] == pytest.approx(100 * share / (1 - share), abs=1.0)


def test_an_object_that_stands_is_that_of_10():
    estimate, ten = known_motion(whisk(), TOLD), with_friction(whisk(), TOLD)
    assert estimate.d_x_mm == pytest.approx(ten.d_x_mm, rel=1e-9)
    assert estimate.beta_rad == pytest.approx(ten.beta_rad)
    assert (estimate.low_mm, estimate.high_mm) == pytest.approx((ten.low_mm, ten.high_mm), rel=0.01)


def test_a_contact_that_sticks_goes_with_the_object():
    """C θ (1 − u_y/x) = m_z x on a cylinder, d_x = x − u_x θ."""
    u, theta = np.array([5.0, 12.0, 0.0]), 0.05
    d_x = held(theta, 0.0, 6.0, u, BEAM).d_x_mm
    x = d_x + u[0] * theta
    assert BEAM.C_Nmm2 * theta * (1 - u[1] / x) == pytest.approx(6.0 * x)
    assert np.isnan(known_motion(whisk((0.0, 12.0, 0.0), m_y=0.0), TOLD).beta_rad)


def test_an_object_that_runs_away_is_felt_alike_at_two_distances():
    estimate = known_motion(whisk((0.0, 15.0, 0.0)), TOLD)
    other = float(estimate.status.split()[1])
    assert other < estimate.d_x_mm and estimate.status.code == "two_distances"
    assert other * estimate.d_x_mm == pytest.approx(
        15.0 * with_friction(whisk(), TOLD).d_x_mm, rel=0.01
    )


def test_how_well_the_speed_is_known_is_in_the_sigma():
    """With no other cause: ∂d_x/∂u_y at u = 0 is −1 on a cylinder, friction across included."""
    alone = EstimatorSettings(TOLD.alpha_est_rad)
    narrow, wide = (known_motion(whisk(told_sigma_mm=s), alone).sigma_mm for s in (0.0, 0.5))
    assert 0.5 <= np.sqrt(wide**2 - narrow**2) < 1.0


def test_what_has_no_distance_says_why():
    assert known_motion(replace(whisk(), object_motion=None), TOLD).status == MOTION_UNKNOWN
    assert known_motion(whisk((0.0, 40.0, 0.0)), TOLD).status == RUNS_AWAY
    assert known_motion(whisk(m_z=-1.0), TOLD).status.code == "not_pushing"
