"""Does a plan foretell the sigmas that are stated once it is recorded?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/plans.py recorded SCENES OUT TABLE.csv
    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/plans.py painted OUT TABLE.csv

recorded: SCENES holds sessions (path-traced ones, say); each is planned as recorded: rods and cameras where they were
seen, each camera's lines worth what they were. painted: rigs are planned before anything is painted, with no look at
their pictures, then simulated and evaluated. A whisk is a row of TABLE.csv with expected and stated sigmas; a session
that is there is not looked at again. Prints how expected over stated is spread, by quantity, and in how many of all it
is within 0.8 and 1.25; and what a point of the wire and an end of the bar's line were worth in the median
(`bench.plan.changes.USUAL`).
"""

import csv
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.errors import BadInput
from bench.base.workers import Workers
from bench.plan.outlook import QUANTITIES
from bench.plan.plan_files import SIGMAS, STATED
from bench.plan.plan_rows import Row
from bench.plan.run_plan import Options, plan_rig, plan_session
from bench.rig.simulation import simulate
from tests.scenes.planned import TWO_CAMERAS
from vision.geometry.refusals import Refused

LOW, HIGH = 0.8, 1.25
COLUMNS = ("session", "trial", *SIGMAS, *STATED, "wire_px", "bar_px", "status")
# Benches that differ in what a plan must foretell: cameras, lenses, light, noise, frames, slopes.
_THIRD = '\n[[cameras]]\nname = "far"\nposition_mm = [150.0, 260.0, 190.0]\n'
_TRIALS = "[[trials]]\nbeta_deg = [0, 20, 40, 60]\nd_x_mm = {}\n"
RIGS = {
    "usual": TWO_CAMERAS + _TRIALS.format(60.0),
    "near_the_base": TWO_CAMERAS + _TRIALS.format(40.0),
    "three_cameras": TWO_CAMERAS + _THIRD + _TRIALS.format(55.0),
    "long_lenses": TWO_CAMERAS.replace("[98.0", "[80.0").replace(
        '"high"', '"high"\nfocal_px = 2600.0'
    )
    + _TRIALS.format(60.0),
    "noisy": "[pictures]\nread_noise = 3.0\nblur_px = 1.5\n" + TWO_CAMERAS + _TRIALS.format(60.0),
    "one_sided_light": "[light]\nlamp = 0.9\nsoft = 0.05\n" + TWO_CAMERAS + _TRIALS.format(60.0),
    "few_frames": "[pictures]\nstep_deg = 0.9\n" + TWO_CAMERAS + _TRIALS.format(60.0),
    "thin_whisker": "[whisker]\ndiameter_mm = 0.6\n" + TWO_CAMERAS + _TRIALS.format(50.0),
}


def recorded(folder: Path, out: Path) -> Iterator[dict]:
    """Rows of a session as recorded."""
    with Workers(0) as pool:
        made = plan_session(folder, out / folder.name, Options(changes=False), pool)
    yield from (row_of(folder.name, row, row) for row in made.rows)


def painted(name: str, out: Path) -> Iterator[dict]:
    """Rows of a rig: planned, then simulated and seen."""
    out.mkdir(parents=True, exist_ok=True)
    protocol = out / f"{name}.toml"
    protocol.write_text(f'name = "{name}"\n' + RIGS[name])
    session = simulate(out / name / "session", protocol=protocol, seed=1)
    with Workers(0) as pool:
        planned = plan_rig(protocol, out / name / "plan", Options(changes=False), pool)
        seen = plan_session(session, out / name / "seen", Options(changes=False), pool)
    stated = {row.facts.trial: row for row in seen.rows}
    yield from (row_of(name, row, stated[row.facts.trial]) for row in planned.rows)


def row_of(session: str, expected: Row, stated: Row) -> dict:
    """A row of the table. wire_px, bar_px: of the median camera, as recorded."""
    worth = [
        (noise.wire_px, np.median(noise.bar_px[:, 1:]))
        for noise in stated.noise.values()
        if len(noise.bar_px)
    ]
    wire_px, bar_px = np.median(worth, axis=0).tolist() if worth else (np.nan, np.nan)
    sigmas = dict(zip(SIGMAS, (expected.outlook.sigma[name] for name in QUANTITIES)))
    known = dict(zip(STATED, ((stated.stated or {}).get(name, np.nan) for name in QUANTITIES)))
    status = "; ".join(filter(None, [expected.outlook.status, stated.outlook.status]))
    return {
        "session": session,
        "trial": expected.facts.trial,
        **sigmas,
        **known,
        "wire_px": wire_px,
        "bar_px": bar_px,
        "status": status,
    }


def ratios(rows: Sequence[dict]) -> np.ndarray:
    """Expected over stated (rows, quantities)."""
    return np.array(
        [[_number(row[e]) / _number(row[s]) for e, s in zip(SIGMAS, STATED)] for row in rows]
    )


def _number(cell) -> float:
    return float(cell) if cell not in ("", None) else float("nan")


def summary(rows: Sequence[dict]) -> Iterator[str]:
    """How expected and stated compare."""
    found = ratios(rows)
    both = np.all(np.isfinite(found), axis=1)
    yield f"{len(rows)} whisks of {len({row['session'] for row in rows})} sessions, {np.sum(both)} with both"
    for name, column in zip(QUANTITIES, found[both].T):
        inside = np.mean((column > LOW) & (column < HIGH))
        spread = " ".join(f"{x:.2f}" for x in np.quantile(column, [0.05, 0.25, 0.5, 0.75, 0.95]))
        yield f"{name:10} {spread} expected over stated (5, 25, 50, 75, 95 %); {100 * inside:.0f} % within the bounds"
    inside = (found[both] > LOW) & (found[both] < HIGH)
    yield f"all: {100 * np.mean(inside):.1f} % within {LOW} to {HIGH}"
    worth = [np.nanmedian([_number(row[name]) for row in rows]) for name in ("wire_px", "bar_px")]
    yield "a point of the wire is worth {:.3f} px, an end of the bar's line {:.3f} px, in the median".format(
        *worth
    )
    for row, one in zip(rows, found):
        far = [f"{name} {x:.2f}" for name, x in zip(QUANTITIES, one) if not LOW < x < HIGH]
        if far:
            yield f"  {row['session']} {row['trial']}: {', '.join(far)} {row['status']}"


def _tasks(kind: str, scenes: str = "") -> dict[str, tuple]:
    """By name what is to be looked at, and how."""
    if kind == "painted":
        return {name: (painted, name) for name in RIGS}
    folders = sorted(path for path in Path(scenes).iterdir() if (path / "session.toml").is_file())
    return {folder.name: (recorded, folder) for folder in folders}


def main() -> None:
    *what, out, table = sys.argv[1:]
    tasks = _tasks(*what)
    rows = (
        list(csv.DictReader(Path(table).read_text().splitlines())) if Path(table).is_file() else []
    )
    there = {row["session"] for row in rows}
    for name, (look, what) in tasks.items():
        if name in there:
            continue
        try:
            rows += look(what, Path(out))
        except (BadInput, Refused) as reason:
            print(f"{name}: {reason}", flush=True)
            continue
        with Path(table).open("w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)
    print(*summary(rows), sep="\n")


if __name__ == "__main__":
    main()
