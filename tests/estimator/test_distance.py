"""Distances: they undo the forward model, keep its symmetries, and refuse with a reason what is no push."""

import warnings

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import quad

from estimator import distance, slip
from estimator.beam import Beam

pytestmark = pytest.mark.filterwarnings("error")

EPSILON = 2.0**-52
slopes = st.builds(
    lambda sign, size: sign * size, st.sampled_from([-1, 0, 1]), st.floats(1e-12, 1.4)
)
frictions = st.floats(0.0, 1.4)
distances = st.floats(1e-3, 1e4)
pushes = st.floats(1e-9, 0.35)
rigidities = st.floats(1e-3, 1e6)
anything = st.floats(allow_nan=True, allow_infinity=True)


def cone_distance(theta, m_y, m_z, alpha_est, C, length):
    """Return d_x of a cone by (10) for its base's cylinder."""
    as_cylinder = distance.with_friction(theta, m_y, m_z, alpha_est, C)
    return Beam(C, length, "cone").distance_mm(as_cylinder)


def cone_without_slip(C, length):
    """Return ν of (17)."""
    beam = Beam(C, length, "cone")
    return lambda theta, m: beam.distance_mm(C * theta / m)


def inversion_tolerance(beta, phi):
    """ε times what an error of one part in one of each angle does to the moments, with 16 for the operations."""
    steep = abs(beta) * np.tan(abs(beta)) + abs(beta) * np.tan(abs(phi)) + 1
    return 16 * EPSILON * steep


@given(distances, pushes, slopes, frictions, rigidities)
def test_known_slope_inverts_the_forward_model(d_x, theta, beta, alpha, C):
    """(6) of (13), (14)."""
    m_y, m_z = slip.moments(d_x, theta, beta, alpha, C)
    tolerance = inversion_tolerance(beta, slip.slip_angle(beta, alpha))
    assert distance.known_slope(theta, m_y, m_z, beta, C) == pytest.approx(d_x, rel=tolerance)


@given(distances, pushes, slopes, st.floats(1e-6, 1.3), rigidities)
def test_right_friction_equals_known_slope_while_slipping(d_x, theta, beta, alpha, C):
    """(10) with the true α equals (6), since β_est = β; tan α adds its sensitivity α sec²α tan φ."""
    assume(abs(beta) > alpha)
    m_y, m_z = slip.moments(d_x, theta, beta, alpha, C)
    phi = slip.slip_angle(beta, alpha)
    tolerance = inversion_tolerance(beta, phi) * (1 + np.tan(abs(phi)) * np.tan(abs(beta)))
    assert distance.with_friction(theta, m_y, m_z, alpha, C) == pytest.approx(d_x, rel=tolerance)
    assert distance.estimated_slope(m_y, m_z, alpha) == pytest.approx(beta, rel=8 * EPSILON)


@given(distances, pushes, slopes, frictions, frictions, rigidities)
def test_without_slip_every_equation_gives_the_distance(d_x, theta, beta, alpha, alpha_est, C):
    """ "(10) is reliable even when α_est > β_est", since m_y = 0 then."""
    assume(abs(beta) <= alpha)
    m_y, m_z = slip.moments(d_x, theta, beta, alpha, C)
    for found in (
        distance.no_slip(theta, m_z, C),
        distance.with_friction(theta, m_y, m_z, alpha_est, C),
        distance.frictionless(theta, m_y, m_z, C),
    ):
        assert found == pytest.approx(d_x, rel=8 * EPSILON)


@given(distances, pushes, slopes, rigidities)
def test_frictionless_surface_by_11_and_12(d_x, theta, beta, C):
    m_y, m_z = slip.moments(d_x, theta, beta, 0.0, C)
    tolerance = inversion_tolerance(beta, beta)
    assert distance.frictionless(theta, m_y, m_z, C) == pytest.approx(d_x, rel=tolerance)
    assert distance.felt_slip_angle(m_y, m_z) == pytest.approx(beta, rel=8 * EPSILON)


