"""Lines of thin objects between two given ends: in real pictures, and in path-traced ones whose line is known.

    OMP_NUM_THREADS=1 python tests/studies/real_wires.py FOLDER [--draw OUT]
    OMP_NUM_THREADS=1 python tests/studies/real_wires.py SCENES --scenes

FOLDER holds pictures and ends.csv (picture,start_x,start_y,end_x,end_y; px); nothing is fetched. The tables on record
are of m4nh/cables_dataset (cable_dataset_reduced @ d8a9d12, ends from its NNNNN.txt), jasonkglim/Catheter-Perception
(tip_pose_images @ 7e8c5db) and pictures of rats' whiskers (nclack/whisk docs/source/images @ d938b9d, JostTim/pWhisk
Documentation @ bd0be4e). A row each: points, length, width, blur, chi² per pixel, scatter, sigma and other paths, or
the code of its refusal. `--draw` writes each picture with its line and edges.

SCENES holds path-traced sessions of one whisk each, as for path_traced.py. Before touch their wire is a straight line,
which is known: a row each for mean error, scatter and RMS of z of a picture's line; then those of all, and the codes of
what was refused.
"""

import argparse
import csv
import sys
from collections import Counter
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.studies.accuracy.bar_scenes import read_scene
from tests.studies.accuracy.wire_scenes import free_wire_px, off_px
from vision.geometry.refusals import Refused
from vision.wire.between_ends import WireLine, trace_between

# Of the wire in a scene, from the hub on, mm: before the bar.
_FIRST_MM = 10.0
_LAST_MM = 45.0
_END_ERROR_PX = 2.0


def row_of(line: WireLine) -> str:
    """Return what a line's row says."""
    width = 2.0 * line.radius_px[[0, -1]]
    return (
        f"{len(line.points):4d} points, {line.points.place[-1]:5.0f} px long, {width[0]:.1f} to {width[1]:.1f} wide, "
        f"blur {line.blur_px:.2f}, chi2 {line.chi2:5.2f}, scatter {line.scatter:.2f}, seen {line.seen:.2f}, "
        f"sigma {np.median(line.points.sigma_px):.3f} own, {np.median(line.sigma_px):.3f} in all, "
        f"{len(line.others)} other paths"
    )


def trace_folder(folder: Path, out: Path | None) -> None:
    """Print a row for each line of ends.csv."""
    with open(folder / "ends.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for number, row in enumerate(rows):
        picture = cv2.imread(str(folder / row["picture"]))
        ends = [(float(row[f"{end}_x"]), float(row[f"{end}_y"])) for end in ("start", "end")]
        name = f"{row['picture']} {number}"
        try:
            line = trace_between(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), *ends)
        except Refused as refused:
            print(f"{name}: refused ({refused.code}): {refused}", flush=True)
            continue
        print(f"{name}: {row_of(line)}", flush=True)
        if out is not None:
            draw(picture, line, out / f"{Path(row['picture']).stem}_{number}.png")


def draw(picture: np.ndarray, line: WireLine, path: Path) -> None:
    """Write a picture, three times as large, with the line red and its edges blue."""
    large = cv2.resize(picture, None, fx=3, fy=3, interpolation=cv2.INTER_CUBIC)
    for side, colour in ((0, (0, 0, 255)), (1, (255, 80, 0)), (-1, (255, 80, 0))):
        px = line.points.px + side * line.radius_px[:, None] * line.points.normal
        cv2.polylines(large, [np.rint(3.0 * px + 1.0).astype(int)], False, colour, 1, cv2.LINE_AA)
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), large)


def trace_scenes(folder: Path, rng: np.random.Generator) -> None:
    """Print a row for each camera's first picture of each scene, then those of all."""
    means = []
    deviations = []
    refusals = Counter()
    for scene in sorted(path for path in folder.iterdir() if (path / "cameras.toml").is_file()):
        views, _, rods, motor_rad, _ = read_scene(scene)
        radius_mm = float(rods.wire.radius_mm(_LAST_MM))
        for view in views:
            frame = min(view.frames)
            true_px = free_wire_px(view.camera, motor_rad[frame], radius_mm)
            place_mm = np.linspace(1.0, 100.0, len(true_px))
            ends = true_px[np.searchsorted(place_mm, [_FIRST_MM, _LAST_MM])]
            ends = ends + _END_ERROR_PX * rng.standard_normal((2, 2))
            name = f"{scene.name} {view.camera.name}"
            try:
                line = trace_between(view.frames[frame], *ends)
            except Refused as refused:
                refusals[refused.code] += 1
                print(f"{name}: refused ({refused.code}): {refused}", flush=True)
                continue
            error = off_px(line.points, true_px)
            z = error / line.sigma_px
            means.append([np.mean(error), np.mean(error) / np.median(line.sigma_px)])
            deviations.append((error - np.mean(error)) / line.points.sigma_px)
            print(
                f"{name}: off {np.mean(error):+.3f} px, scatter {np.std(error):.3f}, "
                f"z RMS {np.sqrt(np.mean(z**2)):.2f}; {row_of(line)}",
                flush=True,
            )
    off, z = np.array(means).T
    print(
        f"{len(off)} lines: off {np.sqrt(np.mean(off**2)):.3f} px RMS, {np.median(np.abs(off)):.3f} in the median, "
        f"z RMS of lines {np.sqrt(np.mean(z**2)):.2f}, of points about their line "
        f"{np.sqrt(np.mean(np.concatenate(deviations) ** 2)):.2f}; refused: {dict(refusals)}"
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scenes", action="store_true")
    parser.add_argument("--draw", type=Path)
    arguments = parser.parse_args()
    if arguments.scenes:
        trace_scenes(arguments.folder, np.random.default_rng(5))
    else:
        trace_folder(arguments.folder, arguments.draw)


if __name__ == "__main__":
    main()
