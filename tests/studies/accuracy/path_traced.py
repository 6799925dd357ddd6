"""The ladder's last rung: do the stated 95 % intervals hold in path-traced scenes, in light that a lab has?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/path_traced.py SCENES TABLE.csv

SCENES holds sessions of one whisk each (trials/w) with exact cameras, rig pictures and the truth (truth.toml,
truth.csv), as fixtures/scenes does. Each is seen by `observe_trial`. A scene is a row of TABLE.csv by its place among
the folders' names; one that is there is not seen again. Prints the coverage of all rows, and the rows without a truth
or beyond four sigma.
"""

import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.studies.accuracy.bar_scenes import read_scene
from tests.studies.accuracy.coverage import COLUMNS, QUANTITIES, Seen, row_of, summary
from tests.studies.accuracy.rows import all_rows
from tests.studies.accuracy.scenes import Truth
from vision.geometry.vision_settings import VisionSettings
from vision.touched.one_view import widest_angle_rad
from vision.truth.observe import observe_trial
from vision.truth.trial_pictures import TrialPictures

ROOT = Path(__file__).resolve().parents[3]
FAR_SIGMAS = 4.0
_STANDARD = VisionSettings()


@dataclass(frozen=True, eq=False)
class PathTraced:
    """What `row_of` asks of a scene."""

    seed: int
    truth: Truth
    cameras: tuple
    plane_angle_deg: float
    motor_rad: np.ndarray


def see_scene(
    number: int, folder: Path, settings: VisionSettings = _STANDARD
) -> tuple[PathTraced, Seen]:
    """A scene with its truth, and what is seen of it."""
    views, cameras, rods, motor_rad, axis = read_scene(folder)
    written = tomllib.loads((folder / "trials" / "w" / "truth.toml").read_text())
    frames = np.genfromtxt(folder / "trials" / "w" / "truth.csv", delimiter=",", names=True)
    slip = np.where(frames["contact"] > 0, frames["slip_mm"], np.nan)
    pictures = TrialPictures(
        {view.camera.name: view.frames for view in views},
        frames["time_s"],
        motor_rad,
        {view.camera.name: view.background for view in views},
    )
    (whisk,) = observe_trial(pictures, [slice(0, len(motor_rad))], cameras, rods, settings).whisks
    seen = slice(None) if whisk.frames is None else whisk.frames.index
    truth = Truth(
        np.radians(written["touch_deg"]),
        written["d_x_mm"],
        np.radians(written["beta_deg"]),
        slip[seen],
    )
    plane_angle_deg = float(np.degrees(widest_angle_rad(cameras, axis)))
    scene = PathTraced(number, truth, tuple(cameras), plane_angle_deg, motor_rad[seen])
    if np.isnan(whisk.d_x_mm.value):
        return scene, Seen({}, {}, whisk.status)
    found = {
        "touch": whisk.touch_rad,
        "d_x": whisk.d_x_mm,
        "beta": whisk.beta_rad,
        "slip": whisk.frames.slip_mm,
    }
    values, sigmas = (
        {name: getattr(one, what) for name, one in found.items()} for what in ("value", "sigma")
    )
    return scene, Seen(values, sigmas, whisk.status)


def odd(row: dict) -> bool:
    """Whether a row has no truth, or one beyond FAR_SIGMAS of what is stated."""
    z = [
        abs(row.get(f"{name}_error", np.nan) / row.get(f"{name}_sigma", np.nan))
        for name in QUANTITIES
    ]
    return not max(z) <= FAR_SIGMAS


def main() -> None:
    scenes, table = Path(sys.argv[1]), Path(sys.argv[2])
    folders = sorted(path.parents[2] for path in scenes.glob("*/trials/w/truth.toml"))
    rows = all_rows(
        table,
        COLUMNS,
        range(len(folders)),
        lambda number: row_of(*see_scene(number, folders[number])),
    )
    print(*summary(rows), sep="\n")
    names = ("d_x_mm_error", "beta_deg_error", "slip_rms_mm")
    errors = np.abs([[row.get(name, np.nan) for name in names] for row in rows])
    print(
        "median |d_x| {:.4f} mm, |beta| {:.3f} deg, slip RMS {:.4f} mm".format(
            *np.nanmedian(errors, axis=0)
        )
    )
    for row in filter(odd, rows):
        values = [
            (name, row.get(f"{name}_error", np.nan), row.get(f"{name}_sigma", np.nan))
            for name in QUANTITIES
        ]
        far = ", ".join("{} {:+.4f} ± {:.4f}".format(*value) for value in values)
        print(f"{folders[row['seed']].name}: {far} {row['status']}")


if __name__ == "__main__":
    main()
