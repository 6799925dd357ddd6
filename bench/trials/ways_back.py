"""The ways back of a trial's whisks: the touch of gauges that are late, and the estimate of both ways."""

from dataclasses import replace

from bench.base.settings import Settings
from bench.base.statuses import reason
from bench.records.trial_result import EstimateRow, FeltWhisk
from bench.trials.estimates import assumed_settings, whisk_of
from estimator.beam import Beam
from estimator.both_ways import there_and_back
from vision import Value

BOTH_WAYS = "both_ways"
NO_WAY_BACK = reason("no_way_back")


def with_late_release(felt: FeltWhisk, late_rad: float) -> FeltWhisk:
    """Return a way back whose touch is at a larger angle: late gauges show the release at a smaller
    one.
    """
    touch = felt.touch_felt_rad
    return replace(felt, touch_felt_rad=Value(touch.value + late_rad, touch.sigma))


def with_both_ways(back: FeltWhisk, there: FeltWhisk, beam: Beam, settings: Settings) -> FeltWhisk:
    """Return the way back, its estimates followed by that of both ways together."""
    if not (back.has_moments and there.has_moments):
        return back
    found = there_and_back(
        whisk_of(there, settings.theta_rad, beam),
        whisk_of(back, settings.theta_rad, beam),
        assumed_settings(settings.alpha_est_rad, 0.0),
        (there.shared_Nmm, back.shared_Nmm),
    )
    row = EstimateRow(
        BOTH_WAYS,
        Value(found.d_x_mm, found.sigma_mm),
        alpha_est_rad=found.alpha_rad,
        beta_est_rad=found.beta_rad,
        status=found.status,
        d_x_est_sigma_alpha_exact_mm=found.sigma_mm,
        d_x_est_low_mm=found.low_mm,
        d_x_est_high_mm=found.high_mm,
    )
    return replace(back, estimates=(*back.estimates, row))
