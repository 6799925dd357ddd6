"""Friction and distance together: whisks at two tilts of the base, or more, that share their
contact.

The plane of whisking is turned about the whisker, so that each whisk meets another slope at the
same distance on the same surface (section VII, way 1). (10) is linear in the distance on the base's
cylinder and in μ,

    (|m|² / Cθ) d (1 + e) + |m_y| μ = m_z,

so that two whisks have one solution, and more a least-squares one. e is what (10) leaves out to
first order, of which friction along the whisker counts most: all of friction where nothing slips
sideways, and less the more does. Neither slopes nor tilts need be known; only must |m_y| of one
whisk differ from another's. Angles in rad, lengths in mm.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import atan, cos, hypot, nan, sin, sqrt

import numpy as np

from estimator import first_order
from estimator.reasons import NamedReason
from estimator.uncertainty import Z_95
from estimator.whisk import EstimatorSettings, Whisk

# [iterations] Of weights and e by the solution: four as a rule; where e is large they may circle. Stated.
_MOST_ITERATIONS = 40
# [sigma] Last step of an iteration that has converged. Stated.
_LAST_STEP_SIGMAS = 1e-6
# [1] The same over distance and tan α, where sigmas are nothing: rounding, many times over. Derived.
_LAST_STEP = 1e-9
# [1] How far a cantilever's end is drawn along itself as it bends, in θ d: its arc's excess over its chord.
# Derived.
DRAWN = 0.6
# [1] Share left unknown of large bending's second order when that is taken out: as much as exact
# mechanics differ from it. Study: tests/studies/accuracy/two_tilts.py.
_LARGE_LEFT = 1 / 3
# [1] The share of friction along a whisker that slips. Study: tests/studies/accuracy/two_tilts.py.
_DRAGGING_LEFT = 1 / 3
ALIKE = NamedReason(
    "whisks_slip_alike", "the whisks slip alike: no two of them tell friction from distance"
)
UNCONVERGED = NamedReason(
    "whisks_unconverged",
    "friction and distance do not converge: the whisks are pushed too far for what (10) leaves out",
)
NO_PUSH = NamedReason("whisk_not_pushing", "a whisk does not push: its m_z is not positive")
BELOW_ZERO = NamedReason("friction_below_zero", "the friction angle came out below 0")


@dataclass(frozen=True, eq=False)
class SharedContact:
    """Distance and friction angle that whisks share, with their covariance (2, 2) in mm, rad.

    NaN where status says why. low_mm, high_mm: the distance's 95 % interval.
    """

    d_x_mm: float
    alpha_rad: float
    covariance: np.ndarray
    low_mm: float = nan
    high_mm: float = nan
    status: str = ""


def shared_contact(
    whisks: Sequence[Whisk],
    settings: EstimatorSettings,
    *,
    apart_sigma_mm: float = 0.0,
    places: Sequence[object] = (),
    shared_Nmm: Sequence[np.ndarray] = (),
) -> SharedContact:
    """Solve for the contact of two whisks or more at different slopes of one surface; α_est is not
    used.

    apart_sigma_mm: standard deviation of a whisk's distance from the common one. places: a name for
    each whisk; those of one name were set up once, and have the same deviation (default: each whisk
    its own). shared_Nmm: for each whisk, the change (k, 2) of its moments by one sigma of each
    cause that all whisks have in common. Thickness and lean of the object are unknown as in (10),
    and the same for all whisks. Raises ValueError for fewer than two whisks.
    """
    if len(whisks) < 2:
        raise ValueError("two whisks at two tilts are the fewest that tell friction from distance")
    apart = apart_sigma_mm * _by_place(places or range(len(whisks)))
    equations = _Equations(whisks, settings, apart, shared_Nmm)
    if not equations.all_push:
        return _without_contact(NO_PUSH)
    solution = equations.start()
    for _ in range(_MOST_ITERATIONS):
        before = solution
        solution, covariance = equations.refine(solution)
        if not np.isfinite(covariance).all() or not solution[0] > 0:
            return _without_contact(ALIKE)
        if _has_converged(solution - before, solution, covariance):
            return _contact(whisks[0], solution, covariance)
    return _without_contact(UNCONVERGED)


@dataclass(frozen=True, eq=False)
class _Equations:
    """Equations m_z = a d (1 + e) + |m_y| μ of n whisks, a = |m|² / Cθ, in (d, μ).

    apart_mm (n, p): one sigma of the distance by place. shared_Nmm: as in `shared_contact`.
    """

    whisks: Sequence[Whisk]
    settings: EstimatorSettings
    apart_mm: np.ndarray
    shared_Nmm: Sequence[np.ndarray]

    @cached_property
    def felt(self) -> np.ndarray:
        """Return θ, m_y and m_z (n, 3) of the whisks, rad and N·mm."""
        return np.array([whisk.felt for whisk in self.whisks])

    @property
    def all_push(self) -> bool:
        """Return whether all of θ, m_y and m_z are known, and each m_z is positive."""
        return bool((self.m_z > 0).all() and np.isfinite(self.felt).all())

    @cached_property
    def per_mm(self) -> np.ndarray:
        """Return a (n,), N·mm per mm."""
        theta, m_y, m_z = self.felt.T
        stiffness = np.array([whisk.beam.C_Nmm2 for whisk in self.whisks])
        return (m_y**2 + m_z**2) / (stiffness * theta)

    @property
    def m_y(self) -> np.ndarray:
        """Return |m_y| (n,), N·mm."""
        return np.abs(self.felt[:, 1])

    @property
    def m_z(self) -> np.ndarray:
        """Return m_z (n,), N·mm."""
        return self.felt[:, 2]

    def start(self) -> np.ndarray:
        """Solve for (d, μ) without errors and weights."""
        return _start(np.column_stack([self.per_mm, self.m_y]), self.m_z)

    def refine(self, solution: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Solve for (d, μ) and its covariance with errors and weights at the solution so far."""
        models = []
        by_friction = []
        for whisk, m_y in zip(self.whisks, self.m_y):
            model = _model(whisk, solution, self.settings)
            models.append(model)
            by_friction.append(0.0 if model.held else m_y)
        error = np.array([model.error for model in models])
        rows = np.column_stack([self.per_mm * (1 + error), by_friction])
        return _weighted(rows, self.m_z, self.spread(models, solution))

    def spread(self, models: "Sequence[_TiltModel]", solution: np.ndarray) -> np.ndarray:
        """Compute the covariance (n, n) of the equations' errors, (N·mm)².

        It holds each whisk's own errors, and those that all whisks or those of one place have in
        common.
        """
        own, common = self._by_felt(models, solution)
        by_own_model = solution[0] * self.per_mm * [model.own for model in models]
        # The equations are of the base's cylinder, 1/d = 1/d_x − τ: a change of d_x is one of d times (d/d_x)².
        d_per_d_x = (solution[0] / self.whisks[0].beam.distance_mm(solution[0])) ** 2
        by_place = self.per_mm[:, None] * self.apart_mm * d_per_d_x
        by_model = solution[0] * self.per_mm[:, None] * [model.shared for model in models]
        causes = np.concatenate([common, by_place, by_model], axis=1)
        return np.diag(own + by_own_model**2) + causes @ causes.T

    def _by_felt(self, models, solution) -> tuple[np.ndarray, np.ndarray]:
        """Return the variances (n,) by each whisk's own angle and moments, (N·mm)², and the changes
        (n, k) by the causes that all have in common, N·mm.
        """
        count = len(self.whisks)
        measured = np.zeros(count)
        common = []  # (k,) of each whisk
        for row, (whisk, model) in enumerate(zip(self.whisks, models)):
            gradient = _gradient(whisk, model.held, solution)
            measured[row] = gradient @ whisk.felt_covariance @ gradient
            by_causes = self.shared_Nmm[row] @ gradient[1:] if len(self.shared_Nmm) else np.zeros(0)
            common.append(by_causes)
        common = np.array(common)
        # The moments' covariance holds their shared causes, too.
        return np.maximum(measured - (common**2).sum(axis=1), 0.0), common


