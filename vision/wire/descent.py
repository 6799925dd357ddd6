"""Damped Gauss–Newton for the positions of all segments, their shading and the lens blur together.

The normal matrix has the form of an arrow: one position for each segment, and one block of what all
share, some hundred unknowns, to which it is reduced (Schur's complement). The shading is linear, so
that at each step it is the most probable one at these positions and this blur (variable projection:
Golub and Pereyra 1973, in Kaufman's form).
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from vision.wire.light_prior import USUAL_LIGHT
from vision.wire.shaded_segments import ShadedSegments
from vision.wire.shading import (
    LEAST_POWER,
    LONGEST_PX,
    PositionEquations,
    SegmentEquations,
    contrast_of,
)

# [steps] At most: Gauss–Newton takes 4 to 10. By 20 d_x moves by 0.01 sigma. Study: thresholds.py
# wire.descent _MOST_STEPS ….
_MOST_STEPS = 40
# [1] Longest step of the blur's logarithm. Half or twice it moves nothing on the fixtures. Study:
# thresholds.py wire.descent _LONGEST_LOG ….
_LONGEST_LOG = 0.3
# [px] A segment that goes farther sees something else. Half or twice it moves nothing on the
# fixtures. Study: thresholds.py wire.descent _FARTHEST_PX ….
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


@dataclass(frozen=True)
class SharedSolution:
    """What all segments share, and where they lie by it.

    shift_px (s,): positions. shared_px (s, k): by how much each moves with one sigma of each of k
    independent causes that all share. coefficients (s, terms): the shading of each.
    evidence: minus twice the log evidence of positions and blur, the shading integrated out.
    by_knot (knots, terms): the shading at its knots. causes: how those causes move any segment.
    """

    shift_px: np.ndarray
    shared_px: np.ndarray
    coefficients: np.ndarray
    blur_px: float
    evidence: float
    by_knot: np.ndarray
    causes: "Causes"


@dataclass(frozen=True)
class Causes:
    """The independent causes that move segments together: errors of shading and of blur.

    root (size + 1, size + 1): lower root of the inverse covariance of shading and blur, positions
    eliminated. in_common (size + 1,): the part of each cause that moves all segments to one side, px at
    the mean half-width, which `common_px` stands for: the sigma of such a shift.
    """

    root: np.ndarray
    in_common: np.ndarray | float = 0.0
    common_px: float = 0.0

    def shifts_px(self, sensitivity: np.ndarray) -> np.ndarray:
        """Return by how much each of the causes moves segments (s, size + 1), px.

        sensitivity (s, size + 1): of their positions to shading and blur.
        """
        return np.linalg.solve(self.root, sensitivity.T).T

    def all_shifts_px(self, sensitivity: np.ndarray, relative_radius: np.ndarray) -> np.ndarray:
        """Return by how much each of the causes and, last, a common shift moves segments, px.

        relative_radius (s,): half-width over the mean one.
        """
        own_px = self.shifts_px(sensitivity) - np.outer(relative_radius, self.in_common)
        return np.concatenate([own_px, self.common_px * relative_radius[:, None]], axis=1)


def descend(here: "Point", coarse: float = 1.0) -> SharedSolution:
    """Descend from a point by damped Gauss–Newton, with the segments' weights as they are there.

    Weights that changed at each step would let segments that a shift spoils count ever less.
    coarse: factor on what a step may still gain where the descent ends. The last step is taken
    without evaluating the point that it leads to.
    """
    arrow = Arrow(here)
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
        arrow = Arrow(here)
    return arrow.solve(damping)


def _solve_positive(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the solution (n,) of equations with a positive definite matrix (n, n)."""
    return cho_solve(cho_factor(matrix, check_finite=False), right, check_finite=False)


@dataclass(frozen=True)
class Point:
    """Positions and blur, and the most probable shading there.

    left: normal matrix (size, size) of the shading. by_knot (knots, terms): the shading at its knots.
    coefficients (s, terms): of each segment.
    chi2 (s,): of each segment.
    stiff (size, size): prior of the shading. robust (s,): weight of each segment.
    """

    task: ShadedSegments
    shift_px: np.ndarray
    log_blur: float
    robust: np.ndarray
    stiff: np.ndarray
    equations: SegmentEquations
    left: np.ndarray
    by_knot: np.ndarray
    coefficients: np.ndarray
    chi2: np.ndarray

    @cached_property
    def misfit(self) -> float:
        """Return all chi² by weight, and what the priors add."""
        shading = self.by_knot.ravel()
        of_shading = shading @ self.stiff @ shading
        of_blur = self.task.blur_deviation(self.log_blur) ** 2
        return float(self.robust @ self.chi2 + of_shading + of_blur)

    @classmethod
    def at(
        cls,
        task: ShadedSegments,
        shift_px: np.ndarray,
        log_blur: float,
        robust: np.ndarray,
        stiff: np.ndarray | None = None,
        equations: SegmentEquations | None = None,
    ) -> "Point":
        """Return the point at these positions and this blur.

        stiff: the shading's prior, by the contrast seen here where None. equations: where they are
        known already.
        """
        if equations is None:
            equations = SegmentEquations(
                task.pieces.moved(shift_px), float(np.exp(log_blur)), task.terms
            )
        if stiff is None:
            precision = USUAL_LIGHT.precision(task.knots, task.terms)
            stiff = precision / contrast_of(equations.pieces) ** 2
        weights = task.knot_weights
        left, right = equations.shared(weights, robust)
        left += stiff
        shared = _solve_positive(left, right)
        by_knot = shared.reshape(weights.shape[1], task.terms)
        coefficients = weights @ by_knot
        return cls(
            task=task,
            shift_px=shift_px,
            log_blur=log_blur,
            robust=robust,
            stiff=stiff,
            equations=equations,
            left=left,
            by_knot=by_knot,
            coefficients=coefficients,
            chi2=equations.chi2(coefficients),
        )

    @classmethod
    def at_common_shift(
        cls,
        task: ShadedSegments,
        shift_px: float,
        log_blur: float,
        robust: np.ndarray | None = None,
    ) -> "Point":
        """Return the point where all segments have one shift, px at their mean half-width, under
        this blur.

        robust (s,): weight of each segment; None: all count alike.
        """
        if robust is None:
            robust = np.ones(len(task.pieces))
        return cls.at(task, shift_px * task.pieces.relative_radius, log_blur, robust)

    @property
    def evidence(self) -> float:
        """Return minus twice the log evidence of positions and blur, the shading integrated out."""
        log_posterior = np.linalg.slogdet(self.left)[1]
        log_prior = np.linalg.slogdet(self.stiff)[1]
        return float(self.misfit + log_posterior - log_prior)

    def moved(self, step_px: np.ndarray, log_blur_step: float) -> "Point":
        """Return the point a step farther on, with the weights of this one."""
        shift = self.shift_px + np.clip(step_px, -LONGEST_PX, LONGEST_PX)
        return self.at(
            self.task,
            np.clip(shift, -_FARTHEST_PX, _FARTHEST_PX),
            self.log_blur + float(np.clip(log_blur_step, -_LONGEST_LOG, _LONGEST_LOG)),
            self.robust,
            self.stiff,
        )

    def weighted(self) -> "Point":
        """Return the point with the segments weighed by their misfit.

        Those well above the median hardly count. What all leave beyond noise is an error of the
        model: where that is large the priors count for as much as where noise is.
        """
        misfit = self.chi2 / self.task.pieces.freedom
        usual = max(float(np.median(misfit)), 1e-9)
        robust = 1.0 / np.maximum(misfit / usual, 1.0) ** 2 / max(usual, 1.0)
        return self.at(self.task, self.shift_px, self.log_blur, robust, equations=self.equations)


