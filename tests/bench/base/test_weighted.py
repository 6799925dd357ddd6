"""Means of values with a cause in common do not gain by their number; those of independent ones do."""

import numpy as np
import pytest

from bench.base.weighted import independent_mean, weighted_mean

SIGMAS = np.array([0.1, 0.1, 0.1, 0.1])


def test_sigma_of_values_that_agree():
    values = np.full(4, 2.0)
    assert weighted_mean(values, SIGMAS) == pytest.approx((2.0, 0.1))
    assert independent_mean(values, SIGMAS) == pytest.approx((2.0, 0.05))


@pytest.mark.parametrize("mean", [weighted_mean, independent_mean])
def test_scatter_counts_where_it_is_larger(mean):
    assert mean(np.array([0.0, 4.0, 0.0, 4.0]), SIGMAS)[1] >= 1.0


def test_the_better_known_value_counts_more():
    value, _ = weighted_mean(np.array([1.0, 2.0]), np.array([0.1, 0.2]))
    assert value == pytest.approx((1.0 * 4 + 2.0) / 5)
