"""(10) run again with what is known of the friction: α fitted per surface, α as seen, and on the kinetic cone.

Of a whisk whose moments alone show that it sticks and slips (`bench.trials.gate`), (10) with α_est as given is asked
once more at the kinetic ends of its teeth.

α_est as given needs nothing and stands in each whisk's own result. The fit of Fig. 8 leaves out the whisk that it
judges. The run with α as seen is no estimate that a robot could make: it shows what is left of the error when friction
is known.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from bench.base.settings import Settings
from bench.friction.alphas import seen_friction
from bench.friction.surfaces import Surface, surfaces
from bench.records.trial import EstimateRow, FeltAt, FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.session.whisker import Whisker
from bench.trials.estimates import answer
from estimator.beam import Beam
from estimator.builtin import corrected, with_friction
from estimator.whisk import Whisk

GIVEN, FITTED, SEEN = "with_friction", "with_friction_fitted", "with_friction_seen"
KINETIC = "with_friction_kinetic"
RUNS = (FITTED, SEEN, KINETIC)
ASSUMING = {GIVEN: with_friction, "corrected": corrected}  # take α_est as given


def alpha_est_sigma(found: Iterable[Surface], settings: Settings) -> float:
    """How far α_est may be off in this session, rad, one sigma: as given, else by its surfaces.

    Root mean square of fitted less assumed α over the surfaces, among which the 5° that hold without any count as one
    (the scale of a scaled inverse χ² posterior): a single surface does not tell how much others differ.
    """
    first = np.radians(settings.first_alpha_est_sigma_deg)
    fits = [s.fit for s in found if s.fit is not None]
    if settings.alpha_est_sigma_deg is not None or not fits:
        return float(first)
    squares = [first**2, *((fit.alpha_rad - settings.alpha_est_rad) ** 2 + fit.sigma_rad**2 for fit in fits)]
    return float(np.sqrt(np.mean(squares)))


def with_runs(results: Iterable[TrialResult], whisker: Whisker, settings: Settings) -> list[TrialResult]:
    """The results, (10) with the session's sigma of α_est, and each whisk's estimates followed by those of (10) with α
    fitted and with α seen, where known."""
    results = list(results)
    found = surfaces(results, whisker.beam)
    by_panel, sigma_rad = {s.panel: s for s in found}, alpha_est_sigma(found, settings)
    return [_with_runs(result, by_panel, whisker.beam, sigma_rad) for result in results]


def _with_runs(result: TrialResult, by_panel: Mapping, beam: Beam, sigma_rad: float) -> TrialResult:
    surface = by_panel.get(result.trial.panel)
    felt = tuple(
        _by_theta(result, replace(felt, estimates=answers), beam, sigma_rad)
        for _, seen, felt in whisks([result])
        for answers in [_answers(result, seen, felt, surface, beam, sigma_rad)]
    )
    return replace(result, felt=replace(result.felt, whisks=felt))


def _by_theta(result: TrialResult, felt: FeltWhisk, beam: Beam, sigma_rad: float) -> FeltWhisk:
    """The whisk with the session's sigma of α_est at all pushing angles."""
    asked = (replace(at, estimates=_given(result, at, at.theta_rad, beam, sigma_rad)) for at in felt.by_theta)
    return replace(felt, by_theta=tuple(asked))


def _answers(
    result: TrialResult, seen: SeenWhisk, felt: FeltWhisk, surface: Surface | None, beam: Beam, sigma_rad: float
) -> tuple[EstimateRow, ...]:
    """The whisk's estimates with the new ones."""
    if not felt.estimates:
        return ()
    fit = surface and surface.fit_without(result.trial.name, seen.whisk)
    fitted = (fit.alpha_rad, fit.sigma_rad) if fit else (np.nan, np.nan)
    theta_rad = np.radians(result.theta_deg)
    whisk = _whisk(felt, theta_rad, beam)
    angles = ((FITTED, fitted), (SEEN, seen_friction(seen)))
    runs = [answer(name, with_friction, whisk, max(a, 0.0), sigma) for name, (a, sigma) in angles if np.isfinite(a)]
    given = _given(result, felt, theta_rad, beam, sigma_rad)
    if felt.kinetic is not None:
        alpha = next(a.alpha_est_rad for a in given if a.estimator == GIVEN)
        runs.append(answer(KINETIC, with_friction, _whisk(felt.kinetic, theta_rad, beam), alpha, sigma_rad))
    return (*given, *runs)


def _given(
    result: TrialResult, felt: FeltWhisk | FeltAt, theta_rad: float, beam: Beam, sigma_rad: float
) -> tuple[EstimateRow, ...]:
    """The estimates, those with α_est as given asked again with the session's sigma of it."""
    whisk = _whisk(felt, theta_rad, beam)
    radii_mm = 0.5 * result.trial.bar_diameter_mm, 0.5 * result.whisker.diameter_mm

    def again(a: EstimateRow) -> EstimateRow:
        return answer(a.estimator, ASSUMING[a.estimator], whisk, a.alpha_est_rad, sigma_rad, radii_mm)

    return tuple(again(a) if a.estimator in ASSUMING else a for a in felt.estimates)


def _whisk(felt: FeltWhisk | FeltAt, theta_rad: float, beam: Beam) -> Whisk:
    """The whisk at the wanted angle: all that (10) looks at."""
    no_samples = (np.zeros(0),) * 4
    moments = felt.m_y_Nmm.value, felt.m_z_Nmm.value
    covariances = felt.covariance_at, felt.theta_sigma_rad, beam, felt.theta_moment_covariance_at
    return Whisk(*no_samples, theta_rad, *moments, *covariances)
