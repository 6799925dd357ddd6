"""Measure whether the stated 95 % intervals hold in path-traced scenes, in light that a lab has.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/path_traced.py SCENES TABLE.csv

SCENES holds sessions of one whisk each (trials/w) with exact cameras, rig pictures and the truth (truth.toml,
truth.csv), as fixtures/scenes does. Each is seen by `observe_trial`. A scene is a row of TABLE.csv by its folder's
name; one that is there is not seen again, so that more scenes can be added at any time. Prints the table of
docs/proof.md, a row for each light, and the scenes without a truth or beyond four sigma.
"""

import sys
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.studies.accuracy import coverage
from tests.studies.accuracy.bar_scenes import read_scene
from tests.studies.accuracy.coverage import QUANTITIES, Seen, row_of
from tests.studies.accuracy.rows import HALF_WIDTH_95, all_rows
from tests.studies.accuracy.scenes import Truth
from vision.geometry.contact import BarAxis
from vision.geometry.vision_settings import VisionSettings
from vision.touched.one_view import widest_angle_rad
from vision.truth.observe import observe_trial
from vision.truth.records import WhiskTruth
from vision.truth.trial_pictures import TrialPictures

ROOT = Path(__file__).resolve().parents[3]
FAR_SIGMAS = 4.0
COLUMNS = ("scene", "look", *coverage.COLUMNS[1:])
_STANDARD = VisionSettings()
_HEADER = """\
| light | scenes, with a truth | d_x: median, nine in ten below | slope median, slip RMS median | largest z of d_x \
| 95 % intervals that hold: d_x, touch, slope, slip | RMS of z |
|---|---|---|---|---|---|---|"""


@dataclass(frozen=True, eq=False)
class PathTraced:
    """What `row_of` asks of a scene."""

    seed: int
    truth: Truth
    cameras: tuple
    plane_angle_deg: float
    motor_rad: np.ndarray


def see_scene(folder: Path, settings: VisionSettings = _STANDARD) -> tuple[PathTraced, Seen]:
    """Return a scene with its truth, and what is seen of it."""
    views, cameras, rods, motor_rad, axis = read_scene(folder)
    pictures = TrialPictures(
        {view.camera.name: view.frames for view in views},
        frames_of(folder)["time_s"],
        motor_rad,
        {view.camera.name: view.background for view in views},
    )
    (whisk,) = observe_trial(pictures, [slice(0, len(motor_rad))], cameras, rods, settings).whisks
    return beside_truth(folder, cameras, motor_rad, axis, whisk)


def beside_truth(
    folder: Path, cameras: tuple, motor_rad: np.ndarray, axis: BarAxis, whisk: WhiskTruth
) -> tuple[PathTraced, Seen]:
    """Return a scene with its truth in the frames of a whisk, and what that has."""
    written = _written_truth(folder)
    frames = frames_of(folder)
    slip = np.where(frames["contact"] > 0, frames["slip_mm"], np.nan)
    looked_at = slice(None) if whisk.frames is None else whisk.frames.index
    truth = Truth(
        np.radians(written["touch_deg"]),
        written["d_x_mm"],
        np.radians(written["beta_deg"]),
        slip[looked_at],
    )
    plane_angle_deg = float(np.degrees(widest_angle_rad(cameras, axis)))
    scene = PathTraced(0, truth, tuple(cameras), plane_angle_deg, motor_rad[looked_at])
    if np.isnan(whisk.d_x_mm.value):
        return scene, Seen({}, {}, whisk.status)
    found = {
        "touch": whisk.touch_rad,
        "d_x": whisk.d_x_mm,
        "beta": whisk.beta_rad,
        "slip": whisk.frames.slip_mm,
    }
    values = {name: one.value for name, one in found.items()}
    sigmas = {name: one.sigma for name, one in found.items()}
    return scene, Seen(values, sigmas, whisk.status)


def frames_of(folder: Path) -> np.ndarray:
    """Return the truth of a scene's frames, with their times and motor angles."""
    return np.genfromtxt(folder / "trials" / "w" / "truth.csv", delimiter=",", names=True)


def scene_row(folder: Path) -> dict:
    """Return a scene's row of the table."""
    row = row_of(*see_scene(folder))
    del row["seed"]
    look = _written_truth(folder).get("look", "")
    return {"scene": folder.name, "look": look, **row}


def _written_truth(folder: Path) -> dict:
    """Return the truth of a scene's whisk, without its frames."""
    return tomllib.loads((folder / "trials" / "w" / "truth.toml").read_text())


def is_far(row: dict) -> bool:
    """Return whether a row has no truth, or one beyond FAR_SIGMAS of what is stated."""
    z = [abs(_z(row, name)) for name in QUANTITIES]
    return not max(z) <= FAR_SIGMAS


def _z(row: dict, quantity: str) -> float:
    """Return a quantity's error in a row over its stated sigma, NaN where there is none."""
    error = row.get(f"{quantity}_error", np.nan)
    sigma = row.get(f"{quantity}_sigma", np.nan)
    return error / sigma


def table_lines(rows: Sequence[dict]) -> Iterator[str]:
    """Yield the table of docs/proof.md: a row for each light, the last for all of them."""
    yield _HEADER
    for look in sorted({row["look"] for row in rows}):
        yield _table_line(look, [row for row in rows if row["look"] == look])
    yield _table_line("all", rows)


def _table_line(title: str, rows: Sequence[dict]) -> str:
    """Return one row of that table."""
    seen = [row for row in rows if np.isfinite(row.get("d_x_mm_sigma", np.nan))]
    counts = f"{len(rows)}, {len(seen)}"
    if not seen:
        return f"| {title} | {counts} | | | | | |"
    d_x_mm = np.abs([row["d_x_mm_error"] for row in seen])
    beta_deg = np.median(np.abs([row["beta_deg_error"] for row in seen]))
    slip_mm = np.nanmedian([row.get("slip_rms_mm", np.nan) for row in seen])
    z = np.abs([[_z(row, name) for name in QUANTITIES] for row in seen])
    holds = ", ".join(f"{100.0 * share:.0f}" for share in np.mean(z < HALF_WIDTH_95, axis=0))
    rms = ", ".join(f"{one:.2f}" for one in np.sqrt(np.nanmean(z**2, axis=0)))
    return (
        f"| {title} | {counts} | {np.median(d_x_mm):.3f}, {np.quantile(d_x_mm, 0.9):.3f} mm "
        f"| {beta_deg:.3f}°, {slip_mm:.4f} mm | {np.max(z[:, 0]):.1f} | {holds} % | {rms} |"
    )


def main() -> None:
    """See the scenes that the table does not have, and print what all of them show."""
    scenes, table = Path(sys.argv[1]), Path(sys.argv[2])
    folders = {
        path.parents[2].name: path.parents[2] for path in scenes.glob("*/trials/w/truth.toml")
    }
    rows = all_rows(table, COLUMNS, folders, lambda name: scene_row(folders[name]))
    print(*table_lines(rows), sep="\n")
    for row in filter(is_far, rows):
        errors = []
        for name in QUANTITIES:
            error, sigma = (row.get(f"{name}_{what}", np.nan) for what in ("error", "sigma"))
            errors.append(f"{name} {error:+.4f} ± {sigma:.4f}")
        print(f"{row['scene']}: {', '.join(errors)} {row['status']}")


if __name__ == "__main__":
    main()
