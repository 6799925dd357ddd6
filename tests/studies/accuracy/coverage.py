"""Do the stated 95 % intervals hold? Independent scenes, from line points or from rasterised pictures.

    python tests/studies/accuracy/coverage.py points FOLDER --count 1000
    python tests/studies/accuracy/coverage.py pictures FOLDER --count 300
    python tests/studies/accuracy/coverage.py alone FOLDER --count 100
    python tests/studies/accuracy/coverage.py hard FOLDER --count 100
    python tests/studies/accuracy/coverage.py cone FOLDER --count 30
    python tests/studies/accuracy/coverage.py tapered FOLDER --count 30

Every scene is drawn anew (slope, distance, cameras, noise, friction, sag, tilt of the bar, light) and its cameras are
calibrated anew from noisy corners. `points` fits line points with every error that the fit allows for; `pictures` has
the rig draw each frame and looks at it with `observe_trial`; `alone` shows it the first camera; `hard` does so with
wires and bars of any brightness. A scene is a row of FOLDER/points.csv, pictures.csv and so on; one that is there is
not seen again: interrupt it and go on at will. Prints the coverage of all rows.
"""

import argparse
import math
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.rig.parts import Job, render_frames
from bench.rig.protocol_tables import WhiskerTable
from tests.studies.accuracy.rows import HALF_WIDTH_95, all_rows
from tests.studies.accuracy.scenes import (
    Scene,
    as_problem,
    begin,
    calibrated,
    draw_scene,
    given,
    hard_light,
    line_points,
)
from vision.fit.converged_fit import ConvergedFit
from vision.fit.problem import Problem, State
from vision.fit.scatter import inflated_by_residuals
from vision.fit.solve import solve
from vision.fit.touch_by_onset import touch_by_onset
from vision.geometry.camera import Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rods import Rods
from vision.geometry.vision_settings import VisionSettings
from vision.touched.one_view import seen_from_one_side
from vision.truth.observe import observe_trial
from vision.truth.trial_pictures import TrialPictures

QUANTITIES = {"d_x_mm": 1.0, "touch_deg": 180 / math.pi, "beta_deg": 180 / math.pi, "slip_mm": 1.0}
# Slip of a scene is that of the frame nearest this pushing angle; its frames share most of their error.
SLIP_AT_RAD = math.radians(3.0)
# Line points start from no bend at all: first as plain least squares, then more and more robust.
SCALES = (1e9,) * 4 + (10.0, 4.0, 4.0)
WIRES = {
    "cone": WhiskerTable(shape="cone"),
    "tapered": WhiskerTable(shape="tapered", tip_diameter_mm=0.4),
}
COLUMNS = (
    "seed",
    "beta_true_deg",
    "d_x_true_mm",
    "cameras",
    "plane_angle_deg",
    "status",
    *(f"{name}_{what}" for name in QUANTITIES for what in ("error", "sigma")),
    "slip_rms_mm",
    "slip_worst_z",
)


@dataclass(frozen=True, eq=False)
class Seen:
    """Values and sigmas by name (touch, d_x, beta: floats; slip: (f,)), or the reason why there are none. frames: of
    the scene's, the indices of those that were looked at; None: of all."""

    value: Mapping
    sigma: Mapping
    status: str = ""
    frames: np.ndarray | None = None


def see_lines(problem: Problem, start: State, scales=SCALES) -> Seen:
    """What the fit says of line points, done as on a trial: fitted once, then again with honest sigmas."""
    state, covariance = solve(problem, start, scales=scales)
    if seen_from_one_side(problem.cameras, problem.axis):
        problem, state = touch_by_onset(problem, state, covariance)
        state, _ = solve(problem, state)
    problem = inflated_by_residuals(problem, state)
    state, _ = solve(problem, state, scales=(4.0, 4.0, 4.0))
    fit = ConvergedFit(problem, state)
    covariance = fit.fit_covariance
    measured, by = fit.measured, fit.by_parameter
    sigma = {name: float(np.sqrt(j @ covariance @ j)) for name, j in by.whisk.items()}
    sigma["slip"] = np.sqrt(
        np.einsum("fi,ij,fj->f", by.frame["slip"], covariance, by.frame["slip"])
    )
    return Seen({**measured.whisk, "slip": measured.frame["slip"]}, sigma)


def see_points(scene: Scene) -> Seen:
    """What the fit says of the scene's noisy line points."""
    rng = np.random.default_rng([scene.seed, 22])
    problem = as_problem(scene, calibrated(scene, rng), *given(scene, rng), line_points(scene, rng))
    try:
        return see_lines(problem, begin(problem))
    except Refused as reason:
        return Seen({}, {}, str(reason))


def see_pictures(
    scene: Scene,
    most_cameras: int | None = None,
    settings: VisionSettings = VisionSettings(),  # noqa: B008
) -> Seen:
    """What `observe_trial` says of rasterised pictures, of the first cameras only where a number is given."""
    pictures, cameras, rods = drawn(scene, most_cameras)
    (whisk,) = observe_trial(
        pictures, [slice(0, len(scene.motor_rad))], cameras, rods, settings
    ).whisks
    if math.isnan(whisk.d_x_mm.value):
        return Seen({}, {}, whisk.status)
    found = {
        "touch": whisk.touch_rad,
        "d_x": whisk.d_x_mm,
        "beta": whisk.beta_rad,
        "slip": whisk.frames.slip_mm,
    }
    values, sigmas = (
        {name: getattr(one, what) for name, one in found.items()} for what in ("value", "sigma")
    )
    return Seen(values, sigmas, whisk.status, whisk.frames.index)


