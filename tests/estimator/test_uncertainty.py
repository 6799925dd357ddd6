"""Sigma of d_x: derivatives against differences, predicted scatter against sampled, and C that drops out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimator import distance, slip, uncertainty

pytestmark = pytest.mark.filterwarnings("error")

C = 8835.7
THETA, ALPHA = np.radians(3.0), np.radians(10.5)
STEP = 1e-6


def cases():
    """Name, distance and gradient as functions of (θ, m_y, m_z, α_est)."""
    return {
        "no_slip": (
            lambda t, y, z, a: distance.no_slip(t, z, C),
            lambda t, y, z, a: uncertainty.gradient_no_slip(t, z, C),
        ),
        "known_slope": (
            lambda t, y, z, b: distance.known_slope(t, y, z, b, C),
            lambda t, y, z, b: uncertainty.gradient_known_slope(t, y, z, b, C),
        ),
        "with_friction": (
            lambda t, y, z, a: distance.with_friction(t, y, z, a, C),
            lambda t, y, z, a: uncertainty.gradient_with_friction(t, y, z, a, C),
        ),
    }


@pytest.mark.parametrize("name", cases())
@pytest.mark.parametrize("m_y", [3.0, -3.0, 0.1])
def test_gradients_are_the_differences(name, m_y):
    """Central differences over ± 1e-6 are good to 1e-12 of the third derivative and ε/1e-6 of rounding."""
    of, gradient = cases()[name]
    at = np.array([THETA, m_y, 7.0, ALPHA])
    differences = []
    for i, size in enumerate(np.maximum(np.abs(at), 0.1)):
        step = np.zeros(4)
        step[i] = STEP * size
        differences.append((of(*(at + step)) - of(*(at - step))) / (2 * step[i]))
    np.testing.assert_allclose(gradient(*at), differences, rtol=1e-8, atol=1e-7)


@given(st.floats(0.01, 0.1), st.floats(-1.0, 1.0), st.floats(0.0, 0.4))
def test_sensitivities_of_10_in_the_closed_forms(theta, phi, alpha_est):
    """∂ln d_x/∂φ = −tan(φ + α_est), ∂ln d_x/∂α_est = −tan(φ + α_est) + tan α_est, for φ > 0 and mirrored."""
    m_y, m_z = 5 * np.sin(phi), 5 * np.cos(phi)
    d_x = distance.with_friction(theta, m_y, m_z, alpha_est, C)
    by_theta, by_y, by_z, by_alpha = (
        uncertainty.gradient_with_friction(theta, m_y, m_z, alpha_est, C) / d_x
    )
    steep = np.tan(abs(phi) + alpha_est)
    assert by_theta == pytest.approx(1 / theta, rel=1e-14)
    assert by_alpha == pytest.approx(np.tan(alpha_est) - steep, rel=1e-11, abs=1e-14)
    turning = by_y * m_z - by_z * m_y
    assert turning == pytest.approx(-np.copysign(steep, m_y), rel=1e-11)


@pytest.mark.parametrize("beta_deg", [0.0, 20.0, 45.0, 70.0])
@pytest.mark.parametrize("equation", ["no_slip", "with_friction"])
def test_predicted_sigma_is_the_sampled_scatter(equation, beta_deg):
    """20000 draws give a scatter good to 1/√40000 = 0.5 %; 0.3 % noise leaves curvature below 1 %; 4 · 0.5 % is 2 %.

    Near m_y = 0 the kink of |m_y| is no line, so β is 0 only where the equation has none.
    """
    if beta_deg == 0 and equation == "with_friction":
        beta_deg = 15.0
    rng = np.random.default_rng(42)
    m_y, m_z = slip.moments(60.0, THETA, np.radians(beta_deg), ALPHA, C)
    covariance = (0.003 * np.hypot(m_y, m_z)) ** 2 * np.array([[1.0, 0.4], [0.4, 0.5]])
    theta_sigma, alpha_sigma = 1.8e-4, 0.002
    y, z = rng.multivariate_normal([m_y, m_z], covariance, 20000).T
    theta = THETA + theta_sigma * rng.normal(size=20000)
    alpha = ALPHA + alpha_sigma * rng.normal(size=20000)
    of, gradient = cases()[equation]
    predicted = uncertainty.sigma(
        gradient(THETA, m_y, m_z, ALPHA),
        theta_sigma=theta_sigma,
        covariance=covariance,
        alpha_est_sigma=alpha_sigma,
    )
    assert np.std(of(theta, y, z, alpha)) == pytest.approx(predicted, rel=0.03)


def test_error_shared_by_angle_and_moment_cancels():
    """A level that is too high makes the touch late and the moment small alike: d_x = Cθ/m keeps."""
    m_z, offset_sigma = 8.0, 0.05
    rise = m_z / THETA
    sigmas = {
        "theta_sigma": offset_sigma / rise,
        "covariance": np.diag([0.0, offset_sigma**2]),
        "theta_moment_covariance": [0.0, offset_sigma**2 / rise],
    }
    gradient = uncertainty.gradient_no_slip(THETA, m_z, C)
    assert uncertainty.sigma(gradient, **sigmas) == pytest.approx(0.0, abs=1e-6)
    del sigmas["theta_moment_covariance"]
    assert uncertainty.sigma(gradient, **sigmas) == pytest.approx(
        np.sqrt(2) * offset_sigma / m_z * distance.no_slip(THETA, m_z, C), rel=1e-12
    )


def test_wrong_modulus_changes_no_distance_where_the_gauges_were_found_with_it():
    """E 10 % too large makes the gauge factors from (2) 10 % too large; d_x from volts keeps to the last digits."""
    volts_y, volts_z, volts_at_gauge = 0.31, 0.52, 0.85
    found = []
    for stiffness in (C, 1.1 * C):
        factor = stiffness * THETA / 50.0 / volts_at_gauge
        m_y, m_z = factor * volts_y, factor * volts_z
        d_x = distance.with_friction(THETA, m_y, m_z, ALPHA, stiffness)
        sigma = uncertainty.sigma(
            uncertainty.gradient_with_friction(THETA, m_y, m_z, ALPHA, stiffness),
            theta_sigma=1e-4,
            covariance=(0.002 * factor) ** 2 * np.eye(2),
        )
        found.append((d_x, sigma))
    np.testing.assert_allclose(found[1], found[0], rtol=16 * 2.0**-52)


def test_friction_doubt_counts_even_where_no_slip_was_felt():
    """At m_y = 0 noise in m_y is still rectified by |m_y|: its one-sided derivative counts."""
    gradient = uncertainty.gradient_with_friction(THETA, 0.0, 7.0, ALPHA, C)
    assert gradient[1] == pytest.approx(
        -np.tan(ALPHA) / 7.0 * distance.no_slip(THETA, 7.0, C), rel=1e-12
    )


def test_no_distance_has_no_sigma():
    gradient = uncertainty.gradient_with_friction(THETA, 9.0, 1.0, ALPHA, C)
    assert np.isnan(uncertainty.sigma(gradient, theta_sigma=1e-4))


def test_arrays_broadcast():
    sigmas = {"theta_sigma": 1e-4, "covariance": np.eye(2) * 1e-4}
    gradient = uncertainty.gradient_with_friction(THETA, np.array([0.0, 1.0, 2.0]), 7.0, ALPHA, C)
    found = uncertainty.sigma(gradient, **sigmas)
    assert found.shape == (3,)
    alone = uncertainty.gradient_with_friction(THETA, 1.0, 7.0, ALPHA, C)
    assert found[1] == uncertainty.sigma(alone, **sigmas)


def test_negative_sigma_is_refused_with_its_name():
    with pytest.raises(ValueError, match="theta_sigma = -1"):
        uncertainty.sigma(uncertainty.gradient_no_slip(THETA, 7.0, C), theta_sigma=-1.0)


@pytest.mark.parametrize("alpha_deg", [0.0, 2.0, 10.5])
def test_interval_holds_where_no_friction_is(alpha_deg):
    """α_est drawn about α with 5°, none below 0: at α = 0 an ellipse cut at its middle holds 93.8 to 95.5 %, the less
    the more friction outweighs noise; where hardly anything is missed on one side, 97.5 %. 20 000 draws know it to
    0.17 %."""
    rng, sigma, beta, d_x = np.random.default_rng(3), np.radians(5.0), np.radians(50.0), 60.0
    alpha, noise = np.radians(alpha_deg), 0.02
    exact = slip.moments(d_x, THETA, beta, alpha, C)
    m_y, m_z = np.array(exact)[:, None] + noise * rng.standard_normal((2, 20_000))
    alpha_est = np.maximum(alpha + sigma * rng.standard_normal(20_000), 0.0)
    told = {"alpha_est_sigma": sigma, "covariance": noise**2 * np.eye(2)}
    low, high = uncertainty.interval_with_friction(THETA, m_y, m_z, alpha_est, C, **told)
    assert 0.933 < np.mean((low <= d_x) & (d_x <= high)) < 0.981
