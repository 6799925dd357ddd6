"""How well the truth is known with one, two and three cameras, and against the angle between their planes.

    python tests/studies/accuracy/views.py --count 20 --figure docs/pictures/views.png

A camera and the bar's axis make a plane; two cameras tell where the bar is by where their planes cut, and likewise the
wire. Here they stand 0.4 m away, turned about the bar to either side of its normal by half the angle between their
planes, one 20 degrees up along the bar and one 20 degrees down, which keeps their planes through the wire apart. A
single camera stands 20 degrees up, a third on the normal. Everything else is drawn anew in every trial (see scenes.py).
Prints root mean square errors and median stated sigmas.
"""

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.drawing import style
from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import CameraTable, PicturesTable, TrialTable
from tests.studies.accuracy.coverage import QUANTITIES, row_of, see_points
from tests.studies.accuracy.scenes import STEP_DEG, Sigmas, make_scene

SLOPE_DEG, D_X_MM, AWAY_MM = 30.0, 60.0, 400.0
UP_DEG = (20.0, -20.0, 0.0)
ANGLES_DEG = (2.0, 5.0, 10.0, 20.0, 40.0, 60.0, 90.0)
MIDDLE_MM = np.array([52.0, 3.0, 0.0])


@dataclass(frozen=True)
class Precision:
    """Root mean square errors and median stated sigmas by quantity; how many trials had a truth."""

    error: dict[str, float]
    sigma: dict[str, float]
    count: int


def table_of(turns_deg: Sequence[float]) -> list[CameraTable]:
    """Cameras turned about the bar by these angles from its normal on the whisker's side: up, down and level."""
    slope = math.radians(SLOPE_DEG)
    normal = np.array([0.0, -math.cos(slope), math.sin(slope)])
    bar = np.array([0.0, math.sin(slope), math.cos(slope)])
    cameras = []
    for name, turn, up in zip("abc", np.radians(turns_deg), np.radians(UP_DEG)):
        level = math.cos(turn) * normal + math.sin(turn) * np.array([1.0, 0.0, 0.0])
        way = math.cos(up) * level + math.sin(up) * bar
        cameras.append(
            CameraTable(
                name=name,
                position_mm=tuple((MIDDLE_MM + AWAY_MM * way).tolist()),
                target_mm=tuple(MIDDLE_MM.tolist()),
            )
        )
    return cameras


def precision_of(turns_deg: Sequence[float], count: int) -> Precision:
    """How well a whisk is known by cameras turned so far, over `count` trials."""
    trial = TrialTable(beta_deg=SLOPE_DEG, d_x_mm=D_X_MM)
    protocol = Protocol(
        cameras=table_of(turns_deg), trials=[trial], pictures=PicturesTable(step_deg=STEP_DEG)
    )
    scenes = [make_scene(protocol, Sigmas(), seed) for seed in range(count)]
    rows = [
        row
        for row in (row_of(scene, see_points(scene)) for scene in scenes)
        if "d_x_mm_error" in row
    ]
    columns = {
        name: np.array([[row[f"{name}_{what}"] for row in rows] for what in ("error", "sigma")])
        for name in QUANTITIES
    }
    return Precision(
        {name: float(np.sqrt(np.mean(c[0] ** 2))) for name, c in columns.items()},
        {name: float(np.median(c[1])) for name, c in columns.items()},
        len(rows),
    )


def line(label: str, precision: Precision) -> str:
    """One line of the table."""
    parts = (
        f"{name} {precision.error[name]:.4f} ({precision.sigma[name]:.4f})" for name in QUANTITIES
    )
    return f"{label:24s}" + "  ".join(parts)


def draw(found: dict[float, Precision], path: Path) -> None:
    """Errors (points) and stated sigmas (lines) of d_x, slip and slope against the angle between the planes."""
    from matplotlib.figure import Figure

    with style():
        figure = Figure(figsize=(5.0, 3.2), layout="constrained")
        axes = figure.subplots()
        for name, label, colour in (
            ("d_x_mm", "$d_x$, mm", "#b2182b"),
            ("slip_mm", "slip, mm", "#2166ac"),
            ("beta_deg", "β, degrees", "#1b7837"),
        ):
            axes.plot(
                list(found), [k.sigma[name] for k in found.values()], color=colour, label=label
            )
            axes.plot(list(found), [k.error[name] for k in found.values()], "o", color=colour)
        axes.set(
            xscale="log",
            yscale="log",
            xlabel="angle between the cameras' planes through the bar, degrees",
            ylabel="stated sigma (line), RMS error (dots)",
            xticks=list(found),
            xticklabels=[f"{a:g}" for a in found],
        )
        axes.minorticks_off()
        axes.set_ylim(top=3 * axes.get_ylim()[1])
        axes.legend(ncols=3, loc="upper right")
        figure.savefig(path, dpi=130)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    print(f"{options.count} trials each: RMS error (median stated sigma)")
    for label, turns in (
        ("one camera", [0.0]),
        ("two, 40 degrees apart", [-20.0, 20.0]),
        ("three, 20 degrees apart", [-20.0, 20.0, 0.0]),
    ):
        print(line(label, precision_of(turns, options.count)), flush=True)
    found = {}
    for angle in ANGLES_DEG:
        found[angle] = precision_of([-angle / 2, angle / 2], options.count)
        print(line(f"two, {angle:g} degrees apart", found[angle]), flush=True)
    if options.figure:
        draw(found, options.figure)


if __name__ == "__main__":
    main()
