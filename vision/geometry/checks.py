"""Checks of the things on the bench when they are made: lengths and sigmas that cannot be are
refused.
"""

import math

from vision.geometry.refusals import Refused


def require(condition: bool, complaint: str) -> None:
    """Raise Refused with the complaint where the condition does not hold."""
    if not condition:
        raise Refused(complaint)


def require_sigma(owner: str, **sigmas_mm: float) -> None:
    """Raise Refused where a standard deviation is negative or not finite."""
    for name, value in sigmas_mm.items():
        is_sigma = math.isfinite(value) and value >= 0
        require(is_sigma, f"{owner} {name} = {value}: must be 0 or more, and finite")


def require_length(owner: str, **lengths_mm: float) -> None:
    """Raise Refused where a length is not above 0 mm, or not finite."""
    for name, value in lengths_mm.items():
        is_length = math.isfinite(value) and value > 0
        require(is_length, f"{owner} {name} = {value}: must be above 0 mm, and finite")
