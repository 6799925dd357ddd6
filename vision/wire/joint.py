"""Positions of all of a rod's pieces in one camera, its shading and the lens blur, solved together.

What all pieces share, shading and blur, can stand in for a shift that they share too: taken by turns the two creep
along the valley between them, and end where they began. Here they are one damped Gauss–Newton problem. Its normal
matrix has the form of an arrow: a position for each piece, and one block of what they share, some hundred unknowns, to
which it is reduced (Schur's complement). The shading is linear, so that at each step it is the most probable one at
these positions and this blur (variable projection: Golub and Pereyra 1973, in Kaufman's form).

What all share has two snares. A shift of all pieces to one side, under another blur and shading, can be a minimum of
its own, or as good as the best: several starts are followed, and the sigma of such a shift holds all that are probable
(`common_shift.py`). And no model of light is right to a hundredth of the contrast, by the same in all pieces:
what is shared is found with pixels weighed by no more than that leaves them.
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

# [1] Of the logarithm of the blur about `_BLUR_PX`: a lens in focus, 0.5 to 1.3 px with the
# pixel's own width; pixels that say otherwise overrule it. Study: wire_scenes.py.
# of the logarithm of the blur: a lens in focus, 0.5 to 1.3 px with the pixel's own width
BLUR_SIGMA = 0.25
# [1, px] Of the contrast: by so much a model of light is off at one distance from the axis, in
# all pieces alike. In 65 views of 30 path-traced scenes common offsets are 0.17 px RMS and 1.3
# sigma; with 0.003 0.19 and 1.4, with 0.0015 0.24 and 1.7, with 0.03 0.26 and 1.7. The second is
# the first look's bin. Study: wire_scenes.py.
_MODEL_SHARE, _ALIKE_PX = 0.006, 0.3
# [px, sigma] Common shifts and blurs to begin with: minima lie 0.5 to 1 px apart. Set by eye.
# Study: wire_scenes.py.
_SHIFTS_PX, _BLUR_SIGMAS = (
    np.linspace(-1.5, 1.5, 7),
    (-1.2, 0.2, 1.6),
)
# [pieces, starts, px] Starts are weighed by so many pieces; so many are followed, no two so near.
# With 100 pieces one view of 65 ended 0.8 px off. Study: wire_scenes.py.
_STARTS_BY, _MOST_STARTS, _APART_PX = 300, 3, 0.3
# [pieces] That tell how probable a common shift is: pixels at one distance tell no more together
# than the model does. Set by eye. Study: wire_scenes.py.
_TOLD_BY = 120
# [steps, 1] 4 to 10 are taken; the blur's step. Set by eye. Study: starts.py.
_MOST_STEPS, _LONGEST_LOG = 40, 0.3
# [px] A piece that goes farther sees something else. Set by eye. Study: starts.py.
_FARTHEST_PX = 4.0
# [1] Of the median piece's normal matrix: 1e-6 to 1e-2 take 4 to 10 steps alike. Study:
# starts.py.
_DAMPED, _MOST_DAMPED = 1e-3, 1e3
# [1] What a step that does not help, or does, makes of the damping; below so much of `_DAMPED`
# there is none. The solution does not hang on them. Derived.
_STIFFER, _EASIER, _UNDAMPED = 10.0, 5.0, 1e-2
# [chi²] What a step may still gain by what all share, which it moves by a seventh of a sigma at
# most, and in the mean by a piece's own position: 0.03 sigma. Study: starts.py.
_SETTLED, _SETTLED_EACH = 0.02, 1e-3
# [1] Times as much, of a start's descent, from whose end another begins: half a sigma by what all
# share. With the looser end d_x, touch, slope and slip move by 0.006 sigma at most in twelve
# scenes. Not measured by a script.
_ROUGHLY = 25.0


@dataclass(frozen=True)
class Shared:
    """What all pieces share, and where they lie by it: shift_px (s,); shared_px (s, k): by how much each moves with one
    sigma of each of k independent causes that all share; waves (s, terms): its shading; blur_px; doubt: minus twice the
    log evidence of positions and blur, the shading integrated out."""

    shift_px: np.ndarray
    shared_px: np.ndarray
    waves: np.ndarray
    blur_px: float
    doubt: float


@dataclass(frozen=True)
class Solved(Shared):
    """And of each piece by itself: own_sigma_px by its own noise, chi2 per pixel, contrast, all (s,); widened_px2
    (s, 2): by how much its blur² is above that of all, and sigma."""

    own_sigma_px: np.ndarray
    chi2: np.ndarray
    contrast: np.ndarray
    widened_px2: np.ndarray


@dataclass(frozen=True)
class Task:
    """What is to be explained: pieces, by so many waves at these knots, and a belief about the lens blur.

    seen_blur_px: what the blur was in an earlier look, which told where the pieces are expected.
    """

    pieces: Pieces
    terms: int
    knots: Knots
    blur_px: float
    blur_sigma: float = BLUR_SIGMA
    seen_blur_px: float | None = None

    @cached_property
    def hats(self) -> np.ndarray:
        """How much each knot has in the shading of each piece, (s, knots)."""
        return self.knots.weights(self.pieces)

    def of(self, some: slice) -> "Task":
        """The same of some of the pieces."""
        return replace(self, pieces=self.pieces.select(some))

    def tempered(self) -> "Task":
        """The same with pixels as many of which, at one distance from the axis, tell no more than the model is good."""
        pieces = self.pieces
        share = _MODEL_SHARE * contrast_of(pieces)
        bins = np.floor(pieces.offset_px / _ALIKE_PX).astype(int)
        bins -= bins.min(initial=0)
        total = np.bincount(bins.ravel(), np.ravel(pieces.weight**2))
        return replace(
            self,
            pieces=replace(pieces, weight=pieces.weight / np.sqrt(1.0 + total[bins] * share**2)),
        )


def solve_jointly(task: Task, *, last: bool = True) -> Solved:
    """The most probable positions, shading and blur of pieces that lie where they are expected, or, before an earlier
    look, all to one side.

    Unless this is the last look, other common shifts that are as probable are not asked for.
    """
    tempered = task.tempered()
    shared = _descend(_begin(tempered, *_start(task)).weighted())
    return settled(task, _with_all_shifts(tempered, shared) if last else shared)


def _with_all_shifts(task: Task, shared: Shared) -> Shared:
    """The same with a sigma for its shift as a whole that holds all shifts that are probable."""
    here = _Point.at(
        task, shared.shift_px, np.log(shared.blur_px), np.ones(len(task.pieces))
    ).weighted()
    some = slice(None, None, 1 + len(task.pieces) // _TOLD_BY)
    spread_px = common_spread_px(
        here.equations.pieces.select(some),
        shared.blur_px,
        task.terms,
        task.knots,
        here.robust[some],
        (task.blur_px, task.blur_sigma),
    )
    bent = shared.shared_px - np.average(shared.shared_px, axis=0, weights=here.robust)
    return replace(
        shared, shared_px=np.concatenate([bent, np.full((len(bent), 1), spread_px)], axis=1)
    )


def settled(task: Task, shared: Shared) -> Solved:
    """Each piece's own position by all that its pixels tell, with what all share known: their mean stays."""
    here = Equations(task.pieces.moved(shared.shift_px), shared.blur_px, task.terms)
    slopes, chi2 = here.linearised(shared.waves), here.chi2(shared.waves) / task.pieces.freedom
    share = slopes.power / np.maximum(chi2 / max(float(np.median(chi2)), 1e-9), 1.0) ** 2
    shift = shared.shift_px + slopes.step_px - np.average(slopes.step_px, weights=share)
    return Solved(
        shift,
        shared.shared_px,
        shared.waves,
        shared.blur_px,
        shared.doubt,
        slopes.own_sigma_px(chi2),
        chi2,
        slopes.contrast,
        _widened(slopes, shared.blur_px, np.maximum(chi2, 1.0)),
    )


