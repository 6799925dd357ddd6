"""Means over whisks are no surer than what these share; many tests together are wrong no more often than one."""

import numpy as np
import pytest
from scipy.special import ndtr

from bench.base.combined import (
    NOTHING,
    Measurement,
    Measurements,
    add_common,
    add_variances,
    between_settings,
    harmonic_mean_chance,
    holm,
    independent,
    student_factor,
)
from estimator.uncertainty import Z_95


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def test_own_errors_average_and_shared_ones_do_not():
    """Ten whisks of one setting, sigma 1 of each, 2 of the setting, 3 of all."""
    whisk = Measurement(5.0, 1.0, 2.0, (3.0,))
    mean = Measurements.of([("a", whisk)] * 10).mean()
    assert mean.value == 5.0 and mean.settings == 1
    assert mean.sigma == pytest.approx(np.sqrt(0.1 + 4.0 + 9.0))
    ten = Measurements.of((str(k), whisk) for k in range(10)).mean()
    assert ten.sigma == pytest.approx(np.sqrt(0.1 + 0.4 + 9.0))


def test_causes_with_opposite_signs_cancel():
    one, other = Measurement(1.0, 0.1, common=(0.5,)), Measurement(1.0, 0.1, common=(-0.5,))
    assert Measurements.of([("a", one), ("b", other)]).mean().sigma == pytest.approx(0.1 / 2**0.5)


def test_a_whisk_with_fewer_causes_has_none_of_the_others():
    whisks = [("a", Measurement(1.0, 0.1, common=(0.5, 0.3))), ("b", Measurement(1.0, 0.1))]
    assert Measurements.of(whisks).common.tolist() == [[0.5, 0.3], [0.0, 0.0]]


def test_what_is_not_known_is_left_out():
    assert Measurements.of([("a", Measurement(np.nan, 1.0))]).mean() == NOTHING
    known = Measurements.of([("a", Measurement(2.0, 1.0)), ("b", Measurement(3.0, np.nan))])
    assert known.mean().value == 2.0


def test_the_better_known_setting_counts_more():
    mean = independent(np.array([1.0, 2.0]), np.array([1.0, 2.0])).mean()
    assert mean.value == pytest.approx((4 * 1.0 + 2.0) / 5)


def test_a_lucky_scatter_makes_no_mean_surer_than_it_is_stated():
    assert independent(np.full(4, 2.0), np.full(4, 0.1)).mean().sigma == pytest.approx(0.05)


def test_the_scatter_of_three_settings_counts_by_students_t():
    """Student's t of two degrees of freedom is 4.303 at 95 %."""
    mean = independent(np.array([0.0, 3.0, 6.0]), np.full(3, 1e-3)).mean()
    assert mean.standard_error == pytest.approx(np.sqrt(3.0), rel=1e-6)
    assert mean.sigma == pytest.approx(np.sqrt(3.0) * 4.3027 / Z_95, rel=1e-4)


@pytest.mark.parametrize("of_setting, stated", [(0.0, True), (2.0, True), (2.0, False)])
def test_the_interval_holds_as_often_as_it_says(rng, of_setting, stated):
    """Eight settings of three whisks, one common cause: of 1000 draws 95 % hold, 0.7 % one sigma; an interval by a
    scatter or by what is stated, whichever is more, holds up to 2 % more often."""
    held = 0
    for _ in range(1000):
        cause = rng.normal()
        whisks = []
        for setting in range(8):
            of_this = of_setting * rng.normal()
            for _ in range(3):
                value = rng.normal() + of_this + 0.5 * cause
                whisks.append(
                    (setting, Measurement(value, 1.0, of_setting if stated else 0.0, (0.5,)))
                )
        mean = Measurements.of(whisks).mean()
        held += abs(mean.value) < Z_95 * mean.sigma
    assert 0.93 < held / 1000 < 0.99


def test_a_chance_is_that_of_students_t():
    mean = Measurements.of([("a", Measurement(1.96, 1.0))]).mean()
    assert mean.chance == pytest.approx(0.05, abs=1e-4)
    assert Measurements.of([("a", Measurement(0.0, 0.0))]).mean().chance == 1.0


def test_degrees_of_freedom_are_those_of_welch_and_satterthwaite():
    both = add_variances((1.0, 4.0), (1.0, 4.0))
    assert both.variance == 2.0 and both.freedom == pytest.approx(8.0)
    assert add_common(1.0, 3.0, np.array([np.nan])).freedom == pytest.approx(3.0)
    assert add_common(1e-9, 1.0, np.array([1.0])).freedom == np.inf
    assert student_factor(np.inf) == 1.0 and student_factor(4.0) == pytest.approx(
        2.776 / Z_95, rel=1e-3
    )


def test_holm_steps_down_and_stops_at_the_first_that_fails():
    """0.01 of four passes 0.05/4, 0.02 fails 0.05/3; what follows falls with it."""
    assert holm([0.02, 0.01, np.nan, 0.04, 0.9], 0.05).tolist() == [
        False,
        True,
        False,
        False,
        False,
    ]
    assert holm([0.01, 0.012, 0.02], 0.05).all() and not len(holm([], 0.05))


def test_of_many_tests_of_nothing_one_session_in_twenty_says_anything(rng):
    """500 sessions of 100 tests: 5 %, 1 % one sigma."""
    sessions = [holm(rng.uniform(size=100), 0.05).any() for _ in range(500)]
    assert 0.02 < np.mean(sessions) < 0.08


@pytest.mark.parametrize("shared", [0.0, 0.7, 1.0])
def test_tests_that_share_their_error_are_wrong_together_as_often_as_one(rng, shared):
    """20,000 times ten tests, from independent to ten times the same: 1 %, 0.07 % one sigma."""
    own = rng.normal(size=(20_000, 10))
    common = rng.normal(size=(20_000, 1))
    z = np.sqrt(shared) * common + np.sqrt(1.0 - shared) * own
    chances = [harmonic_mean_chance(row) for row in 2.0 * ndtr(-np.abs(z))]
    assert 0.006 < np.mean(np.array(chances) < 0.01) < 0.014
    assert harmonic_mean_chance([0.0, 0.5]) < 1e-300


def test_settings_that_differ_have_a_variance_of_their_own(rng):
    """Thirty settings of four whisks, 2 beyond a sigma of 1, about a line: 2 comes back within a quarter (13 % a
    standard deviation); nothing where they differ by no more."""
    settings = np.repeat(np.arange(30), 4)
    design = np.vander(np.linspace(0.0, 1.0, 120), 2)
    noise = rng.normal(size=120)
    differing = noise + 2.0 * rng.normal(size=30)[settings]
    found = between_settings(differing, np.eye(120), design, settings)
    assert np.sqrt(found[0, 3]) == pytest.approx(2.0, rel=0.4) and found[0, 4] == 0.0
    alike = between_settings(np.zeros(120), np.eye(120), design, settings)
    assert not alike.any()
    known_alone = np.diag([1e-40, 1e40])
    lone = between_settings(np.array([1.0, 2.0]), known_alone, np.ones((2, 1)), ["a", "b"])
    assert not lone.any()  # a setting of which nothing is known does not differ
    one = between_settings(noise, np.eye(120), np.ones((120, 1)), ["a"] * 120)
    assert not one.any()
