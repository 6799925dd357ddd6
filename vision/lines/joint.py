"""Positions of all of a rod's pieces in one camera, its shading and the lens blur, solved together.

What all pieces share, shading and blur, can stand in for a shift that they share too: taken by turns the two creep
along the valley between them, and end where they began. Here they are one damped Gauss–Newton problem. Its normal
matrix has the form of an arrow: a position for each piece, and one block of what they share, some hundred unknowns, to
which it is reduced (Schur's complement). The shading is linear, so that at each step it is the most probable one at
these positions and this blur (variable projection: Golub and Pereyra 1973, in Kaufman's form).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from vision.lines.bands import Pieces
from vision.lines.shading import LEAST_POWER, Equations, Knots, stiffness, wave_prior

BLUR_SIGMA = 0.5  # of the logarithm of the blur: pixels say much more, where they say anything
_MOST_STEPS, _LONGEST_PX, _LONGEST_LOG = 40, 0.7, 0.3
_FARTHEST_PX = 4.0  # a piece that goes farther sees something else
_DAMPED, _MOST_DAMPED = 1e-3, 1e3  # of the median piece's normal matrix: at first, and where nothing lower is found
_STIFFER, _EASIER, _UNDAMPED = 10.0, 5.0, 1e-2  # what a step makes of it; of _DAMPED, below which there is none
# What a step may still gain in chi² by what all share, which it moves by a seventh of a sigma at most, and in the mean
# by a piece's own position, which it moves by 0.03 sigma: pieces that tell nothing wander on for ever.
_SETTLED, _SETTLED_EACH = 0.02, 1e-3


@dataclass(frozen=True)
class Solved:
    """Of each piece: shift_px, own_sigma_px by its own noise, chi2 per pixel, contrast, all (s,); shared_px (s, k): by
    how much it moves with one sigma of each of k independent causes that all share; robust (s,): its weight;
    widened_px2 (s, 2): by how much its blur² is above that of all, and sigma."""

    shift_px: np.ndarray
    own_sigma_px: np.ndarray
    chi2: np.ndarray
    contrast: np.ndarray
    shared_px: np.ndarray
    blur_px: float
    robust: np.ndarray
    widened_px2: np.ndarray


@dataclass(frozen=True)
class Task:
    """What is to be explained: pieces, by so many waves at these knots, and a belief about the lens blur."""

    pieces: Pieces
    terms: int
    knots: Knots
    blur_px: float
    blur_sigma: float = BLUR_SIGMA


def solve_jointly(task: Task, shift_px: np.ndarray | None = None, robust: np.ndarray | None = None,
                  damped: float = _DAMPED, most: int = _MOST_STEPS) -> Solved:
    """The most probable positions, shading and blur; begins with these shifts (s,) and weights (s,) of the pieces.

    The last step is taken without looking again: what is told of the pieces is as it was before it.
    """
    count = len(task.pieces)
    here = _Point.at(task, np.zeros(count) if shift_px is None else shift_px, np.log(task.blur_px),
                     np.ones(count) if robust is None else robust)
    here = here.weighted()
    arrow = _Arrow(task, here)
    for _ in range(most):
        step, by_blur, gain = arrow.step(damped)
        if gain[0] < _SETTLED and gain[1] < _SETTLED_EACH * count:
            break
        there = here.moved(step, by_blur)
        if there.misfit > here.misfit:
            damped = max(_STIFFER * damped, _DAMPED)
            if damped > _MOST_DAMPED:
                break
            continue
        damped = damped / _EASIER if damped > _UNDAMPED * _DAMPED else 0.0
        here = there.weighted()
        arrow = _Arrow(task, here)
    return arrow.solved(damped)


@dataclass(frozen=True)
class _Point:
    """Positions and blur, and the most probable shading there: normal matrix left and coefficients shared (size,), of
    each piece waves (s, terms), its chi2 (s,); misfit: all chi² by weight, and what the priors add."""

    task: Task
    shift_px: np.ndarray
    log_blur: float
    robust: np.ndarray
    stiff: np.ndarray
    equations: Equations
    left: np.ndarray
    waves: np.ndarray
    chi2: np.ndarray
    misfit: float

    @classmethod
    def at(cls, task: Task, shift_px, log_blur: float, robust, stiff=None, equations=None) -> "_Point":
        """stiff: the shading's prior, by the contrast seen here where None."""
        if equations is None:
            equations = Equations(task.pieces.moved(shift_px), float(np.exp(log_blur)), task.terms)
        if stiff is None:
            stiff = stiffness(wave_prior(equations.pieces, task.terms), task.knots)
        hats = task.knots.weights(task.pieces)
        left, right = equations.shared(hats, robust)
        left += stiff
        shared = cho_solve(cho_factor(left, check_finite=False), right, check_finite=False)
        waves = hats @ shared.reshape(hats.shape[1], task.terms)
        chi2 = equations.chi2(waves)
        off = (log_blur - np.log(task.blur_px)) / task.blur_sigma
        misfit = float(robust @ chi2 + shared @ stiff @ shared + off**2)
        return cls(task, shift_px, log_blur, robust, stiff, equations, left, waves, chi2, misfit)

    def moved(self, step_px, by_blur: float) -> "_Point":
        """The point a step farther on, weighed as here."""
        shift = self.shift_px + np.clip(step_px, -_LONGEST_PX, _LONGEST_PX)
        return self.at(self.task, np.clip(shift, -_FARTHEST_PX, _FARTHEST_PX),
                       self.log_blur + float(np.clip(by_blur, -_LONGEST_LOG, _LONGEST_LOG)), self.robust, self.stiff)

    def weighted(self) -> "_Point":
        """The same point, pieces weighed by what they leave, and light by the contrast that is seen here.

        What all leave beyond noise is an error of the model: beside it the priors count as much as beside noise.
        """
        misfit = self.chi2 / self.task.pieces.freedom
        usual = max(float(np.median(misfit)), 1e-9)
        robust = 1.0 / np.maximum(misfit / usual, 1.0) ** 2 / max(usual, 1.0)  # well above the median: left out
        return self.at(self.task, self.shift_px, self.log_blur, robust, equations=self.equations)


