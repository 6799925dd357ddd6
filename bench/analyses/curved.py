"""How an object is curved, from successive contacts of one whisk: curvature.csv, a row a whisk, from moments alone.

In the whisking plane a bar is a circle. The contact rolls over it towards the base as the whisker bends, so that (10)
comes out the shorter the further the push (docs/maps.md): its change with θ is the circle's radius. In the sensing
plane a straight bar is flat: there φ stays as it is, and what it changes by with θ is the lateral curvature of
Appendix B, by (23) to (25) as printed and by the exact form.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun
from bench.analyses.cells import value_cells, whisk_cells
from bench.analyses.gave import OBJECT
from bench.analyses.pooling import column, sound_measured_whisks
from bench.base.combined import Combined, Measurement, Measurements, holm
from bench.base.settings import TILT_SIGMA_RAD
from bench.base.statuses import reason
from bench.base.tables import TRIAL, WHISK, Column, Table, status, with_sigma
from bench.records.trial_result import FeltAt, FeltWhisk, TrialResult
from bench.session.whisker import Whisker
from estimator import curvature, first_order
from estimator.beam import Beam
from estimator.domain import RIGHT_ANGLE
from estimator.uncertainty import Z_95, gradient_with_friction, slip_angle_sigma
from vision import UNKNOWN, Value
from vision.geometry import counted

CURVATURE = Table(
    "curvature",
    "A row a measured whisk: how its object is curved, from the moments at successive pushing "
    "angles.",
    (
        TRIAL,
        WHISK,
        Column("angles", "how many pushing angles served"),
        *with_sigma("radius_mm", "radius of curvature in the whisking plane, felt"),
        Column("bar_radius_mm", "radius of the bar as stated"),
        *with_sigma("phi_0_deg", "slip angle at touch"),
        *with_sigma(
            "lateral_per_mm",
            "curvature in the sensing plane, by (23) to (25) with the exact φ; 0 of a straight bar",
            "lateral_sigma_per_mm",
        ),
        Column("lateral_printed_per_mm", "the same with (24) as printed"),
        status("what is missing"),
    ),
)
# [1] Of sessions of straight bars that by chance say of a bar that it is curved to the side. Stated.
_FALSE_ALARM = 0.01
_UNMEASURED = Measurement(np.nan, np.nan)
# [rad] Least pushing angle: nearer to touch the window of a moment is shorter, and (10) mostly noise. Stated.
_FIRST_RAD = np.radians(0.95)
# [rad] Between pushing angles: windows of half a degree to either side share no sample. Derived.
_APART_RAD = np.radians(0.95)
# [angles] Two more than a fit has numbers. Derived.
_FEWEST = 6
# [sigma] Of a slip angle, within which it is none: so are 95 % of whisks that are held. Derived.
_HELD_SIGMAS = 2.0
# [1] Of φ at touch: where it turns by more, terms to θ² are too few. Of nine pushes against a ball of 40 mm those within
# 0.65 are off by 1.8 sigma at most, from 0.75 on by 2 to 7 (tests/bench/analyses/test_curved.py).
_MOST_TURN = 0.6


@dataclass(frozen=True)
class Curved:
    """The curvature of an object by one whisk; NaN where it is not known, and status says why.

    angles: how many pushing angles served. radius: in the whisking plane, mm. phi_0_rad: φ at touch.
    lateral: curvature in the sensing plane by the exact form, 1/mm; lateral_printed_per_mm: by (24).
    """

    angles: int
    radius: Measurement = _UNMEASURED
    phi_0_rad: Value = UNKNOWN
    lateral: Measurement = _UNMEASURED
    lateral_printed_per_mm: float = np.nan
    status: str = ""

    @property
    def radius_mm(self) -> Value:
        """Return the radius of curvature in the whisking plane."""
        return Value(self.radius.value, self.radius.sigma)

    @property
    def lateral_per_mm(self) -> Value:
        """Return the curvature in the sensing plane."""
        return Value(self.lateral.value, self.lateral.sigma)


@dataclass(frozen=True, eq=False)
class CurvedWhisk:
    """A whisk, and the curvature of its object."""

    result: TrialResult
    felt: FeltWhisk
    curved: Curved

    @property
    def bar_radius_mm(self) -> float:
        """Return the radius of the bar as stated."""
        return 0.5 * self.result.trial.bar_diameter_mm


class Curvature(Analysis):
    """How objects are curved along and across the whisker's way."""

    tables = (CURVATURE,)
    heading = OBJECT

    def compute(self, run: EvaluatedRun) -> list[CurvedWhisk]:
        """Return the curvature by every measured whisk with sound moments."""
        alpha_est = Value(run.settings.alpha_est_rad, run.alpha_est_sigma_rad)
        found = []
        for result, _, felt in sound_measured_whisks(run.results):
            if felt.has_moments:
                felt_at = without_shared(felt)
                by_whisk = curved(felt_at, run.whisker, alpha_est.value, alpha_est.sigma)
                found.append(CurvedWhisk(result, felt, by_whisk))
        return found

    def row(self, one: CurvedWhisk) -> dict:
        """Return the row of a whisk."""
        by_whisk = one.curved
        return {
            **whisk_cells(one.result, one.felt.whisk),
            "angles": by_whisk.angles,
            **value_cells("radius_mm", by_whisk.radius_mm),
            "bar_radius_mm": one.bar_radius_mm,
            **value_cells("phi_0_deg", by_whisk.phi_0_rad),
            "lateral_per_mm": by_whisk.lateral_per_mm.value,
            "lateral_sigma_per_mm": by_whisk.lateral_per_mm.sigma,
            "lateral_printed_per_mm": by_whisk.lateral_printed_per_mm,
            "status": by_whisk.status,
        }

    def lines(self, found: Sequence[CurvedWhisk]) -> Iterator[str]:
        """Yield the mean radius less the bar's own, and trials whose object is curved sideways."""
        yield from _radius_lines(found)
        for trial, mean in sideways(found).items():
            printed = []
            for one in found:
                if one.result.trial.name == trial and one.curved.lateral.is_known:
                    printed.append(one.curved.lateral_printed_per_mm)
            yield (
                f"{trial}, {counted(len(printed), 'whisk')}: curved to the side by "
                f"{mean.value:.4f} ± {mean.sigma:.4f} 1/mm (Appendix B; {np.mean(printed):.4f} by (24) "
                "as printed), or it leans along the whisker"
            )


