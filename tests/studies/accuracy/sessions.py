"""Whole sessions of the synthetic rig, boards to verdict: do intervals hold over sessions, and what do whisks share?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/sessions.py FOLDER SEEDS [PROTOCOL]

Seeds 0 to SEEDS - 1 of a protocol (quick, or a file) are recorded with pictures into FOLDER, evaluated, and reduced to
a row of FOLDER/sessions.csv; a session that has its row is not made again, one that is done loses its pictures. Prints
for d_x, touch and slope: the share of whisks whose 95 % interval holds, RMS of z and the largest; then how far a
session's mean error of d_x is off, over what is stated of it (bench/report/summary/shared.py).
"""

import shutil
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench import api
from bench.report.pooled import read_run
from bench.report.score import truth_of
from bench.report.summary.shared import shared_distance
from bench.rig.simulation import simulate
from bench.session.session import Session, load_session
from tests.studies.accuracy.rows import HALF_WIDTH_95, all_rows

NAMES = {"d_x_mm": "d_x_sigma_mm", "touch_deg": "touch_sigma_deg", "beta_deg": "beta_sigma_deg"}
OF_EACH = ("n", "held", "most_z", "rms_z", "mean_error")
COLUMNS = (
    "seed",
    *(f"{name}_{what}" for name in NAMES for what in OF_EACH),
    "d_x_mm_mean_sigma",
    "status",
)


def errors(session: Session, whisks: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Errors and sigmas (n,) of the whisks that have a truth."""
    true = np.array([truth_of(session, row["trial"], int(row["whisk"]))[name] for row in whisks])
    found = whisks[name] - true
    seen = np.isfinite(found)
    return found[seen], whisks[NAMES[name]][seen]


def row_of(folder: Path, seed: int, protocol: str) -> dict:
    """A session recorded, evaluated and reduced."""
    path, out = folder / f"s{seed}", folder / f"out{seed}"
    simulate(path, protocol=protocol, seed=seed, workers=2)
    run, session = api.evaluate(path, out, figures=False, workers=2), load_session(path)
    row: dict = {"seed": seed, "status": ""}
    for name in NAMES:
        error, sigma = errors(session, run.whisks, name)
        z = error / sigma
        values = (
            len(z),
            np.mean(np.abs(z) < HALF_WIDTH_95),
            np.max(np.abs(z)),
            np.sqrt(np.mean(z**2)),
            np.mean(error),
        )
        row |= {f"{name}_{what}": float(value) for what, value in zip(OF_EACH, values)}
    shared = shared_distance(read_run(out))
    shutil.rmtree(path)
    return row | {"d_x_mm_mean_sigma": shared.mean_sigma_mm if shared else np.nan}


def main() -> None:
    folder, seeds, protocol = (
        Path(sys.argv[1]),
        int(sys.argv[2]),
        sys.argv[3] if len(sys.argv) > 3 else "quick",
    )
    rows = all_rows(
        folder / "sessions.csv", COLUMNS, range(seeds), lambda seed: row_of(folder, seed, protocol)
    )
    for name in NAMES:
        n, held, most, rms, mean = (
            np.array([row[f"{name}_{what}"] for row in rows]) for what in OF_EACH
        )
        print(
            f"{name}: {n.sum():.0f} whisks of {len(rows)} sessions, {100 * n @ held / n.sum():.0f} % hold, "
            f"z {np.sqrt(n @ rms**2 / n.sum()):.2f} RMS, {most.max():.1f} at most; mean error of a session "
            f"{np.sqrt(np.mean(mean**2)):.4f} RMS"
        )
    sigma = np.array([row["d_x_mm_mean_sigma"] for row in rows])
    z = np.array([row["d_x_mm_mean_error"] for row in rows]) / sigma
    print(
        f"d_x_mm, of a session's mean: stated {np.sqrt(np.mean(sigma**2)):.4f}, z {np.sqrt(np.mean(z**2)):.2f} RMS"
    )


if __name__ == "__main__":
    main()
