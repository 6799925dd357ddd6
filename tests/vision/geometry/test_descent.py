"""The least value of a smooth function of a few parameters, and fits that do not converge."""

import numpy as np
import pytest

from vision.geometry.newton import descend, gauss_newton
from vision.geometry.refusals import Refused

STEPS, LONGEST = np.array([0.1, 0.1]), np.array([0.5, 0.5])


def test_a_quadratic_is_left_at_its_least_value_with_its_curvature():
    curvature, least = np.array([[4.0, 1.0], [1.0, 2.0]]), np.array([0.3, -1.2])
    function = lambda q: 0.5 * (q - least) @ curvature @ (q - least) + 7.0  # noqa: E731
    found, value, second = descend(function, np.zeros(2), STEPS, LONGEST, 1e-3)
    # differences of a quadratic are exact but for rounding over the square of a step
    assert found == pytest.approx(least, abs=1e-9)
    assert value == pytest.approx(7.0, abs=1e-12)
    assert second == pytest.approx(curvature, abs=1e-9)


def test_from_a_saddle_it_goes_downhill():
    """Newton's step alone would stay on the ridge."""
    function = lambda q: (q[0] ** 2 - 1.0) ** 2 + q[1] ** 2  # noqa: E731
    found, value, _ = descend(function, np.array([0.1, 0.4]), STEPS, LONGEST, 1e-3)
    # fourth derivatives of 24 and steps of 0.1: differences err by 24 h² / 6 in the slope, so 0.04 / 8 in place
    assert np.abs(found) == pytest.approx([1.0, 0.0], abs=0.01)
    assert value < 1e-3


def test_where_nothing_is_lower_it_stays():
    found, value, _ = descend(lambda q: float(q @ q), np.zeros(2), STEPS, LONGEST, 1e-3)
    assert np.array_equal(found, np.zeros(2)) and value == 0.0


def test_a_descent_without_end_is_refused():
    falling = lambda q: float(np.exp(-q).sum())  # noqa: E731
    with pytest.raises(Refused) as refused:
        descend(falling, np.zeros(2), STEPS, LONGEST, 1e-3)
    assert refused.value.code == "fit_not_converged"


def test_a_fit_says_whether_it_has_converged():
    """A line takes two rounds: one to get there and one that hardly moves."""
    residuals_of = lambda vectors: vectors - 0.5  # noqa: E731
    wide, steps = np.full(2, 1e6), np.full(2, 1e-6)
    for rounds, has_converged in ((1, False), (2, True)):
        found, said = gauss_newton(residuals_of, wide, steps, rounds, 1e6)
        assert said is has_converged
        assert found == pytest.approx(0.5, abs=1e-6)


def test_a_descent_to_where_nothing_is_defined_is_refused():
    """As a fit of edges that shrinks a bar until no pixel is left of it."""
    shrinking = lambda q: float(q.sum()) if np.all(q > -1.0) else np.nan  # noqa: E731
    with pytest.raises(Refused) as refused:
        descend(shrinking, np.zeros(2), STEPS, LONGEST, 1e-3)
    assert refused.value.code == "fit_not_converged"
