"""Moments at a pushing angle, their covariance, and the distance's sigma from it all."""

import numpy as np
import pytest

from estimator import uncertainty
from estimator.onset import NO_RISE, FeltTouch
from estimator.signal import NOT_REACHED, felt_touch, moment_at

pytestmark = pytest.mark.filterwarnings("error")

THETA = np.radians(3.0)
CASES = {
    "steel": {},
    "60 degrees": {"slopes": (0.08, 0.08)},
    "strong hum": {"hum": 0.005},
    "stick and slip": {"stick_slip": 0.3},
    "90 degrees a second": {"speed": 90.0, "start": -15.0, "end": 20.0, "touch": 0.0},
}


def felt(s, theta=THETA):
    touch = felt_touch(*s.arrays, s.time_s)
    return touch, moment_at(theta, *s.arrays, touch, time_s=s.time_s)


def test_without_noise_the_moments_are_the_slopes_times_the_angle(stroke):
    s = stroke(np.random.default_rng(0), noise=0.0, hum=0.0, encoder=1e-9)
    for degrees in (0.5, 1.0, 3.0, 4.6):
        _, at = felt(s, np.radians(degrees))
        np.testing.assert_allclose(at.values, s.slopes * degrees, rtol=1e-7)


@pytest.mark.parametrize("name", CASES)
def test_covariance_covers_the_scatter(stroke, name):
    """60 strokes; moments are compared at the felt angle, so that the touch's own error is apart. The sigma is for what
    may drift, too, so it may be twice the scatter, but never less than 0.7 of it."""
    rng = np.random.default_rng(7)
    scores = []
    for _ in range(60):
        s = stroke(rng, **CASES[name])
        touch, at = felt(s)
        expected = s.slopes * (np.degrees(touch.motor_rad + THETA) - s.touch_deg)
        across = s.slopes / np.hypot(*s.slopes)
        scores.append(across @ (at.values - expected) / np.sqrt(across @ at.covariance @ across))
    assert abs(np.mean(scores)) < 4 / np.sqrt(60)
    assert 0.3 < np.std(scores) < 1.4


@pytest.mark.parametrize("name", CASES)
def test_sigma_of_the_distance_covers_its_scatter(stroke, name):
    """Through touch, moment and what they share: d_x ∝ θ/m of the moment across the surface."""
    rng = np.random.default_rng(8)
    scores = []
    for _ in range(60):
        s = stroke(rng, **CASES[name])
        touch, at = felt(s)
        size = np.hypot(*s.slopes)
        across = s.slopes / size
        C = size * np.degrees(1)
        sigma = uncertainty.sigma(
            uncertainty.gradient_no_slip(THETA, across @ at.values, C),
            theta_sigma=touch.sigma_rad,
            covariance=np.diag([0.0, across @ at.covariance @ across]),
            theta_moment_covariance=[0.0, across @ at.theta_covariance],
        )
        scores.append((C * THETA / (across @ at.values) - 1) / sigma)
    assert abs(np.mean(scores)) < 4 / np.sqrt(60)
    assert 0.4 < np.std(scores) < 1.4
    assert np.abs(scores).max() < 4.5


def test_level_error_is_shared_by_touch_and_moment(stroke):
    """A level too high makes the touch late, so the pushing angle and the moment small alike: positive covariance."""
    _, at = felt(stroke(np.random.default_rng(9)))
    assert (at.theta_covariance > 0).all()
    correlation = at.theta_covariance / np.sqrt(np.diag(at.covariance))
    assert (correlation < felt(stroke(np.random.default_rng(9)))[0].sigma_rad).all()


def test_covariance_is_positive_definite_and_scales_with_the_unit(stroke):
    s = stroke(np.random.default_rng(10))
    _, volts = felt(s)
    touch = felt_touch(s.motor_rad, 10.0 * s.moments, s.time_s)
    moments = moment_at(THETA, s.motor_rad, 10.0 * s.moments, touch, time_s=s.time_s)
    np.testing.assert_allclose(moments.values, 10.0 * volts.values, rtol=1e-9)
    np.testing.assert_allclose(moments.covariance, 100.0 * volts.covariance, rtol=1e-6, atol=1e-12)
    assert (np.linalg.eigvalsh(volts.covariance) > 0).all()


def test_one_channel_gives_one_value(stroke):
    s = stroke(np.random.default_rng(11))
    touch = felt_touch(s.motor_rad, s.moments[:, 1])
    at = moment_at(THETA, s.motor_rad, s.moments[:, 1], touch)
    assert at.values.shape == (1,)
    assert at.covariance.shape == (1, 1)


def test_beyond_the_stroke_there_is_no_moment(stroke):
    s = stroke(np.random.default_rng(12))
    _, at = felt(s, np.radians(6.0))
    assert at.status == NOT_REACHED
    assert np.isnan(at.values).all()
    assert np.isnan(at.covariance).all()


def test_without_touch_there_is_no_moment(stroke):
    s = stroke(np.random.default_rng(13))
    at = moment_at(THETA, *s.arrays, FeltTouch.none(NO_RISE))
    assert at.status == NO_RISE
    assert np.isnan(at.values).all()


def test_a_pushing_angle_that_is_none_is_refused(stroke):
    s = stroke(np.random.default_rng(14))
    with pytest.raises(ValueError, match="theta_rad = 0"):
        moment_at(0.0, *s.arrays, felt_touch(*s.arrays))


def test_gaps_at_the_pushing_angle_are_bridged_or_told(stroke):
    s = stroke(np.random.default_rng(15))
    touch, whole = felt(s)
    near = np.abs(s.motor_rad - touch.motor_rad - THETA) < np.radians(0.2)
    s.moments[near] = np.nan
    at = moment_at(THETA, *s.arrays, touch, time_s=s.time_s)
    np.testing.assert_allclose(at.values, whole.values, atol=5 * np.sqrt(at.covariance.max()))
    s.moments[np.abs(s.motor_rad - touch.motor_rad - THETA) < np.radians(0.6)] = np.nan
    assert moment_at(THETA, *s.arrays, touch, time_s=s.time_s).status != ""


def test_a_coarse_encoder_costs_no_more_than_a_fraction_of_its_step(stroke):
    """Steps of 0.1° are 20 samples, rounded to their middles: the fits see a line with a saw of ± 0.05° on it, whose
    mean over a window of 1° is off by less than the rounding of its ends, 0.1°/10."""
    s = stroke(np.random.default_rng(16), encoder=0.1)
    touch, at = felt(s)
    assert np.degrees(touch.motor_rad) == pytest.approx(
        2.3, abs=0.01 + 3 * np.degrees(touch.sigma_rad)
    )
    np.testing.assert_allclose(at.values, s.slopes * 3.0, rtol=0.01)


def test_an_encoder_of_one_step_in_the_window_does_no_harm(stroke):
    """No spread of angles, no line: the window's mean is taken, and no warning comes."""
    s = stroke(np.random.default_rng(17))
    touch = felt_touch(*s.arrays, s.time_s)
    flat = np.where(
        np.abs(s.motor_rad - touch.motor_rad - THETA) < np.radians(0.5),
        touch.motor_rad + THETA,
        s.motor_rad,
    )
    at = moment_at(THETA, flat, s.moments, touch, half_window_rad=np.radians(0.4))
    np.testing.assert_allclose(at.values, s.slopes * 3.0, rtol=0.03)
