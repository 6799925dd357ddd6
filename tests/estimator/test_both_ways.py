"""A push and its way back: slope, friction and distance by exact mechanics, without α_est."""

from dataclasses import replace

import numpy as np
import pytest

from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.stick_slip import FrictionCoefficients
from bench.rig.whisk_mechanics import WhiskMechanics
from estimator.both_ways import ALIKE, NO_PUSH, there_and_back
from estimator.whisk import EstimatorSettings, Whisk
from tests.studies.accuracy.estimates_montecarlo import rod_and_beam

ROD, BEAM = rod_and_beam("cylinder")
THETA, ALPHA = np.radians([3.0, 10.0])
TOLD = EstimatorSettings(0.0, 0.0, 3.5, np.radians(5.0))


def ways(beta_deg):
    """Both ways' whisks at 3° of a push to 4.6°, with a little noise stated and none in them."""
    place = {
        "d_x_mm": 60.0,
        "beta_rad": np.radians(beta_deg),
        "psi_rad": 0.0,
        "touch_rad": 0.0,
        "radius_mm": 3.0,
    }
    bar = TouchedBar.at_contact(**place, whisker_radius_mm=0.5)
    touch, friction = (
        find_first_touch(ROD, bar, 0.0, 60.0),
        FrictionCoefficients(np.tan(ALPHA), np.tan(ALPHA)),
    )
    end = touch.motor_rad + np.radians(4.6)
    march = WhiskMechanics.run(ROD, bar, friction, touch, end, step_rad=np.radians(0.2), back=True)
    at = np.array([touch.motor_rad + THETA])
    moments = (way.moments_at(at)[0] for way in (march.forward, march.back))
    return [
        Whisk(*(np.zeros(0),) * 4, THETA, *felt, 1e-4 * np.eye(2), 1e-4, BEAM) for felt in moments
    ]


@pytest.mark.parametrize("beta_deg", [30.0, 50.0, 70.0])
def test_they_tell_slope_friction_and_distance(beta_deg):
    """d_x to the 0.5 % that a thick bar and friction along the whisker make at 3°; angles within their sigmas."""
    found = there_and_back(*ways(beta_deg), TOLD)
    assert found.status == "" and found.d_x_mm == pytest.approx(60.0, rel=5e-3)
    assert found.low_mm < 60.0 < found.high_mm
    assert abs(found.beta_rad - np.radians(beta_deg)) < 2 * found.beta_sigma_rad
    assert abs(found.alpha_rad - ALPHA) < 2 * found.alpha_sigma_rad


def test_a_contact_that_never_slips_tells_no_slope():
    assert there_and_back(*ways(0.0), TOLD).status == ALIKE


def test_a_way_without_a_push_is_none():
    there, _ = ways(30.0)
    lost = Whisk(*(np.zeros(0),) * 4, THETA, 0.1, -0.2, 1e-4 * np.eye(2), 1e-4, BEAM)
    assert there_and_back(there, lost, TOLD).status == NO_PUSH


def test_what_both_ways_share_does_not_turn_the_slope():
    """Gauges that are off by a share in both moments change neither direction nor difference of them."""
    there, back = ways(50.0)
    shared = tuple(0.02 * np.array([[w.m_y_at_Nmm, w.m_z_at_Nmm]]) for w in (there, back))
    wide = [
        Whisk(
            *(np.zeros(0),) * 4,
            w.theta_at_rad,
            w.m_y_at_Nmm,
            w.m_z_at_Nmm,
            w.covariance_at + s.T @ s,
            w.theta_sigma_rad,
            BEAM,
        )
        for w, s in zip((there, back), shared)
    ]
    told, untold = (there_and_back(*wide, TOLD, one) for one in (shared, None))
    plain = there_and_back(there, back, TOLD)
    assert told.beta_sigma_rad == pytest.approx(plain.beta_sigma_rad, rel=1e-3)
    assert untold.beta_sigma_rad > 1.2 * plain.beta_sigma_rad
    assert told.sigma_mm > plain.sigma_mm


def test_what_the_angle_back_is_off_by_turns_the_slope():
    """As far as its sigma says: at angles that differ the moments' difference is not friction alone."""
    there, back = ways(50.0)
    off = 1e-3
    surer, unsure, moved = (
        there_and_back(
            there, replace(back, theta_at_rad=THETA + shift, theta_sigma_rad=sigma), TOLD
        )
        for shift, sigma in ((0.0, 0.0), (0.0, off), (off, 0.0))
    )
    more = np.sqrt(unsure.beta_sigma_rad**2 - surer.beta_sigma_rad**2)
    assert abs(moved.beta_rad - surer.beta_rad) > np.radians(1.0)
    assert abs(moved.beta_rad - surer.beta_rad) == pytest.approx(more, rel=0.1)
