"""Positions of all of a rod's segments in one camera, its shading and the lens blur, solved
together.

Shading and blur, which all segments share, can stand in for a shift of all segments to one side.
Solved in turns, positions and shading would therefore move slowly along the valley between them and
end near where they began. Here they are one least-squares problem (`descent.py`).

Two things can go wrong with what is shared. A shift of all segments, under another blur and
shading, can be a local minimum, or as probable as the best: several starts are followed
(`starts.py`), and the segments are moved to the mean of the posterior of such a shift, whose sigma
holds all shifts that are probable (`common_shift.py`). And no model of light is right to a
hundredth of the contrast: that error, which all segments have alike, bounds the weights of pixels by
which the shared unknowns are found (`ShadedSegments.tempered`).
"""

from dataclasses import dataclass, replace

import numpy as np

from vision.wire.common_shift import CommonShift, common_shift
from vision.wire.descent import Arrow, Point, SharedSolution, descend
from vision.wire.shaded_segments import ShadedSegments
from vision.wire.shading import LEAST_POWER, PositionEquations, SegmentEquations
from vision.wire.starts import descend_coarsely, find_start

# [segments] By which the posterior of a common shift is computed, at most: more pixels at one
# distance from the axis determine it no better, for the model errs alike in all of them. By 60 or 240 a d_x moves by 0.3
# sigma, its sigma by a quarter. Study: thresholds.py wire.joint _SPREAD_SEGMENTS ….
_SPREAD_SEGMENTS = 120


@dataclass(frozen=True)
class SegmentSolution(SharedSolution):
    """Besides what `SharedSolution` has, for each segment (s,): own_sigma_px by its own noise, chi2 per
    pixel, contrast.

    widened_px2 (s, 2): excess of its blur² over the common one, and its sigma.
    """

    own_sigma_px: np.ndarray
    chi2: np.ndarray
    contrast: np.ndarray
    widened_px2: np.ndarray


def solve_jointly(task: ShadedSegments, *, last: bool = True) -> SegmentSolution:
    """Return the most probable positions, shading and blur of segments.

    The segments lie where they are expected, or, in the first pass, all to one side. last: this
    is the last pass, so that all common shifts count as far as they are probable.
    """
    tempered = task.tempered()
    if not last and task.seen_blur_px is None:
        return place_each_segment(task, descend_coarsely(tempered))
    shift_px, log_blur = find_start(task)
    shared = descend(Point.at_common_shift(tempered, shift_px, log_blur).weighted())
    if last:
        shared = _at_mean_shift(tempered, shared)
    return place_each_segment(task, shared)


def _at_mean_shift(task: ShadedSegments, shared: SharedSolution) -> SharedSolution:
    """Return the solution with all segments moved to the mean of their common shift's posterior.

    The posterior's sigma takes the place of what the causes that are shared move in common.
    """
    here = _weighted_point(task, shared)
    shift = _common_shift(task, here)
    moved_px = shared.shift_px + shift.mean_px * task.pieces.relative_radius
    there = Point.at(task, moved_px, np.log(shared.blur_px) + shift.log_blur, here.robust)
    moved = Arrow(there).hold()
    own_px = _without_common(task, moved.shared_px, there.robust)
    common_px = shift.sigma_px * task.pieces.relative_radius[:, None]
    causes = replace(
        moved.causes,
        in_common=_in_common(task, moved.shared_px, there.robust),
        common_px=shift.sigma_px,
    )
    return replace(moved, shared_px=np.concatenate([own_px, common_px], axis=1), causes=causes)


def _without_common(task: ShadedSegments, shifts_px: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return shifts (s, k) less the common shift that fits them best by weights (s,)."""
    common = task.pieces.relative_radius
    return shifts_px - np.outer(common, _in_common(task, shifts_px, weight))


def _in_common(task: ShadedSegments, shifts_px: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the common shift (k,) that fits shifts (s, k) best by weights (s,)."""
    common = task.pieces.relative_radius
    weighted = weight * common
    return (weighted @ shifts_px) / (weighted @ common)


def _weighted_point(task: ShadedSegments, shared: SharedSolution) -> Point:
    """Return the point at a solution, segments weighed by their misfit."""
    every = np.ones(len(task.pieces))
    return Point.at(task, shared.shift_px, np.log(shared.blur_px), every).weighted()


def _common_shift(task: ShadedSegments, here: Point) -> CommonShift:
    """Return the posterior of a common shift, by _SPREAD_SEGMENTS of the segments."""
    some = slice(None, None, 1 + len(task.pieces) // _SPREAD_SEGMENTS)
    moved = replace(task, pieces=here.equations.pieces).of(some)
    return common_shift(moved, here.robust[some], float(np.exp(here.log_blur)))


def place_each_segment(task: ShadedSegments, shared: SharedSolution) -> SegmentSolution:
    """Find each segment's position by its own pixels, with shading and blur held.

    The common shift of all segments stays as it is.
    """
    here = SegmentEquations(task.pieces.moved(shared.shift_px), shared.blur_px, task.terms)
    linear = here.linearised(shared.coefficients)
    chi2 = here.chi2(shared.coefficients) / task.pieces.freedom
    misfit = chi2 / max(float(np.median(chi2)), 1e-9)
    share = linear.power / np.maximum(misfit, 1.0) ** 2
    step_px = _without_common(task, linear.step_px[:, None], share)[:, 0]
    return SegmentSolution(
        shift_px=shared.shift_px + step_px,
        shared_px=shared.shared_px,
        coefficients=shared.coefficients,
        blur_px=shared.blur_px,
        evidence=shared.evidence,
        by_knot=shared.by_knot,
        causes=shared.causes,
        own_sigma_px=linear.own_sigma_px(chi2),
        chi2=chi2,
        contrast=linear.contrast,
        widened_px2=widened_blurs(linear, shared.blur_px, np.maximum(chi2, 1.0)),
    )


def widened_blurs(linear: PositionEquations, blur_px: float, chi2: np.ndarray) -> np.ndarray:
    """Return the excess of each segment's blur² over the common one, px², and its sigma, (s, 2).

    The segment's position is estimated with it.
    """
    position, blur, residual = range(3)  # rows and columns of the products
    position_by_blur = linear.gram[:, position, blur] / linear.power
    of_blur = linear.gram[:, blur] - position_by_blur[:, None] * linear.gram[:, position]
    information = of_blur[:, blur] + LEAST_POWER  # the position eliminated
    log_blur = of_blur[:, residual] / information
    log_blur_sigma = np.sqrt(chi2 / information)
    return 2.0 * blur_px**2 * np.stack([log_blur, log_blur_sigma], axis=1)
