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

from bench.analyses.explained import by_10
from bench.analyses.felt_push import FeltPush
from bench.analyses.pooling import column, grouped, measured
from bench.analyses.theory_left import as_theory_has_them
from bench.base.combined import add_common, student_factor
from bench.base.settings import ALPHA_EST_SIGMA_DEG
from bench.base.statuses import reason
from bench.records.trial_result import TrialResult, whisks
from bench.session.whisker import Whisker
from estimator.friction_ways import alpha_from_tilts, confidence
from vision import UNKNOWN, Value

_ALPHA_EST_SIGMA_RAD = np.radians(ALPHA_EST_SIGMA_DEG)
# [whisks, recordings] One more than a mean and a slope take. Derived.
_FEWEST = 3
# [rad] Step of a derivative by differences: its error goes with the square. Derived.
_STEP_RAD = 1e-4
# [rad] Friction angles that are tried; the best is then refined. Stated.
_GRID_RAD = np.radians(np.arange(0.0, 45.0, 0.5))
# [1] Least spread of |tan φ|: contacts with one slip angle agree under any α. Stated.
_LEAST_SPREAD = 0.05


@dataclass(frozen=True)
class Way:
    """One way on one surface: α, rad; UNKNOWN where status says why."""

    name: str
    alpha: Value = UNKNOWN
    status: str = ""


def contacts(results: Sequence[TrialResult], panel: tuple[str, float | None]) -> list[FeltPush]:
    """Return the measured whisks of one surface and speed that have sound moments, at nominal slopes and
    distances."""
    found = []
    for result, _, felt in whisks(measured(results)):
        trial = result.trial
        if trial.panel != panel or not felt.has_moments or felt.apart:
            continue
        contact = FeltPush(
            np.radians(trial.beta_nominal_deg),
            trial.d_x_nominal_mm,
            result.theta_rad,
            felt.m_y_Nmm.value,
            felt.m_z_Nmm.value,
            felt.shared_Nmm,
            trial.name,
            reach_mm=result.reach_mm(trial.d_x_nominal_mm),
        )
        found.append(contact)
    return found


def by_tilting(of_surface: Sequence[FeltPush], whisker: Whisker) -> Way:
    """Return α by way 1, from nominal slopes of both signs."""
    known = [contact for contact in of_surface if np.isfinite(contact.beta_rad)]
    slopes = [contact.beta_rad for contact in known]
    if not (slopes and min(slopes) < 0 < max(slopes)):
        return Way("tilting", status=reason("slopes_one_sided"))

    def fit(recordings: Sequence[FeltPush]) -> _AlphaFit:
        """Fit the slip angles of tilts."""
        betas = [contact.beta_rad for contact in recordings]
        fitted = alpha_from_tilts(betas, [contact.phi_rad for contact in recordings])
        return _AlphaFit(fitted.alpha_rad, fitted.sigma_rad, fitted.freedom, fitted.status)

    return _with_shared("tilting", fit, known, whisker)


def by_consistency(of_surface: Sequence[FeltPush], whisker: Whisker) -> Way:
    """Return α by way 2: that under which distances scatter least in parts of their mean."""
    nominal = {contact.d_x_mm for contact in of_surface}
    if len(of_surface) < _FEWEST or len(nominal) != 1 or not np.isfinite(list(nominal)).all():
        return Way("consistency", status=reason("whisks_few", least=_FEWEST))
    return _by_object("consistency", of_surface, whisker, 0)


def by_smoothness(of_surface: Sequence[FeltPush], whisker: Whisker) -> Way:
    """Return α by way 2 of an object that is no edge at one distance: contacts lie on a straight one.

    Bars at several nominal distances stand for one straight edge that leans along the whisker, touched at heights that
    are these distances.
    """
    nominal = {contact.d_x_mm for contact in of_surface}
    if len(nominal) < 2 or not np.isfinite(list(nominal)).all():
        return Way("smoothness", status=reason("one_nominal_distance"))
    return _by_object("smoothness", of_surface, whisker, 1)


def _by_object(name: str, of_surface: Sequence[FeltPush], whisker: Whisker, degree: int) -> Way:
    """Return α by way 2 with an object whose distance is a polynomial of this degree in height."""
    if not np.isfinite(_distances(of_surface, np.zeros(1), whisker)).all():
        return Way(name, status=reason("no_push_on_object"))
    if np.ptp([abs(np.tan(contact.phi_rad)) for contact in of_surface]) < _LEAST_SPREAD:
        return Way(name, status=reason("slip_angles_alike"))

    def fit(recordings: Sequence[FeltPush]) -> _AlphaFit:
        """Fit the distances of contacts to the object."""
        return _least_scatter(recordings, whisker, degree)

    return _with_shared(name, fit, of_surface, whisker)


@dataclass(frozen=True)
class _AlphaFit:
    """A fit of α to recordings, with its sigma by their residuals and the degrees of freedom of that."""

    alpha_rad: float
    sigma_rad: float = np.nan
    freedom: float = 0
    status: str = ""


