"""The contact of an estimate: deflection and slip, their sigmas against sampled ones, and what moves with the touch."""

from dataclasses import replace

import numpy as np
import pytest

from estimator import builtin, slip
from estimator.beam import Beam
from estimator.contact_state import contact_of, deflection
from estimator.contact_state import slip as slip_of
from estimator.whisk import Estimate, EstimatorSettings, Whisk

BEAM = Beam.from_modulus(60.0, 1.0, 100.0)
CONE = replace(BEAM, shape="cone")
THETA, ALPHA, BETA, D_X = np.radians(3.0), np.radians(10.5), np.radians(50.0), 60.0


def whisk_of(m_y, m_z, theta=THETA, covariance=None, theta_sigma=1e-3, mixed=(0.0, 0.0)) -> Whisk:
    covariance = 4e-4 * np.eye(2) if covariance is None else covariance
    return Whisk(
        *(np.zeros(0),) * 4, theta, m_y, m_z, covariance, theta_sigma, BEAM, np.array(mixed)
    )


@pytest.mark.parametrize("beam", [BEAM, CONE])
def test_deflection_and_slip_make_up_the_push(beam):
    """(20): what the whisker does not bend, it slips: θ d_x = d_y + d_z tan β; and along the surface d_z/cos β."""
    m_y, m_z = slip.moments(beam.as_cylinder_mm(D_X), THETA, BETA, ALPHA, beam.C_Nmm2)
    d_y, d_z = deflection(D_X, THETA, m_y, m_z, beam)
    # to first order in θ: the whisker's own slope is θ²/2 = 0.14 %
    assert d_y * np.cos(THETA) + d_z * np.tan(BETA) == pytest.approx(D_X * THETA, rel=1e-12)
    assert slip_of(D_X, THETA, m_y, m_z, ALPHA) == pytest.approx(d_z / np.cos(BETA), rel=1e-12)
    assert slip_of(D_X, THETA, m_y, m_z, ALPHA) == pytest.approx(
        slip.slip_distance(D_X, THETA, BETA, ALPHA), rel=1e-12
    )


def test_stated_sigmas_are_those_of_drawn_whisks(rng):
    """4000 draws tell a standard deviation to 1.1 %, a covariance to some 3 %; curvature adds 1 %."""
    m = np.array(slip.moments(D_X, THETA, BETA, ALPHA, BEAM.C_Nmm2))
    spread = np.array([[9e-7, 6e-6, 9e-6], [6e-6, 4e-4, 1e-4], [9e-6, 1e-4, 4e-4]])
    settings = EstimatorSettings(ALPHA, np.radians(0.5))
    whisk = whisk_of(
        *m, covariance=spread[1:, 1:], theta_sigma=np.sqrt(spread[0, 0]), mixed=spread[0, 1:]
    )
    said = contact_of(whisk, builtin.with_friction(whisk, settings), settings.alpha_est_sigma_rad)
    draws = rng.multivariate_normal([THETA, *m], spread, size=4000)
    found = []
    for theta, m_y, m_z in draws:
        drawn, alpha = (
            whisk_of(m_y, m_z, theta),
            ALPHA + settings.alpha_est_sigma_rad * rng.standard_normal(),
        )
        estimate = builtin.with_friction(drawn, EstimatorSettings(alpha))
        one = contact_of(drawn, estimate, 0.0)
        found.append((one.d_y_mm, one.d_z_mm, one.slip_mm, estimate.d_x_mm, -theta))
    found = np.array(found)
    stated = said.d_y_sigma_mm, said.d_z_sigma_mm, said.slip_sigma_mm
    assert stated == pytest.approx(found[:, :3].std(axis=0), rel=0.05)
    assert said.touch_covariance_mm_rad == pytest.approx(
        np.cov(found[:, 3], found[:, 4])[0, 1], rel=0.15
    )


def test_an_estimate_without_a_gradient_errs_on_its_own():
    whisk = whisk_of(
        *slip.moments(D_X, THETA, BETA, ALPHA, BEAM.C_Nmm2),
        covariance=1e-12 * np.eye(2),
        theta_sigma=0.0,
    )
    said = contact_of(whisk, Estimate(D_X, 0.6, alpha_est_rad=ALPHA), 0.0)
    assert said.slip_sigma_mm == pytest.approx(said.slip_mm * 0.01, rel=1e-6)
    assert said.d_y_sigma_mm == pytest.approx(
        said.d_y_mm * 0.02, rel=1e-6
    )  # by the square of the distance
    assert said.touch_covariance_mm_rad == 0.0


def test_no_distance_no_contact():
    said = contact_of(whisk_of(1.0, 2.0), Estimate(np.nan, np.nan, "no push"), 0.1)
    assert np.isnan([said.d_y_mm, said.slip_sigma_mm]).all()


def test_without_an_assumed_friction_there_is_no_slip():
    said = contact_of(whisk_of(1.0, 2.0), Estimate(D_X, 0.6), 0.0)
    assert np.isnan(said.slip_mm) and np.isfinite(said.d_z_sigma_mm)
