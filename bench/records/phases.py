"""Stick and slip of one whisk: rests, jumps, and the friction angles at the ends of a rest."""

from dataclasses import dataclass

import numpy as np

from bench.base.combined import independent
from vision import UNKNOWN, Value

STATIC = "static"
KINETIC = "kinetic"


@dataclass(frozen=True)
class Angle:
    """One friction angle: its kind, static or kinetic, the pushing angle, and its own sigma, which
    leaves out β's.
    """

    kind: str
    theta_rad: float
    alpha_rad: float
    sigma_rad: float


@dataclass(frozen=True)
class Phases:
    """Numbers of rests and jumps that the record of a whisk shows, and the angles at their ends."""

    rests: int
    jumps: int
    angles: tuple[Angle, ...]

    def mean(self, kind: str) -> Value:
        """Return the weighted mean of the angles of one kind, rad, its sigma from their scatter.

        It is UNKNOWN with less than two angles.
        """
        chosen = [angle for angle in self.angles if angle.kind == kind]
        if len(chosen) < 2:
            return UNKNOWN
        values = np.array([angle.alpha_rad for angle in chosen])
        sigmas = np.array([angle.sigma_rad for angle in chosen])
        mean = independent(values, sigmas).mean()
        return Value(mean.value, mean.sigma)


NO_PHASES = Phases(0, 0, ())
