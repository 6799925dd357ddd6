"""Errors of neighbouring line points are alike: by how much is measured, and what the fit makes of them propagated."""

from dataclasses import replace

import numpy as np
import pytest

from tests.studies.accuracy.scenes import (
    GROUP,
    as_problem,
    begin,
    correlated_noise,
    draw_scene,
    line_points,
)
from vision.fit.converged_fit import ConvergedFit
from vision.fit.scatter import inflated_by_residuals
from vision.fit.solve import solve

ALIKE = 0.6  # with the next point, 0.36 with the one after …: (1 + 0.6)/(1 - 0.6) times the variance of a mean


@pytest.fixture(scope="module")
def fitted():
    """A scene of exact points whose neighbours are said to err alike."""
    scene = draw_scene(0)
    problem = as_problem(scene, scene.cameras, scene.wire, scene.bar, line_points(scene))
    problem = replace(problem, neighbour_correlation=[ALIKE] * len(scene.cameras))
    state, _ = solve(problem, begin(problem), scales=(1e9,) * 8)
    return ConvergedFit(problem, state)


def test_what_neighbours_share_spreads_parameters_as_stated(fitted, rng):
    """2000 draws of such errors: each standard deviation is sampled to 1.6 %, four of which are allowed, and 1 % for
    the ends of a line, where nobody shares from beyond.

    Of all else that errs each row is drawn by itself.
    """
    by_row = fitted.inverse_normal @ fitted.weighted.jacobian.T
    draws = np.array([by_row @ _errors(fitted.problem, by_row.shape[1], rng) for _ in range(2000)])
    stated = np.sqrt(np.diag(fitted.noise_covariance))
    assert np.allclose(draws.std(axis=0) / stated, 1.0, atol=4 * 0.016 + 0.01)


def _errors(problem, count: int, rng) -> np.ndarray:
    """Errors (count,) of all rows over their sigmas, which are wider by as much as what is shared makes of a mean."""
    errors, end = rng.standard_normal(count), 0
    for seen in problem.seen:
        first, end = end, end + len(seen.points)
        if seen.frame >= 0:
            for k in range(first + 1, end):
                errors[k] = ALIKE * errors[k - 1] + np.sqrt(1.0 - ALIKE**2) * errors[k]
            errors[first:end] /= np.sqrt((1.0 + ALIKE) / (1.0 - ALIKE))
    return errors


def test_what_changes_along_the_wire_is_told_better(fitted):
    """Than were each point as uncertain by itself as what it shares makes a mean; in the bends most of all."""
    ratio = np.sqrt(np.diag(fitted.noise_covariance) / np.diag(fitted.inverse_normal))
    assert np.all(ratio < 1.01)
    assert np.median(ratio[fitted.problem.first_bend :]) < 0.98


@pytest.mark.parametrize("group", [1, GROUP])
def test_what_neighbours_share_is_measured(group):
    """Groups of four with one error make the variance of a mean four times as large; the fit hides a fifth of it.

    Ten frames of some thirty points tell each correlation to 0.06, and a sum of those above 0.05 to 0.3 or so.
    """
    scene = draw_scene(0)
    rng = np.random.default_rng(3)
    exact = as_problem(scene, scene.cameras, scene.wire, scene.bar, line_points(scene))
    problem = replace(
        exact,
        seen=[_with_noise(seen, group, rng) if seen.frame >= 0 else seen for seen in exact.seen],
    )
    state, _ = solve(problem, begin(problem), scales=(1e9,) * 8)
    wider = [
        (1.0 + alike) / (1.0 - alike)
        for alike in inflated_by_residuals(problem, state).neighbour_correlation
    ]
    assert np.mean(wider) == pytest.approx(
        {1: 1.0, GROUP: 0.8 * GROUP}[group], abs={1: 0.3, GROUP: 0.8}[group]
    )


def _with_noise(seen, group: int, rng):
    points = seen.points
    off = correlated_noise(len(points), rng) if group == GROUP else rng.standard_normal(len(points))
    return replace(
        seen,
        points=replace(points, px=points.px + (points.sigma_px * off)[:, None] * points.normal),
    )
