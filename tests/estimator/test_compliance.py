"""Distance and stiffness of yielding objects from two distances."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimator import compliance, distance

pytestmark = pytest.mark.filterwarnings("error")

C = 8835.7


def felt_compliance(d_x, stiffness, taper_per_mm=0.0):
    """k_θ by balancing forces: the whisker's spring C (1 − τ d_x)/d_x³ and the object's share the deflection d_x θ."""
    theta, whisker_spring = 0.05, C * (1 - taper_per_mm * d_x) / d_x**3
    force = d_x * theta / (1 / whisker_spring + 1 / stiffness)
    return theta / (force * d_x)


@given(st.floats(20, 80), st.floats(0.02, 10), st.floats(1, 20))
def test_two_distances_give_distance_and_stiffness(d_x, stiffness, shift):
    """Two compliances that differ by a share s lose a factor 1/s of the digits: 1e-15 · (80/1)² · 10 in d, and the
    stiffness those of k_θ − d/C besides."""
    near, far = felt_compliance(d_x, stiffness), felt_compliance(d_x + shift, stiffness)
    found, found_stiffness = compliance.two_distances(near, far, shift, C)
    assert found == pytest.approx(d_x, rel=1e-10)
    assert found_stiffness == pytest.approx(stiffness, rel=1e-6)


@given(st.floats(20, 60), st.floats(0.02, 10), st.floats(5, 20), st.floats(1e-3, 1e-2))
def test_two_distances_of_a_whisker_that_tapers(d_x, stiffness, shift, taper):
    """The same of cones cut off anywhere, the tip at 100 mm; a quartic's root keeps three digits fewer."""
    near, far = (felt_compliance(d, stiffness, taper) for d in (d_x, d_x + shift))
    assert near == pytest.approx(
        compliance.compliance_on_soft_object(d_x, stiffness, C, taper), rel=1e-12
    )
    found, found_stiffness = compliance.two_distances(near, far, shift, C, taper)
    assert found == pytest.approx(d_x, rel=1e-7)
    assert found_stiffness == pytest.approx(stiffness, rel=1e-3)
    assert compliance.give(d_x, near, C, taper) == pytest.approx(1 / stiffness, rel=1e-6)


def test_forward_model_is_springs_in_series():
    assert compliance.compliance_on_soft_object(60.0, 0.3, C) == pytest.approx(
        felt_compliance(60.0, 0.3), rel=1e-14
    )
    assert np.isnan(compliance.compliance_on_soft_object(-60.0, 0.3, C))


def test_rigid_object_is_equation_1():
    near, far = 60.0 / C, 70.0 / C
    d_x, stiffness = compliance.two_distances(near, far, 10.0, C)
    assert d_x == pytest.approx(60.0, rel=1e-12)
    assert stiffness > 1e9
    assert distance.from_compliance(near, C) == pytest.approx(60.0, rel=1e-15)


def test_noise_on_a_rigid_object_leaves_a_distance_and_infinite_stiffness():
    """0.1 % less compliance than a rigid object would have asks for a negative give, which is none."""
    d_x, stiffness = compliance.two_distances(0.999 * 60.0 / C, 70.0 / C, 10.0, C)
    assert d_x == pytest.approx(60.0, rel=0.01)
    assert stiffness == np.inf


def test_soft_object_looks_too_far_away_by_equation_1():
    assert distance.from_compliance(felt_compliance(60.0, 0.3), C) > 60.0


@pytest.mark.parametrize("near, far", [(0.001, 0.1), (np.nan, 0.01), (-0.01, 0.01), (0.01, np.inf)])
def test_compliances_of_no_object_are_nan(near, far):
    assert np.isnan(compliance.two_distances(near, far, 10.0, C)).all()


@pytest.mark.parametrize("taper, draws", [(0.0, 5000), (0.01, 1000)])
def test_sigma_is_the_sampled_scatter(taper, draws):
    """0.1 % noise of both compliances; 1000 draws are good to 2.2 %, curvature to 3 %."""
    rng = np.random.default_rng(4)
    near, far = felt_compliance(60.0, 0.3, taper), felt_compliance(75.0, 0.3, taper)
    near_sigma, far_sigma = 1e-3 * near, 1e-3 * far
    drawn = compliance.two_distances(
        near + near_sigma * rng.normal(size=draws),
        far + far_sigma * rng.normal(size=draws),
        15.0,
        C,
        taper,
    )
    d_sigma, give_sigma = compliance.two_distances_spread(
        60.0, 1 / 0.3, 15.0, C, near_sigma, far_sigma, 0.0, taper
    )
    predicted = d_sigma, give_sigma * 0.3**2
    np.testing.assert_allclose([np.std(values) for values in drawn], predicted, rtol=0.07)


def test_impossible_settings_are_refused():
    with pytest.raises(ValueError, match="shift = 0"):
        compliance.two_distances(0.01, 0.02, 0.0, C)
    with pytest.raises(ValueError, match="C = -1"):
        compliance.two_distances(0.01, 0.02, 1.0, -1.0)
