"""(10) evaluated again with what is known of the friction: α fitted per surface, α as seen, and on the kinetic cone.

Of a whisk whose moments alone show that it sticks and slips (`bench.trials.gate`), (10) with α_est as given is
evaluated once more at the kinetic ends of its teeth.

α_est as given needs nothing and stands in each whisk's own result. The fit of Fig. 8 leaves out the whisk that it
judges. The one with α as seen is no estimate that a robot could make: it shows what is left of the error when friction
is known.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from bench.analyses.surfaces import FittedSurface, surfaces
from bench.analyses.turning_phi import sure_turns, turn, with_turn
from bench.base.progress import count_parts
from bench.base.settings import Settings
from bench.records.trial_result import (
    WITH_FRICTION,
    EstimateRow,
    FeltAt,
    FeltWhisk,
    SeenWhisk,
    TrialResult,
    whisks,
)
from bench.session.whisker import Whisker
from bench.trials.estimates import Estimator, assumed_settings, run_estimator, whisk_of
from estimator.beam import Beam
from estimator.builtin import corrected, exact_rod, with_friction
from estimator.friction import FrictionFit
from estimator.uncertainty import Z_95
from estimator.whisk import EstimatorSettings, Whisk
from vision import Value

FITTED = "with_friction_fitted"
SEEN = "with_friction_seen"
KINETIC = "with_friction_kinetic"
EVALUATED_AGAIN = (FITTED, SEEN, KINETIC)
ASSUMING = {
    WITH_FRICTION: with_friction,
    "corrected": corrected,
    "exact_rod": exact_rod,
}  # take α_est as given


def alpha_est_sigma(found: Iterable[FittedSurface], settings: Settings) -> float:
    """Return how far α_est may be off in this session, rad, one sigma: as given, else by its surfaces.

    Root mean square of fitted less assumed α over the surfaces, among which the 5° that hold without any
    count as one (the scale of a scaled inverse χ² posterior): a single surface does not show how much
    others differ.
    """
    first_rad = np.radians(settings.first_alpha_est_sigma_deg)
    fits = [surface.fit for surface in found if surface.fit is not None]
    if settings.alpha_est_sigma_deg is not None or not fits:
        return float(first_rad)
    squares = [first_rad**2]
    for fit in fits:
        squares.append((fit.alpha_rad - settings.alpha_est_rad) ** 2 + fit.sigma_rad**2)
    return float(np.sqrt(np.mean(squares)))


@dataclass(frozen=True)
class AlphaUncertainty:
    """Standard deviation of the assumed friction angle α_est.

    sigma_rad: by the session's surfaces. ratio_to_first: over the value with which single whisks were
    evaluated before the session's surfaces were known.
    """

    sigma_rad: float
    ratio_to_first: float

    @classmethod
    def of_session(cls, found: Iterable[FittedSurface], settings: Settings) -> "AlphaUncertainty":
        """Return the uncertainty by the surfaces of a session, as settings have it."""
        sigma_rad = alpha_est_sigma(found, settings)
        first_rad = np.radians(settings.first_alpha_est_sigma_deg)
        return cls(sigma_rad, sigma_rad / first_rad if first_rad else 1.0)


@dataclass(frozen=True)
class SecondEvaluation:
    """How (10) is evaluated once more on the whisks of one trial."""

    theta_rad: float
    beam: Beam
    radii_mm: tuple[float, float]
    alpha_est: AlphaUncertainty

    def evaluate(
        self,
        name: str,
        estimator: Estimator,
        whisk: Whisk,
        alpha: tuple[float, float],
        exact_sigma_mm: float | None = None,
    ) -> EstimateRow:
        """Return the estimate with a friction angle (value, sigma) in rad.

        exact_sigma_mm: its sigma as if that angle were right, where that is known already.
        """
        return run_estimator(
            name, estimator, whisk, *alpha, self.radii_mm, exact_sigma_mm=exact_sigma_mm
        )

    def given(self, felt: FeltAt | FeltWhisk, theta_rad: float) -> tuple[EstimateRow, ...]:
        """Return the estimates, those that assume α_est with the session's sigma of it."""
        whisk = whisk_of(felt, theta_rad, self.beam)
        rows = []
        for row in felt.estimates:
            if row.estimator not in ASSUMING:
                rows.append(_rescaled(row, self.alpha_est.ratio_to_first))
                continue
            exact_mm = row.d_x_est_sigma_alpha_exact_mm
            again = self.evaluate(
                row.estimator,
                ASSUMING[row.estimator],
                whisk,
                (row.alpha_est_rad, self.alpha_est.sigma_rad),
                exact_mm if np.isfinite(exact_mm) else None,
            )
            rows.append(again)
        return tuple(rows)


def with_estimates_again(
    results: Iterable[TrialResult], whisker: Whisker, settings: Settings
) -> list[TrialResult]:
    """Return the results, (10) with the session's sigma of α_est.

    Each whisk's estimates are followed by those of (10) with α fitted and with α seen, where known.
    """
    results = list(results)
    found = surfaces(results, whisker.beam)
    surface_of = {surface.panel: surface for surface in found}
    alpha_est = AlphaUncertainty.of_session(found, settings)
    turns = _turns(results, settings.alpha_est_rad)
    finished = []
    for result in count_parts(results, "trials by the friction of all", len(results)):
        again = SecondEvaluation(result.theta_rad, whisker.beam, result.radii_mm, alpha_est)
        surface = surface_of.get(result.trial.panel)
        felt = []
        for _, seen, of_whisk in whisks([result]):
            fit = surface and surface.fit_without(result.trial.name, seen.whisk)
            turning = turns[result.trial.name, seen.whisk]
            felt.append(_with_estimates_again(seen, of_whisk, fit, again, turning))
        finished.append(replace(result, felt=replace(result.felt, whisks=tuple(felt))))
    return finished


