"""(10) run again with what is known of the friction: α fitted per surface, and α as seen.

α_est as given needs nothing and stands in each whisk's own result. The fit of Fig. 8 leaves out the whisk that it
judges. The run with α as seen is no estimate that a robot could make: it shows what is left of the error when friction
is known.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from bench.friction.alphas import seen_friction
from bench.friction.surfaces import Surface, surfaces
from bench.records.trial import EstimateRow, FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.session.whisker import Whisker
from estimator.beam import Beam
from estimator.builtin import with_friction
from estimator.distance import estimated_slope
from estimator.whisk import EstimatorSettings, Whisk
from vision.truth.value import Value

FITTED, SEEN = "with_friction_fitted", "with_friction_seen"
RUNS = (FITTED, SEEN)


def with_runs(results: Iterable[TrialResult], whisker: Whisker) -> list[TrialResult]:
    """The results, each whisk's estimates followed by those of (10) with α fitted and with α seen, where known."""
    results = list(results)
    by_panel = {s.panel: s for s in surfaces(results, whisker.C_Nmm2)}
    return [_with_runs(result, by_panel, whisker) for result in results]


def _with_runs(result: TrialResult, by_panel: Mapping, whisker: Whisker) -> TrialResult:
    beam, surface = Beam(whisker.C_Nmm2, whisker.length_mm, whisker.shape), by_panel.get(result.trial.panel)
    felt = tuple(
        replace(felt, estimates=(*felt.estimates, *_answers(result, seen, felt, surface, beam)))
        for _, seen, felt in whisks([result])
    )
    return replace(result, felt=replace(result.felt, whisks=felt))


def _answers(
    result: TrialResult, seen: SeenWhisk, felt: FeltWhisk, surface: Surface | None, beam: Beam
) -> list[EstimateRow]:
    if not felt.estimates:
        return []
    fit = surface and surface.fit_without(result.trial.name, seen.whisk)
    fitted = (fit.alpha_rad, fit.sigma_rad) if fit else (np.nan, np.nan)
    whisk = _whisk(felt, np.radians(result.theta_deg), beam)
    angles = ((FITTED, fitted), (SEEN, seen_friction(seen)))
    return [_answer(name, whisk, max(alpha, 0.0), sigma) for name, (alpha, sigma) in angles if np.isfinite(alpha)]


def _whisk(felt: FeltWhisk, theta_rad: float, beam: Beam) -> Whisk:
    """The whisk at the wanted angle: all that (10) looks at."""
    no_samples = (np.zeros(0),) * 4
    moments = felt.m_y_Nmm.value, felt.m_z_Nmm.value
    covariances = felt.covariance_at, felt.touch_felt_rad.sigma, beam, felt.theta_moment_covariance_at
    return Whisk(*no_samples, theta_rad, *moments, *covariances)


def _answer(name: str, whisk: Whisk, alpha_rad: float, sigma_rad: float) -> EstimateRow:
    estimate = with_friction(whisk, EstimatorSettings(alpha_rad, sigma_rad))
    slope = float(estimated_slope(whisk.m_y_at_Nmm, whisk.m_z_at_Nmm, alpha_rad))
    return EstimateRow(name, Value(estimate.d_x_mm, estimate.sigma_mm), alpha_rad, slope, estimate.status)
