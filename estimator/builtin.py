"""The paper's estimators, written as anyone would write one: a function of a whisk and the
settings.

For a tapered whisker they run on the base's cylinder, and 1/d_x gains the taper
(`Beam.distance_mm`). An estimate of (10) or (12) beyond the whisker's length is set to the length
and reported as a tip contact (section VII). (2) overestimates because it ignores slip, so that a
distance beyond the length means slip, not the tip: it is flagged and left.
"""

from collections.abc import Callable
from dataclasses import replace
from math import hypot, isnan, nan, sqrt, tan
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from estimator import distance, first_order, uncertainty
from estimator.beam import Beam
from estimator.exact_rod import UNCONVERGED, Reach, RodContact, contact_by_exact_rod
from estimator.reasons import NamedReason
from estimator.whisk import Estimate, EstimatorSettings, Whisk

BEYOND = NamedReason("longer_than_whisker", "longer than the whisker: (2) ignores slip")
TIP = NamedReason(
    "tip_contact",
    "tip contact: the distance came out as {:.1f} mm, longer than the whisker, and was set to its length; "
    "farther than {:.1f} mm (95 %)",
)
NEARER = NamedReason("only_nearer_known", "known only to be nearer than {:.1f} mm (95 %)")

# [1] Of (10): the exact rod's equations have other roots, which are no push; right ones are within 0.108
# of (10), at turns up to 40° and 15° of push, and as much again is left to a wrong α_est.
# Study: exact_rod_limits.py.
_MOST_FROM_10 = 0.2
# [1] Relative sigma of the exact rod over tan α_est. Where |φ| is less than a tenth of α a curved rod may slide in several
# directions (0.6 % RMS of 31 pushes, 2.1 % at most); one that turns by 30° turns its direction while it is pushed by 14°
# (1.5 and 2.4 % of two); elsewhere 0.2 % RMS. Study: exact_rod_limits.py.
_ROD_BY_FRICTION = 0.011
# [1] Relative sigma of the exact rod where there is hardly any friction: 1.3e-4 off at most of 480 pushes.
# Study: exact_rod_limits.py.
_ROD_WITHOUT_FRICTION = 1e-4

# An equation's own relative sigma at a distance, mm, such as `_share_of_10`.
_ModelShare: TypeAlias = Callable[[Whisk, EstimatorSettings, float], float]


