"""Compare what two checkouts measure, so that a rewrite that should change nothing is seen to change nothing.

    python tests/studies/net.py sessions FOLDER            # simulate the sessions, once
    python tests/studies/net.py run FOLDER OUT [NAME ...]  # evaluate them by this checkout
    python tests/studies/net.py compare OUT_BEFORE OUT_AFTER

Sessions: fixtures/small-session, steel-sample where it is there, and simulated ones of a sphere, a
cone, a ring, a moving bar and an array. For each table (whisks.csv, estimates.csv, track/*.csv)
`compare` prints whether its bytes are the same, else the largest difference of a number in units
of its stated sigma and how many texts differ. The exit code is 1 where a number moved by more than
MOST_SIGMAS, or a row or a column is there in one run alone.

A checkout that has no such script yet is asked by `--root CHECKOUT`.
"""

import argparse
import csv
import math
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# [sigmas] What another order of floating-point sums may move a number by.
MOST_SIGMAS = 1e-6
CAMERAS = """
[[cameras]]
name = "high"
position_mm = [38.0, -175.0, 335.0]
roll_deg = 0.6
focal_px = 2010.0
[[cameras]]
name = "low"
position_mm = [98.0, -325.0, 120.0]
target_mm = [53.0, 7.0, 0.0]
roll_deg = 1.4
focal_px = 1932.0
[board]
views = 8
[whisker]
sag_mm = 0.2
set_y_mm = 0.5
set_z_mm = -0.3
"""
TRIAL = "[[trials]]\nbeta_deg = 25\nd_x_mm = 55\n"
PROTOCOLS = {
    "sphere": TRIAL + 'object = "sphere"\nbar_diameter_mm = 40\n',
    "cone": TRIAL + 'object = "cone"\ncone_half_angle_deg = 10\nbar_diameter_mm = 8\n',
    "ring": TRIAL + 'object = "ring"\nring_diameter_mm = 60\n',
    "moving": TRIAL + "object_velocity_mm_s = [0, 2, 0]\n",
    "array": '[[columns]]\nname = "a"\nbase_mm = [0, 0, 0]\nheights_mm = [-6, 6]\n' + TRIAL,
}
RECORDED = {
    "small": ROOT / "fixtures" / "small-session",
    "steel": ROOT.parent / "shared" / "sessions" / "steel-sample",
}


def verb(root: Path, *arguments: object) -> None:
    """Run a verb of the command line of a checkout; raise CalledProcessError where it refuses."""
    code = "import sys, whisker_bench; sys.exit(whisker_bench.main())"
    command = [sys.executable, "-c", code, *map(str, arguments)]
    environment = os.environ | {
        "PYTHONPATH": str(root),
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }
    done = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True)
    if done.returncode not in (0, 1):
        raise subprocess.CalledProcessError(done.returncode, command, done.stdout, done.stderr)


def make_sessions(root: Path, folder: Path) -> None:
    """Simulate the sessions that no fixture holds into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, trial in PROTOCOLS.items():
        protocol = folder / f"{name}.toml"
        protocol.write_text(f'name = "{name}"\n{CAMERAS}{trial}')
        verb(root, "simulate", folder / name, "--protocol", protocol, "--seed", 7)


def run(root: Path, folder: Path, out: Path, names: list[str]) -> None:
    """Evaluate sessions by name, all of them where no name is given."""
    sessions = {name: path for name, path in RECORDED.items() if path.is_dir()}
    sessions |= {name: folder / name for name in PROTOCOLS}
    for name in names or sessions:
        verb(root, "evaluate", sessions[name], "--out", out / name, "--no-figures", "--workers", 2)


def tables(out: Path) -> list[Path]:
    """Return the tables of all runs below a folder, as paths relative to it."""
    found = [*out.rglob("whisks.csv"), *out.rglob("estimates.csv"), *out.rglob("track/*.csv")]
    return sorted(path.relative_to(out) for path in found)


def sigma_column(name: str) -> str:
    """Return the name of the column that holds the standard deviation of another one."""
    stem, _, unit = name.rpartition("_")
    return f"{stem}_sigma_{unit}"


def difference(name: str, before: dict[str, str], after: dict[str, str]) -> float:
    """Return how far a cell moved, in sigmas where the row has one, else relative; NaN for text."""
    if before[name] == after[name]:
        return 0.0
    try:
        values = float(before[name]), float(after[name])
    except ValueError:
        return math.nan
    sigma = before.get(sigma_column(name)) or abs(values[0]) or 1.0
    return abs(values[1] - values[0]) / float(sigma)


def compare_table(before: Path, after: Path) -> tuple[float, int]:
    """Return the largest difference of a number of two CSV files, and how many texts differ.

    The difference is infinite where rows or columns are not the same.
    """
    rows = []
    for path in (before, after):
        with path.open(newline="") as file:
            rows.append(list(csv.DictReader(file)))
    if len(rows[0]) != len(rows[1]) or (rows[0] and set(rows[0][0]) - set(rows[1][0])):
        return math.inf, 0
    largest = 0.0
    texts = 0
    for old, new in zip(*rows):
        for name in old:
            moved = difference(name, old, new)
            if math.isnan(moved):
                texts += 1
            else:
                largest = max(largest, moved)
    return largest, texts


def compare(before: Path, after: Path) -> int:
    """Print a line a table that both folders hold; return 1 where a number moved too far."""
    worst = 0.0
    runs = {path.parts[0] for path in tables(after)}
    for path in tables(before):
        if path.parts[0] not in runs:
            continue
        if not (after / path).exists():
            print(f"{path}: is not there")
            worst = math.inf
        elif (before / path).read_bytes() == (after / path).read_bytes():
            print(f"{path}: same bytes")
        else:
            largest, texts = compare_table(before / path, after / path)
            print(f"{path}: {largest:.2g} sigmas at most; {texts} texts differ")
            worst = max(worst, largest)
    return int(worst > MOST_SIGMAS)


def main() -> int:
    """Read the command line and do what it asks."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("verb", choices=("sessions", "run", "compare"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path, nargs="?")
    parser.add_argument("names", nargs="*")
    parser.add_argument("--root", type=Path, default=ROOT)
    options = parser.parse_args()
    if options.verb == "compare":
        return compare(options.folder, options.out)
    folder = options.folder.absolute()
    if options.verb == "sessions":
        make_sessions(options.root.absolute(), folder)
    else:
        run(options.root.absolute(), folder, options.out.absolute(), options.names)
    return 0


if __name__ == "__main__":
    sys.exit(main())