@lru_cache(maxsize=1)
def drawn(scene: Scene, most_cameras: int | None) -> tuple[TrialPictures, Cameras, Rods]:
    """A scene's pictures, its cameras as they were calibrated, and the rods as someone measured them."""
    rng = np.random.default_rng([scene.seed, 23])
    cameras, rods = calibrated(scene, rng), Rods(*given(scene, rng))
    job = Job(Path(), scene.protocol, scene.seed, False)
    frames = {
        studio.camera.name: dict(enumerate(render_frames(job, 0, k, scene.recording)))
        for k, studio in enumerate(job.studios[:most_cameras])
    }
    background = {
        s.camera.name: s.sensor.expose(s.rig_brightness(), rng).astype(float) for s in job.studios
    }
    return (
        TrialPictures(frames, scene.recording.frames.time_s, scene.motor_rad, background),
        cameras,
        rods,
    )


def see_alone(scene: Scene) -> Seen:
    """The same with one camera."""
    return see_pictures(scene, 1)


def kept(what: str, seed: int) -> dict:
    """The tables that a way's scenes keep, whatever else is drawn."""
    if what == "hard":
        return {"light": hard_light(seed)}
    return {"whisker": WIRES[what]} if what in WIRES else {}


def row_of(scene: Scene, seen: Seen) -> dict:
    """A line of the table; errors are empty where there is no truth."""
    truth = scene.truth
    row = {
        "seed": scene.seed,
        "beta_true_deg": math.degrees(truth.beta),
        "d_x_true_mm": truth.d_x,
        "cameras": len(scene.cameras),
        "plane_angle_deg": scene.plane_angle_deg,
        "status": seen.status,
    }
    if not seen.value:
        return row
    error = {name: seen.value[name] - getattr(truth, name) for name in ("touch", "d_x", "beta")}
    frames = slice(None) if seen.frames is None else seen.frames
    error["slip"] = seen.value["slip"] - truth.slip[frames]
    theta = scene.motor_rad[frames] - truth.touch
    touching = np.isfinite(error["slip"]) & (theta > math.radians(0.2))
    at = int(np.argmin(np.where(touching, np.abs(theta - SLIP_AT_RAD), np.inf)))
    if np.any(touching):  # or it was pushed by less
        row |= {
            "slip_rms_mm": float(np.sqrt(np.mean(error["slip"][touching] ** 2))),
            "slip_worst_z": float(np.max(np.abs(error["slip"] / seen.sigma["slip"])[touching])),
        }
    for column, unit in QUANTITIES.items():
        name = column.rpartition("_")[0]
        pair = (
            values[name][at] if name == "slip" else values[name] for values in (error, seen.sigma)
        )
        row |= {f"{column}_{what}": unit * float(v) for what, v in zip(("error", "sigma"), pair)}
    return row


def scene_row(seed: int, see: Callable[[Scene], Seen], **fixed) -> dict:
    """The row of a drawn scene; fixed: see `draw_scene`."""
    scene = draw_scene(seed, **fixed)
    return row_of(scene, see(scene))


def summary(rows: list[dict]) -> Iterable[str]:
    """Lines: what share of the intervals holds, typical sigma and error, the largest z and its seed."""
    seen = [row for row in rows if math.isfinite(row.get("d_x_mm_sigma", math.nan))]
    yield f"{len(rows)} scenes, {len(seen)} with a truth"
    for column in QUANTITIES if seen else ():
        error, sigma = (
            np.array([row[f"{column}_{what}"] for row in seen]) for what in ("error", "sigma")
        )
        z = np.abs(error / sigma)
        worst = int(np.argmax(z))
        yield (
            f"{column:10s} 95 % intervals hold in {100 * np.mean(z < HALF_WIDTH_95):5.1f} %, z RMS "
            f"{np.sqrt(np.mean(z**2)):.2f}, largest {z[worst]:.2f} (seed {seen[worst]['seed']}); error RMS "
            f"{np.sqrt(np.mean(error**2)):.4f}, sigma median {np.median(sigma):.4f}"
        )


WAYS: Mapping[str, Callable[[Scene], Seen]] = {
    "points": see_points,
    "pictures": see_pictures,
    "alone": see_alone,
    "hard": see_pictures,
    "cone": see_pictures,
    "tapered": see_pictures,
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=WAYS)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--first", type=int, default=0, help="seed of the first scene")
    parser.add_argument("--count", type=int, default=1000)
    options = parser.parse_args()
    table = options.folder / f"{options.what}.csv"
    seeds = range(options.first, options.first + options.count)
    see = WAYS[options.what]
    rows = all_rows(
        table, COLUMNS, seeds, lambda seed: scene_row(seed, see, **kept(options.what, seed))
    )
    print(*summary(rows), sep="\n")


if __name__ == "__main__":
    main()
