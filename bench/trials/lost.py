"""Trials whose process died again and again: their status says so, and the others go on.

What is written of them has no hash, so that the same command tries them again.
"""

from collections.abc import Sequence

from bench.base.doubts import Doubts
from bench.base.results import read_result, write_result
from bench.base.statuses import reason
from bench.base.workers import MOST_DEATHS, Workers
from bench.records.plain import from_plain, to_plain
from bench.records.trial_result import FeltTrial, FeltWhisk, SeenTrial, TrialResult
from bench.session.signals import forward_strokes, read_signals
from bench.trials.seen import unseen
from bench.trials.unit import Unit, described, evaluate_unit, see_unit

LOST = reason("trial_lost", deaths=MOST_DEATHS)


def seen_units(units: Sequence[Unit], pool: Workers, name: str, doubts: Doubts) -> list[SeenTrial]:
    """The seen half of every unit; a doubt for each whose process died. name: of the step."""
    seen = pool.run(see_unit, units, name, lost=_seen_lost)
    for unit, one in zip(units, seen):
        line = LOST.about(f"{unit.trial.name}, among the {name}")
        if one.notes == (LOST,) and line not in doubts.notes:
            doubts.note(line)
    return seen


def evaluated(units: Sequence[Unit], pool: Workers) -> list[TrialResult]:
    """Every unit's result, made where it does not stand in its file already."""
    pool.run(evaluate_unit, units, "trials", lost=_write_lost)
    return [from_plain(TrialResult, read_result(unit.path)) for unit in units]


def _strokes(unit: Unit) -> int:
    return len(forward_strokes(read_signals(unit.trial)))


def _seen_lost(unit: Unit) -> SeenTrial:
    """Whisks without a truth, before gauges are known."""
    return SeenTrial(unseen(_strokes(unit), LOST).whisks, (LOST,))


def _write_lost(unit: Unit) -> None:
    """Whisks with neither truth nor estimates."""
    felt = FeltTrial(tuple(FeltWhisk(number, status=LOST) for number in range(_strokes(unit))))
    lost = TrialResult(*described(unit), unseen(len(felt.whisks), LOST), felt)
    write_result(unit.path, to_plain(lost))
