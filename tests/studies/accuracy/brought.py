"""What a lab brings against the native way: d_x of simulated whisks whose truth is known, one table of all ways.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/brought.py FOLDER [--seeds 1] [--only WAY]

Calls the studies of the single ways (stage.py, given_traces.py, mirror.py, board_kinds.py, angles.py) and keeps sessions
and results in FOLDER: a way that has its rows in FOLDER/brought.csv is not made again. Prints of each way the whisks, RMS
of d_x's error and of its sigma, both of the native way on the same whisks or at the same places, and whether error and
sigma are at most what was asked for: twice the native sigma (of a stage its own), of traces 0.05 mm, of a mirror 1.5 times
what two cameras give.
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.session.session import load_session
from tests.studies.accuracy import angles, board_kinds, given_traces, mirror, stage
from tests.studies.accuracy.rows import all_rows

MOST_TRACES_MM = 0.05
MOST_OF_MIRROR = 1.5
MOST_OF_NATIVE = 2.0
STAGE_WHISKS = 100
COLUMNS = ("look", "n", "rms", "sigma", "native_rms", "native_sigma", "most")
Way = tuple[float, float, float]  # whisks, RMS of error and of sigma, mm


def of_whisks(found: list) -> Way:
    """Whisks and RMS of errors and sigmas (n, 2)."""
    table = np.array(found)
    table = table[np.isfinite(table).all(axis=1)]
    return (len(table), *np.sqrt(np.mean(table**2, axis=0)).tolist())


def row(look: str, way: Way, native: Way, most_mm: float) -> dict:
    """The row of a way: most_mm is what error and sigma may be."""
    return dict(zip(COLUMNS, (look, *way, *native[1:], most_mm)))


def by_stage(folder: Path, seeds: range, workers: int) -> Iterator[dict]:
    """Yield the row of a bar's place by a stage."""
    session = load_session(stage.SESSION)
    drawn = []
    for seed in seeds:
        drawn += stage.drawn_whisks(session, "bar", STAGE_WHISKS, seed + 1)
    way = of_whisks([(w.d_x_error_mm, w.d_x_sigma_mm) for w in drawn])
    yield row("stage", way, way, MOST_OF_NATIVE * way[2])


def by_traces(folder: Path, seeds: range, workers: int) -> Iterator[dict]:
    """Yield the rows of traces beside pictures and without."""
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[str, list] = {}
    for seed in seeds:
        for name, d_x, *_ in given_traces.whisks(folder, seed, 0.1, given_traces.TOO):
            found.setdefault(name, []).append(d_x)
    native = of_whisks(found["pictures"])
    yield row("traces", of_whisks(found["traces"]), native, MOST_TRACES_MM)
    yield row("traces-only", of_whisks(found["alone"]), native, MOST_TRACES_MM)


def by_mirror(folder: Path, seeds: range, workers: int) -> Iterator[dict]:
    """Yield the row of one camera and a mirror."""
    found = {}
    for kind, rows in mirror.rows_of(folder, seeds, workers).items():
        n, _, _, rms, rms_sigma = mirror.pooled(rows, "d_x_mm")
        found[kind] = (n, rms, rms_sigma)
    most_mm = MOST_OF_MIRROR * max(found["two"][1:])
    yield row("mirror", found["mirror"], found["two"], most_mm)


def by_boards(folder: Path, seeds: range, workers: int) -> Iterator[dict]:
    """Yield the rows of other boards than ChArUco."""
    found = {}
    for name in board_kinds.ON_RIG:
        one = board_kinds.whisks_of(folder, name, workers)
        found[name] = tuple(one[f"d_x_{what}"] for what in ("n", "rms", "rms_sigma"))
    native = found.pop("charuco")
    for name, way in found.items():
        yield row(name, way, native, MOST_OF_NATIVE * native[2])


def by_angles(folder: Path, seeds: range, workers: int) -> Iterator[dict]:
    """Yield the rows of angles by pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[str, list] = {}
    for angle_from in ("log", *angles.SEEN):
        for seed in seeds:
            for name, d_x in angles.rows_of(folder, seed, angle_from):
                if name == "d_x_mm":
                    found.setdefault(angle_from, []).append(d_x)
    native = of_whisks(found.pop("log"))
    for angle_from, whisks in found.items():
        yield row(angle_from, of_whisks(whisks), native, MOST_OF_NATIVE * native[2])


Rows = Callable[[Path, range, int], Iterator[dict]]
WAYS: dict[str, tuple[Rows, tuple[str, ...]]] = {
    "stage": (by_stage, ("stage",)),
    "traces": (by_traces, ("traces", "traces-only")),
    "mirror": (by_mirror, ("mirror",)),
    "boards": (by_boards, tuple(name for name in board_kinds.ON_RIG if name != "charuco")),
    "angles": (by_angles, angles.SEEN),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only", choices=WAYS)
    options = parser.parse_args()
    rows: list[dict] = []
    for name, (rows_of, looks) in WAYS.items():
        made: dict[str, dict] = {}

        def make(look: str, name=name, rows_of=rows_of, made=made) -> dict:
            """The row of a look, made with all others of its way."""
            if not made:
                found = rows_of(options.folder / name, range(options.seeds), options.workers)
                made |= {one["look"]: one for one in found}
            return made[look]

        wanted = looks if options.only in (None, name) else ()
        rows = all_rows(options.folder / "brought.csv", COLUMNS, wanted, make)
    print("| way | whisks | error, mm | sigma, mm | native error | native sigma | at most | |")
    print("|---|---|---|---|---|---|---|---|")
    for one in rows:
        numbers = " | ".join(f"{one[name]:.4f}" for name in COLUMNS[2:])
        holds = "holds" if max(one["rms"], one["sigma"]) <= one["most"] else "does not hold"
        print(f"| {one['look']} | {one['n']:.0f} | {numbers} | {holds} |")


if __name__ == "__main__":
    main()
