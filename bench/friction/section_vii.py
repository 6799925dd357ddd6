"""The paper's three ways (section VII) to do without a known friction angle, where a session's whisks allow them.

1. Tilting the array about the whisker's axis: bars of slopes of both signs, on one surface, are such tilts.
2. The α under which the contacts agree best: bars at one nominal distance stand for one upright edge that a tilted
   array touches at one place; the α whose distances scatter least is taken. At several nominal distances they stand for
   a straight edge that leans, and the α is taken whose contacts lie best on a line.
3. Confidence: contacts with a large slip angle count for less.
Ways 1 and 2 see no picture: the slopes are the nominal ones, set by hand.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import stdtrit

from bench.base.settings import ALPHA_EST_SIGMA_DEG
from bench.friction.explained import by_10
from bench.records.trial import TrialResult, whisks
from bench.session.whisker import Whisker
from estimator.friction import Contacts, alpha_from_tilts, confidence, most_consistent_alpha
from estimator.uncertainty import Z_95

_ALPHA_EST_SIGMA_RAD = np.radians(ALPHA_EST_SIGMA_DEG)
_FEWEST = 3  # whisks, or recordings: the least that scatter about a mean and a slope
# rad: the best of these is then refined
_GRID_RAD = np.radians(np.arange(0.0, 45.0, 0.5))
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
    trial: str = ""

    def steeper(self) -> "Contact":
        """The same with a slip angle that is larger by its sigma, and as large a moment."""
        steep, m = abs(self.phi_rad) + self.phi_sigma_rad, np.hypot(self.m_y_Nmm, self.m_z_Nmm)
        phi = float(np.copysign(steep, self.phi_rad))
        return replace(self, phi_rad=phi, m_y_Nmm=float(m * np.sin(phi)), m_z_Nmm=float(m * np.cos(phi)))


def contacts(results: Sequence[TrialResult], panel: tuple[str, float | None]) -> list[Contact]:
    """The measured whisks of one surface and speed."""
    return [
        Contact(
            np.radians(result.trial.beta_nominal_deg),
            result.trial.d_x_nominal_mm,
            float(np.radians(result.theta_deg)),
            felt.m_y_Nmm.value,
            felt.m_z_Nmm.value,
            felt.phi_felt_rad.value,
            felt.phi_felt_rad.sigma,
            result.trial.name,
        )
        for result, _, felt in whisks(results)
        if result.trial.purpose == "measure"
        and result.trial.panel == panel
        and felt.has_moments
        and not felt.apart
    ]


def by_tilting(of_surface: Sequence[Contact]) -> Way:
    """Way 1."""
    known = [c for c in of_surface if np.isfinite(c.beta_rad)]
    if not (any(c.beta_rad < 0 for c in known) and any(c.beta_rad > 0 for c in known)):
        return Way("tilting", np.nan, np.nan, "needs nominal slopes (beta_deg) of both signs")
    sigma = float(np.median([c.phi_sigma_rad for c in known]))

    def found(some: Sequence[Contact]) -> tuple[float, str]:
        fit = alpha_from_tilts([c.beta_rad for c in some], [c.phi_rad for c in some], phi_sigma=sigma)
        return fit.alpha_rad, fit.status

    return _by_recordings("tilting", found, known)


def by_consistency(of_surface: Sequence[Contact], whisker: Whisker) -> Way:
    """Way 2: the α under which distances scatter least as shares of their mean."""
    nominal = {c.d_x_nominal_mm for c in of_surface}
    spread = np.ptp([abs(np.tan(c.phi_rad)) for c in of_surface]) if of_surface else 0.0
    if len(of_surface) < _FEWEST or len(nominal) != 1 or not np.isfinite(list(nominal)).all():
        return Way("consistency", np.nan, np.nan, f"needs {_FEWEST} whisks or more at one nominal distance (d_x_mm)")
    if spread < _LEAST_SPREAD:
        return Way("consistency", np.nan, np.nan, "the whisks do not span two slip angles")
    if not np.isfinite(_distances(of_surface, np.zeros(1), whisker)).all():
        return Way("consistency", np.nan, np.nan, "a whisk is no push against an object")
    return _by_recordings("consistency", lambda some: _least_scatter(some, whisker), of_surface)


def by_smoothness(of_surface: Sequence[Contact], whisker: Whisker) -> Way:
    """Way 2 of an object that is no edge at one distance: the α whose contacts lie best on a straight one.

    Bars at several nominal distances stand for one straight edge that leans along the whisker, touched at heights that
    are these distances (`estimator.consistency`).
    """
    nominal = {c.d_x_nominal_mm for c in of_surface}
    if len(nominal) < 2 or not np.isfinite(list(nominal)).all():
        return Way("smoothness", np.nan, np.nan, "needs whisks at two nominal distances (d_x_mm) or more")
    if not np.isfinite(_distances(of_surface, np.zeros(1), whisker)).all():
        return Way("smoothness", np.nan, np.nan, "a whisk is no push against an object")
    return _by_recordings("smoothness", lambda some: _smoothest(some, whisker), of_surface)


def _smoothest(some: Sequence[Contact], whisker: Whisker) -> tuple[float, str]:
    felt = (np.array([getattr(c, name) for c in some]) for name in ("theta_rad", "m_y_Nmm", "m_z_Nmm"))
    heights = np.array([c.d_x_nominal_mm for c in some])
    beam = whisker.beam
    at = Contacts(*felt, beam.C_Nmm2, np.zeros(len(some)), heights, taper_per_mm=beam.taper / beam.length_mm)
    found = most_consistent_alpha(at)
    return found.alpha_rad, found.status


def _by_recordings(name: str, found: Callable[[Sequence[Contact]], tuple[float, str]], known: Sequence[Contact]) -> Way:
    """α that `found` makes of contacts (α or NaN, a status), with its sigma; NaN where that has a status.

    Whisks of one recording share a bar that was set up once, and are no independent repeats: each recording is left out
    in turn (delete-group jackknife), Student's t for so few of them. What all share, the gauges' part of φ, comes on
    top: all slip angles steeper by their sigma.
    """
    alpha, status = found(known)
    trials = list(dict.fromkeys(c.trial for c in known))
    if status or len(trials) < _FEWEST:
        return Way(name, np.nan, np.nan, status or f"needs {_FEWEST} recordings or more to say how well it is known")
    without = [found([c for c in known if c.trial != trial]) for trial in trials]
    if any(why for _, why in without):
        return Way(name, np.nan, np.nan, f"rests on one recording: without it, {next(w for _, w in without if w)}")
    freedom = len(trials) - 1
    own = np.sqrt(freedom * np.var([a for a, _ in without])) * stdtrit(freedom, 0.975) / Z_95
    shared = found([c.steeper() for c in known])[0] - alpha
    return Way(name, alpha, float(np.hypot(own, shared if np.isfinite(shared) else 0.0)))


def _distances(some: Sequence[Contact], alphas_rad, whisker: Whisker) -> np.ndarray:
    """By (10), mm, (contacts, α); NaN where there is none."""
    return np.array([by_10(c.theta_rad, c.m_y_Nmm, c.m_z_Nmm, alphas_rad, whisker) for c in some])


def _least_scatter(some: Sequence[Contact], whisker: Whisker) -> tuple[float, str]:
    """(α, rad, '') at which the distances scatter least; where one of them ends, the search ends, and says so."""

    def scatter(alphas_rad) -> np.ndarray:
        distances = _distances(some, np.atleast_1d(alphas_rad), whisker)
        return distances.std(axis=0) / distances.mean(axis=0)

    on_grid = scatter(_GRID_RAD)
    last = int(np.flatnonzero(np.isfinite(on_grid))[-1])
    best = int(np.nanargmin(on_grid))
    if best in (0, last):
        return float("nan"), f"at the bound of the search, {np.degrees(_GRID_RAD[best]):.1f}°: no angle between fits"
    bracket = _GRID_RAD[best - 1], _GRID_RAD[best + 1]
    found = minimize_scalar(lambda a: float(scatter(a)[0]), bounds=bracket, method="bounded", options={"xatol": 1e-7})
    return float(found.x), ""


def weights(phi_rad: Sequence[float], alpha_est_rad: float) -> np.ndarray:
    """Way 3: confidence (n,) in contacts of these slip angles, 1 where friction does not matter."""
    return np.atleast_1d(confidence(np.array(phi_rad), alpha_est_rad, _ALPHA_EST_SIGMA_RAD))
