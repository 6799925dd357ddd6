"""A beam of measured diameters against the taper that it may be, quadrature, and the exact rod."""

import numpy as np
import pytest
from scipy.integrate import quad

from estimator.beam import Beam
from estimator.builtin import exact_rod, with_friction
from estimator.profiled_beam import ProfiledBeam
from estimator.whisk import EstimatorSettings, Whisk

WIDTHS = (1.0, -0.35, -0.9, 0.45)
PROFILED = ProfiledBeam.of_widths(9000.0, 100.0, WIDTHS)


def width(share):
    return np.polynomial.polynomial.polyval(share, WIDTHS)


def test_a_taper_by_its_widths_is_that_taper():
    taper = Beam(9000.0, 100.0, "tapered", 0.3)
    same = ProfiledBeam.of_widths(9000.0, 100.0, (1.0, -0.7))
    d_x = np.array([0.1, 5.0, 20.0, 50.0, 80.0, 99.0])
    assert same.tip_share == pytest.approx(0.3, abs=1e-9)
    assert same.as_cylinder_mm(d_x) == pytest.approx(taper.as_cylinder_mm(d_x), rel=1e-8)
    assert same.distance_mm(taper.as_cylinder_mm(d_x)) == pytest.approx(d_x, rel=1e-8)
    assert same.distance_mm(500.0) == pytest.approx(taper.distance_mm(500.0), rel=1e-8)
    assert same.thickness(d_x) == pytest.approx(taper.thickness(d_x), rel=1e-6)


@pytest.mark.parametrize("d_x", [1.3, 17.7, 50.1, 93.3])
def test_its_compliance_is_the_integral(d_x):
    integral, _ = quad(lambda s: (d_x - s) ** 2 / width(s / 100.0) ** 4, 0.0, d_x, epsrel=1e-12)
    assert PROFILED.as_cylinder_mm(d_x) == pytest.approx(3 * integral / d_x**2, rel=1e-8)
    assert PROFILED.distance_mm(PROFILED.as_cylinder_mm(d_x)) == pytest.approx(d_x, rel=1e-8)
    step = 1e-3 * d_x
    response = (
        np.log(PROFILED.as_cylinder_mm(d_x + step) / PROFILED.as_cylinder_mm(d_x - step))
    ) / np.log((d_x + step) / (d_x - step))
    assert PROFILED.thickness(d_x) == pytest.approx(1 / response, rel=1e-5)


@pytest.mark.parametrize("d_x", [20.0, 50.0, 80.0])
def test_10_and_the_exact_rod_agree_at_small_angles(d_x):
    """A line on a thin bar: both differ by the order of θ², 1e-6 here, and by the march's few steps."""
    theta = 1e-3
    m_z = float(PROFILED.moment_Nmm(theta, d_x))
    whisk = Whisk.without_samples(theta, np.array([0.0, m_z]), 1e-12 * m_z**2 * np.eye(2), PROFILED)
    settings = EstimatorSettings(0.0)
    ten = with_friction(whisk, settings)
    assert ten.d_x_mm == pytest.approx(d_x, rel=1e-7)
    assert exact_rod(whisk, settings).d_x_mm == pytest.approx(d_x, rel=2e-5)


def test_the_sigma_follows_the_profile():
    """1 % of the moments moves d_x by `left` of 1 %: what is left of a relative error of the cylinder's."""
    theta, d_x = 0.05, 60.0
    m_z = float(PROFILED.moment_Nmm(theta, d_x))
    noise = np.diag([1e-12, (1e-3 * m_z) ** 2])
    found = with_friction(
        Whisk.without_samples(theta, np.array([0.0, m_z]), noise, PROFILED), EstimatorSettings(0.0)
    )
    assert found.sigma_mm == pytest.approx(1e-3 * PROFILED.thickness(d_x) * d_x, rel=1e-3)


def test_a_rest_shape_that_is_hardly_known_widens_the_exact_rod_s_estimate():
    """As far as the estimate moves where the shape is one sigma off, in y and in z."""
    rest = ((0.0, 0.0, -5.0), (0.0, 0.0, 2.0))
    theta, d_x, sigma_mm = 0.05, 50.0, 2.0
    m_z = float(Beam(9000.0, 100.0).moment_Nmm(theta, d_x))
    noise = (1e-6 * m_z) ** 2 * np.eye(2)

    def answered(rest_mm, rest_sigma_mm=0.0):
        beam = Beam(9000.0, 100.0, rest_mm=rest_mm, rest_sigma_mm=rest_sigma_mm)
        whisk = Whisk.without_samples(theta, np.array([0.2 * m_z, m_z]), noise, beam)
        return exact_rod(whisk, EstimatorSettings(0.1))

    exact = answered(rest)
    vague = answered(rest, sigma_mm)
    (y, z) = rest
    moved = [
        answered(((0.0, 0.0, y[2] + sigma_mm), z)).d_x_mm - exact.d_x_mm,
        answered((y, (0.0, 0.0, z[2] + sigma_mm))).d_x_mm - exact.d_x_mm,
    ]
    assert vague.d_x_mm == exact.d_x_mm
    assert vague.sigma_mm == pytest.approx(np.hypot(exact.sigma_mm, np.hypot(*moved)), rel=1e-6)
    assert vague.low_mm < exact.low_mm and vague.high_mm > exact.high_mm
