"""Rotational compliance with longitudinal slip: (2), less what a contact that rolls along the whisker does to it.

Kaneko et al. [19] take the distance from the compliance and correct it for a contact that moves along the
whisker as it rolls over a round object. Their equation is not at hand: this is the first order of the
exact mechanics (`estimator.first_order.rolling`), for an object of known radius met head-on.
"""

from math import isnan

from estimator import first_order
from estimator.builtin import no_slip
from estimator.whisk import Estimate, EstimatorSettings, Whisk


def compliance_with_rolling(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Estimate by (2) less rolling; where the object's radius is not known, this is (2).

    Slip sideways is ignored, as (2) ignores it.
    """
    estimate = no_slip(whisk, settings)
    d_x = estimate.d_x_mm
    if isnan(d_x) or not settings.is_radius_known:
        return estimate
    thickness = whisk.beam.thickness(d_x)
    reach = settings.reach_mm(thickness)
    rolled = first_order.rolling(whisk.theta_at_rad, reach, 0.0, 0.0, d_x, thickness)
    return estimate.times(1 - rolled)
