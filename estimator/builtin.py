"""The paper's estimators, written as anyone would write one: a function of a whisk and the settings.

For a tapered whisker they run on the base's cylinder, and 1/d_x gains the taper (`Beam.distance_mm`). An estimate of
(10) or (12) beyond the whisker's length is set to the length and said to be a tip contact (section VII). (2)
overestimates by as much as slip it ignores, so that beyond the length it tells of slip, not of the tip: it is flagged
and left.
"""

from dataclasses import replace
from math import hypot, isnan, nan, sqrt

from estimator import distance, first_order, uncertainty
from estimator.reasons import NamedReason
from estimator.whisk import Estimate, EstimatorSettings, Whisk

BEYOND = NamedReason("longer_than_whisker", "longer than the whisker: (2) ignores slip")
TIP = NamedReason(
    "tip_contact",
    "tip contact: the distance came out as {:.1f} mm, longer than the whisker, and was set to its length; "
    "farther than {:.1f} mm (95 %)",
)
NEARER = NamedReason("only_nearer_known", "known only to be nearer than {:.1f} mm (95 %)")


def no_slip(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Equation (2): as if the whisker did not slip sideways."""
    felt = (whisk.theta_at_rad, whisk.m_z_at_Nmm, whisk.beam.C_Nmm2)
    d_x, gradient = distance.no_slip(*felt), uncertainty.gradient_no_slip(*felt)
    return _estimate(
        whisk, _without_friction(settings), d_x, gradient, _model_share, m_y=0.0, clamp=False
    )


def with_friction(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Equation (10): slip accounted for, with the assumed friction cone angle.

    Its interval holds α_est's sigma and stays where (10) loses its root: then only one side of it is known.
    """
    return _with_friction(whisk, settings, _model_share)


def corrected(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Equation (10) less the first order of its own error: rolling over a round object, friction along the whisker.

    The object's radius is the one that it is told, else as thick as it has to allow for; its lean is not known. Where
    (10) has no distance, or the tip's, this says the same.
    """
    estimate, length = _with_friction(whisk, settings, _share_left), whisk.beam.length_mm
    if not 0 < estimate.d_x_mm < length:
        return _with_friction(whisk, settings, _model_share)
    longer = 1 - _first_order(whisk, settings, estimate.d_x_mm)
    d_x, low, high = (
        min(end * longer, length) for end in (estimate.d_x_mm, estimate.low_mm, estimate.high_mm)
    )
    return replace(estimate, d_x_mm=d_x, low_mm=low, high_mm=high)


def frictionless(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Equation (12): slip accounted for, as if there were no friction."""
    felt = (whisk.theta_at_rad, whisk.m_y_at_Nmm, whisk.m_z_at_Nmm, whisk.beam.C_Nmm2)
    d_x, gradient = distance.frictionless(*felt), uncertainty.gradient_frictionless(*felt)
    return _assuming(whisk, _without_friction(settings), d_x, gradient, _model_share)


def printed_17(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Equations (16), (17) as printed, ν(θ, |m|) cos φ with the whisker's own ν: far off where a tapered whisker slips,
    for the slip takes its share of the angle and not of the distance. Not among ESTIMATORS; to be asked for by name."""
    felt, beam = (whisk.theta_at_rad, whisk.m_y_at_Nmm, whisk.m_z_at_Nmm), whisk.beam
    d_x = distance.general_printed(
        *felt, lambda theta, m: beam.distance_mm(beam.C_Nmm2 * theta / m)
    )
    if d_x != d_x:
        return Estimate(nan, nan, distance.why_not(*felt))
    noise = {"theta_sigma": whisk.theta_sigma_rad, "covariance": whisk.covariance_at}
    gradient = uncertainty.gradient_printed(*felt, beam.C_Nmm2, beam.taper / beam.length_mm)
    mixed = whisk.theta_moment_covariance_at
    return Estimate(d_x, uncertainty.sigma(gradient, **noise, theta_moment_covariance=mixed))


ESTIMATORS = {
    "no_slip": no_slip,
    "with_friction": with_friction,
    "frictionless": frictionless,
    "corrected": corrected,
}
WITHOUT_ALPHA = (no_slip, frictionless)  # say the same whatever friction angle they are told


def _first_order(whisk, settings, d_x):
    """The error of (10) at d_x as a share of it, by what is known of the object."""
    beam, alpha = whisk.beam, settings.alpha_est_rad
    phi = 0.0 if is_held(whisk) else distance.felt_slip_angle(whisk.m_y_at_Nmm, whisk.m_z_at_Nmm)
    left = beam.left(d_x)
    told = settings.object_radius_mm == settings.object_radius_mm
    reach = (
        settings.object_radius_mm + settings.whisker_radius_mm * left
        if told
        else settings.object_reach_mm
    )
    rolling = first_order.rolling(whisk.theta_at_rad, reach, phi, alpha, d_x, left)
    return rolling + (
        first_order.HELD_SHARE * first_order.dragging(whisk.theta_at_rad, alpha)
        if phi == 0
        else 0.0
    )


def is_held(whisk: Whisk) -> bool:
    """Is no slip to the side felt, within two sigma?"""
    return abs(whisk.m_y_at_Nmm) <= 2 * sqrt(whisk.covariance_at[0, 0])


def _with_friction(whisk, settings, model):
    """(10); model: what it may be off by itself, see `_model_share`."""
    felt = (
        whisk.theta_at_rad,
        whisk.m_y_at_Nmm,
        whisk.m_z_at_Nmm,
        settings.alpha_est_rad,
        whisk.beam.C_Nmm2,
    )
    d_x, gradient = distance.with_friction(*felt), uncertainty.gradient_with_friction(*felt)
    return _assuming(whisk, settings, d_x, gradient, model)


def _without_friction(settings: EstimatorSettings) -> EstimatorSettings:
    return replace(settings, alpha_est_rad=0.0, alpha_est_sigma_rad=0.0)


def _assuming(whisk, settings, d_x, gradient, model):
    """An estimate that takes both moments, with the friction angle assumed and the slope (9) that follows."""
    slope = distance.estimated_slope(whisk.m_y_at_Nmm, whisk.m_z_at_Nmm, settings.alpha_est_rad)
    estimate = _estimate(whisk, settings, d_x, gradient, model, m_y=whisk.m_y_at_Nmm)
    return replace(estimate, alpha_est_rad=settings.alpha_est_rad, beta_rad=slope)


def _estimate(whisk, settings, d_x, gradient, share, *, m_y, clamp=True):
    """Estimate from a cylinder's distance and gradient: sigma, interval, taper, clamp at the tip, reason for a NaN.

    m_y: the moment along the surface that the equation takes; (2) takes none. share: what the equation itself may be
    off by (`_model_share`). A tapering whisker's distance bends over what α_est may be off by: its sigma is no less
    than the two sides of the interval, in the mean of their squares.
    """
    theta, m_z, beam = whisk.theta_at_rad, whisk.m_z_at_Nmm, whisk.beam
    knows = {
        "theta_sigma": whisk.theta_sigma_rad,
        "covariance": whisk.covariance_at,
        "alpha_est_sigma": settings.alpha_est_sigma_rad,
        "theta_moment_covariance": whisk.theta_moment_covariance_at,
    }
    tapered = beam.distance_mm(d_x)
    left = (
        tapered / d_x
    )  # of the base's diameter at the contact; of a relative error on the base's cylinder, too
    model = share(whisk, settings, tapered, left)
    ends = uncertainty.interval_with_friction(
        theta,
        m_y,
        m_z,
        settings.alpha_est_rad,
        beam.C_Nmm2,
        model_sigma=model / left if model else 0.0,
        **knows,
    )
    low, high = (min(beam.distance_mm(end), beam.length_mm) if end > 0 else end for end in ends)
    if d_x != d_x:
        return Estimate(nan, nan, _reason(whisk, settings.alpha_est_rad, high), low, high)
    sigma, gradient = (
        hypot(uncertainty.sigma(gradient, **knows) * left**2, model * tapered),
        gradient * left**2,
    )
    if beam.taper and settings.alpha_est_sigma_rad > 0 and low > 0:
        sigma = max(sigma, hypot(tapered - low, high - tapered) / (sqrt(2) * uncertainty.Z_95))
    clamped, at_tip = distance.clamp_to_length(tapered, beam.length_mm)
    if at_tip and not clamp:
        return Estimate(tapered, sigma, BEYOND, gradient=gradient)
    if at_tip:
        return Estimate(clamped, sigma, TIP.format(tapered, low), low, high)
    return Estimate(
        clamped, sigma, NEARER.format(high) if low == 0 else "", low, high, gradient=gradient
    )


def _model_share(whisk, settings, d_x, left):
    """What (10) may be off by itself, as a share of d_x; 0 where nothing is said of the object, or without distance."""
    if d_x != d_x or settings.object_reach_mm == 0:
        return 0.0
    phi = distance.felt_slip_angle(whisk.m_y_at_Nmm, whisk.m_z_at_Nmm)
    known = {"reach": settings.object_reach_mm, "tilt_sigma": settings.tilt_sigma_rad, "left": left}
    return uncertainty.model_share(whisk.theta_at_rad, phi, settings.alpha_est_rad, d_x, **known)


def _share_left(whisk, settings, d_x, left):
    """What (10) may still be off by where its first order has been taken out."""
    if d_x != d_x or settings.object_reach_mm == 0:
        return 0.0
    phi = distance.felt_slip_angle(whisk.m_y_at_Nmm, whisk.m_z_at_Nmm)
    known = {"tilt_sigma": settings.tilt_sigma_rad, "left": left}
    known["held_spread"] = first_order.HELD_SPREAD if is_held(whisk) else 1.0
    reach = settings.object_reach_mm if isnan(settings.object_radius_mm) else 0.0
    return uncertainty.model_share(
        whisk.theta_at_rad, phi, settings.alpha_est_rad, d_x, reach=reach, **known
    )


def _reason(whisk, alpha_est, high):
    felt = (whisk.theta_at_rad, whisk.m_y_at_Nmm, whisk.m_z_at_Nmm)
    reason = distance.why_not(*felt, alpha_est=alpha_est)
    return f"{reason}; {NEARER.format(high)}" if high > 0 else reason
