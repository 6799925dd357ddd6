"""The exact rod's estimate against (10) at small angles, the rig's exact mechanics, and where it has none."""

import numpy as np
import pytest

from estimator import slip
from estimator.beam import Beam
from estimator.builtin import exact_rod, with_friction
from estimator.exact_rod import Reach, contact_by_exact_rod
from estimator.whisk import Estimate, EstimatorSettings, Whisk
from tests.scenes.curved_pushes import NITINOL, PROFILED, CurvedPush, feel, whisker_of

NOTHING = Reach(0.0, 0.0)


@pytest.mark.parametrize("shape", ["cylinder", "cone"])
@pytest.mark.parametrize("beta_deg, alpha_deg", [(0.0, 0.0), (40.0, 10.5), (-70.0, 12.0)])
def test_at_small_angles_it_is_equation_10(shape, beta_deg, alpha_deg):
    """A line on a thin bar: both differ by the order of θ², 1e-6 here, and by 1e-7 of a march in few steps."""
    beam = Beam.from_rigidity(2945.0, 100.0, shape)
    theta = 1e-3
    alpha = np.radians(alpha_deg)
    d = beam.as_cylinder_mm(60.0)
    felt = slip.moments(d, theta, np.radians(beta_deg), alpha, beam.C_Nmm2)
    found = contact_by_exact_rod((theta, *felt, alpha), beam, NOTHING, False)
    assert found.d_x_mm == pytest.approx(60.0, rel=1e-5)
    assert found.beta_rad == pytest.approx(np.radians(beta_deg), abs=1e-5)


def answered(push: CurvedPush, estimator) -> tuple[Estimate, float]:
    """Return the estimate from exact moments and the true friction angle, and the true d_x."""
    felt = feel(push)
    noise = 1e-4 * np.linalg.norm(felt.moments_Nmm)
    beam = whisker_of(push.rod).beam
    theta = np.radians(push.theta_deg)
    whisk = Whisk.without_samples(theta, felt.moments_Nmm, noise**2 * np.eye(2), beam)
    settings = EstimatorSettings(
        np.arctan(push.friction),
        0.02,
        object_reach_mm=5.0,
        tilt_sigma_rad=0.03,
        object_radius_mm=push.bar_radius_mm,
        whisker_radius_mm=0.5 * push.rod.diameter_mm,
    )
    return estimator(whisk, settings), felt.d_x_mm


@pytest.mark.parametrize("beta_deg", [0.0, 40.0, -60.0])
@pytest.mark.parametrize("theta_deg", [3.0, 12.0])
def test_without_friction_it_inverts_the_rig_s_mechanics(beta_deg, theta_deg):
    """To 5e-5 of d_x on a vibrissa, where (10) is off by 0.05 to 1.5 %."""
    push = CurvedPush(beta_deg=beta_deg, theta_deg=theta_deg, friction=0.0)
    found, d_x = answered(push, exact_rod)
    assert found.d_x_mm == pytest.approx(d_x, rel=5e-5)
    ten, _ = answered(push, with_friction)
    assert abs(ten.d_x_mm / d_x - 1) > 4e-4


@pytest.mark.parametrize("beta_deg", [0.0, 40.0])
def test_of_measured_diameters_it_inverts_the_rig_s_mechanics(beta_deg):
    """To 5e-5 of d_x, as for a cone."""
    push = CurvedPush(rod=PROFILED, beta_deg=beta_deg, theta_deg=6.0, friction=0.0)
    found, d_x = answered(push, exact_rod)
    assert found.d_x_mm == pytest.approx(d_x, rel=5e-5)


@pytest.mark.parametrize("beta_deg", [0.0, 30.0, 50.0, 70.0])
def test_with_friction_it_is_within_its_interval_at_large_angles(beta_deg):
    push = CurvedPush(rod=NITINOL, d_x_mm=60.0, beta_deg=beta_deg, theta_deg=15.0)
    found, d_x = answered(push, exact_rod)
    assert found.status == ""
    assert found.low_mm < d_x < found.high_mm
    assert abs(found.d_x_mm - d_x) < found.sigma_mm
    assert found.d_x_mm == pytest.approx(d_x, rel=4e-3)


def test_its_gradient_is_that_of_its_distance():
    push = CurvedPush(beta_deg=40.0)
    felt = feel(push)
    beam = whisker_of(push.rod).beam
    at = np.array([np.radians(3.0), *felt.moments_Nmm, 0.28])
    reach = Reach(1.0, 0.1)
    gradient = contact_by_exact_rod(tuple(at.tolist()), beam, reach, False).gradient
    for k, step in enumerate(np.diag(1e-3 * np.abs(at))):
        ends = [
            contact_by_exact_rod(tuple((at + sign * step).tolist()), beam, reach, False).d_x_mm
            for sign in (1, -1)
        ]
        assert gradient[k] == pytest.approx((ends[0] - ends[1]) / (2 * step[k]), rel=1e-4)


def test_moments_of_no_bent_rod_have_no_distance():
    """(10) has 60 mm; by a push of 80° no rod has these."""
    beam = Beam.from_rigidity(2945.0, 100.0)
    theta = np.radians(80.0)
    felt = slip.moments(60.0, theta, 1.2, 0.3, beam.C_Nmm2)
    whisk = Whisk.without_samples(theta, felt, 1e-6 * np.eye(2), beam)
    settings = EstimatorSettings(0.3)
    assert with_friction(whisk, settings).d_x_mm == pytest.approx(60.0)
    found = exact_rod(whisk, settings)
    assert np.isnan(found.d_x_mm) and found.status.code == "rod_unconverged"
