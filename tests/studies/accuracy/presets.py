"""Do the stated 95 % intervals hold at each preset, and where whisks climb from one to the next?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/presets.py SCENES FOLDER

SCENES as for path_traced.py. A table a preset, FOLDER/<preset>.csv, holds a row a scene; one that is there is not seen
again: interrupt it and go on at will, the scenes done are seen at all presets. Prints the coverage of each preset, and
for two accuracies that of climbing: each scene by its first preset whose stated sigma of d_x is no more. Stopping where
sigma looks small selects sigmas that are small by chance, so scenes that stopped before the last preset are shown
apart. Last: by how much of its sigma each preset differs from the one before, and how many do by a tenth at most.
"""

import sys
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.trials.seeing import PRESETS
from tests.studies.accuracy.coverage import COLUMNS, QUANTITIES, row_of, summary
from tests.studies.accuracy.path_traced import see_scene
from tests.studies.accuracy.rows import all_rows

ACCURACIES_MM = (0.02, 0.05)
SAME = 0.1  # of a sigma


def climbed(by_preset: dict[str, list[dict]], accuracy_mm: float) -> dict[str, list[dict]]:
    """Rows by the preset at which each scene stopped."""
    stopped: dict[str, list[dict]] = {name: [] for name in by_preset}
    for rows in zip(*by_preset.values()):
        known = [row.get("d_x_mm_sigma", np.nan) <= accuracy_mm for row in rows]
        place = known.index(True) if any(known) else len(rows) - 1
        stopped[list(by_preset)[place]].append(rows[place])
    return stopped


def apart(before: list[dict], after: list[dict]) -> Iterator[str]:
    """A line a quantity: how far the same scenes' values are from one preset to the next, in sigmas of the latter."""
    for name in QUANTITIES:
        moved = np.array(
            [a[f"{name}_error"] - b[f"{name}_error"] for b, a in zip(before, after) if _both(b, a)]
        )
        sigma = np.array([a[f"{name}_sigma"] for b, a in zip(before, after) if _both(b, a)])
        z = np.abs(moved / sigma)
        within = 100 * np.mean(z <= SAME)
        yield f"{name:10s} {np.median(z):.2f} sigma in the median, {z.max():.2f} at most, {within:.0f} % in {SAME:g}"


def _both(*rows: dict) -> bool:
    return all(np.isfinite(row.get("d_x_mm_sigma", np.nan)) for row in rows)


def see_all(folders: Sequence[Path], out: Path) -> dict[str, list[dict]]:
    """Rows by preset; scene by scene, so that those done are seen at all of them."""
    by_preset = {}
    for number in range(len(folders)):
        for name, settings in PRESETS.items():

            def row(number: int, settings=settings) -> dict:
                return row_of(*see_scene(folders[number], settings)) | {"seed": number}

            by_preset[name] = all_rows(out / f"{name}.csv", COLUMNS, [number], row)
    return by_preset


def main() -> None:
    scenes, folder = Path(sys.argv[1]), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    by_preset = see_all(
        sorted(path.parents[2] for path in scenes.glob("*/trials/w/truth.toml")), folder
    )
    for name, rows in by_preset.items():
        print(name, *summary(rows), sep="\n")
    for accuracy_mm in ACCURACIES_MM:
        stopped = climbed(by_preset, accuracy_mm)
        counts = ", ".join(f"{name} {len(rows)}" for name, rows in stopped.items())
        print(f"\nclimbing to {accuracy_mm:g} mm: {counts}")
        last = list(stopped)[-1]
        for title, rows in (
            ("stopped early", [row for name in stopped if name != last for row in stopped[name]]),
            ("climbed to the end", stopped[last]),
        ):
            if any("d_x_mm_error" in row for row in rows):
                print(title, *summary(rows), sep="\n")
    for before, after in pairwise(by_preset):
        print(f"\n{after} against {before}", *apart(by_preset[before], by_preset[after]), sep="\n")


if __name__ == "__main__":
    main()
