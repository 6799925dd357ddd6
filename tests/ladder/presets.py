"""Do the stated 95 % intervals hold at each preset, and where whisks climb from one to the next?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/ladder/presets.py SCENES FOLDER

SCENES as for path_traced.py. A table a preset, FOLDER/<preset>.csv, holds a row a scene; one that is there is not seen
again. Prints the coverage of each preset, and for two accuracies that of climbing: each scene by its first preset whose
stated sigma of d_x is no more. Stopping where sigma looks small selects sigmas that are small by chance, so scenes that
stopped before the last preset are shown apart.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from bench.trials.seeing import PRESETS
from tests.ladder.coverage import COLUMNS, row_of, summary
from tests.ladder.path_traced import see_scene
from tests.ladder.rows import all_rows

ACCURACIES_MM = (0.02, 0.05)


def climbed(by_preset: dict[str, list[dict]], accuracy_mm: float) -> dict[str, list[dict]]:
    """Rows by the preset at which each scene stopped."""
    stopped: dict[str, list[dict]] = {name: [] for name in by_preset}
    for rows in zip(*by_preset.values()):
        known = [row.get("d_x_mm_sigma", np.nan) <= accuracy_mm for row in rows]
        place = known.index(True) if any(known) else len(rows) - 1
        stopped[list(by_preset)[place]].append(rows[place])
    return stopped


def main() -> None:
    scenes, folder = Path(sys.argv[1]), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    folders = sorted(path.parents[2] for path in scenes.glob("*/trials/w/truth.toml"))
    by_preset = {}
    for name, settings in PRESETS.items():

        def row(number: int, settings=settings) -> dict:
            return row_of(*see_scene(number, folders[number], settings))

        by_preset[name] = all_rows(folder / f"{name}.csv", COLUMNS, range(len(folders)), row)
        print(name, *summary(by_preset[name]), sep="\n")
    for accuracy_mm in ACCURACIES_MM:
        stopped = climbed(by_preset, accuracy_mm)
        counts = ", ".join(f"{name} {len(rows)}" for name, rows in stopped.items())
        print(f"\nclimbing to {accuracy_mm:g} mm: {counts}")
        last = list(stopped)[-1]
        for title, rows in (("stopped early", [row for name in stopped if name != last for row in stopped[name]]),
                            ("climbed to the end", stopped[last])):
            if any("d_x_mm_error" in row for row in rows):
                print(title, *summary(rows), sep="\n")


if __name__ == "__main__":
    main()
