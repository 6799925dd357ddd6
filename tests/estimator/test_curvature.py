"""Appendix B against geometry that shares nothing with it: a force balance at the contact, found by bisection."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import brentq

from estimator import curvature, slip
from estimator.threshold import (
    curved_error,
    curved_threshold,
    distance_error,
    slope_threshold,
)

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
    found_phi, found_d = curvature.exact(r_n, theta, beta_0, alpha)
    assert found_phi == pytest.approx(phi, abs=tolerance)
    assert found_d == pytest.approx(d, rel=tolerance)


@given(radii, pushes, slopes)
def test_printed_and_exact_agree_without_friction(r_n, theta, beta_0):
    assume(theta < r_n * np.cos(beta_0))
    printed = curvature.printed(r_n, theta, beta_0, 0.0)
    exact = curvature.exact(r_n, theta, beta_0, 0.0)
    np.testing.assert_allclose(exact, printed, rtol=1e-12)


def test_printed_slips_against_23_where_friction_holds():
    """α ≥ β_0: (23) has no slip; (24) as printed slips once ζ > α, the exact form never."""
    arguments = (0.2, np.radians(5), np.radians(30), np.radians(32))
    assert curvature.printed(*arguments)[0] > 0.1
    assert curvature.exact(*arguments) == (0.0, np.radians(5))


@given(pushes, slopes, frictions)
def test_no_curvature_is_the_flat_surface(theta, beta, alpha):
    """At r_n = ∞ φ is (4), and d sin φ, d cos φ are (14), (13) over C/d_x."""
    for form in (curvature.exact, curvature.printed):
        phi, d = form(np.inf, theta, beta, alpha)
        assert phi == slip.slip_angle(beta, alpha)
        flat = slip.moments(1.0, theta, beta, alpha, 1.0)
        np.testing.assert_allclose([d * np.sin(phi), d * np.cos(phi)], flat, rtol=4e-15)


@given(radii, pushes, slopes, frictions)
def test_mirrored_slope_mirrors_the_slip(r_n, theta, beta_0, alpha):
    assume(theta < 2 * r_n * np.cos(beta_0))
    for form in (curvature.exact, curvature.printed):
        phi, d = form(r_n, theta, beta_0, alpha)
        np.testing.assert_array_equal(form(r_n, theta, -beta_0, alpha), (-phi, d))


def test_geometry_of_figure_10():
    """(29), (32) on a circle of r_n = 2 with β_0 = 30° and θ = 0.1, from the contact (√3, 1)."""
    zeta = np.pi / 6 + curvature.virtual_turn(0.05, np.pi / 6)
    assert zeta == pytest.approx(np.arctan2(1.0, np.sqrt(3) - 0.1), rel=4 * EPSILON)
    p = 2.0 * curvature.virtual_radius(0.05, np.pi / 6)
    assert p == pytest.approx(np.hypot(1.0, np.sqrt(3) - 0.1), rel=4 * EPSILON)


def test_angle_of_the_virtual_point_has_no_pole():
    """(25) and (29) divide by y_c − θ; ζ runs smoothly through 90° there."""
    pole = np.cos(1.3)
    before, at, after = (
        1.3 + curvature.virtual_turn(pole + step, 1.3) for step in (-1e-6, 0.0, 1e-6)
    )
    assert at == pytest.approx(np.pi / 2, abs=1e-15)
    assert before < at < after


@pytest.mark.parametrize(
    "r_n, theta, beta_0",
    [
        (-1.0, 0.05, 0.5),
        (1.0, -0.05, 0.5),
        (1.0, 2.0, 0.5),
        (1.0, 0.05, 1.6),
        (0.1, 0.3, 1.0),
        (0.1, 0.1, 1.0),
        (np.nan, 0.05, 0.5),
    ],
)
def test_outside_the_domain_is_nan(r_n, theta, beta_0):
    for form in (curvature.exact, curvature.printed):
        assert np.isnan(form(r_n, theta, beta_0, 0.0)).all()


# ---- slope thresholds


@pytest.mark.parametrize("equation", ["with_friction", "no_slip"])
def test_threshold_is_where_the_error_is(equation):
    beta = slope_threshold(0.05, 0.3, 0.2, equation)
    assert abs(distance_error(beta, 0.3, 0.2, equation)) == pytest.approx(0.05, rel=1e-9)
    assert abs(distance_error(0.99 * beta, 0.3, 0.2, equation)) < 0.05


@pytest.mark.parametrize("r_n, theta", [(1.0, 0.05), (0.3, 0.02)])
@pytest.mark.parametrize("form", [curvature.exact, curvature.printed])
def test_threshold_of_a_curved_surface_is_where_the_error_is(r_n, theta, form):
    beta = curved_threshold(0.05, 0.3, r_n, theta, form)
    assert abs(curved_error(beta, 0.3, r_n, theta, form)) == pytest.approx(0.05, rel=1e-9)
    assert abs(curved_error(0.99 * beta, 0.3, r_n, theta, form)) < 0.05


def test_threshold_never_reached_is_nan():
    assert np.isnan(slope_threshold(0.05, 0.2, 0.2))
    assert np.isnan(slope_threshold(1.5, 0.2, 0.4))
    assert np.isnan(curved_threshold(5.0, 0.2, 10.0, 0.01, curvature.exact))


def test_thresholds_broadcast():
    flat = slope_threshold([0.01, 0.05], [[0.1], [0.2], [0.3]], 0.2)
    assert flat.shape == (3, 2)
    assert np.isnan(flat[1]).all()
    curved = curved_threshold(0.05, 0.2, [0.5, 1.0, 2.0], 0.05, curvature.exact)
    assert (np.diff(curved) > 0).all()


def test_impossible_settings_are_refused():
    with pytest.raises(ValueError, match="equation = 'magic'"):
        slope_threshold(0.05, 0.2, 0.2, "magic")
    with pytest.raises(ValueError, match="error = 0"):
        slope_threshold(0.0, 0.2, 0.2)
    with pytest.raises(ValueError, match="theta = 0"):
        curved_threshold(0.05, 0.2, 1.0, 0.0, curvature.exact)
    with pytest.raises(ValueError, match="alpha = 2"):
        curvature.exact(1.0, 0.05, 0.5, 2.0)
