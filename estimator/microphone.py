"""First touch by a microphone at the base (Table I): [17], [27], [29] have texture and touch from it, no distance.

Forces and moments at the base bend its membrane; what is slower than its band is lost. So a touch is where
noise of one variance ends and that of a larger one begins: its instant is the mean over all samples by their likelihood. Derived
here. Times in s.
"""

from dataclasses import dataclass
from math import hypot, nan, sqrt

import numpy as np
from scipy.special import ndtri

from estimator.reasons import NamedReason

# [1] Of a stroke, from its beginning: nothing is touched there. Stated.
_FREE_SHARE = 0.2
# [1] Strokes without a touch in which noise passes for one. Stated.
_FALSE_ALARMS = 1e-3
# [samples] After the loudest of noise: of these is the variance of a touch. Stated.
_LOUD_SAMPLES = 20
# [samples] Fewest of a stroke: a variance of fewer than ten is known to a half. Derived.
_FEWEST_SAMPLES = 50
NOTHING_HEARD = NamedReason("nothing_heard", "no sound stands out of the noise")


@dataclass(frozen=True)
class HeardTouch:
    """The instant of first touch with its standard deviation, s; NaN where nothing is heard, and status says so.

    signal_to_noise: of the first sample that noise does not reach.
    """

    time_s: float
    sigma_s: float
    signal_to_noise: float
    status: str = ""


_NO_TOUCH = HeardTouch(nan, nan, nan, NOTHING_HEARD)


def heard_touch(time_s: np.ndarray, pressure: np.ndarray) -> HeardTouch:
    """Find first touch in the pressure (n,) of one forward stroke, at times (n,), s.

    Gaps in the pressure are left out.
    """
    known = np.isfinite(pressure)
    time_s = time_s[known]
    pressure = pressure[known]
    count = len(pressure)
    begin = int(_FREE_SHARE * count)
    free = pressure[:begin]
    if count < _FEWEST_SAMPLES or not np.std(free) > 0:
        return _NO_TOUCH
    sought = (pressure[begin:] - np.mean(free)) / np.std(free, ddof=2)
    loudest = -float(ndtri(0.5 * _FALSE_ALARMS / count))
    louder = np.flatnonzero(np.abs(sought) > loudest)
    if not len(louder):
        return _NO_TOUCH
    first = int(louder[0])
    likelihood = _onset_likelihood(sought[: first + _LOUD_SAMPLES], first)
    instant_s, sigma_s = _instant_of_touch(time_s, begin, likelihood)
    return HeardTouch(instant_s, sigma_s, float(abs(sought[first])))


def _instant_of_touch(
    time_s: np.ndarray, begin: int, likelihood: np.ndarray
) -> tuple[float, float]:
    """Return the instant of touch and its sigma, s.

    likelihood (m,): that a sample is the first loud one, from the sample `begin` on. The touch lies between
    the last quiet sample and the first loud one.
    """
    times = time_s[begin : begin + len(likelihood)]
    step_s = float(np.median(np.diff(time_s)))
    instant = float(likelihood @ times)
    spread = sqrt(float(likelihood @ (times - instant) ** 2))
    return instant - 0.5 * step_s, hypot(spread, step_s / sqrt(12.0))


def _onset_likelihood(scaled: np.ndarray, first: int) -> np.ndarray:
    """Return the probability (first + 1,) that each sample is the first loud one.

    scaled (n,): in sigmas of the noise; the loud ones have a variance of their own, the most likely.
    """
    squares = scaled**2
    quiet = np.concatenate([[0.0], np.cumsum(squares)])[: first + 1]
    loud = np.cumsum(squares[::-1])[::-1][: first + 1]
    left = len(scaled) - np.arange(first + 1)
    logarithm = -0.5 * (quiet + left * np.log(loud / left) + left)
    weight = np.exp(logarithm - logarithm.max())
    return weight / weight.sum()
