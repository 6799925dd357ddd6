"""Felt against seen, whisk by whisk: the moments at the base that the seen shape asks for, beside those that were felt.

The seen ones are the exact rod's through the contact (`bench.gauges.clamped_rod`), frame by frame; felt are the channels at the
same motor angles. Both lines rise from nothing at touch, so their slopes are compared, two numbers with one covariance:
of pictures, distance, friction along the rod, noise, zero, gauges and the follicle's turn.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from bench.gauges.gauge_readings import Pairs
from bench.gauges.matrix import GaugeMatrix
from vision.geometry.reasons import NO_REASON, Reason

# Once in ten thousand whisks by chance: a session of 640 is then told of one that is sound in one of fifteen.
LEAST_CHANCE = 1e-4
_EXPLAINED = 0.01  # of the chance that a cause must leave
_PER_PARAMETER = 2.0  # of χ², for each number that a cause is free to choose (Akaike)
_OTHERWISE = (
    "no fault of the gauges alone explains it; look whether these are another trial's signals"
)


@dataclass(frozen=True)
class Agreement:
    """χ² of felt less seen moments, 2 degrees of freedom, its chance, and what is likely wrong ('' where nothing)."""

    chi2: float
    chance: float
    cause: str = ""

    @property
    def status(self) -> Reason:
        """Return what to say of the whisk; nothing where both agree."""
        if self.chance >= LEAST_CHANCE:
            return NO_REASON
        sentence = f"felt moments are not those of the seen shape (χ² {self.chi2:.0f}, 2 degrees of freedom): {self.cause}"
        is_explained = self.cause != _OTHERWISE
        return Reason("gauge_fault" if is_explained else "shape_not_felt", sentence)


@dataclass(frozen=True)
class Slopes:
    """Per radian of pushing, in the follicle's axes: volts (2,), seen moments (2,), covariance (2, 2) of matrix · volts
    less seen."""

    volts: np.ndarray
    seen: np.ndarray
    covariance: np.ndarray

    @classmethod
    def of(cls, pairs: Pairs, gauges: GaugeMatrix, scale_sigma: float = 0.0) -> "Slopes":
        """Least-squares slopes through zero of a whisk's pairs. scale_sigma: share by which all moments may be wrong
        together, beyond what the pairs say of it: of C, where the gauges bring newtons of their own."""
        weights = pairs.theta_rad / (pairs.theta_rad @ pairs.theta_rad)
        mean, turn = np.kron(weights, np.eye(2)), np.kron(np.eye(len(pairs)), gauges.matrix)
        volts, seen = weights @ pairs.volts, weights @ pairs.moments
        own = pairs.moments_covariance + turn @ pairs.volts_covariance @ turn.T
        scale = pairs.scale_sigma**2 + scale_sigma**2
        shared = gauges.covariance_at(volts) + scale * np.outer(seen, seen)
        return cls(volts, seen, mean @ own @ mean.T + shared)

    def chi2(self, felt: np.ndarray) -> float:
        """Of felt (2,) less seen."""
        off = felt - self.seen
        return float(off @ np.linalg.solve(self.covariance, off))


def agreement(pairs: Pairs, gauges: GaugeMatrix, scale_sigma: float = 0.0) -> Agreement:
    """What the whisk's felt moments are beside its seen ones, and the likeliest cause where they stand out."""
    slopes = Slopes.of(pairs, gauges, scale_sigma)
    found = slopes.chi2(gauges.matrix @ slopes.volts)
    chance = float(chdtrc(2, found))
    return Agreement(
        found, chance, likeliest_cause(slopes, gauges.matrix) if chance < LEAST_CHANCE else ""
    )


def likeliest_cause(slopes: Slopes, matrix: np.ndarray) -> str:
    """The cause that leaves the least χ², two for each number that it is free to choose; of those that explain all."""
    tried = list(_causes(slopes, matrix))
    left = [slopes.chi2(felt) for _, free, felt in tried]
    explains = [chdtrc(2 - free, c) > _EXPLAINED for c, (_, free, _) in zip(left, tried)]
    costs = [
        c + _PER_PARAMETER * free if ok else np.inf
        for c, ok, (_, free, _) in zip(left, explains, tried)
    ]
    best = int(np.argmin(costs))
    return tried[best][0] if np.isfinite(costs[best]) else _OTHERWISE


def _causes(slopes: Slopes, matrix: np.ndarray) -> Iterator[tuple[str, int, np.ndarray]]:
    """(what is wrong, numbers it is free to choose, the felt moments (2,) without it)."""
    volts, seen = slopes.volts, slopes.seen
    felt = matrix @ volts
    yield "y_V and z_V look exchanged", 0, matrix @ volts[::-1]
    yield "y_V looks reversed", 0, matrix @ (volts * [-1, 1])
    yield "z_V looks reversed", 0, matrix @ (volts * [1, -1])
    yield "y_V and z_V look reversed", 0, -felt
    turn = np.arctan2(felt[0] * seen[1] - felt[1] * seen[0], felt @ seen)
    c, s = np.cos(turn), np.sin(turn)
    turned = np.array([[c, -s], [s, c]]) @ felt
    yield f"the follicle looks turned by {np.degrees(turn):+.1f}° more than stated", 1, turned
    for channel, name in enumerate(("y_V", "z_V")):
        alone = matrix[:, channel] * volts[channel]
        share = _share(slopes, alone, felt - alone)
        if share > 0:
            gives = f"it gives {100 / share:.0f} % of what it should"
            said = f"gauge {name} looks slipped, {gives}, or drifts while the whisker pushes"
            yield said, 1, felt + (share - 1) * alone
    share = _share(slopes, felt, np.zeros(2))
    if share > 0:
        yield (
            f"the whisker looks {100 * share:.1f} % as stiff in the gauges' newtons as its E says",
            1,
            share * felt,
        )


def _share(slopes: Slopes, part, rest) -> float:
    """The factor on a part (2,) of the felt moments with which they come nearest to the seen ones; 0 for no part."""
    weighted = np.linalg.solve(slopes.covariance, part)
    size = weighted @ part
    return float(weighted @ (slopes.seen - rest) / size) if size > 0 else 0.0
