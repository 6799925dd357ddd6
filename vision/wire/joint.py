"""Positions of all of a rod's segments in one camera, its shading and the lens blur, solved together.

What all segments share, shading and blur, can stand in for a shift that they share too. Solved in
turns, the two creep along the valley between them and stop where they began. Here they are one
damped Gauss–Newton problem. Its normal matrix has the form of an arrow: one position for each
segment, and one block of what all share, some hundred unknowns, to which it is reduced (Schur's
complement). The shading is linear, so that at each step it is the most probable one at these
positions and this blur (variable projection: Golub and Pereyra 1973, in Kaufman's form).

Two things can go wrong with what all share. A shift of all segments to one side, under another blur
and shading, can be a minimum of its own, or as good as the best: several starts are followed, and
the sigma of such a shift holds all that are probable (`common_shift.py`). And no model of light is
right to a hundredth of the contrast, in all segments alike: what is shared is found with the
weights of pixels bounded by that error.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from vision.wire.bands import Pieces
from vision.wire.common_shift import common_spread_px
from vision.wire.gathered import GatheredEquations, exactly_if_needed
from vision.wire.shading import (
    LEAST_POWER,
    LONGEST_PX,
    Equations,
    Knots,
    PositionEquations,
    contrast_of,
    stiffness,
    wave_prior,
)

# [1] Prior sigma of the logarithm of the blur: a lens in focus, 0.5 to 1.3 px with the pixel's own
# width; pixels that say otherwise overrule it. Study: wire_scenes.py.
BLUR_SIGMA = 0.25
# [1] Error of the model of light over the contrast, at one distance from the axis in all segments
# alike. In 65 views of 30 path-traced scenes common offsets are 0.17 px RMS and 1.3 sigma; with
# 0.003 0.19 and 1.4, with 0.0015 0.24 and 1.7, with 0.03 0.26 and 1.7. Study: wire_scenes.py.
_MODEL_ERROR_SHARE = 0.006
# [px] Pixels within this distance across share that error: the bin of the first pass. Stated.
_MODEL_ERROR_BIN_PX = 0.3
# [px] Common shifts of the starts: minima lie 0.5 to 1 px apart. Set by eye. Study: wire_scenes.py.
_START_SHIFTS_PX = np.linspace(-1.5, 1.5, 7)
# [sigma] Blurs of the starts, in sigmas of their logarithm. Set by eye. Study: wire_scenes.py.
_START_BLUR_SIGMAS = (-1.2, 0.2, 1.6)
# [segments] By so many the starts are ranked. With 100 one view of 65 ended 0.8 px off. Study:
# wire_scenes.py.
_START_SEGMENTS = 300
# [starts] So many are followed to their end. Study: wire_scenes.py.
_MOST_STARTS = 3
# [px] No two starts that are followed have common shifts so near. Study: wire_scenes.py.
_START_SEPARATION_PX = 0.3
# [segments] By so many the probability of a common shift is found: pixels at one distance together
# determine no more than the model is good for. Set by eye. Study: wire_scenes.py.
_SPREAD_SEGMENTS = 120
# [steps] Gauss–Newton takes 4 to 10. Set by eye. Study: starts.py.
_MOST_STEPS = 40
# [1] Longest step of the blur's logarithm. Set by eye. Study: starts.py.
_LONGEST_LOG = 0.3
# [px] A segment that goes farther sees something else. Set by eye. Study: starts.py.
_FARTHEST_PX = 4.0
# [1] First damping, of the median segment's information: 1e-6 to 1e-2 take 4 to 10 steps alike.
# Study: starts.py.
_DAMPING = 1e-3
# [1] Damping at which the descent ends. Study: starts.py.
_MOST_DAMPING = 1e3
# [1] Damping is multiplied by this after a step that does not help. The solution does not depend
# on it. Derived.
_DAMPING_UP = 10.0
# [1] Damping is divided by this after a step that helps. The solution does not depend on it. Derived.
_DAMPING_DOWN = 5.0
# [1] Below this share of the first damping there is none. The solution does not depend on it. Derived.
_LEAST_DAMPING_SHARE = 1e-2
# [chi²] The descent ends where a step would gain less by what all share, which it moves by a
# seventh of a sigma at most. Study: starts.py.
_CONVERGED_SHARED = 0.02
# [chi²] And less in the mean by a segment's own position: 0.03 sigma. Study: starts.py.
_CONVERGED_EACH = 1e-3
# [1] Factor on both for a start's descent, from whose end another begins: half a sigma by what all
# share. With it d_x, touch, slope and slip move by 0.006 sigma at most in twelve scenes. Not
# measured by a script.
_COARSE = 25.0


@dataclass(frozen=True)
class Shared:
    """Hold what all segments share, and where they lie by it.

    shift_px (s,): positions. shared_px (s, k): by how much each moves with one sigma of each of k
    independent causes that all share. coefficients (s, terms): the shading of each.
    evidence: minus twice the log evidence of positions and blur, the shading integrated out.
    """

    shift_px: np.ndarray
    shared_px: np.ndarray
    coefficients: np.ndarray
    blur_px: float
    evidence: float


@dataclass(frozen=True)
class Solved(Shared):
    """Hold of each segment by itself, too, all (s,): own_sigma_px by its own noise, chi2 per pixel, contrast.

    widened_px2 (s, 2): by how much its blur² is above that of all, and sigma.
    """

    own_sigma_px: np.ndarray
    chi2: np.ndarray
    contrast: np.ndarray
    widened_px2: np.ndarray


@dataclass(frozen=True)
class ShadedSegments:
    """Hold what is to be explained: segments, by so many shading functions at these knots.

    blur_px, blur_sigma: prior of the lens blur, and of its logarithm.
    seen_blur_px: the blur of an earlier pass, which said where the segments are expected; else None.
    """

    pieces: Pieces
    terms: int
    knots: Knots
    blur_px: float
    blur_sigma: float = BLUR_SIGMA
    seen_blur_px: float | None = None

    @cached_property
    def knot_weights(self) -> np.ndarray:
        """Return the weight (s, knots) of each knot in the shading of each segment."""
        return self.knots.weights(self.pieces)

    def of(self, some: slice) -> "ShadedSegments":
        """Return the task of some of the segments."""
        return replace(self, pieces=self.pieces.select(some))

    def tempered(self) -> "ShadedSegments":
        """Return the task with the weights of pixels bounded by the error of the model of light.

        Of pixels at one distance from the axis, many together count no more than that error allows.
        """
        pieces = self.pieces
        model_error = _MODEL_ERROR_SHARE * contrast_of(pieces)
        bins = np.floor(pieces.offset_px / _MODEL_ERROR_BIN_PX).astype(int)
        bins -= bins.min(initial=0)
        total = np.bincount(bins.ravel(), np.ravel(pieces.weight**2))
        weight = pieces.weight / np.sqrt(1.0 + total[bins] * model_error**2)
        return replace(self, pieces=replace(pieces, weight=weight))

    def blur_deviation(self, log_blur: np.ndarray | float) -> np.ndarray | float:
        """Return how many prior sigmas the logarithm of the blur lies from the prior."""
        return (log_blur - np.log(self.blur_px)) / self.blur_sigma


def solve_jointly(task: ShadedSegments, *, last: bool = True) -> Solved:
    """Return the most probable positions, shading and blur of segments.

    The segments lie where they are expected, or, before an earlier pass, all to one side. last: this
    is the last pass, so that other common shifts that are as probable enter the sigma.
    """
    tempered = task.tempered()
    shared = _descend(_begin(tempered, *_start(task)).weighted())
    if last:
        shared = _with_all_shifts(tempered, shared)
    return settled(task, shared)


def _with_all_shifts(task: ShadedSegments, shared: Shared) -> Shared:
    """Return the solution with a sigma for its common shift that holds all probable shifts."""
    robust = np.ones(len(task.pieces))
    here = _Point.at(task, shared.shift_px, np.log(shared.blur_px), robust).weighted()
    some = slice(None, None, 1 + len(task.pieces) // _SPREAD_SEGMENTS)
    spread_px = common_spread_px(
        here.equations.pieces.select(some),
        shared.blur_px,
        task.terms,
        task.knots,
        here.robust[some],
        (task.blur_px, task.blur_sigma),
    )
    bent = shared.shared_px - np.average(shared.shared_px, axis=0, weights=here.robust)
    common = np.full((len(bent), 1), spread_px)
    return replace(shared, shared_px=np.concatenate([bent, common], axis=1))


def settled(task: ShadedSegments, shared: Shared) -> Solved:
    """Return each segment's own position by all of its pixels, what all share known.

    The segments' weighted mean position stays as it is.
    """
    here = Equations(task.pieces.moved(shared.shift_px), shared.blur_px, task.terms)
    linear = here.linearised(shared.coefficients)
    chi2 = here.chi2(shared.coefficients) / task.pieces.freedom
    misfit = chi2 / max(float(np.median(chi2)), 1e-9)
    share = linear.power / np.maximum(misfit, 1.0) ** 2
    return Solved(
        shift_px=shared.shift_px + linear.step_px - np.average(linear.step_px, weights=share),
        shared_px=shared.shared_px,
        coefficients=shared.coefficients,
        blur_px=shared.blur_px,
        evidence=shared.evidence,
        own_sigma_px=linear.own_sigma_px(chi2),
        chi2=chi2,
        contrast=linear.contrast,
        widened_px2=_widened(linear, shared.blur_px, np.maximum(chi2, 1.0)),
    )


def _start(task: ShadedSegments) -> tuple[float, float]:
    """Return the common shift and the logarithm of the blur to begin from.

    They are those of an earlier pass, or of the most probable end of several descents.
    """
    if task.seen_blur_px is not None:
        return 0.0, float(np.log(task.seen_blur_px))
    task = task.of(slice(None, None, 1 + len(task.pieces) // _START_SEGMENTS)).tempered()
    log_blurs = np.log(task.blur_px) + task.blur_sigma * np.array(_START_BLUR_SIGMAS)
    evidences = exactly_if_needed(
        lambda each_pixel: _evidences_of_starts(task, log_blurs, each_pixel)
    )
    by_shift, by_blur = np.unravel_index(np.argsort(evidences, axis=None), evidences.shape)
    starts = list(zip(_START_SHIFTS_PX[by_shift].tolist(), log_blurs[by_blur].tolist()))
    robust = _begin(task, *starts[0]).weighted().robust
    chosen: list[tuple[float, float]] = []
    for shift_px, log_blur in starts:
        if all(abs(shift_px - other) > _START_SEPARATION_PX for other, _ in chosen):
            chosen.append((shift_px, log_blur))
    ends = []
    for shift_px, log_blur in chosen[:_MOST_STARTS]:
        ends.append(_descend(_begin(task, shift_px, log_blur, robust), _COARSE))
    best = min(ends, key=lambda end: end.evidence)
    return float(np.median(best.shift_px)), float(np.log(best.blur_px))


def _evidences_of_starts(
    task: ShadedSegments, log_blurs: np.ndarray, each_pixel: bool
) -> np.ndarray:
    """Return minus twice the log evidence (shifts, blurs) of all segments moved by each start's shift.

    See `_Point.evidence`; each_pixel: see `GatheredEquations`.
    """
    every = np.ones(len(task.pieces))
    models = [(1.0, float(blur)) for blur in np.exp(log_blurs)]
    gathered = GatheredEquations(task.pieces, task.knot_weights, every, each_pixel=each_pixel)
    left, right, power = gathered.normal(_START_SHIFTS_PX, models, task.terms)
    evidences = power + task.blur_deviation(log_blurs) ** 2
    for k, shift in enumerate(_START_SHIFTS_PX):
        prior = wave_prior(task.pieces.moved(shift * every), task.terms)
        stiff = stiffness(prior, task.knots)
        evidences[k] -= np.linalg.slogdet(stiff)[1]
        for b in range(len(log_blurs)):
            factor = cho_factor(left[k, b] + stiff, check_finite=False)
            found = cho_solve(factor, right[k, b], check_finite=False)
            evidences[k, b] += 2.0 * np.sum(np.log(np.diag(factor[0])))
            evidences[k, b] -= right[k, b] @ found
    return evidences


def _begin(
    task: ShadedSegments, shift_px: float, log_blur: float, robust: np.ndarray | None = None
) -> "_Point":
    """Return the point where all segments have one shift, px, under this blur."""
    every = np.ones(len(task.pieces))
    return _Point.at(task, shift_px * every, log_blur, every if robust is None else robust)


def _descend(here: "_Point", coarse: float = 1.0) -> Shared:
    """Descend from a point by damped Gauss–Newton, with the segments' weights as they are there.

    Weights that changed at each step would let segments that a shift spoils count ever less.
    coarse: factor on what a step may still gain where the descent ends. The last step is taken
    without evaluating the point that it leads to.
    """
    arrow = _Arrow(here)
    damping = _DAMPING
    for _ in range(_MOST_STEPS):
        step = arrow.step(damping)
        gains_each = coarse * _CONVERGED_EACH * len(here.shift_px)
        if step.gain_shared < coarse * _CONVERGED_SHARED and step.gain_each < gains_each:
            break
        there = here.moved(step.shift_px, step.log_blur)
        if there.misfit > here.misfit:
            damping = max(_DAMPING_UP * damping, _DAMPING)
            if damping > _MOST_DAMPING:
                break
            continue
        is_damped = damping > _LEAST_DAMPING_SHARE * _DAMPING
        damping = damping / _DAMPING_DOWN if is_damped else 0.0
        here = there
        arrow = _Arrow(here)
    return arrow.solved(damping)


@dataclass(frozen=True)
class _Point:
    """Hold positions and blur, and the most probable shading there.

    left: normal matrix (size, size) of the shading. coefficients (s, terms): of each segment.
    chi2 (s,): of each segment. misfit: all chi² by weight, and what the priors add.
    stiff (size, size): prior of the shading. robust (s,): weight of each segment.
    """

    task: ShadedSegments
    shift_px: np.ndarray
    log_blur: float
    robust: np.ndarray
    stiff: np.ndarray
    equations: Equations
    left: np.ndarray
    coefficients: np.ndarray
    chi2: np.ndarray
    misfit: float

    @classmethod
    def at(
        cls,
        task: ShadedSegments,
        shift_px: np.ndarray,
        log_blur: float,
        robust: np.ndarray,
        stiff: np.ndarray | None = None,
        equations: Equations | None = None,
    ) -> "_Point":
        """Return the point at these positions and this blur.

        stiff: the shading's prior, by the contrast seen here where None. equations: where they are
        known already.
        """
        if equations is None:
            equations = Equations(task.pieces.moved(shift_px), float(np.exp(log_blur)), task.terms)
        if stiff is None:
            stiff = stiffness(wave_prior(equations.pieces, task.terms), task.knots)
        weights = task.knot_weights
        left, right = equations.shared(weights, robust)
        left += stiff
        shared = cho_solve(cho_factor(left, check_finite=False), right, check_finite=False)
        coefficients = weights @ shared.reshape(weights.shape[1], task.terms)
        chi2 = equations.chi2(coefficients)
        of_priors = shared @ stiff @ shared + task.blur_deviation(log_blur) ** 2
        misfit = float(robust @ chi2 + of_priors)
        return cls(
            task, shift_px, log_blur, robust, stiff, equations, left, coefficients, chi2, misfit
        )

    @property
    def evidence(self) -> float:
        """Return minus twice the log evidence of positions and blur, the shading integrated out."""
        log_posterior = np.linalg.slogdet(self.left)[1]
        log_prior = np.linalg.slogdet(self.stiff)[1]
        return float(self.misfit + log_posterior - log_prior)

    def moved(self, step_px: np.ndarray, log_blur_step: float) -> "_Point":
        """Return the point a step farther on, with the weights of this one."""
        shift = self.shift_px + np.clip(step_px, -LONGEST_PX, LONGEST_PX)
        return self.at(
            self.task,
            np.clip(shift, -_FARTHEST_PX, _FARTHEST_PX),
            self.log_blur + float(np.clip(log_blur_step, -_LONGEST_LOG, _LONGEST_LOG)),
            self.robust,
            self.stiff,
        )

    def weighted(self) -> "_Point":
        """Return the point with the segments weighed by their misfit.

        Those well above the median hardly count. What all leave beyond noise is an error of the
        model: where that is large the priors count for as much as where noise is.
        """
        misfit = self.chi2 / self.task.pieces.freedom
        usual = max(float(np.median(misfit)), 1e-9)
        robust = 1.0 / np.maximum(misfit / usual, 1.0) ** 2 / max(usual, 1.0)
        return self.at(self.task, self.shift_px, self.log_blur, robust, equations=self.equations)


@dataclass(frozen=True)
class _Step:
    """Hold a step of positions (s,), px, and of the blur's logarithm.

    gain_shared, gain_each: by how much chi² is expected to fall by what all share, and by positions.
    """

    shift_px: np.ndarray
    log_blur: float
    gain_shared: float
    gain_each: float


class _Arrow:
    """Normal equations at a point: a diagonal of positions, and a block of what all share.

    power, right (s,): matrix and right side of each segment's position.
    cross (s, size + 1): positions with shading and blur. shared (size + 1, size + 1): shading and blur.
    log_blur_right: right side of the blur; that of the shading is 0 at its most probable value.
    """

    def __init__(self, point: _Point):
        task = point.task
        weights = task.knot_weights
        linear = point.equations.linearised(point.coefficients)
        size = len(point.left)
        self.point = point
        self.power = linear.power
        self.right = linear.gram[:, 0, 2]
        by_shading = (weights[:, :, None] * linear.rod[:, None, 0]).reshape(len(weights), size)
        self.cross = np.concatenate([by_shading, linear.gram[:, 0, 1:2]], axis=1)
        blur_by_shading = ((weights * point.robust[:, None]).T @ linear.rod[:, 1]).ravel()
        self.shared = np.zeros((size + 1, size + 1))
        self.shared[:size, :size] = point.left
        self.shared[:size, size] = blur_by_shading
        self.shared[size, :size] = blur_by_shading
        self.shared[size, size] = point.robust @ linear.gram[:, 1, 1] + task.blur_sigma**-2.0
        from_prior = (point.log_blur - np.log(task.blur_px)) / task.blur_sigma**2
        self.log_blur_right = point.robust @ linear.gram[:, 1, 2] - from_prior

    def step(self, damping: float) -> _Step:
        """Return the damped Gauss–Newton step, by Schur's complement of the positions."""
        robust = self.point.robust
        power = robust * self.power
        power = power + damping * np.median(power) + LEAST_POWER
        cross = robust[:, None] * self.cross
        right = robust * self.right
        own = cross / power[:, None]
        left = self.shared - cross.T @ own
        left[-1, -1] += damping * self.shared[-1, -1]
        shared_right = -own.T @ right
        shared_right[-1] += self.log_blur_right
        shared = cho_solve(cho_factor(left, check_finite=False), shared_right, check_finite=False)
        return _Step(
            shift_px=(right - cross @ shared) / power,
            log_blur=float(shared[-1]),
            gain_shared=float(shared_right @ shared),
            gain_each=float(right @ (right / power)),
        )

    def solved(self, damping: float) -> Shared:
        """Return the solution a step farther on, with the sensitivity of positions to what all share."""
        point = self.point
        step = self.step(damping)
        own = self.cross / self.power[:, None]
        left = self.shared - (point.robust[:, None] * self.cross).T @ own
        shared_px = np.linalg.solve(np.linalg.cholesky(left), own.T).T
        log_blur = point.log_blur + np.clip(step.log_blur, -_LONGEST_LOG, _LONGEST_LOG)
        shift_px = point.shift_px + np.clip(step.shift_px, -LONGEST_PX, LONGEST_PX)
        return Shared(
            shift_px, shared_px, point.coefficients, float(np.exp(log_blur)), point.evidence
        )


def _widened(linear: PositionEquations, blur_px: float, chi2: np.ndarray) -> np.ndarray:
    """Return by how much each segment's blur² is above that of all, and sigma, (s, 2).

    The segment's position is free as well.
    """
    gram = linear.gram
    information = gram[:, 1, 1] - gram[:, 0, 1] ** 2 / linear.power + LEAST_POWER
    step = (gram[:, 1, 2] - gram[:, 0, 1] * gram[:, 0, 2] / linear.power) / information
    return 2.0 * blur_px**2 * np.stack([step, np.sqrt(chi2 / information)], axis=1)
