"""The motor's forward strokes: each is a whisk. Angles may carry encoder steps, noise, spikes and pauses."""

import numpy as np
from scipy.ndimage import median_filter

# [rad] Less is a motor that settles, or its encoder's steps. Study: no stroke of the sessions of
# tests/studies/net.py changes at half or at twice of it.
SMALLEST_STROKE_RAD = np.radians(0.3)
# Of the largest stroke: a shorter one is kept (a recording may start mid-stroke), a settling motor is not.
_SMALLEST_SHARE = 0.2
# A turn counts when the motor goes back by this share of its range,
_TURN_SHARE = 0.1
# or by so many times its jitter.
_TURN_JITTERS = 4.0
# [samples] A median over these removes spikes of one or two samples and leaves ramps as they are.
_SPIKE_SAMPLES = 5


def forward_strokes(
    motor_rad: np.ndarray, smallest_rad: float = SMALLEST_STROKE_RAD
) -> tuple[slice, ...]:
    """Return slices of samples in which the motor goes forward, in their order. motor_rad: (n,).

    A pause within a stroke does not end it; back strokes and pauses between strokes belong to none.
    Strokes that the recording cuts at its start or end count.
    """
    if len(motor_rad) < 2:
        return ()
    angle, jitter = without_spikes(motor_rad)
    turn = max(_TURN_SHARE * np.ptp(angle), _TURN_JITTERS * jitter)
    runs = _forward_runs(angle, turn) if turn > 0 else []
    rises = [angle[crest] - angle[trough] for trough, crest in runs]
    smallest = max(smallest_rad, _SMALLEST_SHARE * max(rises, default=0.0))
    found = []
    for (trough, crest), rise in zip(runs, rises):
        if rise >= smallest:
            found.append(_without_pauses(angle, trough, crest, jitter))
    return tuple(found)


def without_spikes(motor_rad: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the angle through a short median, (n,), and its jitter.

    99 of 100 samples lie within the jitter of the median.
    """
    smooth = median_filter(motor_rad, size=_SPIKE_SAMPLES, mode="nearest")
    return smooth, float(np.percentile(np.abs(motor_rad - smooth), 99))


def _forward_runs(angle: np.ndarray, turn: float) -> list[tuple[int, int]]:
    """Return (trough, crest) of every rise of at least `turn` that no fall of `turn` interrupts."""
    runs = []
    low = high = trough = 0
    rising = False
    for i in _extremes(angle).tolist():
        value = angle[i]
        if value > angle[high]:
            high = i
        if value < angle[low]:
            low = i
        if rising and angle[high] - value >= turn:
            runs.append((trough, high))
            rising = False
            low = i
        elif not rising and value - angle[low] >= turn:
            rising = True
            trough = low
            high = i
    return [*runs, (trough, high)] if rising else runs


def _extremes(angle: np.ndarray) -> np.ndarray:
    """Return the indices (m,) of the first sample, of each at which the angle turns round, and of the
    last that it moves to. An angle that stands still has its first alone.
    """
    moved = np.concatenate([[0], np.flatnonzero(np.diff(angle)) + 1])
    is_up = np.diff(angle[moved]) > 0
    turns = moved[1:-1][is_up[1:] != is_up[:-1]]
    return np.concatenate([moved[:1], turns, moved[1:][-1:]])


def _without_pauses(angle: np.ndarray, trough: int, crest: int, jitter: float) -> slice:
    """Return the run from where the motor leaves its trough to where it reaches its crest.

    An encoder stands still between two of its steps, so one step's time at either end belongs to
    the stroke.
    """
    # trough and crest are extremes of the noise, so a pause lies up to twice that from them
    within = 2 * jitter
    run = angle[trough : crest + 1]
    leaves = np.flatnonzero(run <= run[0] + within)[-1]
    arrives = np.flatnonzero(run >= run[-1] - within)[0]
    step = _step_samples(run[leaves : arrives + 1])
    first = max(trough + leaves - step, trough + 1 - _plateau(angle[trough::-1], within))
    last = min(trough + arrives + step, crest - 1 + _plateau(angle[crest:], within))
    return slice(int(first), int(last) + 1)


def _step_samples(rise: np.ndarray) -> int:
    """Return the longest time, in samples, that a rise stands still without pausing."""
    moves = np.flatnonzero(np.diff(rise))
    return int(np.percentile(np.diff(moves), 90)) if len(moves) > 2 else 1


def _plateau(angle: np.ndarray, within: float) -> int:
    """Return how many samples from the first on stay within so much of it."""
    is_beyond = np.abs(angle - angle[0]) > within
    return int(np.argmax(is_beyond)) if is_beyond.any() else len(angle)
