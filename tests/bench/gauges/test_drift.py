"""Drift of the gauges' zero: told from noise by many strokes, and priced into what is read after touch."""

import numpy as np
import pytest

from bench.gauges.drift import FreeSlope, allow_drift, drift_rate, free_slope
from bench.gauges.felt import FeltStroke

RATE_HZ, SPEED = 2000.0, np.radians(10.0)


def stroke(rng, drift=(0.0, 0.0), noise=0.005) -> FeltStroke:
    """0.16 s of free stroke, then a push; channels in volts."""
    time = np.arange(1240) / RATE_HZ
    motor = SPEED * time
    rise = np.maximum(0.0, motor - SPEED * 0.16)[:, None] * [1.0, 8.0]
    channels = rise + np.outer(time, drift) + noise * rng.normal(size=(len(time), 2))
    return FeltStroke(time, motor, channels, channels)


def test_slope_of_a_free_stroke_and_its_noise(rng):
    """z-scores of 200 strokes with a known drift are standard normal: mean 0 ± 0.2, spread 1 ± 0.15 (3 sigma)."""
    drift = np.array([0.05, -0.02])
    found = [free_slope(stroke(rng, drift)) for _ in range(200)]
    z = np.array([(s.slope - drift) / np.sqrt(s.variance) for s in found])
    assert np.abs(z.mean(axis=0)).max() < 0.25
    assert z.std(axis=0) == pytest.approx([1.0, 1.0], abs=0.2)


def test_rate_is_the_drifts_own_scatter(rng):
    """Drifts of 0.03 V/s RMS under slopes known to 0.01: found within a fifth from 300 strokes."""
    variance = np.full(2, 0.01**2)
    slopes = [FreeSlope(rng.normal(0.0, np.hypot(0.03, 0.01), 2), variance) for _ in range(300)]
    assert drift_rate(slopes) == pytest.approx([0.03, 0.03], rel=0.2)


def test_what_few_strokes_cannot_rule_out_is_allowed(rng):
    """Without drift the rate shrinks with the number of strokes, as their noise over its fourth root."""
    variance = np.full(2, 0.01**2)
    few, many = (drift_rate([FreeSlope(np.full(2, 0.01), variance)] * n) for n in (4, 400))
    assert few == pytest.approx(0.01 * (2 / 4) ** 0.25 * np.ones(2))
    assert many == pytest.approx(0.01 * (2 / 400) ** 0.25 * np.ones(2))
    assert drift_rate([]).tolist() == [0.0, 0.0]


def test_drift_widens_what_is_read_far_from_the_free_stroke(rng):
    one = stroke(rng)
    touch = one.touch
    far = np.radians(3.0)
    steady, wandering = (
        one.at(far, allow_drift(touch, rate, SPEED)) for rate in ([0.0, 0.0], [0.05, 0.05])
    )
    seconds = (touch.motor_rad + far - touch.level.centre_rad) / SPEED
    added = np.diag(wandering.covariance - steady.covariance)
    assert np.sqrt(added) == pytest.approx(0.05 * seconds * np.ones(2), rel=0.1)


def test_no_touch_stays_none(rng):
    silent = stroke(rng, noise=5.0)
    assert free_slope(silent) is None
    assert allow_drift(silent.touch, [1.0, 1.0], SPEED).status


def test_a_zero_that_may_drift_is_in_the_touch_too(rng):
    """As far from the free stroke as touch is: drift times that, through the rise's slope."""
    one = stroke(rng)
    steady, wandering = (allow_drift(one.touch, rate, SPEED) for rate in ([0.0, 0.0], [0.05, 0.05]))
    seconds = (steady.motor_rad - steady.level.centre_rad) / SPEED
    added = np.linalg.norm(steady.rise.gain) * 0.05 * seconds
    assert wandering.sigma_rad == pytest.approx(np.hypot(steady.sigma_rad, added), rel=1e-6)


def test_touch_and_moments_may_be_one_whisks(rng):
    """θ's sigma, its covariance with the moments and theirs make a covariance, at small angles and large drifts too."""
    one = stroke(rng)
    touch = allow_drift(one.touch, [0.3, 0.3], SPEED)
    at = one.at(np.radians(0.3), touch)
    whole = np.block(
        [[touch.sigma_rad**2, at.theta_covariance], [at.theta_covariance[:, None], at.covariance]]
    )
    scale = np.sqrt(np.diag(whole))
    assert np.linalg.eigvalsh(whole / np.outer(scale, scale)).min() > -1e-9


def test_fast_strokes_tell_little_of_the_drift(rng):
    """Strokes nine times as fast have 27 times the slope's sigma; the slow ones alone tell as much."""
    slow = [FreeSlope(rng.normal(0.0, 0.01, 2), np.full(2, 0.01**2)) for _ in range(100)]
    fast = [FreeSlope(rng.normal(0.0, 0.27, 2), np.full(2, 0.27**2)) for _ in range(100)]
    assert drift_rate([*slow, *fast]) == pytest.approx(drift_rate(slow), rel=0.05)