class _Arrow:
    """The normal equations at a point: power, right (s,) of each piece's position, cross (s, size + 1) of these with
    what is shared, its own matrix (size + 1, size + 1), and by_blur: the right side of its last row; others are 0."""

    def __init__(self, task: Task, point: _Point):
        self.point, self.slopes = point, point.equations.linearised(point.waves)
        hats, slopes, size = task.knots.weights(task.pieces), self.slopes, len(point.left)
        self.power, self.right = np.maximum(slopes.gram[:, 0, 0], LEAST_POWER), slopes.gram[:, 0, 2]
        by_waves = (hats[:, :, None] * slopes.rod[:, None, 0]).reshape(len(hats), size)
        self.cross = np.concatenate([by_waves, slopes.gram[:, 0, 1:2]], axis=1)
        self.shared = np.zeros((size + 1, size + 1))
        self.shared[:size, :size] = point.left
        self.shared[:size, size] = self.shared[size, :size] = ((hats * point.robust[:, None]).T
                                                               @ slopes.rod[:, 1]).ravel()
        self.shared[size, size] = point.robust @ slopes.gram[:, 1, 1] + task.blur_sigma**-2.0
        self.by_blur = (point.robust @ slopes.gram[:, 1, 2]
                        - (point.log_blur - np.log(task.blur_px)) / task.blur_sigma**2)

    def step(self, damped: float) -> tuple[np.ndarray, float, tuple[float, float]]:
        """Steps of the positions (s,) and of the blur's logarithm, and by how much chi² is expected to fall, by what
        all share and by positions alone."""
        robust = self.point.robust
        power = robust * self.power
        power = power + damped * np.median(power) + LEAST_POWER
        cross, right = robust[:, None] * self.cross, robust * self.right
        own = cross / power[:, None]
        left, shared_right = self.shared - cross.T @ own, -own.T @ right
        left[-1, -1] += damped * self.shared[-1, -1]
        shared_right[-1] += self.by_blur
        shared = cho_solve(cho_factor(left, check_finite=False), shared_right, check_finite=False)
        step = (right - cross @ shared) / power
        return step, float(shared[-1]), (float(shared_right @ shared), float(right @ (right / power)))

    def solved(self, damped: float) -> Solved:
        """A step farther on, with covariance: each piece's own, and what all move by with what they share."""
        point, (step, by_blur, _) = self.point, self.step(damped)
        own = self.cross / self.power[:, None]
        left = self.shared - (point.robust[:, None] * self.cross).T @ own
        chi2 = point.chi2 / point.task.pieces.freedom
        shared = np.linalg.solve(np.linalg.cholesky(left), own.T).T
        return Solved(point.shift_px + np.clip(step, -_LONGEST_PX, _LONGEST_PX),
                      np.sqrt(np.maximum(chi2, 1.0) / self.power), chi2, self.slopes.contrast, shared,
                      float(np.exp(point.log_blur + np.clip(by_blur, -_LONGEST_LOG, _LONGEST_LOG))), point.robust,
                      self._widened(np.maximum(chi2, 1.0)))

    def _widened(self, chi2) -> np.ndarray:
        """By how much each piece's own blur² is above that of all, and sigma, (s, 2), its position free as well."""
        gram = self.slopes.gram
        power = gram[:, 1, 1] - gram[:, 0, 1] ** 2 / self.power + LEAST_POWER
        by_log = 2.0 * np.exp(2.0 * self.point.log_blur)
        step = (gram[:, 1, 2] - gram[:, 0, 1] * gram[:, 0, 2] / self.power) / power
        return by_log * np.stack([step, np.sqrt(chi2 / power)], axis=1)
