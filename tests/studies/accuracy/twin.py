"""A simulated twin of a recorded session: what the cameras' half of the evaluation is off by in both.

    python tests/studies/accuracy/twin.py RECORDED OUT [seeds]

RECORDED is a session with truth files (the steel sample's exact copy, by fixtures/say_exact.py), OUT keeps a file of
errors a seed: run again, it goes on where it stopped. Cameras are calibrated from each session's own boards. Prints RMS
errors of d_x, β and slip over all trials of both, and their ratio, wanted within a factor 1.5. The range is that of the
RMS of one session of the twin alone (10 to 90 % of the seeds): how much RECORDED's own figure is worth.
"""

import csv
import json
import math
import sys
import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.atomic import write_whole
from bench.base.settings import Settings
from bench.cameras.session_cameras import calibrate_session
from bench.rig.protocol import load
from bench.rig.simulation import simulate
from bench.session.session import load_session
from bench.session.signals import read_signals
from bench.trials.seen import see_trial
from bench.trials.trial_frames import TrialInputs

TWIN = Path(__file__).with_name("twin.toml")
UNITS = {"d_x": "mm", "beta": "deg", "slip": "mm"}


def errors_of(session_path: Path, out: Path) -> dict[str, list[float]]:
    """Seen minus true: d_x and β of every whisk, slip of every touching frame; NaN where nothing was seen."""
    session, errors = load_session(session_path), {name: [] for name in UNITS}
    calibration = calibrate_session(session, out)
    for trial in session.trials:
        truth = tomllib.loads((trial.folder / "truth.toml").read_text())
        inputs = TrialInputs(session, trial, read_signals(trial), calibration, Settings())
        (seen,) = see_trial(inputs).whisks
        errors["d_x"].append(seen.d_x_mm.value - truth["d_x_mm"])
        errors["beta"].append(math.degrees(seen.beta_rad.value) - truth["beta_deg"])
        errors["slip"].extend(_slip_errors(seen.frames, trial.folder / "truth.csv"))
    return {name: [float(e) for e in values] for name, values in errors.items()}


def _slip_errors(frames, path):
    with path.open(encoding="utf-8") as file:
        true = {int(row["frame"]): row for row in csv.DictReader(file)}
    if frames is not None:
        for frame, touching, slip_mm in zip(frames.index, frames.touching, frames.slip_mm.value):
            if touching and true[int(frame)]["contact"] == "1":
                yield slip_mm - float(true[int(frame)]["slip_mm"])


def evaluated_once(
    kept: Path, mark: str, session_in: Callable[[Path], Path]
) -> dict[str, list[float]]:
    """Errors of the session that `session_in` makes in a folder or finds, unless they were kept with this mark."""
    if kept.exists() and (found := json.loads(kept.read_text()))["mark"] == mark:
        return found["errors"]
    with TemporaryDirectory() as folder:
        session = session_in(Path(folder))
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
        lines.append(
            f"{name:<6}{unit:<5}{recorded:9.4f}{twin:10.4f}{twin / recorded:8.2f}   {low:.4f} to {high:.4f}"
        )
    missing = sum(np.isnan(t["d_x"]).sum() for t in twins)
    lines.append(
        f"whisks of the twin without truth: {missing} of {sum(len(t['d_x']) for t in twins)}"
    )
    return "\n".join(lines)


def _twin(folder: Path, seed: int) -> Path:
    return simulate(folder / "session", protocol=TWIN, seed=seed)


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
