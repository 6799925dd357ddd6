"""What the fit makes of line points without noise: its own model's, and those of the rig's exact mechanics.

    python tests/studies/accuracy/exactness.py --count 20

First line: line points projected from the fit's own model, fitted from scratch; the whisker is straight at rest, since
the prior of the rest shape and that of the lines' offsets share what no picture tells, and so pull at any other.
Further lines: line points of exact mechanics (large bending, exact friction, sag and set of the wire), exact cameras
and diameters, weighed as on a trial; what is left is the model's error, against the largest pushing angle.
"""

import argparse
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.rig.protocol_tables import MotorTable, PicturesTable, WhiskerTable
from tests.scenes.model_scenes import bar_middle
from tests.studies.accuracy.scenes import (
    STEP_DEG,
    Scene,
    Sigmas,
    as_problem,
    begin,
    draw_scene,
    line_points,
)
from vision.fit.problem import Problem, State, curves_of
from vision.fit.quantities import Measured, measure
from vision.fit.solve import solve
from vision.geometry.centreline import Curves
from vision.geometry.polyline import normals
from vision.wire.points import LinePoints, Observed

QUANTITIES = ("d_x_mm", "touch_mm", "slip_mm", "beta_deg")
# Points so loose that touching frames come to lie on the bar (sigma 0.002 mm, 0.01 px) to 1e-6 of what they were off …
LOOSE_SIGMA_PX = 10.0
# … and so sure that no prior moves them.
OWN_SIGMA_PX = 1e-4
# The fit ends early only at its last scale: all of these are gone through.
ROUNDS = (1e9,) * 20 + (2e9,)
EXACT = Sigmas(wire_diameter_mm=0.0, bar_diameter_mm=0.0)


def exact_problem(scene: Scene) -> Problem:
    """The scene's problem with nothing wrong in it."""
    return as_problem(scene, scene.cameras, scene.wire, scene.bar, line_points(scene))


def own_points(problem: Problem, state: State, sigma_px: float) -> Problem:
    """The problem with its line points where the fit's own model has them."""
    arcs_mm = state.arcs_mm
    for _ in range(8):
        curves, arcs_mm = curves_of(problem, state.vector, arcs_mm)
    return replace(
        problem, seen=[_own(problem, state, curves, seen, sigma_px) for seen in problem.seen]
    )


def _own(
    problem: Problem, state: State, curves: Curves, seen: Observed, sigma_px: float
) -> Observed:
    camera, place = problem.cameras.cameras[seen.camera], seen.points.place
    if seen.frame < 0:
        px = bar_middle(problem, camera, state.vector, place)
    else:
        one = Curves(curves.arc_mm, curves.points_mm[seen.frame], curves.tangents[seen.frame])
        px = camera.project(one.at(place)[0])
    return replace(seen, points=LinePoints(px, normals(px), np.full(len(px), sigma_px), place))


def own_errors(scene: Scene) -> dict[str, float]:
    """Errors of the fit to its own model's points, by quantity."""
    problem = exact_problem(scene)
    near, _ = solve(problem, begin(problem), scales=ROUNDS[:8])
    vector = near.vector.copy()
    vector[problem.blocks.rest_shape.start : problem.first_bend] = (
        0.0  # straight at rest, no line off as a whole
    )
    loose = own_points(problem, State(vector, near.arcs_mm), LOOSE_SIGMA_PX)
    true, _ = solve(loose, State(vector, near.arcs_mm), scales=ROUNDS)
    problem = own_points(problem, true, OWN_SIGMA_PX)
    found, _ = solve(problem, begin(problem), scales=ROUNDS)
    here, there = (measure(problem, s.vector, s.arcs_mm) for s in (found, true))
    return _errors(problem, here, there.whisk, there.frame["slip"])


def model_errors(scene: Scene) -> dict[str, float]:
    """Errors of the fit to points of exact mechanics, by quantity."""
    problem, truth = exact_problem(scene), scene.truth
    found, _ = solve(problem, begin(problem), scales=ROUNDS[:10])
    here = measure(problem, found.vector, found.arcs_mm)
    return _errors(
        problem, here, {"d_x": truth.d_x, "touch": truth.touch, "beta": truth.beta}, truth.slip
    )


def _errors(problem: Problem, here: Measured, whisk, slip_mm) -> dict[str, float]:
    off = {name: float(here.whisk[name] - whisk[name]) for name in ("d_x", "touch", "beta")}
    slip = (here.frame["slip"] - slip_mm)[problem.touching]
    return {
        "d_x_mm": off["d_x"],
        "touch_mm": off["touch"] * float(whisk["d_x"]),
        "slip_mm": float(slip[np.argmax(np.abs(slip))]),
        "beta_deg": float(np.degrees(off["beta"])),
    }


def scenes(count: int, pushed_deg: float = 4.0, **tables) -> Iterable[Scene]:
    """Drawn scenes whose whisks push so far; tables: of the protocol, instead of drawn ones."""
    motor = MotorTable(after_deg=pushed_deg + 0.1)
    pictures = PicturesTable(after_deg=pushed_deg, step_deg=max(STEP_DEG, pushed_deg / 8))
    return (
        draw_scene(seed, sigmas=EXACT, motor=motor, pictures=pictures, **tables)
        for seed in range(count)
    )


def table(errors: Iterable[dict[str, float]]) -> str:
    """Largest size and root mean square of each quantity's error, one line."""
    rows = list(errors)
    columns = {name: np.array([row[name] for row in rows]) for name in QUANTITIES}
    return "; ".join(
        f"{name} {np.abs(v).max():.1e} (RMS {np.sqrt(np.mean(v**2)):.1e})"
        for name, v in columns.items()
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=20)
    count = parser.parse_args().count
    print(f"{count} scenes; largest error (and RMS)")
    print("own model:              ", table(map(own_errors, scenes(count, whisker=WhiskerTable()))))
    for pushed_deg in (4.0, 8.0, 12.0, 16.0, 24.0):
        print(
            f"exact, pushed by {pushed_deg:2.0f} deg:",
            table(map(model_errors, scenes(count, pushed_deg))),
        )


if __name__ == "__main__":
    main()
