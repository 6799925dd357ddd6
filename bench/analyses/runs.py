"""(10) run again with what is known of the friction: α fitted per surface, α as seen, and on the kinetic cone.

Of a whisk whose moments alone show that it sticks and slips (`bench.trials.gate`), (10) with α_est as given is asked
once more at the kinetic ends of its teeth.

α_est as given needs nothing and stands in each whisk's own result. The fit of Fig. 8 leaves out the whisk that it
judges. The run with α as seen is no estimate that a robot could make: it shows what is left of the error when friction
is known.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from bench.analyses.alphas import seen_friction
from bench.analyses.surfaces import Surface, surfaces
from bench.analyses.turning_phi import turn, with_turn
from bench.base.settings import OBJECT_REACH_MM, TILT_SIGMA_RAD, Settings
from bench.records.trial_result import (
    EstimateRow,
    FeltAt,
    FeltWhisk,
    SeenWhisk,
    TrialResult,
    whisks,
)
from bench.session.whisker import Whisker
from bench.trials.estimates import answer, whisk_of
from estimator.beam import Beam
from estimator.builtin import corrected, with_friction
from estimator.uncertainty import Z_95
from estimator.whisk import EstimatorSettings
from vision.truth.value import Value

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
    squares = [
        first**2,
        *((fit.alpha_rad - settings.alpha_est_rad) ** 2 + fit.sigma_rad**2 for fit in fits),
    ]
    return float(np.sqrt(np.mean(squares)))


@dataclass(frozen=True)
class Doubt:
    """What α_est may be off by in the session, rad, one sigma, and that over what whisks were asked with one by one."""

    sigma_rad: float
    part: float


def _doubt(sigma_rad: float, settings: Settings) -> Doubt:
    first = np.radians(settings.first_alpha_est_sigma_deg)
    return Doubt(sigma_rad, sigma_rad / first if first else 1.0)


def with_runs(
    results: Iterable[TrialResult], whisker: Whisker, settings: Settings
) -> list[TrialResult]:
    """The results, (10) with the session's sigma of α_est, and each whisk's estimates followed by those of (10) with α
    fitted and with α seen, where known."""
    results = list(results)
    found = surfaces(results, whisker.beam)
    by_panel, doubt = (
        {s.panel: s for s in found},
        _doubt(alpha_est_sigma(found, settings), settings),
    )
    return [_with_runs(result, by_panel, whisker.beam, doubt) for result in results]


def _with_runs(result: TrialResult, by_panel: Mapping, beam: Beam, doubt: Doubt) -> TrialResult:
    surface = by_panel.get(result.trial.panel)
    felt = tuple(
        _by_theta(
            result,
            replace(felt, estimates=answers, sensors=_sensors(felt, beam, doubt)),
            beam,
            doubt,
        )
        for _, seen, felt in whisks([result])
        for answers in [_answers(result, seen, felt, surface, beam, doubt)]
    )
    return replace(result, felt=replace(result.felt, whisks=felt))


def _by_theta(result: TrialResult, felt: FeltWhisk, beam: Beam, doubt: Doubt) -> FeltWhisk:
    """The whisk with the session's sigma of α_est at all pushing angles."""
    asked = (
        replace(at, estimates=_given(result, at, at.theta_rad, beam, doubt)) for at in felt.by_theta
    )
    return replace(felt, by_theta=tuple(asked))


def _answers(
    result: TrialResult,
    seen: SeenWhisk,
    felt: FeltWhisk,
    surface: Surface | None,
    beam: Beam,
    doubt: Doubt,
) -> tuple[EstimateRow, ...]:
    """The whisk's estimates with the new ones."""
    if not felt.estimates:
        return ()
    fit = surface and surface.fit_without(result.trial.name, seen.whisk)
    fitted = (fit.alpha_rad, fit.sigma_rad) if fit else (np.nan, np.nan)
    theta_rad = np.radians(result.theta_deg)
    whisk = whisk_of(felt, theta_rad, beam)
    angles = ((FITTED, fitted), (SEEN, seen_friction(seen)))
    radii_mm, known = (
        _radii_mm(result),
        ((name, *pair) for name, pair in angles if np.isfinite(pair[0])),
    )
    runs = [
        answer(name, with_friction, whisk, max(a, 0.0), sigma, radii_mm) for name, a, sigma in known
    ]
    given = _given(result, felt, theta_rad, beam, doubt)
    if felt.kinetic is not None:
        alpha = next(a.alpha_est_rad for a in given if a.estimator == GIVEN)
        kinetic = whisk_of(felt.kinetic, theta_rad, beam)
        runs.append(answer(KINETIC, with_friction, kinetic, alpha, doubt.sigma_rad, radii_mm))
    rate, ten = turn(felt.by_theta), {*ASSUMING, *RUNS}
    turned = felt.phi_felt_rad.value, rate, theta_rad, beam.length_mm
    return tuple(
        with_turn(row, *turned) if row.estimator in ten else row for row in (*given, *runs)
    )


