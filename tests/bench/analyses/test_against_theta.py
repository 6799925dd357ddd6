"""Error and sigma against the pushing angle: pooled over sound whisks, and where the error is least."""

from dataclasses import replace

import numpy as np
import pytest

from bench.analyses.against_theta import AgainstTheta, ThetaErrors, against_theta, least_error
from bench.records.trial_result import EstimateRow, FeltAt, TrialResult
from tests.scenes.friction_results import result
from vision.truth.value import Value


def with_errors(whisk: TrialResult, errors_mm: dict[float, float], status: str = "") -> TrialResult:
    """The whisk with estimates that err by so much at these θ, in degrees; sigma 0.3 mm, 0.1 mm with α_est exact."""
    (felt,), truth = whisk.felt.whisks, whisk.seen.whisks[0].d_x_mm.value
    by_theta = tuple(_at(theta_deg, truth + error) for theta_deg, error in errors_mm.items())
    return replace(
        whisk, felt=replace(whisk.felt, whisks=(replace(felt, by_theta=by_theta, status=status),))
    )


def _at(theta_deg: float, d_x_mm: float) -> FeltAt:
    row = EstimateRow("with_friction", Value(d_x_mm, 0.3), d_x_est_sigma_alpha_exact_mm=0.1)
    return FeltAt(
        np.radians(theta_deg),
        Value(0.0, 0.1),
        Value(1.0, 0.1),
        1e-4,
        np.eye(2),
        np.zeros(2),
        (row,),
    )


def test_errors_are_pooled_angle_by_angle_over_sound_whisks():
    """Errors of 0.6 and -1.2 mm of 60: mean -0.5 %, RMS √2.5 %; a whisk with a warning and its 30 mm do not count."""
    wrong = with_errors(result(30.0), {1.0: 30.0}, status="channels exchanged")
    whisks = [
        with_errors(result(20.0), {1.0: 0.6, 3.0: 0.3}),
        with_errors(result(40.0), {1.0: -1.2, 3.0: 0.3}),
        wrong,
    ]
    first, second = against_theta(whisks)
    assert (first.theta_deg, first.whisks, first.none) == (1.0, 2, 0)
    assert first.error_mean_percent == pytest.approx(-0.5)
    assert first.error_rms_percent == pytest.approx(np.sqrt(2.5))
    assert first.error_sigma_percent == pytest.approx(100 * np.hypot(0.3, 0.01) / 60)
    assert first.error_sigma_alpha_exact_percent == pytest.approx(100 * np.hypot(0.1, 0.01) / 60)
    assert least_error([first, second]) is second
    (line,) = AgainstTheta().lines(ThetaErrors((first, second), 1.0))
    assert "least error at θ = 3°, 0.50 % RMS over 2 whisks" in line and "at 1° 1.58 %" in line


def test_an_angle_that_few_whisks_reach_is_not_the_least_error():
    far = {1.0: 0.6, 12.0: 0.0}
    rows = against_theta(
        [with_errors(result(20.0), far), *[with_errors(result(40.0), {1.0: 0.6})] * 3]
    )
    assert least_error(rows).theta_deg == 1.0


def test_a_distance_that_is_none_is_counted_and_drawn_around():
    rows = against_theta([with_errors(result(20.0), {1.0: np.nan, 2.0: 0.6})])
    assert [(row.whisks, row.none) for row in rows] == [(0, 1), (1, 0)]
    assert np.isnan(rows[0].error_rms_percent)
    (axes,) = AgainstTheta().figure(ThetaErrors(tuple(rows), 1.0)).axes
    assert axes.lines[0].get_xdata().tolist() == [2.0]
