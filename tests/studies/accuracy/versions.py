"""The small session evaluated in several environments: do they agree, whatever versions they hold?

    python tests/studies/accuracy/versions.py OUT PYTHON PYTHON ...

OUT takes a run of each interpreter. Each is compared with the first; prints versions and the largest difference in
stated sigmas, and ends with exit code 1 where it is above MOST_SIGMAS. `make test-versions` makes the environments.
"""

import csv
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
SESSION = ROOT / "fixtures" / "small-session"
# Asked for. OpenCV 4.14 with NumPy 1.26 and SciPy 1.12 beside 5.0, 2.4 and 1.17: 0.005 in each of six runs.
MOST_SIGMAS = 0.1


def verb(python: str, *arguments) -> str:
    """What a verb prints in an environment. Raises CalledProcessError where it refuses."""
    one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1") | {
        "PYTHONPATH": str(ROOT)
    }
    done = subprocess.run(
        [python, "-m", "bench.commands.cli", *map(str, arguments)],
        env=os.environ | one,
        capture_output=True,
        text=True,
    )
    if done.returncode not in (0, 1):
        raise subprocess.CalledProcessError(done.returncode, done.args, done.stdout, done.stderr)
    return done.stdout


def largest(table: Path) -> tuple[float, str]:
    """The largest difference of a table of `compare`, in sigmas, and of what it is; infinite where one has no value."""
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert rows, "nothing was compared"
    sizes = [
        (abs(float(row["sigmas"] or "inf")), f"{row['quantity']} of {row['trial']}") for row in rows
    ]
    return max(sizes)


def main(out: Path, pythons: list[str]) -> int:
    """0 where all agree."""
    runs, worst = [out / str(k) for k in range(len(pythons))], 0.0
    with ThreadPoolExecutor() as pool:
        told = [pool.submit(verb, python, "info") for python in pythons]
        done = [
            pool.submit(verb, python, "evaluate", SESSION, "--out", run, "--no-figures")
            for python, run in zip(pythons, runs)
        ]
        told, _ = ([one.result() for one in some] for some in (told, done))
    for k, (python, versions) in enumerate(zip(pythons, told)):
        print(f"{python}: {', '.join(versions.split(chr(10))[1:-1])}", flush=True)
        if k:
            table = out / f"{k}.csv"
            verb(pythons[0], "compare", runs[0], runs[k], "--out", table)
            sigmas, where = largest(table)
            print(f"  {sigmas:.3f} sigma from the first at most ({where})", flush=True)
            worst = max(worst, sigmas)
    return int(worst > MOST_SIGMAS)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), sys.argv[2:]))
