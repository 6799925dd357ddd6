"""A low-pass filter without delay, for the samples of a whole stroke.

As `scipy.signal.sosfiltfilt`, which takes longer to load than a session to read.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_banded

# [1] Order of the Butterworth filter of each way. Stated.
_FILTER_ORDER = 2


def zero_phase_lowpass(x: ArrayLike, rate_Hz: float, cutoff_Hz: float) -> np.ndarray:
    """Filter samples along the first axis by a low-pass, forwards and backwards: without delay.

    Second-order Butterworth each way, −3 dB at cutoff_Hz over both. Missing samples (NaN) are
    bridged by lines for the filter, and stay NaN. Raises ValueError for a cut-off outside (0,
    rate/2).
    """
    x = np.asarray(x, dtype=float)
    if not 0 < cutoff_Hz < rate_Hz / 2:
        raise ValueError(
            f"cutoff_Hz = {cutoff_Hz}: must lie between 0 and half the rate of {rate_Hz} Hz"
        )
    each_way_Hz = cutoff_Hz / (np.sqrt(2) - 1) ** (1 / (2 * _FILTER_ORDER))
    cutoff = min(each_way_Hz / rate_Hz, 0.499)
    padding = min(len(x) - 1, int(3 * rate_Hz / cutoff_Hz))
    bridged = np.apply_along_axis(_bridged, 0, x)
    filtered = _forwards_and_backwards(bridged, cutoff, padding)
    return np.where(np.isfinite(x), filtered, np.nan)


def _forwards_and_backwards(x, cutoff, padding: int):
    """Filter x (n, …) from its beginning and then from its end; cutoff as a share of the rate.

    At both ends x is continued by `padding` samples, mirrored at its end point.
    """
    before = 2 * x[:1] - x[padding:0:-1]
    after = 2 * x[-1:] - x[-2 : -padding - 2 : -1]
    longer = np.concatenate([before, x, after])
    for _ in range(2):
        longer = _butterworth(longer, cutoff)[::-1]
    return longer[padding : padding + len(x)]


def _butterworth(x, cutoff):
    """Filter x (n, …) once by a second-order Butterworth low-pass, at rest at its first sample.

    By the bilinear transform y_k + a1 y_{k-1} + a2 y_{k-2} = b (x_k + 2 x_{k-1} + x_{k-2}): one
    banded system for all k.
    """
    k = np.tan(np.pi * cutoff)
    a0 = 1.0 + np.sqrt(2.0) * k + k * k
    a1 = 2.0 * (k * k - 1.0) / a0
    a2 = (1.0 - np.sqrt(2.0) * k + k * k) / a0
    b = k * k / a0
    above = x - x[:1]
    driven = b * above
    driven[1:] += 2.0 * b * above[:-1]
    driven[2:] += b * above[:-2]
    bands = np.tile([[1.0], [a1], [a2]], len(x))
    filtered = solve_banded((2, 0), bands, driven.reshape(len(x), -1))
    return x[:1] + filtered.reshape(x.shape)


def _bridged(x):
    """Interpolate the missing samples of x (n,) linearly; zeros where all are missing."""
    known = np.flatnonzero(np.isfinite(x))
    if known.size == 0:
        return np.zeros(len(x))
    return np.interp(np.arange(len(x)), known, x[known])
