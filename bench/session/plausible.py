"""Plausible ranges: a value outside is refused, with a guess at its unit that is never applied."""

import math
from dataclasses import dataclass

from bench.base.errors import BadInput

DEGREES_PER_RADIAN = 180.0 / math.pi

METRES = ("metres", 1e3)
MICROMETRES = ("micrometres", 1e-3)
PASCALS = ("pascals", 1e-9)
MEGAPASCALS = ("megapascals", 1e-3)
MILLISECONDS = ("milliseconds", 1e-3)
MICROSECONDS = ("microseconds", 1e-6)
MILLIVOLTS = ("millivolts", 1e-3)

# [°] Steps in which people set slopes. Stated.
_PROTRACTOR_DEG = 5.0


@dataclass(frozen=True)
class PlausibleRange:
    """The range of values that a key may have, and the units that a value beyond it may be in.

    low, high: limits in the key's own unit. units: (name, factor to the key's own unit) of each.
    """

    low: float
    high: float
    units: tuple[tuple[str, float], ...] = ()

    def holds(self, value: float) -> bool:
        """Return whether the value is finite and within the limits."""
        return math.isfinite(value) and self.low <= value <= self.high

    @property
    def allowed(self) -> str:
        """Return the limits in words."""
        if self.high == math.inf:
            return f"{self.low:g} or more"
        return f"from {self.low:g} to {self.high:g}"

    def guess(self, value: float) -> str:
        """Return ' Is it in metres? Then write 100.', or nothing where no unit explains it."""
        for name, factor in self.units:
            if self.holds(value * factor):
                return f" Is it in {name}? Then write {value * factor:.6g}."
        return ""

    def check(self, value: float, name: str, file: str) -> None:
        """Raise BadInput where the value is outside."""
        if not self.holds(value):
            found = f"{name} is {value:g}; {self.allowed} is allowed.{self.guess(value)}"
            raise BadInput(found, file=file)


LENGTH = PlausibleRange(1.0, 5000.0, (METRES, MICROMETRES))
PLACE = PlausibleRange(-5000.0, 5000.0, (MICROMETRES,))
CURVATURE = PlausibleRange(-0.5, 0.5, (("1/m", 1e-3),))
THICKNESS = PlausibleRange(0.01, 30.0, (METRES, MICROMETRES))
WIDTH = PlausibleRange(0.1, 500.0, (METRES, MICROMETRES))
YOUNGS_MODULUS = PlausibleRange(1e-3, 1500.0, (PASCALS, MEGAPASCALS))
RIGIDITY = PlausibleRange(1e-4, 1e8, (("N m2", 1e6),))
THREE_RIGIDITIES = PlausibleRange(3e-4, 3e8, (("N m2", 1e6),))
ANGLE = PlausibleRange(-360.0, 360.0)
SLOPE = PlausibleRange(-90.0, 90.0)
HALF_ANGLE = PlausibleRange(0.1, 85.0)
SPEED = PlausibleRange(1e-3, 1e5)
RATE = PlausibleRange(1e-2, 1e6)
FILTER = PlausibleRange(0.0, 1e6)
NUMBER = PlausibleRange(-1e7, 1e7)
EXPOSURE = PlausibleRange(1e-7, 1.0, (MILLISECONDS, MICROSECONDS))
PIXEL_ASPECT = PlausibleRange(0.1, 10.0)
VELOCITY = PlausibleRange(-1e4, 1e4, (("metres per second", 1e3),))
MARKER = PlausibleRange(0, 1023)
FORCE = PlausibleRange(0.0, 1e3)
SIGMA = PlausibleRange(0.0, math.inf)
ANGLE_SIGMA = PlausibleRange(0.0, 90.0)


def looks_like_radians(angle_deg: float) -> bool:
    """Return whether an angle in degrees is one that a protractor shows, but written in radians.

    A protractor shows multiples of 5°. An angle below 90 rad·(π/180) that is given in degrees, and
    is no round number there, meets this by chance in 1 of 250 cases.
    """
    in_degrees = angle_deg * DEGREES_PER_RADIAN
    off_protractor = abs(in_degrees - _PROTRACTOR_DEG * round(in_degrees / _PROTRACTOR_DEG))
    is_round = abs(angle_deg * 20 - round(angle_deg * 20)) < 1e-9
    return 0 < abs(angle_deg) <= math.pi and off_protractor < 0.01 and not is_round
