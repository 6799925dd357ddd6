"""Coarse-to-fine search for the most probable of many hypotheses about where an object is.

A hypothesis is a row of k numbers, such as a distance along the whisker, a motor angle and a slope.
First all hypotheses of a regular grid are scored on blurred measurements, so that the true object
scores at a grid point half a step away from it. Non-maximum suppression keeps the best of them that
are no neighbours of a better one. Then a few passes follow, each on sharper measurements: every
hypothesis climbs to the best of its neighbours by ever smaller steps, and those that arrive at the
same place are suppressed. What is left is at most a handful of hypotheses, the best first. Bars,
rings, spheres and cones are all found this way: they differ in what the numbers mean and in the
score.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, ClassVar

import numpy as np

from vision.geometry.sampling import grid_points

# [steps] Most steps of a climb; it ends earlier. Study: bar_scenes.py.
_MOST_CLIMBS = 20
# [halvings] Of a climb's first step: a quarter of it is less than the lines of a bar correct.
# Study: bar_scenes.py.
_HALVINGS = 2
# [1] A step that gains no more than this score is no gain. By 1e-4 or 1e-2 a search ends
# elsewhere, and a slope moves by 1.1 or 1.4 sigma. Study: thresholds.py touched.grid_search _LEAST_GAIN ….
_LEAST_GAIN = 1e-3
# [hypotheses] That are compared with better ones at once; no result depends on it. Stated.
_AT_ONCE = 1000

Score = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class SearchPass:
    """One pass of `coarse_to_fine`.

    score: function of hypotheses (n, k) that returns their scores (n,), the higher the better.
    step_share: a climb's first step over the step of the search. separation_share: hypotheses that
    end nearer to each other than this many steps of the search count as one. kept: number of
    hypotheses that go on to the next pass.
    """

    score: Score
    step_share: float
    separation_share: float
    kept: int


def coarse_to_fine(
    values: Sequence[np.ndarray],
    steps: np.ndarray,
    passes: Sequence[SearchPass],
    separation: float,
    starts: int,
) -> np.ndarray:
    """Return the best hypotheses (n, k) after the last pass, the best first.

    values: k arrays, the grid's values of each number. steps (k,): the step of the search in each
    number; 0 holds a number at its grid values. separation: least distance between two hypotheses
    of the grid that go on, in steps. starts: number of hypotheses of the grid that go on.
    """
    grid = grid_points(*values)
    best = suppress_neighbours(grid, passes[0].score(grid), separation * steps, starts)
    for one in passes:
        tops, scores = climb(best, steps * one.step_share, one.score)
        best = suppress_neighbours(tops, scores, one.separation_share * steps, one.kept)
    return best


def half_steps(values: Sequence[np.ndarray]) -> np.ndarray:
    """Return half the distance (k,) between neighbours of each of k regular grids of values."""
    spacing = [grid[1] - grid[0] for grid in values]
    return 0.5 * np.array(spacing)


def suppress_neighbours(
    hypotheses: np.ndarray, scores: np.ndarray, separation: np.ndarray, most: int
) -> np.ndarray:
    """Return the best hypotheses without neighbours of better ones (non-maximum suppression).

    At most so many are returned. hypotheses (n, k), scores (n,). Two are neighbours where no number
    differs by more than its separation (k,).
    """
    order = np.argsort(scores)[::-1]
    chosen: list[np.ndarray] = []
    for first in range(0, len(order), _AT_ONCE):
        remaining = hypotheses[order[first : first + _AT_ONCE]]
        for better in chosen:
            remaining = _apart_from(better, remaining, separation)
        while len(remaining) and len(chosen) < most:
            chosen.append(remaining[0])
            remaining = _apart_from(remaining[0], remaining, separation)
        if len(chosen) == most:
            break
    return np.array(chosen)


def _apart_from(one: np.ndarray, others: np.ndarray, separation: np.ndarray) -> np.ndarray:
    """Return those of others (n, k) that are no neighbours of one (k,)."""
    return others[np.any(np.abs(others - one) > separation, axis=1)]


def climb(
    starts: np.ndarray, first_step: np.ndarray, score: Score
) -> tuple[np.ndarray, np.ndarray]:
    """Return the local maxima (n, k) that hypotheses (n, k) climb to, and their scores (n,).

    A neighbour differs by one step in two numbers at most. Where no neighbour is better, the step
    is halved, from first_step (k,) on.
    """
    steps = first_step * _signs_of_neighbours(len(first_step))  # (neighbours, k)
    best = starts.copy()
    highest = np.full(len(starts), -np.inf)
    step_share = np.ones(len(starts))
    for _ in range(_MOST_CLIMBS):
        going = np.flatnonzero(step_share >= 0.5**_HALVINGS)
        if not len(going):
            break
        around = best[going, None] + step_share[going, None, None] * steps  # (going, neighbours, k)
        best[going], reached = _best_of_each(around, score)
        has_gained = reached > highest[going] + _LEAST_GAIN
        step_share[going[~has_gained]] *= 0.5
        highest[going] = reached
    return best, highest


def _best_of_each(hypotheses: np.ndarray, score: Score) -> tuple[np.ndarray, np.ndarray]:
    """Return the best (n, k) of each row of hypotheses (n, m, k), and their scores (n,)."""
    count, _, k = hypotheses.shape
    scores = score(hypotheses.reshape(-1, k)).reshape(count, -1)
    chosen = np.argmax(scores, axis=1)
    rows = np.arange(count)
    return hypotheses[rows, chosen], scores[rows, chosen]


def _signs_of_neighbours(k: int) -> np.ndarray:
    """Return the steps (n, k) to neighbours, -1, 0 or 1 each, with two numbers moved at most."""
    signs = np.array(list(product((-1.0, 0.0, 1.0), repeat=k)))
    return signs[np.count_nonzero(signs, axis=1) <= 2]


@dataclass(frozen=True)
class ObjectScore(ABC):
    """Score of hypothetical objects, evaluated in batches whose arrays fit the processor's cache.

    objects_of: function of hypotheses (n, k) that returns the objects. batch: how many at a time.
    """

    objects_of: Callable[[np.ndarray], Any]

    batch: ClassVar[int]

    def __call__(self, hypotheses: np.ndarray) -> np.ndarray:
        """Return the scores (n,) of hypotheses (n, k)."""
        batches = np.array_split(hypotheses, -(-len(hypotheses) // self.batch))
        scores = [self.of_objects(self.objects_of(some)) for some in batches]
        return np.concatenate(scores)

    @abstractmethod
    def of_objects(self, objects: Any) -> np.ndarray:
        """Return the scores (n,) of a batch of objects, the higher the better."""
