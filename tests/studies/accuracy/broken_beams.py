"""Wires that do not bend as a beam with a point load, and what the whisk says of them.

    python tests/studies/accuracy/broken_beams.py FOLDER --count 20

The contact points of exact mechanics are kept, so that touch, d_x and slip keep their truth; between base, contact and
tip the wire takes the shape of another rod that is pushed as far: softer in part, with a joint, in a clamp that gives.
Or the fit is told the wrong profile. Prints, for each break, in how many scenes it moved d_x, touch or slip by more
than their sigma, and in how many of these, and of the others, there was an alarm.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.rig.protocol_tables import WhiskerTable
from tests.studies.accuracy.coverage import SCALES
from tests.studies.accuracy.rows import all_rows
from tests.studies.accuracy.scenes import (
    Scene,
    as_problem,
    begin,
    calibrated,
    draw_scene,
    given,
    line_points,
)
from vision.fit.beam_check import BeamCheck, check_beam
from vision.fit.converged_fit import ConvergedFit
from vision.fit.problem import Problem
from vision.fit.scatter import inflated_by_residuals
from vision.fit.solve import solve
from vision.wire.points import Observed

_GRID = 400  # intervals of the integrals along the wire
# Softness (n,) along the arc (n,), mm, of a rod of this length that is 1 at the base.
Softness = Callable[[np.ndarray, float], np.ndarray]


def softer_outside(times: float) -> Softness:
    """Softer by this factor in its outer half, of the length."""
    return lambda arc, length: np.where(arc > 0.5 * length, times, 1.0)


def joint(at_mm: float, as_mm: float) -> Softness:
    """A joint that bends as much as so many mm of the rod."""
    return lambda arc, length: 1.0 + as_mm * np.exp(-0.5 * (arc - at_mm) ** 2) / np.sqrt(2 * np.pi)


def loose_clamp(as_mm: float) -> Softness:
    """A clamp that gives as so many mm of the rod would."""
    return lambda arc, length: 1.0 + 2 * as_mm * np.exp(-0.5 * arc**2) / np.sqrt(2 * np.pi)


def deflection(softness: Softness, arc_mm, contact_mm: float, length_mm: float) -> np.ndarray:
    """Deflection (n,) at arc lengths by a force at the contact, 1 there; small angles."""
    s = np.linspace(0.0, length_mm, _GRID + 1)
    h = s[1] - s[0]
    curvature = softness(s, length_mm) * np.maximum(contact_mm - s, 0.0)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * h * (curvature[1:] + curvature[:-1]))])
    y = np.concatenate([[0.0], np.cumsum(0.5 * h * (angle[1:] + angle[:-1]))])
    return np.interp(arc_mm, s, y) / np.interp(contact_mm, s, y)


def broken(
    scene: Scene, seen: Sequence[Observed], softness: Softness, along=(1.0, 1.0)
) -> list[Observed]:
    """The line points where such a rod would be seen. along: share of its departure taken in y and in z (hub)."""
    return [
        one
        if one.frame < 0 or scene.states[one.frame] is None
        else _moved(scene, one, softness, along)
        for one in seen
    ]


def _moved(scene: Scene, one: Observed, softness: Softness, along) -> Observed:
    state, motor, whisk = (
        scene.states[one.frame],
        scene.motor_rad[one.frame],
        scene.recording.whisks[0],
    )
    camera, place, length = (
        scene.cameras.cameras[one.camera],
        one.points.place,
        scene.wire.length_mm,
    )
    points, contact = (
        whisk.centreline_mm(motor, state, arc) for arc in (place, np.array([state.arc_mm]))
    )
    pushed = contact[0] - whisk.centreline_mm(motor, None, np.array([state.arc_mm]))[0]
    c, s = np.cos(motor), np.sin(motor)
    hub = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    pushed = hub.T @ (np.array([0.0, *along]) * (hub @ pushed))
    uniform = lambda arc, length: np.ones_like(arc)  # noqa: E731
    share = deflection(softness, place, state.arc_mm, length) - deflection(
        uniform, place, state.arc_mm, length
    )
    px = one.points.px + camera.project(points + share[:, None] * pushed) - camera.project(points)
    return replace(one, points=replace(one.points, px=px))


BREAKS = {
    "none": None,
    "outer half 1.5 times as soft": softer_outside(1.5),
    "joint at 30 mm, of 5 mm": joint(30.0, 5.0),
    "clamp that gives as 3 mm": loose_clamp(3.0),
    "cone entered as cylinder": "cylinder",
}
QUANTITIES = ("d_x", "touch", "slip")
COLUMNS = (
    "seed",
    "chance",
    "alarm",
    *(f"{name}_{what}" for name in QUANTITIES for what in ("moved", "told")),
)


def check_of(problem: Problem) -> BeamCheck:
    """The check of line points, fitted as those of a trial."""
    state, _ = solve(problem, begin(problem), scales=SCALES)
    problem = inflated_by_residuals(problem, state)
    fit = ConvergedFit(problem, solve(problem, state, scales=(4.0, 4.0, 4.0))[0])
    return check_beam(fit, fit.fit_covariance)


def row_of(seed: int, how: Softness | str | None) -> dict:
    """Of a break in a scene: what it moves, and what the spline says it moved, in stated sigmas."""
    wrong_shape = how if isinstance(how, str) else None
    scene = draw_scene(seed, whisker=WhiskerTable(shape="cone" if wrong_shape else "cylinder"))
    rng = np.random.default_rng([scene.seed, 22])
    cameras, (wire, bar), seen = calibrated(scene, rng), given(scene, rng), line_points(scene, rng)
    whole = check_of(as_problem(scene, cameras, wire, bar, seen))
    if wrong_shape:
        wire = replace(wire, shape=wrong_shape)
    elif how:
        seen = broken(scene, seen, how)
    check = check_of(as_problem(scene, cameras, wire, bar, seen))
    row = {"seed": seed, "chance": check.chance, "alarm": int(bool(check.alarm))}
    for quantity in QUANTITIES:
        before, after = getattr(whole, quantity), getattr(check, quantity)
        row |= {
            f"{quantity}_moved": (after.beam - before.beam) / after.sigma,
            f"{quantity}_told": after.shift,
        }
    return row


def summary(name: str, rows: Sequence[dict]) -> str:
    """A line on a break."""
    moved = np.array(
        [max(abs(row[f"{quantity}_moved"]) for quantity in QUANTITIES) for row in rows]
    )
    alarms, far = np.array([row["alarm"] == 1 for row in rows]), moved > 1.0
    return (
        f"{name:30s} moved by over a sigma in {far.sum():3d} of {len(rows)}, alarm in {alarms[far].sum():3d} of these "
        f"and {alarms[~far].sum():3d} of the others; least chance {min(row['chance'] for row in rows):.1g}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=20)
    options = parser.parse_args()
    for name, how in BREAKS.items():
        table = options.folder / f"{name.replace(' ', '_')}.csv"
        print(
            summary(name, all_rows(table, COLUMNS, range(options.count), partial(row_of, how=how))),
            flush=True,
        )


if __name__ == "__main__":
    main()
