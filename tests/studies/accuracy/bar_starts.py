"""Whether the bar's line forgets where it was looked for: starts off by a shift and a tilt of so many pixels.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/bar_starts.py FOLDER [PATTERN]

FOLDER is one of bar_scenes.py. A bar is looked for from its true axis, and from axes off by each of STARTS_PX: half of
it at the middle, in a random direction, and half over 20 mm, in another. A row a camera: how far off the line is at
20 mm to either side (px) and the stated sigma; then how far each start moves it, in stated sigmas. Last: z with the
error that the fit takes every line to have besides (BAR_OFFSET_PX), and of the moves, start by start, the RMS, the
median, and the share over 0.2.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.studies.accuracy.bar_scenes import off_px, read_scene
from vision.fit.blocks import BAR_OFFSET_PX
from vision.geometry.camera import Camera
from vision.geometry.centreline import resting_lines
from vision.geometry.contact import BarAxis, axis_frame
from vision.geometry.vision_settings import VisionSettings
from vision.touched.line import BarLineEstimate, measure_bars
from vision.touched.object_view import ObjectView

STARTS_PX = (0.01, 0.1, 0.5, 1.5)
ARM_MM, WIRES, ALLOWED = 20.0, 8, 0.2


def starts(axis: BarAxis, camera: Camera, rng: np.random.Generator) -> list[BarAxis]:
    """The axis, and axes off by each of STARTS_PX as a camera that looks across would see it."""
    px_mm = float(np.linalg.norm(axis.point_mm - camera.centre_mm)) / float(camera.matrix[0, 0])
    across = axis_frame(axis.direction)
    shifted = [axis]
    for size_mm in 0.5 * px_mm * np.array(STARTS_PX):
        shift, tilt = (
            (np.cos(angle), np.sin(angle)) @ across for angle in rng.uniform(0.0, 2.0 * np.pi, 2)
        )
        direction = axis.direction + size_mm / ARM_MM * tilt
        shifted.append(
            BarAxis(axis.point_mm + size_mm * shift, direction / np.linalg.norm(direction))
        )
    return shifted


def moves(
    views: Sequence[ObjectView], axis: BarAxis, rng: np.random.Generator
) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """By camera: how far off the line is (starts + 1, 2), px, and its sigma; without those that see too little."""
    found = []
    for start in starts(axis, views[0].camera, rng):
        coarse = measure_bars(views, start)
        found.append(measure_bars(views, start, coarse))
    rows = []
    for view in views:
        lines: list[BarLineEstimate] = [
            one[view.camera.name] for one in found if view.camera.name in one
        ]
        if len(lines) == len(found) and all(line.is_bar for line in lines):
            points = [line.points for line in lines]
            error = np.array(
                [off_px(view.camera, axis, view.radius_mm, one.px, one.normal) for one in points]
            )
            rows.append((view.camera.name, error, np.array([one.sigma_px for one in points])))
    return rows


def printed(name: str, rows) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Of each camera the errors (2,) and sigmas (2,) from the true axis, and moves (starts,) in sigmas."""
    table = []
    for camera, error, sigma in rows:
        moved = np.max(np.abs(error[1:] - error[0]) / sigma[0], axis=1)
        parts = [f"{e:+.3f} ± {s:.3f}" for e, s in zip(error[0], sigma[0])]
        print(
            f"{name:<12} {camera:<6} {'   '.join(parts)}   moved "
            + " ".join(f"{one:6.2f}" for one in moved),
            flush=True,
        )
        table.append((error[0], sigma[0], moved))
    return table


def summary(table) -> str:
    """Of all cameras."""
    error, sigma, moved = (np.array(column) for column in zip(*table))
    z = np.abs(error / np.hypot(sigma, BAR_OFFSET_PX)).ravel()
    parts = [
        f"{px:g} px {np.sqrt(np.mean(one**2)):.2f}, {np.median(one):.2f} ({np.mean(one > ALLOWED):.0%} over)"
        for px, one in zip(STARTS_PX, moved.T)
    ]
    return (
        f"{len(z)} points: median error {np.median(np.abs(error)):.3f} px, sigma {np.median(sigma):.3f}; z RMS "
        f"{np.sqrt(np.mean(z**2)):.2f}, median {np.median(z):.2f}, within 1.96 {np.mean(z < 1.96):.1%}, over 3 "
        f"{np.mean(z > 3):.1%}, largest {z.max():.1f}\nmoved, in sigmas, RMS and median: {'  '.join(parts)}"
    )


def main() -> None:
    pattern = sys.argv[2] if len(sys.argv) > 2 else "*"
    table = []
    for folder in sorted(
        one for one in Path(sys.argv[1]).glob(pattern) if (one / "trials/w/truth.toml").exists()
    ):
        views, _, rods, motor, axis = read_scene(folder)
        span = np.linspace(motor.min(), motor.max(), WIRES)
        seen = []
        for view in views:
            wires_px = resting_lines(view.camera, rods.wire, span)
            seen.append(ObjectView(view, rods.bar.radius_mm, VisionSettings(), wires_px))
        rows = moves(seen, axis, np.random.default_rng(0))
        table += printed(folder.name, rows)
    print(summary(table))


if __name__ == "__main__":
    main()
