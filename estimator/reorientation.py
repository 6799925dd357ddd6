"""Active reorientation: the plane of rotation is turned until the whisker does not slip, then (2) holds.

This is what Kaneko et al. [19] and Clements and Rahn [37] do about lateral slip. A whisker that slips
over a straight object of slope β deflects in the direction φ = β − α of (8), on the side of β. With
its plane turned about the whisker by φ, the slope is α, the steepest that friction holds, and the
next rotation does not slip. How the plane is turned is derived here from (3) and (8): the sources
turn it in steps. Friction hides slopes below α, so that the slope stays unknown by ± α. Angles in
rad, lengths in mm.
"""

from dataclasses import replace
from math import degrees, hypot, isnan, tan

from estimator.builtin import with_friction
from estimator.reasons import NamedReason
from estimator.uncertainty import Z_95, slip_angle_sigma
from estimator.whisk import Estimate, EstimatorSettings, Whisk

STILL_SLIPS = NamedReason(
    "still_slips", "the whisker still slips sideways, φ is {:+.1f}°: (2) is too long"
)


def slip_angle(whisk: Whisk) -> tuple[float, float]:
    """Return the felt slip angle φ of (8) and its standard deviation, rad; φ is NaN without a push."""
    sigma = slip_angle_sigma(whisk.m_y_at_Nmm, whisk.m_z_at_Nmm, whisk.covariance_at)
    return whisk.phi_rad, sigma


def reoriented(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Estimate by (2) from one push of a reorientation; its sigma holds the slip that is left.

    (2) is (10) with m_y = 0, of which the noise stays in the sigma. A slip angle φ that is left makes it
    too long by tan φ tan (α + φ) of the distance, by (6): that is one sigma, added in squares. Where
    it exceeds the rest, the status says so.
    """
    held = with_friction(replace(whisk, m_y_at_Nmm=0.0), settings)
    if isnan(held.d_x_mm):
        return held
    too_long_mm = _too_long_mm(whisk, settings, held)
    slips = too_long_mm > held.sigma_mm
    return replace(
        held,
        sigma_mm=hypot(held.sigma_mm, too_long_mm),
        low_mm=max(held.d_x_mm - hypot(held.d_x_mm - held.low_mm, Z_95 * too_long_mm), 0.0),
        status=STILL_SLIPS.format(degrees(slip_angle(whisk)[0])) if slips else held.status,
    )


def next_turn_rad(whisk: Whisk, settings: EstimatorSettings) -> float:
    """Return by how much to turn the plane of rotation before the next push.

    It is 0 where the slip that is left moves (2) by less than its own sigma, and where the whisker
    does not push.
    """
    held = with_friction(replace(whisk, m_y_at_Nmm=0.0), settings)
    if isnan(held.d_x_mm) or _too_long_mm(whisk, settings, held) <= held.sigma_mm:
        return 0.0
    return slip_angle(whisk)[0]


def _too_long_mm(whisk: Whisk, settings: EstimatorSettings, held: Estimate) -> float:
    """Return by how much (2) is too long where the felt slip is left, by (6)."""
    phi = abs(slip_angle(whisk)[0])
    return held.d_x_mm * tan(phi) * tan(settings.alpha_est_rad + phi)