def no_slip(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Estimate by equation (2): as if the whisker did not slip sideways."""
    theta, _, m_z = whisk.felt
    d_x = distance.no_slip(theta, m_z, whisk.beam.C_Nmm2)
    gradient = uncertainty.gradient_no_slip(theta, m_z, whisk.beam.C_Nmm2)
    settings = _without_friction(settings)
    return _estimate(whisk, settings, d_x, gradient, _share_of_10, m_y=0.0, clamp=False)


def with_friction(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Estimate by equation (10): slip accounted for, with the assumed friction cone angle.

    Its interval includes α_est's sigma and exists even where (10) loses its root: then with one
    side only.
    """
    return _with_friction(whisk, settings, _share_of_10)


def corrected(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Estimate by equation (10) less the first order of its own error.

    That is rolling over a round object, and friction along the whisker. The object's radius is the
    one of the settings, else the thickness that they allow for; its lean is not known. Where (10)
    has no distance, or the tip's, this is the estimate of (10).
    """
    length = whisk.beam.length_mm
    estimate = _with_friction(whisk, settings, _share_of_corrected)
    if not 0 < estimate.d_x_mm < length:
        return _with_friction(whisk, settings, _share_of_10)
    less = estimate.times(1 - _first_order(whisk, settings, estimate.d_x_mm))
    return replace(
        less,
        d_x_mm=min(less.d_x_mm, length),
        low_mm=min(less.low_mm, length),
        high_mm=min(less.high_mm, length),
    )


def exact_rod(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Estimate by the exact rod of the stated unloaded shape, with the assumed friction cone angle.

    The object's radius is as in `corrected`. The interval has the shape of that of (10). Where (10)
    has no distance, this has none; where no bent rod is found and (10) is at the tip, so is this.
    """
    ten = _with_friction(whisk, settings, _share_of_rod)
    if isnan(ten.d_x_mm):
        return ten
    felt = (*whisk.felt, settings.alpha_est_rad)
    reach = _reach(settings)
    contact = contact_by_exact_rod(felt, whisk.beam, reach, whisk.is_held)
    if contact is None or abs(contact.d_x_mm / ten.d_x_mm - 1) > _MOST_FROM_10:
        at_tip = ten.d_x_mm == whisk.beam.length_mm
        return ten if at_tip else Estimate(nan, nan, UNCONVERGED)
    of_rest = _sigma_of_rest(felt, whisk.beam, reach, whisk.is_held, contact.d_x_mm)
    return _as_of_rod(ten, contact, of_rest, whisk, settings)


def _as_of_rod(
    ten: Estimate,
    contact: RodContact,
    of_rest: float,
    whisk: Whisk,
    settings: EstimatorSettings,
) -> Estimate:
    """Return the estimate of (10), `ten`, with distance, slope and sigma of the exact rod's contact.

    of_rest: one sigma by the stated unloaded shape, mm.
    """
    d_x = contact.d_x_mm
    factor = d_x / ten.d_x_mm
    low, high = _wider(ten.low_mm * factor, d_x, ten.high_mm * factor, of_rest)
    high = min(high, whisk.beam.length_mm)
    model = hypot(_share_of_rod(whisk, settings, d_x), whisk.beam.share_by_taper(d_x))
    of_inputs = uncertainty.sigma(contact.gradient, **_errors(whisk, settings))
    sigma = hypot(of_inputs, model * d_x, of_rest)
    return replace(
        ten,
        d_x_mm=d_x,
        sigma_mm=max(sigma, _sigma_by_friction(whisk, settings, d_x, low, high)),
        status=NEARER.format(high) if low == 0 else "",
        low_mm=low,
        high_mm=high,
        beta_rad=ten.beta_rad if whisk.is_held else contact.beta_rad,
        gradient=contact.gradient,
    )


def _sigma_of_rest(
    felt: tuple[float, ...], beam: Beam, reach: Reach, held: bool, d_x: float
) -> float:
    """Return one sigma of the exact rod's distance d_x by the stated unloaded shape, mm.

    All of the distance where no rod of a shape within its sigma has these moments.
    """
    off = 0.0
    for rest_mm in beam.other_rests_mm():
        moved = contact_by_exact_rod(felt, replace(beam, rest_mm=rest_mm), reach, held)
        off = hypot(off, d_x if moved is None else moved.d_x_mm - d_x)
    return off


def _wider(low: float, d_x: float, high: float, sigma: float) -> tuple[float, float]:
    """Return the ends of a 95 % interval about d_x, widened by one more sigma; an open end stays so."""
    if sigma == 0:
        return low, high
    wide = uncertainty.Z_95 * sigma
    low = max(d_x - hypot(d_x - low, wide), 0.0) if low > 0 else low
    return low, d_x + hypot(high - d_x, wide)


def frictionless(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Estimate by equation (12): slip accounted for, as if there were no friction."""
    return _with_friction(whisk, _without_friction(settings), _share_of_10)


def printed_17(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Estimate by equations (16), (17) as printed: ν(θ, |m|) cos φ with the whisker's own ν.

    It is far from the truth where a tapered whisker slips, since slip takes its share of the angle
    and not of the distance. It is not among ESTIMATORS: use it by its name.
    """
    felt = whisk.felt
    beam = whisk.beam

    def nu(theta: float, m: float) -> float:
        """Return the no-slip distance, mm, for an angle and a moment."""
        return beam.distance_mm(beam.C_Nmm2 * theta / m)

    d_x = distance.general_printed(*felt, nu)
    if isnan(d_x):
        return Estimate(nan, nan, distance.why_not(*felt))
    gradient = uncertainty.gradient_printed(*felt, beam.C_Nmm2, beam.taper / beam.length_mm)
    return Estimate(d_x, uncertainty.sigma(gradient, **_errors(whisk, settings)))


ESTIMATORS = {
    "no_slip": no_slip,
    "with_friction": with_friction,
    "frictionless": frictionless,
    "corrected": corrected,
}
# Of whiskers that are curved without load, besides: it takes some thousand times as long as (10).
OF_CURVED = {"exact_rod": exact_rod}
# Estimators whose distance does not depend on the assumed friction angle.
WITHOUT_ALPHA = (no_slip, frictionless)


def estimators_of(beam: Beam) -> dict[str, Callable[[Whisk, EstimatorSettings], Estimate]]:
    """Return by name the estimators that a whisker of this shape asks for."""
    return ESTIMATORS | OF_CURVED if beam.is_curved else ESTIMATORS


def _first_order(whisk: Whisk, settings: EstimatorSettings, d_x: float) -> float:
    """Return the relative error of (10) at d_x, by the settings' knowledge of the object."""
    theta = whisk.theta_at_rad
    alpha = settings.alpha_est_rad
    phi = 0.0 if whisk.is_held else whisk.phi_rad
    thickness = whisk.beam.thickness(d_x)
    reach = settings.reach_mm(thickness)
    rolling = first_order.rolling(theta, reach, phi, alpha, d_x, thickness)
    if phi != 0:
        return rolling
    return rolling + first_order.HELD_SHARE * first_order.dragging(theta, alpha)


def _with_friction(whisk: Whisk, settings: EstimatorSettings, model_share: _ModelShare) -> Estimate:
    """Estimate by (10), with its friction angle and the slope (9) that follows."""
    theta, m_y, m_z = whisk.felt
    alpha = settings.alpha_est_rad
    inputs = (theta, m_y, m_z, alpha, whisk.beam.C_Nmm2)
    d_x = distance.with_friction(*inputs)
    gradient = uncertainty.gradient_with_friction(*inputs)
    estimate = _estimate(whisk, settings, d_x, gradient, model_share, m_y=m_y)
    slope = distance.estimated_slope(m_y, m_z, alpha)
    return replace(estimate, alpha_est_rad=alpha, beta_rad=slope)


def _without_friction(settings: EstimatorSettings) -> EstimatorSettings:
    """Return the settings with a friction angle that is exactly 0."""
    return replace(settings, alpha_est_rad=0.0, alpha_est_sigma_rad=0.0)


def _estimate(
    whisk: Whisk,
    settings: EstimatorSettings,
    d_x: float,
    gradient: np.ndarray,
    model_share: _ModelShare,
    *,
    m_y: float,
    clamp: bool = True,
) -> Estimate:
    """Assemble an estimate from a cylinder's distance and gradient.

    It adds sigma and interval, the taper, the clamp at the tip, and the reason for a NaN. m_y: the
    moment along the surface that the equation takes; (2) takes none. A tapering whisker's distance is not linear over
    the sigma of α_est: its sigma is no less than the two sides of the interval, in the mean of
    their squares.
    """
    beam = whisk.beam
    tapered = beam.distance_mm(d_x)
    # The change of d_x with the distance of the base's cylinder.
    thickness = beam.thickness(tapered)
    by_cylinder = thickness * tapered / d_x
    model = hypot(model_share(whisk, settings, tapered), beam.share_by_taper(tapered))
    low, high = _interval(whisk, settings, m_y, model / thickness if model > 0 else 0.0)
    if isnan(d_x):
        return Estimate(nan, nan, _reason(whisk, settings.alpha_est_rad, high), low, high)
    of_inputs = uncertainty.sigma(gradient, **_errors(whisk, settings))
    sigma = hypot(of_inputs * by_cylinder, model * tapered)
    sigma = max(sigma, _sigma_by_friction(whisk, settings, tapered, low, high))
    estimate = Estimate(tapered, sigma, "", low, high, gradient=gradient * by_cylinder)
    return _up_to_tip(estimate, beam, clamp)


def _sigma_by_friction(
    whisk: Whisk, settings: EstimatorSettings, d_x: float, low: float, high: float
) -> float:
    """Return the least sigma of a tapering whisker's distance, by the sides of its interval; 0 elsewhere."""
    if whisk.beam.taper and settings.alpha_est_sigma_rad > 0 and low > 0:
        return hypot(d_x - low, high - d_x) / (sqrt(2) * uncertainty.Z_95)
    return 0.0


def _reach(settings: EstimatorSettings) -> Reach:
    """Return what lies between centreline and the object's axis."""
    if settings.is_radius_known:
        return Reach(settings.object_radius_mm, settings.whisker_radius_mm)
    return Reach(settings.object_reach_mm, 0.0)


def _errors(whisk: Whisk, settings: EstimatorSettings) -> dict[str, ArrayLike]:
    """Return the errors of the inputs, as keywords of `uncertainty.sigma`."""
    return {
        "theta_sigma": whisk.theta_sigma_rad,
        "covariance": whisk.covariance_at,
        "alpha_est_sigma": settings.alpha_est_sigma_rad,
        "theta_moment_covariance": whisk.theta_moment_covariance_at,
    }


def _interval(
    whisk: Whisk, settings: EstimatorSettings, m_y: float, model_sigma: float
) -> tuple[float, float]:
    """Return the ends of the 95 % interval on this whisker, mm; model_sigma: relative sigma of the
    cylinder's equation.
    """
    low, high = uncertainty.interval_with_friction(
        whisk.theta_at_rad,
        m_y,
        whisk.m_z_at_Nmm,
        settings.alpha_est_rad,
        whisk.beam.C_Nmm2,
        model_sigma=model_sigma,
        **_errors(whisk, settings),
    )
    low = _on_this_whisker(low, whisk.beam)
    high = _on_this_whisker(high, whisk.beam)
    return low, min(high, whisk.beam.length_mm) if high > 0 else high


def _up_to_tip(estimate: Estimate, beam: Beam, clamp: bool) -> Estimate:
    """Return the estimate with its status: clamped at the tip, or flagged there and without an
    interval.

    At the tip sigma and interval are the same shares of the length as they were of the distance, and
    the length's own sigma comes on top.
    """
    d_x = estimate.d_x_mm
    clamped, at_tip = distance.clamp_to_length(d_x, beam.length_mm)
    if at_tip and not clamp:
        return replace(estimate, status=BEYOND, low_mm=nan, high_mm=nan)
    if at_tip:
        share = beam.length_mm / d_x
        low, high = _wider(estimate.low_mm * share, clamped, clamped, beam.length_sigma_mm)
        return replace(
            estimate,
            d_x_mm=clamped,
            sigma_mm=hypot(estimate.sigma_mm * share, beam.length_sigma_mm),
            status=TIP.format(d_x, low),
            low_mm=low,
            high_mm=high,
            gradient=None,
        )
    status = NEARER.format(estimate.high_mm) if estimate.low_mm == 0 else ""
    return replace(estimate, d_x_mm=clamped, status=status)


def _on_this_whisker(end: float, beam: Beam) -> float:
    """Convert an end of the cylinder's interval to this whisker; keep 0 and NaN."""
    return beam.distance_mm(end) if end > 0 else end


def _share_of_10(whisk: Whisk, settings: EstimatorSettings, d_x: float) -> float:
    """Return the relative sigma of (10) itself; 0 without a distance or without a thickness to
    allow for.
    """
    return _share(whisk, settings, d_x, settings.object_reach_mm, 1.0)


def _share_of_corrected(whisk: Whisk, settings: EstimatorSettings, d_x: float) -> float:
    """Return the relative sigma of (10) less its first order."""
    held_spread = first_order.HELD_SPREAD if whisk.is_held else 1.0
    return _share(whisk, settings, d_x, settings.unknown_reach_mm, held_spread)


def _share(
    whisk: Whisk, settings: EstimatorSettings, d_x: float, reach_mm: float, held_spread: float
) -> float:
    """Return the relative sigma of (10) by what a reach and a held contact leave open."""
    if isnan(d_x) or settings.object_reach_mm == 0:
        return 0.0
    return uncertainty.model_share(
        whisk.theta_at_rad,
        whisk.phi_rad,
        settings.alpha_est_rad,
        d_x,
        reach=reach_mm,
        tilt_sigma=settings.tilt_sigma_rad,
        thickness=whisk.beam.thickness(d_x),
        held_spread=held_spread,
    )


def _share_of_rod(whisk: Whisk, settings: EstimatorSettings, d_x: float) -> float:
    """Return the relative sigma of the exact rod: the object's lean and radius, and friction's way."""
    if isnan(d_x) or settings.object_reach_mm == 0:
        return 0.0
    theta = whisk.theta_at_rad
    phi = whisk.phi_rad
    alpha = settings.alpha_est_rad
    thickness = whisk.beam.thickness(d_x)
    leaning = first_order.leaning(theta, settings.tilt_sigma_rad, phi, alpha)
    rolling = first_order.rolling(theta, settings.unknown_reach_mm, phi, alpha, d_x, thickness)
    by_friction = _ROD_BY_FRICTION * tan(alpha)
    dragging = 0.0
    if whisk.is_held:
        dragging = first_order.HELD_SPREAD * first_order.dragging(theta, alpha)
    return hypot(leaning, rolling, by_friction, _ROD_WITHOUT_FRICTION, dragging)


def _reason(whisk: Whisk, alpha_est: float, high: float) -> NamedReason:
    """Return the reason for having no distance, and the interval's open end where there is one."""
    reason = distance.why_not(*whisk.felt, alpha_est=alpha_est)
    if high > 0:
        nearer = NEARER.format(high)
        return NamedReason(nearer.code, f"{reason}; {nearer}")
    return reason