def sideways(found: Sequence[CurvedWhisk]) -> dict[str, Combined]:
    """Return the mean lateral curvature, 1/mm, of each trial that has one for sure.

    A trial's whisks are pushes against one bar: one test of it. What is said of all trials together is
    wrong by chance as often as _FALSE_ALARM says (`holm`).
    """
    lateral = ((one.result.trial.name, one.curved.lateral) for one in found)
    of_trials = Measurements.of(lateral).by_setting()
    stands = holm([mean.chance for mean in of_trials.values()], _FALSE_ALARM)
    return {trial: mean for (trial, mean), sure in zip(of_trials.items(), stands) if sure}


def mean_radius_error(found: Sequence[CurvedWhisk]) -> Combined:
    """Return the mean over bars of the radius less the bar's own, mm."""
    errors = []
    for one in found:
        radius = one.curved.radius
        error = replace(radius, value=radius.value - one.bar_radius_mm)
        errors.append((one.result.trial.name, error))
    return Measurements.of(errors).mean()


def _radius_lines(found: Sequence[CurvedWhisk]) -> Iterator[str]:
    """Yield a line on the mean of radii less the bar's own, where any is known."""
    inside = []
    for one in found:
        radius = one.curved.radius_mm
        error_mm = radius.value - one.bar_radius_mm
        if np.isfinite(error_mm):
            inside.append(abs(error_mm) < Z_95 * radius.sigma)
    if not inside:
        return
    mean = mean_radius_error(found)
    yield (
        f"radius of the object in the whisking plane, by successive contacts of {len(inside)} whisks "
        f"in {counted(mean.settings, 'trial')}, less the bar's own: {mean.value:+.1f} ± "
        f"{mean.sigma:.1f} mm, 95 % intervals hold in {100.0 * np.mean(inside):.0f} % (curvature.csv)"
    )


