"""What several whiskers cost: CPU seconds to simulate and to evaluate arrays of 1, 5 and 25 whiskers, signals alone.

    python tests/studies/speed/arrays.py [WHISKERS …]

A trial of one whisk each, without figures, in this process; seconds of one core, and those a whisker.
"""

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.settings import Settings
from bench.rig.simulation import simulate
from bench.workflows.session_evaluation import evaluate

COLUMN = """
[[columns]]
name = "{name}"
base_mm = [{x}, {y}, 0]
heights_mm = {heights}
"""


def protocol(whiskers: int) -> str:
    """Columns of up to five whiskers 8 mm apart, motors 12 mm apart along the bar's normal."""
    sizes = [min(5, whiskers - first) for first in range(0, whiskers, 5)]
    columns = [
        COLUMN.format(
            name="abcde"[c], x=0.0, y=-12.0 * c, heights=[8.0 * k - 16.0 for k in range(size)]
        )
        for c, size in enumerate(sizes)
    ]
    return 'name = "array"\n' + "".join(columns) + "[[trials]]\nbeta_deg = 20\nd_x_mm = 60\n"


def cost(whiskers: int, folder: Path) -> tuple[float, float]:
    """CPU seconds of simulating and of evaluating."""
    file = folder / "protocol.toml"
    file.write_text(protocol(whiskers))
    marks = [time.process_time()]
    simulate(folder / "session", protocol=file, signals_only=True)
    marks.append(time.process_time())
    evaluate(
        folder / "session",
        folder / "out",
        Settings(figures=False),
        workers=0,
        announce=lambda _: None,
    )
    marks.append(time.process_time())
    return marks[1] - marks[0], marks[2] - marks[1]


def main() -> None:
    """Print a line a size."""
    print(f"{'whiskers':>8}{'simulate s':>12}{'a whisker':>11}{'evaluate s':>12}{'a whisker':>11}")
    for whiskers in [int(a) for a in sys.argv[1:]] or [1, 5, 25]:
        with TemporaryDirectory() as folder:
            made, judged = cost(whiskers, Path(folder))
        each = f"{made:>12.2f}{made / whiskers:>11.2f}{judged:>12.2f}{judged / whiskers:>11.2f}"
        print(f"{whiskers:>8}{each}", flush=True)


if __name__ == "__main__":
    main()
