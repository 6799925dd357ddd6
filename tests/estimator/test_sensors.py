"""Table I's other sensors: what each reads, what it does not feel, and intervals that hold."""

from dataclasses import replace

import numpy as np
import pytest

from estimator import slip
from estimator.beam import Beam
from estimator.onset import NO_RISE
from estimator.readings import force_at, rate_at
from estimator.sensors import NO_CELL, NO_RATE, force_and_moment, moment_rate, touch_alone
from estimator.signal import FeltTouch, felt_touch
from estimator.whisk import EstimatorSettings, OtherSensors, Whisk

BEAM = Beam(8835.7, 100.0)
THETA, BETA, ALPHA, D_X = *np.radians([3.0, 50.0, 10.0]), 60.0
M_Y, M_Z = slip.moments(D_X, THETA, BETA, ALPHA, BEAM.C_Nmm2)
FORCE = np.array([0.0, M_Z, -M_Y]) / D_X
TOLD = EstimatorSettings(ALPHA)


def whisk(
    *, force=FORCE, force_sigma=1e-4, rate=(M_Y / THETA, M_Z / THETA), scale_sigma=0.0
) -> Whisk:
    others = OtherSensors(
        np.array(force), force_sigma**2 * np.eye(3), scale_sigma, np.array(rate), np.eye(2) * 1e-2
    )
    return Whisk(*(np.zeros(0),) * 4, THETA, M_Y, M_Z, 1e-6 * np.eye(2), 1e-3, BEAM, others=others)


def test_touch_alone_knows_the_whiskers_length(rng):
    """Of places anywhere along the whisker 95 % are within: 4000 drawn, three of their standard deviations."""
    estimate = touch_alone(whisk(), TOLD)
    places = rng.uniform(0.0, BEAM.length_mm, 4000)
    inside = np.mean((estimate.low_mm <= places) & (places <= estimate.high_mm))
    assert inside == pytest.approx(0.95, abs=3 * np.sqrt(0.95 * 0.05 / 4000))
    assert np.sqrt(np.mean((places - estimate.d_x_mm) ** 2)) == pytest.approx(
        estimate.sigma_mm, rel=0.05
    )


def test_the_rate_of_the_moment_is_10_without_an_angle_of_touch():
    estimate = moment_rate(whisk(), TOLD)
    assert estimate.d_x_mm == pytest.approx(D_X, rel=1e-6)
    assert np.degrees(estimate.beta_rad) == pytest.approx(50.0)
    exact_touch = replace(whisk(), theta_sigma_rad=0.0)
    assert moment_rate(exact_touch, TOLD).sigma_mm == pytest.approx(estimate.sigma_mm)


def test_force_and_moment_need_no_friction():
    """To the deflection's θ²/2: 0.2 %."""
    for alpha in (0.0, 0.3):
        assert force_and_moment(whisk(), EstimatorSettings(alpha)).d_x_mm == pytest.approx(
            D_X, rel=2.5e-3
        )


def test_newtons_that_disagree_widen_force_and_moment():
    narrow, wide = (force_and_moment(whisk(scale_sigma=s), TOLD).sigma_mm for s in (0.0, 0.02))
    assert np.sqrt(wide**2 - narrow**2) == pytest.approx(0.02 * D_X, rel=2.5e-3)


def test_the_interval_of_force_and_moment_is_one_over_the_forces(rng):
    """A cell a tenth as good as the force is large: of 1000 draws 95 % hold, within three standard deviations; the
    far side is longer than the near one."""
    sigma = 0.1 * np.linalg.norm(FORCE)
    held, sides = [], []
    for _ in range(1000):
        one = force_and_moment(
            whisk(force=FORCE + sigma * rng.normal(size=3), force_sigma=sigma), TOLD
        )
        held.append(one.low_mm <= 1.0014 * D_X <= one.high_mm)
        sides.append(one.high_mm - one.d_x_mm > one.d_x_mm - one.low_mm)
    assert np.mean(held) == pytest.approx(0.95, abs=3 * np.sqrt(0.95 * 0.05 / 1000))
    assert np.mean(sides) > 0.95


def test_a_force_within_its_noise_leaves_a_near_end_alone():
    weak = force_and_moment(whisk(force_sigma=2 * np.linalg.norm(FORCE)), TOLD)
    assert weak.high_mm == BEAM.length_mm and 0 < weak.low_mm < weak.d_x_mm


def test_beyond_the_tip_is_the_tip():
    far = force_and_moment(whisk(force=0.5 * FORCE), TOLD)
    assert (
        far.d_x_mm == BEAM.length_mm and far.status.code == "tip_contact" and far.gradient is None
    )


def test_what_was_not_recorded_is_a_reason():
    bare = replace(whisk(), others=None)
    assert (moment_rate(bare, TOLD).status, force_and_moment(bare, TOLD).status) == (
        NO_RATE,
        NO_CELL,
    )
    reversed_cell = force_and_moment(whisk(force=-FORCE), TOLD)
    assert np.isnan(reversed_cell.d_x_mm) and reversed_cell.status.code == "force_unlike_moment"


def test_rate_and_force_scatter_as_stated(stroke, rng):
    """25 strokes: a standard deviation of them is known to 14 %, the stated one scatters besides; three of both. That
    nothing drifts is known, as a session's strokes together tell it."""
    rates, forces = [], []
    for _ in range(25):
        made = stroke(rng, hum=0.0)
        touch = felt_touch(*made.arrays, made.time_s)
        touch = replace(touch, level=replace(touch.level, drift=np.zeros(2)))
        noise = 0.01 * rng.normal(size=(len(made.moments), 3))
        cell = 2.0 * np.column_stack([made.moments, made.moments[:, 0]]) + noise
        rates.append(_first(*rate_at(THETA, *made.arrays, touch)))
        read = force_at(THETA, made.motor_rad, cell, touch, drift=np.zeros(3))
        forces.append(_first(read.values, read.covariance))
    for found, true in ((np.array(rates), np.degrees(0.25)), (np.array(forces), 2 * 3.0 * 0.25)):
        assert found[:, 0].mean() == pytest.approx(true, rel=0.02)
        assert np.std(found[:, 0]) == pytest.approx(np.sqrt(np.mean(found[:, 1])), rel=0.5)


def _first(values, covariance) -> tuple[float, float]:
    """The second channel and its variance."""
    return values[1], covariance[1, 1]


def test_without_a_touch_nothing_is_read():
    none, angles, samples = (
        FeltTouch.none(NO_RISE),
        np.linspace(0, 0.1, 50),
        np.zeros((50, 3)),
    )
    assert force_at(THETA, angles, samples, none).status == NO_RISE
    assert np.isnan(rate_at(THETA, angles, samples, none)[0]).all()
