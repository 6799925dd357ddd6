"""Friction and distance together: whisks at two tilts of the base, or more, that share their contact.

The plane of whisking is turned about the whisker, so that each whisk meets another slope at the same distance on the
same surface (section VII, way 1). (10) is linear in the distance on the base's cylinder and in μ,

    (|m|² / Cθ) d (1 + e) + |m_y| μ = m_z,

so that two whisks have one solution, and more a least-squares one. e is what (10) leaves out to first order, of which
friction along the whisker counts most: all of friction where nothing slips sideways, and less the more does. Neither
slopes nor tilts need be known; only must |m_y| of one whisk differ from another's. Angles in rad, lengths in mm.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan, cos, hypot, isnan, nan, sin, sqrt

import numpy as np

from estimator import first_order
from estimator.builtin import is_held
from estimator.distance import felt_slip_angle
from estimator.uncertainty import Z_95
from estimator.whisk import EstimatorSettings, Whisk

_ROUNDS = 8  # of weights and e by the solution; after four nothing changes that matters
_DRAWN = 0.6  # of θ d: how far a cantilever's end is drawn along itself as it bends, its arc's excess over its chord
# Of large bending's second order and of friction along the whisker that slips, what is left unknown when they are taken
# out: as much as exact mechanics differ from them (tests/studies/accuracy/two_tilts.py).
_LARGE_LEFT, _DRAGGING_LEFT = 1 / 3, 1 / 3
ALIKE = "the whisks slip alike: no two of them tell friction from distance"
NO_PUSH = "a whisk does not push: its m_z is not positive"
BELOW_ZERO = "the friction angle came out below 0"


@dataclass(frozen=True, eq=False)
class SharedContact:
    """Distance and friction angle that whisks share, with their covariance (2, 2) in mm, rad; NaN where status says
    why. low_mm, high_mm: the distance's 95 % interval."""

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
    """The contact of two whisks or more at different slopes of one surface. α_est is not asked for.

    apart_sigma_mm: how far a whisk's distance may be off the common one; places: what was set up once has one name, and
    is off by the same (default: each whisk by its own). shared_Nmm: of each whisk, what its moments
    change by at one sigma of each cause that all whisks have in common, (k, 2). What nothing is known of in the object
    enters as in (10): thickness and lean, of which all whisks meet the same. Raises ValueError for fewer than two.
    """
    if len(whisks) < 2:
        raise ValueError("two whisks at two tilts are the fewest that tell friction from distance")
    felt = np.array([(w.theta_at_rad, w.m_y_at_Nmm, w.m_z_at_Nmm) for w in whisks])
    if not (felt[:, 2] > 0).all() or not np.isfinite(felt).all():
        return _none(NO_PUSH)
    scale, m_z = _per_distance(whisks), felt[:, 2]
    solution, covariance = (
        _start(np.column_stack([scale, np.abs(felt[:, 1])]), m_z),
        np.full((2, 2), np.nan),
    )
    for _ in range(_ROUNDS):
        models = [_model(whisk, solution, settings) for whisk in whisks]
        across = [0.0 if model.held else abs(w.m_y_at_Nmm) for w, model in zip(whisks, models)]
        rows = np.column_stack([scale * [1 + model.error for model in models], across])
        apart = apart_sigma_mm * _by_place(places or range(len(whisks)))
        spread = _spread(whisks, models, solution, apart, shared_Nmm)
        solution, covariance = _weighted(rows, m_z, spread)
        if not np.isfinite(covariance).all() or not solution[0] > 0:
            return _none(ALIKE)
    return _told(whisks[0], solution, covariance)


def _per_distance(whisks: Sequence[Whisk]) -> np.ndarray:
    """|m|² / Cθ (n,)."""
    squares = np.array([w.m_y_at_Nmm**2 + w.m_z_at_Nmm**2 for w in whisks])
    return squares / [w.beam.C_Nmm2 * w.theta_at_rad for w in whisks]


def _start(rows: np.ndarray, m_z: np.ndarray) -> np.ndarray:
    """(d, μ) by plain least squares: friction may come out as anything, the distance is above zero."""
    d, mu = np.linalg.lstsq(rows, m_z, rcond=None)[0]
    return np.array([d, mu]) if d > 0 else np.array([(m_z / rows[:, 0]).mean(), 0.0])