def without_shared(felt: FeltWhisk) -> list[FeltAt]:
    """Return the moments at successive angles with the part of their covariance that is not shared.

    Gauges' coefficients move all moments of a push by one share of them: no change with θ comes from that.
    """
    size_Nmm = np.hypot(felt.m_y_Nmm.value, felt.m_z_Nmm.value)
    causes_Nmm = felt.shared_Nmm.reshape(-1, 2)
    shared = causes_Nmm.T @ causes_Nmm / size_Nmm**2  # (2, 2), of |m|²
    found = []
    for at in felt.by_theta:
        square = at.m_y_Nmm.value**2 + at.m_z_Nmm.value**2
        variances, axes = np.linalg.eigh(at.covariance_at - square * shared)
        own = axes * np.maximum(variances, 0.0) @ axes.T
        m_y = Value(at.m_y_Nmm.value, float(np.sqrt(own[0, 0])))
        m_z = Value(at.m_z_Nmm.value, float(np.sqrt(own[1, 1])))
        found.append(replace(at, m_y_Nmm=m_y, m_z_Nmm=m_z, covariance_at=own))
    return found


@dataclass(frozen=True)
class _SlipAngle:
    """φ over a push: at touch, rad, its rate with θ, and the span of its values, rad."""

    at_touch: Value
    rate: Value
    span_rad: float

    @property
    def is_held(self) -> bool:
        """Return whether φ may be none, so that the contact does not slip sideways."""
        return abs(self.at_touch.value) <= _HELD_SIGMAS * self.at_touch.sigma

    @property
    def turns_far(self) -> bool:
        """Return whether φ of a slipping contact turns by more than terms to θ² hold for."""
        phi = self.at_touch
        most_rad = _MOST_TURN * abs(phi.value) + _HELD_SIGMAS * phi.sigma
        return not self.is_held and self.span_rad > most_rad


def curved(
    felt: Iterable[FeltAt], whisker: Whisker, alpha_rad: float, alpha_sigma_rad: float
) -> Curved:
    """Return the curvature by the moments of a whisk at successive pushing angles.

    Where φ turns far, only the first angles count. alpha_rad, alpha_sigma_rad: the assumed friction
    angle and its standard deviation.
    """
    chosen = independent_angles(felt)
    if len(chosen) < _FEWEST:
        return Curved(len(chosen), status=reason("angles_few", least=_FEWEST))
    chosen, slip = _before_phi_turns_far(chosen)
    if slip.turns_far:
        too_far = reason("phi_turns_far", degrees=np.degrees(slip.span_rad))
        return Curved(len(chosen), phi_0_rad=slip.at_touch, status=too_far)
    return _by_slip(chosen, slip, whisker, Value(alpha_rad, alpha_sigma_rad))


def _before_phi_turns_far(felt: Sequence[FeltAt]) -> tuple[Sequence[FeltAt], _SlipAngle]:
    """Return the first pushing angles, over which φ does not turn far, and φ over them.

    Where φ turns far even over the fewest angles, these are returned.
    """
    slip = _slip_angle(felt)
    while slip.turns_far and len(felt) > _FEWEST:
        felt = felt[:-1]
        slip = _slip_angle(felt)
    return felt, slip


