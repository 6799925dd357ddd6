"""Are the fit's derivatives those of its residuals and of what it reports? Central differences over drawn scenes.

    python tests/studies/accuracy/gradients.py --count 10

Three families: residuals by parameters (`linearise`), quantities by parameters (`jacobians`, by which uncertainty goes
from the fit to d_x and slip), residuals by the cameras' parameters (the calibration's share). Each is taken at a state
off the solution. Prints the largest difference in parts of its column's largest value.
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.studies.accuracy.scenes import Scene, as_problem, begin, draw_scene, line_points
from vision.fit.converged_fit import ConvergedFit
from vision.fit.problem import Problem, State
from vision.fit.quantities import jacobians, measure
from vision.fit.solve import linearise, solve

# Steps of about 1e-4 px: rounding leaves 1e-8 of the residual, curvature 1e-6.
_TILT, _BEND, _LENGTH = 1e-6, 1e-5, 1e-4


def off_solution(scene: Scene) -> tuple[Problem, State]:
    """A problem with noisy points and a state near its solution, the contacts settled to where they stay."""
    rng = np.random.default_rng([scene.seed, 26])
    problem = as_problem(scene, scene.cameras, scene.wire, scene.bar, line_points(scene, rng))
    state, _ = solve(problem, begin(problem), scales=(1e9,) * 6)
    state = State(state.vector + 1e-4 * rng.standard_normal(problem.size), state.arcs_mm)
    for _ in range(20):
        _, state = linearise(problem, state)
    return problem, state


def _steps(problem: Problem) -> np.ndarray:
    step = np.full(problem.size, _LENGTH)
    step[2:4], step[problem.first_bend :] = _TILT, _BEND
    return step


def _central(
    function: Callable[[np.ndarray], np.ndarray], at: np.ndarray, step: np.ndarray
) -> np.ndarray:
    """Derivatives (n, p) of a function (n,) by central differences."""
    moves = np.diag(step)
    return np.stack(
        [(function(at + m) - function(at - m)) / (2 * h) for m, h in zip(moves, step)], axis=1
    )


def _difference(given: np.ndarray, found: np.ndarray) -> float:
    """Largest difference in parts of each column's largest value; columns of zeros count as themselves."""
    largest = np.max(np.abs(found), axis=0)
    return float(np.max(np.abs(given - found) / np.where(largest > 0, largest, 1.0)))


def of_residuals(problem: Problem, state: State) -> float:
    """Residuals by parameters."""
    residual = lambda v: linearise(problem, replace(state, vector=v))[0].residual  # noqa: E731
    return _difference(
        linearise(problem, state)[0].jacobian, _central(residual, state.vector, _steps(problem))
    )


def of_quantities(problem: Problem, state: State) -> float:
    """Everything that is reported of a whisk and of its touching frames, by parameters."""
    _, given = jacobians(problem, state)

    def values(vector):
        here = measure(problem, vector, state.arcs_mm)
        return np.concatenate(
            [
                *(np.atleast_1d(v) for v in here.whisk.values()),
                *(v[problem.touching] for v in here.frame.values()),
            ]
        )

    rows = np.concatenate(
        [
            *(j[None] for j in given.whisk.values()),
            *(j[problem.touching] for j in given.frame.values()),
        ]
    )
    found = _central(values, state.vector, _steps(problem))
    return _difference(rows.T, found.T)


def of_cameras(problem: Problem, state: State) -> float:
    """Residuals of line points by the cameras' parameters."""
    sizes = np.tile(
        [0.1, 0.1, 0.1, 0.1, *[1e-4] * 5, *[1e-6] * 3, *[1e-3] * 3], len(problem.cameras)
    )

    def residual(step):
        linear, _ = linearise(replace(problem, cameras=problem.cameras.moved(step)), state)
        return linear.residual[linear.is_point]

    return _difference(
        ConvergedFit(problem, state).by_camera, _central(residual, np.zeros(len(sizes)), sizes)
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=10)
    cases = [off_solution(draw_scene(seed)) for seed in range(parser.parse_args().count)]
    for name, of in (
        ("residuals", of_residuals),
        ("quantities", of_quantities),
        ("cameras", of_cameras),
    ):
        print(
            f"{name:10s} largest difference {max(of(*case) for case in cases):.1e} of the column's largest value"
        )


if __name__ == "__main__":
    main()
