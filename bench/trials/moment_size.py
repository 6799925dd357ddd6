"""The size of moments that were recorded as such: what a whisker can give, and units that it is not."""

import numpy as np

from bench.session.plausible import PlausibleRange
from bench.session.whisker import Whisker
from vision.geometry import NO_REASON, Reason

# [1] Of the moment of a push at the tip without slip: a slope of 87° leaves that much of it, less
# at a tip that tapers. Stated.
_LEAST_MOMENT_SHARE = 0.01
# [1] Of the same: a contact at a fiftieth of the length. Stated.
_LARGEST_MOMENT_SHARE = 50.0
_MOMENT_UNITS = (("N·m", 1e3), ("N·µm", 1e-3), ("nN·m", 1e-6))


def check_moment_size(moments_Nmm: np.ndarray, theta_rad: float, whisker: Whisker) -> Reason:
    """Compare moments recorded as such with what this whisker can give: a unit is a factor of 1000.

    moments_Nmm (2,): m_y, m_z at the pushing angle.
    """
    beam = whisker.beam
    most_Nmm = beam.C_Nmm2 * theta_rad / beam.length_mm  # of a rod touched at its tip, without slip
    plausible = PlausibleRange(
        _LEAST_MOMENT_SHARE * most_Nmm, _LARGEST_MOMENT_SHARE * most_Nmm, _MOMENT_UNITS
    )
    size_Nmm = float(np.linalg.norm(moments_Nmm))
    if not np.isfinite(size_Nmm) or plausible.holds(size_Nmm):
        return NO_REASON
    guess = plausible.guess(size_Nmm) or " Are these another unit, or volts?"
    limits = (
        f"a push by {np.degrees(theta_rad):g}° gives {plausible.low:.2g} to {plausible.high:.2g}"
    )
    sentence = f"the moment is {size_Nmm:.3g} N·mm, {limits} with this whisker.{guess}"
    return Reason("moments_implausible", sentence)