@dataclass(frozen=True)
class Step:
    """A step of positions (s,), px, and of the blur's logarithm.

    gain_shared, gain_each: by how much chi² is expected to fall by what all share, and by
    positions.
    """

    shift_px: np.ndarray
    log_blur: float
    gain_shared: float
    gain_each: float


class Arrow:
    """Normal equations at a point: a diagonal of positions, and a block of what all share.

    power, right (s,): matrix and right side of each segment's position.
    cross (s, size + 1): positions with shading and blur. shared (size + 1, size + 1): shading and blur.
    log_blur_right: right side of the blur; that of the shading is 0 at its most probable value.
    """

    def __init__(self, point: Point):
        task = point.task
        linear = point.equations.linearised(point.coefficients)
        self.point = point
        self.power = linear.power
        self.right = linear.gram[:, 0, 2]
        self.cross = positions_with_shared(linear, task.knot_weights)
        self.shared = _shared_block(point, linear)
        from_prior = task.blur_deviation(point.log_blur) / task.blur_sigma
        self.log_blur_right = point.robust @ linear.gram[:, 1, 2] - from_prior

    def step(self, damping: float) -> Step:
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
        shared = _solve_positive(left, shared_right)
        return Step(
            shift_px=(right - cross @ shared) / power,
            log_blur=float(shared[-1]),
            gain_shared=float(shared_right @ shared),
            gain_each=float(right @ (right / power)),
        )

    def solve(self, damping: float) -> SharedSolution:
        """Return the solution a step farther on, with the sensitivity of positions to what all
        share.
        """
        point = self.point
        step = self.step(damping)
        return replace(
            self.hold(),
            shift_px=point.shift_px + np.clip(step.shift_px, -LONGEST_PX, LONGEST_PX),
            blur_px=float(
                np.exp(point.log_blur + np.clip(step.log_blur, -_LONGEST_LOG, _LONGEST_LOG))
            ),
        )

    def hold(self) -> SharedSolution:
        """Return the solution at the point itself, with the sensitivity of positions to what all
        share.
        """
        point = self.point
        own = self.cross / self.power[:, None]
        left = self.shared - (point.robust[:, None] * self.cross).T @ own
        causes = Causes(np.linalg.cholesky(left))
        return SharedSolution(
            shift_px=point.shift_px,
            shared_px=causes.shifts_px(own),
            coefficients=point.coefficients,
            blur_px=float(np.exp(point.log_blur)),
            evidence=point.evidence,
            by_knot=point.by_knot,
            causes=causes,
        )


def positions_with_shared(linear: PositionEquations, knot_weights: np.ndarray) -> np.ndarray:
    """Return the normal matrix (s, size + 1) of positions with shading and, last, blur.

    knot_weights (s, knots): weight of each knot in the shading of each segment.
    """
    by_shading = knot_weights[:, :, None] * linear.rod[:, None, 0]
    by_shading = by_shading.reshape(len(by_shading), -1)
    return np.concatenate([by_shading, linear.gram[:, 0, 1:2]], axis=1)


def _shared_block(point: Point, linear: PositionEquations) -> np.ndarray:
    """Return the normal matrix (size + 1, size + 1) of shading and, last, the blur's logarithm."""
    weighted_knots = point.task.knot_weights * point.robust[:, None]
    blur_with_shading = (weighted_knots.T @ linear.rod[:, 1]).ravel()  # (size,)
    of_blur = point.robust @ linear.gram[:, 1, 1] + point.task.blur_sigma**-2.0
    size = len(blur_with_shading)
    matrix = np.empty((size + 1, size + 1))
    matrix[:size, :size] = point.left
    matrix[:size, size] = blur_with_shading
    matrix[size, :size] = blur_with_shading
    matrix[size, size] = of_blur
    return matrix