def _given(
    result: TrialResult, felt: FeltWhisk | FeltAt, theta_rad: float, beam: Beam, doubt: Doubt
) -> tuple[EstimateRow, ...]:
    """The estimates, those with α_est as given asked again with the session's sigma of it."""
    whisk, radii_mm = whisk_of(felt, theta_rad, beam), _radii_mm(result)

    def again(a: EstimateRow) -> EstimateRow:
        asked = (
            a.estimator,
            ASSUMING[a.estimator],
            whisk,
            a.alpha_est_rad,
            doubt.sigma_rad,
            radii_mm,
        )
        exact_mm = a.d_x_est_sigma_alpha_exact_mm
        return answer(*asked, exact_sigma_mm=exact_mm if np.isfinite(exact_mm) else None)

    return tuple(
        again(a) if a.estimator in ASSUMING else _rescaled(a, doubt.part) for a in felt.estimates
    )


def _radii_mm(result: TrialResult) -> tuple[float, float]:
    """Of the bar, NaN where the manifest does not say, and of the whisker's base."""
    return 0.5 * result.trial.bar_diameter_mm, 0.5 * result.whisker.diameter_mm


def _rescaled(row: EstimateRow, part: float) -> EstimateRow:
    """One's own estimate, which was asked with the first sigma of α_est, with this part of it: to first order, what the
    sigma holds beyond that of an exact α_est goes with it. An interval of its own stays."""
    own, value = row.d_x_est_sigma_alpha_exact_mm, row.d_x_est_mm
    if not value.sigma > own:
        return row
    sigma = float(np.sqrt(own**2 + part**2 * (value.sigma**2 - own**2)))
    ends = {
        "d_x_est_low_mm": value.value - Z_95 * sigma,
        "d_x_est_high_mm": value.value + Z_95 * sigma,
    }
    symmetric = np.isclose(row.d_x_est_high_mm - value.value, Z_95 * value.sigma)
    return replace(row, d_x_est_mm=Value(value.value, sigma), **(ends if symmetric else {}))


def _sensors(felt: FeltWhisk, beam: Beam, doubt: Doubt) -> tuple[EstimateRow, ...]:
    """What other sensors say, likewise, each side of an interval that is not symmetric by itself."""
    return tuple(
        replace(_rescaled(row, doubt.part), **_sides(row, beam, doubt.part)) for row in felt.sensors
    )


def _sides(row: EstimateRow, beam: Beam, part: float) -> dict[str, float]:
    """Both ends, with this part of what they hold beyond an exact α_est. An open end stays open."""
    value, own = row.d_x_est_mm.value, Z_95 * row.d_x_est_sigma_alpha_exact_mm
    ends = {}
    for name, way in (("d_x_est_low_mm", -1.0), ("d_x_est_high_mm", 1.0)):
        end = getattr(row, name)
        half = way * (end - value)
        if 0 < end < beam.length_mm and half > own:
            moved = value + way * float(np.sqrt(own**2 + part**2 * (half**2 - own**2)))
            ends[name] = min(max(moved, 0.0), beam.length_mm)
    return ends


def told_of(result: TrialResult) -> EstimatorSettings:
    """What an estimator that asks for no α_est is told of a trial's object."""
    radii_mm = _radii_mm(result)
    reach_mm = OBJECT_REACH_MM if np.isnan(radii_mm[0]) else sum(radii_mm)
    return EstimatorSettings(0.0, 0.0, reach_mm, TILT_SIGMA_RAD, *radii_mm)
