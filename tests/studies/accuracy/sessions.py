"""Whole sessions of the synthetic rig, boards to verdict: do intervals hold over sessions, and what do whisks share?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/sessions.py FOLDER SEEDS [PROTOCOL]

Seeds 0 to SEEDS - 1 of a protocol (quick, or a file) are recorded with pictures into FOLDER, evaluated, and reduced to
a row of FOLDER/sessions.csv; a session that has its row is not made again, one that is done loses its pictures. Prints
for d_x, touch, slope, slip and the contact (x, y, z in the first frame that touches): the share of whisks whose 95 %
interval holds, RMS of z and the largest; then how far a session's mean error is off, what is stated of it by what its
whisks share (the columns of whisks.csv) and what each has of its own, and RMS of that z.
"""

import shutil
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench import api
from bench.base.tables import shared_name, sigma_name
from bench.report.score import truth_of
from bench.report.whisk_tables import PLACE, TRACK
from bench.rig.simulation import simulate
from bench.session.session import Session, load_session
from tests.studies.accuracy.rows import HALF_WIDTH_95, all_rows

# Columns of whisks.csv, and keys of truth.toml.
AT_TOUCH = {"d_x_mm": "d_x_mm", "touch_deg": "touch_deg", "beta_deg": "beta_deg"}
NAMES = (*AT_TOUCH, "slip_mm", *PLACE)
OF_EACH = ("n", "held", "most_z", "rms_z", "mean_error", "mean_sigma")
COLUMNS = ("seed", *(f"{name}_{what}" for name in NAMES for what in OF_EACH), "status")
SLIP_THETA_DEG = 3.0  # at which truth.toml states the slip


def errors(session: Session, out: Path, whisks: np.ndarray, name: str) -> np.ndarray:
    """Errors, sigmas and shared parts of these (n, 3) of a quantity of the whisks that have a truth."""
    found = []
    for row in whisks:
        if name in PLACE:
            value, sigma, true = first_contact(session, out, row["trial"], int(row["whisk"]), name)
        else:
            value, sigma = row[name], row[sigma_name(name)]
            true = true_value(session, row, name)
        found.append([value - true, sigma, row[shared_name(name)]])
    found = np.array(found)
    return found[np.isfinite(found).all(axis=1)]


def true_value(session: Session, row, name: str) -> float:
    """The true value of a column of whisks.csv; NaN of a slip at another pushing angle than is stated."""
    truth = truth_of(session, row["trial"], int(row["whisk"]))
    if name == "slip_mm":
        return truth["slip_at_3deg_mm"] if row["theta_deg"] == SLIP_THETA_DEG else np.nan
    return truth[AT_TOUCH[name]]


def first_contact(
    session: Session, out: Path, trial: str, whisk: int, name: str
) -> tuple[float, float, float]:
    """A coordinate of the contact in a whisk's first touching frame as seen, its sigma, and as it is; NaN without."""
    track = TRACK.read_file(out / "track" / f"{trial}.csv")
    truth = np.genfromtxt(session.trial(trial).own("truth.csv"), delimiter=",", names=True)
    touches = (truth["contact"] == 1)[track["frame"]]
    rows = track[(track["whisk"] == whisk) & (track["touching"] == 1) & touches]
    if len(rows) == 0:
        return np.nan, np.nan, np.nan
    first = rows[0]
    return first[name], first[sigma_name(name)], truth[name][first["frame"]]


def figures(found: np.ndarray) -> tuple[float, ...]:
    """OF_EACH of errors, sigmas and shared parts (n, 3)."""
    error, sigma, shared = found.T
    z = error / sigma
    own_variance = np.mean(np.maximum(sigma**2 - shared**2, 0.0))
    mean_sigma = np.sqrt(np.mean(shared**2) + own_variance / len(z))
    return (
        len(z),
        np.mean(np.abs(z) < HALF_WIDTH_95),
        np.max(np.abs(z)),
        np.sqrt(np.mean(z**2)),
        np.mean(error),
        mean_sigma,
    )


def row_of(folder: Path, seed: int, protocol: str) -> dict:
    """A session recorded, evaluated and reduced."""
    path = folder / f"s{seed}"
    out = folder / f"out{seed}"
    simulate(path, protocol=protocol, seed=seed, workers=2)
    run = api.evaluate(path, out, figures=False, workers=2)
    row = row_of_run(load_session(path), out, run.whisks)
    shutil.rmtree(path)
    return {"seed": seed, **row}


def row_of_run(session: Session, out: Path, whisks: np.ndarray) -> dict:
    """The columns of an evaluated session, but for its seed."""
    row: dict = {"status": ""}
    for name in NAMES:
        values = figures(errors(session, out, whisks, name))
        row |= {f"{name}_{what}": float(value) for what, value in zip(OF_EACH, values)}
    return row


def lines(rows: list[dict]) -> list[str]:
    """What is printed of all sessions: two lines a quantity."""
    found = []
    for name in NAMES:
        each = np.array([[row[f"{name}_{what}"] for what in OF_EACH] for row in rows])
        n, held, most, rms, mean, mean_sigma = each.T
        found.append(
            f"{name}: {n.sum():.0f} whisks of {len(rows)} sessions, {100 * n @ held / n.sum():.0f} % hold, "
            f"z {np.sqrt(n @ rms**2 / n.sum()):.2f} RMS, {most.max():.1f} at most"
        )
        found.append(
            f"  mean error of a session {np.sqrt(np.mean(mean**2)):.4f} RMS, stated "
            f"{np.sqrt(np.mean(mean_sigma**2)):.4f}, z {np.sqrt(np.mean((mean / mean_sigma) ** 2)):.2f} RMS"
        )
    return found


def main() -> None:
    folder = Path(sys.argv[1])
    seeds = int(sys.argv[2])
    protocol = sys.argv[3] if len(sys.argv) > 3 else "quick"
    rows = all_rows(
        folder / "sessions.csv", COLUMNS, range(seeds), lambda seed: row_of(folder, seed, protocol)
    )
    print(*lines(rows), sep="\n")


if __name__ == "__main__":
    main()
