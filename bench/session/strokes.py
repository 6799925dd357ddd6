"""The motor's forward strokes: each is a whisk. Angles may carry encoder steps, noise, spikes and pauses."""

import numpy as np
from scipy.ndimage import median_filter

SMALLEST_STROKE_RAD = np.radians(
    0.3
)  # rad: less is a motor that settles, or its encoder's steps. Set by eye
# Of the largest stroke: a shorter one is kept (a recording may start mid-stroke), a settling motor is not.
_SMALLEST_SHARE = 0.2
# A turn counts when the motor goes back by this share of its range, or by so many times its jitter.
_TURN_SHARE, _TURN_JITTERS = 0.1, 4.0
# a median over these removes spikes of one or two samples and leaves ramps as they are
_SPIKE_SAMPLES = 5


def forward_strokes(
    motor_rad: np.ndarray, smallest_rad: float = SMALLEST_STROKE_RAD
) -> tuple[slice, ...]:
    """Slices of samples in which the motor goes forward, in their order. motor_rad: (n,).

    A pause within a stroke does not end it; back strokes and pauses between strokes belong to none. Strokes
    that the recording cuts at its start or end count.
    """
    if len(motor_rad) < 2:
        return ()
    angle, jitter = without_spikes(motor_rad)
    turn = max(_TURN_SHARE * np.ptp(angle), _TURN_JITTERS * jitter)
    runs = _forward_runs(angle, turn) if turn > 0 else []
    rises = [angle[crest] - angle[trough] for trough, crest in runs]
    smallest = max(smallest_rad, _SMALLEST_SHARE * max(rises, default=0.0))
    return tuple(
        _without_pauses(angle, *run, jitter) for run, rise in zip(runs, rises) if rise >= smallest
    )


def without_spikes(motor_rad: np.ndarray) -> tuple[np.ndarray, float]:
    """The angle through a short median, (n,), and its jitter: 99 of 100 samples lie within that of it."""
    smooth = median_filter(motor_rad, size=_SPIKE_SAMPLES, mode="nearest")
    return smooth, float(np.percentile(np.abs(motor_rad - smooth), 99))


def _forward_runs(angle: np.ndarray, turn: float) -> list[tuple[int, int]]:
    """(trough, crest) of every rise of at least `turn` that no fall of `turn` interrupts."""
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
            rising, low = False, i
        elif not rising and value - angle[low] >= turn:
            rising, trough, high = True, low, i
    return [*runs, (trough, high)] if rising else runs


def _extremes(angle: np.ndarray) -> np.ndarray:
    """Indices (m,) of the first sample, of all that the angle turns round at, and of the last that it moves to; of one
    that stands still its first."""
    moved = np.concatenate([[0], np.flatnonzero(np.diff(angle)) + 1])
    up = np.diff(angle[moved]) > 0
    return np.concatenate([moved[:1], moved[1:-1][up[1:] != up[:-1]], moved[1:][-1:]])


def _without_pauses(angle: np.ndarray, trough: int, crest: int, jitter: float) -> slice:
    """The run from where the motor leaves its trough to where it reaches its crest.

    An encoder stands still between two of its steps, so one step's time at either end belongs to the stroke.
    """
    within = (
        2 * jitter
    )  # trough and crest are extremes of the noise, so a pause lies up to twice that from them
    run = angle[trough : crest + 1]
    leaves = np.flatnonzero(run <= run[0] + within)[-1]
    arrives = np.flatnonzero(run >= run[-1] - within)[0]
    step = _step_samples(run[leaves : arrives + 1])
    first = max(trough + leaves - step, _plateau_start(angle, trough, within))
    last = min(trough + arrives + step, _plateau_end(angle, crest, within))
    return slice(int(first), int(last) + 1)


def _step_samples(rise: np.ndarray) -> int:
    """The longest time, in samples, that the angle stands still within a rise, unless it pauses there."""
    moves = np.flatnonzero(np.diff(rise))
    return int(np.percentile(np.diff(moves), 90)) if len(moves) > 2 else 1


def _plateau_start(angle: np.ndarray, trough: int, within: float) -> int:
    before = np.flatnonzero(np.abs(angle[:trough] - angle[trough]) > within)
    return int(before[-1]) + 1 if len(before) else 0


def _plateau_end(angle: np.ndarray, crest: int, within: float) -> int:
    after = np.flatnonzero(np.abs(angle[crest:] - angle[crest]) > within)
    return crest + int(after[0]) - 1 if len(after) else len(angle) - 1
