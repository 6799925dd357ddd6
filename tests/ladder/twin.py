"""A simulated twin of a recorded session, seed by seed through the whole evaluation, against the session itself.

    python tests/ladder/twin.py RECORDED OUT [seeds]

RECORDED is a session with truth files (the steel sample), OUT keeps a line of results a seed: run again, it goes on
where it stopped. Prints RMS errors of d_x, β and slip of both and their ratio, wanted within a factor 1.5. The range
is that of the RMS of one session alone, over the seeds (10 to 90 %): how much RECORDED's own figure is worth.
"""

import csv
import json
import sys
import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from bench.atomic import write_whole
from bench.evaluate import evaluate
from bench.rig.protocol import load
from bench.rig.simulate import simulate
from bench.settings import Settings

TWIN = Path(__file__).with_name("twin.toml")
UNITS = {"d_x": "mm", "beta": "deg", "slip": "mm"}


def errors_of(session: Path, out: Path) -> dict[str, list[float]]:
    """Measured minus true: d_x and β of every whisk, slip of every touching frame."""
    errors = {name: [] for name in UNITS}
    for row in _rows(out / "whisks.csv"):
        folder = session / "trials" / row["trial"]
        truth = tomllib.loads((folder / "truth.toml").read_text())
        for name in ("d_x", "beta"):
            column = f"{name}_{UNITS[name]}"
            errors[name].append(float(row[column] or "nan") - truth[column])
        true = {int(r["frame"]): r for r in _rows(folder / "truth.csv")}
        for seen in _rows(out / "track" / f"{row['trial']}.csv"):
            there = true[int(seen["frame"])]
            if seen["touching"] == there["contact"] == "1":
                errors["slip"].append(float(seen["slip_mm"]) - float(there["slip_mm"]))
    return errors


def _rows(path: Path) -> list[dict]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def evaluated_once(kept: Path, mark: str, session_in: Callable[[Path], Path]) -> dict[str, list[float]]:
    """Errors of the session that `session_in` makes in a folder or finds, unless they were kept with this mark."""
    if kept.exists() and (found := json.loads(kept.read_text()))["mark"] == mark:
        return found["errors"]
    with TemporaryDirectory() as folder:
        session = session_in(Path(folder))
        evaluate(session, Path(folder) / "out", Settings(), workers=1)
        errors = errors_of(session, Path(folder) / "out")
    write_whole(kept, json.dumps({"mark": mark, "errors": errors}))
    return errors


def rms(values) -> float:
    """Over what was measured; a whisk without truth is NaN."""
    return float(np.sqrt(np.nanmean(np.square(values))))


def table(own: dict, twins: list[dict]) -> str:
    """RMS of both, ratio, and the range of a single session's RMS."""
    lines = [f"{len(twins)} seeds   recorded      twin   ratio   one session of the twin"]
    for name, unit in UNITS.items():
        alone = [rms(t[name]) for t in twins]
        low, high = np.percentile(alone, [10, 90])
        recorded, twin = rms(own[name]), rms(np.concatenate([t[name] for t in twins]))
        lines.append(f"{name:<6}{unit:<5}{recorded:9.4f}{twin:10.4f}{twin / recorded:8.2f}   {low:.4f} to {high:.4f}")
    missing = sum(np.isnan(t["d_x"]).sum() for t in twins)
    lines.append(f"whisks of the twin without truth: {missing} of {sum(len(t['d_x']) for t in twins)}")
    return "\n".join(lines)


def _twin(folder: Path, seed: int) -> Path:
    return simulate(folder / "session", protocol=TWIN, seed=seed, workers=1)


def main() -> None:
    recorded, out = Path(sys.argv[1]), Path(sys.argv[2])
    seeds = int(sys.argv[3]) if len(sys.argv) > 3 else 20
    out.mkdir(parents=True, exist_ok=True)
    own, twins = evaluated_once(out / "recorded.json", "recorded", lambda _: recorded), []
    for seed in range(seeds):
        make = partial(_twin, seed=seed)
        twins.append(evaluated_once(out / f"seed{seed:03d}.json", load(TWIN).fingerprint(), make))
        print(table(own, twins), flush=True)


if __name__ == "__main__":
    main()
