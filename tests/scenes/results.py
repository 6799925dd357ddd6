"""Results of trials: built from what a test needs of them, and read as a person's own script would."""

import csv
import json
from collections.abc import Iterable
from pathlib import Path

from bench.records.trial_result import (
    FeltTrial,
    FeltWhisk,
    SeenTrial,
    SeenWhisk,
    TrialFacts,
    TrialResult,
    WhiskerFacts,
)
from vision.geometry.reasons import NO_REASON, Reason
from vision.truth.records import WhiskTruth

WHISKER_FACTS = WhiskerFacts("cylinder", 100.0, 1.0, 2945.2)


def seen_whisk(number: int = 0, status: Reason = NO_REASON, **truth) -> SeenWhisk:
    """Return a whisk as seen. truth: fields of `WhiskTruth`; without any there is no truth."""
    return SeenWhisk(WhiskTruth(number, **truth), status)


def trial_result(
    seen: SeenTrial | Iterable[SeenWhisk] = (),
    felt: FeltTrial | Iterable[FeltWhisk] = (),
    *,
    name: str = "t",
    surface: str = "steel",
) -> TrialResult:
    """Return the result of a measured trial of the paper's whisker, at 10°/s and θ = 3°.

    Of a half that is not given there is one whisk for each of the other's, of which nothing is known.
    """
    seen_trial = seen if isinstance(seen, SeenTrial) else SeenTrial(tuple(seen))
    felt_trial = felt if isinstance(felt, FeltTrial) else FeltTrial(tuple(felt))
    count = max(len(seen_trial.whisks), len(felt_trial.whisks))
    if not seen_trial.whisks:
        seen_trial = SeenTrial(tuple(seen_whisk(number) for number in range(count)))
    if not felt_trial.whisks:
        felt_trial = FeltTrial(tuple(FeltWhisk(number) for number in range(count)))
    facts = TrialFacts(name, "measure", surface, 10.0)
    return TrialResult(facts, WHISKER_FACTS, 3.0, seen_trial, felt_trial)


def table(path: Path) -> list[dict[str, str]]:
    """Return the rows of a CSV file, each by the names of its columns."""
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def codes(out: Path, trial: str) -> set[str]:
    """Return the codes of all statuses of a trial's whisks, seen and felt, from a run's records."""
    record = json.loads((out / "trials" / f"{trial}.json").read_text())
    whisks = [*record["seen"]["whisks"], *record["felt"]["whisks"]]
    return {code for whisk in whisks for code, _ in whisk["status_codes"]}
