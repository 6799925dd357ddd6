"""The paper's three ways (section VII) to do without a known friction angle, where a session's whisks allow them.

1. Tilting the array about the whisker's axis: bars of slopes of both signs, on one surface, are such tilts.
2. The α under which the contacts agree best: bars at one nominal distance stand for one upright edge that a tilted
   array touches at one place; the α whose distances scatter least is taken.
3. Confidence: contacts with a large slip angle count for less.
Ways 1 and 2 see no picture: the slopes are the nominal ones, set by hand.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.base.results import number
from bench.base.settings import ALPHA_EST_SIGMA_DEG
from bench.friction.explained import by_10
from bench.session.whisker import Whisker
from bench.trials.compare import whisks
from estimator.friction import alpha_from_tilts, confidence

_ALPHA_EST_SIGMA_RAD = np.radians(ALPHA_EST_SIGMA_DEG)
_FEWEST = 3
_GRID_RAD = np.radians(np.arange(0.0, 45.0, 0.05))
_LEAST_SPREAD = 0.05  # of |tan φ|: contacts with one slip angle agree under any α


@dataclass(frozen=True)
class Way:
    """One way on one surface: α with sigma, rad, or NaN and why."""

    name: str
    alpha_rad: float
    sigma_rad: float
    status: str = ""


@dataclass(frozen=True)
class Contact:
    """What a robot has of one whisk: nominal slope and distance (NaN where not given), and what was felt."""

    beta_rad: float
    d_x_nominal_mm: float
    theta_rad: float
    m_y_Nmm: float
    m_z_Nmm: float
    phi_rad: float
    phi_sigma_rad: float


def contacts(results: Sequence[dict], surface: str, speed_deg_s: float) -> list[Contact]:
    """The measured whisks of one surface and speed."""
    return [
        Contact(
            np.radians(number(r["trial"]["beta_nominal_deg"])),
            number(r["trial"]["d_x_nominal_mm"]),
            float(np.radians(r["theta_deg"])),
            *(felt[name] for name in ("m_y_Nmm", "m_z_Nmm", "phi_felt_rad", "phi_felt_sigma_rad")),
        )
        for r, _, felt in whisks(results)
        if r["trial"]["purpose"] == "measure"
        and (r["trial"]["surface"], number(r["trial"]["speed_deg_s"])) == (surface, speed_deg_s)
        and felt.get("phi_felt_rad") is not None
        and not felt.get("apart")
    ]


def by_tilting(of_surface: Sequence[Contact]) -> Way:
    """Way 1."""
    known = [c for c in of_surface if np.isfinite(c.beta_rad)]
    if not (any(c.beta_rad < 0 for c in known) and any(c.beta_rad > 0 for c in known)):
        return Way("tilting", np.nan, np.nan, "needs nominal slopes (beta_deg) of both signs")
    sigma = float(np.median([c.phi_sigma_rad for c in known]))
    fit = alpha_from_tilts([c.beta_rad for c in known], [c.phi_rad for c in known], phi_sigma=sigma)
    return Way("tilting", fit.alpha_rad, fit.sigma_rad, fit.status)


def by_consistency(of_surface: Sequence[Contact], whisker: Whisker) -> Way:
    """Way 2: the α under which distances scatter least as shares of their mean; sigma by leaving out each contact."""
    nominal = {c.d_x_nominal_mm for c in of_surface}
    spread = np.ptp([abs(np.tan(c.phi_rad)) for c in of_surface]) if of_surface else 0.0
    if len(of_surface) < _FEWEST or len(nominal) != 1 or not np.isfinite(list(nominal)).all():
        return Way("consistency", np.nan, np.nan, f"needs {_FEWEST} whisks or more at one nominal distance (d_x_mm)")
    if spread < _LEAST_SPREAD:
        return Way("consistency", np.nan, np.nan, "the whisks do not span two slip angles")
    distances = np.array([by_10(c.theta_rad, c.m_y_Nmm, c.m_z_Nmm, _GRID_RAD, whisker) for c in of_surface])
    if not np.isfinite(distances[:, 0]).all():
        return Way("consistency", np.nan, np.nan, "a whisk is no push against an object")
    best = _least_scatter(distances)
    without = [_least_scatter(np.delete(distances, k, axis=0)) for k in range(len(distances))]
    sigma = float(np.sqrt((len(without) - 1) * np.var(without)))
    return Way("consistency", best, sigma, "at the bound of the search" if best in _GRID_RAD[[0, -1]] else "")


def _least_scatter(distances) -> float:
    """α, rad, at which the distances (contacts, α) scatter least; where one of them ends, the search ends."""
    scatter = distances.std(axis=0) / distances.mean(axis=0)
    return float(_GRID_RAD[int(np.nanargmin(np.where(np.isfinite(scatter), scatter, np.inf)))])


def weights(phi_rad: Sequence[float], alpha_est_rad: float) -> np.ndarray:
    """Way 3: confidence (n,) in contacts of these slip angles, 1 where friction does not matter."""
    return np.atleast_1d(confidence(np.array(phi_rad), alpha_est_rad, _ALPHA_EST_SIGMA_RAD))
