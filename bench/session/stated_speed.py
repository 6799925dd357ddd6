"""The motor's angle without a motor log: the stated speed times the time, over one forward stroke.

The angle counts from the recording's start, so pushing angles since felt touch are known, as well as
the speed is, and the angle at which pictures have the whisker is not.
"""

import numpy as np
from scipy.ndimage import uniform_filter1d

from bench.base.errors import BadInput

# [1] Of the recording's samples, for the level at its start and for the mean that finds its crest. Stated.
_SMOOTH_SHARE = 0.01
# [1] Of the largest change of the channels: there the stroke ends. A crest that is held has noise on it.
# Stated.
_CREST_SHARE = 0.98
# [1] Of that change: signals that rose so far and fell again before the crest are of several strokes.
# Stated.
_RISEN = 0.5
# [1] Of that change: signals that fell so far have let go of the object. Stated.
_FALLEN = 0.2


def by_stated_speed(
    time_s: np.ndarray, channels: np.ndarray, speed_deg_s: float, label: str
) -> np.ndarray:
    """Return the motor's angle (n,), degrees.

    It grows from 0 at the stated speed until the channels (n, 2) are at their crest, and stays there: how
    the motor comes back is not known. Raises BadInput where the recording has several strokes.
    """
    crest = _crest(channels, label)
    return speed_deg_s * (np.minimum(time_s, time_s[crest]) - time_s[0])


def _crest(channels: np.ndarray, label: str) -> int:
    """Return the first sample at which the channels (n, 2) are as far from their start as they come."""
    samples = max(1, round(_SMOOTH_SHARE * len(channels)))
    smooth = uniform_filter1d(channels, samples, axis=0, mode="nearest")
    change = np.linalg.norm(smooth - channels[:samples].mean(axis=0), axis=1)
    share = change / max(change.max(), np.finfo(float).tiny)
    crest = int(np.argmax(share >= _CREST_SHARE))
    risen = np.flatnonzero(share[:crest] > _RISEN)
    if len(risen) and share[risen[0] : crest].min() < _FALLEN:
        found = "the channels rise and fall before their largest change"
        cure = 'angle_from = "speed" takes one forward stroke a recording'
        raise BadInput(f"{found}; {cure}", file=label)
    return crest
