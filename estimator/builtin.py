"""The paper's estimators, written as anyone would write one: a function of a whisk and the settings.

For a cone the equations run on the base's cylinder, and 1/d_x gains 1/L (`distance.cone`). An estimate of (10) or
(12) beyond the whisker's length is set to the length and said to be a tip contact (section VII). (2) overestimates
by as much as slip it ignores, so that beyond the length it tells of slip, not of the tip: it is flagged and left.
"""

from math import nan

from estimator import distance, uncertainty
from estimator.whisk import Estimate, EstimatorSettings, Whisk

BEYOND = "longer than the whisker: (2) ignores slip"
TIP = "tip contact: the distance came out as {:.1f} mm, longer than the whisker, and was set to its length"


def no_slip(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Equation (2): as if the whisker did not slip sideways."""
    felt = (whisk.theta_at_rad, whisk.m_z_at_Nmm, whisk.beam.C_Nmm2)
    d_x, gradient = distance.no_slip(*felt), uncertainty.gradient_no_slip(*felt)
    return _estimate(whisk, settings, d_x, gradient, alpha_est=0.0, clamp=False)


def with_friction(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Equation (10): slip accounted for, with the assumed friction cone angle."""
    felt = (whisk.theta_at_rad, whisk.m_y_at_Nmm, whisk.m_z_at_Nmm, settings.alpha_est_rad, whisk.beam.C_Nmm2)
    return _estimate(whisk, settings, distance.with_friction(*felt), uncertainty.gradient_with_friction(*felt))


def frictionless(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Equation (12): slip accounted for, as if there were no friction."""
    felt = (whisk.theta_at_rad, whisk.m_y_at_Nmm, whisk.m_z_at_Nmm, whisk.beam.C_Nmm2)
    d_x, gradient = distance.frictionless(*felt), uncertainty.gradient_frictionless(*felt)
    return _estimate(whisk, settings, d_x, gradient, alpha_est=0.0)


ESTIMATORS = {
    "no_slip": no_slip,
    "with_friction": with_friction,
    "frictionless": frictionless,
}


def _estimate(whisk, settings, d_x, gradient, alpha_est=None, clamp=True):
    """Estimate from a cylinder's distance and gradient: sigma, taper, clamp at the tip, reason for a NaN."""
    if d_x != d_x:
        alpha_est = settings.alpha_est_rad if alpha_est is None else alpha_est
        return Estimate(nan, nan, _reason(whisk, alpha_est))
    sigma = uncertainty.sigma(
        gradient,
        theta_sigma=whisk.theta_sigma_rad,
        covariance=whisk.covariance_at,
        alpha_est_sigma=settings.alpha_est_sigma_rad,
        theta_moment_covariance=whisk.theta_moment_covariance_at,
    )
    length = whisk.beam.length_mm
    if whisk.beam.shape == "cone":
        tapered = distance.taper(d_x, length)
        d_x, sigma = tapered, sigma * (tapered / d_x) ** 2
    clamped, at_tip = distance.clamp_to_length(d_x, length)
    if at_tip and not clamp:
        return Estimate(d_x, sigma, BEYOND)
    return Estimate(clamped, sigma, TIP.format(d_x) if at_tip else "")


def _reason(whisk, alpha_est):
    return distance.why_not(whisk.theta_at_rad, whisk.m_y_at_Nmm, whisk.m_z_at_Nmm, alpha_est=alpha_est)
