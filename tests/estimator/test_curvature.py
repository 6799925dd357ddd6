"""Appendix B against geometry that shares nothing with it: a force balance at the contact, found by bisection."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import brentq

from estimator import curvature, slip

pytestmark = pytest.mark.filterwarnings("error")

EPSILON = 2.0**-52
radii = st.floats(0.05, 1e3)
pushes = st.floats(1e-4, 0.1)
slopes = st.builds(
    lambda sign, size: sign * size, st.sampled_from([-1, 0, 1]), st.floats(1e-12, 1.4)
)
frictions = st.floats(0.0, 1.4)


def contact_by_force_balance(r_n, theta, beta_0, alpha):
    """(φ, d): the contact on the circle at which the deflection leaves the normal by the friction angle.

    The deflection runs from the virtual point V to the contact P, the normal from the centre to P; while sliding the
    angle between them is α. The contact is sought between the first one and where V's own normal meets the circle.
    """
    virtual = r_n * np.array([np.cos(beta_0), np.sin(beta_0)]) - [theta, 0.0]

    def deflection(normal):
        return r_n * np.array([np.cos(normal), np.sin(normal)]) - virtual

    def excess(normal):
        d_y, d_z = deflection(normal)
        return normal - alpha - np.arctan2(d_z, d_y)

    if beta_0 <= alpha:
        return 0.0, theta
    normal = brentq(excess, beta_0, np.arctan2(virtual[1], virtual[0]) + 1e-12, xtol=1e-15)
    d_y, d_z = deflection(normal)
    return np.arctan2(d_z, d_y), np.hypot(d_y, d_z)


@given(radii, pushes, st.floats(0.02, 1.4), frictions)
def test_exact_form_is_the_force_balance(r_n, theta, beta_0, alpha):
    """P − V is a difference of r_n-sized numbers, good to ε r_n; so is the oracle's answer, over d."""
    assume(theta < r_n * np.cos(beta_0))
    phi, d = contact_by_force_balance(r_n, theta, beta_0, alpha)
    assume(phi < 1.5)
    tolerance = 1e-13 * (1 + r_n / theta) / np.cos(beta_0)
    assert curvature.slip_angle(r_n, theta, beta_0, alpha) == pytest.approx(phi, abs=tolerance)
    assert curvature.deflection(r_n, theta, beta_0, alpha) == pytest.approx(d, rel=tolerance)


@given(radii, pushes, slopes)
def test_printed_and_exact_agree_without_friction(r_n, theta, beta_0):
    assume(theta < r_n * np.cos(beta_0))
    printed = curvature.slip_angle_printed(r_n, theta, beta_0, 0.0)
    exact = curvature.slip_angle(r_n, theta, beta_0, 0.0)
    np.testing.assert_allclose(exact, printed, rtol=1e-12)
    np.testing.assert_allclose(
        curvature.deflection(r_n, theta, beta_0, 0.0),
        curvature.deflection_printed(r_n, theta, beta_0, 0.0),
        rtol=1e-12,
    )


def test_printed_slips_against_23_where_friction_holds():
    """α ≥ β_0: (23) has no slip; (24) as printed slips once ζ > α, the exact form never."""
    arguments = (0.2, np.radians(5), np.radians(30), np.radians(32))
    assert curvature.slip_angle_printed(*arguments) > 0.1
    assert curvature.slip_angle(*arguments) == 0.0
    assert curvature.deflection(*arguments) == np.radians(5)


@given(pushes, slopes, frictions)
def test_no_curvature_is_the_flat_surface(theta, beta, alpha):
    """At r_n = ∞ φ is (4), and d sin φ, d cos φ are (14), (13) over C/d_x."""
    for form in (curvature.slip_angle, curvature.slip_angle_printed):
        assert form(np.inf, theta, beta, alpha) == slip.slip_angle(beta, alpha)
    for form in (curvature.moments, curvature.moments_printed):
        np.testing.assert_allclose(
            form(np.inf, theta, beta, alpha), slip.moments(1.0, theta, beta, alpha, 1.0), rtol=4e-15
        )


@given(radii, pushes, slopes, frictions)
def test_mirrored_slope_mirrors_the_slip(r_n, theta, beta_0, alpha):
    assume(theta < 2 * r_n * np.cos(beta_0))
    for form in (curvature.moments, curvature.moments_printed):
        m_y, m_z = form(r_n, theta, beta_0, alpha)
        np.testing.assert_array_equal(form(r_n, theta, -beta_0, alpha), (-m_y, m_z))


