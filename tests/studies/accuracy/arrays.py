"""Shapes felt by arrays: contacts of 2 × 3 whiskers beside a bar, a ring, a sphere and a cone, which stand where they
are said to, and how large these are by the contacts alone.

    python tests/studies/accuracy/arrays.py [SEEDS]

Signals by exact mechanics (bench/rig), the whole evaluation, and the lines of its surface table for all seeds together:
how far felt contacts lie off the object and along the whisker, how many 95 % intervals hold, and the normals. Then the
sizes felt (size.csv), a line an object: how many are told, their error and stated sigma, RMS, and how many intervals
hold.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.array.shape_verdict import SURFACE_POINTS
from bench.array.size import SIZE
from bench.base.settings import Settings
from bench.rig.simulation import simulate
from bench.workflows.session_evaluation import evaluate

COLUMNS = """
[[columns]]
name = "a"
heights_mm = [-10, 0, 10]
[[columns]]
name = "b"
base_mm = [0, -12, 0]
heights_mm = [-10, 0, 10]
"""
TRIAL = """
[[trials]]
beta_deg = {betas}
d_x_mm = {d_x}
friction = 0.185339
beta_scatter_deg = 5.0
d_x_scatter_mm = 5.0
"""
OBJECTS = {
    "bar of 6 mm": TRIAL.format(betas=[0, 20, 40, 60], d_x=55),
    "ring of 80 mm": TRIAL.format(betas=[0, 20, 40], d_x=55)
    + 'object = "ring"\nring_diameter_mm = 80.0\n',
    "sphere of 60 mm": TRIAL.format(betas=[0, 20, 40], d_x=55)
    + 'object = "sphere"\nbar_diameter_mm = 60.0\n',
    "cone of 40 deg": TRIAL.format(betas=[0, 20, 40], d_x=55)
    + 'object = "cone"\nbar_diameter_mm = 40.0\ncone_half_angle_deg = 20.0\n',
}
ESTIMATORS = ("no_slip", "frictionless", "with_friction", "corrected")


def felt(text: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows of surface.csv and of size.csv of one session."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "protocol.toml").write_text(COLUMNS + text)
        simulate(
            folder / "session", protocol=folder / "protocol.toml", signals_only=True, seed=seed
        )
        settings = Settings(figures=False, alpha_est_sigma_deg=2.0)
        evaluate(folder / "session", folder / "out", settings, workers=0, announce=lambda _: None)
        return (SURFACE_POINTS.read(folder / "out"), SIZE.read(folder / "out"))


def line(name: str, rows: np.ndarray) -> str:
    """RMS off the object and along the whisker with how many intervals hold, and of the normals."""
    parts = []
    for key in ("distance", "along"):
        error, sigma = rows[f"{key}_mm"], rows[f"{key}_sigma_mm"]
        held = 100 * np.mean(np.abs(error) <= 1.959964 * sigma)
        parts.append(f"{np.sqrt(np.mean(error**2)):8.3f} mm {held:4.0f} %")
    off = rows["normal_off_deg"][np.isfinite(rows["normal_off_deg"])]
    normals = f"{np.sqrt(np.mean(off**2)):6.1f} deg" if len(off) else "     -"
    return f"{name:<34}{len(rows):>5}{parts[0]:>20}{parts[1]:>20}  {normals}"


def size_line(name: str, rows: np.ndarray) -> str:
    """Error and sigma of the sizes that are told, and how many of all intervals hold."""
    key, unit = ("half_angle", "deg") if "cone" in name else ("radius", "mm")
    value, sigma, stated = (
        rows[f"{column}_{unit}"] for column in (key, f"{key}_sigma", f"stated_{key}")
    )
    told = rows["status"] == ""
    held = (
        100 * np.mean(np.abs(value - stated)[told] <= 1.959964 * sigma[told])
        if told.any()
        else np.nan
    )
    rms = [
        np.sqrt(np.mean(numbers[told] ** 2)) if told.any() else np.nan
        for numbers in (value - stated, sigma)
    ]
    return f"{name}: {told.sum()} of {len(rows)} told; off {rms[0]:.3f}, stated {rms[1]:.3f} {unit}; {held:.0f} % hold"


def main() -> None:
    """Print a line an object and estimator, and a line on the size of each object."""
    sizes = []
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    print(f"{'':<34}{'n':>5}{'off it, in 95 %':>20}{'along, in 95 %':>20}  normals")
    for name, text in OBJECTS.items():
        rows, found = (
            np.concatenate(tables) for tables in zip(*(felt(text, seed) for seed in range(seeds)))
        )
        sizes.append(size_line(name, found))
        for estimator in ESTIMATORS:
            mine = rows[(rows["estimator"] == estimator) & (rows["status"] == "")]
            print(line(f"{name}, {estimator}", mine), flush=True)
    print(*sizes, sep="\n")


if __name__ == "__main__":
    main()
