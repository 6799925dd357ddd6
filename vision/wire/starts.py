"""Where the descent of a rod's segments begins: their common shift and the lens blur.

A shift of all segments to one side, under another blur and shading, can be a minimum of its own:
all starts of a grid are ranked by their evidence, and the best are followed.
"""

import numpy as np

from vision.wire.descent import Point, SharedSolution, descend
from vision.wire.gathered import GatheredEquations, exactly_if_needed
from vision.wire.light_prior import USUAL_LIGHT
from vision.wire.shaded_segments import ShadedSegments
from vision.wire.shading import contrast_of

# [px] Common shifts of the starts: minima lie 0.5 to 1 px apart. By 5 or 11 of them touch moves by
# 0.07 sigma. Study: thresholds.py wire.starts _START_SHIFTS_PX ….
_START_SHIFTS_PX = np.linspace(-1.5, 1.5, 7)
# [sigma] Blurs of the starts, in sigmas of their logarithm. By one or five of them touch moves by
# 0.07 sigma. Study: thresholds.py wire.starts _START_BLUR_SIGMAS ….
_START_BLUR_SIGMAS = (-1.2, 0.2, 1.6)
# [segments] By so many the starts are ranked. With 100 one view of 65 ended 0.8 px off. Study:
# wire_scenes.py.
_START_SEGMENTS = 300
# [starts] So many are followed to their end. Study: wire_scenes.py.
_MOST_STARTS = 3
# [px] No two starts that are followed have common shifts so near. Study: wire_scenes.py.
_START_SEPARATION_PX = 0.3
# [px] Ends of two descents that are nearer are one minimum: they are 0.01 px apart. 0.03 or 0.3 move
# nothing on the fixtures. Study: thresholds.py wire.starts _SAME_END_PX ….
_SAME_END_PX = 0.1
# [1] Factor on both for a start's descent, from whose end another begins: half a sigma by what all
# share. With it d_x, touch, slope and slip move by 0.006 sigma at most in twelve scenes. Study:
# thresholds.py wire.starts _COARSE ….
_COARSE = 25.0


def find_start(task: ShadedSegments) -> tuple[float, float]:
    """Return the common shift and the logarithm of the blur to begin from.

    They are those of an earlier pass, or of the most probable end of several descents.
    """
    if task.seen_blur_px is not None:
        return 0.0, float(np.log(task.seen_blur_px))
    some = task.of(slice(None, None, 1 + len(task.pieces) // _START_SEGMENTS)).tempered()
    best = descend_coarsely(some)
    return _common_shift_px(some, best), float(np.log(best.blur_px))


def descend_coarsely(task: ShadedSegments) -> SharedSolution:
    """Return the most probable end of descents from the best starts, until two of them end alike."""
    starts = _rank_starts(task)
    robust = Point.at_common_shift(task, *starts[0]).weighted().robust
    ends: list[SharedSolution] = []
    for shift_px, log_blur in _keep_apart(starts)[:_MOST_STARTS]:
        start = Point.at_common_shift(task, shift_px, log_blur, robust)
        end = descend(start, _COARSE)
        shift_px = _common_shift_px(task, end)
        is_known = any(abs(shift_px - _common_shift_px(task, one)) < _SAME_END_PX for one in ends)
        ends.append(end)
        if is_known:
            break
    return min(ends, key=lambda end: end.evidence)


def _common_shift_px(task: ShadedSegments, shared: SharedSolution) -> float:
    """Return the shift that segments have in common, px at their mean half-width."""
    return float(np.median(shared.shift_px / task.pieces.relative_radius))


def _rank_starts(task: ShadedSegments) -> list[tuple[float, float]]:
    """Return all starts, common shift and logarithm of the blur, the most probable first."""
    log_blurs = np.log(task.blur_px) + task.blur_sigma * np.array(_START_BLUR_SIGMAS)
    evidences = exactly_if_needed(lambda each_pixel: _evidences(task, log_blurs, each_pixel))
    by_shift, by_blur = np.unravel_index(np.argsort(evidences, axis=None), evidences.shape)
    return list(zip(_START_SHIFTS_PX[by_shift].tolist(), log_blurs[by_blur].tolist()))


def _keep_apart(starts: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the starts whose common shift is not that of one before."""
    chosen: list[tuple[float, float]] = []
    for shift_px, log_blur in starts:
        if all(abs(shift_px - other) > _START_SEPARATION_PX for other, _ in chosen):
            chosen.append((shift_px, log_blur))
    return chosen


def _evidences(task: ShadedSegments, log_blurs: np.ndarray, each_pixel: bool) -> np.ndarray:
    """Return minus twice the log evidence (shifts, blurs) of all segments moved by each start's
    shift.

    See `Point.evidence`; each_pixel: see `GatheredEquations`.
    """
    every = np.ones(len(task.pieces))
    models = [(1.0, float(blur)) for blur in np.exp(log_blurs)]
    gathered = GatheredEquations(task.pieces, task.knot_weights, every, each_pixel=each_pixel)
    normal = gathered.normal(_START_SHIFTS_PX, models, task.terms)
    contrasts = []
    for shift_px in _START_SHIFTS_PX:
        contrasts.append(contrast_of(task.pieces.moved(shift_px * task.pieces.relative_radius)))
    precision = USUAL_LIGHT.precision(task.knots, task.terms)
    evidences = normal.evidences(precision, np.repeat(contrasts, len(models)))
    return evidences.reshape(-1, len(models)) + task.blur_deviation(log_blurs) ** 2
