"""A stage's place that is off, in sessions without pictures: how small an error is named, and is any right one?

    python tests/studies/accuracy/stage_off.py FOLDER --seeds 3

Each session is simulated, with the errors that a stage's sigmas say: 21 whisks on slopes of 0 to 60°, 43 to 88 mm
away. Printed of all: whisks that are warned of as they are; then, along x and z, of each size, how many places are
named where only one is off, in how many sessions the origin is. A whisk that no longer touches counts as named; one on
a slope of 0° is the same bar wherever it is along z, and is left out there.
"""

import argparse
import math
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.settings import Settings
from bench.records.trial_result import TrialResult
from bench.report.run_folder import read_results
from bench.session.session import Session, load_session
from bench.session.signals import Signals, read_signals
from bench.trials.seen import NO_PICTURES, unseen
from bench.trials.stage_against_felt import with_stage_against_felt
from bench.trials.stated_truth import by_stage
from bench.workflows.session_evaluation import evaluate
from fixtures.bring_stage import bring_stage

DISTANCES_MM = [45.0, 60.0, 75.0, 85.0]
OFF_MM = (2.0, 1.0, 0.5)
LEAST_SLOPE_DEG = 5.0
STEEP_DEG = 40.0
NOWHERE: Mapping[str, np.ndarray] = {}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    warned = total = 0
    counts: dict[tuple, list[bool]] = {}
    for seed in range(1, arguments.seeds + 1):
        evaluated = evaluate_session(arguments.folder, seed)
        total += len(evaluated.results)
        warned += len(named(evaluated))
        for key, is_named in of_session(evaluated):
            counts.setdefault(key, []).append(is_named)
    print(f"as they are: {warned} of {total} whisks are warned of")
    for (what, axis, off_mm), is_named in counts.items():
        print(f"{what} {off_mm:g} mm off along {axis}: named {sum(is_named)} of {len(is_named)}")


@dataclass(frozen=True)
class Evaluated:
    """A session, its results, and the signals of its trials by name."""

    session: Session
    results: list[TrialResult]
    signals: dict[str, Signals]


def evaluate_session(folder: Path, seed: int) -> Evaluated:
    """Simulate a session and evaluate it."""
    path = folder / f"session_{seed}"
    if not path.exists():
        bring_stage(path, seed, DISTANCES_MM)
    out = folder / f"out_{seed}"
    evaluate(path, out, Settings(figures=False), workers=0, announce=lambda text: None)
    session = load_session(path)
    signals = {trial.name: read_signals(trial) for trial in session.trials}
    return Evaluated(session, read_results(out), signals)


def of_session(evaluated: Evaluated) -> Iterator[tuple[tuple, bool]]:
    """Yield what is off, and whether it is named."""
    results = evaluated.results
    for axis, letter in ((0, "x"), (2, "z")):
        for off_mm in OFF_MM:
            off = off_mm * np.eye(3)[axis]
            for result in results:
                slope_deg = abs(math.degrees(result.seen.whisks[0].beta_rad.value))
                by_ruler = evaluated.session.trial(result.trial.name).stage is None
                if letter == "z" and (slope_deg < LEAST_SLOPE_DEG or by_ruler):
                    continue
                steepness = "steeper" if slope_deg > STEEP_DEG else "up to 40°"
                names = named(evaluated, {result.trial.name: off})
                yield (
                    (f"one place, slopes {steepness},", letter, off_mm),
                    names == {result.trial.name},
                )
            everywhere = {result.trial.name: off for result in results}
            yield (
                ("origin", letter, off_mm),
                len(named(evaluated, everywhere)) == len(results),
            )


def named(evaluated: Evaluated, off: Mapping[str, np.ndarray] = NOWHERE) -> set[str]:
    """Return the trials that are warned of, or without a truth, where places (3,), mm, are off."""
    moved = [
        restated(evaluated, one, off[one.trial.name]) if one.trial.name in off else one
        for one in evaluated.results
    ]
    compared = with_stage_against_felt(moved, evaluated.session.whisker)
    whisks = {one.trial.name: one.seen.whisks[0] for one in compared}
    return {name for name, whisk in whisks.items() if whisk.contradicted or not whisk.has_truth}


def restated(evaluated: Evaluated, result: TrialResult, off_mm: np.ndarray) -> TrialResult:
    """Return a trial's result as by a stage that says a place off by so much."""
    session = evaluated.session
    trial = session.trial(result.trial.name)
    if trial.stage is None:
        trial = replace(trial, d_x_mm=trial.d_x_mm + off_mm[0])
    else:
        trial = replace(trial, stage=replace(trial.stage, place_mm=trial.stage.place_mm + off_mm))
    signals = evaluated.signals[trial.name]
    seen = by_stage(session, trial, signals, Settings(), unseen(1, NO_PICTURES))
    return replace(result, seen=seen)


if __name__ == "__main__":
    main()
