"""Rings, spheres and cones in pictures: what is seen of each against the rig's truth.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/rounded_seen.py FOLDER [SEEDS [OBJECT …]]

Sessions of the rig of one whisker, a trial a slope, boards to verdict, of two seeds by default; OBJECT: names of
OBJECTS. A session that has its rows in FOLDER is not made again. Prints a line an object: how many whisks have a truth,
how many of these a status; of d_x, touch, β, ψ and slip the RMS error, how many 95 % intervals hold and the largest z;
and CPU seconds a whisk of seeing and of simulating.
"""

import json
import shutil
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench import api
from bench.base.settings import Settings
from bench.report.score import truth_of
from bench.rig.simulation import simulate
from bench.session.session import load_session
from bench.workflows.session_evaluation import evaluate
from tests.studies.accuracy.arrays_seen import CAMERAS, NAMES, SIGMAS

OBJECTS = {
    "sphere of 40 mm": 'object = "sphere"\nbar_diameter_mm = 40\n',
    "sphere of 12 mm": 'object = "sphere"\nbar_diameter_mm = 12\n',
    "ring of 80 mm": 'object = "ring"\nring_diameter_mm = 80\n',
    "ring of 30 mm": 'object = "ring"\nring_diameter_mm = 30\n',
    "cone of 40 deg": 'object = "cone"\ncone_half_angle_deg = 20\nbar_diameter_mm = 12\n',
    "cone of 20 deg": 'object = "cone"\ncone_half_angle_deg = 10\nbar_diameter_mm = 8\n',
}
BETAS = (0, 10, 20, 30, 45, 60)
TRIAL = "[[trials]]\nbeta_deg = {beta}\nd_x_mm = {d_x}\n{object}"
NAMES = NAMES | {"psi_deg": "psi_deg"}
SIGMAS = SIGMAS | {"psi_deg": "psi_sigma_deg"}


def protocol(name: str) -> str:
    """The protocol of a session."""
    return CAMERAS + "".join(
        TRIAL.format(beta=beta, d_x=45 + 4 * k, object=OBJECTS[name])
        for k, beta in enumerate(BETAS)
    )


def made(folder: Path, name: str, seed: int) -> dict:
    """Errors, sigmas and costs of one session, which loses its pictures."""
    place = folder / f"{name.replace(' ', '_')}_{seed}"
    if (record := place.with_suffix(".json")).exists():
        return json.loads(record.read_text())
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    (place / "protocol.toml").write_text(protocol(name))
    marks = [time.process_time()]
    session = simulate(place / "session", protocol=place / "protocol.toml", seed=seed)
    marks.append(time.process_time())
    evaluate(session, place / "out", Settings(figures=False), workers=0, announce=lambda _: None)
    marks.append(time.process_time())
    view = load_session(session)
    found = {
        "whisks": [_whisk(row, view) for row in api.read(place / "out").table("whisks")],
        "cpu_s": np.diff(marks).tolist(),
    }
    record.write_text(json.dumps(found))
    shutil.rmtree(session)
    return found


def _whisk(row: np.ndarray, view) -> dict:
    true = truth_of(view, row["trial"], int(row["whisk"]))
    values = {
        key: [float(row[key] - true[told]), float(row[SIGMAS[key]])] for key, told in NAMES.items()
    }
    return values | {"trial": str(row["trial"]), "status": str(row["status"])}


def line(name: str, sessions: list[dict]) -> str:
    """What all sessions of an object say."""
    whisks = [whisk for one in sessions for whisk in one["whisks"]]
    seen = [whisk for whisk in whisks if np.isfinite(whisk["d_x_mm"][0])]
    parts = [
        f"{name}: {len(seen)} of {len(whisks)} seen, {sum(bool(w['status']) for w in seen)} with a status"
    ]
    for key in NAMES:
        error, sigma = np.array([whisk[key] for whisk in seen]).T
        z = np.abs(error / sigma)
        rms, held = np.sqrt(np.nanmean(error**2)), 100 * np.nanmean(z <= 1.959964)
        parts.append(f"{key} RMS {rms:.4f}, {held:.0f} % hold, most |z| {np.nanmax(z):.2f}")
    cost = np.mean([np.array(one["cpu_s"]) / len(one["whisks"]) for one in sessions], axis=0)
    return "; ".join([*parts, f"CPU {cost[1]:.1f} s a whisk to see, {cost[0]:.1f} to simulate"])


def main() -> None:
    """Print a line an object, and each whisk that is not seen, or beyond three sigma."""
    folder, seeds = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 2
    for name in sys.argv[3:] or OBJECTS:
        sessions = [made(folder, name, seed) for seed in range(seeds)]
        print(line(name, sessions), flush=True)
        for whisk in (whisk for one in sessions for whisk in one["whisks"]):
            if not all(abs(whisk[key][0]) < 3.0 * whisk[key][1] for key in NAMES):
                print("      beyond three sigma, or not seen:", whisk, flush=True)


if __name__ == "__main__":
    main()