def _start(task: Task) -> tuple[float, float]:
    """Common shift and logarithm of the blur: of an earlier look, or of the most probable end of several descents."""
    if task.seen_blur_px is not None:
        return 0.0, float(np.log(task.seen_blur_px))
    task = task.of(slice(None, None, 1 + len(task.pieces) // _STARTS_BY)).tempered()
    log_blurs = np.log(task.blur_px) + task.blur_sigma * np.array(_BLUR_SIGMAS)
    doubts = exactly_if_needed(lambda each_pixel: _doubts_of_starts(task, log_blurs, each_pixel))
    ranked = np.unravel_index(np.argsort(doubts, axis=None), doubts.shape)
    begins = list(zip(_SHIFTS_PX[ranked[0]].tolist(), log_blurs[ranked[1]].tolist()))
    robust, chosen = _begin(task, *begins[0]).weighted().robust, []
    for one in begins:
        if all(abs(one[0] - other[0]) > _APART_PX for other in chosen):
            chosen.append(one)
    ends = (_descend(_begin(task, *one, robust), _ROUGHLY) for one in chosen[:_MOST_STARTS])
    best = min(ends, key=lambda one: one.doubt)
    return float(np.median(best.shift_px)), float(np.log(best.blur_px))


def _doubts_of_starts(task: Task, log_blurs: np.ndarray, each_pixel: bool) -> np.ndarray:
    """Minus twice the log evidence (m, b) of all pieces moved by each of _SHIFTS_PX, at these blurs; see
    `_Point.doubt`."""
    pieces, every = task.pieces, np.ones(len(task.pieces))
    models = [(1.0, float(blur)) for blur in np.exp(log_blurs)]
    gathered = GatheredEquations(pieces, task.hats, every, each_pixel=each_pixel)
    left, right, power = gathered.normal(_SHIFTS_PX, models, task.terms)
    doubts = power + ((log_blurs - np.log(task.blur_px)) / task.blur_sigma) ** 2
    for k, shift in enumerate(_SHIFTS_PX):
        stiff = stiffness(wave_prior(pieces.moved(shift * every), task.terms), task.knots)
        doubts[k] -= np.linalg.slogdet(stiff)[1]
        for b in range(len(log_blurs)):
            factor = cho_factor(left[k, b] + stiff, check_finite=False)
            doubts[k, b] += 2.0 * np.sum(np.log(np.diag(factor[0])))
            doubts[k, b] -= right[k, b] @ cho_solve(factor, right[k, b], check_finite=False)
    return doubts


def _begin(
    task: Task, shift_px: float, log_blur: float, robust: np.ndarray | None = None
) -> "_Point":
    every = np.ones(len(task.pieces))
    return _Point.at(task, shift_px * every, log_blur, every if robust is None else robust)


def _descend(here: "_Point", roughly: float = 1.0) -> Shared:
    """Downhill from a point, the pieces weighed as there: weighed anew at each step, those that a shift spoils would
    count ever less.

    The last step is taken without looking again: what is told of the pieces is as it was before it.
    """
    arrow, damped = _Arrow(here), _DAMPED
    for _ in range(_MOST_STEPS):
        step, by_blur, gain = arrow.step(damped)
        if gain[0] < roughly * _SETTLED and gain[1] < roughly * _SETTLED_EACH * len(here.shift_px):
            break
        there = here.moved(step, by_blur)
        if there.misfit > here.misfit:
            damped = max(_STIFFER * damped, _DAMPED)
            if damped > _MOST_DAMPED:
                break
            continue
        damped = damped / _EASIER if damped > _UNDAMPED * _DAMPED else 0.0
        here = there
        arrow = _Arrow(here)
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
    def at(
        cls, task: Task, shift_px, log_blur: float, robust, stiff=None, equations=None
    ) -> "_Point":
        """stiff: the shading's prior, by the contrast seen here where None."""
        if equations is None:
            equations = Equations(task.pieces.moved(shift_px), float(np.exp(log_blur)), task.terms)
        if stiff is None:
            stiff = stiffness(wave_prior(equations.pieces, task.terms), task.knots)
        hats = task.hats
        left, right = equations.shared(hats, robust)
        left += stiff
        shared = cho_solve(cho_factor(left, check_finite=False), right, check_finite=False)
        waves = hats @ shared.reshape(hats.shape[1], task.terms)
        chi2 = equations.chi2(waves)
        off = (log_blur - np.log(task.blur_px)) / task.blur_sigma
        misfit = float(robust @ chi2 + shared @ stiff @ shared + off**2)
        return cls(task, shift_px, log_blur, robust, stiff, equations, left, waves, chi2, misfit)

    @property
    def doubt(self) -> float:
        """Minus twice the log evidence of positions and blur, the shading integrated out."""
        return float(
            self.misfit + np.linalg.slogdet(self.left)[1] - np.linalg.slogdet(self.stiff)[1]
        )

    def moved(self, step_px, by_blur: float) -> "_Point":
        """The point a step farther on, weighed as here."""
        shift = self.shift_px + np.clip(step_px, -LONGEST_PX, LONGEST_PX)
        return self.at(
            self.task,
            np.clip(shift, -_FARTHEST_PX, _FARTHEST_PX),
            self.log_blur + float(np.clip(by_blur, -_LONGEST_LOG, _LONGEST_LOG)),
            self.robust,
            self.stiff,
        )

    def weighted(self) -> "_Point":
        """The same point, pieces weighed by what they leave.

        What all leave beyond noise is an error of the model: beside it the priors count as much as beside noise.
        """
        misfit = self.chi2 / self.task.pieces.freedom
        usual = max(float(np.median(misfit)), 1e-9)
        robust = (
            1.0 / np.maximum(misfit / usual, 1.0) ** 2 / max(usual, 1.0)
        )  # well above the median: left out
        return self.at(self.task, self.shift_px, self.log_blur, robust, equations=self.equations)


class _Arrow:
    """The normal equations at a point: power, right (s,) of each piece's position, cross (s, size + 1) of these with
    what is shared, its own matrix (size + 1, size + 1), and by_blur: the right side of its last row; others are 0."""

    def __init__(self, point: _Point):
        task = point.task
        self.point, self.slopes = point, point.equations.linearised(point.waves)
        hats, slopes, size = task.hats, self.slopes, len(point.left)
        self.power, self.right = slopes.power, slopes.gram[:, 0, 2]
        by_waves = (hats[:, :, None] * slopes.rod[:, None, 0]).reshape(len(hats), size)
        self.cross = np.concatenate([by_waves, slopes.gram[:, 0, 1:2]], axis=1)
        self.shared = np.zeros((size + 1, size + 1))
        self.shared[:size, :size] = point.left
        self.shared[:size, size] = self.shared[size, :size] = (
            (hats * point.robust[:, None]).T @ slopes.rod[:, 1]
        ).ravel()
        self.shared[size, size] = point.robust @ slopes.gram[:, 1, 1] + task.blur_sigma**-2.0
        self.by_blur = (
            point.robust @ slopes.gram[:, 1, 2]
            - (point.log_blur - np.log(task.blur_px)) / task.blur_sigma**2
        )

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
        return (
            step,
            float(shared[-1]),
            (float(shared_right @ shared), float(right @ (right / power))),
        )

    def solved(self, damped: float) -> Shared:
        """A step farther on, with what all move by with what they share."""
        point, (step, by_blur, _) = self.point, self.step(damped)
        own = self.cross / self.power[:, None]
        left = self.shared - (point.robust[:, None] * self.cross).T @ own
        shared = np.linalg.solve(np.linalg.cholesky(left), own.T).T
        blur_px = float(np.exp(point.log_blur + np.clip(by_blur, -_LONGEST_LOG, _LONGEST_LOG)))
        shift_px = point.shift_px + np.clip(step, -LONGEST_PX, LONGEST_PX)
        return Shared(shift_px, shared, point.waves, blur_px, point.doubt)


def _widened(slopes: PositionEquations, blur_px: float, chi2) -> np.ndarray:
    """By how much each piece's own blur² is above that of all, and sigma, (s, 2), its position free as well."""
    gram, power = slopes.gram, slopes.power
    own = gram[:, 1, 1] - gram[:, 0, 1] ** 2 / power + LEAST_POWER
    step = (gram[:, 1, 2] - gram[:, 0, 1] * gram[:, 0, 2] / power) / own
    return 2.0 * blur_px**2 * np.stack([step, np.sqrt(chi2 / own)], axis=1)
