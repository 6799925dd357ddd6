"""(10) run again with what is known of the friction: α fitted per surface, and α as seen.

α_est as given needs nothing and stands in each whisk's own result. The fit of Fig. 8 leaves out the whisk that it
judges. The run with α as seen is no estimate that a robot could make: it shows what is left of the error when friction
is known.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from bench.base.results import number, plain
from bench.friction.alphas import seen_friction
from bench.friction.surfaces import Surface, surfaces
from bench.session.whisker import Whisker
from estimator.beam import Beam
from estimator.builtin import with_friction
from estimator.distance import estimated_slope
from estimator.whisk import EstimatorSettings, Whisk

FITTED, SEEN = "with_friction_fitted", "with_friction_seen"
RUNS = (FITTED, SEEN)


def with_runs(results: Iterable[dict], whisker: Whisker) -> list[dict]:
    """The results, each whisk's estimates followed by those of (10) with α fitted and with α seen, where known."""
    results = list(results)
    by_key = {(s.name, s.speed_deg_s): s for s in surfaces(results, whisker.C_Nmm2)}
    return [_with_runs(result, by_key, whisker) for result in results]


def _with_runs(result: dict, by_key: dict, whisker: Whisker) -> dict:
    trial, beam = result["trial"], Beam(whisker.C_Nmm2, whisker.length_mm, whisker.shape)
    surface = by_key.get((trial["surface"], number(trial["speed_deg_s"])))
    felt = [
        felt | {"estimates": [*felt["estimates"], *_answers(result, seen, felt, surface, beam)]}
        for seen, felt in zip(result["seen"]["whisks"], result["felt"]["whisks"])
    ]
    return result | {"felt": result["felt"] | {"whisks": felt}}


def _answers(result: dict, seen: dict, felt: dict, surface: Surface | None, beam: Beam) -> Sequence[dict]:
    if not felt["estimates"]:
        return []
    fit = surface and surface.fit_without(result["trial"]["name"], seen["whisk"])
    fitted = (fit.alpha_rad, fit.sigma_rad) if fit else (np.nan, np.nan)
    whisk = _whisk(felt, np.radians(result["theta_deg"]), beam)
    known = ((FITTED, fitted), (SEEN, seen_friction(seen)))
    return [_answer(name, whisk, max(alpha, 0.0), sigma) for name, (alpha, sigma) in known if np.isfinite(alpha)]


def _whisk(felt: dict, theta_rad: float, beam: Beam) -> Whisk:
    """The whisk at the wanted angle: all that (10) looks at."""
    no_samples = (np.zeros(0),) * 4
    covariance, with_theta = np.array(felt["covariance_at"]), np.array(felt["theta_moment_covariance_at"])
    moments = felt["m_y_Nmm"], felt["m_z_Nmm"]
    return Whisk(*no_samples, theta_rad, *moments, covariance, felt["touch_felt_sigma_rad"], beam, with_theta)


def _answer(name: str, whisk: Whisk, alpha_rad: float, sigma_rad: float) -> dict:
    estimate = with_friction(whisk, EstimatorSettings(alpha_rad, sigma_rad))
    return {
        "estimator": name,
        "alpha_est_rad": alpha_rad,
        "d_x_est_mm": plain(estimate.d_x_mm),
        "d_x_est_sigma_mm": plain(estimate.sigma_mm),
        "beta_est_rad": plain(float(estimated_slope(whisk.m_y_at_Nmm, whisk.m_z_at_Nmm, alpha_rad))),
        "status": estimate.status,
    }
