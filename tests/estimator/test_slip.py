"""Slip in the sensing plane: physics and symmetry, over random contacts."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimator import slip

pytestmark = pytest.mark.filterwarnings("error")

EPSILON = 2.0**-52
slopes = st.builds(
    lambda sign, size: sign * size, st.sampled_from([-1, 0, 1]), st.floats(1e-12, 1.5)
)
frictions = st.floats(0.0, 1.5)
distances = st.floats(1e-3, 1e4)
pushes = st.floats(1e-9, 0.35)
rigidities = st.floats(1e-3, 1e6)


@given(distances, pushes, slopes, frictions, rigidities)
def test_mirrored_slope_mirrors_the_slip_and_m_y(d_x, theta, beta, alpha, C):
    m_y, m_z = slip.moments(d_x, theta, beta, alpha, C)
    assert slip.moments(d_x, theta, -beta, alpha, C) == (-m_y, m_z)
    assert slip.slip_angle(-beta, alpha) == -slip.slip_angle(beta, alpha)
    assert slip.slip_distance(d_x, theta, -beta, alpha) == -slip.slip_distance(
        d_x, theta, beta, alpha
    )


@given(distances, pushes, frictions, st.floats(0, 1), rigidities)
def test_friction_cone_wider_than_the_slope_holds_the_whisker(d_x, theta, alpha, share, C):
    beta = share * alpha
    assert slip.slip_angle(beta, alpha) == 0.0
    assert slip.slip_distance(d_x, theta, beta, alpha) == 0.0
    m_y, m_z = slip.moments(d_x, theta, beta, alpha, C)
    assert m_y == 0.0
    assert m_z == pytest.approx(C * theta / d_x, rel=8 * EPSILON)


@given(slopes)
def test_without_friction_the_force_is_normal_to_the_surface(beta):
    """φ → β for α → 0; at α = 0 it is β itself."""
    assert slip.slip_angle(beta, 0.0) == beta
    tiny = 1e-9
    assert slip.slip_angle(abs(beta), tiny) == max(0.0, abs(beta) - tiny)


@given(distances, pushes, slopes, frictions, rigidities, st.integers(-400, 400))
def test_scale_invariance(d_x, theta, beta, alpha, C, power):
    """Moments scale with C and with 1/d_x, the slip with d_x; powers of two scale normal numbers without rounding."""
    scale = 2.0**power
    m_y, m_z = slip.moments(d_x, theta, beta, alpha, C)
    assert slip.moments(d_x, theta, beta, alpha, C * scale) == (m_y * scale, m_z * scale)
    assert slip.moments(d_x * scale, theta, beta, alpha, C) == (m_y / scale, m_z / scale)
    slid = slip.slip_distance(d_x, theta, beta, alpha)
    assert slip.slip_distance(d_x * scale, theta, beta, alpha) == slid * scale


@given(distances, pushes, st.floats(0.01, 1.4), frictions, rigidities)
def test_magnitude_and_direction_belong_together(d_x, theta, beta, alpha, C):
    """8 ε for each of two square roots and an arc tangent, whose argument is at most tan 1.4 = 6 times as sensitive."""
    m_y, m_z = slip.moments(d_x, theta, beta, alpha, C)
    assert np.hypot(m_y, m_z) == pytest.approx(
        slip.moment_magnitude(d_x, theta, beta, alpha, C), rel=32 * EPSILON
    )
    assert np.arctan2(m_y, m_z) == pytest.approx(slip.slip_angle(beta, alpha), abs=64 * EPSILON)


@given(distances, pushes, st.floats(0.05, 1.4), st.floats(0.0, 1.4), rigidities)
def test_deflections_hang_together(d_x, theta, beta, alpha, C):
    """Fig. 4: d_z = σ cos β, d_y = d_x θ − σ sin β; then (18)–(21) give back the moments, the slope and φ."""
    slid = slip.slip_distance(d_x, theta, beta, alpha)
    d_y, d_z = d_x * theta - slid * np.sin(beta), slid * np.cos(beta)
    np.testing.assert_allclose(
        slip.moment_from_deflection(d_x, d_y, d_z, C),
        slip.moments(d_x, theta, beta, alpha, C),
        rtol=1e-12,
    )
    found_beta, found_phi = slip.slope_from_deflection(d_x, theta, d_y, d_z)
    assert found_phi == pytest.approx(slip.slip_angle(beta, alpha), rel=1e-12, abs=1e-15)
    if slid > 1e-9 * d_x * theta:
        assert found_beta == pytest.approx(beta, rel=1e-12 * d_x * theta / slid)


def test_no_slip_leaves_no_trace_of_the_slope():
    beta, phi = slip.slope_from_deflection(50.0, 0.05, 2.5, 0.0)
    assert np.isnan(beta)
    assert phi == 0.0


@pytest.mark.parametrize(
    "d_x, theta, beta",
    [
        (0.0, 0.05, 0.5),
        (-1.0, 0.05, 0.5),
        (50.0, -0.05, 0.5),
        (50.0, 1.6, 0.5),
        (50.0, 0.05, np.pi / 2),
        (50.0, 0.05, -2.0),
        (np.nan, 0.05, 0.5),
        (50.0, np.inf, 0.5),
    ],
)
def test_outside_the_domain_is_nan(d_x, theta, beta):
    assert np.isnan(slip.moments(d_x, theta, beta, 0.2, 1.0)).all()
    assert np.isnan(slip.moment_magnitude(d_x, theta, beta, 0.2, 1.0))
    assert np.isnan(slip.slip_distance(d_x, theta, beta, 0.2))


def test_no_push_is_no_moment():
    assert slip.moments(50.0, 0.0, 1.0, 0.2, 9000.0) == (0.0, 0.0)
    assert slip.slip_distance(50.0, 0.0, 1.0, 0.2) == 0.0


def test_scalars_give_floats_and_arrays_broadcast():
    assert type(slip.slip_angle(1, 0.2)) is float
    m_y, m_z = slip.moments([[50.0], [60.0]], 0.05, [0.0, 0.5, 1.0], 0.2, 9000.0)
    assert m_y.shape == m_z.shape == (2, 3)
    assert m_y[1, 2] == slip.moments(60.0, 0.05, 1.0, 0.2, 9000.0)[0]


@pytest.mark.parametrize("alpha", [-1e-9, np.pi / 2, np.nan, np.inf])
def test_impossible_friction_is_refused_with_name_and_range(alpha):
    with pytest.raises(ValueError, match=r"alpha = .* must lie in \[0, pi/2\)"):
        slip.slip_angle(0.5, alpha)


@pytest.mark.parametrize("C", [0.0, -1.0, np.nan, np.inf])
def test_impossible_rigidity_is_refused_with_name(C):
    with pytest.raises(ValueError, match=r"C = .* must be positive"):
        slip.moments(50.0, 0.05, 0.5, 0.2, C)


def test_overflow_and_underflow_stay_silent():
    assert np.isnan(slip.moments(5e-324, 0.3, 0.5, 0.2, 1e300)).all()
    assert slip.moments(1e300, 1e-300, 0.5, 0.2, 1e-300) == (0.0, 0.0)
