"""Whether an estimator's stated intervals cover its errors, and what so many whisks allow to say of others."""

import numpy as np
import pytest

from bench.analyses.estimator_accuracy import Accuracy, accuracies
from bench.records.trial_result import EstimateRow, FeltWhisk
from tests.scenes.results import seen_whisk, trial_result
from vision.truth.value import Value

D_X_MM = 60.0


@pytest.mark.parametrize(
    "holding, intervals, is_covered",
    [(0, 0, False), (0, 1, False), (1, 1, True), (0, 2, False), (1, 2, True), (19, 20, True)],
)
def test_intervals_of_which_none_holds_cover_nothing(holding, intervals, is_covered):
    """Chance alone says little of one whisk: an error of 200 ± 4 % was covered, in 0 of 1."""
    accuracy = Accuracy("no_slip", intervals, (), (), (), (), intervals, holding, intervals)
    assert accuracy.is_covered == is_covered


def results_of(rng: np.random.Generator, settings: int, whisks: int, of_setting: float):
    """Return results at slopes 5° apart. Errors are of 1 %, the share `of_setting` of their variance that
    of the setting."""
    results = []
    for number in range(settings):
        common = np.sqrt(of_setting) * rng.standard_normal()
        seen = []
        felt = []
        for whisk in range(whisks):
            error = common + np.sqrt(1.0 - of_setting) * rng.standard_normal()
            beta = Value(np.radians(5.0 * number + rng.uniform(-0.5, 0.5)), 0.001)
            seen.append(seen_whisk(whisk, d_x_mm=Value(D_X_MM, 0.01), beta_rad=beta))
            distance_mm = D_X_MM * (1.0 + 0.01 * error)
            half_mm = 0.0196 * D_X_MM
            row = EstimateRow(
                "with_friction",
                Value(distance_mm, 0.01 * D_X_MM),
                d_x_est_sigma_alpha_exact_mm=0.006 * D_X_MM,
                d_x_est_low_mm=distance_mm - half_mm,
                d_x_est_high_mm=distance_mm + half_mm,
            )
            felt.append(FeltWhisk(whisk, estimates=(row,)))
        results.append(trial_result(seen, felt, name=f"b{number}"))
    return results


def test_whisks_of_one_slope_are_one_setting():
    (accuracy,) = accuracies(
        results_of(np.random.default_rng(1), settings=3, whisks=10, of_setting=1.0)
    )
    assert (len(accuracy.judged), accuracy.settings) == (30, 3)


def test_the_stated_sigma_has_a_part_for_friction():
    """0.6 % without it and 1 % in all leave 0.8 %."""
    (accuracy,) = accuracies(
        results_of(np.random.default_rng(1), settings=2, whisks=1, of_setting=1.0)
    )
    parts = accuracy.stated_percent, accuracy.stated_for_friction_percent
    assert parts == pytest.approx((1.0, 0.8))
    assert accuracy.stated_alpha_exact_percent == pytest.approx(0.6)


@pytest.mark.parametrize("settings", [1, 2, 16])
def test_the_range_of_the_rms_holds_that_of_further_settings(settings):
    """Ten whisks share their error: 95 % of 1000 such samples are 93 to 97 % at 3 standard errors."""
    rng = np.random.default_rng(settings)
    held = 0
    for _ in range(1000):
        common = np.repeat(rng.standard_normal(settings), 10)
        accuracy = _with_errors(common, settings)
        low, high = accuracy.rms_range_percent
        held += low <= 1.0 <= high
    assert 930 <= held <= 970


def _with_errors(errors_percent: np.ndarray, settings: int) -> Accuracy:
    """Return the accuracy of an estimator with these errors."""
    accuracy = Accuracy("mine", 1, tuple(errors_percent), (), (), (), 0, 0, settings)
    return _Known(**vars(accuracy))


class _Known(Accuracy):
    """An accuracy whose whisks are errors, per cent, alone."""

    @property
    def errors_percent(self):
        return np.array(self.judged)


def test_the_share_of_intervals_is_that_of_settings():
    """Of two settings whose intervals hold, no more is known than 0.025 ** (1 / 2); by ten whisks each, either."""
    for whisks in (1, 10):
        accuracy = Accuracy("mine", 2, (), (), (), (), 2 * whisks, 2 * whisks, 2)
        assert accuracy.holding_range_percent == pytest.approx((100.0 * 0.025**0.5, 100.0))
    none = Accuracy("mine", 2, (), (), (), (), 2, 0, 2)
    assert none.holding_range_percent == pytest.approx((0.0, 100.0 * (1.0 - 0.025**0.5)))


def test_few_settings_do_not_show_that_intervals_are_too_narrow():
    """Of 20 whisks of one slope 10 intervals hold: chance, where they share an error; of 20 slopes it is none."""
    one = Accuracy("mine", 20, (), (), (), (), 20, 10, 1)
    many = Accuracy("mine", 20, (), (), (), (), 20, 10, 20)
    assert one.is_covered and not many.is_covered