def _with_shared(
    name: str,
    fit_to: Callable[[Sequence[FeltPush]], _AlphaFit],
    known: Sequence[FeltPush],
    whisker: Whisker,
) -> Way:
    """Return the way by a fit to recordings, with what all whisks share in its sigma.

    Whisks of one recording share a bar that was set up once, and are no independent repeats: their mean counts as one.
    What all whisks share comes on top, one cause after another, and so does what theory leaves out of all of them
    (`bench.analyses.theory_left`). Sigma is half a 95 % interval by Student's t, over 1.96.
    """
    of_trials = grouped(known, lambda contact: contact.trial)
    recordings = [_mean(some) for some in of_trials.values()]
    fit = fit_to(recordings)
    if fit.status or fit.freedom < 1:
        return Way(name, status=fit.status or reason("recordings_few"))
    alphas_rad = []  # with each shared cause off by its sigma
    for cause in range(len(known[0].shared_Nmm)):
        moved = fit_to([contact.moved(cause) for contact in recordings])
        alphas_rad.append(moved.alpha_rad)
    in_theory = fit_to(_as_theory_has_them(recordings, fit.alpha_rad, whisker))
    alphas_rad.append(in_theory.alpha_rad)
    total = add_common(fit.sigma_rad, fit.freedom, np.array(alphas_rad) - fit.alpha_rad)
    sigma_rad = float(np.sqrt(total.variance)) * student_factor(total.freedom)
    return Way(name, Value(fit.alpha_rad, sigma_rad))


def _as_theory_has_them(
    some: Sequence[FeltPush], alpha_rad: float, whisker: Whisker
) -> list[FeltPush]:
    """Return the contacts without what theory leaves out of their moments at an α."""
    found = []
    for contact, (m_y, m_z) in zip(some, as_theory_has_them(some, alpha_rad, whisker.beam)):
        found.append(replace(contact, m_y_Nmm=float(m_y), m_z_Nmm=float(m_z)))
    return found


def _mean(some: Sequence[FeltPush]) -> FeltPush:
    """Return the whisks of one recording as one."""
    return replace(
        some[0],
        m_y_Nmm=column(some, "m_y_Nmm").mean(),
        m_z_Nmm=column(some, "m_z_Nmm").mean(),
        shared_Nmm=column(some, "shared_Nmm").mean(axis=0),
    )


def _distances(some: Sequence[FeltPush], alphas_rad: np.ndarray, whisker: Whisker) -> np.ndarray:
    """Return d_x by (10), mm, (contacts, α); NaN where there is none."""
    theta = column(some, "theta_rad")[:, None]
    m_y = column(some, "m_y_Nmm")[:, None]
    m_z = column(some, "m_z_Nmm")[:, None]
    return by_10(theta, m_y, m_z, alphas_rad, whisker)


def _residuals(distances: np.ndarray, heights: np.ndarray, degree: int) -> np.ndarray:
    """Return how far contacts (contacts, α) lie from the polynomial in height that fits them best.

    In parts of their mean distance: of their own, near bars would err by more, for a hand sets all
    of them wrong by as many millimetres; in millimetres the largest α would scatter least. NaN of an
    α at which a contact has no distance.
    """
    design = np.vander(heights, degree + 1)
    on_object = design @ np.linalg.pinv(design) @ distances
    return (distances - on_object) / np.mean(distances, axis=0)


def _least_scatter(some: Sequence[FeltPush], whisker: Whisker, degree: int) -> _AlphaFit:
    """Fit the α at which the contacts lie least off an object.

    Where one of their distances ends, the search ends, and status says so. Sigma is that of a least-squares fit whose
    residuals, all of one size, are what bars are set up wrong by.
    """
    heights = column(some, "d_x_mm")

    def residuals(alphas_rad: np.ndarray) -> np.ndarray:
        """Return residuals (contacts, α)."""
        return _residuals(_distances(some, alphas_rad, whisker), heights, degree)

    def squares(alphas_rad: np.ndarray) -> np.ndarray:
        """Return the sums (α,) of squared residuals."""
        return np.sum(residuals(alphas_rad) ** 2, axis=0)

    on_grid = squares(_GRID_RAD)
    best = int(np.nanargmin(on_grid))
    if best in (0, _last_known(on_grid)):
        status = reason("friction_at_bound", bound_deg=np.degrees(_GRID_RAD[best]))
        return _AlphaFit(np.nan, status=status)
    alpha_rad, least = _bounded_minimum(squares, (_GRID_RAD[best - 1], _GRID_RAD[best + 1]))
    freedom = len(some) - degree - 2  # the object's coefficients, and α
    if freedom < 1:
        return _AlphaFit(alpha_rad)
    sigma = _fit_sigma(residuals, alpha_rad, least / freedom)
    return _AlphaFit(alpha_rad, sigma, freedom)


def _last_known(values: np.ndarray) -> int:
    """Return the place of the last finite value (n,)."""
    return int(np.flatnonzero(np.isfinite(values))[-1])


def _bounded_minimum(
    squares: Callable[[np.ndarray], np.ndarray], bounds: tuple[float, float]
) -> tuple[float, float]:
    """Return the α between two bounds, rad, at which the sum of squares is least, and that sum."""
    found = minimize_scalar(
        lambda alpha_rad: squares(np.array([alpha_rad]))[0],
        bounds=bounds,
        method="bounded",
        options={"xatol": 1e-7},
    )
    return float(found.x), found.fun


def _fit_sigma(
    residuals: Callable[[np.ndarray], np.ndarray], alpha_rad: float, variance: float
) -> float:
    """Return the standard deviation of a least-squares fit of α by the variance of its residuals."""
    high, low = residuals(alpha_rad + _STEP_RAD * np.array([1.0, -1.0])).T
    slope = (high - low) / (2.0 * _STEP_RAD)
    return float(np.sqrt(variance / np.sum(slope**2)))


def weights(phi_rad: Sequence[float], alpha_est_rad: float) -> np.ndarray:
    """Return by way 3 the confidence (n,) in contacts of these slip angles.

    It is 1 where friction does not matter.
    """
    return np.atleast_1d(confidence(np.array(phi_rad), alpha_est_rad, _ALPHA_EST_SIGMA_RAD))
