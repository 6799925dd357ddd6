"""The RMS error that is expected over several whisks, and how far chance may move that of so many.

Choices are ranked by what is expected of them: of many choices that are measured on few whisks the
best one is the luckiest.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

# [1] So much of the chance lies below a range, and as much above it.
_TAIL = 0.025


def interval_of_rms(rms: float, count: int) -> tuple[float, float]:
    """Return the 95 % interval of an RMS error that so many independent errors show; NaN without any."""
    if not count:
        return math.nan, math.nan
    low, high = np.sqrt(count / chdtri(count, [_TAIL, 1.0 - _TAIL]))
    return rms * float(low), rms * float(high)


@dataclass(frozen=True)
class ExpectedRms:
    """The expected RMS of errors, and the range of 95 % of the RMS errors of so many whisks.

    NaN where nothing is known.
    """

    rms: float
    low: float
    high: float

    @classmethod
    def of_errors(cls, biases: np.ndarray, sigmas: np.ndarray) -> "ExpectedRms":
        """Return what is expected of errors (n,) that are normal about biases (n,) with sigmas (n,).

        The mean of their squares is taken as a scaled χ² variable of the same mean and variance
        (Satterthwaite, Biometrics Bulletin 2, 1946).
        """
        if not len(biases):
            return cls(math.nan, math.nan, math.nan)
        mean = float(np.mean(biases**2 + sigmas**2))
        variance = float(np.mean(2.0 * sigmas**4 + 4.0 * biases**2 * sigmas**2)) / len(biases)
        rms = math.sqrt(mean)
        if not variance:
            return cls(rms, rms, rms)
        freedom = 2.0 * mean**2 / variance
        low, high = np.sqrt(chdtri(freedom, [1.0 - _TAIL, _TAIL]) / freedom)
        return cls(rms, rms * float(low), rms * float(high))

    def to_rank(self, measured: float) -> float:
        """Return the error that a choice is ranked by: the expected one, or the measured RMS where that
        is larger than chance explains, so that the expectation does not hold."""
        return measured if measured > self.high else self.rms