@given(pushes, slopes, st.floats(0.0, 0.3), rigidities, st.integers(-400, 400))
def test_scale_invariance(theta, phi, alpha_est, C, power):
    """d_x follows C, and moments against it, exactly: powers of two do not round."""
    assume(abs(phi) + alpha_est < 1.5)
    m_y, m_z = np.sin(phi), np.cos(phi)
    scale = 2.0**power
    d_x = distance.with_friction(theta, m_y, m_z, alpha_est, C)
    assert distance.with_friction(theta, m_y * scale, m_z * scale, alpha_est, C * scale) == d_x
    assert distance.with_friction(theta, m_y, m_z, alpha_est, C * scale) == d_x * scale
    length = 3 * d_x
    cone = cone_distance(theta, m_y, m_z, alpha_est, C, length)
    assert cone_distance(theta, m_y, m_z, alpha_est, C * scale, length * scale) == cone * scale


@pytest.mark.parametrize("m_y", [0.0, 5e-324, 1e-320, 1e-300, 1e-16])
def test_the_smallest_slip_is_no_slip(m_y):
    """Even a subnormal m_y leaves the distance of (2), to the last digit."""
    for alpha_est in (0.0, 0.2, 1.5):
        assert distance.with_friction(0.05, m_y, 9.0, alpha_est, 9000.0) == pytest.approx(
            50.0, rel=4 * EPSILON
        )
    assert distance.known_slope(0.05, m_y, 9.0, 0.3, 9000.0) == pytest.approx(50.0, rel=4 * EPSILON)


@given(pushes, slopes, st.floats(0.0, 0.1), rigidities)
def test_mirrored_moment_gives_the_same_distance(theta, phi, alpha_est, C):
    m_y, m_z = np.sin(phi), np.cos(phi)
    for sign in (1, -1):
        assert distance.with_friction(
            theta, sign * m_y, m_z, alpha_est, C
        ) == distance.with_friction(theta, m_y, m_z, alpha_est, C)
    assert distance.known_slope(theta, -m_y, m_z, -0.3, C) == pytest.approx(
        distance.known_slope(theta, m_y, m_z, 0.3, C), nan_ok=True, rel=0
    )