def test_geometry_of_figure_10():
    """(26)–(28), (29), (32) on a circle of r_n = 2 with β_0 = 30° and θ = 0.1."""
    y_c, z_c = curvature.initial_contact(2.0, np.pi / 6)
    assert (y_c, z_c) == pytest.approx((np.sqrt(3), 1.0), rel=4 * EPSILON)
    assert np.hypot(y_c, z_c) == pytest.approx(2.0, rel=4 * EPSILON)
    assert curvature.virtual_angle(2.0, 0.1, np.pi / 6) == pytest.approx(
        np.arctan2(1.0, np.sqrt(3) - 0.1), rel=4 * EPSILON
    )
    assert curvature.virtual_radius(2.0, 0.1, np.pi / 6) == pytest.approx(
        np.hypot(1.0, np.sqrt(3) - 0.1), rel=4 * EPSILON
    )


def test_angle_of_the_virtual_point_has_no_pole():
    """(25) and (29) divide by y_c − θ; ζ runs smoothly through 90° there."""
    theta = 2 * np.cos(1.3)
    before, at, after = (
        curvature.virtual_angle(2.0, theta + step, 1.3) for step in (-1e-6, 0.0, 1e-6)
    )
    assert at == pytest.approx(np.pi / 2, abs=1e-15)
    assert before < at < after


def test_curvature_and_radius_of_equation_15():
    assert curvature.normalized_curvature(50.0, 25.0) == 2.0
    assert curvature.normalized_radius(50.0, 25.0) == 0.5
    assert np.isnan(curvature.normalized_curvature(50.0, 0.0))
    assert np.isnan(curvature.normalized_radius(-50.0, 25.0))


@pytest.mark.parametrize(
    "r_n, theta, beta_0, code",
    [
        (-1.0, 0.05, 0.5, "radius_not_positive"),
        (1.0, -0.05, 0.5, "angle_negative"),
        (1.0, 2.0, 0.5, "angle_too_large"),
        (1.0, 0.05, 1.6, "first_slope_too_steep"),
        (0.1, 0.3, 1.0, "object_passed"),
        (0.1, 0.1, 1.0, "slip_angle_too_large"),
        (np.nan, 0.05, 0.5, "value_missing"),
    ],
)
def test_outside_the_domain_is_nan_with_a_reason(r_n, theta, beta_0, code):
    assert curvature.why_not(r_n, theta, beta_0).code == code
    assert np.isnan(curvature.moments(r_n, theta, beta_0, 0.0)).all()


def test_inside_the_domain_there_is_no_reason():
    assert curvature.why_not(1.0, 0.05, [0.5, 1.0], 0.2).tolist() == ["", ""]


@given(radii, st.floats(0, 0.4), slopes, frictions)
def test_numbers_exist_exactly_where_no_reason_is_given(r_n, theta, beta_0, alpha):
    missing = np.isnan(curvature.deflection(r_n, theta, beta_0, alpha))
    assert missing == bool(curvature.why_not(r_n, theta, beta_0, alpha))


# ---- slope thresholds


@pytest.mark.parametrize("equation", ["with_friction", "no_slip"])
@pytest.mark.parametrize("r_n, theta", [(np.inf, 0.0), (1.0, 0.05), (0.3, 0.02)])
@pytest.mark.parametrize("printed", [True, False])
def test_threshold_is_where_the_error_is(equation, r_n, theta, printed):
    settings = {"equation": equation, "r_n": r_n, "theta": theta, "printed": printed}
    beta = curvature.slope_threshold(0.05, 0.3, 0.2, **settings)
    assert abs(curvature.distance_error(beta, 0.3, 0.2, **settings)) == pytest.approx(
        0.05, rel=1e-9
    )
    assert abs(curvature.distance_error(0.99 * beta, 0.3, 0.2, **settings)) < 0.05


def test_threshold_never_reached_is_nan():
    assert np.isnan(curvature.slope_threshold(0.05, 0.2, 0.2))
    assert np.isnan(curvature.slope_threshold(1.5, 0.2, 0.4))
    assert np.isnan(curvature.slope_threshold(5.0, 0.2, 0.2, r_n=10.0, theta=0.01))


def test_thresholds_broadcast():
    flat = curvature.slope_threshold([0.01, 0.05], [[0.1], [0.2], [0.3]], 0.2)
    assert flat.shape == (3, 2)
    assert np.isnan(flat[1]).all()
    curved = curvature.slope_threshold(0.05, 0.2, 0.2, r_n=[0.5, 1.0, 2.0], theta=0.05)
    assert (np.diff(curved) > 0).all()


def test_impossible_settings_are_refused():
    with pytest.raises(ValueError, match="equation = 'magic'"):
        curvature.slope_threshold(0.05, 0.2, equation="magic")
    with pytest.raises(ValueError, match="error = 0"):
        curvature.slope_threshold(0.0, 0.2)
    with pytest.raises(ValueError, match="theta = 0"):
        curvature.slope_threshold(0.05, 0.2, r_n=1.0)
    with pytest.raises(ValueError, match="alpha = 2"):
        curvature.deflection(1.0, 0.05, 0.5, 2.0)
