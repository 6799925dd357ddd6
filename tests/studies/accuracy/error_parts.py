"""Which camera's line of the bar moves d_x by how much, in path-traced scenes.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/error_parts.py SCENES [PATTERN]

SCENES as for path_traced.py: the truth knows the bar's axis, so that each line of it has an error, and d_x answers it
by the fit's own gain. A row a camera: how far its line is off (px, the mean of its two points), stated sigma with what
the fit takes every line to have besides, and what it adds to d_x (mm); then d_x's error in all. At the end medians: of
the lines, of d_x, of what the bar's lines add to it, and of what is left without that.
"""

import sys
import tomllib
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.studies.accuracy.bar_scenes import off_px, read_scene
from vision.fit.blocks import BAR_OFFSET_PX
from vision.fit.problem import point_rows
from vision.geometry.contact import BarAxis
from vision.geometry.refusals import Refused
from vision.geometry.vision_settings import VisionSettings
from vision.touched.search import find_object
from vision.touched.search_scene import SearchScene
from vision.truth.traced_lines import TracedLines
from vision.truth.whisk_fit import fit_whisk
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures


def read_whisk(folder: Path) -> tuple[WhiskPictures, BarAxis]:
    """The whisk of a scene with its bar found, and the bar's true axis. Raises Refused where none is found."""
    views, cameras, rods, motor_rad, axis = read_scene(folder)
    settings, time_s = VisionSettings(), np.arange(len(motor_rad), dtype=float)
    bar = find_object(SearchScene(views, cameras, rods, motor_rad, settings))
    whisk = WhiskPictures(
        0,
        range(len(motor_rad)),
        time_s,
        motor_rad,
        tuple(views),
        cameras,
        rods,
        bar,
        settings,
        lines=TracedLines,
    )
    return whisk.without_gaps(), axis


def fit_scene(folder: Path) -> tuple[FittedWhisk, BarAxis]:
    """The fit of a scene's whisk, and the true axis of its bar. Raises Refused where there is no fit."""
    whisk, axis = read_whisk(folder)
    return fit_whisk(whisk), axis


def by_camera(found: FittedWhisk, axis: BarAxis) -> dict[str, tuple[float, float, float]]:
    """By camera whose line of the bar's middle is seen: its error and sigma, px, and what it adds to d_x, mm."""
    problem, parts = found.problem, {}
    gain = found.weighted.jacobian @ (found.inverse_normal @ found.by_parameter.whisk["d_x"])
    for seen, mine in point_rows(problem):
        if seen.frame >= 0 or seen.side:
            continue
        camera, points = problem.cameras.cameras[seen.camera], seen.points
        error = off_px(camera, axis, problem.rods.bar.radius_mm, points.px, points.normal)
        sigma = float(np.hypot(np.mean(points.sigma_px), BAR_OFFSET_PX))
        parts[camera.name] = (
            float(np.mean(error)),
            sigma,
            float(gain[mine] @ (error / points.sigma_px)),
        )
    return parts


def main() -> None:
    pattern, lines, wholes = sys.argv[2] if len(sys.argv) > 2 else "*", [], []
    for folder in sorted(
        one for one in Path(sys.argv[1]).glob(pattern) if (one / "trials/w/truth.toml").exists()
    ):
        true_mm = tomllib.loads((folder / "trials/w/truth.toml").read_text())["d_x_mm"]
        try:
            found, axis = fit_scene(folder)
        except Refused as reason:
            print(f"{folder.name}: {reason}", flush=True)
            continue
        parts, d_x = by_camera(found, axis), found.of_whisk("d_x")
        if not parts:
            continue
        lines += parts.values()
        wholes.append((d_x.value - true_mm, sum(part for *_, part in parts.values())))
        for name, (error, sigma, part) in parts.items():
            print(f"{folder.name:<6} {name}: {error:+.3f} ± {sigma:.3f} px, {part:+.4f} mm of d_x")
        whole, by_bar = wholes[-1]
        print(
            f"{folder.name:<6} d_x {whole:+.4f} ± {d_x.sigma:.4f} mm, by the bar {by_bar:+.4f}",
            flush=True,
        )
    (error, sigma, _), (whole, by_bar) = np.array(lines).T, np.array(wholes).T
    print(
        f"{len(error)} lines: |error| {np.median(np.abs(error)):.3f} px in the median, "
        f"{np.quantile(np.abs(error), 0.9):.3f} for nine in ten, z {np.sqrt(np.mean((error / sigma) ** 2)):.2f} RMS"
    )
    print(
        f"{len(whole)} whisks: |d_x| {np.median(np.abs(whole)):.4f} mm in the median, by the bar's lines alone "
        f"{np.median(np.abs(by_bar)):.4f}; without their errors {np.median(np.abs(whole - by_bar)):.4f}"
    )


if __name__ == "__main__":
    main()
