"""Whether an estimator's stated intervals cover its errors."""

import pytest

from bench.analyses.estimator_accuracy import Accuracy


@pytest.mark.parametrize(
    "holding, intervals, is_covered",
    [(0, 0, False), (0, 1, False), (1, 1, True), (0, 2, False), (1, 2, True), (19, 20, True)],
)
def test_intervals_of_which_none_holds_cover_nothing(holding, intervals, is_covered):
    """Chance alone says little of one whisk: an error of 200 ± 4 % was covered, in 0 of 1."""
    accuracy = Accuracy("no_slip", intervals, (), (), (), (), intervals, holding)
    assert accuracy.is_covered == is_covered
