"""Stick and slip of one whisk: rests, jumps, and the friction angles at the ends of a rest."""

from dataclasses import dataclass

import numpy as np

STATIC, KINETIC = "static", "kinetic"


@dataclass(frozen=True)
class Angle:
    """One friction angle.

    kind: STATIC or KINETIC. theta_rad: the pushing angle. sigma_rad: its own, without β's.
    """

    kind: str
    theta_rad: float
    alpha_rad: float
    sigma_rad: float


@dataclass(frozen=True)
class Phases:
    """The rests and jumps of one whisk, how many, and the friction angles at their ends."""

    rests: int
    jumps: int
    angles: tuple[Angle, ...]

    def mean(self, kind: str) -> tuple[float, float]:
        """Return the weighted mean of the angles of one kind, rad, and its sigma from their scatter.

        NaN without two of them.
        """
        chosen = [angle for angle in self.angles if angle.kind == kind]
        count = len(chosen)
        if count < 2:
            return float("nan"), float("nan")
        values = np.array([angle.alpha_rad for angle in chosen])
        information = np.array([angle.sigma_rad for angle in chosen]) ** -2.0
        weights = information / np.sum(information)
        mean = float(weights @ values)
        squares = np.sum(weights**2 * (values - mean) ** 2)
        scatter = np.sqrt(count / (count - 1) * squares)
        return mean, float(max(scatter, np.sum(information) ** -0.5))


NO_PHASES = Phases(0, 0, ())