def _by_slip(felt: Sequence[FeltAt], slip: _SlipAngle, whisker: Whisker, alpha: Value) -> Curved:
    """Return the curvature by the distances at the pushing angles and by how φ turns over them."""
    count = len(felt)
    phi = slip.at_touch
    alpha_rad = alpha.value
    distances = np.array([_distance(at, alpha_rad, whisker.beam) for at in felt])
    if not np.isfinite(distances).all():
        return Curved(count, phi_0_rad=phi, status=reason("distances_missing"))
    d_x, creep = _at_touch(column(felt, "theta_rad"), distances[:, 0], distances[:, 1])
    if slip.is_held:
        radius = _radius(d_x.value, creep, 0.0, alpha, 0.0, whisker)
        return Curved(count, radius, phi, status=reason("no_lateral_slip"))
    beyond = turn_beyond_chance(phi.value, slip.rate, alpha_rad)
    turned = d_x.value * beyond * share_by_turn(phi.value, alpha_rad)
    radius = _radius(d_x.value, creep, phi.value, alpha, turned, whisker)
    lateral, printed = _lateral(phi.value, slip.rate, d_x.value, alpha_rad)
    return Curved(count, radius, phi, lateral, printed)


def _slip_angle(felt: Sequence[FeltAt]) -> _SlipAngle:
    """Return φ of a push by the moments at its pushing angles."""
    phi = slip_angles(felt)
    sigmas = np.array([phi_sigma(at) for at in felt])
    at_touch, rate = _at_touch(column(felt, "theta_rad"), phi, sigmas)
    return _SlipAngle(at_touch, rate, float(np.ptp(phi)))


def slip_angles(felt: Sequence[FeltAt]) -> np.ndarray:
    """Return φ (n,) by the moments at n pushing angles, rad."""
    return np.arctan2(column(felt, "m_y_Nmm.value"), column(felt, "m_z_Nmm.value"))


def independent_angles(felt: Iterable[FeltAt]) -> list[FeltAt]:
    """Return the pushing angles whose moments share no sample, from the first on.

    Without those of moments that show no noise: how well they are known is not known.
    """
    chosen: list[FeltAt] = []
    for at in sorted(felt, key=lambda at: at.theta_rad):
        is_apart = not chosen or at.theta_rad - chosen[-1].theta_rad >= _APART_RAD
        if at.theta_rad >= _FIRST_RAD and is_apart and phi_sigma(at) > 0.0:
            chosen.append(at)
    return chosen


