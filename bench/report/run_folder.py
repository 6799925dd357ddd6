"""An evaluated run, read from its folder: run.json, and the results of its trials."""

import csv
from pathlib import Path

from bench.analyses.analysis import EvaluatedRun
from bench.base.errors import BadInput
from bench.base.results import read_result
from bench.records.plain import from_plain
from bench.records.record_file import AGAIN
from bench.records.trial_result import TrialResult
from bench.report.evaluation import evaluated_run
from bench.report.record import RECORD, read_record
from bench.report.run_facts import RunRecord

_TABLE = "whisks.csv"


def read_run(out: Path) -> tuple[RunRecord, EvaluatedRun]:
    """Read what run.json says of a run, and the run by its trials' results. Raises BadInput as `read_results`."""
    record = read_record(out)
    return record, evaluated_run(read_results(out), record.whisker, record.settings)


def read_results(out: Path) -> list[TrialResult]:
    """Read the results of a run's trials, in the order of its whisks.csv.

    Raises BadInput where it is no finished run, or another one was stopped half-way in the same
    folder.
    """
    if not (out / _TABLE).is_file():
        none = f"is no evaluated run (there is no {_TABLE} in it); give the OUT of `evaluate`"
        raise BadInput(none, file=out)
    results = [_result(out, trial) for trial in _trials(out / _TABLE)]
    if not results:
        raise BadInput(f"holds no whisk ({_TABLE} has no rows)", file=out)
    recorded = (read_result(out / RECORD) or {}).get("results", {})
    for result in results:
        trial = result.trial.name
        if result.hash != recorded.get(trial, result.hash):
            later = f"trials/{trial}.json is of a later run, which was not finished"
            raise BadInput(f"{later}; {AGAIN}", file=out)
    return results


def _trials(table: Path) -> list[str | None]:
    """Return the names in the column `trial`, each once. Raise BadInput where the file is damaged."""
    try:
        with table.open(newline="", encoding="utf-8") as file:
            return list(dict.fromkeys(row.get("trial") for row in csv.DictReader(file)))
    except (UnicodeDecodeError, csv.Error) as problem:
        raise BadInput(f"is damaged ({problem}); {AGAIN}", file=table) from None


def _result(out: Path, trial: str | None) -> TrialResult:
    """Read the result of a trial. Raise BadInput where it is not there, damaged or too old."""
    name = f"trials/{trial}.json"
    values = read_result(out / name)
    if not values:
        raise BadInput(f"{name} is not there or damaged; {AGAIN}", file=out)
    try:
        return from_plain(TrialResult, values)
    except ValueError:
        raise BadInput(f"{name} is of an older version; {AGAIN}", file=out) from None
