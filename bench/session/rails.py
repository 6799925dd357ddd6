"""Saturated samples: a channel that stands still at its own extreme, far from where it began."""

import numpy as np
from scipy.ndimage import label

_LEAST_RUN = 3  # samples: two equal ones are an ADC's steps, three at an extreme a rail
_FAR = 0.5  # of the channel's range, from its level at the start: noise without an ADC stands still at zero too


def off_the_rails(channels: np.ndarray) -> np.ndarray:
    """Channels (n, k) with NaN where a channel is at its rail: three equal samples in a row, or more, at its maximum
    or minimum, more than half of its range from the level of its first samples."""
    kept = np.array(channels, dtype=float)
    for column in kept.T:
        column[_at_rail(column)] = np.nan
    return kept


def _at_rail(column) -> np.ndarray:
    level, span = np.median(column[: max(1, len(column) // 50)]), np.ptp(column)
    railed = np.zeros(len(column), dtype=bool)
    for extreme in (column.max(), column.min()):
        if span > 0 and abs(extreme - level) > _FAR * span:
            railed |= _runs(column == extreme)
    return railed


def _runs(marked) -> np.ndarray:
    """The marked samples that belong to runs of `_LEAST_RUN` or more."""
    runs, _ = label(marked)
    return marked & (np.bincount(runs)[runs] >= _LEAST_RUN)
