"""How the page names whisks and writes values."""

from collections.abc import Iterable
from dataclasses import dataclass

from bench.base.numbers import MISSING, number, with_sigma
from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult, whisks
from vision import Value

__all__ = [
    "MISSING",
    "WhiskRow",
    "by_whisk",
    "distance_text",
    "number",
    "rows_of",
    "value_text",
    "with_sigma",
]


@dataclass(frozen=True, eq=False)
class WhiskRow:
    """One whisk of the page: its key, unique in the page, and its result, seen and felt."""

    key: str
    result: TrialResult
    seen: SeenWhisk
    felt: FeltWhisk

    @property
    def trial(self) -> str:
        """Return the name of its trial."""
        return self.result.trial.name

    @property
    def name(self) -> str:
        """Return the trial, and the whisk's number where it is not the first."""
        return whisk_name(self.trial, self.seen.whisk)


def whisk_name(trial: str, number: int) -> str:
    """Return the trial, and the whisk's number where it is not the first."""
    return f"{trial}, whisk {number}" if number else trial


def rows_of(results: Iterable[TrialResult]) -> list[WhiskRow]:
    """Return all whisks in their order."""
    rows = []
    for number_of, (result, seen, felt) in enumerate(whisks(results)):
        rows.append(WhiskRow(f"w{number_of}", result, seen, felt))
    return rows


def by_whisk(rows: Iterable[WhiskRow]) -> dict[tuple[str, int], WhiskRow]:
    """Return the rows by trial and number of the whisk."""
    return {(row.trial, row.seen.whisk): row for row in rows}


def distance_text(seen: SeenWhisk) -> str:
    """Return d_x with the part of its sigma that is the whisk's own, and that which all share."""
    own_mm = seen.d_x_own_sigma_mm
    if not own_mm > 0.0:
        return value_text(seen.d_x_mm)
    text = with_sigma(float(seen.d_x_mm.value), own_mm)
    decimals = len(text.rpartition(".")[2])
    return f"{text} ± {number(seen.d_x_shared_sigma_mm, decimals)}"


def value_text(value: Value, *, sign: bool = False) -> str:
    """Return a value with its sigma."""
    return with_sigma(float(value.value), float(value.sigma), sign=sign)
