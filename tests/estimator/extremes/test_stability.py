"""Every equation against mpmath at 50 digits, over the extremes of its domain."""

import pytest

from tests.estimator.extremes.stability import BOUND, CASES, worst


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_error_stays_within_eight_epsilon_of_the_condition(case):
    error, arguments = worst(case, samples=150)
    assert error <= BOUND, arguments
