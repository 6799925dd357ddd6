"""Truth and (10) without a motor log: angles by the hub's marker, the whisker's base or a stated speed, beside the log.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/angles.py FOLDER [--seeds 1]

FOLDER keeps the sessions: in each, four whisks before two exact cameras. The motor log is left out, `calibrate angles`
finds the angles in the pictures, and all is evaluated. By the speed, which is off by the 1 % that it states, a ruler
states d_x, and the estimates alone are shown. Printed: of d_x and slope as seen, and of d_x by (10), RMS of error, RMS
of z (of (10) against half of its interval's width over 1.96), and how many 95 % intervals hold.
"""

import argparse
import shutil
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
import tomli_w

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench import api
from bench.base.toml_text import read_toml
from bench.cameras.cameras_toml import write_cameras
from bench.commands import cli
from bench.report.score import truth_of
from bench.rig.simulation import simulate
from bench.session.session import load_session
from tests.scenes.no_motor_log import without_log
from tests.scenes.recorded import exact_cameras
from tests.scenes.rig_sessions import CAMERAS_OF_QUICK
from tests.studies.accuracy.rows import HALF_WIDTH_95

PROTOCOL = f"""
name = "angles"
{CAMERAS_OF_QUICK}[board]
views = 1
[gauges]
known = true
[[trials]]
beta_deg = [0, 25, 45, 60]
d_x_mm = 58.0
"""
SPEED_SHARE = 0.01
KEYS = {
    "log": None,
    "marker": 'angle_from = "marker"\nhub_marker = 98',
    "whisker": 'angle_from = "whisker"',
    "speed": 'angle_from = "speed"',
}
SEEN = ("marker", "whisker")  # by `calibrate angles`


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, default=1)
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    found = defaultdict(list)
    for seed in range(arguments.seeds):
        for angle_from in KEYS:
            for name, row in rows_of(arguments.folder, seed, angle_from):
                found[angle_from, name].append(row)
                print(seed, angle_from, name, f"{row[0]:+.4f} ± {row[1]:.4f}", flush=True)
    for (angle_from, name), rows in found.items():
        error, sigma = np.array(rows).T
        z = error / sigma
        print(
            f"{angle_from:8s} {name:9s} n {len(z):3d}  RMS {np.sqrt(np.mean(error**2)):.4f}  "
            f"RMS z {np.sqrt(np.mean(z**2)):.2f}  held {np.mean(np.abs(z) < HALF_WIDTH_95):.0%}"
        )


def rows_of(folder: Path, seed: int, angle_from: str):
    """Yield the quantity, its error and its sigma of each whisk, by angles from somewhere."""
    logged = recorded(folder, seed)
    session = logged
    if KEYS[angle_from] is not None:
        session = folder / f"s{seed}_{angle_from}"
        shutil.rmtree(session, ignore_errors=True)
        without_log(logged, session, KEYS[angle_from])
    if angle_from in SEEN:
        assert cli.main(["calibrate", "angles", str(session)]) == 0
    if angle_from == "speed":
        state_speed_and_distance(session, np.random.default_rng([seed, 2]))
    out = folder / f"s{seed}_{angle_from}_out"
    run = api.evaluate(session, out, figures=False)
    known = load_session(session)
    for whisk in run.whisks if angle_from != "speed" else ():
        truth = truth_of(known, whisk["trial"], int(whisk["whisk"]))
        for name in ("d_x_mm", "beta_deg"):
            sigma = whisk[name.replace("_mm", "_sigma_mm").replace("_deg", "_sigma_deg")]
            if np.isfinite(whisk[name]):
                yield name, (whisk[name] - truth[name], sigma)
            else:
                print(whisk["trial"], whisk["status"])
    for row in run.estimates:
        if row["estimator"] == "with_friction" and np.isfinite(row["d_x_est_high_mm"]):
            true_mm = truth_of(known, row["trial"], int(row["whisk"]))["d_x_mm"]
            width_mm = row["d_x_est_high_mm"] - row["d_x_est_low_mm"]
            yield "(10)", (row["d_x_est_mm"] - true_mm, 0.5 * width_mm / HALF_WIDTH_95)


def recorded(folder: Path, seed: int) -> Path:
    """Return the session of a seed, with exact cameras; made where it is not there."""
    session = folder / f"s{seed}"
    if not (session / "cameras.toml").exists():
        shutil.rmtree(session, ignore_errors=True)
        protocol = folder / "protocol.toml"
        protocol.write_text(PROTOCOL)
        simulate(session, protocol=protocol, seed=seed)
        write_cameras(session / "cameras.toml", exact_cameras(session))
    return session


def state_speed_and_distance(session: Path, rng: np.random.Generator) -> None:
    """State a speed that is off by 1 %, as one sigma says, and each distance by a ruler."""
    manifest = session / "session.toml"
    table = read_toml(manifest, manifest.name)
    table["truth"] = {"source": "stage"}
    manifest.write_text(tomli_w.dumps(table))
    off = 1.0 + SPEED_SHARE * rng.standard_normal()
    for trial in sorted((session / "trials").iterdir()):
        keys = read_toml(trial / "trial.toml", trial.name)
        truth = read_toml(trial / "truth.toml", trial.name)
        keys["speed_deg_s"] *= off
        keys["speed_sigma_deg_s"] = SPEED_SHARE * keys["speed_deg_s"]
        keys["d_x_mm"] = truth["d_x_mm"] + 0.3 * rng.standard_normal()
        keys["d_x_sigma_mm"] = 0.3
        (trial / "trial.toml").write_text(tomli_w.dumps(keys))


if __name__ == "__main__":
    main()