def _has_converged(step: np.ndarray, solution: np.ndarray, covariance: np.ndarray) -> bool:
    """Return whether the last step (2,) of (d, μ) is nothing against its sigmas."""
    least = _LAST_STEP * np.array([solution[0], 1.0])
    return bool((np.abs(step) <= _LAST_STEP_SIGMAS * np.sqrt(np.diag(covariance)) + least).all())


def _start(rows: np.ndarray, m_z: np.ndarray) -> np.ndarray:
    """Solve for (d, μ) by plain least squares; without friction where the distance is not above
    zero.
    """
    solution = np.linalg.lstsq(rows, m_z, rcond=None)[0]
    if solution[0] > 0:
        return solution
    return np.array([(m_z / rows[:, 0]).mean(), 0.0])


def _weighted(
    rows: np.ndarray, m_z: np.ndarray, spread: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Solve for (d, μ) with covariance by generalized least squares; NaN where the rows do not
    separate the two.
    """
    nothing = np.full(2, np.nan), np.full((2, 2), np.nan)
    try:
        pull = np.linalg.solve(spread, rows)
        covariance = np.linalg.inv(rows.T @ pull)
    except np.linalg.LinAlgError:
        return nothing
    if not (np.diag(covariance) > 0).all():
        return nothing
    return covariance @ pull.T @ m_z, covariance


def _by_place(places: Sequence[object]) -> np.ndarray:
    """Return which whisks (n, p) were made at each place, 1 or 0."""
    names = list(dict.fromkeys(places))
    made_at = np.zeros((len(places), len(names)))
    for row, place in enumerate(places):
        made_at[row, names.index(place)] = 1.0
    return made_at


def _gradient(whisk: Whisk, held: bool, solution: np.ndarray) -> np.ndarray:
    """Compute the derivative (3,) of m_z − a d − |m_y| μ by θ, m_y, m_z, where a = |m|² / Cθ."""
    d, mu = solution
    theta, m_y, m_z = whisk.felt
    per_moment = d / (whisk.beam.C_Nmm2 * theta)
    friction = 0.0 if held else np.copysign(mu, m_y)
    by_theta = per_moment * (m_y**2 + m_z**2) / theta
    return np.array([by_theta, -2 * per_moment * m_y - friction, 1 - 2 * per_moment * m_z])


@dataclass(frozen=True)
class _TiltModel:
    """Errors of (10) for one whisk, as shares of d.

    held: nothing slips sideways, so that m_y is noise. error: the error that is corrected. shared
    (3,): sigmas by lean, thickness and large bending, which whisks have in common. own: the whisk's
    own sigma.
    """

    held: bool
    error: float
    shared: np.ndarray
    own: float


def _model(whisk: Whisk, solution: np.ndarray, settings: EstimatorSettings) -> _TiltModel:
    """Evaluate the errors of (10), docs/maps.md, at the friction and the distance found so far.

    Where the object's radius is not known, everything from nothing to the allowed reach is equally
    probable. A share of d_x is 1/w of that of d, w being the diameter there over the base's.
    """
    theta = whisk.theta_at_rad
    alpha = max(atan(solution[1]), 0.0)
    d_x = whisk.beam.distance_mm(solution[0])
    thickness = d_x / solution[0]
    held = whisk.is_held
    bending = _bending_held(theta, alpha) if held else _bending_slipping(whisk, alpha)
    large = first_order.bending_far(bending.bent, thickness)
    rolling, rolling_sigma = _rolling(theta, bending.phi, alpha, d_x, thickness, settings)
    leaning = first_order.leaning(theta, settings.tilt_sigma_rad, bending.phi, alpha)
    error = bending.dragging + large + rolling
    by_taper = whisk.beam.share_by_taper(d_x)
    shared = np.array([leaning, rolling_sigma, _LARGE_LEFT * large, by_taper])
    return _TiltModel(
        held, error / thickness, shared / thickness, bending.dragging_sigma / thickness
    )


@dataclass(frozen=True)
class _Bending:
    """How a whisker bends and is drawn along itself.

    phi: felt slip angle, rad. bent: how much of the pushing angle bends it, rad. dragging: error by
    friction along it, as a share, with its sigma.
    """

    phi: float
    bent: float
    dragging: float
    dragging_sigma: float


def _bending_held(theta: float, alpha: float) -> _Bending:
    """Return the bending of a whisker that does not slip sideways."""
    dragging = first_order.dragging(theta, alpha)
    of_held = (first_order.HELD_SHARE * dragging, first_order.HELD_SPREAD * dragging)
    return _Bending(0.0, theta, *of_held)


def _bending_slipping(whisk: Whisk, alpha: float) -> _Bending:
    """Return the bending of a whisker that slips sideways.

    Friction acts along it by the share that the way along has in the whole way of the contact.
    """
    theta = whisk.theta_at_rad
    phi = abs(whisk.phi_rad)
    bent = theta * max(cos(phi + alpha), 0.0) / cos(alpha)
    drawn = DRAWN * bent
    along = drawn / hypot(drawn, sin(phi) / cos(alpha))
    dragging = first_order.dragging(theta, alpha)
    return _Bending(phi, bent, along * dragging, _DRAGGING_LEFT * along * dragging)


def _rolling(theta, phi, alpha, d_x, thickness, settings) -> tuple[float, float]:
    """Return the error by rolling over the object, and its sigma: that of a uniform distribution of
    unknown radii.
    """
    reach = settings.reach_mm(thickness)
    rolling = first_order.rolling(theta, reach, phi, alpha, d_x, thickness)
    if settings.is_radius_known:
        return rolling, 0.0
    return 0.5 * rolling, rolling / sqrt(12.0)


def _contact(whisk: Whisk, solution: np.ndarray, covariance: np.ndarray) -> SharedContact:
    """Convert (d, μ) with its covariance to d_x and α."""
    d, mu = solution.tolist()
    d_x = float(whisk.beam.distance_mm(d))
    alpha = atan(max(mu, 0.0))
    jacobian = np.diag([(d_x / d) ** 2, cos(alpha) ** 2])
    covariance = jacobian @ covariance @ jacobian
    half_d_x, half_alpha = Z_95 * np.sqrt(np.diag(covariance))
    return SharedContact(
        d_x_mm=d_x,
        alpha_rad=alpha,
        covariance=covariance,
        low_mm=float(max(d_x - half_d_x, 0.0)),
        high_mm=float(min(d_x + half_d_x, whisk.beam.length_mm)),
        status=BELOW_ZERO if mu < -half_alpha else "",
    )


def _without_contact(status: str) -> SharedContact:
    """Return that there is no contact, and why."""
    return SharedContact(nan, nan, np.full((2, 2), nan), status=status)
