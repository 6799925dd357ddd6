"""Trials evaluated by workers; where a worker died again and again, a status says so.

A result that stands for a lost trial has no hash, so that the same command tries the trial again.
"""

from collections.abc import Sequence

from bench.base.input_problems import InputProblems
from bench.base.results import read_result, write_result
from bench.base.statuses import reason
from bench.base.workers import MOST_DEATHS, Workers
from bench.records.plain import from_plain, to_plain
from bench.records.trial_result import FeltTrial, FeltWhisk, SeenTrial, TrialResult
from bench.session.signals import forward_strokes, read_signals
from bench.trials.seen import unseen
from bench.trials.trial_evaluation import evaluate_unit, see_unit, trial_facts, whisker_facts
from bench.trials.unit import Unit

LOST = reason("trial_lost", deaths=MOST_DEATHS)


def see_units(
    units: Sequence[Unit], pool: Workers, name: str, problems: InputProblems
) -> list[SeenTrial]:
    """Return the seen half of every unit, and note those whose process died.

    name: of the step.
    """
    trials = pool.run(see_unit, units, name, lost=_lost_seen)
    for unit, seen in zip(units, trials):
        line = LOST.about(f"{unit.trial.name}, among the {name}")
        if seen.notes == (LOST,) and line not in problems.warnings:
            problems.warn(line)
    return trials


def evaluate_units(units: Sequence[Unit], pool: Workers) -> list[TrialResult]:
    """Return every unit's result, evaluated where it does not stand in its file already."""
    pool.run(evaluate_unit, units, "trials", lost=_write_lost)
    return [from_plain(TrialResult, read_result(unit.path)) for unit in units]


def _lost_seen(unit: Unit) -> SeenTrial:
    """Return a trial whose whisks have no truth."""
    count = len(forward_strokes(read_signals(unit.trial)))
    return SeenTrial(unseen(count, LOST).whisks, (LOST,))


def _write_lost(unit: Unit) -> None:
    """Write a result whose whisks have neither truth nor estimates."""
    count = len(forward_strokes(read_signals(unit.trial)))
    felt = FeltTrial(tuple(FeltWhisk(number, status=LOST) for number in range(count)))
    facts = trial_facts(unit)
    whisker = whisker_facts(unit)
    result = TrialResult(facts, whisker, unit.settings.theta_deg, unseen(count, LOST), felt)
    write_result(unit.path, to_plain(result))
