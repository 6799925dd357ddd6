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

from bench.analyses.explained import by_10
from bench.base.settings import ALPHA_EST_SIGMA_DEG
from bench.records.trial_result import TrialResult, whisks
from bench.session.whisker import Whisker
from estimator.distance import felt_slip_angle
from estimator.friction import alpha_from_tilts, confidence
from estimator.uncertainty import Z_95

_ALPHA_EST_SIGMA_RAD = np.radians(ALPHA_EST_SIGMA_DEG)
_FEWEST = 3  # whisks, or recordings: the least that scatter about a mean and a slope
_STEP_RAD = 1e-4  # of a derivative by differences: its error goes with the square
# rad: the best of these is then refined
_GRID_RAD = np.radians(np.arange(0.0, 45.0, 0.5))
TOO_FEW = "needs more recordings than it has unknowns to say how well it is known"
# of the variance that is the fit's own: with less, Student's t is the normal distribution
_LEAST_SHARE = 1e-3
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

    def found(some: Sequence[Contact]) -> _Found:
        fit = alpha_from_tilts([c.beta_rad for c in some], [c.phi_rad for c in some])
        return _Found(fit.alpha_rad, fit.sigma_rad, fit.freedom, fit.status)

    return _with_shared("tilting", found, known)


def by_consistency(of_surface: Sequence[Contact], whisker: Whisker) -> Way:
    """Way 2: the α under which distances scatter least as shares of themselves."""
    nominal = {c.d_x_nominal_mm for c in of_surface}
    if len(of_surface) < _FEWEST or len(nominal) != 1 or not np.isfinite(list(nominal)).all():
        return Way(
            "consistency",
            np.nan,
            np.nan,
            f"needs {_FEWEST} whisks or more at one nominal distance (d_x_mm)",
        )
    return _by_object("consistency", of_surface, whisker, 0)


def by_smoothness(of_surface: Sequence[Contact], whisker: Whisker) -> Way:
    """Way 2 of an object that is no edge at one distance: the α whose contacts lie best on a straight one.

    Bars at several nominal distances stand for one straight edge that leans along the whisker, touched at heights that
    are these distances.
    """
    nominal = {c.d_x_nominal_mm for c in of_surface}
    if len(nominal) < 2 or not np.isfinite(list(nominal)).all():
        return Way(
            "smoothness", np.nan, np.nan, "needs whisks at two nominal distances (d_x_mm) or more"
        )
    return _by_object("smoothness", of_surface, whisker, 1)


def _by_object(name: str, of_surface: Sequence[Contact], whisker: Whisker, degree: int) -> Way:
    """Way 2 with an object whose distance is a polynomial of this degree in height."""
    if not np.isfinite(_distances(of_surface, np.zeros(1), whisker)).all():
        return Way(name, np.nan, np.nan, "a whisk is no push against an object")
    if np.ptp([abs(np.tan(c.phi_rad)) for c in of_surface]) < _LEAST_SPREAD:
        return Way(name, np.nan, np.nan, "the whisks do not span two slip angles")
    return _with_shared(name, lambda some: _least_scatter(some, whisker, degree), of_surface)


@dataclass(frozen=True)
class _Found:
    """What a fit to recordings gives: α, its sigma by their residuals, and the degrees of freedom of that."""

    alpha_rad: float
    sigma_rad: float = np.nan
    freedom: float = 0
    status: str = ""


