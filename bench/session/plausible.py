"""Plausibility windows: a value far outside is refused, with a guess at its unit that is never applied."""

import math
from dataclasses import dataclass

from bench.base.errors import BadInput

DEGREES_PER_RADIAN = 180.0 / math.pi

METRES, MICROMETRES = ("metres", 1e3), ("micrometres", 1e-3)
PASCALS, MEGAPASCALS = ("pascals", 1e-9), ("megapascals", 1e-3)
MILLISECONDS, MICROSECONDS = ("milliseconds", 1e-3), ("microseconds", 1e-6)
MILLIVOLTS = ("millivolts", 1e-3)

_PROTRACTOR_DEG = 5.0  # °: what people set slopes in


@dataclass(frozen=True)
class Window:
    """`low` to `high` is taken; beyond, `units` are tried: (name, factor to the key's own unit)."""

    low: float
    high: float
    units: tuple[tuple[str, float], ...] = ()

    def holds(self, value: float) -> bool:
        """Whether the value is finite and within."""
        return math.isfinite(value) and self.low <= value <= self.high

    @property
    def allowed(self) -> str:
        """The window in words."""
        return (
            f"{self.low:g} or more"
            if self.high == math.inf
            else f"from {self.low:g} to {self.high:g}"
        )

    def guess(self, value: float) -> str:
        """' Is it in metres? Then write 100.' or nothing."""
        for name, factor in self.units:
            if self.holds(value * factor):
                return f" Is it in {name}? Then write {value * factor:.6g}."
        return ""

    def check(self, value: float, name: str, file: str) -> None:
        """Raises BadInput where the value is outside."""
        if not self.holds(value):
            raise BadInput(
                f"{name} is {value:g}; {self.allowed} is allowed.{self.guess(value)}", file=file
            )


LENGTH = Window(1.0, 5000.0, (METRES, MICROMETRES))
PLACE = Window(-5000.0, 5000.0, (MICROMETRES,))
THICKNESS = Window(0.01, 30.0, (METRES, MICROMETRES))
WIDTH = Window(0.1, 500.0, (METRES, MICROMETRES))
YOUNGS_MODULUS = Window(1e-3, 1500.0, (PASCALS, MEGAPASCALS))
RIGIDITY = Window(1e-4, 1e8, (("N m2", 1e6),))
ANGLE = Window(-360.0, 360.0)
SLOPE = Window(-90.0, 90.0)
HALF_ANGLE = Window(0.1, 85.0)
SPEED = Window(1e-3, 1e5)
RATE = Window(1e-2, 1e6)
FILTER = Window(0.0, 1e6)
CLOCK = Window(-1e7, 1e7)
EXPOSURE = Window(1e-7, 1.0, (MILLISECONDS, MICROSECONDS))
VELOCITY = Window(-1e4, 1e4, (("metres per second", 1e3),))
FORCE = Window(0.0, 1e3)
SIGMA = Window(0.0, math.inf)


def looks_like_radians(angle_deg: float) -> bool:
    """Whether an angle in degrees is one that a protractor shows (a multiple of 5°), but written in radians.

    An honest angle below 90 rad·(π/180) that is no round number in degrees meets this by chance in 1 of 250
    cases.
    """
    in_degrees = angle_deg * DEGREES_PER_RADIAN
    off_protractor = abs(in_degrees - _PROTRACTOR_DEG * round(in_degrees / _PROTRACTOR_DEG))
    is_round = abs(angle_deg * 20 - round(angle_deg * 20)) < 1e-9
    return 0 < abs(angle_deg) <= math.pi and off_protractor < 0.01 and not is_round