@given(anything, anything, anything, frictions, st.floats(1e-300, 1e300))
def test_a_distance_is_positive_and_finite_or_has_a_reason(theta, m_y, m_z, alpha_est, C):
    """No arguments whatever give a warning, or a negative or infinite distance."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        d_x = distance.with_friction(theta, m_y, m_z, alpha_est, C)
        reason = distance.why_not(theta, m_y, m_z, alpha_est=alpha_est, C=C)
    assert bool(reason) == np.isnan(d_x)
    assert np.isnan(d_x) or 0 < d_x < np.inf


@given(anything, anything, anything, anything, st.floats(1e-300, 1e300), st.floats(1e-300, 1e300))
def test_every_distance_is_positive_and_finite_or_nan(theta, m_y, m_z, beta, C, length):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = [
            distance.no_slip(theta, m_z, C),
            distance.known_slope(theta, m_y, m_z, beta, C),
            distance.frictionless(theta, m_y, m_z, C),
            distance.from_compliance(theta, C),
            *distance.clamp_to_length([theta], length)[:1],
        ]
        reason = distance.why_not(theta, m_y, m_z, beta=beta, C=C)
    assert all(np.isnan(d) or 0 < d < np.inf for d in map(float, np.ravel(np.hstack(found))))
    assert bool(reason) == np.isnan(found[1])


@pytest.mark.parametrize(
    "theta, m_y, m_z, alpha_est, code",
    [
        (0.0, 0.0, 1.0, 0.1, "angle_not_positive"),
        (-0.05, 0.0, 1.0, 0.1, "angle_not_positive"),
        (3.0, 0.0, 1.0, 0.1, "angle_too_large"),
        (0.05, 0.0, 0.0, 0.1, "not_pushing"),
        (0.05, 1.0, -1.0, 0.1, "not_pushing"),
        (0.05, 1.0, 0.1, 0.2, "beyond_friction"),
        (0.05, np.nan, 1.0, 0.1, "value_missing"),
        (0.05, 0.0, np.inf, 0.1, "value_missing"),
    ],
)
def test_each_condition_is_named(theta, m_y, m_z, alpha_est, code):
    assert distance.why_not(theta, m_y, m_z, alpha_est=alpha_est).code == code
    assert np.isnan(distance.with_friction(theta, m_y, m_z, alpha_est, 1.0))


def test_reasons_of_the_known_slope_and_of_the_range():
    assert distance.why_not(0.05, 0.1, 1.0, beta=np.pi / 2).code == "slope_too_steep"
    assert distance.why_not(0.05, -1.0, 1.0, beta=1.2).code == "moments_up_slope"
    assert np.isnan(distance.known_slope(0.05, -1.0, 1.0, 1.2, 1.0))
    assert distance.why_not(0.05, 0.0, 5e-324, C=1e10).code == "distance_out_of_range"
    assert distance.why_not([0.05, -1.0], 0.1, 1.0).tolist() == [
        "",
        distance.ANGLE_NOT_POSITIVE,
    ]


@pytest.mark.parametrize("alpha_est", [-0.1, np.pi / 2, np.nan])
def test_impossible_alpha_est_is_refused_with_name_and_range(alpha_est):
    with pytest.raises(ValueError, match=r"alpha_est = .* must lie in \[0, pi/2\).*90 degrees"):
        distance.with_friction(0.05, 0.1, 1.0, alpha_est, 1.0)


@pytest.mark.parametrize(
    "call",
    [
        lambda bad: distance.no_slip(0.05, 1.0, bad),
        lambda bad: distance.known_slope(0.05, 0.1, 1.0, 0.2, bad),
        lambda bad: distance.clamp_to_length(50.0, bad),
    ],
)
@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_impossible_settings_are_refused(call, bad):
    with pytest.raises(ValueError, match="must be positive and finite"):
        call(bad)


# ---- (1): compliance


@given(distances, st.floats(0.01, 0.1), st.floats(-0.05, 0.05), rigidities)
def test_compliance_does_not_need_the_touch(d_x, theta, touch, C):
    """Two motor angles and their moments give d_x whatever the angle of touch."""
    motor = touch + theta * np.array([0.5, 1.0])
    moment = C / d_x * theta * np.array([0.5, 1.0])
    compliance = distance.rotational_compliance(motor, moment)
    assert distance.from_compliance(compliance, C) == pytest.approx(d_x, rel=1e-11)


def test_compliance_of_noisy_strokes_is_their_regression():
    """10 strokes of 400 samples at 1 % noise: a slope good to √12 · 1 % · √3 / √400 = 0.3 % each, 0.1 % together."""
    rng = np.random.default_rng(8)
    theta = np.linspace(0.0, 0.08, 400)
    moment = 9000.0 / 50.0 * (theta + 0.0008 * rng.normal(size=(10, 400)))
    d_x = distance.from_compliance(distance.rotational_compliance(theta, moment), 9000.0)
    assert d_x.shape == (10,)
    assert d_x.mean() == pytest.approx(50.0, rel=4 * 0.001)


def test_falling_or_level_moment_is_no_compliance():
    assert np.isnan(distance.rotational_compliance([0.01, 0.02], [2.0, 1.0]))
    assert np.isnan(distance.rotational_compliance([0.01, 0.02], [2.0, 2.0]))
    with pytest.raises(ValueError, match="two samples"):
        distance.rotational_compliance(0.1, 0.2)


# ---- (16), (17): other whiskers


def cone_moments(d_x, theta, beta, alpha, C, length):
    """Moments of a slipping cone from the integral over its curvature; small deflections, no formula of (17).

    A force F at d_x bends the beam by F ∫ (d_x − s)² / EI(s) ds, and slip leaves cos β / cos(β − φ) of d_x θ of it.
    """
    phi = max(0.0, beta - alpha)
    give, _ = quad(
        lambda s: (d_x - s) ** 2 / (C / 3 * (1 - s / length) ** 4), 0, d_x, epsabs=0, epsrel=1e-12
    )
    force = d_x * theta * np.cos(beta) / np.cos(beta - phi) / give
    return force * d_x * np.sin(phi), force * d_x * np.cos(phi)


@pytest.mark.parametrize("d_x", [5.0, 30.0, 60.0, 80.0, 95.0])
@pytest.mark.parametrize("beta, alpha", [(0.0, 0.0), (0.5, 0.0), (1.0, 0.2), (0.3, 0.4)])
def test_cone_against_the_bending_integral(d_x, beta, alpha):
    """quad is good to 1e-12, and the cone's tip magnifies that by L / (L − d_x) = 20 at most."""
    m_y, m_z = cone_moments(d_x, 0.02, beta, alpha, 9000.0, 100.0)
    found = cone_distance(0.02, m_y, m_z, alpha, 9000.0, 100.0)
    assert found == pytest.approx(d_x, rel=1e-10)
    if beta <= alpha:
        assert cone_without_slip(9000.0, 100.0)(0.02, m_z) == pytest.approx(d_x, rel=1e-10)


