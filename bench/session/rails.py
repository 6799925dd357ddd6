"""Saturated samples: a channel that stands still at its own extreme, far from where it began."""

import numpy as np
from scipy.ndimage import label

# [samples] Two equal ones are an ADC's steps, three at an extreme a rail.
_LEAST_RUN = 3
# Of the channel's range, from its level at the start: noise without an ADC stands still at zero too.
_FAR = 0.5


def off_the_rails(channels: np.ndarray) -> np.ndarray:
    """Return channels (n, k) with NaN where a channel is at its rail.

    At its rail it stands for three samples in a row, or more, at its maximum or minimum, more than
    half of its range from the level of its first samples.
    """
    kept = np.array(channels, dtype=float)
    for column in kept.T:
        column[_at_rail(column)] = np.nan
    return kept


def _at_rail(column: np.ndarray) -> np.ndarray:
    """Return the mask (n,) of a channel's samples that are at its rail."""
    level = np.median(column[: max(1, len(column) // 50)])
    span = np.ptp(column)
    at_rail = np.zeros(len(column), dtype=bool)
    for extreme in (column.max(), column.min()):
        if span > 0 and abs(extreme - level) > _FAR * span:
            at_rail |= _in_long_runs(column == extreme)
    return at_rail


def _in_long_runs(marked: np.ndarray) -> np.ndarray:
    """Return the marked samples (n,) that belong to runs of `_LEAST_RUN` or more."""
    runs, _ = label(marked)
    return marked & (np.bincount(runs)[runs] >= _LEAST_RUN)
