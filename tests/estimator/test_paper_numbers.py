"""Every number that the paper prints about its equations, and the same recomputed, each named after its place.

The paper's own figures are whole percents and degrees; the recomputed ones have the digits they are given with.
Only the friction angles of Fig. 8 are not here: they come from data alone.
"""

import numpy as np
import pytest

from estimator import curvature, distance, slip
from estimator.friction import Pushes, fit_alpha
from estimator.threshold import curved_threshold, distance_error


def angle(degrees):
    return float(np.radians(degrees))


# ---- section IV-A and Fig. 5: α_est beside the true α


@pytest.mark.parametrize(
    "alpha_est, beta, alpha, printed_percent, percent",
    [
        (10, 60, 8.2, 5, -5.01),
        (10, 60, 11.7, 5, 4.50),
        (10, 70, 7.8, 10, -10.08),
        (10, 70, 12.3, 10, 10.07),
        (10, 45, 20.0, 10, 10.5),
    ],
)
def test_section_4a_error_of_10_with_a_wrong_friction_angle(
    alpha_est, beta, alpha, printed_percent, percent
):
    """By the forward model and (10) itself; half a unit of the last digit given, half a percent of the paper's."""
    theta, C = angle(3), 9000.0
    m_y, m_z = slip.moments(60.0, theta, angle(beta), angle(alpha), C)
    found = 100 * (distance.with_friction(theta, m_y, m_z, angle(alpha_est), C) / 60.0 - 1)
    assert found == pytest.approx(percent, abs=0.05 if percent == 10.5 else 0.005)
    assert abs(found) == pytest.approx(printed_percent, abs=0.55)
    closed_form = 100 * distance_error(angle(beta), angle(alpha), angle(alpha_est))
    assert closed_form == pytest.approx(found, abs=1e-10)


# ---- section IV-B and Fig. 6: curvature. The recomputed slopes are the first of a grid of 0.05° or 0.1° beyond the
# threshold, hence up to 0.1° above it.


@pytest.mark.parametrize(
    "theta, error, printed_deg, recomputed_deg",
    [(3, 0.05, 63, 62.9), (3, 0.10, 74, 74.15), (5, 0.05, 52, 51.5), (5, 0.10, 65, 65.05)],
)
def test_section_4b_curved_surface_without_friction(theta, error, printed_deg, recomputed_deg):
    for form in (curvature.printed, curvature.exact):
        found = np.degrees(curved_threshold(error, 0.0, 1.0, angle(theta), form))
        assert 0 <= recomputed_deg - found <= 0.1
        assert found == pytest.approx(printed_deg, abs=0.55)


@pytest.mark.parametrize(
    "theta, error, form, recomputed_deg",
    [
        (3, 0.05, curvature.printed, 63.45),
        (3, 0.10, curvature.printed, 74.25),
        (3, 0.05, curvature.exact, 68.2),
        (3, 0.10, curvature.exact, 76.2),
        (5, 0.05, curvature.exact, 60.3),
        (5, 0.10, curvature.exact, 69.5),
    ],
)
def test_section_4b_curved_surface_with_friction_of_20_degrees(theta, error, form, recomputed_deg):
    """ "Friction has negligible impact" holds for (24) as printed, not for the force at the contact point."""
    found = np.degrees(curved_threshold(error, angle(20), 1.0, angle(theta), form))
    assert 0 <= recomputed_deg - found <= 0.1


# ---- Appendix B: as printed it loses all digits near r_n = 1e8


def printed_formula(r_n, theta, beta_0):
    """(28), (32), (31) with φ = ζ, typed as they stand, for α = 0."""
    y_c = r_n / np.sqrt(np.tan(beta_0) ** 2 + 1)
    z_c = r_n * np.tan(beta_0) / np.sqrt(np.tan(beta_0) ** 2 + 1)
    p = np.sqrt((y_c - theta) ** 2 + z_c**2)
    return np.sqrt(r_n**2 - p**2 / 2 * (1 - np.cos(0.0))) - p


def test_appendix_b_goes_over_into_the_flat_surface():
    """At r_n = 1e8 an error of ε in p² is 1e-8 in d, a fifth of it; the stable form differs from flat by θ/r_n."""
    theta, beta = 0.05, angle(60)
    flat = theta * np.cos(beta)
    for stable in (curvature.exact, curvature.printed):
        for r_n in (1e6, 1e8, 1e12, np.inf):
            _, d = stable(r_n, theta, beta, 0.0)
            assert d == pytest.approx(flat, rel=theta / r_n + 1e-15)
    lost = [abs(printed_formula(r_n, theta, beta) / flat - 1) for r_n in (1e2, 1e8, 1e16)]
    assert lost[1] > 1e-8
    assert lost[2] > 0.5


# ---- section V: the protocol's arithmetic


def test_section_5_calibration_at_beta_0_uses_m_z():
    """At β = 0 there is no m_y; (2) at d_x = 50 mm and θ = 3° gives the factor of the one channel."""
    m_y, m_z = slip.moments(50.0, angle(3), 0.0, angle(10.5), 8835.7)
    assert m_y == 0.0
    assert distance.no_slip(angle(3), m_z, 8835.7) == pytest.approx(50.0, rel=1e-15)


def test_fig_8_angles_come_back_from_their_own_curves():
    """The fit finds each of the four friction angles printed beside Fig. 8 in moments made with it; golden sections
    end within √ε of the minimum."""
    beta = np.radians(np.arange(0, 80, 5))
    for printed_deg in (10.5, 12.3, 23.3, 18.7):
        m_y, m_z = slip.moments(50.0, angle(3), beta, angle(printed_deg), 8835.7)
        fit = fit_alpha(Pushes(beta, m_y, m_z, 50.0, angle(3), 8835.7))
        assert np.degrees(fit.alpha_rad) == pytest.approx(printed_deg, abs=1e-5)
