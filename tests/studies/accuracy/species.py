"""Four kinds of whisker, boards to verdict: what pictures and gauges make of a session of each.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/species.py FOLDER [PROTOCOL ...]

A session of each protocol (nitinol, thin-wire, polymer-cone and vibrissa, or those named) is recorded with pictures
into FOLDER and evaluated, where that is not done yet; some minutes each. Prints a row of docs/rig.md each: RMS errors of
the truth, of α seen and of (10), each with its largest |z|; errors of the two gauges' own factors; and how many warnings.
"""

import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench import api
from bench.analyses.pooling import rms
from bench.report.score import Score, scores_of
from bench.rig.simulation import simulate
from bench.session.session import load_session

SPECIES = ("nitinol", "thin-wire", "polymer-cone", "vibrissa")
SEED = 1
# Quantities of the score, and their units.
COLUMNS = {
    "d_x_mm": "mm",
    "touch_deg": "°",
    "beta_deg": "°",
    "slip_mm, touching frames": "mm",
    "z_mm, touching frames": "mm",
    "alpha_seen_deg": "°",
    "d_x by with_friction": "mm",
}


def cell(score: Score, unit: str) -> str:
    """RMS error of a quantity, and the largest |z|."""
    return f"{rms(score.errors):.2g} {unit}, {np.abs(score.errors / score.sigmas).max():.1f}"


def row(folder: Path, protocol: str) -> str:
    """A line of the table."""
    path = folder / protocol
    out = folder / f"{protocol}-out"
    if not path.is_dir():
        simulate(path, protocol=protocol, seed=SEED)
    run = api.read(out) if (out / "run.json").is_file() else api.evaluate(path, out, figures=False)
    session = load_session(path)
    by_name = {score.name: score for score in scores_of(session, out)}
    cells = [cell(by_name[name], unit) for name, unit in COLUMNS.items()]
    true = np.array(json.loads((path / "truth.json").read_text())["gauge_matrix_Nmm_per_V"])
    factors = np.diag(run.record.gauges.matrix_Nmm_per_V) / np.diag(true)
    gauges = ", ".join(f"{100 * (factor - 1):+.2f} %" for factor in factors)
    return " | ".join([f"| {protocol}", *cells, gauges, f"{len(run.warnings)} |"])


def main() -> None:
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for protocol in sys.argv[2:] or SPECIES:
        print(row(folder, protocol), flush=True)


if __name__ == "__main__":
    main()
