"""Errors of neighbouring line points are alike: what the fit makes of them is propagated as they are."""

from dataclasses import replace

import numpy as np
import pytest

from tests.ladder.scenes import as_problem, begin, draw_scene, line_points, lumpy_noise
from vision.fit import honest, solve, weighted_jacobian
from vision.problem import WIRE_LUMP
from vision.uncertainty import uncertainty


@pytest.fixture(scope="module")
def fitted():
    """A scene whose points are exact, so that nothing is added to their sigmas but the lumps' root."""
    scene = draw_scene(0)
    problem = as_problem(scene, scene.cameras, scene.wire, scene.bar, line_points(scene))
    problem = replace(problem, onset=None)
    state, _ = solve(problem, begin(problem), scales=(1e9,) * 6)
    problem = honest(problem, state)
    state, answer = solve(problem, state, scales=(1e9,) * 4)
    return problem, state, answer


def test_lumps_spread_parameters_as_stated(fitted, rng):
    """2000 draws of lumps: each standard deviation is sampled to 1.6 %, four of which are allowed.

    Of all else that errs each row is drawn by itself.
    """
    problem, state, answer = fitted
    by_row = answer @ weighted_jacobian(problem, state).T
    draws = np.array([by_row @ _errors(problem, by_row.shape[1], rng) for _ in range(2000)])
    stated = np.sqrt(np.diag(uncertainty(problem, state, answer).noise))
    assert np.allclose(draws.std(axis=0) / stated, 1.0, atol=4 * 0.016)


def _errors(problem, count: int, rng) -> np.ndarray:
    """Errors (count,) of all rows over their sigmas, which are larger than the points' own by the lumps' root."""
    errors, end = rng.standard_normal(count), 0
    for seen in problem.seen:
        first, end = end, end + len(seen.points)
        if seen.frame >= 0:
            errors[first:end] = lumpy_noise(len(seen.points), rng) / np.sqrt(WIRE_LUMP)
    return errors


def test_what_changes_along_the_wire_is_told_better_than_each_lump_for_itself(fitted):
    """Against counting each point for a quarter: never worse but for lumps' ends, and better in bends."""
    problem, state, answer = fitted
    ratio = np.sqrt(np.diag(uncertainty(problem, state, answer).noise) / np.diag(answer))
    assert np.all(ratio < 1.01)
    assert np.median(ratio[problem.first_bend:]) < 0.98