def _with_shared(
    name: str, found: Callable[[Sequence[Contact]], _Found], known: Sequence[Contact]
) -> Way:
    """What `found` makes of recordings; NaN where that has a status.

    Whisks of one recording share a bar that was set up once, and are no independent repeats: their mean counts as one.
    What all whisks share comes on top, one cause after another. The sum has the degrees of freedom of Welch and
    Satterthwaite, cut to a whole number (GUM, G.4); sigma is half a 95 % interval by Student's t, over 1.96.
    """
    of_trials = [
        [c for c in known if c.trial == trial] for trial in dict.fromkeys(c.trial for c in known)
    ]
    recordings = [_mean(some) for some in of_trials]
    fit = found(recordings)
    if fit.status or fit.freedom < 1:
        return Way(name, np.nan, np.nan, fit.status or TOO_FEW)
    causes = range(len(known[0].shared_Nmm))
    shared = [found([c.moved(k) for c in recordings]).alpha_rad - fit.alpha_rad for k in causes]
    variance = fit.sigma_rad**2 + np.sum(np.nan_to_num(shared) ** 2)
    own = max(fit.sigma_rad**2 / variance, _LEAST_SHARE) if variance > 0 else 1.0
    freedom = np.floor(fit.freedom / own**2)
    return Way(name, fit.alpha_rad, float(np.sqrt(variance) * stdtrit(freedom, 0.975) / Z_95))


def _mean(some: Sequence[Contact]) -> Contact:
    """The whisks of one recording as one."""
    means = {
        name: np.mean([getattr(c, name) for c in some], axis=0)
        for name in ("m_y_Nmm", "m_z_Nmm", "shared_Nmm")
    }
    return replace(some[0], **means)


def _distances(some: Sequence[Contact], alphas_rad, whisker: Whisker) -> np.ndarray:
    """By (10), mm, (contacts, α); NaN where there is none."""
    felt = ([[getattr(c, name)] for c in some] for name in ("theta_rad", "m_y_Nmm", "m_z_Nmm"))
    return by_10(*map(np.array, felt), alphas_rad, whisker)


def _off(distances: np.ndarray, heights: np.ndarray, degree: int) -> np.ndarray:
    """How far contacts (n,) lie off the polynomial in height that fits them best, as shares of their distances."""
    design = np.vander(heights, degree + 1) / distances[:, None]
    if not np.isfinite(design).all():
        return np.full(len(distances), np.nan)
    return 1.0 - design @ np.linalg.lstsq(design, np.ones(len(distances)), rcond=None)[0]


def _least_scatter(some: Sequence[Contact], whisker: Whisker, degree: int) -> _Found:
    """α at which the contacts lie least off an object; where one of their distances ends, the search ends, and says so.

    Sigma is that of a least-squares fit whose residuals, all of one size, are what bars are set up wrong by.
    """
    heights = np.array([c.d_x_nominal_mm for c in some])

    def off(alphas_rad) -> np.ndarray:
        return np.array(
            [
                _off(d, heights, degree)
                for d in _distances(some, np.atleast_1d(alphas_rad), whisker).T
            ]
        )

    on_grid = np.sum(off(_GRID_RAD) ** 2, axis=1)
    last, best = int(np.flatnonzero(np.isfinite(on_grid))[-1]), int(np.nanargmin(on_grid))
    if best in (0, last):
        bound = np.degrees(_GRID_RAD[best])
        return _Found(
            np.nan, status=f"at the bound of the search, {bound:.1f}°: no angle between fits"
        )
    bracket = _GRID_RAD[best - 1], _GRID_RAD[best + 1]
    found = minimize_scalar(
        lambda a: np.sum(off(a) ** 2), bounds=bracket, method="bounded", options={"xatol": 1e-7}
    )
    freedom = len(some) - degree - 2  # the object's coefficients, and α
    if freedom < 1:
        return _Found(float(found.x))
    high, low = off(found.x + _STEP_RAD * np.array([1.0, -1.0]))
    sigma = np.sqrt(found.fun / freedom / np.sum(((high - low) / (2.0 * _STEP_RAD)) ** 2))
    return _Found(float(found.x), float(sigma), freedom)


def weights(phi_rad: Sequence[float], alpha_est_rad: float) -> np.ndarray:
    """Way 3: confidence (n,) in contacts of these slip angles, 1 where friction does not matter."""
    return np.atleast_1d(confidence(np.array(phi_rad), alpha_est_rad, _ALPHA_EST_SIGMA_RAD))
