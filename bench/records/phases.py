"""Stick and slip of one whisk: rests, jumps, and the friction angles at the ends of a rest."""

from dataclasses import dataclass

import numpy as np

STATIC, KINETIC = "static", "kinetic"


@dataclass(frozen=True)
class Angle:
    """One friction angle, rad: kind "static" or "kinetic", at which pushing angle, and its own sigma (not β's)."""

    kind: str
    theta_rad: float
    alpha_rad: float
    sigma_rad: float


@dataclass(frozen=True)
class Phases:
    """Of one whisk: how many rests and jumps its record shows, and the angles at their ends."""

    rests: int
    jumps: int
    angles: tuple[Angle, ...]

    def mean(self, kind: str) -> tuple[float, float]:
        """Weighted mean of the angles of one kind and its sigma from their scatter, rad; NaN without two of them."""
        chosen = [a for a in self.angles if a.kind == kind]
        if len(chosen) < 2:
            return float("nan"), float("nan")
        values, sigmas = np.array([(a.alpha_rad, a.sigma_rad) for a in chosen]).T
        weights = sigmas**-2.0 / np.sum(sigmas**-2.0)
        mean = float(weights @ values)
        scatter = np.sqrt(
            len(values) / (len(values) - 1) * np.sum(weights**2 * (values - mean) ** 2)
        )
        return mean, float(max(scatter, np.sum(sigmas**-2.0) ** -0.5))


NO_PHASES = Phases(0, 0, ())