@dataclass(frozen=True)
class _Turning:
    """How φ of a whisk turns over its push, and whether it does for sure."""

    rate: Value
    is_sure: bool


def _turns(results: Iterable[TrialResult], alpha_est_rad: float) -> dict[tuple[str, int], _Turning]:
    """Return how φ turns in each whisk, by trial and number; all whisks are tested together."""
    keys = []
    phi_rad = []
    rates = []
    for result, seen, felt in whisks(results):
        keys.append((result.trial.name, seen.whisk))
        phi_rad.append(felt.phi_felt_rad.value)
        rates.append(turn(felt.by_theta))
    sure = sure_turns(phi_rad, rates, alpha_est_rad)
    return {key: _Turning(rate, bool(one)) for key, rate, one in zip(keys, rates, sure)}


def _with_estimates_again(
    seen: SeenWhisk,
    felt: FeltWhisk,
    fit: FrictionFit | None,
    again: SecondEvaluation,
    turning: _Turning,
) -> FeltWhisk:
    """Return the whisk with (10) run again. fit: of α to the other whisks of its surface."""
    ratio = again.alpha_est.ratio_to_first
    by_theta = []
    for at in felt.by_theta:
        by_theta.append(replace(at, estimates=again.given(at, at.theta_rad)))
    return replace(
        felt,
        estimates=_estimates(seen, felt, fit, again, turning),
        sensors=tuple(_rescaled_sensor(row, again.beam, ratio) for row in felt.sensors),
        by_theta=tuple(by_theta),
    )


def _estimates(
    seen: SeenWhisk,
    felt: FeltWhisk,
    fit: FrictionFit | None,
    again: SecondEvaluation,
    turning: _Turning,
) -> tuple[EstimateRow, ...]:
    """Return the whisk's estimates with the new ones."""
    if not felt.estimates:
        return ()
    given = again.given(felt, again.theta_rad)
    phi_rad = felt.phi_felt_rad.value
    rows = []
    for row in (*given, *_runs(seen, felt, fit, again)):
        if row.estimator in ASSUMING or row.estimator in EVALUATED_AGAIN:
            row = with_turn(
                row,
                phi_rad,
                turning.rate,
                again.theta_rad,
                again.beam.length_mm,
                is_sure=turning.is_sure,
            )
        rows.append(row)
    return tuple(rows)


def _runs(
    seen: SeenWhisk, felt: FeltWhisk, fit: FrictionFit | None, again: SecondEvaluation
) -> Iterator[EstimateRow]:
    """Yield (10) with α fitted and seen, where known, and at the kinetic ends, where there are any."""
    whisk = whisk_of(felt, again.theta_rad, again.beam)
    fitted = (fit.alpha_rad, fit.sigma_rad) if fit else (np.nan, np.nan)
    by_pictures = (seen.friction_rad.value, seen.friction_rad.sigma)
    for name, (alpha_rad, sigma_rad) in ((FITTED, fitted), (SEEN, by_pictures)):
        if np.isfinite(alpha_rad):
            alpha = (max(alpha_rad, 0.0), sigma_rad)
            yield again.evaluate(name, with_friction, whisk, alpha)
    if felt.kinetic is not None:
        alpha = (felt.estimate(WITH_FRICTION).alpha_est_rad, again.alpha_est.sigma_rad)
        kinetic = whisk_of(felt.kinetic, again.theta_rad, again.beam)
        yield again.evaluate(KINETIC, with_friction, kinetic, alpha)


def _rescaled(row: EstimateRow, ratio: float) -> EstimateRow:
    """Return a user's own estimate with another sigma of α_est, by its ratio to the first.

    To first order, what the sigma holds beyond that of an exact α_est goes with it. An interval of its own
    stays.
    """
    exact = row.d_x_est_sigma_alpha_exact_mm
    value = row.d_x_est_mm.value
    before = row.d_x_est_mm.sigma
    if not before > exact:
        return row
    sigma = float(np.sqrt(exact**2 + ratio**2 * (before**2 - exact**2)))
    rescaled = replace(row, d_x_est_mm=Value(value, sigma))
    if not np.isclose(row.d_x_est_high_mm - value, Z_95 * before):
        return rescaled
    return replace(
        rescaled, d_x_est_low_mm=value - Z_95 * sigma, d_x_est_high_mm=value + Z_95 * sigma
    )


def _rescaled_sensor(row: EstimateRow, beam: Beam, ratio: float) -> EstimateRow:
    """Return the estimate of another sensor with another sigma of α_est.

    Each side of an interval that is not symmetric is rescaled by itself; an open end stays open.
    """
    value = row.d_x_est_mm.value
    exact = Z_95 * row.d_x_est_sigma_alpha_exact_mm
    ends = {}
    for name, side in (("d_x_est_low_mm", -1.0), ("d_x_est_high_mm", 1.0)):
        end = getattr(row, name)
        half = side * (end - value)
        if 0 < end < beam.length_mm and half > exact:
            moved = value + side * float(np.sqrt(exact**2 + ratio**2 * (half**2 - exact**2)))
            ends[name] = min(max(moved, 0.0), beam.length_mm)
    return replace(_rescaled(row, ratio), **ends)


def settings_without_alpha(result: TrialResult) -> EstimatorSettings:
    """Return what an estimator that assumes no α_est is given of a trial's object."""
    return assumed_settings(0.0, 0.0, result.radii_mm)