def _weighted(
    rows: np.ndarray, m_z: np.ndarray, spread: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(d, μ) with covariance, by generalized least squares; NaN where the rows do not tell the two apart."""
    try:
        pull = np.linalg.solve(spread, rows)
        covariance = np.linalg.inv(rows.T @ pull)
    except np.linalg.LinAlgError:
        return np.full(2, np.nan), np.full((2, 2), np.nan)
    if not (np.diag(covariance) > 0).all():
        return np.full(2, np.nan), np.full((2, 2), np.nan)
    return covariance @ pull.T @ m_z, covariance


def _by_place(places: Sequence[object]) -> np.ndarray:
    """Which whisks (n, p) were made at each place, 1 or 0."""
    names = list(dict.fromkeys(places))
    return np.array([[float(name == place) for name in names] for place in places])


def _spread(whisks, models, solution, apart_mm, shared_Nmm) -> np.ndarray:
    """Covariance (n, n) of the equations' errors, N·mm: each whisk's own, and what all, or those of one place, have in
    common. apart_mm (n, p): one sigma of the distance by place."""
    by = np.array([_by_felt(whisk, model.held, solution) for whisk, model in zip(whisks, models)])
    per_mm = _per_distance(whisks)
    common = np.zeros((len(whisks), 0))
    if len(shared_Nmm):
        common = np.array([shared @ gradient[1:] for shared, gradient in zip(shared_Nmm, by)])
    causes = [
        common,
        per_mm[:, None] * apart_mm,
        solution[0] * per_mm[:, None] * [model.shared for model in models],
    ]
    causes = np.concatenate(causes, axis=1)
    own = np.array(
        [gradient @ _covariance(whisk) @ gradient for whisk, gradient in zip(whisks, by)]
    )
    own = np.maximum(
        own - (common**2).sum(axis=1), 0.0
    )  # the moments' covariance holds their shared causes, too
    left = solution[0] * per_mm * [model.own for model in models]
    return np.diag(own + left**2) + causes @ causes.T


def _by_felt(whisk: Whisk, held: bool, solution: np.ndarray) -> np.ndarray:
    """Change (3,) of m_z − a d − |m_y| μ with θ, m_y, m_z."""
    (d, mu), theta, m_y, m_z = solution, whisk.theta_at_rad, whisk.m_y_at_Nmm, whisk.m_z_at_Nmm
    stiff = d / (whisk.beam.C_Nmm2 * theta)
    of_friction = 0.0 if held else np.copysign(mu, m_y)
    return np.array(
        [stiff * (m_y**2 + m_z**2) / theta, -2 * stiff * m_y - of_friction, 1 - 2 * stiff * m_z]
    )


def _covariance(whisk: Whisk) -> np.ndarray:
    """Of θ, m_y, m_z (3, 3)."""
    whole = np.zeros((3, 3))
    whole[0, 0], whole[1:, 1:] = whisk.theta_sigma_rad**2, whisk.covariance_at
    whole[0, 1:] = whole[1:, 0] = whisk.theta_moment_covariance_at
    return whole


@dataclass(frozen=True)
class _Model:
    """Of one whisk: error of (10) as a share of d, and one sigma of what is not known of it: by lean, thickness and
    large bending, which whisks share (3,), and of its own. held: nothing slips sideways, so that m_y is noise."""

    held: bool
    error: float
    shared: np.ndarray
    own: float


def _model(whisk: Whisk, solution: np.ndarray, settings: EstimatorSettings) -> _Model:
    """By docs/maps.md, at the friction and the distance found so far. Of an object whose radius nobody tells all from
    nothing to what is allowed for is as likely. A share of d_x is 1/w of that of d, w of the diameter being left."""
    theta, alpha, d_x = (
        whisk.theta_at_rad,
        max(atan(solution[1]), 0.0),
        whisk.beam.distance_mm(solution[0]),
    )
    left, held = d_x / solution[0], is_held(whisk)
    phi = 0.0 if held else abs(felt_slip_angle(whisk.m_y_at_Nmm, whisk.m_z_at_Nmm))
    bent = theta if held else theta * max(cos(phi + alpha), 0.0) / cos(alpha)
    drawn, slipped = _DRAWN * bent, sin(phi) / cos(alpha)
    along = first_order.HELD_SHARE if held else drawn / hypot(drawn, slipped)
    dragging, large = first_order.dragging(theta, alpha), bent**2 / (6 * left)
    told = not isnan(settings.object_radius_mm)
    reach = (
        settings.object_radius_mm + settings.whisker_radius_mm * left
        if told
        else settings.object_reach_mm
    )
    rolling = first_order.rolling(theta, reach, phi, alpha, d_x, left)
    leaning = first_order.leaning(theta, settings.tilt_sigma_rad, phi, alpha)
    error = along * dragging + large + (rolling if told else 0.5 * rolling)
    shared = np.array([leaning, 0.0 if told else rolling / sqrt(12.0), _LARGE_LEFT * large])
    own = (first_order.HELD_SPREAD if held else _DRAGGING_LEFT * along) * dragging
    return _Model(held, error / left, shared / left, own / left)


def _told(whisk: Whisk, solution: np.ndarray, covariance: np.ndarray) -> SharedContact:
    """From (d, μ) to d_x and α."""
    d_x, mu = whisk.beam.distance_mm(solution[0]), max(solution[1], 0.0)
    by = np.diag([(d_x / solution[0]) ** 2, cos(atan(mu)) ** 2])
    covariance = by @ covariance @ by
    half = Z_95 * covariance[0, 0] ** 0.5
    low, high = max(d_x - half, 0.0), min(d_x + half, whisk.beam.length_mm)
    status = BELOW_ZERO if solution[1] < -Z_95 * covariance[1, 1] ** 0.5 else ""
    return SharedContact(float(d_x), atan(mu), covariance, float(low), float(high), status)


def _none(status: str) -> SharedContact:
    return SharedContact(nan, nan, np.full((2, 2), nan), status=status)
