"""What whisks of a session share of d_x's error, and what each has of its own."""

import numpy as np
import pytest

from bench.analyses.estimator_accuracy import truth_uncertainty
from bench.report.page.words import distance_text
from bench.report.summary.shared import scatter_warnings, shared_distance, shared_lines
from tests.scenes.results import seen_whisk, trial_result
from vision.truth.records import SharedSigmas
from vision.truth.value import Value

SHARED_MM, OWN_MM = 0.008, 0.002


def session(rng, trials, a_trial, own_mm=OWN_MM):
    """Results of whisks whose stated own part is OWN_MM, and which scatter by own_mm."""
    shared = SharedSigmas(1e-4, SHARED_MM, 2e-3, 2e-3, np.array([SHARED_MM, 0.0, 0.06]))
    off = SHARED_MM * rng.standard_normal()
    results = []
    for _ in range(trials):
        errors = off + own_mm * rng.standard_normal(a_trial)
        sigma = float(np.hypot(SHARED_MM, OWN_MM))
        whisks = [
            seen_whisk(
                k,
                d_x_mm=Value(60.0 + e, sigma),
                shared=shared,
                touch_rad=Value(0.04, 2e-4),
                beta_rad=Value(0.5, 3e-3),
                point_mm=Value(np.zeros(3), np.array([sigma, 0.01, 0.061])),
            )
            for k, e in enumerate(errors)
        ]
        results.append(trial_result(whisks))
    return results


def test_a_mean_over_whisks_is_known_to_what_they_share():
    """Over 400 sessions of 12 whisks the error of the mean scatters as stated; a fortieth is its sampling error, three
    of them allowed. Taken for independent, it would be stated 3.5 times too narrow."""
    rng = np.random.default_rng(3)
    made = [session(rng, 4, 3) for _ in range(400)]
    found = shared_distance(made[0])
    assert found.shared_mm == pytest.approx(SHARED_MM) and found.own_mm == pytest.approx(OWN_MM)
    means = [
        np.mean([w.d_x_mm.value for result in one for w in result.seen.whisks]) - 60.0
        for one in made
    ]
    assert np.std(means) == pytest.approx(found.mean_sigma_mm, rel=3 / np.sqrt(2 * 400))


def test_scatter_within_recordings_tests_the_own_part():
    rng = np.random.default_rng(4)
    sound = [list(scatter_warnings(session(rng, 4, 3))) for _ in range(300)]
    assert sum(map(len, sound)) <= 2  # one in a thousand
    (line,) = scatter_warnings(session(rng, 4, 10, own_mm=3 * OWN_MM))
    assert "mm is stated as each whisk's own" in line


def test_a_distance_is_stated_with_both_parts():
    (made,) = session(np.random.default_rng(6), 1, 1)
    (seen,) = made.seen.whisks
    assert seen.d_x_own_sigma_mm == pytest.approx(OWN_MM)
    assert distance_text(seen) == f"{seen.d_x_mm.value:.4f} ± 0.0020 ± 0.0080"
    alone = seen_whisk(0, d_x_mm=Value(60.0, 0.01))
    assert distance_text(alone) == "60.000 ± 0.010"


def test_the_truth_of_several_whisks_is_known_in_two_parts():
    two = truth_uncertainty(session(np.random.default_rng(7), 1, 2))
    assert two.d_x_text == "± 0.002 mm (each whisk's own) and ± 0.008 mm (shared by all)"
    one = truth_uncertainty(session(np.random.default_rng(7), 1, 1))
    assert one.d_x_text == "± 0.0082 mm"


def test_single_whisks_say_nothing_of_their_scatter():
    rng = np.random.default_rng(5)
    line, parts = shared_lines(session(rng, 3, 1))
    assert "one error that all 3 whisks share" in line
    assert "contact z 0.060 and 0.011 mm" in parts and "touch 0.0057 and 0.0099 deg" in parts
    assert (
        list(shared_lines(session(rng, 1, 1))) == list(scatter_warnings(session(rng, 3, 1))) == []
    )
