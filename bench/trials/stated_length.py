"""Units that a stated length may be in, where it is no length of mm."""

import math

# Name, and mm in each.
_UNITS = (
    ("metres", 1e3),
    ("centimetres", 10.0),
    ("tenths of a millimetre", 0.1),
    ("inches", 25.4),
    ("micrometres", 1e-3),
)
# [1] By which an estimate of a distance may be off, either way, where another unit explains it: (10) errs by
# less on slopes that it has a solution for, and units are a factor of 2.5 or more apart. Stated.
_MOST_FACTOR = 1.5


def unit_within(length: float, least_mm: float, most_mm: float) -> str:
    """Return the unit in which a length would be within a range, or ''."""
    for name, factor in _UNITS:
        if least_mm < length * factor <= most_mm:
            return name
    return ""


def stated_in_other_unit(stated: float, estimate_mm: float) -> str:
    """Return the unit in which a stated length would be the estimate, or '' where none explains it."""
    if not (stated > 0.0 and estimate_mm > 0.0 and math.isfinite(estimate_mm)):
        return ""
    for name, factor in _UNITS:
        if abs(math.log(estimate_mm / (stated * factor))) < math.log(_MOST_FACTOR):
            return name
    return ""
