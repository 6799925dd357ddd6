"""What a lab brings against the native way: d_x of simulated whisks whose truth is known, one table of all ways.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/brought.py FOLDER [--seeds 6] [--only WAY]

Calls the studies of the single ways (stage.py, given_traces.py, mirror.py, board_kinds.py, angles.py). A seed that has its
row in FOLDER/<way>.csv is not made again. Prints of each way the whisks, how many 95 % intervals hold, and how often
chance alone would leave so few or so many; RMS of d_x's error and of its sigma, both of the native way on the same whisks
or at the same places, and whether error and sigma are at most what was asked for: twice the native sigma (of a stage its
own), of traces 0.05 mm, of a mirror 1.5 times what two cameras give.
"""

import argparse
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from scipy.stats import binomtest

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.session.session import load_session
from tests.studies.accuracy import angles, board_kinds, given_traces, mirror, stage
from tests.studies.accuracy.rows import all_rows
from tests.studies.accuracy.whisk_errors import (
    Figures,
    as_columns,
    columns_of,
    of_columns,
    of_whisks,
    pooled,
)

MOST_TRACES_MM = 0.05
MOST_OF_MIRROR = 1.5
MOST_OF_NATIVE = 2.0
LASTING_PX = 0.1
STAGE_WHISKS = 100


def by_stage(folder: Path, seed: int, workers: int) -> dict[str, Figures]:
    """A bar's place by a stage."""
    session = load_session(stage.SESSION)
    drawn = stage.drawn_whisks(session, "bar", STAGE_WHISKS, seed + 1)
    return {"stage": of_whisks([(w.d_x_error_mm, w.d_x_sigma_mm) for w in drawn])}


def by_traces(folder: Path, seed: int, workers: int) -> dict[str, Figures]:
    """Traces beside pictures and without, and pictures alone."""
    found: dict[str, list] = {}
    for name, d_x, *_ in given_traces.whisks(folder, seed, LASTING_PX, given_traces.TOO):
        found.setdefault(name, []).append(d_x)
    shutil.rmtree(folder / f"s{seed}")
    return {name: of_whisks(whisks) for name, whisks in found.items()}


def by_mirror(folder: Path, seed: int, workers: int) -> dict[str, Figures]:
    """One camera and a mirror, and two cameras at the same places."""
    found = {}
    for kind, rows in mirror.rows_of(folder, range(seed, seed + 1), workers).items():
        (row,) = (row for row in rows if row["seed"] == seed)
        found[kind] = of_columns(row, "d_x_mm")
    return found


def by_boards(folder: Path, seed: int, workers: int) -> dict[str, Figures]:
    """Each kind of board, ChArUco among them."""
    found = {}
    for name in board_kinds.ON_RIG:
        row = board_kinds.row_of(folder, name, board_kinds.FIRST_SEED + seed, workers)
        found[name] = of_columns(row, "d_x")
    return found


def by_angles(folder: Path, seed: int, workers: int) -> dict[str, Figures]:
    """Angles by pictures, and by the log."""
    found: dict[str, list] = {}
    for angle_from in ("log", *angles.SEEN):
        for name, d_x in angles.rows_of(folder, seed, angle_from):
            if name == "d_x_mm":
                found.setdefault(angle_from, []).append(d_x)
    for session in folder.glob(f"s{seed}*"):
        shutil.rmtree(session)
    return {angle_from: of_whisks(whisks) for angle_from, whisks in found.items()}


def twice_native(native: Figures) -> float:
    """What error and sigma may be, mm."""
    return MOST_OF_NATIVE * native["rms_sigma"]


@dataclass(frozen=True)
class Way:
    """How whisks of a seed are seen.

    native: the look that the others are held against. most_mm: by its figures, what error and sigma of these may be.
    """

    figures: Callable[[Path, int, int], dict[str, Figures]]
    looks: tuple[str, ...]
    native: str
    most_mm: Callable[[Figures], float] = twice_native


WAYS = {
    "stage": Way(by_stage, ("stage",), "stage"),
    "traces": Way(by_traces, ("traces", "alone"), "pictures", lambda _: MOST_TRACES_MM),
    "mirror": Way(
        by_mirror,
        ("mirror",),
        "two",
        lambda two: MOST_OF_MIRROR * max(two["rms"], two["rms_sigma"]),
    ),
    "boards": Way(by_boards, tuple(k for k in board_kinds.ON_RIG if k != "charuco"), "charuco"),
    "angles": Way(by_angles, angles.SEEN, "log"),
}


def rows_of(folder: Path, name: str, seeds: int, workers: int) -> dict[str, list[Figures]]:
    """Return by look the figures of each seed of a way, made where they are not there."""
    way = WAYS[name]
    looks = dict.fromkeys((way.native, *way.looks))
    columns = ("seed", *columns_of(looks))

    def row_of(seed: int) -> dict:
        """The row of a seed."""
        (folder / name).mkdir(parents=True, exist_ok=True)
        row: dict = {"seed": seed}
        for look, figures in way.figures(folder / name, seed, workers).items():
            row |= as_columns(look, figures)
        return row

    rows = all_rows(folder / f"{name}.csv", columns, range(seeds), row_of)
    return {look: [of_columns(row, look) for row in rows] for look in looks}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only", choices=WAYS)
    options = parser.parse_args()
    print(
        "| way | whisks | hold | by chance | z | error | sigma | native error | sigma | at most | |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for name in WAYS if options.only is None else (options.only,):
        rows = rows_of(options.folder, name, options.seeds, options.workers)
        native = pooled(rows[WAYS[name].native])
        most_mm = WAYS[name].most_mm(native)
        for look, of_seeds in rows.items():
            way = pooled(of_seeds)
            n = round(way["n"])
            chance = binomtest(round(way["held"] * n), n, 0.95).pvalue
            roots = " | ".join(f"{way[what]:.4f}" for what in ("rms", "rms_sigma"))
            of_native = f"{native['rms']:.4f} | {native['rms_sigma']:.4f} | {most_mm:.4f}"
            holds = max(way["rms"], way["rms_sigma"]) <= most_mm
            print(
                f"| {look} | {n} | {way['held']:.1%} | {chance:.2f} | {way['rms_z']:.2f} | {roots} | {of_native} "
                f"| {'holds' if holds else 'does not hold'} |"
            )


if __name__ == "__main__":
    main()
