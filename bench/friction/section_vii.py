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
from estimator.consistency import smoothest_alpha
from estimator.distance import felt_slip_angle
from estimator.friction import Contacts, alpha_from_tilts, confidence
from estimator.uncertainty import Z_95

_ALPHA_EST_SIGMA_RAD = np.radians(ALPHA_EST_SIGMA_DEG)
_FEWEST = 3  # whisks, or recordings: the least that scatter about a mean and a slope
_BEARS_NOTHING = 1e-6  # of the largest change: a recording without which the fit is the same, to rounding
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
    """What a robot has of one whisk: nominal slope and distance (NaN where not given), and what was felt.

    shared_Nmm (k, 2): what (m_y, m_z) change by at one sigma of each cause that all whisks have in common.
    """

    beta_rad: float
    d_x_nominal_mm: float
    theta_rad: float
    m_y_Nmm: float
    m_z_Nmm: float
    phi_sigma_rad: float
    shared_Nmm: np.ndarray
    trial: str = ""

    @property
    def phi_rad(self) -> float:
        """The slip angle (8)."""
        return felt_slip_angle(self.m_y_Nmm, self.m_z_Nmm)

    def moved(self, cause: int) -> "Contact":
        """The same with one of the shared causes off by its sigma."""
        m_y, m_z = (float(m) for m in (self.m_y_Nmm, self.m_z_Nmm) + self.shared_Nmm[cause])
        return replace(self, m_y_Nmm=m_y, m_z_Nmm=m_z)


def contacts(results: Sequence[TrialResult], panel: tuple[str, float | None]) -> list[Contact]:
    """The measured whisks of one surface and speed."""
    return [
        Contact(
            np.radians(result.trial.beta_nominal_deg),
            result.trial.d_x_nominal_mm,
            float(np.radians(result.theta_deg)),
            felt.m_y_Nmm.value,
            felt.m_z_Nmm.value,
            felt.phi_felt_rad.sigma,
            felt.shared_Nmm,
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

    return _by_recordings("tilting", found, known, 2)


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
    return _by_recordings("consistency", lambda some: _least_scatter(some, whisker), of_surface, 2)


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
    return _by_recordings("smoothness", lambda some: _smoothest(some, whisker), of_surface, 3)


def _smoothest(some: Sequence[Contact], whisker: Whisker) -> tuple[float, str]:
    felt = (np.array([getattr(c, name) for c in some]) for name in ("theta_rad", "m_y_Nmm", "m_z_Nmm"))
    heights = np.array([c.d_x_nominal_mm for c in some])
    beam = whisker.beam
    at = Contacts(*felt, beam.C_Nmm2, np.zeros(len(some)), heights, taper_per_mm=beam.taper / beam.length_mm)
    return smoothest_alpha(at)


def _by_recordings(
    name: str, found: Callable[[Sequence[Contact]], tuple[float, str]], known: Sequence[Contact], unknowns: int
) -> Way:
    """α that `found` makes of contacts (α or NaN, a status), with its sigma; NaN where that has a status.

    Whisks of one recording share a bar that was set up once, and are no independent repeats: each recording is left out
    in turn. What all whisks share comes on top, one cause after another. unknowns: what `found` fits, α among it.
    """
    alpha, status = found(known)
    trials = list(dict.fromkeys(c.trial for c in known))
    if status or len(trials) <= unknowns:
        few = f"needs {unknowns + 1} recordings or more to say how well it is known"
        return Way(name, np.nan, np.nan, status or few)
    without = [found([c for c in known if c.trial != trial]) for trial in trials]
    if any(why for _, why in without):
        return Way(name, np.nan, np.nan, f"rests on one recording: without it, {next(w for _, w in without if w)}")
    changes = np.array([a for a, _ in without]) - alpha
    shared = [found([c.moved(k) for c in known])[0] - alpha for k in range(len(known[0].shared_Nmm))]
    return Way(name, alpha, float(np.hypot(_own_sigma(changes, unknowns), np.linalg.norm(np.nan_to_num(shared)))))


def _own_sigma(changes: np.ndarray, unknowns: int) -> float:
    """Sigma of a fit from what leaving out each recording changes it by, as half a 95 % interval over 1.96.

    A recording left out moves the fit by more than it had pulled it, 1/(1 − h), by its leverage h, p/n in the mean of p
    unknowns. So the sum of the squares is n/(n − p) times the variance, with n − p degrees of freedom for Student's t
    (after MacKinnon & White, J. Econometrics 29, 1985: HC2 in place of HC3). Of n, those count that bear on it.
    """
    n = np.count_nonzero(np.abs(changes) > _BEARS_NOTHING * np.abs(changes).max())
    freedom = max(n - unknowns, 1)
    return float(np.sqrt(freedom / max(n, 1) * np.sum(changes**2)) * stdtrit(freedom, 0.975) / Z_95)


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