def weighted_fit(
    columns: Sequence[np.ndarray], values: np.ndarray, sigmas: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Fit values (n,) of stated sigmas (n,) by a sum of columns, each (n,).

    Returns the coefficients (k,), their covariance (k, k), and χ² of what is left.
    """
    design = np.stack(columns, axis=1) / sigmas[:, None]
    coefficients, *_ = np.linalg.lstsq(design, values / sigmas, rcond=None)
    residuals = values / sigmas - design @ coefficients
    return coefficients, np.linalg.inv(design.T @ design), float(np.sum(residuals**2))


def _at_touch(theta: np.ndarray, values: np.ndarray, sigmas: np.ndarray) -> tuple[Value, Value]:
    """Return value and rate at θ = 0 of what is felt at θ (n,).

    The fit is to second order, with a part that goes as 1/θ, as errors of touch and zero do. Where the
    values scatter about it by more than their sigmas, the scatter counts.
    """
    columns = (np.ones_like(theta), theta, theta**2, 1 / theta)
    coefficients, covariance, chi_square = weighted_fit(columns, values, sigmas)
    scatter = np.sqrt(chi_square / (len(theta) - len(columns)))
    spread = np.sqrt(np.diag(covariance)) * max(scatter, 1.0)
    value = Value(float(coefficients[0]), float(spread[0]))
    return value, Value(float(coefficients[1]), float(spread[1]))


def phi_sigma(at: FeltAt) -> float:
    """Return the standard deviation of φ by the moments, rad."""
    return slip_angle_sigma(at.m_y_Nmm.value, at.m_z_Nmm.value, at.covariance_at)


def _distance(at: FeltAt, alpha_rad: float, beam: Beam) -> tuple[float, float]:
    """Return d_x of (10) and its sigma by the moments alone, mm."""
    gradient = gradient_with_friction(
        at.theta_rad, at.m_y_Nmm.value, at.m_z_Nmm.value, alpha_rad, beam.C_Nmm2
    )
    cylinder_mm = float(gradient[0] * at.theta_rad)  # ∂d/∂θ = d/θ
    d_x_mm = float(beam.distance_mm(cylinder_mm))
    by_moments = gradient[1:3] * (d_x_mm / cylinder_mm) ** 2
    return d_x_mm, float(np.sqrt(by_moments @ at.covariance_at @ by_moments))


def rate_by_hand(phi: float, alpha_rad: float) -> float:
    """Return the change of φ with θ against an object that leans as one set up by hand, one sigma."""
    return float(0.5 * np.cos(_slope(phi, alpha_rad)) * np.tan(TILT_SIGMA_RAD))


def turn_beyond_chance(phi: float, rate: Value, alpha_rad: float) -> float:
    """Return by how much φ turns with θ beyond noise and an object's lean by hand; 0 where it does not.

    It is the root of what the turn's square is beyond its variance (the positive part of the moment estimate,
    as DerSimonian & Laird, Controlled Clinical Trials 7, 1986): of an object across the whisker nothing, in
    the mean.
    """
    by_hand = rate_by_hand(phi, alpha_rad)
    return float(np.sqrt(max(rate.value**2 - rate.sigma**2 - by_hand**2, 0.0)))


def share_by_turn(phi: float, alpha_rad: float) -> float:
    """Return the change of (10), as a share of it, with θ and with the rate at which φ turns.

    It goes one way where the object leans, half as far the other way where it is curved to the side
    (`bench.analyses.turning_phi`, docs/maps.md).
    """
    return float(np.sin(abs(phi)) / (np.cos(alpha_rad) * np.cos(_slope(phi, alpha_rad))))


def _slope(phi: float, alpha_rad: float) -> float:
    """Return the size of the slope, rad, by the slip angle and the friction angle."""
    return min(abs(phi) + alpha_rad, 0.999 * RIGHT_ANGLE)


def _radius(
    d_x_mm: float, creep: Value, phi: float, alpha: Value, turned: float, whisker: Whisker
) -> Measurement:
    """Return the radius of the object by the change of (10) with θ, mm.

    creep: that change, mm/rad. phi: 0 where the contact is held. alpha: as assumed, rad. turned: what
    a turn of φ may add, mm/rad. Lean and turn are of the bar, what friction along the whisker adds is of
    all whisks.
    """
    left = whisker.beam.thickness(d_x_mm)
    per_mm = float(first_order.rolling(1.0, 1.0, phi, alpha.value, 1.0, left))
    dragging = 0.0
    by_alpha = 0.0
    if phi == 0:
        dragging = d_x_mm * float(first_order.dragging(1.0, alpha.value))
        by_alpha = 0.2 * d_x_mm * alpha.sigma * first_order.HELD_SHARE
    leaning = d_x_mm * float(first_order.leaning(1.0, TILT_SIGMA_RAD, phi, alpha.value))
    reach_mm = (creep.value - first_order.HELD_SHARE * dragging) / per_mm
    spread = first_order.HELD_SPREAD * dragging
    return Measurement(
        reach_mm - 0.5 * whisker.diameter_mm * left,
        own=abs(creep.sigma / per_mm),
        of_setting=math.hypot(leaning, turned) / abs(per_mm),
        common=(spread / per_mm, by_alpha / per_mm),
    )


def _lateral(phi: float, rate: Value, d_x_mm: float, alpha_rad: float) -> tuple[Measurement, float]:
    """Return the lateral curvature by the exact form, and by (24) as printed, 1/mm.

    An object that leans turns φ by ½ θ cos β tan ψ, which is in the sigma.
    """
    exact = float(curvature.curvature_of_slip(1.0, phi, alpha_rad)) / d_x_mm
    printed = float(curvature.curvature_of_slip_printed(1.0, phi, alpha_rad)) / d_x_mm
    leaning = rate_by_hand(phi, alpha_rad)
    lateral = Measurement(exact * rate.value, abs(exact * rate.sigma), abs(exact * leaning))
    return lateral, printed * rate.value