def test_general_form_with_the_cylinder_is_10_and_with_the_cone_is_its_own():
    arguments = (0.05, [0.0, 1.0, -2.0], 3.0, 0.18)
    cylinder = distance.general(*arguments, lambda theta, m: distance.no_slip(theta, m, 9000.0))
    np.testing.assert_allclose(
        cylinder, distance.with_friction(*arguments, 9000.0), rtol=8 * EPSILON
    )
    cone = distance.general(*arguments, cone_without_slip(9000.0, 100.0))
    np.testing.assert_allclose(cone, cone_distance(*arguments, 9000.0, 100.0), rtol=8 * EPSILON)


def test_general_form_as_printed_is_17_on_a_cone_and_12_on_a_cylinder():
    moments = (0.05, np.array([0.0, 1.0, -2.0]), 3.0)
    cone = distance.general_printed(*moments, cone_without_slip(9000.0, 100.0))
    m = np.hypot(moments[1], 3.0)
    printed = 9000.0 * 0.05 * 100.0 / (9000.0 * 0.05 + m * 100.0) * (3.0 / m)
    np.testing.assert_allclose(cone, printed, rtol=8 * EPSILON)
    cylinder = distance.general_printed(
        *moments, lambda theta, m: distance.no_slip(theta, m, 9000.0)
    )
    np.testing.assert_allclose(cylinder, distance.frictionless(*moments, 9000.0), rtol=8 * EPSILON)


@given(pushes, st.floats(-1.2, 1.2), st.floats(0.0, 0.3), rigidities, st.floats(1.0, 1e3))
def test_cone_never_reaches_beyond_its_tip(theta, phi, alpha_est, C, length):
    d_x = cone_distance(theta, 1e-3 * np.sin(phi), 1e-3 * np.cos(phi), alpha_est, C, length)
    assert 0 < d_x <= length


# ---- section VII: the tip, section II: the contact point


def test_beyond_the_tip_is_the_tip_and_flagged():
    d_x, at_tip = distance.clamp_to_length([50.0, 100.0, 130.0, np.nan], 100.0)
    np.testing.assert_array_equal(d_x, [50.0, 100.0, 100.0, np.nan])
    assert at_tip.tolist() == [False, False, True, False]


def test_contact_point_is_radius_touch_and_height():
    assert distance.contact_point(50.0, 0.04, 12.0) == (50.0, 0.04, 12.0)
    assert np.isnan(distance.contact_point(np.nan, 0.04)).all()
    x, y, z = distance.cartesian(*distance.contact_point(50.0, np.pi / 6, 12.0))
    assert (x, y, z) == pytest.approx((50 * np.sqrt(3) / 2, 25.0, 12.0), rel=4 * EPSILON)


def test_scalars_give_floats_and_arrays_broadcast():
    assert type(distance.with_friction(0.05, 1, 3, 0.18, 9000)) is float
    assert distance.with_friction([[0.05], [0.04]], [1.0, 2.0, 3.0], 3.0, 0.18, 9000.0).shape == (
        2,
        3,
    )
